"""Tuning on a simulated truck: the PID over many operating points, and load by load what goes beyond it.

Source: Fri & Fahlén (2017), sections 4.4.1 and 4.5.1, (4.4); section 6.3 asks for more than the PID.
Pressure feedback against the swing of a lowered load: Kjelland & Hansen (2013). Its phase has to make up for
the delay, so it follows from the truck, the load and the delay. A reference shaped to the swing's period:
Singer & Seering (1990). A predictor: Smith (1957).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from forklift import __version__, _core
from forklift.base.alone import alone_with
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.output import check_file
from forklift.control.closed_loop import (
    DELAY_TICKS,
    SIGNALS,
    TEMPERATURES_DEGC,
    TICK_S,
    Lowering,
    lower,
    requests,
)
from forklift.control.controller import Controller, Shaper, Swing
from forklift.control.metrics import WINDOW_S, plateaus
from forklift.control.presets import today
from forklift.control.search import Journal, Sought, minimised
from forklift.control.trial import SUBSTEPS, TRUCKS, Trial
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.channels import LIFTS, Lift

METHODS = ("adaptation", "shaped", "swing", "predictor")
"""Section 6.3's: learning of the feed-forward, a shaped reference, feedback of the pressure's swing, a Smith
predictor."""

SPACING = 9
"""The base-2 logarithm of the distance of the pressure's knots [steps]: 31 bar."""
KNOTS = 9
"""Up to 246 bar, beyond what 1500 kg weigh."""
LOADS_KG = (0.0, 400.0, 800.0, 1200.0, 1500.0, 1800.0)
DELAYS = (-1, 0, 1)
"""A tick less and more, while the feedback is set up."""
LEADS_DEG = tuple(range(-180, 180, 20))
GAINS = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0)
GAIN_COST = 3e-4
"""What a mm/s per bar counts as swing [m/s]. Chosen: where nothing swings nothing is fed back."""
DAMPING = 0.35
"""Of the resonator. Chosen: half an octave either way, so that a load wrong by a fifth stays in its band."""
LIMIT_MM_S = 60.0
"""Largest correction: a tenth of the full speed. Chosen."""
FREQUENCIES_HZ = (1.1, 6.0)
"""Where the swing of a load is looked for."""

CURVE_LOADS_KG = (400.0, 800.0, 1200.0, 1600.0)
"""Where the feedback's gain and lead, and the shaper's delay are searched."""
FIRST_IMPULSE = 0.54
"""The shaper's first impulse, 1 / (1 + K), K = exp(-pi zeta / sqrt(1 - zeta^2)) (Singer & Seering 1990, (8)),
of a damping of 0.05: between the 0.09 of a slow and the 0.01 of a fast lowering."""
GENERATIONS = {"free": 250, "main": 120}
CANDIDATES = 18


@dataclass(frozen=True)
class Progress:
    """How far a search is: which lift, how many generations of how many, and the least cost so far."""

    lift: Lift
    generation: int
    generations: int
    cost: float


NUMBERS: dict[Lift, dict[str, Sought]] = {
    "free": {
        "integral": Sought(0.8, 0.2, 0.2, 5.0),
        "proportional": Sought(0.06, 0.02, 0.0, 0.1),
        "derivative": Sought(0.001, 0.002, 0.0, 0.02),
        "overspeed": Sought(2.5, 1.0, 0.0, 12.0),
        "overspeed_from": Sought(586.0, 2.0, 585.0, 620.0),
    },
    "main": {
        "integral": Sought(1.9, 0.2, 1.0, 4.0),
        "proportional": Sought(0.005, 0.005, 0.0, 0.1),
        "derivative": Sought(0.004, 0.001, 0.0, 0.02),
    },
}
"""Beside the greatest order of (4.7), which starts from the controller's. All chosen, after first searches.
More proportional part than a tenth kicks at every count of the encoder, which is 98 mm/s for a tick. The free
lift's `overspeed_from` is so near to the highest request that this is not missed by a hundredth; the main
lift does not overshoot it."""
U_MAX_MM_S = (10.0, 30.0)
"""Width, and how far either way."""
OF_METHOD: dict[str, dict[Lift, dict[str, Sought]]] = {
    "adaptation": {
        "free": {"adaptation_s": Sought(0.03, 0.01, 0.02, 0.5)},
        "main": {"adaptation_s": Sought(0.45, 0.1, 0.2, 20.0)},
    },
    "shaped": {lift: {"early_corner": Sought(20.0, 4.0, 2.0, 25.0)} for lift in LIFTS},
    "swing": {lift: {} for lift in LIFTS},
    "predictor": {
        "free": {"prediction": Sought(0.9, 0.2, 0.0, 1.0)},
        "main": {"prediction": Sought(0.1, 0.1, 0.0, 1.0)},
    },
}
GAIN, LEAD, DELAY = (0.5, 0.0, 8.0), (15.0, -360.0, 360.0), (0.02, 0.0, 0.4)
"""Width and bounds of the feedback's gain [mm/s per bar] and lead [degrees], of the shaper's delay [s]."""


def tune(
    controller: Controller,
    truck: Truck | str | Path,
    *,
    methods: Sequence[str] = METHODS,
    delays_ticks: dict[Lift, int] | None = None,
    seed: int = 1,
    transition: bool = True,
    start: Controller | None = None,
    kept: Path | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Controller:
    """The controller with both lifts' gains and what `methods` adds, tuned on a truck and others of its make.

    Parameters
    ----------
    controller
        What it is measured against, and whose settings stay where none of `methods` acts.
    truck
        Whose make the trucks of the trial are scattered about; a name or a path will do.
    methods
        Some of `METHODS`.
    delays_ticks
        From sensors to valve; `DELAY_TICKS` if None.
    seed
        Of the sensors' noise, of the search and of the scattered trucks; at least 0.
    transition
        Whether the transition between the lifts has to be smoother than with the controller in use. If not,
        the lifts swing less.
    start
        Whose numbers, feedback and shaper the search begins with; None sets the feedback up load by load,
        and takes `NUMBERS`. What is tuned is measured against `controller`, wherever it began.
    kept
        A file for the costs of every generation: after a stop the same call goes on with it, and after the
        end it gives the same at once. None keeps nothing.
    progress
        Is told after every generation how far the search is.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for an unknown method; ``"not-writable"`` and ``"folder-in-use"`` for `kept`;
        as `forklift.control.closed_loop.lower`.
    """
    truck = truck_of(truck)
    for method in methods:
        if method not in METHODS:
            raise ForkliftError(
                "argument-invalid", f"{method} is no method; there are {', '.join(METHODS)}", name="methods"
            )
    given = {**DELAY_TICKS, **(delays_ticks or {})}
    made_of = (
        f"{__version__} {controller.hash} {truck.sha256} {list(methods)} {dict(given)} {seed} {transition}"
        f"{'' if start is None else f' {start.hash}'}"
    )
    with alone_with(check_file(kept)) if kept is not None else nullcontext():
        journal = Journal(kept, made_of)
        for lift in LIFTS:
            controller = _search(
                controller, truck, lift, methods, given[lift], seed, transition, start, journal, progress
            )
    return controller


def _search(
    before: Controller,
    truck: Truck,
    lift: Lift,
    methods: Sequence[str],
    delay: int,
    seed: int,
    transition: bool,
    begun: Controller | None,
    journal: Journal,
    say: Callable[[Progress], None] | None,
) -> Controller:
    """The numbers of `NUMBERS`, and load by load those of the methods.

    They cost least in a `Trial` beside the controller one starts from and the one in use today. By evolution:
    encoder counts make the cost jump.
    """
    start = before
    own = None if begun is None else getattr(begun, lift)
    if "swing" in methods and own is not None and own.swing is not None:
        start = start.with_swing(lift, _at_our_knots(own.swing)).with_numbers(
            lift, "chosen: a tenth of full speed", swing_limit=LIMIT_MM_S
        )
    elif "swing" in methods:
        start = tune_swing(start, truck, lift, delay_ticks=delay, seed=seed)
    swing = getattr(start, lift).swing
    numbers = getattr(start, lift).numbers
    u_max = numbers["u_max"].value
    sought = {
        "integral": NUMBERS[lift]["integral"],
        "u_max": Sought(u_max, U_MAX_MM_S[0], u_max - U_MAX_MM_S[1], u_max + U_MAX_MM_S[1]),
        **NUMBERS[lift],
    }
    for method in methods:
        sought |= OF_METHOD[method][lift]
    if own is not None:
        sought = {name: replace(one, start=own.numbers[name].value) for name, one in sought.items()}
    names = list(sought)
    places = [_swing(before, truck, lift, load, delay, seed) for load in CURVE_LOADS_KG]
    pressures = [pressure for pressure, _ in places]
    knots = _pressures(SPACING, KNOTS)
    parts = {"numbers": [*sought.values()]}
    if "shaped" in methods:
        delays = [0.5 / frequency for _, frequency in places]
        if own is not None and own.shaper is not None:
            delays = list(
                np.interp(
                    pressures, _pressures(own.shaper.spacing, len(own.shaper.delay_s)), own.shaper.delay_s
                )
            )
        parts["delay"] = [Sought(float(x), *DELAY) for x in delays]
    if "swing" in methods:
        gains, leads = (
            np.interp(pressures, _pressures(swing.spacing, len(part)), part)
            for part in (swing.gain_mm_s_per_bar, swing.lead_deg)
        )
        parts["gain"] = [Sought(float(x), *GAIN) for x in gains]
        parts["lead"] = [Sought(float(x), *LEAD) for x in leads]
    source = (
        f"forklift control tune {before.name}: truck {truck.name} (sha256 {truck.sha256[:12]}) and {TRUCKS} "
        f"like it, {', '.join(methods) or 'no method'}, delay {delay} ticks, seed {seed}"
        f"{'' if begun is None else f', from {begun.name} ({begun.hash})'}"
        f"{'' if transition else ', without the transition'}"
    )

    def made(values: Floats) -> Controller:
        pieces = np.split(values, np.cumsum([len(part) for part in parts.values()])[:-1])
        own = dict(zip(parts, pieces, strict=True))
        found = start.with_numbers(
            lift, source, **{n: float(f"{x:.4g}") for n, x in zip(names, own["numbers"], strict=True)}
        )
        if "delay" in own:
            delays = np.interp(knots, pressures, own["delay"])
            shaper = Shaper(
                spacing=SPACING,
                delay_s=[round(float(x), 4) for x in delays],
                share=[FIRST_IMPULSE] * KNOTS,
                source=source,
            )
            found = found.with_shaper(lift, shaper)
        if "gain" in own:
            curve = {
                "gain_mm_s_per_bar": [round(float(x), 2) for x in np.interp(knots, pressures, own["gain"])],
                "lead_deg": [round(float(x), 1) for x in np.interp(knots, pressures, own["lead"])],
                "source": source,
            }
            found = found.with_swing(lift, swing.model_copy(update=curve))
        return found

    every = [one for part in parts.values() for one in part]
    trial = Trial(truck, lift, delay, seed, [before, today(truck)], transition)

    def told(generation: int, cost: float) -> None:
        if say:
            say(Progress(lift, generation, GENERATIONS[lift], cost))

    best = minimised(
        lambda tried: trial.cost([made(one) for one in tried]),
        every,
        generations=GENERATIONS[lift],
        candidates=CANDIDATES,
        seed=len(LIFTS) * seed + LIFTS.index(lift),
        journal=journal,
        say=told,
    )
    return made(best)


def _pressures(spacing: int, count: int) -> Floats:
    """A table's knots [Pa]."""
    found: Floats = np.arange(count, dtype=np.float64) * float(1 << spacing) * _core.PRESSURE_STEP_PA
    return found


def _at_our_knots(swing: Swing) -> Swing:
    """The same feedback at the knots of a search."""
    knots = _pressures(SPACING, KNOTS)
    own = _pressures(swing.spacing, len(swing.lead_deg))
    columns = {
        name: [float(x) for x in np.interp(knots, own, getattr(swing, name))]
        for name in ("frequency_hz", "damping", "gain_mm_s_per_bar", "lead_deg")
    }
    return swing.model_copy(update={"spacing": SPACING, **columns})


def tune_swing(
    controller: Controller,
    truck: Truck | str | Path,
    lift: Lift,
    *,
    delay_ticks: int | None = None,
    seed: int = 1,
) -> Controller:
    """The controller with a lift's pressure feedback set up: frequency, gain and lead at each mean pressure.

    Load by load: the frequency at which the pressure swings without feedback on a plateau, then the lead
    and the gain with which the least swing is left over, the worst of three oil temperatures, of two
    reference signals and of delays a tick shorter and longer. What lies between and beyond the loads'
    pressures is interpolated and held.

    Parameters
    ----------
    truck
        Whose lift swings; a name or a path will do.
    lift
        Which.
    delay_ticks
        From sensors to valve; `DELAY_TICKS` of the lift if None.
    seed
        Of the sensors' noise.

    Raises
    ------
    ForkliftError
        As `forklift.control.closed_loop.lower`.
    """
    truck = truck_of(truck)
    if delay_ticks is None:
        delay_ticks = DELAY_TICKS[lift]
    controller = controller.with_swing(lift, None)
    found = []
    for load in LOADS_KG:
        pressure, frequency = _swing(controller, truck, lift, load, delay_ticks, seed)
        choices = [(gain, float(lead)) for gain in GAINS for lead in LEADS_DEG]
        left = _left_over(controller, truck, lift, load, delay_ticks, seed, frequency, choices)
        # Of two that damp alike the one that acts less.
        gain, lead = choices[
            int(np.argmin([x + GAIN_COST * gain for x, (gain, _) in zip(left, choices, strict=True)]))
        ]
        found.append((pressure, frequency, gain, lead))
    pressures, frequencies, gains, leads = (np.array(column) for column in zip(*found, strict=True))
    knots = _pressures(SPACING, KNOTS)
    unwrapped = np.degrees(np.unwrap(np.radians(leads)))
    unwrapped -= 360.0 * round(float(unwrapped.mean()) / 360.0)
    columns = [np.interp(knots, pressures, values) for values in (frequencies, gains, unwrapped)]
    swing = Swing(
        spacing=SPACING,
        frequency_hz=[round(float(x), 3) for x in columns[0]],
        damping=[DAMPING] * KNOTS,
        gain_mm_s_per_bar=[round(float(x), 2) for x in columns[1]],
        lead_deg=[round(float(x), 1) for x in columns[2]],
        source=f"tuned on truck {truck.name} (sha256 {truck.sha256[:12]}), "
        f"delay {delay_ticks} ticks, seed {seed}",
    )
    return controller.with_swing(lift, swing).with_numbers(
        lift, "chosen: a tenth of full speed", swing_limit=LIMIT_MM_S
    )


def _swing(
    controller: Controller, truck: Truck, lift: Lift, load: float, delay: int, seed: int
) -> tuple[float, float]:
    """Mean pressure [Pa] on plateaus and the frequency [Hz] of the greatest swing about it."""
    request = requests(lift, 1)
    base = Lowering(truck, controller.only(lift), load, 40.0, request, delay_ticks=delay)
    run = lower([base], lifts=lift, seed=seed)
    window = round(1.5 * WINDOW_S / TICK_S)
    spectrum: Floats = np.zeros(1)
    means = []
    size = 4096
    frequency = np.fft.rfftfreq(size, TICK_S)
    for plateau in plateaus(request, run.speed_m_s[lift][0], TICK_S):
        part = run.pressure_pa[lift][0, plateau.stop - window : plateau.stop]
        means.append(part.mean())
        # What drifts over the window would outweigh what swings in it.
        time = np.linspace(-1.0, 1.0, len(part))
        part = part - np.polynomial.Polynomial.fit(time, part, 3)(time)
        spectrum = spectrum + np.abs(np.fft.rfft(part * np.hanning(len(part)), size)) ** 2
    use = (frequency >= FREQUENCIES_HZ[0]) & (frequency <= FREQUENCIES_HZ[1])
    return float(np.mean(means)), float(frequency[use][np.argmax(spectrum[use])])


def _left_over(
    controller: Controller,
    truck: Truck,
    lift: Lift,
    load: float,
    delay: int,
    seed: int,
    frequency: float,
    choices: Sequence[tuple[float, float]],
) -> Floats:
    """(choices,) The worst swing of the speed [m/s] with each gain and lead."""
    tried = []
    for gain, lead in choices:
        swing = Swing(
            spacing=SPACING,
            frequency_hz=[frequency] * 2,
            damping=[DAMPING] * 2,
            gain_mm_s_per_bar=[gain] * 2,
            lead_deg=[lead] * 2,
            source="tried",
        )
        with_it = controller.with_swing(lift, swing).with_numbers(lift, "tried", swing_limit=LIMIT_MM_S)
        tried.append(with_it.only(lift))
    worst: Floats = np.zeros(len(choices))
    for signal in SIGNALS:
        request = requests(lift, signal)
        lowerings = [
            Lowering(truck, one, load, t, request, delay_ticks=max(0, delay + d))
            for one in tried
            for t in TEMPERATURES_DEGC
            for d in DELAYS
        ]
        run = lower(lowerings, lifts=lift, seed=seed, substeps=SUBSTEPS)
        swings = [
            max(p.oscillation_m_s for p in plateaus(request, speed, TICK_S)) for speed in run.speed_m_s[lift]
        ]
        found = np.nan_to_num(np.array(swings).reshape(len(choices), -1), nan=np.inf).max(axis=1)
        worst = np.maximum(worst, found)
    return worst

"""Tuning on a simulated truck: the PID's gains over many operating points, the feedback of the pressure's swing
load by load.

Source: Fri & Fahlén (2017), sections 4.4.1 and 4.5.1, (4.4); section 6.3 asks for more than the PID. Pressure
feedback against the swing of a lowered load: Kjelland & Hansen (2013). Its phase has to make up for the delay,
so it follows from the truck, the load and the delay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from forklift import _core
from forklift.base.arrays import Floats
from forklift.control.closed_loop import DELAY_TICKS, TICK_S, Lowering, lower, requests
from forklift.control.controller import Controller, Swing
from forklift.control.metrics import LIMIT_M_S, WINDOW_S, nrmse_percent, plateaus
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import LIFTS, Lift

SPACING = 9
"""The base-2 logarithm of the distance of the pressure's knots [steps]: 31 bar."""
KNOTS = 9
"""Up to 246 bar, beyond what 1500 kg weigh."""
LOADS_KG = (0.0, 400.0, 800.0, 1200.0, 1500.0, 1800.0)
TEMPERATURES_DEGC = (20.0, 60.0)
DELAYS = (-1, 0, 1)
"""What is tuned has to bear a tick more or less."""
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
SUBSTEPS = 4
"""Of a tick, while one searches."""

GAIN_LOADS_KG = (0.0, 800.0, 1500.0)
SIGNALS = (1, 2)
TOP = 4
"""The signal on which the speed must not stay above the limit."""
ROUNDS, CANDIDATES, KEPT = 16, 32, 5
"""Of the search over the gains: the first quarter of its rounds anywhere, the rest about the best few."""
SEARCHED = {
    "proportional": (-0.3, 0.6),
    "integral": (0.3, 5.0),
    "derivative": (-0.02, 0.05),
    "u_max": (600.0, 700.0),
}
"""The numbers that are searched, and where."""
SWING_FLOOR_M_S = 0.01
"""Less swing than a third of this is not asked for: a count of the encoder in a second."""
SWING_WEIGHT, OVERSPEED_WEIGHT = 500.0, 500.0
"""What a m/s of swing or of overspeed counts against a percent of NRMSE. Chosen: a hundredth of a m/s is five
percent."""


def tune(
    controller: Controller,
    truck: Truck,
    *,
    delays_ticks: dict[Lift, int] | None = None,
    rounds: int = 2,
    seed: int = 1,
) -> Controller:
    """The controller with both lifts' gains and pressure feedback tuned on a truck, in turn.

    Parameters
    ----------
    delays_ticks
        From sensors to valve; `DELAY_TICKS` if None.
    rounds
        How often both are tuned, each with the other as it then is.
    seed
        Of the sensors' noise and of the search.

    Raises
    ------
    ForkliftError
        As `forklift.control.closed_loop.lower`.
    """
    given = delays_ticks or DELAY_TICKS
    before = controller
    for _ in range(rounds):
        for lift in LIFTS:
            controller = tune_gains(
                controller, truck, lift, before=before, delay_ticks=given[lift], seed=seed
            )
            controller = tune_swing(controller, truck, lift, delay_ticks=given[lift], seed=seed)
    return controller


@dataclass(frozen=True, eq=False)
class _Scores:
    """Of controllers (rows) at operating points (columns)."""

    nrmse: Floats
    swing: Floats
    fastest: Floats


def tune_gains(
    controller: Controller,
    truck: Truck,
    lift: Lift,
    *,
    before: Controller | None = None,
    delay_ticks: int | None = None,
    seed: int = 1,
) -> Controller:
    """The controller with P, I, D of (4.12) and the greatest order of (4.7) searched for a lift.

    The most of the NRMSE over loads, temperatures, delays and two reference signals, less what it swings beyond
    a third of what it swings with the controller `before` (or of `SWING_FLOOR_M_S`), and less what a plateau at
    the highest speed stays above the limit. A seeded random search: the objective jumps, as encoder counts do.

    Raises
    ------
    ForkliftError
        As `forklift.control.closed_loop.lower`.
    """
    delay = DELAY_TICKS[lift] if delay_ticks is None else delay_ticks
    random = np.random.default_rng([seed, LIFTS.index(lift)])
    lower_end, upper_end = (np.array([ends[k] for ends in SEARCHED.values()]) for k in (0, 1))
    numbers = getattr(controller, lift).numbers
    found: list[tuple[float, Floats]] = []
    tried = [np.array([numbers[name].value for name in SEARCHED])]
    swings = _scores([before or controller], truck, lift, delay, seed).swing[0]
    allowed = np.maximum(swings, SWING_FLOOR_M_S) / 3.0
    for k in range(ROUNDS):
        scores = _scores([_given(controller, lift, one, "tried") for one in tried], truck, lift, delay, seed)
        swing = np.maximum(scores.swing - allowed, 0.0).mean(axis=1)
        over = np.maximum(scores.fastest - LIMIT_M_S, 0.0).max(axis=1)
        value = scores.nrmse.mean(axis=1) - SWING_WEIGHT * swing - OVERSPEED_WEIGHT * over
        found += zip(value.tolist(), tried, strict=True)
        found = sorted(found, key=lambda one: -one[0])[:KEPT]
        if 4 * k < ROUNDS:
            tried = list(random.uniform(lower_end, upper_end, (CANDIDATES, len(SEARCHED))))
        else:
            width = (0.1 if 2 * k < ROUNDS else 0.04) * (upper_end - lower_end)
            about = [found[j][1] for j in random.integers(0, len(found), CANDIDATES)]
            tried = [
                np.clip(one + width * random.standard_normal(len(one)), lower_end, upper_end) for one in about
            ]
    return _given(controller, lift, found[0][1], f"tuned on truck {truck.name} (sha256 {truck.sha256[:12]})")


def _given(controller: Controller, lift: Lift, values: Floats, source: str) -> Controller:
    rounded = {
        name: float(f"{value:.4g}") for name, value in zip(SEARCHED, values.tolist(), strict=True)
    }
    return controller.with_numbers(lift, source, **rounded)


def _scores(controllers: Sequence[Controller], truck: Truck, lift: Lift, delay: int, seed: int) -> _Scores:
    points = [(t, load, max(0, delay + d)) for t in TEMPERATURES_DEGC for load in GAIN_LOADS_KG for d in DELAYS]
    nrmse, swing, fastest = [], [], []
    for signal in (*SIGNALS, TOP):
        request = requests(lift, signal)
        lowerings = [
            Lowering(truck, controller.only(lift), load, t, request, delay_ticks=d, stream=k)
            for controller in controllers
            for k, (t, load, d) in enumerate(points)
        ]
        run = lower(lowerings, lifts=lift, seed=seed + signal, substeps=SUBSTEPS)
        pairs = list(zip(run.reference_m_s[lift], run.speed_m_s[lift], strict=True))
        ends = [plateaus(request, speed, TICK_S) for _, speed in pairs]
        if signal == TOP:
            fastest.append([max(p.mean_m_s for p in one) for one in ends])
        else:
            nrmse.append([nrmse_percent(reference, speed) for reference, speed in pairs])
            swing.append([max(p.oscillation_m_s for p in one) for one in ends])
    shape = (len(controllers), len(points))

    def table(columns: list[list[float]]) -> Floats:
        return np.nan_to_num(np.array(columns).reshape(len(columns), *shape), nan=np.inf)

    return _Scores(
        np.nan_to_num(table(nrmse), posinf=-1e3).mean(axis=0),
        np.nan_to_num(table(swing), posinf=1e3).max(axis=0),
        np.nan_to_num(table(fastest), posinf=1e3).max(axis=0),
    )


def tune_swing(
    controller: Controller,
    truck: Truck,
    lift: Lift,
    *,
    delay_ticks: int | None = None,
    seed: int = 1,
) -> Controller:
    """The controller with a lift's pressure feedback set up: frequency, gain and lead at each mean pressure.

    Load by load: the frequency at which the pressure swings without feedback on a plateau, then the lead
    and the gain with which the least swing is left over, the worst of two oil temperatures, of two reference
    signals and of delays a tick shorter and longer.
    What lies between and beyond the loads' pressures is interpolated and held.

    Raises
    ------
    ForkliftError
        As `forklift.control.closed_loop.lower`.
    """
    if delay_ticks is None:
        delay_ticks = DELAY_TICKS[lift]
    controller = controller.with_swing(lift, None)
    found = []
    for load in LOADS_KG:
        pressure, frequency = _swing(controller, truck, lift, load, delay_ticks, seed)
        choices = [(gain, float(lead)) for gain in GAINS for lead in LEADS_DEG]
        left = _left_over(controller, truck, lift, load, delay_ticks, seed, frequency, choices)
        # Of two that damp alike the one that acts less.
        gain, lead = choices[int(np.argmin([x + GAIN_COST * gain for x, (gain, _) in zip(left, choices, strict=True)]))]
        found.append((pressure, frequency, gain, lead))
    pressures, frequencies, gains, leads = (np.array(column) for column in zip(*found, strict=True))
    knots = np.arange(KNOTS) * float(1 << SPACING) * _core.PRESSURE_STEP_PA
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

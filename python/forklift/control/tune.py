"""Tuning on a simulated truck: the PID's gains over many operating points, the feedback of the pressure's
swing
load by load.

Source: Fri & Fahlén (2017), sections 4.4.1 and 4.5.1, (4.4); section 6.3 asks for more than the PID. Pressure
feedback against the swing of a lowered load: Kjelland & Hansen (2013). Its phase has to make up for the
delay,
so it follows from the truck, the load and the delay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from forklift import _core
from forklift.base.arrays import Floats
from forklift.control.closed_loop import DELAY_TICKS, TICK_S, Integers, Lowering, lower, requests
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
SUBSTEPS = 2
"""Of a tick, while one searches."""

NOMINAL_LOADS_KG = (0.0, 800.0, 1500.0)
FACTORS = (0.8, 1.2)
"""Of a load: the controller is not told it."""
TRUCKS = 4
"""Scattered ones beside the truck itself."""
SPREADS = {
    "viscosity.nu_0": 0.15,
    "viscosity.lambda": 0.1,
    "volume.V": 0.1,
    "mass.moving": 0.05,
    "bulk.a_1": 0.1,
    "bulk.a_2": 0.1,
    "friction.F_pr": 0.2,
    "friction.c_v": 0.2,
    "friction.f_cfr": 0.2,
    "valve.omega": 0.1,
    "valve.f_hs": 0.2,
    "valve.C_D": 0.03,
}
"""Standard deviations of the logarithm of a lift's parameters. Chosen: a truck of the same make, with another
oil and other seals."""
SIGNALS = (1, 2)
TOP = 4
"""The signal on which the speed must not stay above the limit."""
GENERATIONS, CANDIDATES, KEPT = 30, 20, 4
FACTOR_OF_INTEGRAL = (0.5, 1.5)
"""Of what it was. Chosen: a faster one follows better and swings more on other trucks of the make."""
NUMBERS = {"integral": 0.1, "derivative": 0.002, "u_max": 8.0}
"""The numbers that are searched, and how far at a time. (4.12)'s proportional part stays: it damps
nothing."""
DERIVATIVE_S = (0.0, 0.012)
U_MAX_MM_S = 30.0
"""Either way."""
CURVE_LOADS_KG = (400.0, 800.0, 1200.0, 1600.0)
"""Where the feedback's gain and lead are searched."""
GAIN_SEARCH, LEAD_SEARCH = (0.0, 8.0, 0.5), (-360.0, 360.0, 15.0)
SWING_FLOOR_M_S = 0.01
"""Less swing than a third of this is not asked for: a count of the encoder in a fifth of a second."""
ENOUGH_PERCENT = 1.0
WORST_WEIGHT, MEAN_WEIGHT, OVERSPEED_WEIGHT = 40.0, 20.0, 500.0
"""Against a percent of NRMSE, of which no more than `ENOUGH_PERCENT` counts: the worst swing of an
operating point and the mean one, each over that of the
controller one starts from, and a m/s of overspeed. Chosen."""


def scattered(truck: Truck, count: int, seed: int) -> list[Truck]:
    """Trucks of the same make: parameters drawn by `SPREADS`."""
    random = np.random.default_rng(seed)
    names = [f"{lift}.{name}" for lift in LIFTS for name in SPREADS]
    spreads = np.tile(list(SPREADS.values()), len(LIFTS))
    found = []
    for _ in range(count):
        factors = np.exp(spreads * random.standard_normal(len(names)))
        values = zip(names, factors.tolist(), strict=True)
        found.append(truck.with_values({name: truck.values[name] * factor for name, factor in values}))
    return found


def tune(
    controller: Controller,
    truck: Truck,
    *,
    delays_ticks: dict[Lift, int] | None = None,
    seed: int = 1,
) -> Controller:
    """The controller with both lifts' gains and pressure feedback tuned on a truck and others of its make.

    Parameters
    ----------
    delays_ticks
        From sensors to valve; `DELAY_TICKS` if None.
    seed
        Of the sensors' noise, of the search and of the scattered trucks.

    Raises
    ------
    ForkliftError
        As `forklift.control.closed_loop.lower`.
    """
    given = delays_ticks or DELAY_TICKS
    for lift in LIFTS:
        first = tune_swing(controller, truck, lift, delay_ticks=given[lift], seed=seed)
        controller = _search(first, controller, truck, lift, given[lift], seed)
    return controller


def _search(
    start: Controller, before: Controller, truck: Truck, lift: Lift, delay: int, seed: int
) -> Controller:
    """I and D of (4.12), the greatest order of (4.7), and the gain and lead of the feedback over the load.

    What the NRMSE gains on the controller `before`, less the swing in terms of that controller's, less what a
    plateau at the highest speed stays above the limit; over trucks, loads, oil temperatures, delays and
    two reference signals. A
    seeded evolution (Schwefel 1981): the objective jumps, as encoder counts do.
    """
    random = np.random.default_rng([seed, LIFTS.index(lift)])
    trial = _Trial(truck, lift, delay, seed)
    numbers, swing = getattr(start, lift).numbers, getattr(start, lift).swing
    pressures = [_swing(before, truck, lift, load, delay, seed)[0] for load in CURVE_LOADS_KG]
    knots = np.arange(KNOTS) * float(1 << SPACING) * _core.PRESSURE_STEP_PA
    n = len(NUMBERS)
    was = {name: numbers[name].value for name in NUMBERS}
    ranges = {
        "integral": (FACTOR_OF_INTEGRAL[0] * was["integral"], FACTOR_OF_INTEGRAL[1] * was["integral"]),
        "derivative": DERIVATIVE_S,
        "u_max": (was["u_max"] - U_MAX_MM_S, was["u_max"] + U_MAX_MM_S),
    }
    own = [(*ranges[name], step) for name, step in NUMBERS.items()]
    searched = np.array([*own, *[GAIN_SEARCH] * len(pressures), *[LEAD_SEARCH] * len(pressures)])
    source = f"tuned on truck {truck.name} (sha256 {truck.sha256[:12]}) and {TRUCKS} like it, seed {seed}"

    def made(values: Floats) -> Controller:
        given = {name: float(f"{x:.4g}") for name, x in zip(NUMBERS, values[:n].tolist(), strict=True)}
        curves = [np.interp(knots, pressures, part) for part in np.split(values[n:], 2)]
        curve = swing.model_copy(
            update={
                "gain_mm_s_per_bar": [round(float(x), 2) for x in curves[0]],
                "lead_deg": [round(float(x), 1) for x in curves[1]],
                "source": f"{source}, delay {delay} ticks",
            }
        )
        return start.with_numbers(lift, source, **given).with_swing(lift, curve)

    first = [*was.values()]
    first += [
        np.interp(pressures, knots, swing.gain_mm_s_per_bar),
        np.interp(pressures, knots, swing.lead_deg),
    ]
    tried = [np.clip(np.hstack(first), searched[:, 0], searched[:, 1])]
    reference = trial.scores([before])
    found: list[tuple[float, Floats]] = []
    for k in range(GENERATIONS):
        values = trial.worth([made(one) for one in tried], reference)
        found += zip(values.tolist(), tried, strict=True)
        found = sorted(found, key=lambda one: -one[0])[:KEPT]
        width = searched[:, 2] * 0.95**k
        about = [found[j][1] for j in random.integers(0, len(found), CANDIDATES)]
        # A third of the values at a time.
        tried = [
            np.clip(
                one + width * random.standard_normal(len(one)) * (random.random(len(one)) < 1.0 / 3.0) * 2.0,
                searched[:, 0],
                searched[:, 1],
            )
            for one in about
        ]
    return made(found[0][1])


@dataclass(frozen=True, eq=False)
class _Scores:
    """Of controllers (first axis) at nominal points (second axis); swing has members beside (third axis)."""

    nrmse: Floats
    swing: Floats
    fastest: Floats


class _Trial:
    """What every candidate goes through."""

    def __init__(self, truck: Truck, lift: Lift, delay: int, seed: int) -> None:
        self.truck, self.lift, self.seed, self.delay = truck, lift, seed, delay
        self.trucks = [truck, *scattered(truck, TRUCKS, seed)]
        self.points = [(t, load) for t in TEMPERATURES_DEGC for load in NOMINAL_LOADS_KG]
        self.members = [
            (one, factor, max(0, delay + d)) for one in self.trucks for factor in FACTORS for d in (-1, 1)
        ]

    def scores(self, controllers: Sequence[Controller]) -> _Scores:
        shape = (len(controllers), len(self.points), len(self.members))
        nrmse, swing = [], []
        for signal in SIGNALS:
            speeds, references, request = self._lowered(controllers, signal, self.members)
            pairs = zip(references, speeds, strict=True)
            nrmse.append(np.reshape([nrmse_percent(*pair) for pair in pairs], shape))
            ends = [plateaus(request, speed, TICK_S) for speed in speeds]
            swing.append(np.reshape([max(p.oscillation_m_s for p in one) for one in ends], shape))
        few = [(one, 1.0, self.delay) for one in self.trucks]
        speeds, _, request = self._lowered(controllers, TOP, few)
        top = [max(p.mean_m_s for p in plateaus(request, speed, TICK_S)) for speed in speeds]
        return _Scores(
            np.nan_to_num(np.mean(nrmse, axis=0), nan=-1e3),
            np.nan_to_num(np.max(swing, axis=0), nan=1e3),
            np.nan_to_num(np.reshape(top, (*shape[:2], len(few))), nan=1e3),
        )

    def worth(self, controllers: Sequence[Controller], reference: _Scores) -> Floats:
        """(controllers,) The objective."""
        scores = self.scores(controllers)
        loaded = [k for k, (_, load) in enumerate(self.points) if load > 0.0]
        allowed = np.maximum(reference.swing, SWING_FLOOR_M_S)[0, loaded]
        ratio = scores.swing[:, loaded] / allowed
        worst = scores.swing[:, loaded].max(axis=2) / np.maximum(reference.swing, SWING_FLOOR_M_S)[
            0, loaded
        ].max(axis=1)
        over = np.maximum(scores.fastest - LIMIT_M_S, 0.0).max(axis=(1, 2))
        value: Floats = (
            np.minimum(scores.nrmse.mean(axis=2) - reference.nrmse.mean(axis=2), ENOUGH_PERCENT).mean(axis=1)
            - WORST_WEIGHT * np.maximum(worst - 0.3, 0.0).mean(axis=1)
            - MEAN_WEIGHT * ratio.mean(axis=(1, 2))
            - OVERSPEED_WEIGHT * over
        )
        return value

    def _lowered(
        self, controllers: Sequence[Controller], signal: int, members: Sequence[tuple[Truck, float, int]]
    ) -> tuple[Floats, Floats, Integers]:
        request = requests(self.lift, signal)
        lowerings = [
            Lowering(one, controller.only(self.lift), load * factor, t, request, delay_ticks=d, stream=k)
            for controller in controllers
            for t, load in self.points
            for k, (one, factor, d) in enumerate(members)
        ]
        run = lower(lowerings, lifts=self.lift, seed=self.seed + signal, substeps=SUBSTEPS)
        return run.speed_m_s[self.lift], run.reference_m_s[self.lift], request


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
        gain, lead = choices[
            int(np.argmin([x + GAIN_COST * gain for x, (gain, _) in zip(left, choices, strict=True)]))
        ]
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

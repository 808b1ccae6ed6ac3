"""The pressure feedback of a lift set up on a simulated truck, load by load.

Against the swing of a lowered load: Kjelland & Hansen (2013). Its phase has to make up for the delay, so it
follows from the truck, the load and the delay.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from forklift import _core
from forklift.base.arrays import Floats
from forklift.control.closed_loop import (
    DELAY_TICKS,
    SIGNALS,
    TEMPERATURES_DEGC,
    TICK_S,
    Lowering,
    lower,
    requests,
)
from forklift.control.controller import Controller, Swing
from forklift.control.metrics import WINDOW_S, plateaus
from forklift.control.trial import SUBSTEPS
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.channels import Lift

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
"""Largest correction."""
LIMIT_SOURCE = "chosen: a tenth of full speed"
FREQUENCIES_HZ = (1.1, 6.0)
"""Where the swing of a load is looked for."""


def pressures_of(spacing: int, count: int) -> Floats:
    """A table's knots [Pa], from the base-2 logarithm of their distance [steps] and their number."""
    found: Floats = np.arange(count, dtype=np.float64) * float(1 << spacing) * _core.PRESSURE_STEP_PA
    return found


def at_the_knots(swing: Swing) -> Swing:
    """The same feedback at the knots that are searched."""
    knots = pressures_of(SPACING, KNOTS)
    own = pressures_of(swing.spacing, len(swing.lead_deg))
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
        pressure, frequency = swing_of(controller, truck, lift, load, delay_ticks, seed)
        choices = [(gain, float(lead)) for gain in GAINS for lead in LEADS_DEG]
        left = _left_over(controller, truck, lift, load, delay_ticks, seed, frequency, choices)
        # Of two that damp alike the one that acts less.
        gain, lead = choices[
            int(np.argmin([x + GAIN_COST * gain for x, (gain, _) in zip(left, choices, strict=True)]))
        ]
        found.append((pressure, frequency, gain, lead))
    pressures, frequencies, gains, leads = (np.array(column) for column in zip(*found, strict=True))
    knots = pressures_of(SPACING, KNOTS)
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
    return controller.with_swing(lift, swing).with_numbers(lift, LIMIT_SOURCE, swing_limit=LIMIT_MM_S)


def swing_of(
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

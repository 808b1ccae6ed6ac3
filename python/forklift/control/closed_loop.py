"""Trucks lowered by a controller, as the ECU would: 50 Hz, sensors as integers, a delay to the valve.

Source: Fri & Fahlén (2017), sections 4.5.2, 4.6 and 5.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import polars as pl
from numpy.typing import NDArray

from forklift import _core
from forklift.base import arguments
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.control.controller import Controller
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import LIFTS, Lift

Integers = NDArray[np.int32]

TICK_S = _core.CONTROL_TICK_S
LOADS_KG = (0.0, 800.0, 1500.0)
TEMPERATURES_DEGC = (20.0, 40.0, 60.0)
"""Of tables 5.6 and 5.7."""
SIGNALS = (1, 2)
"""Of `requests`, those of the NRMSE and of the swing."""
STEADY, TOP = 3, 4
"""Those of the steady error and of the highest speed, which must not stay above the limit."""
DELAY_TICKS: dict[Lift, int] = {"free": 2, "main": 1}
"""From reading the sensors to the valve's coil [ticks]. The thesis's truck itself answers a step of current
by half after 118 ms (free lift) and 138 ms (main lift); with these the whole comes to the 160 ms of section
4.5.2 (`tests/test_control_room.py`)."""
MOST_MM_S = 2**31 - 1
"""Of a speed that is asked for: what is above the controller's `request_most` counts as that."""
START_M = (0.98, 1.96)
"""Cylinder positions at the start, free and main [m], as the reference trajectories have them."""


@dataclass(frozen=True)
class Lowering:
    """One lowering: truck, conditions, request and what its sensors are like.

    Attributes
    ----------
    truck, controller
        What is lowered, and by what.
    load_kg
        On the forks, 0 or more.
    oil_temperature_degc
        Of the oil, constant.
    request_mm_s
        (ticks,) Lowering speed of the forks asked for, downward positive.
    start_m
        Cylinder positions at the start, free and main, above the ends of their strokes.
    delay_ticks
        From reading the sensors to the current in the valve's coil.
    pressure_noise_pa, temperature_noise_k
        Standard deviations of the sensors' noise before rounding.
    encoder_zero_m
        Where within a count each encoder's zero lies.
    stream
        Names the noise's sequence; different streams are independent.
    """

    truck: Truck
    controller: Controller
    load_kg: float
    oil_temperature_degc: float
    request_mm_s: Integers
    start_m: tuple[float, float] = START_M
    delay_ticks: int = DELAY_TICKS["free"]
    pressure_noise_pa: float = 0.3e5
    temperature_noise_k: float = 0.1
    encoder_zero_m: tuple[float, float] = (0.0, 0.0)
    stream: int = 0

    def __post_init__(self) -> None:
        arguments.of_kind(Truck, truck=self.truck)
        arguments.whole("delay_ticks", self.delay_ticks)
        for name in ("pressure_noise_pa", "temperature_noise_k"):
            if not 0.0 <= (deviation := arguments.number(name, getattr(self, name))) < np.inf:
                raise ForkliftError(
                    "argument-invalid",
                    f"{name} is {deviation:g}; give a standard deviation, zero or more",
                    name=name,
                    value=deviation,
                    lower=0.0,
                )
        fastest = np.abs(np.asarray(self.request_mm_s, np.float64)).max(initial=0.0)
        if not fastest <= MOST_MM_S:
            raise ForkliftError(
                "argument-invalid",
                f"request_mm_s goes up to {fastest:g} mm/s; give speeds of no more than {MOST_MM_S} mm/s",
                name="request_mm_s",
                value=float(fastest),
                upper=MOST_MM_S,
            )


@dataclass(frozen=True, eq=False)
class Lowered:
    """What became of lowerings; arrays (lowerings, ticks).

    Attributes
    ----------
    time_s
        (ticks,).
    speed_m_s
        True speed of the forks by lift, downward positive.
    pressure_pa
        True cylinder pressures by lift.
    reference_m_s
        What the controller meant each lift to have, downward positive.
    current_ma
        What it ordered, before the delay.
    readings
        (lowerings, ticks, 5) What it read, if that was noted, else without ticks: encoder counts and
        pressures in steps, each of the free and the main lift, and the oil temperature in steps.
    """

    time_s: Floats
    speed_m_s: dict[str, Floats]
    pressure_pa: dict[str, Floats]
    reference_m_s: dict[str, Floats]
    current_ma: dict[str, Integers]
    readings: Integers


def lower(
    lowerings: Sequence[Lowering],
    *,
    lifts: Literal["both"] | Lift = "both",
    seed: int = 0,
    substeps: int = 8,
    floating: bool = False,
    noted: bool = False,
) -> Lowered:
    """Simulate lowerings side by side; a result depends neither on the others nor on the number of threads.

    Parameters
    ----------
    lowerings
        With requests of one length.
    lifts
        ``"both"``, or one that is simulated alone.
    seed
        Of the sensors' noise.
    substeps
        Of the plant's integrator in a tick of 20 ms.
    floating
        The controller in floating point instead of its integers: to measure what they cost.
    noted
        Whether what the controllers read is kept; they are then asked one by one.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``, ``"argument-shape"``, ``"interrupted"``.
    """
    arguments.whole("substeps", substeps)
    arguments.whole("seed", seed)
    lengths = {len(one.request_mm_s) for one in lowerings}
    if len(lengths) != 1 or 0 in lengths:
        raise ForkliftError(
            "argument-shape", "lowerings that run side by side need requests of one length above zero"
        )
    try:
        answer = _core.closed_loop(
            [one.truck.core for one in lowerings],
            [one.controller.core for one in lowerings],
            [one.load_kg for one in lowerings],
            [one.oil_temperature_degc for one in lowerings],
            [list(one.start_m) for one in lowerings],
            np.array([one.request_mm_s for one in lowerings], np.int32),
            [one.delay_ticks for one in lowerings],
            [[one.pressure_noise_pa, one.temperature_noise_k] for one in lowerings],
            [list(one.encoder_zero_m) for one in lowerings],
            [one.stream for one in lowerings],
            seed=seed,
            lifts=lifts,
            substeps=substeps,
            floating=floating,
            noted=noted,
        )
    except (TypeError, ValueError, OverflowError) as error:
        raise ForkliftError(
            "argument-invalid", f"a number of a lowering is of the wrong kind, shape or size: {error}"
        ) from None
    place = {name: k for k, name in enumerate(outputs())}
    values = answer["outputs"]
    names = LIFTS
    return Lowered(
        TICK_S * np.arange(values.shape[1], dtype=np.float64),
        {n: -FORKS_PER_SENSOR[n] * values[:, :, place[f"velocity_{n}_m_s"]] for n in names},
        {n: values[:, :, place[f"pressure_{n}_pa"]] for n in names},
        {n: 1e-3 * answer["reference"][:, :, k].astype(np.float64) for k, n in enumerate(names)},
        {n: answer["current"][:, :, k] for k, n in enumerate(names)},
        answer["readings"],
    )


def requests(lift: Lift, signal: int) -> Integers:
    """The test signals of a lift [mm/s], 1 to 4, each within the lift's stroke.

    The thesis shows two signals per lift, steps between plateaus up to 0.6 m/s, whose levels do not survive
    in the text; 1 and 2 are chosen: one through three levels, one from the highest speed down. 3 is one
    plateau that the integral part has time to settle on, 4 one at the highest speed, nearly as long as the
    stroke allows.
    """
    longer = {"free": 1.0, "main": 1.9}[lift]
    plateaus = {
        1: ((200, 2.2), (450, 2.0), (100, 2.0)),
        2: ((590, 2.6), (300, 1.3)),
        3: ((250, 6.0),),
        4: ((590, 3.0),),
    }[signal]
    parts = [np.zeros(50, np.int32)]
    parts += [np.full(round(longer * seconds / TICK_S), level, np.int32) for level, seconds in plateaus]
    return np.concatenate([*parts, np.zeros(75, np.int32)])


def trace(run: Lowered, place: int = 0) -> pl.DataFrame:
    """One of the lowerings, a row a tick."""
    columns: dict[str, Floats | Integers] = {"time_s": run.time_s}
    for lift in LIFTS:
        columns[f"reference_{lift}_m_s"] = run.reference_m_s[lift][place]
        columns[f"speed_{lift}_m_s"] = run.speed_m_s[lift][place]
        columns[f"current_{lift}_ma"] = run.current_ma[lift][place]
        columns[f"pressure_{lift}_pa"] = run.pressure_pa[lift][place]
    return pl.DataFrame(columns)

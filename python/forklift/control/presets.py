"""Controllers for a truck: the thesis's with Table 5.3, and the one in use today. Both with tables of that
truck.

Source: Fri & Fahlén (2017), Table 5.3, sections 4.3 to 4.6, 5.6.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from forklift.control.controller import Controller, Curve, LiftSettings, Number, speed_table
from forklift.plant.forklift.speed_table import TEMPERATURES_DEGC, TemperatureScaling, speed_to_current
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.channels import LIFTS, Lift

TABLE_5_3: Mapping[Lift, Mapping[str, float]] = {
    "free": {
        "proportional": 0.001201,
        "integral": 1.178,
        "derivative": 0.00084129,
        "a": -0.0030497,
        "b": 1.8571,
        "c": -0.3077,
        "d": -0.049189,
    },
    "main": {
        "proportional": 0.00010892,
        "integral": 2.1999,
        "derivative": 0.006814,
        "a": -0.0023468,
        "b": 1.6415,
        "c": -0.36625,
        "d": -0.36953,
    },
}
"""Gains and temperature scalings of the thesis, for mm/s and mA."""
OPEN_LOOP = {
    "proportional": 0.0,
    "integral": 0.0,
    "derivative": 0.0,
    "a": 0.0,
    "b": 1.0,
    "c": 0.0,
    "d": 0.0,
}
"""The table alone."""
THESIS_TABLE_DEGC = 12.0
"""The thesis does not say at which oil temperature its table holds. With one of this temperature (4.8) and
(4.9) with Table 5.3 leave the least of both lifts, of one alone at 11 and 12 (`scaling_error`, `python3
dev.py control table`)."""
TABLES_DEGC = range(41)
"""Among which that is looked for."""
TODAY_TABLE_DEGC = 40.0
"""The controller in use was tuned warm, and knows no temperature: the middle of the thesis's range is
taken."""

_CHOSEN = "chosen"
U_MAX: Mapping[Lift, Number] = {
    "free": Number(
        value=620.0,
        source="chosen: a twentieth above the greatest request. Without load the free lift takes seconds "
        "to its highest speed, and what the integral part gathers meanwhile would take it above 0.6 m/s, "
        "were it 640",
    ),
    "main": Number(value=700.0, source="chosen: the end of Figure 5.6a; a sixth above the greatest request"),
}
_STILL = {"adaptation_s": 0.0, "swing_limit": 0.0, "prediction": 0.0, "overspeed": 0.0}


def _shared() -> dict[str, Number]:
    return {
        "request_most": Number(
            value=590.0, source="section 1.1: never more than 0.6 m/s; less what a swing adds"
        ),
        "ramp_up": Number(value=600.0, source="chosen: a second to full speed; section 4.6 gives no slope"),
        "ramp_down": Number(value=900.0, source=_CHOSEN),
        "ramp_corner": Number(value=1.5, source=_CHOSEN),
        "temperature_least": Number(value=-20.0, source=_CHOSEN),
        "temperature_most": Number(value=90.0, source=_CHOSEN),
    }


def _lift(lift: Lift, table: Curve, gains: Mapping[str, float], source: str, ratio: Curve) -> LiftSettings:
    numbers = {name: Number(value=value, source=source) for name, value in gains.items()}
    numbers |= {
        "forks_per_count": Number(
            value={"free": 1.0, "main": 2.0}[lift], source="sections 2.1, 3.1.4: x_G = 2 x_ML + x_FL"
        ),
        "filter_rate": Number(value=20.0, source="Figure A.17: pole e^-0.4 at 50 Hz"),
        "delay": Number(value=8.0, source="section 4.5.2: 160 ms"),
        "u_min": Number(value=0.0, source=_CHOSEN),
        "u_max": U_MAX[lift],
        "i_min": Number(value=0.0, source="Figure A.16: the current is not negative"),
        "i_max": Number(value=1400.0, source="Figure 5.6: the end of the tables"),
    }
    numbers |= {name: Number(value=value, source="off") for name, value in _STILL.items()}
    numbers["early_corner"] = Number(value=1.5, source="that of ramp_corner: nothing is shaped")
    numbers["overspeed_from"] = Number(value=590.0, source="the greatest request")
    return LiftSettings(numbers=numbers, table=table, ratio=ratio)


FULL_FREE_COUNTS = 998
"""Encoder counts of the free lift where lowering begins: 1.96 m (`tests/test_control_room.py`)."""


TAIL = 0.1
"""Share of the speed with which the main lift comes to its end."""


def _early_ratios() -> dict[Lift, Curve]:
    """Over the forks' height [counts]: the free lift starts half a metre above the main lift's end and has
    all of the speed before it; the main lift slows to `TAIL` on its way there and creeps on to its end."""
    source = (
        "chosen on the thesis's truck (`forklift control compare`): the free lift starts earlier, 5.6.3, "
        "and the main "
        "lift meets its end slowly"
    )
    return {
        "free": Curve(first=FULL_FREE_COUNTS + 20, spacing=8, values=[1.0, 0.0], source=source),
        "main": Curve(first=FULL_FREE_COUNTS - 234, spacing=8, values=[0.0, TAIL, 1.0], source=source),
    }


def _common_ratios() -> dict[Lift, Curve]:
    """Both lifts change over together, within an eighth of a metre: (4.10), (4.11) with one R."""
    return {
        lift: Curve(
            first=FULL_FREE_COUNTS,
            spacing=6,
            values=[1.0, 0.0] if lift == "free" else [0.0, 1.0],
            source="chosen",
        )
        for lift in LIFTS
    }


def scaling_error(truck: Truck, lift: Lift, table_degc: float) -> float:
    """What Table 5.3's (4.8) and (4.9) leave over with a table of this oil temperature [m/s].

    The root mean square of the steady speed less the one asked for, of 50 to 550 mm/s, 0, 800 and 1500 kg,
    20 to 60 degC. No feedback.

    Raises
    ------
    ForkliftError
        ``"no-steady-state"``.
    """
    gains = TABLE_5_3[lift]
    scaling = TemperatureScaling(gains["a"], gains["b"], 1e-3 * gains["c"], 1e-3 * gains["d"])
    table = speed_to_current(truck, lift, oil_temperature_degc=table_degc)
    speeds, loads = 1e-3 * np.arange(50.0, 551.0, 50.0), np.array([0.0, 800.0, 1500.0])
    left = scaling.left_over(table, speeds, np.array(TEMPERATURES_DEGC), loads)
    return float(np.sqrt(np.mean(left**2)))


def _inverting(
    name: str,
    truck: Truck | str | Path,
    table_degc: float,
    gains: Mapping[Lift, Mapping[str, float]],
    source: str,
    ratios: Mapping[Lift, Curve],
) -> Controller:
    """A controller whose tables invert a truck's steady lowering at an oil temperature."""
    truck = truck_of(truck)
    free, main = (
        _lift(
            lift,
            speed_table(truck, lift, oil_temperature_degc=table_degc),
            gains[lift],
            source,
            ratios[lift],
        )
        for lift in LIFTS
    )
    return Controller(name, _shared(), free, main)


def thesis(truck: Truck | str | Path) -> Controller:
    """The thesis's controller: Table 5.3, a table of its own, a free lift that starts earlier (5.6.3).

    Parameters
    ----------
    truck
        Whose steady lowering at `THESIS_TABLE_DEGC` its tables invert; a name or a path will do.

    Raises
    ------
    ForkliftError
        ``"no-steady-state"`` for a truck of which no table can be made.
    """
    return _inverting("thesis", truck, THESIS_TABLE_DEGC, TABLE_5_3, "Table 5.3", _early_ratios())


def today(truck: Truck | str | Path) -> Controller:
    """The controller in use: tables tuned warm, no temperature, no feedback; both lifts change over together.

    Parameters
    ----------
    truck
        Whose steady lowering at `TODAY_TABLE_DEGC` its tables invert; a name or a path will do.

    Raises
    ------
    ForkliftError
        ``"no-steady-state"`` for a truck of which no table can be made.
    """
    gains: dict[Lift, Mapping[str, float]] = dict.fromkeys(LIFTS, OPEN_LOOP)
    return _inverting("today", truck, TODAY_TABLE_DEGC, gains, "section 5.6: open loop", _common_ratios())

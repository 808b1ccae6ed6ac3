"""A truck's CAN bus: a DBC and logs in it, written with python-can."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

DBC = """\
VERSION ""

NS_ :

BS_:

BU_: ECU IO

BO_ 256 ValveCommand: 8 ECU
 SG_ ValveCurrFL : 0|16@1+ (0.1,0) [0|3000] "mA" IO
 SG_ ValveCurrML : 16|16@1+ (0.1,0) [0|3000] "mA" IO

BO_ 2566844672 LiftSensors: 8 IO
 SG_ pA_FL : 0|16@1+ (0.01,0) [0|400] "bar" ECU
 SG_ xFL : 16|16@1+ (0.1,0) [0|5000] "mm" ECU

BO_ 512 Diagnostics: 8 IO
 SG_ Page M : 0|8@1+ (1,0) [0|255] "" ECU
 SG_ TOil m0 : 8|16@1+ (0.1,-40) [-40|400] "degF" ECU
 SG_ Supply m1 : 8|16@1+ (0.001,0) [0|60] "V" ECU
"""
"""Standard and 29-bit identifiers (2566844672 = 0x18FF1100 extended), and a multiplexed message."""

MAPPING = """\
name = "bus"
sample_rate_hz = 50.0
dbc = "truck.dbc"

[channels]
ValveCurrFL = "current_free_a"
ValveCurrML = "current_main_a"
pA_FL = "pressure_free_pa"
xFL = "position_free_m"
TOil = "oil_temperature_degc"

[[recording]]
file = "{file}"
lift = "free"
load_kg = 800.0
role = "estimate"
"""


SENSORS_LATE_S = 0.002
"""After the command."""


def frames(time: np.ndarray, columns: Mapping[str, np.ndarray], start: float = 1.7e9) -> list[Any]:
    """The frames of a run: commands and sensors 2 ms apart, the temperature every fifth time."""
    can = pytest.importorskip("can", reason="python-can (the extra can) is not installed")
    cantools = pytest.importorskip("cantools", reason="cantools (the extra can) is not installed")
    database = cantools.database.load_string(DBC, "dbc", strict=False)
    made = []

    def add(at: float, name: str, values: Mapping[str, float]) -> None:
        message = database.get_message_by_name(name)
        made.append(
            can.Message(
                timestamp=start + at,
                arbitration_id=message.frame_id,
                is_extended_id=message.is_extended_frame,
                data=message.encode(values, strict=False),
                channel=1,
            )
        )

    for k, t in enumerate(time):
        row = {name: float(values[k]) for name, values in columns.items()}
        add(t, "ValveCommand", {name: row[name] for name in ("ValveCurrFL", "ValveCurrML")})
        add(t + SENSORS_LATE_S, "LiftSensors", {name: row[name] for name in ("pA_FL", "xFL")})
        if k % 5 == 0:
            add(t + 0.003, "Diagnostics", {"Page": 0, "TOil": row["TOil"]})
        elif k % 5 == 1:
            add(t + 0.003, "Diagnostics", {"Page": 1, "Supply": 24.0})
    return made


def write(path: Path, made: Iterable[Any]) -> Path:
    """A log of the format that the suffix names."""
    can = pytest.importorskip("can", reason="python-can (the extra can) is not installed")
    with can.Logger(path) as log:
        for frame in made:
            log(frame)
    return path

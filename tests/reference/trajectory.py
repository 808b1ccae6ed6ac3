"""The twelve reference trajectories beside this file: names and reading. See README.md for their set-up."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent / "trajectories"
NAMES = tuple(sorted(path.stem for path in FOLDER.glob("*.csv")))


@dataclass(frozen=True)
class Trajectory:
    """One lowering at 50 Hz: its conditions and its columns, in the units their names carry."""

    lift: str
    load_kg: float
    temperature_degc: float
    time_s: np.ndarray
    command_a: np.ndarray
    valve_current_a: np.ndarray
    cylinder_position_m: np.ndarray
    cylinder_velocity_m_s: np.ndarray
    cylinder_pressure_pa: np.ndarray
    volume_pressure_pa: np.ndarray


def read(name: str, duration_s: float = np.inf) -> Trajectory:
    """Read LIFT_COMMAND_LOADkg_TEMPc up to `duration_s`; its conditions stand in its name."""
    lift, _, load, temperature = name.split("_")
    data = np.genfromtxt(FOLDER / f"{name}.csv", delimiter=",", names=True)
    data = data[data["time_s"] <= duration_s]
    columns = {column: data[column] for column in data.dtype.names}
    return Trajectory(lift, float(load[:-2]), float(temperature[:-1]), **columns)

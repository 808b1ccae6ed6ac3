"""How far the forks move with a lift: its cylinder, and the sensor on it."""

from __future__ import annotations

from collections.abc import Mapping

from forklift.plant.forklift.curve_tables import per_output
from forklift.recordings.channels import LIFTS, Lift

FORKS_PER_CYLINDER = 2.0
"""How far the forks move for a metre of either lift's cylinder, (3.38)."""
FORKS_PER_SENSOR: Mapping[Lift, float] = {
    lift: FORKS_PER_CYLINDER * per_output("position", lift) for lift in LIFTS
}
"""How far the forks move for a metre of the output ``position_*_m``, which the lift's own sensor reads."""

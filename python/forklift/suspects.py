"""What may be amiss with a forklift or its recordings: the effects of the catalogue, and their dull rivals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from forklift.diagnosis.suspect import Suspect, widened, with_unknown
from forklift.effects import EFFECTS
from forklift.estimation.problem import Problem
from forklift.estimation.readings import Reading, reading
from forklift.estimation.sensors import POSITIONS
from forklift.estimation.unknowns import of_effect
from forklift.names import LIFTS, Lift, channels, effects

LOAD_WIDTH_KG = 100.0
"""Prior standard deviation of an entered load that may be wrong."""
TEMPERATURE_WIDTH_K = 3.0
"""The same of a recording's oil temperature."""
START_WIDTH_M = 0.2
"""Where a lift starts, as far as an encoder of unknown scale tells."""


def suspects(lifts: Sequence[Lift], measured: Sequence[str]) -> tuple[Suspect, ...]:
    """All of them for a campaign that commands `lifts` and has these channels."""
    return (*_physics(lifts), *_sensors(measured), *_conditions())

"""What came of a fit, of any machine: data, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from forklift.fitting.compared import Compared, validation_change
from forklift.fitting.intervals import Knowledge, interval
from forklift.fitting.origin import Origin
from forklift.fitting.profile import Profile
from forklift.fitting.residuals import ChannelResidual
from forklift.fitting.search import Found
from forklift.fitting.starts import End
from forklift.fitting.widening import BIASED, widening
from forklift.plant.findings import Caution
from forklift.plant.parameter import Unknown
from forklift.plant.subject import Subject
from forklift.recordings.noise import Sensor

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True, eq=False, repr=False)
class Fitted:
    """All that a fit found."""

    machine: Subject
    """Where the fit started, with the parts that were fitted."""
    origin: Origin
    recordings: tuple[Any, ...]
    unknowns: tuple[Unknown, ...]
    found: Found
    sensors: dict[str, Sensor]
    noise: dict[str, float]
    """What each channel was weighted by, in its unit; of an encoder the softness of its edges."""
    knowledge: Knowledge
    judged: tuple[ChannelResidual, ...]
    """Every channel of every recording, against the sensors' noise."""
    ends: tuple[End, ...]
    profiles: tuple[Profile, ...]
    cautions: tuple[Caution, ...]
    before: Compared
    after: Compared
    interrupted: bool
    seconds: float
    options: Mapping[str, Any]
    """What `fit` was called with beside machine and recordings."""

    @property
    def parts(self) -> tuple[str, ...]:
        """Those that were fitted: of a truck the lifts that some recording commands."""
        return tuple(self.machine.parts)

    @cached_property
    def values(self) -> Mapping[str, float]:
        """What was estimated, by name."""
        return dict(self.found.problem.values(self.found.x))

    @property
    def title(self) -> str:
        """What the fitted machine is called."""
        return f"{self.origin.name} fitted from {self.machine.name}"

    @cached_property
    def sources(self) -> Mapping[str, str]:
        """Of each value where it comes from, with its 95 % interval."""
        origin, sources = self.origin, dict[str, str]()
        estimated = f"estimated from campaign {origin.name!r} (sha256 {origin.sha256[:12]})"
        for estimate, theta in zip(self.knowledge.estimates, self.found.x.tolist(), strict=False):
            unknown = estimate.unknown
            wide = widening(self.judged, unknown.name)
            ends = interval(unknown, theta, wide * estimate.deviation)
            for name, lower, upper in zip(unknown.names, *ends.tolist(), strict=True):
                biased = f", {BIASED}" if wide > 1.0 else ""
                sources[name] = (
                    f"{estimated}, 95 % interval {lower:.6g} to {upper:.6g}{biased}"
                    if estimate.identifiable
                    else f"not identifiable from campaign {origin.name!r} alone; near "
                    f"{self.machine.words.noun} {self.machine.name!r} by its prior"
                )
        return {name.rpartition(".")[0]: estimated for name in sources} | sources

    @cached_property
    def truck(self) -> Any:
        """The fitted machine as its user has it: a `Truck`, a `Plant`; values carry their `sources`."""
        return self.machine.named(self.values, self.sources, self.title)

    @property
    def held_out(self) -> tuple[ChannelResidual, ...]:
        """What is judged on: `validate` recordings, or without any, all."""
        judged = tuple(found for found in self.judged if found.role == "validate")
        return judged or self.judged

    @property
    def complete(self) -> bool:
        """Whether the machine explains all that is judged to the sensors' noise."""
        return all(found.explained for found in self.held_out)

    def validation(self, channel: str) -> pl.DataFrame:
        """`Comparison.validation` of one headline, before and after."""
        return validation_change(self.before, self.after, channel)

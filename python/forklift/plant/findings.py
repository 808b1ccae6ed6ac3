"""What a look at recordings gives before any fit: cautions, and stretches that are no measurement."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from forklift.base.arrays import Floats


@dataclass(frozen=True)
class Caution:
    """Something that a fit survives but whoever reads it must know.

    Attributes
    ----------
    code
        Stable, hyphenated word for its kind.
    sentence
        What, where, value, and what follows or what to do.
    facts
        What the sentence says, as data.
    """

    code: str
    sentence: str
    facts: Mapping[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """The caution as plain data, for JSON."""
        return {"code": self.code, "sentence": self.sentence, "facts": dict(self.facts)}


@dataclass(frozen=True)
class InvalidStretch:
    """A stretch of one channel in one recording that tells nothing.

    Attributes
    ----------
    from_s, to_s
        Between which times [s].
    how
        ``"stuck"``: it stands still while it should not; ``"slip"``: a position has jumped and stays off.
    """

    file: str
    channel: str
    from_s: float
    to_s: float
    how: Literal["stuck", "slip"]

    @property
    def said(self) -> str:
        """In words."""
        if self.how == "slip":
            return f"the signal slips in {self.file} at {self.from_s:.2f} s"
        return f"the signal stands still in {self.file} from {self.from_s:.2f} to {self.to_s:.2f} s"


def without(
    file: str, time_s: Floats, columns: Mapping[str, Floats], invalid: Iterable[InvalidStretch]
) -> dict[str, Floats]:
    """A recording's columns, (times,) each, with its invalid stretches missing."""
    kept = dict(columns)
    for one in invalid:
        if one.file == file:
            within = (time_s >= one.from_s) & (time_s <= one.to_s)
            kept[one.channel] = np.where(within, np.nan, kept[one.channel])
    return kept


@dataclass(frozen=True)
class Findings:
    """What was found.

    Attributes
    ----------
    invalid
        Stretches whose samples were left out.
    cautions
        What to know about a fit.
    unexcited
        Why the recordings tell nothing of any part; empty if they do.
    held
        Parameters that no recording tells, those held out neither, so that a fit must leave them alone.
    same
        Conditions that all recordings of a part have in common, so that no effect of them can be told: each
        with the part.
    """

    invalid: tuple[InvalidStretch, ...] = ()
    cautions: tuple[Caution, ...] = ()
    unexcited: str = ""
    held: tuple[str, ...] = ()
    same: tuple[tuple[str, str], ...] = ()

    def alike(self, conditions: Collection[str], where: str) -> bool:
        """Whether a part's recordings have one of these conditions in common; of the whole machine, any's."""
        return any(condition in conditions and where in (part, "") for condition, part in self.same)

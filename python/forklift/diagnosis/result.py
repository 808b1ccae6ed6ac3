"""What a diagnosis gives: its outcome, which tells and writes itself."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from forklift.base import present
from forklift.diagnosis import files, sentences, to_json
from forklift.diagnosis.outcome import Outcome


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Outcome):
    """What `diagnose` gives; `write` puts all of it into a folder."""

    @cached_property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        return sentences.sentence(self)

    def write(self, out: str | Path) -> Path:
        """Write ``report.html``, ``diagnosis.json``, the machine that was found, and predictions.

        The folder appears whole or not at all; an earlier diagnosis there is replaced.

        Raises
        ------
        ForkliftError
            ``"output-exists"`` if `out` holds anything but an earlier diagnosis, ``"not-writable"``.
        """
        return files.write(self, out)

    def to_dict(self) -> dict[str, Any]:
        """As ``diagnosis.json`` has it."""
        return to_json.to_dict(self)

    def _repr_html_(self) -> str:
        return present.summary(self)

    def __repr__(self) -> str:
        causes = [cause.hypothesis.label for cause in self.causes]
        return f"Diagnosis({self.origin.name!r}, {self.verdict!r}, {causes})"

    def __str__(self) -> str:
        return sentences.text(self)

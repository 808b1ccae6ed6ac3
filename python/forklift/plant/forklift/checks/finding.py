"""What a check of a recording gives: an error where a fit would be nonsense, else a caution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from forklift.base.errors import ForkliftError

if TYPE_CHECKING:
    from forklift.recordings.recording import Recording


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


Finding = ForkliftError | Caution


def fault(recording: Recording, code: str, sentence: str, **facts: Any) -> ForkliftError:
    """An error about one recording; the sentence follows the file's name."""
    return ForkliftError(code, f"{recording.file}: {sentence}", file=recording.file, **facts)


def caution(recording: Recording, code: str, sentence: str, **facts: Any) -> Caution:
    """A caution about one recording; the sentence follows the file's name."""
    return Caution(code, f"{recording.file}: {sentence}", {"file": recording.file, **facts})


def take_out(channel: str) -> str:
    """What to do about a channel that cannot be used."""
    return (
        f"empty its cells there, put {channel}'s column into ignore in campaign.toml for all recordings, "
        "or take the recording out"
    )

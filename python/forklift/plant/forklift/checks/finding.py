"""What a check of a recording gives: an error where a fit would be nonsense, else a caution."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from forklift.base.errors import ForkliftError
from forklift.plant.findings import Caution

if TYPE_CHECKING:
    from forklift.recordings.recording import Recording


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

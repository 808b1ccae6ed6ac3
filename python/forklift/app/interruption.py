"""Ctrl-C and SIGTERM: the sentence and the status with which a command ends."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from forklift.app.options import INTERRUPTED
from forklift.base.errors import ForkliftError

NOTHING = "interrupted; nothing was left half-written"

_TERMINATED: list[int] = []


def terminated() -> None:
    """SIGTERM has come: the core, too, tells of it as of Ctrl-C."""
    _TERMINATED.append(signal.SIGTERM)


def status() -> int:
    """128 + the signal."""
    return 128 + _TERMINATED[-1] if _TERMINATED else INTERRUPTED


@contextmanager
def keeping(folder: Path, same: str) -> Iterator[None]:
    """What is interrupted in this block is kept in `folder`, if anything is, and `same` goes on from there.

    Raises
    ------
    ForkliftError
        ``"interrupted"``.
    """
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        kept = f"interrupted; what was computed is kept in {folder}, and {same} goes on from there"
        raise ForkliftError("interrupted", kept if folder.exists() else NOTHING) from None

"""One call at a time in a folder, or with a file, that calls go on in."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from forklift.base import output
from forklift.base.errors import ForkliftError

LOCK = ".lock"
"""File that a call holds while it runs; the system lets go of it when the call ends, however it ends."""


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Nobody else who asks for `folder` gets it until this ends.

    Raises
    ------
    ForkliftError
        ``"folder-in-use"`` if another call has it; ``"not-writable"``.
    """
    with alone_with(folder / LOCK, folder):
        yield


@contextmanager
def alone_with(path: Path, told: Path | None = None) -> Iterator[None]:
    """Nobody else who asks for the file `path` gets it until this ends; `told` is what an error names.

    Raises
    ------
    ForkliftError
        ``"folder-in-use"`` if another call has it; ``"not-writable"``.
    """
    told = told or path
    with output.writing(path):
        file = path.open("a", encoding="utf-8")
    with file:
        try:
            _hold(file)
        except OSError:
            raise ForkliftError(
                "folder-in-use",
                f"another call that still runs writes to {told}; wait for its end, or name another place",
                file=str(told),
            ) from None
        yield


if sys.platform == "win32":
    import msvcrt

    def _hold(file: IO[str]) -> None:
        file.seek(1 << 30)  # beyond what is ever written: there nobody else is kept from writing
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _hold(file: IO[str]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)

"""A sweep piece by piece: one file a chunk, written whole, so that a run that was killed goes on where it
stood.

A chunk's file has the same bytes whenever, wherever and by however many threads it was made.
"""

from __future__ import annotations

import io
import os
from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, suppress
from pathlib import Path

import numpy as np
import polars as pl

from forklift.base.errors import ForkliftError
from forklift.ensemble.members import Members
from forklift.ensemble.tables import measures, verdicts
from forklift.recordings.channels import commanded

FOLDER = "members"
"""Of the chunks' files, in a sweep's folder."""


def columns(members: Members) -> dict[str, list[str]]:
    """The names of a chunk's columns by kind: what varies, the margins, the measures."""
    spec = members.specification
    return {
        "vary": list(spec.vary),
        "margins": [f"margin.{require.name}" for require in spec.require],
        "measures": [f"{lift}.{name}" for lift in commanded(spec.lifts) for name in measures()],
    }


def run(members: Members, chunk: int) -> pl.DataFrame:
    """The members of a chunk, a row each."""
    first, last = members.span(chunk)
    values, streams = members.draw(first, last)
    verdict, numbers = members.core.run(values, streams)
    return frame(members, first, values, verdict, numbers)


def frame(
    members: Members,
    first: int,
    values: np.ndarray,
    verdict: np.ndarray,
    numbers: np.ndarray,
) -> pl.DataFrame:
    """A table of members: index, what varied, verdict, margins (unscaled), measures."""
    names = columns(members)
    data: dict[str, object] = {"index": np.arange(first, first + len(values), dtype=np.uint64)}
    data |= {name: values[:, k] for k, name in enumerate(names["vary"])}
    words = list(verdicts())
    data["verdict"] = pl.Series(words, dtype=pl.Enum(words)).gather(verdict)
    data |= {name: numbers[:, k] for k, name in enumerate(names["margins"] + names["measures"])}
    return pl.DataFrame(data)


def encoded(table: pl.DataFrame) -> bytes:
    """A chunk as the bytes of its file."""
    buffer = io.BytesIO()
    table.write_parquet(buffer, compression="zstd", statistics=False, row_group_size=max(len(table), 1))
    return buffer.getvalue()


def path(folder: Path, chunk: int) -> Path:
    return folder / FOLDER / f"{chunk:06d}.parquet"


def store(folder: Path, chunk: int, data: bytes) -> None:
    """The file of a chunk, whole or not at all."""
    target = path(folder, chunk)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, target)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise ForkliftError(
            "not-writable",
            f"{target} cannot be written ({(error.strerror or 'it is not allowed').lower()}); make room and "
            f"run "
            "the same command again",
            file=str(target),
        ) from None


def present(folder: Path, members: Members) -> list[bool]:
    """Which chunks have a file, which is whole; what a killed run left half done is removed."""
    place = folder / FOLDER
    place.mkdir(parents=True, exist_ok=True)
    for left in place.glob(".*.tmp"):
        left.unlink(missing_ok=True)
    return [path(folder, chunk).is_file() for chunk in range(members.chunks)]


def load(folder: Path, chunk: int) -> pl.DataFrame:
    """A chunk's table.

    Raises
    ------
    ForkliftError
        ``"file-unreadable"``.
    """
    try:
        return pl.read_parquet(path(folder, chunk), memory_map=False)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise ForkliftError(
            "file-unreadable",
            f"{path(folder, chunk)} cannot be read ({type(error).__name__}); delete it and run the sweep "
            f"again",
            file=str(path(folder, chunk)),
        ) from None


def all_of(
    members: Members,
    folder: Path | None,
    *,
    elsewhere: Callable[[list[int]], Iterator[tuple[int, bytes]]] | None = None,
) -> Iterator[tuple[pl.DataFrame, bool]]:
    """Every chunk in order, from its file or made now, with whether it was made now.

    A chunk is counted and its file written while the next one runs; by one thread, before it. `elsewhere`
    makes the missing chunks of a list in any order.
    """
    there = present(folder, members) if folder else [False] * members.chunks
    missing = [chunk for chunk, found in enumerate(there) if not found]
    if elsewhere is not None and folder is not None:
        for chunk, data in elsewhere(missing):
            store(folder, chunk, data)
        for chunk in range(members.chunks):
            yield load(folder, chunk), chunk in missing
        return
    made = _made(members, missing)
    with closing(made), ThreadPoolExecutor(1) as beside:
        writing = None
        for chunk in range(members.chunks):
            if there[chunk] and folder:
                yield load(folder, chunk), False
                continue
            table = next(made)
            if writing is not None:
                writing.result()
            if folder and members.threads == 1:
                _write(folder, chunk, table)
            elif folder:
                writing = beside.submit(_write, folder, chunk, table)
            yield table, True
        if writing is not None:
            writing.result()


def _made(members: Members, missing: list[int]) -> Generator[pl.DataFrame]:
    """These chunks in turn, the core two ahead, so that its threads never wait for who takes them;
    by one thread, each when it is asked for."""
    if members.threads == 1:
        yield from (run(members, chunk) for chunk in missing)
        return
    with ThreadPoolExecutor(2) as core:
        begun: deque[tuple[int, np.ndarray, Future[tuple[np.ndarray, np.ndarray]]]] = deque()
        for chunk in missing:
            first, last = members.span(chunk)
            values, streams = members.draw(first, last)
            begun.append((first, values, core.submit(members.core.run, values, streams)))
            if len(begun) == 3:
                yield _ended(members, *begun.popleft())
        while begun:
            yield _ended(members, *begun.popleft())


def _ended(
    members: Members, first: int, values: np.ndarray, run: Future[tuple[np.ndarray, np.ndarray]]
) -> pl.DataFrame:
    return frame(members, first, values, *run.result())


def _write(folder: Path, chunk: int, table: pl.DataFrame) -> None:
    store(folder, chunk, encoded(table))

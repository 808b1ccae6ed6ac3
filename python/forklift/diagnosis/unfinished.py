"""Searches that a diagnosis has made, kept until it is written: what was interrupted goes on from there.

A diagnosis that is made again of the same asks for the same searches in the same order. So each is kept under
its number, as plain numbers, with a digest of what was asked, and is found again to the bit. How much was
computed until then is kept too, since that decides which trials begin.
"""

from __future__ import annotations

import json
import re
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.base import output
from forklift.base.arrays import Floats
from forklift.base.fingerprint import fingerprint
from forklift.fitting.search import Found, Stage, ended, search

if TYPE_CHECKING:
    from forklift.fitting.problem import LeastSquares
    from forklift.recordings.noise import Sensor

FOLDER = "unfinished"
"""Where it is kept, within the folder of the diagnosis."""
OF = "of.json"
"""What all of it was made of."""
_FILE = re.compile(rf"{FOLDER}/\.?(of|\d{{4,}})\.json(\.\d+\.tmp)?")
"""A killed process may have left a temporary file."""


def work_files(out: str | Path) -> frozenset[str]:
    """The files of an unfinished diagnosis in `out`, relative to it; none if there is none."""
    folder = Path(out) / FOLDER
    if not (folder / OF).is_file():
        return frozenset()
    names = {f"{FOLDER}/{path.name}" for path in folder.iterdir()}
    return frozenset(name for name in names if _FILE.fullmatch(name))


@dataclass
class Unfinished:
    """The searches of a diagnosis, by number.

    Attributes
    ----------
    folder
        Where they are kept; None: nowhere.
    of
        Digest of what the diagnosis is made of; work of anything else is removed.
    asked
        How many searches were asked for.
    spared_s
        How many seconds those that were found again took when they were made.
    """

    folder: Path | None = None
    of: str = ""
    asked: int = 0
    spared_s: float = 0.0

    @classmethod
    def within(cls, out: str | Path | None, *given: object) -> Unfinished:
        """Of a diagnosis of what was given, to be written to `out`."""
        if out is None:
            return cls()
        from forklift import __version__

        here = cls(Path(out) / FOLDER, fingerprint(__version__, np.__version__, *given))
        assert here.folder is not None
        if here._read(OF) != {"forklift": __version__, "of": here.of} and work_files(out):
            shutil.rmtree(here.folder)
        return here

    def search(
        self,
        problem: LeastSquares,
        x: Floats,
        sensors: Mapping[str, Sensor],
        stages: tuple[Stage, ...],
        bars: Sequence[float] = (),
    ) -> Found:
        """See `forklift.fitting.search.search`: the same, made or found again."""
        number, self.asked = self.asked, self.asked + 1
        if self.folder is None:
            return search(problem, x, sensors, stages, bars=bars)
        asked = _digest(problem, x, stages, bars)
        known = self._read(_name(number))
        if known and known.get("asked") == asked:
            self.spared_s += known["seconds"]
            return _again(problem, known)
        began = time.monotonic()
        found = search(problem, x, sensors, stages, bars=bars)
        self._write(number, asked, found, time.monotonic() - began)
        return found

    def _read(self, name: str) -> dict[str, Any] | None:
        assert self.folder is not None
        try:
            told = json.loads((self.folder / name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return told if isinstance(told, dict) else None

    def _write(self, number: int, asked: str, found: Found, seconds: float) -> None:
        assert self.folder is not None
        problem: Any = found.problem
        told = {
            "asked": asked,
            "x": found.x.tolist(),
            "sigma": dict(found.problem.sigma),
            "substeps": found.problem.substeps,
            "evaluations": found.evaluations,
            "work": found.problem.work.done,
            "visited": [[substeps, x.tolist()] for substeps, x in problem.visited()],
            "seconds": seconds,
        }
        if not (self.folder / OF).exists():
            from forklift import __version__

            self.folder.mkdir(parents=True, exist_ok=True)
            output.write_text(self.folder / OF, json.dumps({"forklift": __version__, "of": self.of}))
        output.write_text(self.folder / _name(number), json.dumps(told))


def _again(problem: LeastSquares, known: Mapping[str, Any]) -> Found:
    """As the search left it: its end, the runs that it left for those that follow, and the work."""
    at = problem.weighted(known["sigma"], known["substeps"])
    at.visit([(substeps, np.array(x)) for substeps, x in known["visited"]])
    found = ended(at, np.array(known["x"]), known["evaluations"])
    problem.work.done = known["work"]
    return found


def _name(number: int) -> str:
    return f"{number:04d}.json"


def _digest(problem: LeastSquares, x: Floats, stages: Sequence[Stage], bars: Sequence[float]) -> str:
    return fingerprint(x, stages, list(bars), *_posed(problem))


def _posed(problem: LeastSquares) -> Iterator[object]:
    """What is asked: the unknowns, what is held, and which recordings with what of their own."""
    yield from (problem.sigma, problem.substeps, problem.fixed, problem.lags)
    yield [one.name for one in problem.unknowns]
    for sample in problem.samples:
        yield [sample.recording.file, list(sample.names), sample.centre, sample.width]
        yield [[seen.sensor.channel, len(seen.rows)] for seen in sample.observed]

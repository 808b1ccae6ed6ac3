"""The search of a tuner: a minimum of a function that jumps, with every generation's costs kept on the way.

The search is CMA-ES (Hansen & Ostermeier 2001, Evolutionary Computation 9(2)), by the package of its author.
It draws by a seed, so that the costs of earlier generations are all that it takes to go on with it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cma
import numpy as np

from forklift.base.arrays import Floats
from forklift.base.output import check_file, writing


@dataclass(frozen=True)
class Sought:
    """A number that is searched: where from, how far at first, and within which bounds."""

    start: float
    width: float
    lower: float
    upper: float


class Journal:
    """The costs of every generation so far, in a file if there is one.

    A file of the same search is read, and what it holds is not worked out again; one of another search is
    begun anew.

    Parameters
    ----------
    path
        None keeps nothing.
    of
        What the search is made of: equal text, equal search.

    Raises
    ------
    ForkliftError
        ``"not-writable"``.
    """

    def __init__(self, path: Path | None = None, of: str = "") -> None:
        self._path = None if path is None else check_file(path)
        self._known: list[list[float]] = []
        self._place = 0
        if self._path is None:
            return
        if not self._read(of):
            self._write(json.dumps(of) + "\n")

    def _read(self, of: str) -> bool:
        """Whether the file is of this search; a last line that a kill cut short is dropped."""
        assert self._path is not None
        try:
            first, *lines = self._path.read_text(encoding="utf-8").splitlines(keepends=True)
            if json.loads(first) != of:
                return False
        except (OSError, ValueError):
            return False
        whole = [line for line in lines if line.endswith("\n")]
        try:
            self._known = [[float(x) for x in json.loads(line)] for line in whole]
        except (ValueError, TypeError):
            return False
        if len(whole) < len(lines):
            self._write("".join([first, *whole]))
        return True

    def costs(self, work: Callable[[], Floats]) -> list[float]:
        """Of the next generation, as the file has them, or by `work`."""
        if self._place < len(self._known):
            found = self._known[self._place]
        else:
            found = [float(x) for x in work()]
            self._known.append(found)
            self._write(json.dumps(found) + "\n", "a")
        self._place += 1
        return found

    def _write(self, text: str, mode: str = "w") -> None:
        if self._path is not None:
            with writing(self._path), self._path.open(mode, encoding="utf-8") as file:
                file.write(text)


def minimised(
    cost: Callable[[list[Floats]], Floats],
    sought: Sequence[Sought],
    *,
    generations: int,
    candidates: int,
    seed: int,
    journal: Journal | None = None,
    say: Callable[[int, float], None] | None = None,
) -> Floats:
    """The best of all candidates within the bounds; the start is the first of them.

    Parameters
    ----------
    cost
        (candidates,) Of as many candidates at once.
    seed
        At least 0; the generator's has 32 bits.
    journal
        Where every generation's costs are kept.
    say
        Is told after every generation how many there were, and the least cost.
    """
    journal = journal or Journal()
    lower, upper = np.array([one.lower for one in sought]), np.array([one.upper for one in sought])
    start = np.clip([one.start for one in sought], lower, upper)
    options = {
        "CMA_stds": [one.width for one in sought],
        "bounds": [lower, upper],
        "popsize": candidates,
        "maxiter": generations,
        "seed": seed % (2**32 - 1) + 1,  # it takes 0 for the time of day
        "verbose": -9,
    }
    search = cma.CMAEvolutionStrategy(start, 1.0, options)
    best, least = start, np.inf
    while not search.stop():
        tried = search.ask()
        if search.countiter == 0:
            tried[0] = start
        found = journal.costs(partial(cost, tried))
        search.tell(tried, found)
        if min(found) < least:
            best, least = np.asarray(tried[int(np.argmin(found))], float), min(found)
        if say:
            say(search.countiter, least)
    return best

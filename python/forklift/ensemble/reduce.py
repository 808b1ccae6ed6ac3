"""What the members of a sweep come to: counts, the worst, a map; chunk after chunk, in constant memory.

Chunks are taken in order, and everything kept is a count, an extreme or a member: the result is the same
however the members were cut into chunks.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import polars as pl
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.ensemble.specification import Specification
from forklift.ensemble.tables import verdicts

Counts = NDArray[np.int64]

BINS = 12
"""Of each axis of a map, where a quantity is not one of a few values."""
STABLE, NOT_FINITE = "stable", "not_finite"
SCALED = "least_scaled_margin"
"""Of all requirements, each margin divided by its scale: it ranks members, and no more."""


@dataclass(frozen=True, eq=False)
class Axis:
    """One axis of a map: a varied quantity in cells.

    Attributes
    ----------
    edges
        (n + 1,) rising, of n cells.
    """

    name: str
    edges: Floats

    @property
    def cells(self) -> int:
        return len(self.edges) - 1

    @property
    def middles(self) -> Floats:
        middles: Floats = (self.edges[1:] + self.edges[:-1]) / 2.0
        return middles

    def of(self, values: Floats) -> NDArray[np.intp]:
        """(n,) the cell of each value; what lies outside belongs to the nearest."""
        return np.clip(np.searchsorted(self.edges, values, side="right") - 1, 0, self.cells - 1)


@dataclass(eq=False)
class Tally:
    """The sums over the chunks seen so far.

    Attributes
    ----------
    verdicts
        Members of each verdict.
    broken, unasked
        By requirement, members that break it, and members it was never asked of.
    axes, seen, failed, least
        A map of two varied quantities: members and failures of each cell (x, y), and the least scaled margin
        in it, infinite where there is none; less where fewer are varied.
    shares
        Of a Sobol sequence, failures of each scramble.
    worst
        The members with the least scaled margins, the first of them the worst.
    """

    specification: Specification
    axes: tuple[Axis, ...]
    scramble: int = 0
    """Members of a scramble; 0 without."""
    members: int = 0
    verdicts: dict[str, int] = field(default_factory=dict)
    broken: dict[str, int] = field(default_factory=dict)
    unasked: dict[str, int] = field(default_factory=dict)
    shares: dict[int, int] = field(default_factory=dict)
    seen: Counts = field(init=False)
    failed: Counts = field(init=False)
    least: Floats = field(init=False)
    worst: pl.DataFrame | None = None

    def __post_init__(self) -> None:
        self.verdicts = {name: 0 for name in verdicts()}
        self.broken = {require.name: 0 for require in self.specification.require}
        self.unasked = dict(self.broken)
        shape = tuple(axis.cells for axis in self.axes)
        self.seen, self.failed = np.zeros(shape, np.int64), np.zeros(shape, np.int64)
        self.least = np.full(shape, np.inf)

    @property
    def failures(self) -> int:
        """Members that are not stable, for whatever reason."""
        return self.members - self.verdicts[STABLE]

    def add(self, table: pl.DataFrame) -> None:
        """The next chunk."""
        codes = table["verdict"].cast(pl.Enum(list(self.verdicts))).to_physical().to_numpy()
        failed = codes != list(self.verdicts).index(STABLE)
        self.members += len(table)
        for name, count in zip(self.verdicts, np.bincount(codes, minlength=len(self.verdicts)), strict=True):
            self.verdicts[name] += int(count)
        for require in self.specification.require:
            margin = table[f"margin.{require.name}"].to_numpy()
            self.broken[require.name] += int((margin < 0.0).sum())
            self.unasked[require.name] += int((margin == np.inf).sum())
        rank = scaled(self.specification, table)
        # What has no number at all fails the most, and what ceased to be finite, whatever it was until then.
        rank[np.isnan(rank) | (codes == list(self.verdicts).index(NOT_FINITE))] = -np.inf
        if self.axes:
            places = tuple(axis.of(table[axis.name].to_numpy()) for axis in self.axes)
            cells = np.ravel_multi_index(places, self.seen.shape)
            self.seen += _counted(cells, self.seen.shape)
            self.failed += _counted(cells[failed], self.seen.shape)
            np.minimum.at(self.least, places, rank)
        if self.scramble:
            first = int(table["index"][0]) // self.scramble
            self.shares[first] = self.shares.get(first, 0) + int(failed.sum())
        self._keep(table, rank)

    def _keep(self, table: pl.DataFrame, rank: Floats) -> None:
        """The worst so far: of this chunk only those are sorted that may be among them."""
        most = self.specification.worst
        if self.worst is not None and len(self.worst) >= most > 0:
            bound = self.worst[SCALED][-1]
        elif 0 < most < len(rank):
            bound = np.partition(rank, most - 1)[most - 1]
        else:
            bound = np.inf
        chosen = np.flatnonzero(rank <= bound)
        ranked = table[chosen].with_columns(pl.Series(SCALED, rank[chosen]))
        both = ranked if self.worst is None else pl.concat([self.worst, ranked])
        self.worst = both.sort(SCALED, "index").head(most)


def _counted(cells: NDArray[np.intp], shape: tuple[int, ...]) -> Counts:
    """How many of the members lie in each cell."""
    return np.bincount(cells, minlength=int(np.prod(shape))).reshape(shape)


def scaled(specification: Specification, table: pl.DataFrame) -> Floats:
    """(n,) the least margin of each member over its requirements, each divided by its scale."""
    margins = [
        table[f"margin.{require.name}"].to_numpy() / require.scale for require in specification.require
    ]
    least: Floats = np.min(np.stack(margins), axis=0)
    return least


def axis(name: str, kind: str, numbers: list[float]) -> Axis:
    """The cells of a varied quantity: each of a few values, or `BINS` even ones of its range.

    A normal quantity has its range from the 1st to the 99th percentile of what is left of it by its cut.
    """
    from scipy.special import ndtr, ndtri

    if kind == "choice":
        values = np.unique(numbers)
        if len(values) > 4 * BINS:
            return Axis(name, np.linspace(values[0], values[-1], BINS + 1))
        gaps = np.diff(values) if len(values) > 1 else np.array([1.0])
        inner = (values[1:] + values[:-1]) / 2.0
        return Axis(name, np.concatenate([[values[0] - gaps[0] / 2.0], inner, [values[-1] + gaps[-1] / 2.0]]))
    logarithmic = kind.startswith("log")

    def even(values: list[float]) -> Floats:
        if not logarithmic:
            return np.array(values)
        with np.errstate(divide="ignore"):  # a cut at 0 or below cuts nothing
            return np.log(np.maximum(values, 0.0))

    if kind.endswith("normal"):
        (middle,), deviation = even(numbers[:1]), numbers[1]
        cut = (even(numbers[2:]) - middle) / deviation if len(numbers) == 4 else np.array([-np.inf, np.inf])
        # Beyond the middle the tail is counted from above, so that nothing of it is rounded off.
        side = -1.0 if cut[0] > 0.0 else 1.0
        first, last = ndtr(side * cut)
        ends = middle + side * deviation * ndtri(first + np.array([0.01, 0.99]) * (last - first))
    else:
        ends = even(numbers)
    first, last = ends.tolist()
    if logarithmic:
        return Axis(name, np.geomspace(np.exp(first), np.exp(last), BINS + 1))
    return Axis(name, np.linspace(first, last, BINS + 1))

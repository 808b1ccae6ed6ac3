"""The verb `rare`: failures of a sweep that are too rare to count, and its worst case.

Both go by the least scaled margin of a member.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base import output
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.typeset import printed
from forklift.control.controller import Controller
from forklift.ensemble.intervals import LEAST_REPLICATES
from forklift.ensemble.members import Members, Streams, uniform_of
from forklift.ensemble.quantities import quantity
from forklift.ensemble.reduce import NOT_FINITE
from forklift.ensemble.specification import Specification
from forklift.ensemble.subset import MOST_LEVELS, SHARE, RareFailures, subset_simulation
from forklift.ensemble.tables import verdicts
from forklift.ensemble.trajectory import Trajectory, trajectory
from forklift.plant.forklift.truck import Truck

LEVEL_MEMBERS = 1000
"""Of a level of subset simulation: as those whose intervals ``python3 dev.py sweep-intervals`` counts."""
GENERATIONS = 40
"""Of the search for the worst case; chosen."""
WITHIN = 3.0
"""How far the search goes, in standard deviations: 99.7 % of what a quantity is drawn as."""
RESULT, LIKELIEST, WORST = "rare.json", "likeliest.csv", "worst.csv"
FILES = (RESULT, LIKELIEST, WORST)


@dataclass(frozen=True)
class Progress:
    """How far it is: runs of subset simulation ended, of how many; then the worst case is searched."""

    run: int
    runs: int


@dataclass(frozen=True)
class WorstCase:
    """The least scaled margin that a search found.

    Attributes
    ----------
    within
        How far from the middle of each distribution was searched, in standard deviations, those of a
        normal distribution of the same shares.
    margin
        The least of the requirements' margins, each divided by its scale; negative where one is broken.
    evaluations
        Members run.
    trajectory
        Its values and its lowering.
    """

    within: float
    margin: float
    evaluations: int
    trajectory: Trajectory


@dataclass(frozen=True)
class Rare:
    """What `rare` gives.

    Attributes
    ----------
    failures
        The probability that a member fails, its interval, and each run's estimate.
    likeliest
        The failure that is likeliest, of those that were seen; None if none was.
    worst
        The worst case that was found within so many standard deviations; None if nothing in there has its
        parameters within their bounds.
    """

    specification: Specification
    truck: Truck
    controller: Controller | None
    failures: RareFailures
    likeliest: Trajectory | None
    worst: WorstCase | None

    @property
    def verdict(self) -> str:
        """The one sentence."""
        found, name = self.failures, self.specification.name
        if not any(found.probabilities):
            return (
                f"No run out of {len(found.probabilities)} came to a failure of a member of {name!r}, "
                f"down to a probability of {SHARE**MOST_LEVELS:.0e}; that is no proof that there is none."
            )
        interval = found.interval
        return (
            f"A member of {name!r} fails with a probability of {interval.estimate:.2g}, between "
            f"{interval.lower:.2g} and {interval.upper:.2g} ({100 * interval.level:g} % interval, "
            f"{interval.method})."
        )

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "schema": 1,
            "name": self.specification.name,
            "specification_sha256": self.specification.sha256,
            "truck": {"name": self.truck.name, "sha256": self.truck.sha256},
            "controller": self.controller and {"name": self.controller.name, "hash": self.controller.hash},
            "verdict": self.verdict,
            "probability": self.failures.interval.to_dict(),
            "runs": list(self.failures.probabilities),
            "levels": list(self.failures.levels),
            "members_run": self.failures.evaluations + (self.worst.evaluations if self.worst else 0),
            "likeliest_failure": self.likeliest and self.likeliest.to_dict(),
            "worst_case": self.worst
            and {
                "within_standard_deviations": self.worst.within,
                "margin": self.worst.margin,
                "evaluations": self.worst.evaluations,
                **self.worst.trajectory.to_dict(),
            },
        }

    def write(self, folder: str | Path) -> Path:
        """`to_dict` as ``rare.json``, and both lowerings as ``likeliest.csv`` and ``worst.csv``.

        Raises
        ------
        ForkliftError
            ``"output-exists"`` if `folder` holds anything else, ``"not-writable"``.
        """
        with output.folder(folder, FILES, RESULT) as new:
            text = json.dumps(self.to_dict(), indent=1, ensure_ascii=False) + "\n"
            output.write_text(new / RESULT, text)
            if self.worst:
                self.worst.trajectory.write(new / WORST)
            if self.likeliest:
                self.likeliest.write(new / LIKELIEST)
        return Path(folder)

    def __str__(self) -> str:
        worst = self.worst
        lines = [self.verdict]
        if any(self.failures.probabilities) and self.likeliest is None:
            lines.append("Every failure that was seen has a value outside its parameter's bounds.")
        columns = {"likeliest failure": self.likeliest.varied} if self.likeliest else {}
        if worst:
            said = "breaks a requirement" if worst.margin < 0.0 else "keeps every requirement"
            lines.append(
                f"The worst case that a search found within {worst.within:g} standard deviations of each "
                f"quantity {said}: its least margin is {worst.margin:.3g} of its scale."
            )
            columns["worst"] = worst.trajectory.varied
        if columns:
            lines.append("".join([" " * 40, *(f"{name:>20}" for name in columns)]))
        for name in self.specification.vary if columns else ():
            of = quantity(self.specification, name, controlled=self.controller is not None)
            unit = printed(of.unit)
            cells = (f"{one[name]:>20.6g}" for one in columns.values())
            lines.append(f"{name:>40}{''.join(cells)} {unit}".rstrip())
        return "\n".join(lines)


def rare(
    given: Specification | Mapping[str, Any] | str | Path,
    *,
    truck: Truck | None = None,
    controller: Controller | None = None,
    threads: int = 0,
    members: int = LEVEL_MEMBERS,
    runs: int = LEAST_REPLICATES,
    generations: int = GENERATIONS,
    within: float = WITHIN,
    progress: Callable[[Progress], None] | None = None,
) -> Rare:
    """How rarely a member of a sweep fails where counting finds too few, and the worst case.

    The probability is that of an independent member, by subset simulation (Au & Beck 2001) on the least
    scaled margin; noise moves with its member. Failures that lie apart may be missed by some runs, which the
    interval over runs shows. The worst case is searched by differential evolution (Storn & Price 1997, as
    SciPy has it) with one sequence of noise: a search finds a case and proves no bound.

    Parameters
    ----------
    given, truck, controller, threads
        As of `sweep`; the specification's `members` and `sampling` are not used.
    members
        Of a level, a multiple of ten.
    runs
        Independent runs of subset simulation; ten or more give an interval that holds.
    generations
        Of the search.
    within
        How far it goes from the middle of each distribution, in standard deviations (`WorstCase.within`).

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for a number out of bounds or a sweep in which nothing varies, and those of
        `Members.of`.
    """
    found = Members.of(given, truck, controller, threads)
    spec = found.specification
    each = round(1.0 / SHARE)
    if members < each * each or members % each:
        raise _out_of_bounds("members", members, f"a multiple of {each}, {each * each} or more")
    if runs < 2:
        raise _out_of_bounds("runs", runs, "2 or more")
    if generations < 1:
        raise _out_of_bounds("generations", generations, "1 or more")
    if not 0.0 < within < np.inf:
        raise _out_of_bounds("within", within, "more than 0, and a number")
    if not spec.vary:
        raise ForkliftError(
            "argument-invalid", f"nothing varies in {spec.name!r}; give [vary.NAME] in its file", name="vary"
        )

    def told(run: int) -> None:
        if progress:
            progress(Progress(run, runs))

    failures = probability(found, size=members, runs=runs, ended=told)
    likeliest = None
    if failures.likeliest:
        u, stream = failures.likeliest
        likeliest = trajectory(found, found.values(uniform_of(u[None, :]))[0], stream)
    worst = worst_case(found, generations=generations, within=within)
    return Rare(spec, found.truck, found.controller, failures, likeliest, worst)


def margin_of(members: Members, uniform: Floats, streams: Streams) -> Floats:
    """(n,) the least scaled margin at uniform numbers (n, varied) and sequences of noise (n,).

    −∞ of a member that has none, which counts as a failure: one with a value outside its parameter's bounds,
    and one that ceased to be finite, whatever it was until then.
    """
    verdict, numbers = members.core.run(members.values(uniform), streams)
    scales = np.array([require.scale for require in members.specification.require])
    least: Floats = np.min(numbers[:, : len(scales)] / scales, axis=1)
    return np.where(np.isnan(least) | (verdict == list(verdicts()).index(NOT_FINITE)), -np.inf, least)


def probability(
    members: Members, *, size: int, runs: int, ended: Callable[[int], None] | None = None
) -> RareFailures:
    """The probability that a member fails, by subset simulation with levels of `size` members."""

    def margin(u: Floats, streams: Streams) -> Floats:
        return margin_of(members, uniform_of(u), streams)

    spec = members.specification
    return subset_simulation(margin, len(spec.vary), seed=spec.seed, members=size, runs=runs, ended=ended)


def worst_case(members: Members, *, generations: int, within: float) -> WorstCase | None:
    """The values within their bounds that come nearest to a failure, or fail the most.

    With one sequence of noise, frozen. None if no member that was tried has its values within their bounds.
    """
    from scipy.optimize import differential_evolution

    def objective(u: Floats) -> Floats:
        streams = np.zeros(u.shape[1], np.uint64)
        margins = margin_of(members, uniform_of(u.T), streams)
        return np.where(np.isneginf(margins), np.inf, margins)

    found = differential_evolution(
        objective,
        [(-within, within)] * len(members.specification.vary),
        maxiter=generations,
        rng=np.random.default_rng(members.specification.seed),
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=0.0,
    )
    if np.isposinf(found.fun):
        return None
    values = members.values(uniform_of(found.x[None, :]))[0]
    run = trajectory(members, values, 0)
    return WorstCase(within, float(found.fun), int(found.nfev), run)


def _out_of_bounds(name: str, value: float, bounds: str) -> ForkliftError:
    return ForkliftError("argument-invalid", f"{name} is {value}; give {bounds}", name=name, value=value)

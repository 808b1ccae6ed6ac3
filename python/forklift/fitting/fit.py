"""Fit a machine to recordings: its parameters, with what is known of them and what is not."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from forklift.base import arguments, present
from forklift.base.errors import ForkliftError
from forklift.base.threads import one_thread
from forklift.fitting import files, fit_tables, words
from forklift.fitting.agreement import agreement
from forklift.fitting.clocks import clock_cautions
from forklift.fitting.compare import Comparison, replayed
from forklift.fitting.constraints import constrained
from forklift.fitting.fitted import Fitted
from forklift.fitting.interface import Problem
from forklift.fitting.intervals import Knowledge, knowledge
from forklift.fitting.origin import Origin, given
from forklift.fitting.posing import pose
from forklift.fitting.predict import predict_all, settled_within
from forklift.fitting.problem import LeastSquares
from forklift.fitting.profile import Profile, profile
from forklift.fitting.residuals import ChannelResidual, judge
from forklift.fitting.search import STAGES, Found, Stage, settle
from forklift.fitting.starts import Ends, compare_ends, from_starts
from forklift.fitting.widening import widening
from forklift.plant.parameter import Unknown
from forklift.plant.subject import Subject
from forklift.recordings.noise import Sensor

if TYPE_CHECKING:
    import polars as pl

    from forklift.base.arrays import Floats

T = TypeVar("T")

SEED = 1
AGAIN = 3
"""Starts of a fit that leaves something over."""


@dataclass(frozen=True)
class Progress:
    """How far a fit is; told after every evaluation."""

    start: int
    starts: int
    stage: int
    stages: int
    evaluation: int
    cost: float
    """−ln posterior with the stage's weights: comparable within a stage only."""
    misfit: float
    """Root mean square of the residuals in units of the sensors' noise, whatever the stage's weights."""
    profile: str = ""
    """After the search: the parameter whose profile likelihood is being drawn."""


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Fitted):
    """What `fit` gives; `write` puts all of it into a folder."""

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """In plain sentences: how good the fit is, what it leaves over and where, what it cannot tell."""
        return words.sentences(self)

    @cached_property
    def fits(self) -> pl.DataFrame:
        """`Comparison.fits` before and after: one row per recording and signal."""
        return fit_tables.fits(self)

    @cached_property
    def signals(self) -> pl.DataFrame:
        """What is left of each signal and role, as mean square in units of the sensors' noise."""
        return fit_tables.signals(self)

    @cached_property
    def parameters(self) -> pl.DataFrame:
        """One row per parameter: start, value, 95 % intervals before and after, and how it is known."""
        return fit_tables.parameters(self)

    def profile(self, name: str) -> Profile:
        """The profile likelihood of one parameter: about as much work as the fit itself.

        Raises
        ------
        ForkliftError
            ``"parameter-unknown"`` if it was not estimated.
        """
        _check_profiles([name], self.unknowns)
        k = [unknown.name for unknown in self.unknowns].index(name)
        with one_thread():
            return profile(self.found.problem, self.found.x, k, self.knowledge.estimates[k].deviation)

    def write(self, out: str | Path) -> Path:
        """Write the fitted machine, the page to look at, and all that is known of the fit, into a folder.

        ``truck.toml`` (of a plant ``parameters.json``), ``report.html``, ``fit.json``, ``fit.csv``,
        ``parameters.csv``, ``predictions/baseline/FILE.csv``, and of a truck ``speed_table_free.csv`` or
        ``speed_table_main.csv`` of each fitted lift. The folder appears whole or not at all; an
        earlier fit there is replaced.

        Raises
        ------
        ForkliftError
            ``"output-exists"`` if `out` holds anything but an earlier fit, ``"not-writable"``.
        """
        return files.write(self, out)

    def to_dict(self) -> dict[str, Any]:
        """All but the curves as plain data, with version and hashes, for JSON."""
        return files.to_dict(self)

    def _repr_html_(self) -> str:
        return present.summary(self)

    def __repr__(self) -> str:
        return (
            f"Fit({self.origin.name!r}, {len(self.unknowns)} unknowns, "
            f"{'complete' if self.complete else 'something left over'}, {self.seconds:.1f} s)"
        )

    def __str__(self) -> str:
        return "\n".join([*self.sentences, "", *present.tables(self)])


@dataclass
class _Watch:
    """Turns the search's progress into the caller's, and keeps each start's best point for Ctrl-C."""

    problem: LeastSquares
    sensors: Mapping[str, Sensor]
    tell: Callable[[Progress], None] | None
    starts: int
    best: dict[int, tuple[Stage, float, Floats]] = field(default_factory=dict)
    """By start, where its last stage stands: costs of two stages do not compare."""
    evaluations: int = 0

    def of(self, start: int) -> Callable[[Stage, int, float, Floats], None]:
        def evaluated(stage: Stage, evaluation: int, cost: float, x: Floats) -> None:
            self.evaluations += 1
            known = self.best.get(start)
            if known is None or known[0] is not stage or cost <= known[1]:
                self.best[start] = stage, cost, x.copy()
            if self.tell:
                at = replace(self.problem, substeps=stage.substeps)
                place, misfit = STAGES.index(stage) + 1, _misfit(at, self.sensors, x)
                self.tell(Progress(start, self.starts, place, len(STAGES), evaluation, cost, misfit))

        return evaluated


def _misfit(problem: Problem, every: Mapping[str, Sensor], x: Floats) -> float:
    """See `Progress.misfit`."""
    at_noise = problem.weighted({name: sensor.noise for name, sensor in every.items()})
    return float(np.sqrt(np.mean(np.concatenate(at_noise.residuals(x)) ** 2)))


def fit(
    machine: Any,
    recordings: Any,
    *,
    hold: Collection[str] = (),
    also: Collection[str] = (),
    together: Sequence[Sequence[str]] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    starts: int | None = None,
    profiles: Collection[str] = (),
    seed: int = SEED,
    progress: Callable[[Progress], None] | None = None,
    **conditions: Any,
) -> Fit:
    """Estimate a machine's parameters from all ``estimate`` recordings at once, and judge it on the others.

    Free-running simulation; joint likelihood of all channels with each sensor's own noise, encoders as
    intervals; per recording what it has of its own: of a truck an offset of the oil temperature and the
    positions at the start. Least squares, of a truck on exact derivatives, tempered, along the canyon of
    what nearly makes up for one another (`forklift.fitting`).

    Parameters
    ----------
    machine, recordings
        As `forklift.diagnose` takes them: where the fit starts (another truck of the same make will do), and
        what was measured.
    hold, also, together
        Parameters left as they are (the drift of a clock, too), estimated besides the usual ones
        (of a truck the thesis's, see `forklift.plant.forklift.unknowns`), and groups that move together.
    bounds, priors
        By parameter its least and greatest value, and its mean and standard deviation, in its unit, where
        more is known than the tables say; the search starts from a prior's mean.
    starts
        How many starts: the machine itself and scattered ones. By default one, and if that leaves something
        over three, so that a search gone astray is not taken for missing physics.
    profiles
        Parameters whose profile likelihood is wanted.
    seed
        Of the scattered starts.
    progress
        Called after each evaluation. Ctrl-C ends the search and keeps the best so far.
    conditions
        Of a truck: ``oil_temperature_degc`` of recordings without one [°C]; ``load_width_kg``, the standard
        deviation of each entered load [kg], by default 0: the loads are right.

    Raises
    ------
    ForkliftError
        What the machine finds that its recordings cannot support: of a truck the errors of
        `forklift.plant.forklift.checks.suitability`; ``"parameter-unknown"``, ``"argument-invalid"``,
        ``"bounds-invalid"``, ``"prior-invalid"``; those of `forklift.compare`.
    """
    began = time.monotonic()
    arguments.names(hold=hold, also=also, together=together, profiles=profiles)
    for group in together:
        arguments.names(together=group)
        if len(group) < 2:
            raise ForkliftError(
                "argument-invalid",
                f"together has a group of {', '.join(group) or 'none'}, where parameters that move together "
                "are two or more; name the others too, or give it as also",
                name="together",
                value=list(group),
            )
    _check_numbers(starts, seed)
    entered, each, origin = given(machine, recordings, doubts=False, **conditions)
    model, kept, findings = entered.suited(each)
    every = model.sensors(kept)
    clocks = {one.name: one for one in model.clock_rates}
    moved = model.unknowns([name for name in hold if name not in clocks], also, together)
    if not moved:
        raise ForkliftError(
            "argument-invalid",
            "every parameter is held, so that there is nothing to fit; hold fewer",
            name="hold",
        )
    free = [one for name, one in clocks.items() if name not in hold]
    moved = tuple(constrained((*moved, *free), bounds or {}, priors or {}))
    _check_moved([*also, *(name for group in together for name in group)], moved)
    _check_profiles(profiles, moved)
    everyone = pose(model, kept, moved, every)
    problem = everyone.over(
        [
            found
            for found in everyone.samples
            if found.recording.role == "estimate" and set(model.driven(found.recording)) & set(model.parts)
        ]
    )
    stop = _Stop()
    ends = _search(problem, every, starts or 1, seed, progress, stop)
    known, judged = stop.finish(lambda: _judge(everyone, ends.best, every))
    if starts is None and not stop.asked and not all(seen.explained for seen in judged):
        ends = _search(problem, every, AGAIN, seed, progress, stop, earlier=ends)
        known, judged = stop.finish(lambda: _judge(everyone, ends.best, every))
    found = ends.best
    wide = max((widening(judged, part) for part in model.parts), default=1.0)
    before = stop.finish(lambda: replayed(entered, kept, origin))
    after = stop.finish(lambda: _fitted(model, kept, origin, everyone, found))
    result = Fit(
        model,
        origin,
        kept,
        moved,
        found,
        every,
        dict(found.problem.sigma),
        known,
        judged,
        ends.ends,
        (),
        (*findings.cautions, *clock_cautions(model.words, found.problem, found.x, known, wide)),
        before,
        after,
        stop.asked,
        0.0,
        {
            **conditions,
            "hold": _listed(hold),
            "also": _listed(also),
            "together": [[*group] for group in together],
            "bounds": {name: [*pair] for name, pair in (bounds or {}).items()},
            "priors": {name: [*pair] for name, pair in (priors or {}).items()},
            "starts": None if starts is None else int(starts),
            "profiles": _listed(profiles),
            "seed": int(seed),
        },
    )
    drawn: list[Profile] = []
    with stop.noticed():
        for name in () if stop.asked else profiles:
            if progress:
                starts, stages = len(ends.ends), len(STAGES)
                misfit = _misfit(found.problem, every, found.x)
                progress(Progress(starts - 1, starts, stages, stages, 0, found.cost, misfit, name))
            drawn.append(result.profile(name))
    seconds = time.monotonic() - began
    return replace(result, profiles=tuple(drawn), interrupted=stop.asked, seconds=seconds)


def _fitted(
    model: Subject, recordings: Sequence[Any], origin: Origin, everyone: LeastSquares, found: Found
) -> Comparison:
    """The comparison with the model as it was judged: see `forklift.fitting.predict`."""
    problem = everyone.weighted(found.problem.sigma, found.problem.substeps)
    predicted = predict_all(problem, settled_within(problem, found.x[: len(found.problem.unknowns)]))
    adjusted = [[one.names[k] for k in one.free] for one in problem.samples]
    return Comparison(model, origin, agreement(model, recordings, predicted, adjusted))


class _Stop:
    """Ctrl-C, once there is something to keep: it ends the search and the profiles, and nothing is lost."""

    def __init__(self) -> None:
        self.asked = False

    @contextmanager
    def noticed(self) -> Iterator[None]:
        """Leave the block at Ctrl-C, and go on behind it."""
        try:
            yield
        except KeyboardInterrupt:
            self.asked = True

    def finish(self, work: Callable[[], T]) -> T:
        """What `work` gives, little beside a search: done again after Ctrl-C; a second one ends it."""
        with self.noticed():
            return work()
        return work()


def _listed(names: Collection[str]) -> list[str]:
    """As they were given; a set, which has no order, by name."""
    return sorted(names) if isinstance(names, Set) else [*names]


def _check_numbers(starts: int | None, seed: int) -> None:
    arguments.whole("seed", seed)
    if starts is not None and arguments.whole("starts", starts) < 1:
        raise ForkliftError(
            "argument-invalid",
            f"a fit needs a start, and {starts} are asked for; ask for one or more",
            name="starts",
            value=starts,
            lower=1,
        )


def _check_moved(names: Sequence[str], moved: Sequence[Unknown]) -> None:
    """What is asked to move does, and once: a table as a whole or a lift without recordings cannot."""
    every = [name for unknown in moved for name in unknown.names]
    for name in names:
        if name not in every:
            near = get_close_matches(name, every, n=1, cutoff=0.0)[0]
            raise ForkliftError(
                "argument-invalid",
                f"{name} is not estimated, by itself or in a group; did you mean {near}?",
                name=name,
            )
    for name in every:
        if every.count(name) > 1:
            raise ForkliftError(
                "argument-invalid", f"{name} is in two groups that move together; make them one", name=name
            )


def _check_profiles(names: Collection[str], moved: Sequence[Unknown]) -> None:
    """Before the search: a profile can be had of what is estimated only."""
    known = [unknown.name for unknown in moved]
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
            raise ForkliftError(
                "parameter-unknown",
                f"{name} is not estimated, so that it has no profile; did you mean {near}?",
                name=name,
            )


def _search(
    problem: LeastSquares,
    every: Mapping[str, Sensor],
    starts: int,
    seed: int,
    progress: Callable[[Progress], None] | None,
    stop: _Stop,
    earlier: Ends | None = None,
) -> Ends:
    """The best of some starts, and how the others compare; after Ctrl-C, of those that were begun."""
    watch = _Watch(problem, every, progress, starts)
    done = [earlier.best] if earlier else []
    with stop.noticed():
        return from_starts(problem, every, starts, seed, watch.of, done[0] if done else None)
    begun = [*done, *(settle(problem, x, every) for _, _, x in watch.best.values())]
    if not begun:
        raise KeyboardInterrupt
    ends = compare_ends(begun, begun)
    evaluations = watch.evaluations + sum(found.evaluations for found in done)
    return replace(ends, best=replace(ends.best, evaluations=evaluations))


def _judge(
    problem: LeastSquares, found: Found, every: Mapping[str, Sensor]
) -> tuple[Knowledge, tuple[ChannelResidual, ...]]:
    with one_thread():
        known = knowledge(found.problem, found.x)
        theta = found.x[: len(problem.unknowns)]
        weighted = found.problem.over(problem.samples)
        return known, tuple(judge(weighted, theta, known.covariance, every))

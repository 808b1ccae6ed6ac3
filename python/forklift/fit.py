"""Fit a truck to a campaign: all that the thesis estimated, with what is known of it and what is not."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.compare import Comparison, compare
from forklift.errors import ForkliftError
from forklift.estimation import words
from forklift.estimation.algebra import one_thread
from forklift.estimation.judgement import Judged, judge
from forklift.estimation.knowledge import Knowledge, knowledge
from forklift.estimation.problem import Problem, sample
from forklift.estimation.profile import Profile, profile
from forklift.estimation.search import STAGES, Found, Stage, settle
from forklift.estimation.sensors import Sensor, sensors
from forklift.estimation.starts import End, Ends, from_starts
from forklift.estimation.suitability import Caution, suitability
from forklift.estimation.unknowns import Unknown, move, unknowns
from forklift.names import Lift, commanded
from forklift.truck import Truck

if TYPE_CHECKING:
    from forklift.campaign import Campaign
    from forklift.fits import Floats

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
    misfit: float
    """Root mean square of the residuals, in units of the sensors' noise."""
    cost: float
    """−ln posterior with the stage's weights."""


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """What `fit` gives; `write` puts all of it into a folder."""

    campaign: Campaign
    start: Truck
    truck: Truck
    """The fitted truck; its moved values carry their 95 % interval in their source."""
    lifts: tuple[Lift, ...]
    """The lifts that were fitted: those that some recording commands."""
    unknowns: tuple[Unknown, ...]
    found: Found
    sensors: dict[str, Sensor]
    noise: dict[str, float]
    """What each channel was weighted by, in its unit; of an encoder the softness of its edges."""
    knowledge: Knowledge
    judged: tuple[Judged, ...]
    """Every channel of every recording, against the sensors' noise."""
    ends: tuple[End, ...]
    profiles: tuple[Profile, ...]
    cautions: tuple[Caution, ...]
    before: Comparison
    after: Comparison
    interrupted: bool
    seconds: float

    @property
    def held_out(self) -> tuple[Judged, ...]:
        """What is judged on: `validate` recordings, or without any, all."""
        judged = tuple(found for found in self.judged if found.role == "validate")
        return judged or self.judged

    @property
    def complete(self) -> bool:
        """Whether the truck explains all that is judged to the sensors' noise."""
        return all(found.explained for found in self.held_out)

    @cached_property
    def verdict(self) -> tuple[str, ...]:
        """In plain sentences: how good the fit is, what it leaves over and where, what it cannot tell."""
        return words.verdict(self)

    def profile(self, name: str) -> Profile:
        """The profile likelihood of one parameter (a minute's work for thirty of them).

        Raises
        ------
        ForkliftError
            ``"parameter-unknown"`` if it was not estimated.
        """
        names = [unknown.name for unknown in self.unknowns]
        if name not in names:
            raise ForkliftError(
                "parameter-unknown",
                f"{name} was not estimated; profiles can be had of {', '.join(names)}",
                name=name,
            )
        k = names.index(name)
        return profile(self.found.problem, self.found.x, k, self.knowledge.estimates[k].deviation)

    def __repr__(self) -> str:
        return (
            f"Fit({self.campaign.name!r}, {len(self.unknowns)} unknowns, "
            f"{'complete' if self.complete else 'something left over'}, {self.seconds:.1f} s)"
        )

    def __str__(self) -> str:
        return "\n".join(self.verdict)


@dataclass
class _Watch:
    """Turns the search's progress into the caller's, and keeps the last good point for Ctrl-C."""

    tell: Callable[[Progress], None] | None
    starts: int
    samples: int
    last: Floats | None = None

    def of(self, start: int) -> Callable[[Stage, int, float, Floats], None]:
        def evaluated(stage: Stage, evaluation: int, cost: float, x: Floats) -> None:
            if start == 0:
                self.last = x.copy()
            if self.tell:
                misfit = stage.temper * float(np.sqrt(2.0 * cost / max(self.samples, 1)))
                place = STAGES.index(stage) + 1
                self.tell(Progress(start, self.starts, place, len(STAGES), evaluation, misfit, cost))

        return evaluated


def fit(
    campaign: Campaign,
    truck: Truck,
    *,
    hold: Collection[str] = (),
    also: Collection[str] = (),
    together: Sequence[Sequence[str]] = (),
    load_width_kg: float = 0.0,
    oil_temperature_degc: float | None = None,
    starts: int | None = None,
    profiles: Collection[str] = (),
    seed: int = SEED,
    progress: Callable[[Progress], None] | None = None,
) -> Fit:
    """Estimate the truck's parameters from all ``estimate`` recordings at once, and judge it on the others.

    Free-running simulation of both lifts; joint likelihood of positions (encoders as intervals), pressures
    and fork height with each sensor's own noise; per recording an offset of the oil temperature and the
    positions at the start. Least squares on exact derivatives, tempered, along the canyon of what nearly
    makes up for one another (`forklift.estimation`).

    Parameters
    ----------
    campaign, truck
        What was measured, and where the fit starts: another truck of the same make will do.
    hold, also, together
        Parameters left as they are, estimated besides the thesis's, and groups that move together
        (`forklift.estimation.unknowns`).
    load_width_kg
        Standard deviation of each recording's entered load [kg]; 0: the loads are right.
    oil_temperature_degc
        For recordings without an oil temperature [°C].
    starts
        How many starts: the truck itself and scattered ones. By default one, and if that leaves something
        over three, so that a search gone astray is not taken for missing physics.
    profiles
        Parameters whose profile likelihood is wanted.
    seed
        Of the scattered starts.
    progress
        Called after each evaluation. Ctrl-C ends the search and keeps the best so far.

    Raises
    ------
    ForkliftError
        Those of `forklift.estimation.suitability` if the campaign cannot support a fit;
        ``"parameter-unknown"``, ``"argument-invalid"``; those of `forklift.simulate.predict`.
    """
    began = time.monotonic()
    suited = suitability(campaign.recordings, truck)
    every = sensors(campaign.recordings)
    moved = unknowns(truck, suited.lifts, hold=hold, also=also, together=together)
    if not moved:
        raise ForkliftError(
            "argument-invalid",
            "every parameter is held, so that there is nothing to fit; hold fewer",
            name="hold",
        )
    conditions: dict[str, Any] = {
        "load_width_kg": load_width_kg,
        "oil_temperature_degc": oil_temperature_degc,
    }
    samples = tuple(sample(found, truck, every, **conditions) for found in campaign.recordings)
    fitted = tuple(
        found
        for found in samples
        if found.recording.role == "estimate" and set(commanded(found.recording.lift)) & set(suited.lifts)
    )
    problem = Problem(truck, moved, fitted, substeps=4)
    everyone = replace(problem, samples=samples)
    ends, interrupted = _search(problem, every, starts or 1, seed, progress)
    known, judged = _judge(everyone, ends.best, every)
    if starts is None and not interrupted and not all(seen.explained for seen in judged):
        ends, interrupted = _search(problem, every, AGAIN, seed, progress, earlier=ends.best)
        known, judged = _judge(everyone, ends.best, every)
    found = ends.best
    best = _fitted_truck(campaign, truck, moved, found, known)
    result = Fit(
        campaign,
        truck,
        best,
        suited.lifts,
        moved,
        found,
        every,
        dict(found.problem.sigma),
        known,
        judged,
        ends.ends,
        (),
        suited.cautions,
        compare(campaign, truck, oil_temperature_degc=oil_temperature_degc),
        compare(campaign, best, oil_temperature_degc=oil_temperature_degc),
        interrupted,
        0.0,
    )
    drawn = () if interrupted else tuple(result.profile(name) for name in profiles)
    return replace(result, profiles=drawn, seconds=time.monotonic() - began)


def _search(
    problem: Problem,
    every: Mapping[str, Sensor],
    starts: int,
    seed: int,
    progress: Callable[[Progress], None] | None,
    earlier: Found | None = None,
) -> tuple[Ends, bool]:
    """The best of some starts; and whether Ctrl-C ended it before its time."""
    count = sum(len(seen.rows) for found in problem.samples for seen in found.observed)
    watch = _Watch(progress, starts, count)
    try:
        return from_starts(problem, every, starts, seed, watch.of, earlier), False
    except (KeyboardInterrupt, ForkliftError) as error:
        if isinstance(error, ForkliftError) and error.code != "interrupted":
            raise
        if earlier is None and watch.last is None:
            raise
        best = earlier or settle(problem, watch.last, every)  # type: ignore[arg-type]
        return Ends(best, (End(0, 0.0, 0.0, True),)), True


def _judge(
    problem: Problem, found: Found, every: Mapping[str, Sensor]
) -> tuple[Knowledge, tuple[Judged, ...]]:
    with one_thread():
        known = knowledge(found.problem, found.x)
        theta = found.x[: len(problem.unknowns)]
        weighted = replace(found.problem, samples=problem.samples)
        return known, tuple(judge(weighted, theta, known.covariance, every))


def _fitted_truck(
    campaign: Campaign, start: Truck, moved: Sequence[Unknown], found: Found, known: Knowledge
) -> Truck:
    """The truck at the optimum; each moved value has its interval as its source."""
    from_campaign = f"estimated from campaign {campaign.name} (sha256 {campaign.sha256[:12]})"
    truck = move(start, moved, found.x[: len(moved)], from_campaign)
    sources = dict(truck.sources)
    for estimate in known.estimates:
        for name in estimate.unknown.names:
            if name not in sources:
                continue  # a knot: its table is one value in the file, and its interval stands in fit.json
            sources[name] = (
                f"{from_campaign}, 95 % interval {estimate.lower:.6g} to {estimate.upper:.6g}"
                if estimate.told
                else f"not told by campaign {campaign.name} alone; near {start.name}'s by its prior"
            )
    return Truck(f"{campaign.name} fitted from {start.name}", truck.values, sources)

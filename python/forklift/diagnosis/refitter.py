"""Fits the whole problem anew with a set of hypotheses, in stages, and judges it on recordings held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.diagnosis.criteria import (
    ALIKE,
    BEHIND,
    CLEARLY,
    ENDED,
    LATER,
    LEAST_ROUGH,
    LESS,
    LIVES_UP,
    MISFIT,
    MOVES,
    MUCH,
    NEAR,
    SETTLED,
    SLIGHT,
    TWICE,
)
from forklift.diagnosis.hypothesis import carry, with_hypotheses
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.screening import loo_log_scores
from forklift.diagnosis.unfinished import Unfinished
from forklift.fitting.interface import Problem, Recording
from forklift.fitting.intervals import Knowledge, covariance_at_noise, knowledge
from forklift.fitting.nuisance import sought
from forklift.fitting.problem import LeastSquares
from forklift.fitting.residuals import ChannelResidual, judge
from forklift.fitting.search import STAGES, Found, Stage, ended
from forklift.fitting.work import Work
from forklift.plant.parameter import Unknown
from forklift.plant.protocol import Hypothesis
from forklift.recordings.noise import Sensor

ROUGH = tuple(replace(stage, share=SETTLED) for stage in STAGES[:2])
FINE = (replace(STAGES[2], share=0.5 * SETTLED), *(replace(one, gain=ENDED) for one in STAGES[3:]))
"""The race is run over the tempered stages; only who is still in it goes on to the sensors' own noise."""
AGAIN = ROUGH[1:]
QUICK = tuple(replace(stage, evaluations=6) for stage in ROUGH)
"""For who is tried beside what explains everything: who explains as much is nearly there by then."""
SETTLING = (replace(STAGES[2], evaluations=8),)
"""A fit that clearly misses something need not go to the last: it crawls, and gains nothing."""
FINEST = replace(STAGES[-1], substeps=32, evaluations=6)
AFTER_SEEKING = 2
"""How often recordings held out are linearised anew, once what is their own was sought with all else held."""
OVER_ALL = replace(STAGES[-1], evaluations=12, gain=ENDED)
"""From a fit that explains all recordings, or all that were fitted. A fit that had not ended there would let
hypotheses promise what it still had to gain."""


Which = Callable[[Recording], bool]
"""Whether a recording is judged."""

Bars = tuple[float, float]
"""What −ln posterior must come down to in each of the tempered stages, or the trial is given up."""
NO_BARS: Bars = (float("inf"), float("inf"))


class First(NamedTuple):
    """Where the first tempered stage ended."""

    hypotheses: Sequence[Hypothesis]
    found: Found


@dataclass(frozen=True)
class Refitter:
    """All that refits have in common."""

    start: LeastSquares
    """Over the recordings to be fitted, at the start truck."""
    everyone: LeastSquares
    """The same over all recordings."""
    sensors: Mapping[str, Sensor]
    strict: bool = False
    """Whether recordings held out may move parameters only as far as a complete model's would be uncertain,
    and not by what the fit leaves over: where that is large, a wrong model's would explain anything. What
    they have of their own is then sought to the end."""
    later: float = LATER
    """Share of what is left over that an explanation beside another must remove."""

    held: tuple[Unknown, ...] = ()
    """Parameters that no recording tells, so that no refit moves them."""
    unfinished: Unfinished = field(default_factory=Unfinished)
    """What was searched for already."""
    known: dict[Refit, Found] = field(default_factory=dict, compare=False, repr=False)
    """What `everywhere` found."""

    @property
    def together(self) -> float:
        """How many times as much as white noise the slowest of the sensors' noise promises by chance."""
        return max(sensor.together for sensor in self.sensors.values())

    @property
    def work(self) -> Work:
        """What all refits together have computed."""
        return self.start.work

    def search(self, problem: Any, x: Floats, stages: tuple[Stage, ...], bars: Sequence[float] = ()) -> Found:
        """See `forklift.fitting.search.search`."""
        return self.unfinished.search(problem, x, self.sensors, stages, bars)

    def beside(self, hypotheses: Sequence[Hypothesis], after: Refit, bars: Bars = NO_BARS) -> Refit:
        """The second tempered stage alone, from where another refit left it: a curve acts nearly linearly."""
        problem, x = self._from(hypotheses, after)
        found = self.search(problem, x, AGAIN, bars[1:])
        return self._stopped(hypotheses, found, (after.costs[0], found.cost))

    def rough(
        self, hypotheses: Sequence[Hypothesis], after: Refit | None = None, bars: Bars = NO_BARS
    ) -> Refit:
        """The tempered stages, cold from the start machine or from where another refit left them; given up
        where they will not come down to `bars`."""
        return self._led_on(self._first(hypotheses, after, bars), bars)

    def quick(self, hypotheses: Sequence[Hypothesis], after: Refit, bars: Bars) -> Refit:
        """A few evaluations from where another refit left them; fewer where the first ones do not come down
        to the first of `bars`."""
        found = self.search(*self._from(hypotheses, after), QUICK[:1])
        if found.cost > bars[0]:
            return self._stopped(hypotheses, found, (found.cost, np.inf))
        return self._led_on(First(hypotheses, found), stages=QUICK[1:])

    def ahead(
        self,
        several: Sequence[tuple[Hypothesis, ...]],
        after: Refit,
        promised: float = np.inf,
        bars: Bars = NO_BARS,
        *,
        again: bool = True,
    ) -> Refit:
        """Who comes furthest in the tempered stages: the first of several sets of hypotheses from where
        another refit left them; and `again` all of them from the start machine too, unless the first gains
        nearly the share of the cost that was promised, or leaves little over, or no work is left.

        Either start can end astray where the other does not.
        """
        warm = self._led_on(self._first(several[0], after, bars), bars)
        gained = 1.0 - warm.rough / after.rough
        enough = gained >= LIVES_UP * promised or warm.excess <= MUCH * after.excess
        if enough or not again or self.work.spent:
            return warm
        cold = self.cold(several, after, bars)
        return replace(min(warm, cold, key=lambda one: one.rough), cold=True)

    def cold(self, several: Sequence[tuple[Hypothesis, ...]], beside: Refit, bars: Bars = NO_BARS) -> Refit:
        """The tempered stages from the start machine; of what stands beside names also with these as large as
        they were told: who comes furthest."""
        starts: list[Refit | None] = [None, beside] if beside.hypotheses else [None]
        firsts = [
            self._begun(hypotheses, self._at_start(hypotheses, as_told), bars)
            for hypotheses in several
            for as_told in starts
        ]
        return replace(self._furthest(firsts, bars), cold=True)

    def _at_start(self, hypotheses: Sequence[Hypothesis], as_told: Refit | None) -> tuple[Problem, Floats]:
        """The start machine, with the names of a refit as that told them."""
        problem, x = self._from(hypotheses)
        if as_told:
            own = {one.name for each in as_told.hypotheses for one in each.addition.free}
            told = carry(as_told.early.x, as_told.early.problem, problem)
            kept = [place for place, one in enumerate(problem.unknowns) if one.name in own]
            x[kept] = told[kept]
        return problem, x

    def afresh(self, refit: Refit) -> Refit:
        """The same hypotheses from the start machine, to the end; the refit itself if it came from there."""
        first = self._first(refit.hypotheses)
        return refit if first.found.cost == refit.costs[0] else self.finish(self._led_on(first))

    def slightly(self, hypotheses: Sequence[Hypothesis], after: Refit) -> Refit:
        """From where a refit ended that leaves little over, at the sensors' own noise: what hardly shows in
        any channel is nothing to the tempered stages. If it left nothing, all recordings are asked how well
        the others foretell them; and beside what they led, they lead too."""
        problem = with_hypotheses(self.start, hypotheses)
        x = carry(after.found.x, after.found.problem, problem)
        found = self.search(problem, x, FINE[-1:])
        refit = self._judged(hypotheses, found, after.costs, early=after.early, finished=True)
        if not after.quiet:
            return refit
        new = [hypothesis for hypothesis in hypotheses if hypothesis not in after.hypotheses]
        refit = self._led(refit) if after.pooled else self.pooled(refit, nearly=True)
        everywhere = self.everywhere(after)
        scores = loo_log_scores(everywhere.problem, everywhere.x, new).tolist()
        if sum(scores) >= CLEARLY:
            refit = self.asked(refit, new)
        files = [sample.recording.file for sample in everywhere.problem.samples]
        return replace(refit, foretold=dict(zip(files, scores, strict=True)))

    def by_all(self, hypotheses: Sequence[Hypothesis], after: Refit) -> Refit:
        """Led by all recordings from where these led another refit, where those held out alone show what it
        leaves over: those that were fitted would say nothing of a cushion that none of them met."""
        there = self.everywhere(after)
        problem = with_hypotheses(self.everyone, hypotheses)
        over_all = self.search(problem, carry(there.x, there.problem, problem), AGAIN + FINE)
        fitted = with_hypotheses(self.start, hypotheses)
        fitted = fitted.weighted(over_all.problem.sigma, over_all.problem.substeps)
        return self._at(over_all, hypotheses, fitted, after)

    def asked(self, refit: Refit, new: Sequence[Hypothesis]) -> Refit:
        """The same where all recordings lead it, if these tell what is new of it and those that were fitted
        do not: those may be few. Of what hardly more than raises an alarm those that were fitted must tell by
        themselves: it may be the other law of what was found before."""
        if self.strict or not refit.complete or all(refit.clear(one) for one in new):
            return refit
        led = self._led(refit)
        return led if led.complete and all(led.clear(one) for one in new) else refit

    def _first(
        self, hypotheses: Sequence[Hypothesis], after: Refit | None = None, bars: Bars = NO_BARS
    ) -> First:
        return self._begun(hypotheses, self._from(hypotheses, after), bars)

    def _begun(
        self, hypotheses: Sequence[Hypothesis], at: tuple[Problem, Floats], bars: Sequence[float]
    ) -> First:
        """The first tempered stage from there."""
        return First(hypotheses, self.search(*at, ROUGH[:1], bars[:1]))

    def _furthest(self, firsts: Sequence[First], bars: Bars) -> Refit:
        """Led on by the second stage, without those that are clearly behind after the first."""
        least = min(first.found.cost for first in firsts)
        near = [first for first in firsts if first.found.cost <= max(BEHIND * least, least + BEHIND)]
        return min((self._led_on(first, bars) for first in near), key=lambda one: one.rough)

    def _led_on(self, first: First, bars: Bars = NO_BARS, stages: tuple[Stage, ...] = AGAIN) -> Refit:
        found = self.search(first.found.problem, first.found.x, stages, bars[1:])
        return self._stopped(first.hypotheses, _after(first.found, found), (first.found.cost, found.cost))

    def _from(self, hypotheses: Sequence[Hypothesis], after: Refit | None = None) -> tuple[Problem, Floats]:
        problem = with_hypotheses(self.start, hypotheses)
        x = carry(after.early.x, after.early.problem, problem) if after else np.zeros(problem.starts[-1])
        return problem, x

    def baseline(self) -> Refit:
        """The machine without any hypothesis."""
        return self.pooled(self.finish(self.rough(())))

    def pooled(self, refit: Refit, *, nearly: bool = False) -> Refit:
        """The same, led on by all recordings, if those that were fitted are explained, those held out are
        not, and one machine explains them all; `nearly`: or leaves less over.

        Recordings held out may reach beyond those fitted: a friction that no light load was fitted for lies
        anywhere. What one machine says of all of them is then no mismatch.
        """
        if self.strict or refit.complete or self._misses(refit.found):
            return refit
        if not all(one.explained for one in refit.rest()):
            return refit
        led = self._led(refit)
        better = led.complete or (nearly and led.squares < refit.squares)
        return led if better else refit

    def _led(self, refit: Refit) -> Refit:
        """The same where all recordings lead it, with what these tell of its numbers."""
        led = self._at(self.everywhere(refit), refit.hypotheses, refit.found.problem, refit)
        return replace(led, cold=refit.cold)

    def _at(self, over_all: Found, hypotheses: Sequence[Hypothesis], problem: Problem, after: Refit) -> Refit:
        """Where a search over all recordings ended, judged as a refit of `problem`, which has those that are
        fitted; with what all of them tell of its numbers."""
        places = {one.recording.file: k for k, one in enumerate(over_all.problem.samples)}
        x = np.zeros(problem.starts[-1])
        for k, sample in enumerate(problem.samples):
            x[problem.columns(k)] = over_all.x[over_all.problem.columns(places[sample.recording.file])]
        found = ended(problem, x, after.found.evaluations + over_all.evaluations)
        led = self._judged(hypotheses, found, after.costs, early=after.early, finished=True)
        return replace(led, pooled=True, knowledge=knowledge(over_all.problem, over_all.x))

    def _misses(self, found: Found) -> bool:
        """Whether a search leaves so much over in a channel of a recording that was fitted, that no judgement
        will find it explained."""
        problem = found.problem
        squares = [
            np.mean((seen.left(said[seen.sensor.channel]) / self.sensors[seen.sensor.channel].noise) ** 2)
            for sample, said in zip(problem.samples, problem.said(found.x), strict=True)
            for seen in sample.observed
        ]
        return bool(max(squares) > SLIGHT)

    def everywhere(self, refit: Refit) -> Found:
        """The same machine fitted to all recordings, those held out too, with substeps no longer than it had:
        else the simulation's own error would show."""
        if refit not in self.known:
            self.known[refit] = self._everywhere(refit)
        return self.known[refit]

    def _everywhere(self, refit: Refit) -> Found:
        told = refit.found
        problem = with_hypotheses(self.everyone, refit.hypotheses).weighted(
            told.problem.sigma, told.problem.substeps
        )
        shared = len(problem.unknowns)
        x = np.zeros(problem.starts[-1])
        x[:shared] = told.x[:shared]
        others = []  # those held out begin at what was entered
        for k, sample in enumerate(problem.samples):
            fitted = [one.recording is sample.recording for one in told.problem.samples]
            if any(fitted):
                own = problem.columns(k)[len(problem.unknowns) :]
                x[own] = told.x[told.problem.columns(fitted.index(True))[shared:]]
            elif len(sample.free):
                others.append(k)
        if others:
            held = problem.over([problem.samples[k] for k in others])
            found = sought(held, held.at(x))
            for j, k in enumerate(others):
                x[problem.columns(k)] = found[held.columns(j)]
        stage = replace(OVER_ALL, substeps=max(OVER_ALL.substeps, told.problem.substeps))
        return self.search(problem, x, (stage,))

    def gained(self, before: Refit, after: Refit) -> float:
        """How far −ln posterior of all recordings falls from one refit to another, each with its numbers at
        their best, and both with the same weights: the larger of theirs."""
        both = self.everywhere(before), self.everywhere(after)
        weights = [found.problem.sigma for found in both]
        sigma = {name: max(one[name] for one in weights) for name in weights[0]}
        substeps = max(found.problem.substeps for found in both)
        ends = [ended(one.problem.weighted(sigma, substeps), one.x, one.evaluations) for one in both]
        return ends[0].cost - ends[1].cost

    def finish(self, refit: Refit) -> Refit:
        """The last stages, all of them only if nothing may be missing any more; and the judgement."""
        early, clearly = refit.early, refit.worst.mean_square >= MISFIT
        done = self._ended(refit, early, SETTLING if clearly else FINE[:1])
        missed = done.worst.mean_square >= MISFIT
        if missed and (clearly or not self._felt(done, FINE[1].substeps)):
            return done
        done = self._ended(refit, done.found, FINE if clearly else FINE[1:])
        return done if done.complete else self.pooled(self.finer(done))

    def _ended(self, refit: Refit, at: Found, stages: tuple[Stage, ...]) -> Refit:
        """The refit after these stages from there, judged."""
        found = self.search(at.problem, at.x, stages)
        ended = self._judged(
            refit.hypotheses, _after(at, found), refit.costs, early=refit.early, finished=True
        )
        return replace(ended, cold=refit.cold)

    def finer(self, refit: Refit) -> Refit:
        """The same with shorter substeps, if what is left over is the simulation's own error.

        The recording that is missed most is judged first: what it still leaves over, no other can make up
        for.
        """
        if not self._felt(refit, FINEST.substeps):
            return refit
        problem = refit.found.problem.weighted(refit.found.problem.sigma, FINEST.substeps)
        finest = replace(refit.found, problem=problem)
        file, bar = refit.worst.file, LESS * refit.worst.mean_square
        first = self.residuals_of(refit.hypotheses, finest, refit.knowledge, lambda one: one.file == file)
        if max(one.mean_square for one in first) > bar:
            return refit
        exact = self._judged(refit.hypotheses, finest, refit.costs, early=refit.early, finished=True)
        if exact.worst.mean_square > bar:
            return refit
        found = self.search(problem, refit.found.x, (FINEST,))
        return self._judged(
            refit.hypotheses, _after(refit.found, found), refit.costs, early=refit.early, finished=True
        )

    def _felt(self, refit: Refit, substeps: int) -> bool:
        """Whether so many substeps might change what is left over."""
        problem = refit.found.problem.weighted(refit.found.problem.sigma, substeps)
        worth = (1.0 - np.sqrt(LESS)) * np.sqrt(refit.worst.mean_square)
        return bool(TWICE * self._apart(refit.found, problem) > worth)

    def _apart(self, found: Found, finer: Problem) -> float:
        """How far shorter substeps move what the model says of a recording that was fitted, at most: root of
        the mean square over a channel, in units of its sensor's noise."""
        pairs = zip(found.problem.said(found.x), finer.said(found.x), strict=True)
        moved = [
            float(np.sqrt(np.mean((said - other[name]) ** 2))) / self.sensors[name].noise
            for one, other in pairs
            for name, said in one.items()
            if len(said)
        ]
        return max(moved, default=0.0)

    def without(self, hypothesis: Hypothesis, refit: Refit) -> Refit:
        """The same refit without one of its hypotheses, from where it ended."""
        rest = tuple(one for one in refit.hypotheses if one is not hypothesis)
        problem = with_hypotheses(self.start, rest)
        x = carry(refit.found.x, refit.found.problem, problem)
        found = self.search(problem, x, AGAIN)
        return self.finish(self._stopped(rest, found, (np.inf, found.cost)))

    def simpler(self, refit: Refit, before: Refit) -> Refit | None:
        """The hypotheses of `before` alone, searched for again from where a refit with more of them ended.

        None, unless that gains half of what the refit gained: the search that led to `before` had then gone
        astray, and the refit is no better for what it has more. (Of the cost itself half may be out of reach:
        most of it may be the sensors' noise.)
        """
        problem = with_hypotheses(self.start, before.hypotheses)
        x = carry(refit.early.x, refit.early.problem, problem)
        bar = before.rough - max(ALIKE * (before.rough - refit.rough), LEAST_ROUGH)
        found = self.search(problem, x, AGAIN, (bar,))
        if found.cost > bar:
            return None
        first = self.search(problem, found.x, (replace(ROUGH[0], evaluations=1),)).cost
        return self.finish(self._stopped(before.hypotheses, found, (first, found.cost)))

    def _stopped(self, hypotheses: Sequence[Hypothesis], found: Found, costs: tuple[float, float]) -> Refit:
        """Judged as it stands after the tempered stages."""
        return self._judged(hypotheses, found, costs, early=found, finished=False)

    def _judged(
        self,
        hypotheses: Sequence[Hypothesis],
        found: Found,
        costs: tuple[float, float],
        *,
        early: Found,
        finished: bool,
    ) -> Refit:
        with one_thread():
            known = knowledge(found.problem, found.x)
        roles = {one.recording.role for one in self.everyone.samples}
        told = self.residuals_of(hypotheses, found, known, _held if "validate" in roles else _fitted)
        left = _left_at(found.problem.sigma, told, self.sensors) if self.strict else None

        def rest() -> tuple[ChannelResidual, ...]:
            if "validate" not in roles:
                return ()
            return self.residuals_of(hypotheses, found, known, _fitted, at=None if self.strict else found.x)

        return Refit(
            tuple(hypotheses), found, known, told, costs, finished, early, left, rest=rest, held=self.held
        )

    def residuals_of(
        self,
        hypotheses: Sequence[Hypothesis],
        found: Found,
        known: Knowledge,
        which: Which,
        at: Floats | None = None,
    ) -> tuple[ChannelResidual, ...]:
        """Recordings, judged by a search's end and what is known there of the parameters; `at`: where what is
        their own was found."""
        everyone = with_hypotheses(self.everyone, hypotheses).weighted(
            found.problem.sigma, found.problem.substeps
        )
        asked = everyone.over([one for one in everyone.samples if which(one.recording)])
        theta = found.x[: len(found.problem.unknowns)]
        with one_thread():
            if self.strict:
                granted = covariance_at_noise(found.problem, found.x, self.sensors)
                return tuple(judge(asked, theta, granted, self.sensors, far=NEAR, moves=MOVES))
            seek, moves = sought, AFTER_SEEKING
            return tuple(judge(asked, theta, known.covariance, self.sensors, moves=moves, seek=seek, at=at))


def _held(recording: Recording) -> bool:
    return recording.role == "validate"


def _fitted(recording: Recording) -> bool:
    return recording.role != "validate"


def _left_at(
    weights: Mapping[str, float], judged: Sequence[ChannelResidual], sensors: Mapping[str, Sensor]
) -> float:
    """Mean square left over on what is held out, in units of these weights."""
    held = [found for found in judged if found.role == "validate"] or judged
    scale = {name: sensors[name].noise / weight for name, weight in weights.items()}
    square = sum(found.samples * found.mean_square * scale[found.channel] ** 2 for found in held)
    return square / sum(found.samples for found in held)


def _after(before: Found, found: Found) -> Found:
    """With the evaluations of both searches."""
    return replace(found, evaluations=before.evaluations + found.evaluations)

"""Hypotheses without a name: free curves where the mismatch is, ranked by their evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.criteria import (
    ALARM_CURVE,
    ALARM_ROUNDED,
    CURVE_NEAR,
    CURVE_TIE,
    CURVES_AT,
    FAINT_CURVES,
    MOST_CURVES,
    MOST_NOW,
    MOST_PAST,
    MOST_PLACES,
    MOVES_AT_ALL,
    NEAR_PLACES,
    STANDS,
)
from forklift.diagnosis.dependence import Dependence, dependences
from forklift.diagnosis.foreseen import foreseen
from forklift.diagnosis.locate import UnknownInput, hats, unknown_inputs
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.screening import Screened, Screening, screen, screen_both
from forklift.fitting.interface import Problem
from forklift.fitting.search import Found
from forklift.plant.protocol import Hypothesis, Machine, Place


@dataclass(frozen=True)
class FreeCurves:
    """Offers free curves for what a fitted model leaves over.

    Attributes
    ----------
    machine
        Whose places and variables there are.
    known
        Unknown inputs that were estimated already, by refit; more are kept here.
    """

    machine: Machine
    known: dict[Refit, Sequence[UnknownInput]]
    offered: dict[Refit, list[Screened]] = field(default_factory=dict)
    """What was offered already, by refit."""
    weighed: dict[tuple[Refit, bool], tuple[Found, Screening]] = field(default_factory=dict)
    """What was screened to mend a refit's law, and where; by refit, and whether slow noise was taken off."""
    made: dict[Hypothesis, tuple[str, float, float]] = field(default_factory=dict)
    """Of every curve its variable, and from where to where it goes."""

    def __call__(self, refit: Refit) -> list[Screened]:
        """The curves whose evidence is greatest beside what the refit has: at the most credible places, over
        every variable. Beside nothing also what is no curve, at every place that is nearly as credible as the
        first."""
        if refit not in self.offered:
            self.offered[refit] = self._offered(refit)
        return self.offered[refit]

    def _offered(self, refit: Refit) -> list[Screened]:
        inputs = self._inputs(refit)
        places = self._first(refit, inputs)[: len(credible(inputs))]
        offered = self._curves(refit, refit.told_from, places)
        if not refit.hypotheses:
            near = [one.port for one in credible(inputs) if one.evidence >= CURVE_NEAR * inputs[0].evidence]
            samples = refit.early.problem.samples
            further = [one for port in near for one in self.machine.unnamed(self._place(port), samples)]
            offered += [one for place, one in enumerate(further) if one not in further[:place]]
        at = refit.told_from
        told = screen(at.problem, at.x, offered, 0, slow=refit.quiet).ranked
        ranked = sorted(told, key=lambda one: -one.evidence)
        worth = [one for one in ranked if one.evidence >= CURVE_NEAR * ranked[0].evidence > 0.0]
        return self._in_order(worth)[:MOST_CURVES]

    def _in_order(self, worth: Sequence[Screened]) -> list[Screened]:
        """Those that yield last. Of one variable's curves that stand for each other, that at the place which
        the machine names first goes first."""
        if not worth:
            return []
        behind = {one: self.yields_to(one, worth[0]) for one in worth}
        first = min(worth, key=lambda one: behind[one])
        names = [place.name for place in self.machine.places]

        def key(one: Screened) -> tuple[bool, bool, int]:
            curve, places = one.hypotheses[0], self.machine.acted_on(one.hypotheses[0])
            alike = curve.over == first.hypotheses[0].over != "" and bool(places)
            level = alike and not behind[one] and one.evidence >= STANDS * first.evidence
            return behind[one], not level, min(map(names.index, places)) if level else 0

        return sorted(worth, key=key)

    def faint(self, refit: Refit, everywhere: Found) -> Screened | None:
        """The curve of the greatest evidence over all recordings, of those that have the greatest over the
        recordings that were fitted, beside a refit that leaves next to nothing over in any channel: the
        coarsest over every variable, at the most credible places. What counts there is what is `heard` of it.
        """
        places = [self._place(one.port) for one in credible(self._inputs(refit))]
        at = refit.found
        offered = self._curves(refit, at, places, most=1)
        ranked = sorted(screen(at.problem, at.x, offered, 0, slow=True).ranked, key=lambda one: -one.evidence)
        first = [one.hypotheses[0] for one in ranked[:FAINT_CURVES]]
        told = self._heard(first, everywhere)
        by_ear = [replace(one, evidence=one.heard, heard=one.evidence) for one in told]
        best = next(iter(self._in_order(sorted(by_ear, key=lambda one: -one.evidence))), None)
        return best and replace(best, evidence=best.heard, heard=best.evidence)

    @staticmethod
    def _heard(curves: Sequence[Hypothesis], everywhere: Found) -> list[Screened]:
        """Each with its evidence by sensors that do not round; or by all, less what those that do must
        promise more: what begins at the same place in every recording is rounded alike in all of them."""
        at, less = everywhere, ALARM_ROUNDED - ALARM_CURVE
        told, other = screen_both(at.problem, at.x, curves, slow=True)
        alone = {one.hypotheses: one.evidence for one in other.ranked}
        return [
            replace(one, heard=max(one.evidence - less, alone.get(one.hypotheses, -np.inf)))
            for one in told.ranked
        ]

    def told_by(self, refit: Refit, withheld: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
        """Of hypotheses that speak of a condition that all recordings are said to have in common, those over
        whose condition a curve of the refit goes: the recordings do not have it in common then."""
        over = {self.made[one][0] for one in refit.hypotheses if one in self.made}
        return tuple(
            one
            for one in withheld
            if any(condition.startswith(variable) for condition in one.needs_two_of for variable in over)
        )

    @staticmethod
    def yields_to(one: Screened, best: Screened) -> bool:
        """Whether it yields to those that promise nearly as much: it is far behind, or unlikely."""
        return one.evidence < CURVE_TIE * best.evidence or one.hypotheses[0].unlikely

    def near(self, refit: Refit, one: Hypothesis) -> float:
        """Of the greatest evidence of an unknown input, the share of the input where the hypothesis acts, if
        that is among the `NEAR_PLACES` most credible places. No place speaks against what acts at none, as a
        chassis that gives way does."""
        acted_on, inputs = self.machine.acted_on(one), self._inputs(refit)
        if not acted_on or not inputs or not inputs[0].evidence:
            return 1.0
        places = list(dict.fromkeys(self._equation(found.port) for found in inputs))[:NEAR_PLACES]
        own = [
            found.evidence
            for found in inputs
            if found.port in acted_on and self._equation(found.port) in places
        ]
        return own[0] / inputs[0].evidence if own else 0.0

    def _equation(self, name: str) -> tuple[str, str]:
        """The part and the equation of a place."""
        place = self._place(name)
        return place.part, place.equation

    def laws(self, refit: Refit, at: Found, *, slow: bool = False) -> Screening:
        """Those `beside` a refit, screened at a place where it ended; worked out once."""
        key = refit, slow
        if key not in self.weighed or self.weighed[key][0] is not at:
            screened = screen(at.problem, at.x, self.beside(refit), 0, slow=slow)
            self.weighed[key] = at, screened
        return self.weighed[key][1]

    def beside(self, refit: Refit) -> list[Hypothesis]:
        """The coarsest curve over every variable of the moment at each place where the refit's hypotheses
        act; and other curves that belong there.

        A law is tested by few coefficients: what chance promises grows with their number.
        """
        acted_on = {name for one in refit.hypotheses for name in self.machine.acted_on(one)}
        places = [one for one in self.machine.places if one.name in acted_on]
        others = [
            one
            for place in places
            for one in self.machine.unnamed(place, refit.early.problem.samples)
            if one.over
        ]
        return [*self._curves(refit, refit.told_from, places, most=1, past=False), *others]

    def _place(self, name: str) -> Place:
        return next(one for one in self.machine.places if one.name == name)

    def _inputs(self, refit: Refit) -> list[UnknownInput]:
        """An unknown input at every place, sensors apart, the most credible first."""
        places = [one.name for one in self.machine.places]
        if refit not in self.known:
            early = refit.early
            width_s = self.machine.hat_width_s(early.problem.samples)
            self.known[refit] = unknown_inputs(early.problem, early.x, places, width_s)
        return [one for one in self.known[refit] if one.port in places]

    def _curves(
        self,
        refit: Refit,
        found: Found,
        places: Sequence[Place],
        most: int | None = None,
        *,
        past: bool = True,
    ) -> list[Hypothesis]:
        """Curves at each of these places over every variable of the moment; if asked for over those of the
        `past` too, over what promises most of either. Of at most so many resolutions."""
        ranges = {part: ranges_of(found, part) for part in dict.fromkeys(one.part for one in places)}
        made = {
            (place.name, variable): dict.fromkeys(
                self.machine.curves(place, variable, *ends)[:most], (variable, *ends)
            )
            for place in places
            for variable, ends in ranges[place.part].items()
            if past or variable not in self.machine.past
        }
        could = [pair for pair, curves in made.items() if curves]
        kept = self._worth(refit, places, could) if past else set(could)
        chosen = {one: of for pair in could if pair in kept for one, of in made[pair].items()}
        self.made.update(chosen)
        return list(chosen)

    def elsewhere(self, curve: Hypothesis) -> list[Hypothesis]:
        """The same curve at every other place of its part where its variable may plausibly act."""
        if curve not in self.made:
            return []
        own = self.machine.acted_on(curve)
        parts = {place.part for place in self.machine.places if place.name in own}
        return [
            one
            for place in self.machine.places
            if place.part in parts and place.name not in own
            for one in self.machine.curves(place, *self.made[curve])
            if len(one.amplitudes) == len(curve.amplitudes) and not one.unlikely
        ]

    def twins(self, refit: Refit, curve: Hypothesis) -> list[Hypothesis]:
        """The same curve at the same place of every other part: a supply, the oil, a tank act on all alike,
        each part's as far as its own variable goes."""
        if curve not in self.made:
            return []
        variable, *_ = self.made[curve]
        own = [one for one in self.machine.places if one.name in self.machine.acted_on(curve)]
        found: list[Hypothesis] = []
        for place in self.machine.places:
            if not any(_same(place, one) for one in own):
                continue
            ends = ranges_of(refit.told_from, place.part).get(variable)
            made = self.machine.curves(place, variable, *ends) if ends else ()
            alike = [one for one in made if len(one.amplitudes) == len(curve.amplitudes)]
            self.made.update({one: (variable, *ends) for one in alike if ends})
            found += alike
        return found

    def _worth(
        self, refit: Refit, places: Sequence[Place], could: Sequence[tuple[str, str]]
    ) -> set[tuple[str, str]]:
        """Of pairs of these places and a variable those whose curve is worth a simulation: those that promise
        most by the places' answers to hats. Of a machine that has no past all of its few."""
        past, at = self.machine.past, refit.early
        if not past or not places:
            return set(could)
        width_s = self.machine.hat_width_s(at.problem.samples)
        centres = [hats(sample, width_s) for sample in at.problem.samples]
        parts = dict.fromkeys(one.part for one in places)
        seen = {part: variables(at.problem, at.x, part, centres) for part in parts}
        asked = {one.name: seen[one.part] for one in places}
        promised = foreseen(at.problem, at.x, asked, {one.name: one.size for one in places}, width_s)
        ranked = sorted((one for one in could if one in promised), key=lambda one: -promised[one])
        now = [one for one in ranked if one[1] not in past][:MOST_NOW]
        return {*now, *[one for one in ranked if one[1] in past][:MOST_PAST]}

    def _first(self, refit: Refit, inputs: Sequence[UnknownInput]) -> list[Place]:
        """Where curves are tried: where the named hypothesis acts, and where the evidence is greatest."""
        own = [
            one.port
            for one in inputs
            for hypothesis in refit.hypotheses
            if one.port in self.machine.acted_on(hypothesis)
        ]
        names = dict.fromkeys([*own[:1], *(one.port for one in inputs)])
        return [self._place(name) for name in names]


def _same(place: Place, other: Place) -> bool:
    """Whether they are the same place of two parts."""
    alike = place.name.removeprefix(place.part) == other.name.removeprefix(other.part)
    return alike and place.part != other.part and place.equation == other.equation


def credible(inputs: Sequence[UnknownInput]) -> Sequence[UnknownInput]:
    """Of unknown inputs, the most credible first, those at whose places curves are screened: all that are
    nearly as credible as the first, and a few more.

    An input over time is a poor judge between places of one flow: a law of the speed at the viscosity is as
    well imitated at the opening or the current. The curve itself, a function, parts them.
    """
    near = sum(one.evidence >= CURVE_NEAR * inputs[0].evidence for one in inputs)
    return inputs[: min(max(near, CURVES_AT), MOST_PLACES)]


def variables(problem: Problem, x: Floats, part: str, at: Sequence[Floats]) -> list[dict[str, Floats]]:
    """Of every recording the machine's variables for what acts on `part`, at these times."""
    moments = problem.moments(x, part)
    return [
        {name: np.interp(times, one.recording.time_s, values) for name, values in seen.items()}
        for one, seen, times in zip(problem.samples, moments, at, strict=True)
    ]


def over_variables(refit: Refit, found: UnknownInput, part: str) -> list[Dependence]:
    """An unknown input as a function of each variable, the best first."""
    early = refit.early
    seen = variables(early.problem, early.x, part, found.centres)
    return dependences(found, seen, early.problem.machine.past)


def ranges_of(found: Found, part: str) -> dict[str, tuple[float, float]]:
    """Between which values each variable moves in the recordings."""
    seen = found.problem.moments(found.x, part)
    ends = {
        name: (float(min(one[name].min() for one in seen)), float(max(one[name].max() for one in seen)))
        for name in seen[0]
        if all(name in one for one in seen)
    }
    return {
        name: (lower, upper)
        for name, (lower, upper) in ends.items()
        if upper - lower > MOVES_AT_ALL * max(abs(lower), abs(upper))
    }

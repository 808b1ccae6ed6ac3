"""Trials of free curves: ahead of names, beside them, or where no name explains enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from forklift.diagnosis.criteria import (
    AHEAD,
    ALARM_CURVE,
    AS_NEAR,
    BEYOND_DOUBT,
    LAW,
    LEAST_GAIN,
    MISFIT,
    MOST_OF,
    PAIR,
    SHAPES_BESIDE,
)
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.race import Race, rank
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.rules import by_chance, excess_screened, explains, may_help, outdoes
from forklift.diagnosis.screening import Screened, Screening, screen
from forklift.fitting.search import Found
from forklift.plant.protocol import Hypothesis


class General(Protocol):
    """Hypotheses without a name."""

    def __call__(self, refit: Refit) -> Sequence[Screened]:
        """For what a refit leaves over, those of the greatest evidence first."""

    def laws(self, refit: Refit, at: Found, *, slow: bool = False) -> Screening:
        """That would mend the law of what the refit has, where it acts; screened at where it ended."""

    def faint(self, refit: Refit, everywhere: Found) -> Screened | None:
        """Where next to nothing is left over: the one of the greatest evidence over all recordings."""

    def twins(self, refit: Refit, curve: Hypothesis) -> Sequence[Hypothesis]:
        """The same curve at the same place of other parts of the machine."""

    def near(self, refit: Refit, one: Hypothesis) -> float:
        """Of the evidence of the place where something acts that a refit leaves over most credibly, the share
        that the place has where this acts; 0.0 of what acts at none of the most credible."""


def faint_curve(race: Race, baseline: Refit, general: General) -> Screened | None:
    """Where no channel shows anything, or hardly: a curve whose evidence over all recordings is more than
    chance and slow noise have. What no catalogue holds may still act."""
    if not (baseline.quiet or by_chance(baseline)):
        return None
    curve = general.faint(baseline, race.refitter.everywhere(baseline))
    return curve if curve and curve.heard >= ALARM_CURVE else None


def shape_ahead(race: Race, best: Refit, screening: Screening, general: General) -> list[Refit]:
    """The curve that promises most, fitted beside the best before any name, if no name promises nearly as
    much, and no two promise more: what repeats along the stroke, say. A condition has a freedom in every
    recording, by which it follows laws of anything that differs from one to the next: of it the curve need
    only have more evidence."""
    singles, pairs = screening.singles, screening.pairs
    one = [found.gain for found in singles if _of_laws(found)][:1]
    two = [found.gain for found in pairs if _of_laws(found)][:1]
    free = [found.evidence for found in singles if not _of_laws(found)][:1]
    promised = [*one, *two]
    if best.quiet or by_chance(best) or not singles:
        return []
    # Encoders at rest leave less than their noise: more may be promised than seems to be left over. And where
    # conditions bend far to make up for what is missing, little is left over of it.
    excess = excess_screened(best, screening)
    if not best.strained and excess >= max(promised, default=0.0) >= MOST_OF * excess:
        return []
    shapes = general(best)
    if not shapes or shapes[0].evidence < max([*(AHEAD * gain for gain in one), *two, *free]):
        return []
    return twinned(race, race.beside(best, shapes[0].hypotheses[0], []), general)


def _of_laws(found: Screened) -> bool:
    """Whether none of them has a freedom in every recording."""
    return all(one.amplitude is not None for one in found.hypotheses)


def twinned(race: Race, refits: list[Refit], general: General) -> list[Refit]:
    """The same; and if the last ended with a curve and leaves something over, that with the same curve at the
    same place of another part, if it promises to help: what both lifts share acts on each of them."""
    last = refits[-1] if refits else None
    if last is None or not last.finished or last.complete:
        return refits
    beside = general.twins(last, last.hypotheses[-1])
    if not beside:
        return refits
    at = last.told_from
    found = screen(at.problem, at.x, beside, 0, slow=last.quiet)
    for screened in found.ranked[:1]:
        if screened.evidence >= max(LAW, LEAST_GAIN * excess_screened(last, found)):
            return race.beside(last, screened.hypotheses[0], refits)
    return refits


def shape_beside(race: Race, best: Refit, general: General) -> list[Refit]:
    """The curve that promises most, where a name was found that leaves most over: what has a freedom in every
    recording removes some of anything, and is to remove half of what one curve does."""
    if best.quiet or by_chance(best):
        return []
    return [
        refit for screened in general(best)[:1] for refit in race.beside(best, screened.hypotheses[0], [])
    ]


def without_names(
    race: Race,
    baseline: Refit,
    named: Sequence[Refit],
    best: Refit,
    general: General,
    shapes: Sequence[Refit] = (),
    promised: float = 0.0,
) -> tuple[Refit, ...]:
    """Hypotheses without a name, alone and beside the first name; where more names explain everything, too.

    They may be needed only because the first has another law than the catalogue's. Beside all of them nothing
    is asked for any more, nor where a machine without any leaves what may be chance. `shapes` were tried
    before. `promised` is the first name's gain: where it leaves something over with a curve as well, one that
    promised `PAIR` times as much is tried instead of it.
    """
    first = named[:1]
    if best.slight and best.hypotheses:
        beside = []
    elif best.complete:
        doubtful = any(best.deviations(one) < BEYOND_DOUBT for one in best.hypotheses)
        beside = [refit for refit in first if doubtful and len(refit.hypotheses) < len(best.hypotheses)]
    else:
        beside = [*first, *(() if by_chance(baseline) else (baseline,))]
    refits = list(shapes)
    for refit in beside:
        if any(one.complete and set(refit.hypotheses) <= set(one.hypotheses) for one in refits):
            break
        tried = [one for one in refits if set(refit.hypotheses) < set(one.hypotheses)]
        known = {one.hypotheses[-1] for one in tried}
        curves = general(refit)[: SHAPES_BESIDE if first else None]
        race.clock.plan(len(curves))
        for screened in curves:
            instead = 0.0 < PAIR * promised <= screened.evidence and not refit.hypotheses
            rivals = [one for one in tried if set(one.hypotheses).isdisjoint(best.hypotheses)]
            if any(explains(one, refit) for one in (rivals if instead else tried)):
                break
            faint = refit.slight and screened.gain < LAW
            if refit.worst.mean_square <= MISFIT:
                faint = faint or not may_help(screened, refit, race.refitter)
            alike = any(
                one.finished and one.hypotheses[-1].over == screened.hypotheses[0].over != "" for one in tried
            )  # over the same variable at another place: what gained little here gains little there
            if screened.hypotheses[0] not in known and not faint and not alike:
                tried = twinned(race, race.beside(refit, screened.hypotheses[0], tried), general)
        refits += [one for one in tried if one not in refits]
    return tuple(sorted(refits, key=rank))


def instead_of_names(race: Race, best: Refit, unnamed: Sequence[Refit]) -> Refit | None:
    """What acts elsewhere without a name and leaves clearly less than names, if these are not told from none
    beside it: a hose that creeps moves the lift as tyres do, and beside its curve no tyres are left."""
    for refit in unnamed:
        hypotheses = (*refit.hypotheses, *best.hypotheses)
        if outdoes(refit, best) and race.begins("trying", hypotheses):
            both = race.refitter.finish(race.refitter.beside(hypotheses, refit))
            if not any(both.clear(one) for one in best.hypotheses):
                return refit
    return None


def curve_beside(refitter: Refitter, best: Refit, general: General) -> Screened | None:
    """What explains everything may still have another law: the curve beside it that promises most over all
    recordings, if that is `LAW`."""
    at = refitter.everywhere(best)
    promised = general.laws(best, at, slow=True).singles
    return next((one for one in promised if one.gain >= LAW), None)


def with_curve(refitter: Refitter, best: Refit, curve: Screened, clock: Clock) -> tuple[Refit, ...]:
    clock.say(f"fitting {curve.hypotheses[0].name}")
    return (refitter.slightly((*best.hypotheses, *curve.hypotheses), best),)


def named_by_its_law(
    race: Race, baseline: Refit, best: Refit, mended: Refit, hypotheses: Sequence[Hypothesis]
) -> Refit | None:
    """The name whose law a curve is, with it, in place of a name of which the curve leaves nothing: a valve
    that needs the longer the further it has to go answers by a lag, though a dead time came nearer to that
    than a lag of one length did."""
    curves = [one for one in mended.hypotheses if one.law_of and one not in best.hypotheses]
    known = {one.label for one in best.hypotheses}
    others = [
        one
        for one in hypotheses
        if any(one.id == curve.law_of and one.where == curve.where for curve in curves)
        and one.label not in known
    ]
    if not others or any(mended.clear(one) for one in best.hypotheses if one in mended.hypotheses):
        return None
    race.say(f"fitting {others[0].label} with {curves[0].name}")
    refit = race.refitter.slightly((others[0], *curves), baseline if baseline.quiet else mended)
    if refit.squares > mended.squares + AS_NEAR:
        return None
    return refit if baseline.quiet else replace(refit, foretold=None)  # told beside nothing, as the others

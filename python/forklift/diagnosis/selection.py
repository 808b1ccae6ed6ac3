"""Which hypotheses, and how many: forward, looking ahead by pairs, with a race at each step and a check back.

A hypothesis is accepted by what recordings held out say, never by those it was fitted on; and it is called
complete only if nothing above the sensors' noise is left in any channel of any of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from forklift.diagnosis.refit import ALIKE, MUCH, Refit, Refitter
from forklift.diagnosis.screening import Screened, Screening, screen
from forklift.plant.protocol import Hypothesis, Kind

FIRST, FURTHER = 3, 4
"""How many hypotheses the race begins with, and how many more enter if none of them explains everything."""
WORTH = 0.1
"""A hypothesis enters the race if it promises this share of the best one's gain; and what is easily confused
with a complete explanation is tried beside that from this share of its gain on."""
LITTLE = 0.05
"""Likewise of what is left over above the noise: who promises less is tried only if it is the first, or from
the start machine where the evidence is."""
PAIR = 1.5
"""The best pair enters if it promises this many times as much as the best alone."""
VARIANTS = 3
"""From how many places of its further parameters the search for one hypothesis starts."""
NEARLY = 0.01
"""Share of what was left over that may still be left by a search that only ended in the wrong place."""
NEAR_PLACES, MOST_NEAR = 4, 4
"""At how many of the most credible places names are tried from the start machine before something is said to
have none, and how many names."""
AHEAD, MOST_OF = 2.0, 0.5
"""How many times as much as the next the most promising promises, and which share of what is left over it
removes, if no other is tried in its place."""
BEYOND_DOUBT = 25.0
"""An amplitude so many of its deviations from none is needed: without it −ln posterior would rise by some
three hundred."""
LEAST_ROUGH = 2.0
"""A hypothesis stays in the race if, after the tempered stages, −ln posterior has fallen by `ALIKE` of what
it has with the best one, and by no less than this."""
LEAST_GAIN = 0.1
"""Share of what is left over that the first explanation must remove; of later ones `Refitter.later`."""
CLEARLY = 30.0
"""Least fall of the sum of squares on recordings held out that counts as one."""
CONFIRMED = 5.0
"""Where nothing shows, and all recordings together have raised an alarm: how much better, in ln probability,
they must foretell each other with a hypothesis. Those held out may be too few to tell, but must not
object."""
AS_NEAR = 20.0
"""Explanations whose sums of squares on recordings held out differ by less are as good as each other: e^-10
in likelihood, which samples of one recording, that err together, may well make up for."""
ALARM: Mapping[Kind, float] = {"physics": 12.0, "parameter": 30.0, "sensor": 80.0, "unknown": np.inf}
"""Fall of −ln posterior over all recordings that a hypothesis must promise to be asked for where no channel
of a recording held out shows by itself that anything is missing: 4.9 deviations of an amplitude, among some
sixty. Conditions have an unknown for every recording; and sensors promise up to 45 where nothing is amiss,
since an encoder that starts from the same place in every recording is rounded alike in all of them."""
LAW = 15.0
"""Likewise, of a curve beside a name that explains everything."""
MOST_ACCEPTED = 3
REDRAWS = 2000
"""Of the recordings held out, for the credibility."""

Say = Callable[[str], None]


class General(Protocol):
    """Hypotheses without a name."""

    def __call__(self, refit: Refit) -> Sequence[Hypothesis]:
        """For what a refit leaves over."""

    def beside(self, refit: Refit) -> Sequence[Hypothesis]:
        """That would mend the law of what the refit has, where it acts."""

    def located(self, refit: Refit) -> Sequence[tuple[str, str]]:
        """Where and in which equation something acts that a refit leaves over, the most credible first."""


@dataclass(frozen=True, eq=False)
class Step:
    """One round: what was screened, who was tried, who was accepted."""

    screening: Screening
    refits: tuple[Refit, ...]
    """Those that explain everything first, then by what they leave over."""
    accepted: Refit | None


@dataclass(frozen=True, eq=False)
class Selection:
    """All rounds."""

    baseline: Refit
    steps: tuple[Step, ...]
    final: Refit
    """The last that was accepted, without hypotheses that it does not need."""
    unnamed: tuple[Refit, ...] = ()
    """What was tried that has no name."""
    curve: Screened | None = None
    """Of one name that explains everything: a curve that promises to mend its law, whether or not recordings
    held out bear it out."""


def alarming(screening: Screening, together: float) -> Screening:
    """Only the hypotheses that promise so much that they are asked for although no channel shows anything.

    What slow noise promises by chance is `together` times as much as what white noise does.
    """
    loud = [one for one in screening.singles if one.gain >= together * ALARM[one.hypotheses[0].kind]]
    return replace(screening, singles=tuple(loud), pairs=())


def select(
    refitter: Refitter,
    baseline: Refit,
    screening: Screening,
    hypotheses: Sequence[Hypothesis],
    say: Say,
    general: General,
) -> Selection:
    """Rounds until nothing is left over, or no hypothesis removes enough of it; then shapes without a name.

    `screening` is the baseline's: of a baseline that explains everything only what is `alarming`.
    """
    best, steps = _named(refitter, baseline, screening, hypotheses, say)
    if not best.complete:
        step = _near(refitter, best, steps, hypotheses, say, general)
        if step is not None:
            steps.append(step)
            best = step.accepted or best
    best = _needed(refitter, best, say)
    law = _law_instead(refitter, baseline, best, steps, say, general) if best.complete else None
    if law is not None:
        steps.append(law)
        return Selection(baseline, tuple(steps), law.accepted or best)
    named = [step.accepted for step in steps if step.accepted]
    curve = None
    if best.complete and len(best.hypotheses) == 1:
        say("checking the law")
        curve = _curve(refitter, best, general)
    unnamed = (
        _with_curve(refitter, best, curve, say)
        if curve
        else _unnamed(refitter, baseline, named, best, say, general)
    )
    chosen = _mended(unnamed, best) or _choice(
        [refit for refit in unnamed if _replaces(refit, best, refitter.later)]
    )
    final = chosen or best
    if not final.finished:
        say("fitting the final model")
        final = refitter.finish(final)
    return Selection(baseline, tuple(steps), final, unnamed, curve)


def _named(
    refitter: Refitter, baseline: Refit, screening: Screening, hypotheses: Sequence[Hypothesis], say: Say
) -> tuple[Refit, list[Step]]:
    """Rounds of names, as long as each leaves enough less over."""
    best, steps = baseline, [_round(refitter, baseline, screening, say)]
    while (accepted := steps[-1].accepted) is not None:
        best = accepted
        if best.complete or len(best.hypotheses) >= MOST_ACCEPTED:
            break
        say("screening the hypotheses")
        left = _beside(best, hypotheses)
        steps.append(_round(refitter, best, screen(best.told_from.problem, best.told_from.x, left), say))
    return best, steps


def _beside(best: Refit, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those that `best` has not."""
    known = {hypothesis.label for hypothesis in best.hypotheses}
    return [hypothesis for hypothesis in hypotheses if hypothesis.label not in known]


def _near(
    refitter: Refitter,
    best: Refit,
    steps: Sequence[Step],
    hypotheses: Sequence[Hypothesis],
    say: Say,
    general: General,
) -> Step | None:
    """Where something is left over, physics at the most credible places, from the start machine.

    The parameters may have bent so far to make up for what is missing that no linear step from there promises
    anything of it. Those that were searched for from the start machine are not tried again.
    """
    if len(best.hypotheses) >= MOST_ACCEPTED:
        return None
    places = list(dict.fromkeys(general.located(best)))[:NEAR_PLACES]
    own = {one.label for one in best.hypotheses}
    tried = {
        one.label
        for step in steps
        for refit in step.refits
        if refit.cold
        for one in refit.hypotheses
        if {each.label for each in refit.hypotheses} - {one.label} == own
    }
    left = [
        one
        for one in _beside(best, hypotheses)
        if one.kind == "physics"
        and one.label not in tried
        and any(one.equation == equation and one.where in (where, "") for where, equation in places)
    ]
    if not left:
        return None
    screening = screen(best.told_from.problem, best.told_from.x, left)
    refits: list[Refit] = []
    for screened in screening.singles[:MOST_NEAR]:
        hypothesis = screened.hypotheses[0]
        say(f"trying {hypothesis.label} from the start")
        refit = replace(refitter.rough((*best.hypotheses, hypothesis)), cold=True)
        refits += _finished(refitter, best, [refit], refits, say)[len(refits) :]
        if refits[-1].complete and refits[-1].identifiable:
            break
    share = refitter.later if best.hypotheses else LEAST_GAIN
    accepted = _choice([refit for refit in refits if _helps(refit, best, share)])
    return Step(screening, tuple(sorted(refits, key=_rank)), accepted)


def _round(refitter: Refitter, best: Refit, screening: Screening, say: Say) -> Step:
    """The most promising; further ones while none explains everything; what the winner is confused with."""
    share = refitter.later if best.hypotheses else LEAST_GAIN
    gains = [found.gain for found in screening.singles]
    least = max(WORTH * gains[0], LITTLE * _excess(best, screening)) if gains else 0.0
    ranked = screening.singles[:1] + tuple(one for one in screening.singles[1:] if one.gain >= least)
    pairs = [pair for pair in screening.pairs[:1] if pair.gain > PAIR * screening.singles[0].gain]
    refits: list[Refit] = []
    for entered in (ranked[:1], [*ranked[1:FIRST], *pairs], ranked[FIRST : FIRST + FURTHER]):
        refits = _race(refitter, best, entered, screening, refits, say)
        accepted = _choice([refit for refit in refits if _helps(refit, best, share)])
        if accepted is not None and (accepted.complete or _leads(accepted, best, screening)):
            rivals = _rivals(accepted, refits, screening)
            refits = _race(refitter, best, rivals, screening, refits, say, quick=True)
            break
    accepted = _choice([refit for refit in refits if _helps(refit, best, share)])
    return Step(screening, tuple(sorted(refits, key=_rank)), accepted)


def _excess(best: Refit, screening: Screening) -> float:
    """How far −ln posterior lies above what the sensors' noise leaves, where the hypotheses were screened."""
    samples = sum(len(seen.rows) for one in best.found.problem.samples for seen in one.observed)
    return max(screening.cost - 0.5 * samples, 0.0)


def _law_instead(
    refitter: Refitter,
    baseline: Refit,
    best: Refit,
    steps: Sequence[Step],
    say: Say,
    general: General,
) -> Step | None:
    """One law with a curve that mends it, in place of a condition entered wrongly.

    A condition has a freedom in every recording, so that it follows what a law of another shape than the
    catalogue's does not; what that freedom costs is part of the comparison.
    """
    if all(hypothesis.amplitude is not None for hypothesis in best.hypotheses):
        return None
    step, most = steps[0], (1.0 - MOST_OF) * baseline.excess
    laws = [
        refit
        for refit in step.refits
        if len(refit.hypotheses) == 1 and refit.hypotheses[0].kind == "physics" and refit.excess <= most
    ]
    if not laws:
        return None
    law = min(laws, key=lambda refit: refit.squares)
    at = law.found if law.finished else law.early
    curves = screen(at.problem, at.x, general.beside(law), 0).ranked
    if not curves:
        return None
    curve = max(curves, key=lambda one: one.evidence).hypotheses[0]
    say(f"fitting {law.hypotheses[0].label} with {curve.name}")
    mended = refitter.finish(refitter.rough((*law.hypotheses, curve), law))
    if not mended.complete or mended.squares > best.squares + AS_NEAR:
        return None
    return Step(step.screening, tuple(sorted([mended, law, best], key=_rank)), mended)


def _leads(accepted: Refit, best: Refit, screening: Screening) -> bool:
    """Whether the most promising removes most of what is left over, and promises far more than the next: what
    is left is then sought beside it, and no other instead of it."""
    first, *others = screening.singles
    own = {hypothesis.label for hypothesis in accepted.hypotheses} - {one.label for one in best.hypotheses}
    alone = own == {first.hypotheses[0].label}
    ahead = not others or first.gain >= AHEAD * others[0].gain
    return alone and ahead and best.squares - accepted.squares >= MOST_OF * best.excess


def _unnamed(
    refitter: Refitter, baseline: Refit, named: Sequence[Refit], best: Refit, say: Say, general: General
) -> tuple[Refit, ...]:
    """Hypotheses without a name, alone and beside the first name; where more names explain everything, too.

    They may be needed only because the first has another law than the catalogue's. Beside all of them nothing
    is asked for any more.
    """
    first = named[:1]
    if best.complete:
        doubtful = any(best.deviations(one) < BEYOND_DOUBT for one in best.hypotheses)
        beside = [refit for refit in first if doubtful and len(refit.hypotheses) < len(best.hypotheses)]
    else:
        beside = [baseline, *first]
    refits = []
    for refit in beside:
        tried: list[Refit] = []
        for hypothesis in general(refit):
            say(f"trying {hypothesis.label} at the {hypothesis.equation}")
            rough = refitter.rough((*refit.hypotheses, hypothesis), refit)
            tried = _finished(refitter, refit, [rough], tried, say)
            if tried[-1].complete:
                break
        refits += tried
        if any(one.complete for one in tried):
            break
    return tuple(sorted(refits, key=_rank))


def _curve(refitter: Refitter, best: Refit, general: General) -> Screened | None:
    """What explains everything may still have another law: the curve beside it that promises most over all
    recordings, if that is as much as is asked of a hypothesis where no channel shows anything."""
    at = refitter.everywhere(best)
    promised = screen(at.problem, at.x, general.beside(best), 0).singles
    return next((one for one in promised if one.gain >= refitter.together * LAW), None)


def _with_curve(refitter: Refitter, best: Refit, curve: Screened, say: Say) -> tuple[Refit, ...]:
    say(f"fitting {curve.hypotheses[0].name}")
    return (refitter.finish(refitter.rough((*best.hypotheses, *curve.hypotheses), best)),)


def _mended(unnamed: Sequence[Refit], best: Refit) -> Refit | None:
    """What explains everything with a curve beside it, if the curve was needed: the name's own amplitude,
    that the curve may take over, need not be told from none any more."""
    return next(
        (
            refit
            for refit in unnamed
            if best.complete
            and set(best.hypotheses) < set(refit.hypotheses)
            and best.squares - refit.squares >= CLEARLY
        ),
        None,
    )


def _replaces(refit: Refit, best: Refit, share: float) -> bool:
    """Whether what has no name may stand for names: where they explain everything, only if it explains more
    by a clear margin."""
    if not best.complete:
        return _helps(refit, best, share)
    return refit.identifiable and best.squares - refit.squares > AS_NEAR


def _helps(refit: Refit, best: Refit, share: float) -> bool:
    """Whether the refit is told from none, and removes this share of what `best` leaves over; if that is
    nothing, whether recordings foretell each other better with it."""
    gained = best.squares - refit.squares
    if best.complete:
        return refit.identifiable and gained >= -AS_NEAR and (refit.loo_log_score or 0.0) >= CONFIRMED
    return refit.identifiable and gained >= max(CLEARLY, share * best.excess)


def _rank(refit: Refit) -> tuple[bool, float, float]:
    """What explains everything first, and of that what says least."""
    return not refit.complete, len(refit.hypotheses) if refit.complete else 0, refit.squares


def _choice(enough: Sequence[Refit]) -> Refit | None:
    """The best of those that help; of those as good as it, one that is not unlikely."""
    if not enough:
        return None
    first = min(enough, key=_rank)
    likely = [
        refit
        for refit in enough
        if _rank(refit)[:2] == _rank(first)[:2]
        and refit.squares - first.squares < AS_NEAR
        and not any(hypothesis.unlikely for hypothesis in refit.hypotheses)
    ]
    return first if first in likely or not likely else min(likely, key=_rank)


def _rivals(accepted: Refit, refits: Sequence[Refit], screening: Screening) -> list[Screened]:
    """The most promising, and what could be taken for the accepted explanation, that were not tried."""
    known = {hypothesis.label for refit in refits for hypothesis in refit.hypotheses}
    own = {hypothesis.label for hypothesis in accepted.hypotheses}
    names = {hypothesis.id for hypothesis in accepted.hypotheses}
    words = {word for hypothesis in accepted.hypotheses for word in hypothesis.confused_with}
    gains = [found.gain for found in screening.singles if found.hypotheses[0].label in own]
    least = WORTH * max(gains, default=0.0)

    def confused(one: Hypothesis) -> bool:
        return one.id in words or not names.isdisjoint(one.confused_with)

    return [
        found
        for place, found in enumerate(screening.singles)
        if found.hypotheses[0].label not in known
        and (place < FIRST or (confused(found.hypotheses[0]) and found.gain >= least))
    ]


def _needed(refitter: Refitter, best: Refit, say: Say) -> Refit:
    """Without the hypotheses that the others make superfluous, now that the search knows where to end.

    A search that went astray in an early round leaves something over, and invites a hypothesis that is none.
    """
    for hypothesis in best.hypotheses:
        if len(best.hypotheses) > 1 and best.deviations(hypothesis) < BEYOND_DOUBT:
            say(f"checking whether {hypothesis.label} is needed")
            refit = refitter.without(hypothesis, best)
            if refit.complete or refit.squares <= best.squares + CLEARLY:
                best = refit
    return best


def _race(
    refitter: Refitter,
    best: Refit,
    entered: Sequence[Screened],
    screening: Screening,
    ended: Sequence[Refit],
    say: Say,
    *,
    quick: bool = False,
) -> list[Refit]:
    """Those entered, fitted; who falls behind, also behind those that ended before, is stopped.

    Who soon leaves little over is fitted to the end at once, and if that explains everything, nobody enters
    any more. Beside what explains everything already, one start is enough: `quick`.
    """
    if best.slight:
        refits = list(ended)
        for screened in entered:
            say(f"fitting {' and '.join(hypothesis.label for hypothesis in screened.hypotheses)}")
            refits.append(refitter.slightly((*best.hypotheses, *screened.hypotheses), best))
        return refits
    rough: list[Refit] = []
    refits = list(ended)
    for screened in entered:
        say(f"trying {' and '.join(hypothesis.label for hypothesis in screened.hypotheses)}")
        rough.append(_roughly(refitter, best, screened, screening, quick=quick))
        if not quick and rough[-1].rough <= MUCH * best.rough:
            refits = _finished(refitter, best, rough[-1:], refits, say)
            rough.pop()
            if refits[-1].complete and refits[-1].identifiable:
                break
    return _finished(refitter, best, rough, refits, say)


def _finished(
    refitter: Refitter, best: Refit, rough: Sequence[Refit], ended: Sequence[Refit], say: Say
) -> list[Refit]:
    """Those who keep up with the best, fitted to the end; the others as they stand."""
    least = min((refit.rough for refit in (*rough, *ended)), default=0.0)
    refits = list(ended)
    for refit in rough:
        keeps_up = best.rough - refit.rough >= max(ALIKE * (best.rough - least), LEAST_ROUGH)
        if keeps_up:
            say(f"fitting {' and '.join(hypothesis.label for hypothesis in refit.hypotheses)}")
        refits.append(_to_the_end(refitter, best, refit) if keeps_up else refit)
    return refits


def _to_the_end(refitter: Refitter, best: Refit, refit: Refit) -> Refit:
    """What explains nearly everything, but not all, may have ended beside the place where it explains all."""
    done = refitter.finish(refit)
    if done.complete or done.excess > NEARLY * best.excess:
        return done
    return min(done, refitter.afresh(done), key=_rank)


def _roughly(
    refitter: Refitter, best: Refit, screened: Screened, screening: Screening, *, quick: bool
) -> Refit:
    """The tempered stages with what entered, from where the best stands; if that leaves much over, from the
    start machine too, and of what may start from several places, from some."""
    several: list[tuple[Hypothesis, ...]] = [screened.hypotheses]
    if len(screened.hypotheses) == 1:
        several = [(one,) for one in screening.variants(screened.hypotheses[0])[:VARIANTS]]
    every = [(*best.hypotheses, *more) for more in several]
    promised = screened.gain / screening.cost
    return refitter.quick(every[0], best) if quick else refitter.ahead(every, best, promised)


def credibility(refits: Sequence[Refit], draws: int = REDRAWS, seed: int = 1) -> list[float]:
    """In which share of resampled sets of held-out recordings each refit leaves the least over.

    Whole recordings are resampled: samples of one err together, so that their number proves nothing.
    """
    tables = [refit.by_recording() for refit in refits]
    files = sorted(tables[0])
    squares = np.array([[table[file] for file in files] for table in tables])
    random = np.random.default_rng(seed)
    drawn = random.integers(len(files), size=(draws, len(files)))
    winners = np.argmin(squares[:, drawn].sum(axis=2), axis=0)
    return [float(count) / draws for count in np.bincount(winners, minlength=len(refits))]

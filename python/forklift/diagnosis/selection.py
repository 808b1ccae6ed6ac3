"""Which hypotheses, and how many: forward, looking ahead by pairs, with a race at each step and a check back.

A hypothesis is accepted by what recordings held out say, never by those it was fitted on; and it is called
complete only if nothing above the sensors' noise is left in any channel of any of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from forklift.diagnosis.criteria import (
    AHEAD,
    ALARM,
    ALIKE,
    AS_NEAR,
    BEYOND_DOUBT,
    CLEARLY,
    CONFIRMED,
    DOUBTFUL,
    FIRST,
    FURTHER,
    LAW,
    LEAST_FAULT,
    LEAST_GAIN,
    LITTLE,
    LIVES_BEYOND,
    MISFIT,
    MOST_ACCEPTED,
    MOST_NEAR,
    MOST_NEAR_MORE,
    MOST_OF,
    NEAR_PLACES,
    PAIR,
    REDRAWS,
    RIVAL,
    SAME_PLACE,
    SHAPES_BESIDE,
    SIMPLER,
    WORTH,
)
from forklift.diagnosis.group_validation import group_folds
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.race import Race, rank
from forklift.diagnosis.refit import Refit, Refitter
from forklift.diagnosis.screening import Screened, Screening, screen
from forklift.plant.protocol import Hypothesis


class General(Protocol):
    """Hypotheses without a name."""

    def __call__(self, refit: Refit) -> Sequence[Screened]:
        """For what a refit leaves over, those of the greatest evidence first."""

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
    skipped: tuple[tuple[Hypothesis, ...], ...] = ()
    """What was not tried within the work that a diagnosis may do, see
    `forklift.diagnosis.criteria.BUDGET`."""


def alarming(screening: Screening, together: float) -> Screening:
    """Only the hypotheses that promise so much that they are asked for although no channel shows anything.

    What slow noise promises by chance is `together` times as much as what white noise does. A sensor that is
    off by next to nothing is not asked for.
    """
    loud = [
        one
        for one in screening.singles
        if one.gain >= together * ALARM[one.hypotheses[0].kind]
        and not (one.hypotheses[0].kind == "sensor" and abs(one.amplitudes[0]) < LEAST_FAULT)
    ]
    return replace(screening, singles=tuple(loud), pairs=())


def select(
    refitter: Refitter,
    baseline: Refit,
    screening: Screening,
    hypotheses: Sequence[Hypothesis],
    clock: Clock,
    general: General,
) -> Selection:
    """Rounds until nothing is left over, or no hypothesis removes enough of it; then shapes without a name.

    `screening` is the baseline's: of a baseline that explains everything only what is `alarming`.
    """
    race = Race(refitter, clock)
    best, steps, shapes = _named(race, baseline, screening, hypotheses, general)
    if not (best.complete or best.slight or any(refit.complete for refit in shapes)):
        step = _near(race, best, steps, shapes, hypotheses, general)
        if step is not None:
            steps.append(step)
            best = step.accepted or best
    best = _needed(race, best)
    law = _law_instead(refitter, baseline, best, steps, clock, general) if best.complete else None
    if law is not None:
        steps.append(law)
        return Selection(baseline, tuple(steps), law.accepted or best, skipped=tuple(race.skipped))
    named = [step.accepted for step in steps if step.accepted]
    curve = None
    if (best.complete or best.slight) and len(best.hypotheses) == 1 and not refitter.work.spent:
        clock.say("checking the law")
        curve = _curve(refitter, best, general)
    unnamed = (
        _with_curve(refitter, best, curve, clock)
        if curve
        else _unnamed(race, baseline, named, best, general, shapes)
    )
    chosen = _mended(unnamed, best) or _choice(
        [refit for refit in unnamed if _replaces(refit, best, baseline, refitter.later)]
    )
    final = chosen if chosen and _foresees(refitter, best, chosen) else best
    if final is not best:
        most = best.excess <= (1.0 - MOST_OF) * baseline.excess
        final = _needed(race, final, kept=best.hypotheses if most else ())
    return Selection(baseline, tuple(steps), final, unnamed, curve, tuple(race.skipped))


def _named(
    race: Race,
    baseline: Refit,
    screening: Screening,
    hypotheses: Sequence[Hypothesis],
    general: General,
) -> tuple[Refit, list[Step], list[Refit]]:
    """Rounds of names, as long as each leaves enough less over; and the curves that were tried before them,
    as no name promised nearly as much."""
    best, steps = baseline, []
    shapes: list[Refit] = []
    while True:
        ahead = _shape_ahead(race, best, screening, general)
        steps.append(_round(race, best, screening, ahead))
        shapes += ahead
        accepted = steps[-1].accepted
        if accepted is None:
            return best, steps, shapes
        best = accepted
        left = _beside(best, hypotheses)
        if best.complete:  # a condition may be far off, and each recording's own make up for it
            left = [one for one in left if one.kind == "parameter"]
        if not left or len(best.hypotheses) >= MOST_ACCEPTED or race.refitter.work.spent:
            return best, steps, shapes
        race.say("screening the hypotheses")
        faint = best.complete or best.slight
        at = race.refitter.everywhere(best) if faint else best.told_from
        screening = screen(at.problem, at.x, left)
        if faint:
            screening = alarming(screening, race.refitter.together)
            if not screening.singles:
                return best, steps, shapes


def _shape_ahead(race: Race, best: Refit, screening: Screening, general: General) -> list[Refit]:
    """The curve that promises most, fitted beside the best before any name, if no name promises nearly as
    much: what repeats along the stroke, say."""
    promised = [found.gain for found in (*screening.singles[:1], *screening.pairs[:1])]
    if best.slight or best.complete or _chance(best) or not promised:
        return []
    if max(promised) >= MOST_OF * _excess(best, screening):
        return []
    shapes = general(best)
    if not shapes or shapes[0].evidence < AHEAD * max(promised):
        return []
    return race.beside(best, shapes[0].hypotheses[0], [])


def _beside(best: Refit, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those that `best` has not."""
    known = {hypothesis.label for hypothesis in best.hypotheses}
    return [hypothesis for hypothesis in hypotheses if hypothesis.label not in known]


def _near(
    race: Race,
    best: Refit,
    steps: Sequence[Step],
    shapes: Sequence[Refit],
    hypotheses: Sequence[Hypothesis],
    general: General,
) -> Step | None:
    """Where something is left over, physics at the most credible places, from the start machine.

    The parameters may have bent so far to make up for what is missing that no linear step from there promises
    anything of it. Those that were searched for from the start machine are not tried again.
    """
    if len(best.hypotheses) >= MOST_ACCEPTED or best.worst.mean_square <= MISFIT:
        return None  # nothing has bent far to make up for what hardly shows
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
    beside = [refit for refit in shapes if refit.finished and own <= _labels(refit)]
    refits = list(beside)
    entered = screening.singles[: MOST_NEAR_MORE if best.hypotheses else MOST_NEAR]
    race.clock.plan(len(entered))
    for screened in entered:
        refits = race.cold(best, screened.hypotheses[0], refits)
        if refits and refits[-1].complete and refits[-1].identifiable:
            break
    refits = refits[len(beside) :]
    accepted = _choice(_helping(refits, best, race.refitter, beside))
    return Step(screening, tuple(sorted(refits, key=rank)), accepted)


def _round(race: Race, best: Refit, screening: Screening, shapes: Sequence[Refit] = ()) -> Step:
    """The most promising; further ones while none explains everything; what the winner is confused with.

    Beside a curve that promised far more than any name, fewer names are tried, and one counts only if it
    removes nearly as much.
    """
    gains = [found.gain for found in screening.singles]
    least = max(WORTH * gains[0], LITTLE * _excess(best, screening)) if gains else 0.0
    led = any(_helps(refit, best, _share(best, race.refitter)) for refit in shapes)
    # Of a clear mismatch a recording held out may leave anything: what it leaves is no measure then.
    sure = not led and best.worst.mean_square > MISFIT
    ranked = [
        one
        for place, one in enumerate(screening.singles)
        if (place == 0 or one.gain >= least) and (sure or _may_help(one, best, race.refitter))
    ]
    pairs = [
        pair
        for pair in screening.pairs[:1]
        if pair.gain > PAIR * screening.singles[0].gain and (sure or _may_help(pair, best, race.refitter))
    ]
    waves = [ranked[:1], [*ranked[1:FIRST], *pairs]]
    if not led:
        waves.append(ranked[FIRST : FIRST + FURTHER])
    refits: list[Refit] = list(shapes)
    race.clock.plan(sum(map(len, waves)))
    for place, entered in enumerate(waves):
        refits = race.run(best, entered, screening, refits, again=place == 0 and not led)
        accepted = _choice(_helping(refits[len(shapes) :], best, race.refitter, shapes))
        enough = accepted is not None and (accepted.complete or accepted.slight)
        if accepted is not None and (enough or _leads(accepted, best, screening)):
            rivals = _rivals(accepted, refits, screening)
            race.clock.plan(len(rivals))
            refits = race.run(best, rivals, screening, refits, quick=True)
            break
    refits = refits[len(shapes) :]
    accepted = _choice(_helping(refits, best, race.refitter, shapes))
    return Step(screening, tuple(sorted(refits, key=rank)), accepted)


def _share(best: Refit, refitter: Refitter) -> float:
    """Which share of what the best leaves over an explanation must remove: of a clear mismatch the first one
    less, as several may act at once; what is faint, one thing explains or chance does."""
    clear = best.worst.mean_square > MISFIT
    return LEAST_GAIN if clear and not best.hypotheses else refitter.later


def _may_help(one: Screened, best: Refit, refitter: Refitter) -> bool:
    """Whether it may remove enough of what the best leaves over: `LIVES_BEYOND` times what it promises does.

    What it promises is of the recordings that are fitted; of what is left over there those held out tell,
    sample for sample.
    """
    if best.complete or best.slight:
        return True
    fitted = sum(len(seen.rows) for sample in best.found.problem.samples for seen in sample.observed)
    held = sum(found.samples for found in best.held_out)
    asked = 0.5 * _share(best, refitter) * best.excess * fitted / held
    return LIVES_BEYOND * one.gain >= asked


def _helping(
    refits: Sequence[Refit], best: Refit, refitter: Refitter, shapes: Sequence[Refit]
) -> list[Refit]:
    """Those that remove enough of what the best leaves over: at least half of what a curve does."""
    share = _share(best, refitter)
    most = max((best.squares - refit.squares for refit in shapes if refit.finished), default=0.0)
    return [
        refit
        for refit in refits
        if _helps(refit, best, share) and (refit.complete or best.squares - refit.squares >= ALIKE * most)
    ]


def _excess(best: Refit, screening: Screening) -> float:
    """How far −ln posterior lies above what the sensors' noise leaves, where the hypotheses were screened."""
    samples = sum(len(seen.rows) for one in best.found.problem.samples for seen in one.observed)
    return max(screening.cost - 0.5 * samples, 0.0)


def _law_instead(
    refitter: Refitter,
    baseline: Refit,
    best: Refit,
    steps: Sequence[Step],
    clock: Clock,
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
    clock.say(f"fitting {law.hypotheses[0].label} with {curve.name}")
    mended = refitter.finish(refitter.rough((*law.hypotheses, curve), law))
    if not mended.complete or mended.squares > best.squares + AS_NEAR:
        return None
    return Step(step.screening, tuple(sorted([mended, law, best], key=rank)), mended)


def _leads(accepted: Refit, best: Refit, screening: Screening) -> bool:
    """Whether the most promising removes most of what is left over, and promises far more than the next: what
    is left is then sought beside it, and no other instead of it."""
    first, *others = screening.singles
    own = {hypothesis.label for hypothesis in accepted.hypotheses} - {one.label for one in best.hypotheses}
    alone = own == {first.hypotheses[0].label}
    ahead = not others or first.gain >= AHEAD * others[0].gain
    return alone and ahead and best.squares - accepted.squares >= MOST_OF * best.excess


def _unnamed(
    race: Race,
    baseline: Refit,
    named: Sequence[Refit],
    best: Refit,
    general: General,
    shapes: Sequence[Refit] = (),
) -> tuple[Refit, ...]:
    """Hypotheses without a name, alone and beside the first name; where more names explain everything, too.

    They may be needed only because the first has another law than the catalogue's. Beside all of them nothing
    is asked for any more, nor where a machine without any leaves what may be chance. `shapes` were tried
    before.
    """
    first = named[:1]
    if best.slight and best.hypotheses:
        beside = []
    elif best.complete:
        doubtful = any(best.deviations(one) < BEYOND_DOUBT for one in best.hypotheses)
        beside = [refit for refit in first if doubtful and len(refit.hypotheses) < len(best.hypotheses)]
    else:
        beside = [*first, *(() if _chance(baseline) else (baseline,))]
    refits = list(shapes)
    for refit in beside:
        if any(one.complete for one in refits):
            break
        tried = [one for one in refits if set(refit.hypotheses) < set(one.hypotheses)]
        known = {one.hypotheses[-1] for one in tried}
        curves = general(refit)[: SHAPES_BESIDE if first else None]
        race.clock.plan(len(curves))
        for screened in curves:
            if any(_explains(one, refit) for one in tried):
                break
            faint = refit.slight and screened.gain < race.refitter.together * LAW
            if refit.worst.mean_square <= MISFIT:
                faint = faint or not _may_help(screened, refit, race.refitter)
            alike = any(
                one.finished and one.hypotheses[-1].over == screened.hypotheses[0].over != "" for one in tried
            )  # over the same variable at another place: what gained little here gains little there
            if screened.hypotheses[0] not in known and not faint and not alike:
                tried = race.beside(refit, screened.hypotheses[0], tried)
        refits += [one for one in tried if one not in refits]
    return tuple(sorted(refits, key=rank))


def _chance(best: Refit) -> bool:
    """Whether what no name explains is put down to chance: a curve follows whatever there is."""
    return not best.hypotheses and best.worst.mean_square <= DOUBTFUL and not best.strained


def _explains(one: Refit, best: Refit) -> bool:
    """Whether it removes most of what the best leaves over, so that no other is tried in its place."""
    return one.complete or (one.finished and best.squares - one.squares >= MOST_OF * best.excess)


def _curve(refitter: Refitter, best: Refit, general: General) -> Screened | None:
    """What explains everything may still have another law: the curve beside it that promises most over all
    recordings, if that is as much as is asked of a hypothesis where no channel shows anything."""
    at = refitter.everywhere(best)
    promised = screen(at.problem, at.x, general.beside(best), 0).singles
    return next((one for one in promised if one.gain >= refitter.together * LAW), None)


def _with_curve(refitter: Refitter, best: Refit, curve: Screened, clock: Clock) -> tuple[Refit, ...]:
    clock.say(f"fitting {curve.hypotheses[0].name}")
    return (refitter.slightly((*best.hypotheses, *curve.hypotheses), best),)


def _mended(unnamed: Sequence[Refit], best: Refit) -> Refit | None:
    """What explains everything, or nearly, with a curve beside a name, if the curve was needed: the name's
    own amplitude, that the curve may take over, need not be told from none any more."""
    if not best.hypotheses:
        return None
    return next(
        (
            refit
            for refit in unnamed
            if (best.complete or best.slight)
            and refit.finished
            and set(best.hypotheses) < set(refit.hypotheses)
            and best.squares - refit.squares >= CLEARLY
        ),
        None,
    )


def _foresees(refitter: Refitter, best: Refit, refit: Refit) -> bool:
    """Whether groups of recordings are foretold from each other better with a curve than without: one over
    what is constant in each of them follows whatever each has of its own.

    Where the sensors' noise can be reached, what recordings held out leave over tells as much.
    """
    if not refitter.strict:
        return True
    folds = group_folds(refitter, best, refit)
    return not folds or sum(one.after for one in folds) < sum(one.before for one in folds)


def _replaces(refit: Refit, best: Refit, baseline: Refit, share: float) -> bool:
    """Whether what has no name may stand for names: where they explain everything, only if it explains more
    by a clear margin.

    Where they do not, a curve beside them must remove that share of what they leave over, at the place of
    one of them less, as it is part of the same cause; and a curve instead of them must gain much more than
    they do.
    """
    if best.complete:
        return refit.identifiable and best.squares - refit.squares > AS_NEAR
    if not best.hypotheses:
        clear = best.worst.mean_square > MISFIT
        return _helps(refit, best, LEAST_GAIN if clear else share)
    if set(best.hypotheses) < set(refit.hypotheses):
        places = {(one.where, one.equation) for one in best.hypotheses}
        new = [one for one in refit.hypotheses if one not in best.hypotheses]
        mends = all((one.where, one.equation) in places for one in new)
        return _helps(refit, best, SAME_PLACE if mends else share)
    named = baseline.squares - best.squares
    return _helps(refit, best, 0.0) and baseline.squares - refit.squares >= (1.0 + MOST_OF) * named


def _helps(refit: Refit, best: Refit, share: float) -> bool:
    """Whether the refit is told from none, and removes this share of what `best` leaves over; if that is
    nothing, whether recordings foretell each other better with it. Where `best` strains what was entered, it
    is enough to leave nothing over: the strain is little beside the slack of many samples."""
    gained = best.squares - refit.squares
    if not refit.finished:
        return False
    if best.complete:
        return refit.identifiable and gained >= -AS_NEAR and (refit.loo_log_score or 0.0) >= CONFIRMED
    eased = best.strained and refit.complete
    return refit.identifiable and gained >= (CLEARLY if eased else max(CLEARLY, share * best.excess))


def _choice(enough: Sequence[Refit]) -> Refit | None:
    """The best of those that help; of those nearly as good the simplest: that is not unlikely, none of whose
    numbers has gone to a bound, and that has the fewest."""
    if not enough:
        return None
    first = min(enough, key=rank)
    gained = SIMPLER * max(max(refit.squares for refit in enough) - first.squares, 0.0)
    margin = AS_NEAR if first.complete else max(AS_NEAR, gained)
    near = [
        refit
        for refit in enough
        if rank(refit)[:2] == rank(first)[:2] and refit.squares - first.squares < margin
    ]
    if not (first.at_bounds or any(hypothesis.unlikely for hypothesis in first.hypotheses)):
        return first
    return min(near, key=_plain)


def _plain(refit: Refit) -> tuple[bool, bool, int, float]:
    """The least of what is asked for beside a good explanation: likely, within its bounds, and short."""
    unlikely = any(hypothesis.unlikely for hypothesis in refit.hypotheses)
    return unlikely, bool(refit.at_bounds), refit.freedoms, refit.squares


def _labels(refit: Refit) -> set[str]:
    return {hypothesis.label for hypothesis in refit.hypotheses}


def _rivals(accepted: Refit, refits: Sequence[Refit], screening: Screening) -> list[Screened]:
    """The most promising, and what could be taken for the accepted explanation, that were not tried."""
    known = {hypothesis.label for refit in refits for hypothesis in refit.hypotheses}
    own = {hypothesis.label for hypothesis in accepted.hypotheses}
    names = {hypothesis.id for hypothesis in accepted.hypotheses}
    words = {word for hypothesis in accepted.hypotheses for word in hypothesis.confused_with}
    gains = [found.gain for found in screening.singles if found.hypotheses[0].label in own]
    most = max(gains, default=0.0)

    def confused(one: Hypothesis) -> bool:
        return one.id in words or not names.isdisjoint(one.confused_with)

    return [
        found
        for place, found in enumerate(screening.singles)
        if found.hypotheses[0].label not in known
        and found.gain >= most * (WORTH if confused(found.hypotheses[0]) else RIVAL)
        and (place < FIRST or confused(found.hypotheses[0]))
    ]


def _needed(race: Race, best: Refit, kept: Sequence[Hypothesis] = ()) -> Refit:
    """Without the names that the others make superfluous, now that the search knows where to end.

    `kept` are not asked: names that by themselves removed most of what was left over. A curve over the same
    variable can always take them over; it says then that the law is another, not that there is none.

    A search that went astray in an early round leaves something over, and invites a hypothesis that is none;
    and what a curve takes over needs no name beside it. Of what is left over without it each name must remove
    what it must to be accepted after the others: two that entered at once may hide that one does not.
    """
    first = best.hypotheses[:1]
    for hypothesis in best.hypotheses:
        named = hypothesis.kind != "unknown" and hypothesis not in kept
        if hypothesis.amplitude is None and (best.loo_log_score or 0.0) >= CONFIRMED:
            continue  # recordings foretell each other by it, though none needs it for itself
        sure = best.complete and best.deviations(hypothesis) >= BEYOND_DOUBT
        if len(best.hypotheses) > 1 and named and not sure:
            race.say(f"checking whether {hypothesis.label} is needed")
            refit = race.refitter.without(hypothesis, best)
            share = LEAST_GAIN if hypothesis in first else race.refitter.later
            least = max(CLEARLY, share * refit.excess)
            if refit.complete or refit.squares <= best.squares + least:
                best = refit
    return best


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

"""Which of several refits is taken, and which stand beside or in place of it: rules over what they leave.

Every bound stands in `criteria.py`. Only `foresees` fits, which leaves groups out, and `foretells_better`,
which asks all recordings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from forklift.diagnosis.criteria import (
    AHEAD,
    ALIKE,
    ANOTHER_SHAPE,
    AS_NEAR,
    CLEARLY,
    CONFIRMED,
    DOUBTFUL,
    FIRST,
    LEAST_EFFECT,
    LEAST_GAIN,
    LIVES_BEYOND,
    MISFIT,
    MOST_OF,
    REDRAWS,
    RIVAL,
    SAME_PLACE,
    SIMPLER,
    WORTH,
    alarm,
)
from forklift.diagnosis.group_validation import group_folds
from forklift.diagnosis.race import rank
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.screening import Screened, Screening
from forklift.plant.protocol import Hypothesis


def share_asked(best: Refit, refitter: Refitter) -> float:
    """Which share of what the best leaves over an explanation must remove: of a clear mismatch the first one
    less, as several may act at once; what is faint, one thing explains or chance does."""
    clear = best.worst.mean_square > MISFIT
    return LEAST_GAIN if clear and not best.hypotheses else refitter.later


def may_help(one: Screened, best: Refit, refitter: Refitter) -> bool:
    """Whether it may remove enough of what the best leaves over: `LIVES_BEYOND` times what it promises does.

    What it promises is of the recordings that are fitted; of what is left over there those held out tell,
    sample for sample.
    """
    if best.quiet:
        return True
    if best.worst.mean_square <= MISFIT:
        asked = least_of_a_faint(one.hypotheses, best, refitter)
    else:
        asked = share_asked(best, refitter) * best.excess
    fitted = sum(len(seen.rows) for sample in best.found.problem.samples for seen in sample.observed)
    held = sum(found.samples for found in best.held_out)
    return LIVES_BEYOND * one.gain >= 0.5 * asked * fitted / held


def measures(best: Refit, shapes: Sequence[Refit]) -> bool:
    """Whether what the best leaves over says what a name must promise: of a clear mismatch a recording held
    out may leave anything, unless a curve that was tried removes most of it."""
    return best.worst.mean_square <= MISFIT or any(explains(one, best) for one in shapes)


def least_of_a_faint(hypotheses: Sequence[Hypothesis], best: Refit, refitter: Refitter) -> float:
    """By how much what leaves nothing over of a faint mismatch must lower the sum of squares: by twice what
    one must promise where no channel shows anything."""
    loud = 2.0 * refitter.together * max(alarm(one) for one in hypotheses)
    return max(CLEARLY, loud, LEAST_GAIN * best.excess)


def helping(refits: Sequence[Refit], best: Refit, refitter: Refitter, shapes: Sequence[Refit]) -> list[Refit]:
    """Those that remove enough of what the best leaves over: at least half of what a curve does; what has a
    freedom in every recording, as much as the curve, and beside one most of what is left over. That follows
    in part whatever differs from one recording to the next; where it is the cause, it has no law that could
    be another than the catalogue's."""
    share = share_asked(best, refitter)
    most = max((best.squares - refit.squares for refit in shapes if refit.finished), default=0.0)

    def partly(refit: Refit) -> bool:
        return bool(shapes) and freer(refit, best) and not refit.complete

    return [
        refit
        for refit in refits
        if (
            helps(refit, best, max(share, MOST_OF) if partly(refit) else share)
            or completes(refit, best, refitter)
        )
        and (
            not most
            or refit.complete
            or best.squares - refit.squares >= (1.0 if freer(refit, best) else ALIKE) * most
        )
    ]


def freer(refit: Refit, best: Refit) -> bool:
    """Whether it has beside the best only what has a freedom in every recording: it follows anything that
    differs from one to the next, as a law does, and is no law."""
    return all(one.amplitude is None for one in refit.hypotheses if one not in best.hypotheses)


def excess_screened(best: Refit, screening: Screening) -> float:
    """How far −ln posterior lies above what the sensors' noise leaves, where the hypotheses were screened."""
    samples = sum(len(seen.rows) for one in best.found.problem.samples for seen in one.observed)
    return max(screening.cost - 0.5 * samples, 0.0)


def leads(accepted: Refit, best: Refit, screening: Screening) -> bool:
    """Whether the most promising removes most of what is left over, and promises far more than the next: what
    is left is then sought beside it, and no other instead of it."""
    first, *others = screening.singles
    own = {hypothesis.label for hypothesis in accepted.hypotheses} - {one.label for one in best.hypotheses}
    alone = own == {first.hypotheses[0].label}
    ahead = not others or first.gain >= AHEAD * others[0].gain
    return alone and ahead and best.squares - accepted.squares >= MOST_OF * best.excess


def by_chance(best: Refit) -> bool:
    """Whether what no name explains is put down to chance: a curve follows whatever there is."""
    return not best.hypotheses and best.worst.mean_square <= DOUBTFUL and not best.strained


def settled_names(best: Refit, baseline: Refit) -> tuple[Hypothesis, ...]:
    """The names that a curve beside them does not replace: what leaves nothing over has removed all there
    was, however much of the excess is no mismatch; else they have to have removed most of it."""
    most = baseline.quiet or best.complete or best.excess <= (1.0 - MOST_OF) * baseline.excess
    return best.hypotheses if most else ()


def explains(one: Refit, best: Refit) -> bool:
    """Whether it removes most of what the best leaves over, so that no other is tried in its place."""
    return one.complete or (one.finished and best.squares - one.squares >= MOST_OF * best.excess)


def mended(unnamed: Sequence[Refit], best: Refit) -> Refit | None:
    """What explains everything, or nearly, with a curve beside a name, if the curve was needed: the name's
    own amplitude, that the curve may take over, need not be told from none any more."""
    if not best.hypotheses:
        return None
    return next(
        (
            refit
            for refit in unnamed
            if best.quiet
            and refit.finished
            and set(best.hypotheses) < set(refit.hypotheses)
            and best.squares - refit.squares >= CLEARLY
        ),
        None,
    )


def foresees(refitter: Refitter, best: Refit, refit: Refit) -> bool:
    """Whether groups of recordings are foretold from each other better with a curve than without: one over
    what is constant in each of them follows whatever each has of its own.

    Where the sensors' noise can be reached, what recordings held out leave over tells as much.
    """
    if not refitter.strict:
        return True
    folds = [one for one in group_folds(refitter, best, refit) if one.asked]
    return not folds or sum(one.after for one in folds) < sum(one.before for one in folds)


def has_more_evidence(curve: Screened, screening: Screening, baseline: Refit) -> bool:
    """Whether a curve has more evidence than the name that promises most where nothing shows."""
    return baseline.quiet and any(
        _clearly_above(curve.evidence, one.evidence) for one in screening.singles[:1]
    )


def promises_more(curve: Screened, first: Refit, baseline: Refit, screening: Screening) -> bool:
    """Whether a curve has more evidence than the first name that was accepted where nothing showed: both are
    linear about the same place, and over the same recordings."""
    if not baseline.quiet or len(first.hypotheses) != 1:
        return False
    evidence = {one.hypotheses[0].label: one.evidence for one in screening.singles}
    return _clearly_above(curve.evidence, evidence.get(first.hypotheses[0].label, curve.evidence))


def _clearly_above(one: float, other: float) -> bool:
    """Of two evidences, in ln probability."""
    return 2.0 * (one - other) > AS_NEAR


def foretells_better(curve: Refit, named: Sequence[Refit], refitter: Refitter) -> bool:
    """Whether a curve leaves no more over on recordings held out than names that were accepted one beside the
    other, and recordings foretell each other better by it, by a clear margin. That is told by a linear step
    from where nothing was known, and says too little of a name that lives on its further numbers: a lag, from
    its time. So the curve must explain all recordings better as well, each with its numbers at their best."""
    each = [one.loo_log_score for one in named if one.loo_log_score is not None]
    if curve.loo_log_score is None or len(each) < len(named) or curve.squares > named[-1].squares:
        return False
    foretold = curve.loo_log_score - sum(each)
    return 2.0 * min(foretold, refitter.gained(named[-1], curve)) > AS_NEAR


def replaces(refit: Refit, best: Refit, baseline: Refit, share: float) -> bool:
    """Whether what has no name may stand for names: where they explain everything, only if it explains more
    by a clear margin.

    Where they do not, a curve beside them must remove that share of what they leave over, at the place of
    one of them less, as it is part of the same cause; and a curve instead of them must gain much more than
    they do. A curve alone must remove most: where it does not, the place is told and no law.
    """
    if best.complete:
        return refit.identifiable and best.squares - refit.squares > AS_NEAR
    if not best.hypotheses:
        return helps(refit, best, max(share, MOST_OF))
    if set(best.hypotheses) < set(refit.hypotheses):
        places = {(one.where, equation) for one in best.hypotheses for equation in one.equations}
        new = [one for one in refit.hypotheses if one not in best.hypotheses]
        mends = all((one.where, one.equation) in places for one in new)
        return helps(refit, best, SAME_PLACE if mends else share)
    named = baseline.squares - best.squares
    return helps(refit, best, 0.0) and baseline.squares - refit.squares >= (1.0 + MOST_OF) * named


def stands_alone(refit: Refit, best: Refit, tried: Sequence[Refit]) -> bool:
    """Whether what has none of the best's names explains everything, where these do not: most of what they
    leave over is gone, and every one of those tried that has them leaves clearly more."""
    own = set(best.hypotheses)
    with_them = [one for one in tried if own <= set(one.hypotheses)]
    return (
        refit.complete
        and not best.complete
        and own.isdisjoint(refit.hypotheses)
        and helps(refit, best, MOST_OF)
        and bool(with_them)
        and all(one.squares - refit.squares >= AS_NEAR for one in with_them)
    )


def outdoes(refit: Refit, best: Refit) -> bool:
    """Whether what has no name, and acts where none of the names does, leaves clearly less than they do."""
    places = {(one.where, equation) for one in best.hypotheses for equation in one.equations}
    return (
        bool(best.hypotheses)
        and not best.complete
        and set(best.hypotheses).isdisjoint(refit.hypotheses)
        and all((one.where, one.equation) not in places for one in refit.hypotheses)
        and helps(refit, best, LEAST_GAIN)
    )


def helps(refit: Refit, best: Refit, share: float) -> bool:
    """Whether the refit is told from none, and removes this share of what `best` leaves over; if that is
    nothing, whether recordings foretell each other better with it. Where `best` strains what was entered, it
    is enough to leave nothing over: the strain is little beside the slack of many samples."""
    gained = best.squares - refit.squares
    if not refit.finished:
        return False
    if best.complete:
        borne_out = not objected_to(refit, best) and (refit.loo_log_score or 0.0) >= CONFIRMED
        return refit.identifiable and borne_out and not next_to_none(refit, best)
    eased = best.strained and refit.complete
    return refit.identifiable and gained >= (CLEARLY if eased else max(CLEARLY, share * best.excess))


def objected_to(refit: Refit, best: Refit) -> bool:
    """Whether recordings held out speak against what all recordings bear out: they lose by it more than such
    samples may, and more than a little of what all gain. A cushion that one fitted recording meets is in no
    other; and where its numbers were told from that one alone, these lose some squares by them."""
    return best.squares - refit.squares < -max(AS_NEAR, LEAST_GAIN * 2.0 * (refit.loo_log_score or 0.0))


def next_to_none(refit: Refit, best: Refit) -> bool:
    """Whether it has an effect of a size that is none, and recordings held out do not show it either: in many
    recordings of one kind what two simulations differ by adds up to as much."""
    new = [one for one in refit.hypotheses if one not in best.hypotheses and one.kind == "physics"]
    unseen = best.squares - refit.squares < CLEARLY
    return unseen and any(refit.size(one) < LEAST_EFFECT for one in new if one.amplitude is not None)


def led_elsewhere(refits: Sequence[Refit], best: Refit, share: float) -> Refit | None:
    """Of those that remove this share of what `best` leaves over although an amplitude is not told from none,
    the one that leaves least: what is not there explains nothing, so its search ended in another place."""
    found = [
        refit
        for refit in refits
        if refit.finished
        and not refit.identifiable
        and best.squares - refit.squares >= max(CLEARLY, share * best.excess)
    ]
    return min(found, key=lambda refit: refit.squares, default=None)


def completes(refit: Refit, best: Refit, refitter: Refitter) -> bool:
    """Whether it leaves nothing over of a faint mismatch, or less than half in the channels that were not
    explained, or of what hardly shows something that all recordings bear out, or next to nothing where
    conditions had gone further than is plausible; and gains as much on recordings held out as a hypothesis
    must promise where no channel shows anything; or where all recordings foretell each other better by that
    much, and those held out do not object.

    A condition that takes away strain that was all there was need not gain as much.

    A model that explains everything still leaves something beside the noise that was measured, channel by
    channel: where a mismatch is faint, that is no small share of it.
    """
    if best.complete or best.worst.mean_square > MISFIT or not (refit.finished and refit.identifiable):
        return False
    new = [one for one in refit.hypotheses if one not in best.hypotheses]
    gained, least = best.squares - refit.squares, least_of_a_faint(new, best, refitter)
    score = refit.loo_log_score or 0.0
    if best.slight and 2.0 * score >= least and not objected_to(refit, best):
        return not next_to_none(refit, best)
    borne_out = best.slight and score >= CONFIRMED
    eased = best.strained and refit.slight
    if not (refit.complete or borne_out or eased or refit.missing < (1.0 - MOST_OF) * best.missing):
        return False
    if best.strains_alone and refit.complete and freer(refit, best):
        return gained > 0.0  # that chance does not strain conditions so far is known already
    return gained >= least


def choice(enough: Sequence[Refit], before: Refit) -> Refit | None:
    """The best of those that help; of those nearly as good the simplest: that is not unlikely, none of whose
    numbers has gone to a bound, and that has the fewest. Where all recordings were asked, that by which they
    foretell each other best; of those nearly as good, likewise. Signals that are all late by the same yield
    to what removes nearly as much: they are a machine that answers late, but for the shape of that law.
    `before` is what they are tried beside.
    """
    if not enough:
        return None
    first = min(enough, key=rank)
    margin = AS_NEAR if first.complete else max(AS_NEAR, SIMPLER * (before.squares - first.squares))
    if any(one.unlikely and one.kind == "sensor" for one in first.hypotheses):
        margin = max(margin, (1.0 - ANOTHER_SHAPE) * (before.squares - first.squares))
    level = [refit for refit in enough if rank(refit)[:2] == rank(first)[:2]]
    near = [refit for refit in level if refit.squares - first.squares < margin]
    asked = {refit: refit.loo_log_score for refit in level if refit.loo_log_score is not None}
    if first in asked:
        most = max(asked.values())
        alike = [refit for refit, score in asked.items() if 2.0 * (most - score) < AS_NEAR]
        return min(alike, key=lambda refit: (*plain(refit)[:2], -asked[refit]))
    if not (first.at_bounds or any(hypothesis.unlikely for hypothesis in first.hypotheses)):
        return first
    return min(near, key=plain)


def plain(refit: Refit) -> tuple[bool, bool, int, float]:
    """The least of what is asked for beside a good explanation: likely, within its bounds, and short."""
    unlikely = any(hypothesis.unlikely for hypothesis in refit.hypotheses)
    return unlikely, bool(refit.at_bounds), refit.freedoms, refit.squares


def labels(refit: Refit) -> set[str]:
    """One hypothesis may have been tried from several places: they are one by their label."""
    return {hypothesis.label for hypothesis in refit.hypotheses}


def rivals(accepted: Refit, refits: Sequence[Refit], screening: Screening) -> list[Screened]:
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


def lost(refits: Sequence[Refit]) -> list[Mapping[str, float]]:
    """What each leaves over in each recording held out; where all recordings were asked how well they
    foretell each other with it, twice the ln probability that is wanting."""
    asked = [refit.foretold for refit in refits if refit.foretold is not None]
    if len(asked) == len(refits):
        return [{file: -2.0 * score for file, score in one.items()} for one in asked]
    return [refit.by_recording() for refit in refits]


def credibility(refits: Sequence[Refit]) -> list[float]:
    """In which share of resampled sets of held-out recordings each refit leaves the least over.

    Whole recordings are resampled: samples of one err together, so that their number proves nothing. See
    `lost`.
    """
    tables = lost(refits)
    files = sorted(tables[0])
    squares = np.array([[table[file] for file in files] for table in tables])
    random = np.random.default_rng(1)
    drawn = random.integers(len(files), size=(REDRAWS, len(files)))
    winners = np.argmin(squares[:, drawn].sum(axis=2), axis=0)
    return [float(count) / REDRAWS for count in np.bincount(winners, minlength=len(refits))]

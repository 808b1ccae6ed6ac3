"""Which suspects, and how many: forward, looking ahead by pairs, with a race at each step and a check back.

A suspect is accepted by what recordings held out say, never by those it was fitted on; and it is called
complete only if nothing above the sensors' noise is left in any channel of any of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from forklift.diagnosis.hypothesis import Kind, Suspect
from forklift.diagnosis.refit import ALIKE, MUCH, Bench, Trial
from forklift.diagnosis.screening import Screened, Screening, screen

FIRST, FURTHER = 3, 4
"""How many suspects the race begins with, and how many more enter if none of them explains everything."""
WORTH = 0.1
"""A suspect enters the race if it promises this share of the best one's gain; and what is easily confused
with a complete explanation is tried beside that from this share of its gain on."""
PAIR = 1.5
"""The best pair enters if it promises this many times as much as the best alone."""
VARIANTS = 3
"""From how many places of its further parameters the search for one suspect starts."""
NEARLY = 0.01
"""Share of what was left over that may still be left by a search that only ended in the wrong place."""
LEAST_ROUGH = 2.0
"""A suspect stays in the race if, after the tempered stages, −ln posterior has fallen by `ALIKE` of what it
has with the best one, and by no less than this."""
LEAST_GAIN = 0.1
"""Share of what is left over that the first explanation must remove; of later ones `Bench.later`."""
CLEARLY = 30.0
"""Least fall of the sum of squares on recordings held out that counts as one."""
CONFIRMED = 5.0
"""Where nothing shows, and all recordings together have raised an alarm: how much better, in ln probability,
they must foretell each other with a suspect. Those held out may be too few to tell, but must not object."""
AS_NEAR = 20.0
"""Explanations whose sums of squares on recordings held out differ by less are as good as each other: e^-10
in likelihood, which samples of one recording, that err together, may well make up for."""
ALARM: Mapping[Kind, float] = {"physics": 12.0, "parameter": 30.0, "sensor": 80.0, "unknown": np.inf}
"""Fall of −ln posterior over all recordings that a suspect must promise to be asked for where no channel of a
recording held out shows by itself that anything is missing: 4.9 deviations of an amplitude, among some sixty.
Conditions have an unknown for every recording; and sensors promise up to 45 where nothing is amiss, since an
encoder that starts from the same place in every recording is rounded alike in all of them."""
LAW = 15.0
"""Likewise, of a curve beside a name that explains everything."""
MOST_ACCEPTED = 3
REDRAWS = 2000
"""Of the recordings held out, for the credibility."""

Say = Callable[[str], None]


class General(Protocol):
    """Suspects without a name."""

    def __call__(self, trial: Trial) -> Sequence[Suspect]:
        """For what a trial leaves over."""

    def beside(self, trial: Trial) -> Sequence[Suspect]:
        """That would mend the law of what the trial has, where it acts."""


@dataclass(frozen=True, eq=False)
class Step:
    """One round: what was screened, who was tried, who was accepted."""

    screening: Screening
    trials: tuple[Trial, ...]
    """Those that explain everything first, then by what they leave over."""
    accepted: Trial | None


@dataclass(frozen=True, eq=False)
class Selection:
    """All rounds."""

    baseline: Trial
    steps: tuple[Step, ...]
    final: Trial
    """The last that was accepted, without suspects that it does not need."""
    unnamed: tuple[Trial, ...] = ()
    """What was tried that has no name."""
    curve: Screened | None = None
    """Of one name that explains everything: a curve that promises to mend its law, whether or not recordings
    held out bear it out."""


def alarming(screening: Screening, together: float) -> Screening:
    """Only the suspects that promise so much that they are asked for although no channel shows anything.

    What slow noise promises by chance is `together` times as much as what white noise does.
    """
    loud = [one for one in screening.singles if one.gain >= together * ALARM[one.suspects[0].kind]]
    return replace(screening, singles=tuple(loud), pairs=())


def select(
    bench: Bench,
    baseline: Trial,
    screening: Screening,
    suspects: Sequence[Suspect],
    say: Say,
    general: General,
) -> Selection:
    """Rounds until nothing is left over, or no suspect removes enough of it; then shapes without a name.

    `screening` is the baseline's: of a baseline that explains everything only what is `alarming`.
    """
    best, steps = baseline, [_round(bench, baseline, screening, say)]
    while (accepted := steps[-1].accepted) is not None:
        best = accepted
        if best.complete or len(best.suspects) >= MOST_ACCEPTED:
            break
        known = {suspect.label for suspect in best.suspects}
        say("screening the suspects")
        left = [suspect for suspect in suspects if suspect.label not in known]
        steps.append(_round(bench, best, screen(best.told_from.problem, best.told_from.x, left), say))
    best = _needed(bench, best, say)
    named = [step.accepted for step in steps if step.accepted]
    curve = None
    if best.complete and len(best.suspects) == 1:
        say("checking the law")
        curve = _curve(bench, best, general)
    unnamed = (
        _with_curve(bench, best, curve, say)
        if curve
        else _unnamed(bench, baseline, named, best, say, general)
    )
    chosen = _mended(unnamed, best) or _choice(
        [trial for trial in unnamed if _replaces(trial, best, bench.later)]
    )
    final = chosen or best
    if not final.finished:
        say("fitting the final model")
        final = bench.finish(final)
    return Selection(baseline, tuple(steps), final, unnamed, curve)


def _round(bench: Bench, best: Trial, screening: Screening, say: Say) -> Step:
    """The most promising; further ones while none explains everything; what the winner is confused with."""
    share = bench.later if best.suspects else LEAST_GAIN
    ranked = [found for found in screening.singles if found.gain >= WORTH * screening.singles[0].gain]
    pairs = [pair for pair in screening.pairs[:1] if pair.gain > PAIR * screening.singles[0].gain]
    trials: list[Trial] = []
    for entered in (ranked[:1], [*ranked[1:FIRST], *pairs], ranked[FIRST : FIRST + FURTHER]):
        trials = _race(bench, best, entered, screening, trials, say)
        accepted = _choice([trial for trial in trials if _helps(trial, best, share)])
        if accepted is not None and accepted.complete:
            rivals = _rivals(accepted, trials, screening)
            trials = _race(bench, best, rivals, screening, trials, say, quick=True)
            break
    accepted = _choice([trial for trial in trials if _helps(trial, best, share)])
    return Step(screening, tuple(sorted(trials, key=_rank)), accepted)


def _unnamed(
    bench: Bench, baseline: Trial, named: Sequence[Trial], best: Trial, say: Say, general: General
) -> tuple[Trial, ...]:
    """Suspects without a name, alone and beside the first name; where more names explain everything, too.

    They may be needed only because the first has another law than the catalogue's. Beside all of them nothing
    is asked for any more.
    """
    first = named[:1]
    if best.complete:
        beside = [trial for trial in first if len(trial.suspects) < len(best.suspects)]
    else:
        beside = [baseline, *first]
    trials = []
    for trial in beside:
        rough = []
        for suspect in general(trial):
            say(f"trying {suspect.label} at the {suspect.equation}")
            suspects = (*trial.suspects, suspect)
            rough.append(bench.ahead([suspects], trial))
        trials += _finished(bench, trial, rough, [], say)
    return tuple(sorted(trials, key=_rank))


def _curve(bench: Bench, best: Trial, general: General) -> Screened | None:
    """What explains everything may still have another law: the curve beside it that promises most over all
    recordings, if that is as much as is asked of a suspect where no channel shows anything."""
    at = bench.everywhere(best)
    promised = screen(at.problem, at.x, general.beside(best), 0).singles
    return next((one for one in promised if one.gain >= bench.together * LAW), None)


def _with_curve(bench: Bench, best: Trial, curve: Screened, say: Say) -> tuple[Trial, ...]:
    say(f"fitting {curve.suspects[0].name}")
    return (bench.finish(bench.rough((*best.suspects, *curve.suspects), best)),)


def _mended(unnamed: Sequence[Trial], best: Trial) -> Trial | None:
    """What explains everything with a curve beside it, if the curve was needed: the name's own amplitude,
    that the curve may take over, need not be told from none any more."""
    return next(
        (
            trial
            for trial in unnamed
            if best.complete
            and set(best.suspects) < set(trial.suspects)
            and best.squares - trial.squares >= CLEARLY
        ),
        None,
    )


def _replaces(trial: Trial, best: Trial, share: float) -> bool:
    """Whether what has no name may stand for names: where they explain everything, only if it explains more
    by a clear margin."""
    if not best.complete:
        return _helps(trial, best, share)
    return trial.told and best.squares - trial.squares > AS_NEAR


def _helps(trial: Trial, best: Trial, share: float) -> bool:
    """Whether the trial is told from none, and removes this share of what `best` leaves over; if that is
    nothing, whether recordings foretell each other better with it."""
    gained = best.squares - trial.squares
    if best.complete:
        return trial.told and gained >= -AS_NEAR and (trial.foretold or 0.0) >= CONFIRMED
    return trial.told and gained >= max(CLEARLY, share * best.excess)


def _rank(trial: Trial) -> tuple[bool, float, float]:
    """What explains everything first, and of that what says least."""
    return not trial.complete, len(trial.suspects) if trial.complete else 0, trial.squares


def _choice(enough: Sequence[Trial]) -> Trial | None:
    """The best of those that help; of those as good as it, one that is not unlikely."""
    if not enough:
        return None
    first = min(enough, key=_rank)
    likely = [
        trial
        for trial in enough
        if _rank(trial)[:2] == _rank(first)[:2]
        and trial.squares - first.squares < AS_NEAR
        and not any(suspect.unlikely for suspect in trial.suspects)
    ]
    return first if first in likely or not likely else min(likely, key=_rank)


def _rivals(accepted: Trial, trials: Sequence[Trial], screening: Screening) -> list[Screened]:
    """The most promising, and what could be taken for the accepted explanation, that were not tried."""
    known = {suspect.label for trial in trials for suspect in trial.suspects}
    own = {suspect.label for suspect in accepted.suspects}
    names = {suspect.id for suspect in accepted.suspects}
    words = {word for suspect in accepted.suspects for word in suspect.confused_with}
    gains = [found.gain for found in screening.singles if found.suspects[0].label in own]
    least = WORTH * max(gains, default=0.0)

    def confused(one: Suspect) -> bool:
        return one.id in words or not names.isdisjoint(one.confused_with)

    return [
        found
        for place, found in enumerate(screening.singles)
        if found.suspects[0].label not in known
        and (place < FIRST or (confused(found.suspects[0]) and found.gain >= least))
    ]


def _needed(bench: Bench, best: Trial, say: Say) -> Trial:
    """Without the suspects that the others make superfluous, now that the search knows where to end.

    A search that went astray in an early round leaves something over, and invites a suspect that is none.
    """
    for suspect in best.suspects:
        if len(best.suspects) > 1:
            say(f"checking whether {suspect.label} is needed")
            trial = bench.without(suspect, best)
            if trial.complete or trial.squares <= best.squares + CLEARLY:
                best = trial
    return best


def _race(
    bench: Bench,
    best: Trial,
    entered: Sequence[Screened],
    screening: Screening,
    ended: Sequence[Trial],
    say: Say,
    *,
    quick: bool = False,
) -> list[Trial]:
    """Those entered, fitted; who falls behind, also behind those that ended before, is stopped.

    Who soon leaves little over is fitted to the end at once, and if that explains everything, nobody enters
    any more. Beside what explains everything already, one start is enough: `quick`.
    """
    if best.slight:
        trials = list(ended)
        for screened in entered:
            say(f"fitting {' and '.join(suspect.label for suspect in screened.suspects)}")
            trials.append(bench.slightly((*best.suspects, *screened.suspects), best))
        return trials
    rough: list[Trial] = []
    trials = list(ended)
    for screened in entered:
        say(f"trying {' and '.join(suspect.label for suspect in screened.suspects)}")
        rough.append(_roughly(bench, best, screened, screening, quick=quick))
        if not quick and rough[-1].rough <= MUCH * best.rough:
            trials = _finished(bench, best, rough[-1:], trials, say)
            rough.pop()
            if trials[-1].complete and trials[-1].told:
                break
    return _finished(bench, best, rough, trials, say)


def _finished(
    bench: Bench, best: Trial, rough: Sequence[Trial], ended: Sequence[Trial], say: Say
) -> list[Trial]:
    """Those who keep up with the best, fitted to the end; the others as they stand."""
    least = min((trial.rough for trial in (*rough, *ended)), default=0.0)
    trials = list(ended)
    for trial in rough:
        keeps_up = best.rough - trial.rough >= max(ALIKE * (best.rough - least), LEAST_ROUGH)
        if keeps_up:
            say(f"fitting {' and '.join(suspect.label for suspect in trial.suspects)}")
        trials.append(_to_the_end(bench, best, trial) if keeps_up else trial)
    return trials


def _to_the_end(bench: Bench, best: Trial, trial: Trial) -> Trial:
    """What explains nearly everything, but not all, may have ended beside the place where it explains all."""
    done = bench.finish(trial)
    if done.complete or done.excess > NEARLY * best.excess:
        return done
    return min(done, bench.afresh(done), key=_rank)


def _roughly(bench: Bench, best: Trial, screened: Screened, screening: Screening, *, quick: bool) -> Trial:
    """The tempered stages with what entered, from where the best stands; if that leaves much over, from the
    start machine too, and of what may start from several places, from some."""
    several: list[tuple[Suspect, ...]] = [screened.suspects]
    if len(screened.suspects) == 1:
        several = [(one,) for one in screening.variants(screened.suspects[0])[:VARIANTS]]
    every = [(*best.suspects, *more) for more in several]
    return bench.quick(every[0], best) if quick else bench.ahead(every, best)


def credibility(trials: Sequence[Trial], draws: int = REDRAWS, seed: int = 1) -> list[float]:
    """In which share of resampled sets of held-out recordings each trial leaves the least over.

    Whole recordings are resampled: samples of one err together, so that their number proves nothing.
    """
    tables = [trial.by_recording() for trial in trials]
    files = sorted(tables[0])
    squares = np.array([[table[file] for file in files] for table in tables])
    random = np.random.default_rng(seed)
    drawn = random.integers(len(files), size=(draws, len(files)))
    winners = np.argmin(squares[:, drawn].sum(axis=2), axis=0)
    return [float(count) / draws for count in np.bincount(winners, minlength=len(trials))]

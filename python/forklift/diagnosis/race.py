"""Trials of hypotheses side by side: who falls behind is stopped, and nobody begins once the work is done.

A trial is a refit's tempered stages, then the last ones if it keeps up. What a diagnosis may compute is
counted in simulated recordings (`forklift.fitting.work`), so that an answer depends neither on how busy the
machine is nor on how many threads it has; the most promising come first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from forklift.diagnosis.criteria import (
    ALIKE,
    CLEARLY,
    LEAST_ROUGH,
    MOST_OF,
    MUCH,
    NEARLY,
    ONCE_MORE,
    VARIANTS,
)
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Bars, Refitter
from forklift.diagnosis.screening import Screened, Screening
from forklift.plant.protocol import Hypothesis


@dataclass
class Race:
    """Trials, as long as any work is left.

    Attributes
    ----------
    skipped
        What was not tried within the work that a diagnosis may do.
    granted
        Whether more was granted than that.
    """

    refitter: Refitter
    clock: Clock
    skipped: list[tuple[Hypothesis, ...]] = field(default_factory=list)
    granted: bool = False

    def run(
        self,
        best: Refit,
        entered: Sequence[Screened],
        screening: Screening,
        ended: Sequence[Refit],
        *,
        quick: bool = False,
        again: bool = True,
    ) -> list[Refit]:
        """Those entered, fitted; who falls behind, also behind those that ended before, is stopped.

        Who soon leaves little over is fitted to the end at once, and if that explains everything, nobody
        enters any more. Beside what explains everything already, one start is enough: `quick`. `again`: from
        the start machine too. What shows on recordings held out alone, these must lead.
        """
        if best.quiet:
            return [*ended, *self._slightly(best, entered)]
        if best.held_out_alone and not self.refitter.strict:
            return [*ended, *self._by_all(best, entered)]
        rough: list[Refit] = []
        refits = list(ended)
        for screened in entered:
            if not self.begins("trying", screened.hypotheses):
                continue
            bars = self.bars(best, [*refits, *rough])
            one = self._roughly(best, screened, screening, bars, quick=quick, again=again)
            if quick or one.excess > MUCH * best.excess:
                rough.append(one)
                continue
            refits = self.finished(best, [one], refits)
            if refits[-1].complete and refits[-1].identifiable:
                break
        return self.finished(best, rough, refits)

    def cold(self, best: Refit, hypotheses: tuple[Hypothesis, ...], ended: Sequence[Refit]) -> list[Refit]:
        """`ended`, and one more with these beside the best, from the start machine."""
        if not self.begins("trying from the start", hypotheses):
            return list(ended)
        rough = self.refitter.cold([(*best.hypotheses, *hypotheses)], best, self.bars(best, ended))
        return self.finished(best, [rough], ended)

    def beside(self, best: Refit, hypothesis: Hypothesis, ended: Sequence[Refit]) -> list[Refit]:
        """`ended`, and one more beside the best, from where that stands."""
        if not self.begins("trying", (hypothesis,)):
            return list(ended)
        rough = self.refitter.beside((*best.hypotheses, hypothesis), best, self.bars(best, ended))
        return self.finished(best, [rough], ended)

    def say(self, what: str) -> None:
        """Something is being done."""
        self.clock.say(what)

    def goes_on(self, best: Refit) -> bool:
        """Whether work is left for a round beside the best; where that leaves nothing over, once more."""
        work = self.refitter.work
        if work.spent and best.quiet and not self.granted:
            self.granted = True
            work.grant(ONCE_MORE)
        return not work.spent

    def begins(self, what: str, hypotheses: tuple[Hypothesis, ...]) -> bool:
        """Whether there is work left for a trial of these; what there is not is kept."""
        if self.refitter.work.spent:
            self.skipped.append(hypotheses)
            return False
        self.clock.trial(f"{what} {_words(hypotheses)}")
        return True

    @staticmethod
    def bars(best: Refit, ended: Sequence[Refit]) -> Bars:
        """What a trial must come down to, to be fitted to the end: half of what the best of those that ended
        gained in each of the tempered stages, or what there was without it."""

        def bar(stage: int) -> float:
            least = min((refit.costs[stage] for refit in ended), default=best.costs[stage])
            gained = max(best.costs[stage] - least, 0.0)
            return best.costs[stage] + LEAST_ROUGH - ALIKE * gained

        return bar(0), bar(1)

    def finished(self, best: Refit, rough: Sequence[Refit], ended: Sequence[Refit]) -> list[Refit]:
        """Those who keep up with the best, fitted to the end; the others as they stand.

        Who already removes half of what the best leaves over on recordings held out keeps up, whatever it
        gains on those that were fitted: what is missing may show in the ones and not in the others.
        """
        least = min((refit.rough for refit in (*rough, *ended)), default=0.0)
        refits = list(ended)
        for refit in rough:
            keeps_up = best.rough - refit.rough >= max(ALIKE * (best.rough - least), LEAST_ROUGH)
            foretells = self.removes_most(best, refit)
            if keeps_up or foretells:
                self.say(f"fitting {_words(refit.hypotheses)}")
            refits.append(self.to_the_end(best, refit) if keeps_up or foretells else refit)
            refits += self.alone_of(best, refits[-1])
        return refits

    def led_on(self, best: Refit, refits: Sequence[Refit], least: float) -> list[Refit]:
        """Where none helps: of those given up, who removes most of what the best leaves over on recordings
        held out, fitted to the end, if that is as much as is asked."""
        given_up = [one for one in refits if not one.finished]
        first = min(given_up, key=lambda one: one.squares, default=None)
        if first is None or best.squares - first.squares < least or self.refitter.work.spent:
            return list(refits)
        self.say(f"fitting {_words(first.hypotheses)}")
        return [self.to_the_end(best, one) if one is first else one for one in refits]

    def to_the_end(self, best: Refit, refit: Refit) -> Refit:
        """What explains nearly everything, but not all, may have ended beside the place where it explains
        all."""
        done = self.refitter.finish(refit)
        if done.complete or done.excess > NEARLY * best.excess or self.refitter.work.spent:
            return done
        return min(done, self.refitter.afresh(done), key=rank)

    @staticmethod
    def removes_most(best: Refit, refit: Refit) -> bool:
        """Whether it removes most of what the best leaves over on recordings held out, and clearly."""
        return best.squares - refit.squares >= max(CLEARLY, MOST_OF * best.excess)

    def alone_of(self, best: Refit, pair: Refit) -> list[Refit]:
        """Of two that entered together and are clearly better than the best, the one that is there, if the
        other is not: it may have promised little by itself, from so far off."""
        new = [one for one in pair.hypotheses if one not in best.hypotheses]
        idle = [one for one in new if not pair.clear(one)]
        if not pair.finished or not self.removes_most(best, pair) or len(new) < 2 or len(idle) != 1:
            return []
        self.say(f"fitting without {idle[0].label}")
        return [self.refitter.without(idle[0], pair)]

    def _slightly(self, best: Refit, entered: Sequence[Screened]) -> list[Refit]:
        """Beside what leaves little over, at the sensors' own noise."""
        refits: list[Refit] = []
        for screened in entered:
            if self.begins("fitting", screened.hypotheses):
                refits.append(self.refitter.slightly((*best.hypotheses, *screened.hypotheses), best))
        return refits

    def _by_all(self, best: Refit, entered: Sequence[Screened]) -> list[Refit]:
        """Beside what leaves something over on recordings held out alone, led by all of them."""
        return [
            self.refitter.by_all((*best.hypotheses, *screened.hypotheses), best)
            for screened in entered
            if self.begins("fitting to all recordings", screened.hypotheses)
        ]

    def _roughly(
        self,
        best: Refit,
        screened: Screened,
        screening: Screening,
        bars: Bars,
        *,
        quick: bool,
        again: bool,
    ) -> Refit:
        """The tempered stages with what entered, from where the best stands; if that leaves much over, from
        the start machine too, and of what may start from several places, from some."""
        several: list[tuple[Hypothesis, ...]] = [screened.hypotheses]
        if len(screened.hypotheses) == 1:
            several = [(one,) for one in screening.variants(screened.hypotheses[0])[:VARIANTS]]
        every = [(*best.hypotheses, *more) for more in several]
        if quick:
            return self.refitter.quick(every[0], best, bars)
        promised = screened.gain / screening.cost
        return self.refitter.ahead(every, best, promised, bars, again=again)


def rank(refit: Refit) -> tuple[bool, int, bool, float]:
    """What explains everything first, and of that what says least; of as much what foretells recordings held
    out, before what these had to lead."""
    names = len(refit.hypotheses) if refit.complete else 0
    return not refit.complete, names, refit.complete and refit.pooled, refit.squares


def _words(hypotheses: Sequence[Hypothesis]) -> str:
    """Their labels; of what has no name where it acts."""
    said = [
        f"{one.label} at the {one.equation}" if one.kind == "unknown" else one.label for one in hypotheses
    ]
    return " and ".join(said)

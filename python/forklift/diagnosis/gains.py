"""A sensor's gain that the machine's own parameters have made up for: searched for from the start.

An encoder's wrong scale is for the most part a machine whose areas, openings and masses are others. The fit
of the machine alone has gone there, so that no linear step from where it ended promises what the scale itself
explains: all parameters would have to come back. So where no names explain everything, the gains of sensors
are searched for from the start machine too; all at once first, as what they leave over together, each of them
does. One counts if it explains everything by itself, nearly as well as any curve does. The same is asked
where little was left over, and a name was found that explains it: it is one, too, that a linear step from the
bent machine promised.
"""

from __future__ import annotations

from collections.abc import Sequence

from forklift.diagnosis.criteria import ALARM_SENSOR, ANOTHER_SHAPE
from forklift.diagnosis.race import Race, rank
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.screening import screen
from forklift.diagnosis.selected import Selection, Step
from forklift.plant.protocol import Hypothesis
from forklift.plant.sensor_faults import SensorUnknown


def is_gain(hypothesis: Hypothesis) -> bool:
    """Whether it is a sensor's gain, or scale."""
    return any(isinstance(one, SensorUnknown) and one.fault == "gain" for one in hypothesis.addition.free)


def gain_instead(
    race: Race,
    baseline: Refit,
    best: Refit,
    steps: Sequence[Step],
    shapes: Sequence[Refit],
    hypotheses: Sequence[Hypothesis],
) -> Step | None:
    """A round with a sensor's gain alone in the place of all so far, if these explain less than that does."""
    if not steps:
        return None
    first = steps[0]
    names = [one for one in first.refits if not any(map(is_gain, one.hypotheses))]
    refits, accepted = gains(race, baseline, best, hypotheses, names, shapes)
    refits = sorted([*names, *refits], key=rank)
    return Step(first.screening, tuple(refits), accepted) if accepted else None


def gain_for_curve(
    race: Race, found: Selection, steps: Sequence[Step], hypotheses: Sequence[Hypothesis]
) -> Step | None:
    """The same in the place of a curve that nothing but all recordings together show: what the machine's own
    parameters have made up for leaves as little, and shows in as many."""
    return gain_instead(race, found.baseline, found.final, steps, [found.final], hypotheses)


def gains(
    race: Race,
    baseline: Refit,
    best: Refit,
    hypotheses: Sequence[Hypothesis],
    names: Sequence[Refit],
    curves: Sequence[Refit],
) -> tuple[list[Refit], Refit | None]:
    """Gains that were tried alone, and the one that explains everything, if any does.

    `names` and `curves` are what was tried beside nothing. Gains of which the recordings say nothing, as of a
    lift that stands still, are not asked for; but all of them are where all recordings had to be asked: the
    machine's parameters have then gone so far that nothing shows. They are few, and take no work from all
    else. None is tried of a machine that is not expected to reach its sensors' noise: none could explain all.
    """
    refits: list[Refit] = []
    doubted = baseline.slight and best.hypotheses and not any(map(is_gain, best.hypotheses))
    own = [one for one in hypotheses if is_gain(one)]
    if not own or race.refitter.strict or (best.complete and not doubted):
        return refits, None
    with race.refitter.work.beside():
        everywhere = baseline.quiet or baseline.held_out_alone
        at = race.refitter.everywhere(baseline) if everywhere else baseline.told_from
        singles = screen(at.problem, at.x, own, 0, slow=baseline.quiet).singles
        asked = [one.hypotheses[0] for one in singles if one.evidence > 0.0 or best.foretold]
        if len(asked) > 1:
            asked = _that_may(race, baseline, asked, [*names, *curves])
        for one in asked:
            found = race.cold(baseline, (one,), [*names, *curves, *refits])
            refits = found[len(names) + len(curves) :]
            if _explains(race, baseline, best, curves, refits[-1]):
                return refits, refits[-1]
    return refits, None


def _that_may(
    race: Race, baseline: Refit, asked: Sequence[Hypothesis], ended: Sequence[Refit]
) -> list[Hypothesis]:
    """Those of them that may explain everything: none if all together do not, and of these only who is told
    from none beside the others."""
    together = race.cold(baseline, tuple(asked), ended)[len(ended)]
    return [one for one in asked if together.complete and together.clear(one)]


def _explains(race: Race, baseline: Refit, best: Refit, curves: Sequence[Refit], one: Refit) -> bool:
    """Whether a gain explains everything, is there, and does nearly as well as any curve that explains
    everything, whose many numbers follow a little more; and better than names, by what a sensor must promise
    where nothing shows. What all recordings had to be asked for is compared by all of them, else by those
    held out."""
    if not (one.finished and one.complete and one.identifiable):
        return False
    margin = race.refitter.together * ALARM_SENSOR
    if best.foretold:
        gained = race.refitter.gained(baseline, best)
        least = ANOTHER_SHAPE * gained if best in curves else gained + margin
        return race.refitter.gained(baseline, one) >= least
    most = [
        baseline.squares - ANOTHER_SHAPE * (baseline.squares - curve.squares)
        for curve in curves
        if curve.finished and curve.complete
    ]
    if best.complete:
        most.append(best.squares - 2.0 * margin)
    return one.squares <= min(most, default=float("inf"))

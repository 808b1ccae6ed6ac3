"""A sensor's gain that the machine's own parameters have made up for: searched for from the start.

An encoder's wrong scale is for the most part a machine whose areas, openings and masses are others. The fit
of the machine alone has gone there, so that no linear step from where it ended promises what the scale itself
explains: all parameters would have to come back. So where no names explain everything, the gains of sensors
are searched for from the start machine too. One counts if it explains everything by itself, nearly as well
as any curve does. The same is asked where little was left over, and a name was found that explains it: it is
one, too, that a linear step from the bent machine promised.
"""

from __future__ import annotations

from collections.abc import Sequence

from forklift.diagnosis.criteria import ALARM_SENSOR, ANOTHER_SHAPE
from forklift.diagnosis.race import Race
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.screening import screen
from forklift.plant.protocol import Hypothesis
from forklift.plant.sensor_faults import SensorUnknown


def is_gain(hypothesis: Hypothesis) -> bool:
    """Whether it is a sensor's gain, or scale."""
    return any(isinstance(one, SensorUnknown) and one.fault == "gain" for one in hypothesis.addition.free)


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
    lift that stands still, are not asked for. The others are few, and take no work from all else. None is
    tried of a machine that is not expected to reach its sensors' noise: none could explain everything.
    """
    refits: list[Refit] = []
    doubted = baseline.slight and best.hypotheses and not any(map(is_gain, best.hypotheses))
    own = [one for one in hypotheses if is_gain(one)]
    if not own or race.refitter.strict or (best.complete and not doubted):
        return refits, None
    least = _least(race, baseline, best, curves)
    with race.refitter.work.beside():
        everywhere = baseline.quiet or baseline.held_out_alone
        at = race.refitter.everywhere(baseline) if everywhere else baseline.told_from
        for screened in screen(at.problem, at.x, own, 0, slow=baseline.quiet).singles:
            if screened.evidence <= 0.0:
                continue
            found = race.cold(baseline, screened.hypotheses[0], [*names, *curves, *refits])
            refits = found[len(names) + len(curves) :]
            if _explains(refits[-1:], least):
                break
    return refits, min(_explains(refits, least), key=lambda one: one.squares, default=None)


def _explains(refits: Sequence[Refit], least: float) -> list[Refit]:
    """Those that explain everything, are there, and leave no more than this over."""
    return [one for one in refits if one.complete and one.identifiable and one.squares <= least]


def _least(race: Race, baseline: Refit, best: Refit, curves: Sequence[Refit]) -> float:
    """The sum of squares that a gain may leave: it removes nearly as much as any curve that explains
    everything, whose many numbers follow a little more; and where names do, it leaves less than they by twice
    what a sensor must promise where nothing shows."""
    told = [
        baseline.squares - ANOTHER_SHAPE * (baseline.squares - one.squares)
        for one in curves
        if one.finished and one.complete
    ]
    if best.complete:
        told.append(best.squares - 2.0 * race.refitter.together * ALARM_SENSOR)
    return min(told, default=float("inf"))

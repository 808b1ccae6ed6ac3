"""The whole of a diagnosis, for any machine: fit, locate, screen and try the hypotheses, name the causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from forklift.diagnosis.causes import Cause, causes, told
from forklift.diagnosis.criteria import BUDGET, DOUBTFUL
from forklift.diagnosis.curves import FreeCurves, over_variables
from forklift.diagnosis.dependence import Dependence
from forklift.diagnosis.locate import UnknownInput, sensors_behind, unknown_inputs
from forklift.diagnosis.progress import FITTING, TRYING, Clock
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.screening import Screening, screen
from forklift.diagnosis.selected import Selection
from forklift.diagnosis.selection import alarming, select
from forklift.plant.protocol import Hypothesis, Machine

Verdict = Literal["no-mismatch", "missing-physics", "unknown-effect", "parameter-error", "sensor-fault"]
VERDICTS: Mapping[str, Verdict] = {
    "physics": "missing-physics",
    "sensor": "sensor-fault",
    "parameter": "parameter-error",
    "unknown": "unknown-effect",
}
"""By kind of the first cause."""


@dataclass(frozen=True, eq=False)
class Investigation:
    """What came of it."""

    inputs: tuple[UnknownInput, ...]
    dependences: tuple[Dependence, ...]
    selection: Selection
    screening: Screening
    """All hypotheses at the fitted machine."""
    causes: tuple[Cause, ...]
    doubted: tuple[Cause, ...]
    """Explanations of which none is more likely than all others together."""
    elsewhere: tuple[Hypothesis, ...]
    """What has no name was found as a curve: the same curve at the other places."""
    asked: tuple[Hypothesis, ...]
    """All hypotheses that were screened, those withheld at first with them if they were."""


def investigate(
    refitter: Refitter,
    hypotheses: Sequence[Hypothesis],
    machine: Machine,
    clock: Clock,
    *,
    withheld: Sequence[Hypothesis] = (),
    hopeless: bool = False,
) -> Investigation:
    """Fit the machine; if it leaves something over, say where, and try what might explain it.

    `withheld` are not asked, since all recordings have a condition in common that they speak of; where a
    curve over that condition explains what is left over, they are asked too. `hopeless` recordings tell
    nothing: the machine is fitted, and no more.
    """
    with clock.stage(FITTING):
        baseline = refitter.baseline()
    while True:
        refitter.work.grant(BUDGET)
        inputs, seen, selection, screening, general = _from(
            refitter, baseline, hypotheses, machine, clock, hopeless
        )
        more = general.told_by(selection.final, withheld)
        if more:
            hypotheses, withheld = (*hypotheses, *more), ()
        elif selection.baseline is baseline:
            break
        baseline = selection.baseline
    found = causes(selection)
    credible = told(found)
    doubted = tuple(cause for cause in found if cause not in credible)
    elsewhere = tuple(other for one in selection.final.hypotheses for other in general.elsewhere(one))
    return Investigation(
        tuple(inputs), tuple(seen), selection, screening, credible, doubted, elsewhere, tuple(hypotheses)
    )


def _from(
    refitter: Refitter,
    baseline: Refit,
    hypotheses: Sequence[Hypothesis],
    machine: Machine,
    clock: Clock,
    hopeless: bool,
) -> tuple[list[UnknownInput], list[Dependence], Selection, Screening, FreeCurves]:
    """Screen, locate and select, from a baseline; where its search went astray, the selection has another."""
    with clock.stage("screening the hypotheses"):
        # What shows in no channel, or hardly, may still show in all recordings together.
        everywhere = baseline.slight or baseline.held_out_alone
        at = refitter.everywhere(baseline) if everywhere else baseline.told_from
        screening = screen(at.problem, at.x, hypotheses, slow=baseline.quiet)
    asked = screening
    if baseline.quiet:
        asked = alarming(screening)
    inputs: list[UnknownInput] = []
    seen: list[Dependence] = []
    general = FreeCurves(machine, {})
    if hopeless:
        selection = Selection(baseline, (), baseline)
    else:
        with clock.stage("locating the mismatch"):
            early = baseline.early
            places = [*(one.name for one in machine.places), *refitter.sensors]
            width_s = machine.hat_width_s(early.problem.samples)
            inputs = sensors_behind(unknown_inputs(early.problem, early.x, places, width_s), refitter.sensors)
            seen = over_variables(baseline, inputs[0], machine.part_of(inputs[0].port))
        with clock.stage(TRYING):
            general.known[baseline] = inputs
            selection = select(refitter, baseline, asked, hypotheses, clock, general)
    return inputs, seen, selection, screening, general


def verdict(
    selection: Selection, found: Sequence[Cause], seen: Sequence[Cause] = (), *, hopeless: bool = False
) -> Verdict:
    """In one word: by the first cause; without one, by whether anything is left over, and by what was `seen`
    before any fit. A little that nothing explains may be chance; what several explain as well is none. What
    acts in recordings that were fitted alone is left over, too."""
    baseline = selection.baseline
    if found:
        return VERDICTS[found[0].hypothesis.kind]
    unexplained = selection.final is baseline
    doubtful = unexplained and baseline.worst.mean_square <= DOUBTFUL and not baseline.strained
    left = baseline.fitted_alone or not (baseline.complete or doubtful)
    if left and not hopeless:
        return "unknown-effect"
    return VERDICTS[seen[0].hypothesis.kind] if seen else "no-mismatch"


def loudest(refit: Refit) -> str:
    """The channel in which the mismatch shows most."""
    sums: dict[str, float] = {}
    for found in refit.judged if refit.fitted_alone else refit.held_out:
        sums[found.channel] = sums.get(found.channel, 0.0) + found.excess
    return max(sums, key=lambda channel: sums[channel])

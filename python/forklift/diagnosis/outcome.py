"""What came of a diagnosis, of any machine: data, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from forklift.diagnosis.group_validation import outlying_groups
from forklift.diagnosis.numbers import Number, numbers
from forklift.diagnosis.refit import Refit
from forklift.fitting.origin import Origin
from forklift.plant.findings import Findings
from forklift.plant.protocol import Hypothesis
from forklift.plant.subject import Subject, Wanted
from forklift.recordings.noise import Sensor

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.confounding import Confounded
    from forklift.diagnosis.deficiency import Deficiency
    from forklift.diagnosis.dependence import Dependence
    from forklift.diagnosis.engine import Verdict
    from forklift.diagnosis.group_validation import GroupFold
    from forklift.diagnosis.in_use import InUse
    from forklift.diagnosis.locate import UnknownInput
    from forklift.diagnosis.misfit import Share
    from forklift.diagnosis.next_recording import Proposal
    from forklift.diagnosis.regimes import Regimes
    from forklift.diagnosis.screening import Screening
    from forklift.diagnosis.selected import Selection
    from forklift.fitting.agreement import Agreement


UNFIT = ("sensor_stuck", "sensor_slip")
"""Causes that are seen before any fit."""
COMMAND = "next_recording.csv"
"""The file of what drives the next recording."""


@dataclass(frozen=True)
class Location:
    """Where the mismatch lies.

    Attributes
    ----------
    part
        Of the machine; ``"both"`` of a forklift whose lifts are both touched; empty where there is one.
    equation
        Of the model: the field's word for it.
    signal
        In which it shows most.
    region
        Of which variable an unknown input there is a function, in words.
    share
        Of the misfit above the noise, that an unknown input there explains.
    """

    part: str
    equation: str
    signal: str
    region: str
    share: float


@dataclass(frozen=True, eq=False, repr=False)
class Outcome:
    """All that a diagnosis found.

    Attributes
    ----------
    machine
        Where the fit started.
    origin
        What it was made from.
    recordings
        Without samples that are no measurement.
    findings
        What a look at the recordings gave before any fit.
    verdict, location, causes
        The answer.
    doubted
        Explanations of which none is more likely than all others together: several fit as well.
    inputs
        An unknown input at every place, the most credible first.
    dependences
        The most credible one as a function of what is known of the moment, the best first.
    screening
        All hypotheses at the fitted machine.
    unidentifiable
        Hypotheses that were not asked, for want of a second value of a condition.
    deficiency
        Every test of what the fitted machine leaves over, and of what the final model does.
    misfit
        What the fitted machine leaves over, by recording, signal, phase and band of frequency.
    regimes
        Each cause's amplitude from two disjoint regimes.
    groups
        Each group of recordings left out in turn.
    confounded
        What could stand for a cause on these recordings, to first order.
    next_recording, next_why
        What to record next; why that, or why none.
    proposal
        What it would part, by pairs.
    before, after
        Every recording by the fitted machine, and by the final model.
    in_use
        By the label of a cause, what it does to the machine; nothing of what is none of its parts.
    sensors
        By channel, noise and count.
    seconds
        By stage.
    """

    machine: Subject
    origin: Origin
    recordings: tuple[Any, ...]
    findings: Findings
    verdict: Verdict
    location: Location | None
    causes: tuple[Cause, ...]
    doubted: tuple[Cause, ...]
    inputs: tuple[UnknownInput, ...]
    dependences: tuple[Dependence, ...]
    selection: Selection
    screening: Screening
    unidentifiable: tuple[Hypothesis, ...]
    deficiency: tuple[Deficiency, Deficiency]
    misfit: tuple[Share, ...]
    regimes: tuple[Regimes, ...]
    groups: tuple[GroupFold, ...]
    confounded: tuple[Confounded, ...]
    next_recording: Wanted | None
    next_why: str
    proposal: Proposal | None
    before: Agreement
    after: Agreement
    in_use: Mapping[str, InUse]
    sensors: Mapping[str, Sensor]
    seconds: Mapping[str, float]

    @property
    def baseline(self) -> Refit:
        """The fitted machine, without any hypothesis."""
        return self.selection.baseline

    @property
    def final(self) -> Refit:
        """With what was found."""
        return self.selection.final

    @property
    def explaining(self) -> tuple[Cause, ...]:
        """Causes of what is left over: not those that were seen before any fit."""
        return tuple(cause for cause in self.causes if cause.hypothesis.id not in UNFIT)

    @property
    def unexplained(self) -> bool:
        """Whether something is missing that has no cause."""
        return self.verdict == "unknown-effect" and not self.explaining

    @property
    def numbers(self) -> tuple[Number, ...]:
        """Every parameter of the final model with its 95 % interval."""
        return numbers(self.final)

    @property
    def values(self) -> Mapping[str, float]:
        """Parameters of the final model that are not as the machine started with them, by name."""
        return dict(self.final.found.problem.values(self.final.found.x))

    @property
    def source(self) -> str:
        """As the source of what was found."""
        return f"estimated by diagnosis of {self.origin.title} (sha256 {self.origin.sha256[:12]})"

    @property
    def title(self) -> str:
        """What the machine with what was found is called."""
        return f"{self.origin.name} diagnosed from {self.machine.name}"

    @property
    def truck(self) -> Any:
        """The machine with what was found, as its user has it: a `Truck`, a `Plant`."""
        return self.machine.named(self.values, self.source, self.title)

    def rmse(self) -> tuple[float, float]:
        """Root mean square error before and after, over all samples of what was held out.

        Driven signals are counted together, so that it says something for one, or several of one unit.
        """
        return self.before.rmse, self.after.rmse

    @property
    def judged_on(self) -> str:
        """``"validate"``; ``"estimate"`` if no recording was held out."""
        return "validate" if any(one.role == "validate" for one in self.recordings) else "estimate"

    @property
    def outlying_groups(self) -> tuple[str, ...]:
        """Groups that fit no law that fits the others."""
        return outlying_groups(self.groups)

    @property
    def untestable(self) -> tuple[Hypothesis, ...]:
        """Hypotheses of which these recordings can tell nothing."""
        if self.findings.unexcited:
            return (
                *self.unidentifiable,
                *self.screening.untestable,
                *(one.hypotheses[0] for one in self.screening.singles),
            )
        return (*self.unidentifiable, *self.screening.unidentifiable)

    @property
    def gap_closed(self) -> float:
        """(MS_before − MS_after)/(MS_before − 1), MS the mean square left over on held-out recordings."""
        before, after = self.baseline.reduced_chi2, self.final.reduced_chi2
        return (before - after) / (before - 1.0) if before > 1.0 else float("nan")

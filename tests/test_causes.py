"""What a selection comes to: one suspect tried from several places is one, and no rival of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from forklift.diagnosis.causes import causes
from forklift.diagnosis.hypothesis import Suspect
from forklift.diagnosis.refit import Trial
from forklift.diagnosis.screening import Screened, Screening
from forklift.diagnosis.selection import Selection, Step, _rivals

NOTHING = Screening(0.0, (), (), ())


@dataclass(frozen=True, eq=False)
class Tried:
    """A trial as far as causes are told from it."""

    suspects: tuple[Suspect, ...]
    left: float
    complete: bool = False
    finished: bool = True

    @property
    def left_over(self) -> float:
        return self.left

    def by_recording(self) -> dict[str, float]:
        return {"a": self.left, "b": self.left}


def suspect(name: str, *confused: str) -> Suspect:
    return Suspect(name, "physics", name, "", "friction", name, lambda problem: problem, confused)


def trial(*suspects: Suspect, left: float, complete: bool = False) -> Trial:
    return cast(Trial, Tried(suspects, left, complete))


def selected(accepted: Trial, *others: Trial) -> Selection:
    return Selection(trial(left=900.0), (Step(NOTHING, (accepted, *others), accepted),), accepted)


def test_another_start_of_the_same_suspect_is_no_rival_and_counts_for_it():
    one, again, other = suspect("overflow"), suspect("overflow"), suspect("pump")
    accepted = trial(one, left=400.0)
    (cause,) = causes(selected(accepted, trial(again, other, left=300.0), trial(again, left=350.0)))
    assert cause.suspect is one
    assert cause.credibility == 1.0
    assert [one.label for one in cause.not_separable_from] == ["pump"]
    assert [[one.label for one in names] for names, *_ in cause.rivals] == [["overflow", "pump"]]


def test_what_explains_everything_has_no_rival_that_contains_it():
    one, again, other = suspect("overflow"), suspect("overflow"), suspect("pump")
    accepted = trial(one, left=100.0, complete=True)
    (cause,) = causes(
        selected(accepted, trial(again, other, left=99.0, complete=True), trial(other, left=400.0))
    )
    assert (cause.form, cause.not_separable_from) == ("complete", ())
    assert [[one.label for one in names] for names, *_ in cause.rivals] == [["pump"]]


def test_rivals_are_those_confused_either_way_and_not_the_accepted_from_another_place():
    accepted, again = suspect("temperature", "pump"), suspect("temperature", "pump")
    said, says, neither = suspect("pump"), suspect("viscosity", "temperature"), suspect("leakage")
    fillers = [suspect(name) for name in ("a", "b", "c")]
    listed = [*fillers, again, said, says, neither]
    screening = Screening(0.0, tuple(Screened((one,), 10.0, (0.0,), (0.1,)) for one in listed), (), ())
    best = trial(accepted, left=100.0, complete=True)
    found = _rivals(best, [best, trial(fillers[0], left=500.0)], screening)
    assert [one.suspects[0].label for one in found] == ["b", "c", "pump", "viscosity"]

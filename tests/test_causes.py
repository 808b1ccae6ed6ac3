"""What a selection comes to: one hypothesis tried from several places is one, and no rival of itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import pytest

from forklift.base.typeset import as_precise, number
from forklift.diagnosis import sentences
from forklift.diagnosis.causes import causes
from forklift.diagnosis.criteria import LIKELY
from forklift.diagnosis.hypothesis import Hypothesis
from forklift.diagnosis.numbers import Number
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.rules import rivals
from forklift.diagnosis.screening import Screened, Screening
from forklift.diagnosis.selected import Selection, Step
from forklift.plant.forklift.hypotheses import hypotheses
from forklift.plant.forklift.truck import Truck
from forklift.plant.protocol import Kind

NOTHING = Screening(0.0, (), (), ())


@dataclass(frozen=True, eq=False)
class Tried:
    """A refit as far as causes are told from it."""

    hypotheses: tuple[Hypothesis, ...]
    left: float
    complete: bool = False
    finished: bool = True
    foretold: dict[str, float] | None = None
    identifiable: bool = True
    at_bounds: tuple[str, ...] = ()

    @property
    def reduced_chi2(self) -> float:
        return self.left

    def by_recording(self) -> dict[str, float]:
        return {"a": self.left, "b": self.left}


def hypothesis(name: str, *confused: str) -> Hypothesis:
    return Hypothesis(name, "physics", name, "", "friction", name, lambda problem: problem, confused)


def refit(*hypotheses: Hypothesis, left: float, complete: bool = False) -> Refit:
    return cast(Refit, Tried(hypotheses, left, complete))


def selected(accepted: Refit, *others: Refit) -> Selection:
    return Selection(refit(left=900.0), (Step(NOTHING, (accepted, *others), accepted),), accepted)


def test_another_start_of_the_same_suspect_is_no_rival_and_counts_for_it():
    one, again, other = hypothesis("overflow"), hypothesis("overflow"), hypothesis("pump")
    accepted = refit(one, left=400.0)
    (cause,) = causes(selected(accepted, refit(again, other, left=300.0), refit(again, left=350.0)))
    assert cause.hypothesis is one
    assert cause.share == 1.0
    assert [one.label for one in cause.not_separable_from] == ["pump"]
    assert [[one.label for one in names] for names, *_ in cause.rivals] == [["overflow", "pump"]]


def test_a_name_whose_form_is_uncertain_leaves_something_for_a_law_that_was_not_tried():
    one, other = hypothesis("overflow"), hypothesis("pump")
    nameless = replace(hypothesis("unknown"), kind="unknown")
    (settled,) = causes(selected(refit(one, left=100.0, complete=True), refit(other, left=400.0)))
    (open_,) = causes(selected(refit(one, left=300.0), refit(other, left=400.0)))
    (unnamed,) = causes(selected(refit(nameless, left=300.0)))
    assert (settled.share, settled.form, settled.credibility) == (1.0, "complete", 1.0)
    assert (open_.share, open_.form) == (1.0, "uncertain")
    assert LIKELY < open_.credibility < 0.9
    assert (unnamed.form, unnamed.credibility) == ("uncertain", unnamed.share)  # it claims no name


def test_what_explains_everything_has_no_rival_that_contains_it():
    one, again, other = hypothesis("overflow"), hypothesis("overflow"), hypothesis("pump")
    accepted = refit(one, left=100.0, complete=True)
    (cause,) = causes(
        selected(accepted, refit(again, other, left=99.0, complete=True), refit(other, left=400.0))
    )
    assert (cause.form, cause.not_separable_from) == ("complete", ())
    assert [[one.label for one in names] for names, *_ in cause.rivals] == [["pump"]]


def test_rivals_are_those_confused_either_way_and_not_the_accepted_from_another_place():
    accepted, again = hypothesis("temperature", "pump"), hypothesis("temperature", "pump")
    said, says, neither = hypothesis("pump"), hypothesis("viscosity", "temperature"), hypothesis("leakage")
    fillers = [hypothesis(name) for name in ("a", "b", "c")]
    listed = [*fillers, again, said, says, neither]
    screening = Screening(0.0, tuple(Screened((one,), 10.0, (0.0,), (0.1,)) for one in listed), (), ())
    best = refit(accepted, left=100.0, complete=True)
    found = rivals(best, [best, refit(fillers[0], left=500.0)], screening)
    assert [one.hypotheses[0].label for one in found] == ["b", "c", "pump", "viscosity"]


def test_a_curve_that_mends_a_law_is_part_of_its_cause_and_none_of_its_own():
    name = hypothesis("viscosity")
    curve = Hypothesis("unknown", "unknown", "curve", "", "friction", "c", lambda problem: problem, over="x")
    (cause,) = causes(selected(refit(name, curve, left=100.0, complete=True), refit(name, left=120.0)))
    assert (cause.hypothesis, cause.curve, cause.form) == (name, curve, "uncertain")


@pytest.mark.parametrize(
    ("where", "at", "mended", "form"),
    [
        ("", "free", True, "uncertain"),
        ("free", "free", True, "uncertain"),
        ("main", "free", False, "complete"),
        ("free", "", False, "uncertain"),  # not mended by it, but it acts on this part too
    ],
)
def test_a_law_of_the_whole_machine_is_mended_by_a_curve_at_any_of_its_parts(where, at, mended, form):
    name = replace(hypothesis("back_pressure"), where=where)
    curve = replace(hypothesis("curve"), id="unknown", kind="unknown", where=at, over="x")
    first, *others = causes(selected(refit(name, curve, left=100.0, complete=True), refit(name, left=120.0)))
    assert first.hypothesis == name
    assert (first.curve == curve, first.form) == (mended, form)
    assert len(others) == (not mended)


@pytest.mark.parametrize("where", ["", "free"])
def test_the_same_curve_on_both_lifts_mends_the_law_of_what_acts_on_both(where: str) -> None:
    name = replace(hypothesis("back_pressure"), where=where)
    free, main = (
        replace(hypothesis("curve"), id="unknown", kind="unknown", where=lift, over="x")
        for lift in ("free", "main")
    )
    both = refit(name, free, main, left=100.0, complete=True)
    first, *others = causes(selected(both, refit(name, left=120.0)))
    assert first.curves == ((free, main) if not where else (free,))
    assert [one.hypothesis for one in others] == ([] if not where else [main])


def test_a_rival_that_ended_in_no_number_is_none():
    """As of a machine that swings up by itself."""
    accepted, other = refit(hypothesis("overflow"), left=400.0), refit(hypothesis("pump"), left=float("inf"))
    (cause,) = causes(selected(accepted, other))
    assert cause.share == 1.0
    assert cause.rivals == ()


@pytest.mark.parametrize(
    ("value", "said"), [(float("nan"), "—"), (None, "—"), (float("inf"), "∞"), (-float("inf"), "−∞")]
)
def test_what_is_no_number_is_printed(value, said):
    assert number(value) == said


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((1.13, 1.01), ["1.1", "1.0"]),
        ((0.98, 1.0), ["0.98", "1.00"]),
        ((51.53, 1.06), ["51.5", "1.1"]),
        ((-3.2, 41.0), ["−3.2", "41.0"]),
        ((430.0, 1.2), ["430", "1.2"]),
        ((5.0, 0.0), ["5", "0"]),
    ],
)
def test_numbers_that_are_compared_have_as_many_decimals(values, said):
    assert as_precise(*values) == said


@pytest.mark.parametrize(
    ("lower", "upper", "beyond"),
    [(0.011, 0.019, True), (0.011, 0.021, False), (0.16, 0.3, True), (0.1, 0.16, False), (0.01, 0.2, False)],
)
def test_what_no_such_part_has_leaves_a_law_uncertain(
    monkeypatch: pytest.MonkeyPatch, lower: float, upper: float, beyond: bool
) -> None:
    """A damping ratio of tyres lies between 0.02 and 0.15: only an interval with nothing in common speaks
    against it, and the size of the effect is asked for nothing."""
    name = replace(hypothesis("chassis"), plausible=(("damping_ratio", 0.02, 0.15),))
    told = [
        Number("compliance", "m/N", 0.0, 1e-9, 0.9e-9, 1.1e-9),
        Number("damping_ratio", "1", 0.05, (lower * upper) ** 0.5, lower, upper),
    ]
    monkeypatch.setattr("forklift.diagnosis.causes.of_hypothesis", lambda refit, one: iter(told))
    (cause,) = causes(selected(refit(name, left=100.0, complete=True)))
    assert cause.form == ("uncertain" if beyond else "complete")
    assert [one.number.name for one in cause.beyond] == (["damping_ratio"] if beyond else [])


@pytest.mark.parametrize("at_bound", [True, False])
def test_a_size_that_no_such_part_has_speaks_against_a_name_only_at_its_bound(
    monkeypatch: pytest.MonkeyPatch, at_bound: bool
) -> None:
    """A hose whose oil would have to be heavier than any: its inertance is at its bound."""
    name = replace(hypothesis("hose"), plausible=(("hose", 5e6, 6e7),))
    assert name.amplitude == "hose"
    told = [Number(name.amplitude, "Pa s2/m3", 0.0, 1e8, 9.1e7, 1e8)]
    monkeypatch.setattr("forklift.diagnosis.causes.of_hypothesis", lambda refit, one: iter(told))
    ended = Tried((name,), 100.0, complete=True, at_bounds=(name.amplitude,) if at_bound else ())
    (cause,) = causes(selected(cast(Refit, ended)))
    assert cause.form == ("uncertain" if at_bound else "complete")
    assert [one.number.name for one in cause.beyond] == ([name.amplitude] if at_bound else [])


def test_a_place_is_plausible_where_the_lift_came_by_and_the_rest_as_the_catalogue_has_it() -> None:
    truck = Truck.read("thesis")
    told = [
        one
        for one in hypotheses(truck, ["main"], ["position_main_m"], {"main": (0.2, 2.9)})
        if one.id == "friction_position"
    ]
    assert {one.plausible for one in told} == {
        (
            ("main.friction_position.rise", -0.5, 2.0),
            ("main.friction_position.centre", 0.2, 2.9),
            ("main.friction_position.width", 0.05, 0.5),
        )
    }


def test_what_is_told_beside_such_a_number_is_uncertain_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A filter in cold oil, told as a hose that resists and one whose oil is heavier than any."""
    hose, inertia = hypothesis("hose"), replace(hypothesis("inertia"), plausible=(("inertia", 5e6, 6e7),))
    numbers = {hose: Number("hose", "Pa s2/m6", 0.0, 3e12, 2.9e12, 3.1e12)}
    numbers[inertia] = Number("inertia", "Pa s2/m3", 0.0, 1e8, 9.1e7, 1e8)
    monkeypatch.setattr("forklift.diagnosis.causes.of_hypothesis", lambda refit, one: iter([numbers[one]]))
    ended = cast(Refit, Tried((hose, inertia), 100.0, complete=True, at_bounds=("inertia",)))
    first, second = causes(selected(ended))
    assert (first.form, second.form) == ("uncertain", "uncertain")
    assert (first.beyond, first.beside) == ((), (inertia,))
    assert second.beyond
    assert second.beside == ()
    assert "inertia" in sentences.doubt(first)


@pytest.mark.parametrize(
    ("kind", "equation", "where", "faint", "forms"),
    [
        ("physics", "friction", "free", True, ["uncertain", "uncertain"]),
        ("physics", "friction", "free", False, ["complete", "complete"]),
        ("physics", "friction", "main", True, ["complete", "uncertain"]),
        ("physics", "valve", "free", True, ["complete", "uncertain"]),
        ("parameter", "operating-point", "", True, ["uncertain", "uncertain"]),
        ("parameter", "operating-point", "", False, ["complete", "complete"]),
        ("sensor", "sensor", "free", True, ["complete", "complete"]),
    ],
)
def test_what_hardly_shows_may_mend_the_law_of_what_acts_in_its_equation_or_depends_on_it(
    kind: Kind, equation: str, where: str, faint: bool, forms: list[str]
) -> None:
    """Friction that grows at rest and saturates, told with a second friction at the place where it rested; a
    spool with backlash, told as a dead time with oil warmer than recorded."""
    dwell, place = (replace(hypothesis(name), where="free") for name in ("dwell", "place"))
    place = replace(place, kind=kind, equation=equation, where=where)
    first = refit(dwell, left=200.0)
    both = cast(Refit, Tried((dwell, place), 100.0, complete=True, foretold={"a": 7.0} if faint else None))
    steps = tuple(Step(NOTHING, (one,), one) for one in (first, both))
    found = causes(Selection(refit(left=900.0), steps, both))
    assert [one.form for one in found] == forms
    assert ("place" in sentences.doubt(found[0])) == (forms[0] == "uncertain")
    assert bool(sentences.doubt(found[1])) == (forms[1] == "uncertain")
    assert ("dwell" in sentences.doubt(found[1])) == (forms == ["uncertain", "uncertain"])


@pytest.mark.parametrize(
    ("kind", "where", "form"),
    [
        ("physics", "main", "uncertain"),
        ("physics", "", "uncertain"),
        ("physics", "free", "complete"),
        ("parameter", "", "uncertain"),
        ("sensor", "main", "complete"),
    ],
)
def test_a_law_that_explains_everything_only_beside_what_has_no_name_is_uncertain(
    kind: Kind, where: str, form: str
) -> None:
    """Dry friction that falls with temperature, told as viscous friction that does, and a force without a
    name over the position: what nobody knows the law of may bend any law on its lift."""
    name = replace(hypothesis("viscous"), kind=kind, where=where)
    force = replace(hypothesis("force"), kind="unknown", where="main", equation="balance")
    both = refit(name, force, left=100.0, complete=True)
    alone = refit(name, left=200.0)
    step = Step(NOTHING, (alone,), alone)
    named, unnamed = causes(Selection(refit(left=900.0), (step,), both))
    assert (named.form, unnamed.form) == (form, "uncertain")
    assert ("force" in sentences.doubt(named)) == (form == "uncertain")


@pytest.mark.parametrize(
    ("left", "of", "amplitude", "form"),
    [
        (108.0, "physics", "size", "uncertain"),  # 99 % of what it removes
        (108.0, "sensor", "lag", "uncertain"),
        (140.0, "physics", "size", "complete"),  # 95 %
        (108.0, "parameter", None, "complete"),  # it follows whatever differs from one recording to the next
        (108.0, "unknown", "bend", "complete"),  # a curve follows anything
    ],
)
def test_a_law_is_uncertain_if_a_little_other_one_of_a_rival_would_do_as_well(
    left: float, of: Kind, amplitude: str | None, form: str
) -> None:
    """All signals arrive late; or the valve does, behind several lags."""
    late = replace(hypothesis("late"), amplitude="late")
    rival = replace(hypothesis("slow"), kind=of, amplitude=amplitude)
    accepted = refit(late, left=100.0, complete=True)
    (cause,) = causes(selected(accepted, refit(rival, left=left)))
    assert cause.form == form
    assert ("“slow” removes 99.0 %" in sentences.doubt(cause)) == (form == "uncertain")


def test_what_is_told_with_its_rival_beside_it_is_no_rival_of_it() -> None:
    """A rival that holds the cause and more says nothing of another law."""
    late, slow = (replace(hypothesis(name), amplitude=name) for name in ("late", "slow"))
    accepted = refit(late, left=100.0, complete=True)
    (cause,) = causes(selected(accepted, refit(late, slow, left=101.0)))
    assert cause.form == "complete"


def test_a_name_that_came_to_nothing_is_no_rival_of_a_curve():
    """Its linear step promises to foretell recordings better than the curve; but fitted, it is not there."""
    curve = replace(hypothesis("unknown"), kind="unknown")
    names = [hypothesis("hose_resistance"), hypothesis("valve_delay")]
    found = [
        Tried((one,), left, foretold={"a": score, "b": score}, identifiable=there)
        for one, left, score, there in (
            (curve, 0.8, 26.0, True),
            (names[0], 0.93, 45.0, False),
            (names[1], 0.93, 10.0, True),
        )
    ]
    final, *others = (cast(Refit, one) for one in found)
    steps = (Step(NOTHING, tuple(others), None),)
    (cause,) = causes(Selection(refit(left=0.94), steps, final))
    assert cause.share == 1.0
    assert [[one.label for one in names] for names, *_ in cause.rivals] == [["valve_delay"]]

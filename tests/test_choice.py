"""Which of several explanations is accepted, and which are not worth a trial."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import nan
from types import SimpleNamespace
from typing import Any, cast

import pytest

from forklift import Truck
from forklift.diagnosis.criteria import (
    AS_NEAR,
    CLEARLY,
    LEAST_EFFECT,
    LEAST_FAULT,
    LEAST_GAIN,
    LIVES_BEYOND,
    MISFIT,
    SAME_PLACE,
    SIMPLER,
)
from forklift.diagnosis.curves import FreeCurves
from forklift.diagnosis.group_validation import GroupFold
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.race import Race
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.rules import (
    choice,
    foresees,
    helping,
    helps,
    led_elsewhere,
    may_help,
    measures,
    mended,
    replaces,
    stands_alone,
)
from forklift.diagnosis.screening import Screened, Screening
from forklift.diagnosis.selected import Selection
from forklift.diagnosis.selection import alarming, needed
from forklift.plant.forklift.unnamed import curves
from forklift.plant.protocol import Addition, Hypothesis


@dataclass(frozen=True, eq=False)
class Name:
    """A hypothesis as far as these decisions need it."""

    label: str
    kind: str = "physics"
    where: str = "main"
    equation: str = "friction"
    unlikely: bool = False
    amplitude: str | None = "amplitude"

    @property
    def equations(self) -> tuple[str, ...]:
        return (self.equation,)


@dataclass(frozen=True, eq=False)
class Tried:
    """A refit likewise; what is left over is its excess."""

    hypotheses: tuple[Name, ...] = ()
    squares: float = 0.0
    excess: float = 0.0
    complete: bool = False
    slight: bool = False
    strained: bool = False
    strains_alone: bool = False
    finished: bool = True
    identifiable: bool = True
    at_bounds: tuple[str, ...] = ()
    freedoms: int = 1
    worst: Any = field(default_factory=lambda: SimpleNamespace(mean_square=10.0))
    loo_log_score: float | None = None
    foretold: Any = None
    missing: float = 1000.0
    pooled: bool = False
    sizes: dict[str, float] = field(default_factory=dict)

    @property
    def quiet(self) -> bool:
        return self.complete or self.slight

    def by_recording(self) -> dict[str, float]:
        return {"a": 0.5 * self.squares, "b": 0.5 * self.squares}

    def size(self, name: Name) -> float:
        return self.sizes.get(name.label, 1.0)


LEAK, DRY, STRIBECK = Name("leak"), Name("dry friction"), Name("Stribeck")
CURVE = Name("curve", "unknown")
OIL = Name("oil temperature", "parameter", amplitude=None)


def chosen(*refits: Tried, before: float = 1500.0) -> Tried:
    beside = cast(Refit, Tried(squares=before))
    return cast(Tried, choice([cast(Refit, refit) for refit in refits], beside))


def test_the_best_is_chosen_and_of_those_that_explain_everything_the_shortest():
    assert chosen(best := Tried((LEAK,), 100.0), Tried((DRY,), 500.0)) is best
    both = Tried((LEAK, DRY), 90.0, complete=True)
    assert chosen(both, one := Tried((LEAK,), 100.0, complete=True)) is one


def test_what_foretells_recordings_held_out_goes_before_what_these_had_to_lead():
    """Friction along the stroke followed a cushion as soon as the recording that met it was fitted too."""
    led, foretold = Tried((DRY,), 100.0, complete=True, pooled=True), Tried((LEAK,), 400.0, complete=True)
    assert chosen(led, foretold) is foretold
    assert chosen(led, replace(foretold, complete=False)) is led
    assert chosen(led, replace(foretold, pooled=True)) is led
    assert chosen(led, Tried((LEAK, DRY), 90.0, complete=True)) is led  # which says less


def test_a_number_at_its_bound_yields_to_a_simpler_twin_within_the_margin():
    bound = Tried((STRIBECK,), 1000.0, at_bounds=("width",), freedoms=3)
    assert chosen(bound, twin := Tried((DRY,), 1000.0 + 0.5 * AS_NEAR)) is twin
    assert chosen(bound, Tried((DRY,), 1000.0 + 2.0 * AS_NEAR)) is bound
    twin = Tried((DRY,), 1000.0 + 2.0 * AS_NEAR)
    assert chosen(bound, twin, before=1000.0 + 1.1 * 2.0 * AS_NEAR / SIMPLER) is twin
    free = Tried((STRIBECK,), 1000.0, freedoms=3)
    assert chosen(free, Tried((DRY,), 1000.0 + 0.5 * AS_NEAR)) is free


@pytest.mark.parametrize(
    ("kind", "removed", "told"),
    [("sensor", 0.99, "valve"), ("sensor", 0.97, "late"), ("physics", 0.99, "late")],
)
def test_signals_that_are_all_late_yield_to_a_valve_that_answers_late(kind, removed, told):
    """A valve behind several lags is a dead time but for two deviations in a hundred."""
    late = Tried((Name("late", kind, unlikely=True),), 1000.0, complete=True)
    valve = Tried((Name("valve"),), 1000.0 + (1.0 - removed) * 9000.0, complete=True)
    assert chosen(late, valve, before=10000.0).hypotheses[0].label == told


def replaced(refit: Tried, best: Tried, baseline: Tried) -> bool:
    return replaces(cast(Refit, refit), cast(Refit, best), cast(Refit, baseline), 0.5)


@pytest.mark.parametrize(
    ("alone", "beside", "best_complete", "taken"),
    [
        (Tried((CURVE,), 300.0, complete=True), Tried((LEAK, CURVE), 301.0 + AS_NEAR), False, True),
        (Tried((CURVE,), 300.0, complete=True), Tried((LEAK, CURVE), 299.0 + AS_NEAR), False, False),
        (Tried((CURVE,), 300.0), Tried((LEAK, CURVE), 400.0), False, False),  # something is left over
        (Tried((CURVE,), 300.0, complete=True), Tried((LEAK, CURVE), 400.0), True, False),
        (Tried((CURVE,), 2000.0, complete=True), Tried((LEAK, CURVE), 2500.0), False, False),
        (Tried((CURVE,), 300.0, complete=True), None, False, False),  # none was tried with the name
    ],
)
def test_a_curve_that_explains_all_stands_for_a_name_that_does_not_and_needs_one(
    alone: Tried, beside: Tried | None, best_complete: bool, taken: bool
) -> None:
    """A valve that needs the longer the further it has to go, told as a dead time with a curve."""
    best = cast(Refit, Tried((LEAK,), 2400.0, 1100.0, complete=best_complete))
    tried = [cast(Refit, one) for one in (alone, beside) if one]
    assert stands_alone(tried[0], best, tried) is taken


def test_a_curve_at_the_place_of_a_name_mends_it_with_less_than_a_second_cause_needs():
    baseline, best = Tried((), 9000.0, 8000.0), Tried((LEAK,), 5000.0, 4000.0)
    less = 5000.0 - 1.1 * SAME_PLACE * 4000.0
    assert replaced(Tried((LEAK, CURVE), less), best, baseline)
    elsewhere = Name("curve", "unknown", equation="tank")
    assert not replaced(Tried((LEAK, elsewhere), less), best, baseline)


def test_a_curve_instead_of_a_name_must_gain_much_more():
    baseline, best = Tried((), 9000.0, 8000.0), Tried((LEAK,), 8000.0, 7000.0)
    assert replaced(Tried((CURVE,), 7000.0), best, baseline)
    assert not replaced(Tried((CURVE,), 7800.0), best, baseline)


def test_who_was_stopped_on_the_way_replaces_nobody():
    baseline, best = Tried((), 9000.0, 8000.0), Tried((LEAK,), 8000.0, 7000.0)
    assert not replaced(Tried((CURVE,), 1000.0, finished=False), best, baseline)


@pytest.mark.parametrize(
    ("left", "first", "share"),
    [(0.9 * MISFIT, True, LEAST_GAIN), (2.0 * MISFIT, True, 0.1), (2.0 * MISFIT, False, 0.5)],
    ids=["faint", "clear", "second"],
)
def test_who_could_not_remove_enough_is_not_tried(left, first, share):
    channel = SimpleNamespace(samples=100)
    seen = SimpleNamespace(rows=range(200))
    found = SimpleNamespace(problem=SimpleNamespace(samples=[SimpleNamespace(observed=[seen])]))
    best: Any = SimpleNamespace(
        complete=False,
        slight=False,
        quiet=False,
        hypotheses=() if first else (DRY,),
        excess=1000.0,
        worst=SimpleNamespace(mean_square=left),
        held_out=[channel],
        found=found,
    )
    needed = 0.5 * share * 1000.0 * 2.0 / LIVES_BEYOND
    refitter = cast(Refitter, SimpleNamespace(later=0.5, together=1.0))

    def helps(gain: float) -> bool:
        return may_help(Screened((cast(Hypothesis, LEAK),), gain, (), ()), best, refitter)

    assert helps(1.01 * needed)
    assert not helps(0.99 * needed)


@pytest.mark.parametrize(
    ("gained", "left", "complete", "together", "accepted"),
    [
        (300.0, 1.6, True, 1.0, True),
        (300.0, 1.6, False, 1.0, False),  # something is left, so that half of the mismatch is asked for
        (300.0, 1.6, True, 15.0, False),  # slow noise promises as much
        (CLEARLY - 1.0, 1.6, True, 1.0, False),
    ],
    ids=["whole", "part", "slow noise", "little"],
)
def test_of_a_faint_mismatch_who_leaves_nothing_over_need_not_remove_half_of_what_noise_is_part_of(
    gained, left, complete, together, accepted
):
    best = Tried((), 10_000.0, 1500.0, worst=SimpleNamespace(mean_square=left))
    refit = Tried((LEAK,), 10_000.0 - gained, 1500.0 - gained, complete=complete)
    refitter = SimpleNamespace(together=together, later=0.5)
    kept = helping([cast(Refit, refit)], cast(Refit, best), cast(Refitter, refitter), ())
    assert bool(kept) is accepted


@pytest.mark.parametrize(("missing", "accepted"), [(0.4, True), (0.6, False)])
def test_of_a_faint_mismatch_half_of_what_is_not_explained_is_enough(missing, accepted):
    """Beside it stands what is no larger than noise may be, channel by channel, which nothing removes."""
    best = Tried((), 10_000.0, 3000.0, worst=SimpleNamespace(mean_square=0.7 * MISFIT))
    refit = Tried((LEAK,), 8800.0, 1800.0, missing=missing * best.missing)
    refitter = cast(Refitter, SimpleNamespace(together=1.0, later=0.5))
    assert bool(helping([cast(Refit, refit)], cast(Refit, best), refitter, ())) is accepted


@pytest.mark.parametrize(
    ("strained", "slight", "accepted"), [(True, True, True), (True, False, False), (False, True, False)]
)
def test_what_eases_strain_and_leaves_next_to_nothing_need_not_remove_half_of_what_is_not_explained(
    strained: bool, slight: bool, accepted: bool
) -> None:
    """Oil of another law in the cold: each recording's temperature had made up for it."""
    best = Tried((), 10_000.0, 3000.0, strained=strained, worst=SimpleNamespace(mean_square=0.7 * MISFIT))
    refit = Tried((LEAK,), 9500.0, 2500.0, missing=0.8 * best.missing, slight=slight)
    refitter = cast(Refitter, SimpleNamespace(together=1.0, later=0.5))
    assert bool(helping([cast(Refit, refit)], cast(Refit, best), refitter, ())) is accepted


@dataclass(frozen=True, eq=False)
class Pair(Tried):
    """A refit whose amplitudes are told from none, or some are not."""

    idle: tuple[Name, ...] = ()

    def clear(self, name: Name) -> bool:
        return name not in self.idle


@pytest.mark.parametrize(
    ("idle", "left", "without"),
    [
        ((DRY,), 500.0, (LEAK,)),  # that one is not there: it goes
        ((), 500.0, None),
        ((LEAK, DRY), 500.0, None),
        ((DRY,), 1500.0, None),  # they gained too little
    ],
)
def test_of_two_that_entered_together_the_one_that_is_not_there_goes(idle, left, without) -> None:
    """A truck on its tyres promised little by itself, and with a dead time that is none explained all."""
    taken: list[Name] = []

    class Without:
        def without(self, name: Name, refit: Tried) -> Tried:
            taken.append(name)
            return Tried(tuple(one for one in refit.hypotheses if one is not name), 500.0)

        def finish(self, refit: Tried) -> Tried:
            return refit

    best = Pair((), 3000.0, 2000.0)
    pair = Pair((LEAK, DRY), 1000.0 + left, left, complete=True, idle=idle)
    race = Race(cast(Refitter, Without()), Clock())
    found = race.alone_of(cast(Refit, best), cast(Refit, pair))
    assert [one.hypotheses for one in found] == ([] if without is None else [without])
    assert taken == ([] if without is None else list(idle))


@pytest.mark.parametrize("beside", [(), (DRY,)], ids=["first", "second"])
def test_a_second_name_may_leave_nothing_over_of_what_is_faint_too(beside):
    best = Tried(beside, 10_000.0, 1500.0, worst=SimpleNamespace(mean_square=0.9 * MISFIT))
    refit = Tried((*beside, LEAK), 9700.0, 1200.0, complete=True)
    refitter = SimpleNamespace(together=1.0, later=0.5)
    kept = helping([cast(Refit, refit)], cast(Refit, best), cast(Refitter, refitter), ())
    assert kept == [refit]


def test_where_all_recordings_were_asked_they_decide():
    """Where nothing shows, what is held out alone differs by less than chance does."""
    held, every = (Tried((name,), squares, complete=True) for name, squares in ((LEAK, 990.0), (DRY, 1000.0)))
    assert chosen(held, every) is held
    held, every = replace(held, loo_log_score=21.0), replace(every, loo_log_score=85.0)
    assert chosen(held, every) is every
    doubtful = replace(every, hypotheses=(replace(STRIBECK, unlikely=True),), loo_log_score=88.0)
    assert chosen(held, every, doubtful) is every
    far = replace(every, squares=990.0 + 2.0 * AS_NEAR)
    assert chosen(held, far) is far


def test_what_has_a_freedom_in_every_recording_must_remove_as_much_as_a_curve():
    best, law = Tried((), 10_000.0, 9000.0), Tried((CURVE,), 5000.0)
    refitter = cast(Refitter, SimpleNamespace(together=1.0, later=0.5))

    def kept(refit: Tried) -> bool:
        shapes = [cast(Refit, law)]
        return bool(helping([cast(Refit, refit)], cast(Refit, best), refitter, shapes))

    assert kept(Tried((LEAK,), 7000.0))
    assert not kept(Tried((OIL,), 7000.0))
    assert kept(Tried((OIL,), 4900.0))
    assert kept(Tried((OIL,), 7000.0, complete=True))


def test_a_curve_is_unlikely_where_its_variable_does_not_act():
    truck = Truck.read("thesis")

    def unlikely(port: str, variable: str) -> bool:
        return curves(truck, "free", port, "", variable, 0.0, 1.0)[0].unlikely

    assert not unlikely("current", "other_command")
    assert unlikely("viscosity", "other_command")
    assert not unlikely("viscosity", "oil_temperature")
    assert not unlikely("viscosity", "load")
    assert unlikely("viscosity", "position")
    assert unlikely("bulk_modulus", "speed")
    assert not unlikely("opening", "speed")


def test_of_curves_that_promise_nearly_as_much_the_likely_one_goes_first():
    def curve(evidence: float, *, unlikely: bool) -> Screened:
        return Screened((cast(Hypothesis, Name("c", unlikely=unlikely)),), evidence, (), (), evidence)

    best, near, far = curve(100.0, unlikely=True), curve(90.0, unlikely=False), curve(75.0, unlikely=False)
    ranked = sorted([best, near, far], key=lambda one: FreeCurves.yields_to(one, best))
    assert ranked == [near, best, far]


def test_a_curve_mends_a_name_and_not_a_machine_that_leaves_little_over():
    nothing, name = Tried((), 1000.0, 600.0, slight=True), Tried((LEAK,), 1000.0, 600.0, slight=True)
    curve, beside = Tried((CURVE,), 900.0), Tried((LEAK, CURVE), 900.0)
    assert mended([cast(Refit, curve)], cast(Refit, nothing)) is None
    assert mended([cast(Refit, beside)], cast(Refit, name)) is beside


@dataclass(frozen=True, eq=False)
class Asked:
    """A refit whose names are asked whether they are needed."""

    hypotheses: tuple[Hypothesis, ...]
    loo_log_score: float | None = None
    complete: bool = True
    squares: float = 100.0
    excess: float = 0.0

    def deviations(self, hypothesis: Hypothesis) -> float:
        return 0.0


class Without:
    """A refitter that says that nothing is needed."""

    later = 0.5
    together = 1.0

    def without(self, hypothesis: Hypothesis, refit: Asked) -> Asked:
        return Asked(tuple(one for one in refit.hypotheses if one is not hypothesis))


def test_a_condition_that_recordings_confirm_is_not_dropped_for_want_of_a_need():
    load = Hypothesis("load_entered", "parameter", "", "", "", None, Addition())
    gain = Hypothesis("pressure_gain", "sensor", "", "", "", "gain", Addition())
    race = Race(cast(Refitter, Without()), Clock())
    unconfirmed = needed(race, cast(Refit, Asked((load, gain))))
    assert unconfirmed.hypotheses == (gain,)
    confirmed = needed(race, cast(Refit, Asked((load, gain), loo_log_score=200.0)))
    assert load in confirmed.hypotheses


@pytest.mark.parametrize(("score", "stays"), [(None, False), (70.0, True)])
def test_a_second_name_that_recordings_confirm_is_not_dropped_because_those_held_out_are_few(score, stays):
    leak, limit = (Hypothesis(id, "physics", "", "", "", id, Addition()) for id in ("leak", "limit"))

    class Held:
        later = 0.5
        together = 1.0

        def without(self, hypothesis: Hypothesis, refit: Asked) -> Asked:
            rest = tuple(one for one in refit.hypotheses if one is not hypothesis)
            return Asked(rest, squares=5000.0 if hypothesis is leak else refit.squares + 20.0)

    best = Asked((leak, limit), loo_log_score=score)
    found = needed(Race(cast(Refitter, Held()), Clock()), cast(Refit, best))
    assert found.hypotheses == ((leak, limit) if stays else (leak,))


def test_who_gains_much_without_being_there_only_ended_elsewhere():
    best = Tried((), 9000.0, 8000.0)
    there = Tried((LEAK,), 4000.0)
    absent = Tried((DRY,), 5000.0, identifiable=False)
    little = Tried((STRIBECK,), 8900.0, identifiable=False)
    stopped = Tried((CURVE,), 1000.0, identifiable=False, finished=False)

    def elsewhere(*refits: Tried) -> Refit | None:
        return led_elsewhere([cast(Refit, one) for one in refits], cast(Refit, best), 0.1)

    assert elsewhere(there, absent, little, stopped) is cast(Refit, absent)
    assert elsewhere(there, little, stopped) is None


@pytest.mark.parametrize(("gained", "stays"), [(20.0, False), (400.0, True)])
def test_where_nothing_is_left_over_a_name_stays_that_gains_what_it_must_promise_there(gained, stays):
    """A curve beside a name leaves nothing over without it either, where hardly anything was left at all."""
    lag = Hypothesis("valve_lag", "physics", "", "", "", "share", Addition())
    curve = Hypothesis("unknown", "unknown", "", "", "", None, Addition())

    class Curve:
        later = 0.5
        together = 1.0

        def without(self, hypothesis: Hypothesis, refit: Asked) -> Asked:
            return Asked((curve,), squares=100.0 + gained)

    found = needed(Race(cast(Refitter, Curve()), Clock()), cast(Refit, Asked((lag, curve))))
    assert (lag in found.hypotheses) is stays


@pytest.mark.parametrize(("removed", "stays"), [(0.4, False), (0.6, True)])
def test_no_name_stays_that_removes_less_than_it_must_to_be_accepted(removed, stays):
    """However surely its amplitude is told from none: many samples tell anything from none."""
    much, little = (Hypothesis(id, "physics", "", "", "", id, Addition()) for id in ("much", "little"))

    class Sure(Asked):
        def deviations(self, hypothesis: Hypothesis) -> float:
            return 100.0

    class Left:
        later = 0.5

        def without(self, hypothesis: Hypothesis, refit: Asked) -> Asked:
            rest = tuple(one for one in refit.hypotheses if one is not hypothesis)
            excess = 1e5 if hypothesis is much else 1e4
            share = 0.9 if hypothesis is much else removed
            return Sure(rest, complete=False, squares=refit.squares + share * excess, excess=excess)

    race = Race(cast(Refitter, Left()), Clock())
    best = Sure((much, little), complete=False, squares=2e4, excess=1e4)
    assert needed(race, cast(Refit, best)).hypotheses == ((much, little) if stays else (much,))


@pytest.mark.parametrize(
    ("kind", "size", "asked"),
    [
        ("sensor", 0.5 * LEAST_FAULT, 0),
        ("sensor", 2.0 * LEAST_FAULT, 1),
        ("physics", 0.5 * LEAST_EFFECT, 1),  # by another shape than that it was screened at it may be more
    ],
)
def test_a_sensor_that_is_off_by_next_to_nothing_is_not_asked_for_where_nothing_shows(kind, size, asked):
    one = cast(Hypothesis, Name("gain", kind))
    screened = Screened((one,), 1e4, (size,), (1e-4,))
    assert len(alarming(Screening(0.0, (screened,), (), ())).singles) == asked


def test_two_are_asked_for_together_where_nothing_shows_if_each_is_asked_for():
    one, other, faint = (cast(Hypothesis, Name(name, "physics")) for name in ("one", "other", "faint"))
    singles = tuple(
        Screened((each,), gain, (1.0,), (0.1,)) for each, gain in ((one, 80.0), (other, 60.0), (faint, 1.0))
    )
    pairs = tuple(Screened(two, 150.0, (1.0, 1.0), (0.1, 0.1)) for two in ((one, other), (one, faint)))
    assert alarming(Screening(0.0, singles, pairs, ())).pairs == pairs[:1]


@pytest.mark.parametrize(
    ("size", "gained", "accepted"),
    [
        (2.0 * LEAST_EFFECT, 0.0, True),
        (0.5 * LEAST_EFFECT, 0.0, False),  # a leak of 0.4 % of what is usual
        (0.5 * LEAST_EFFECT, 2.0 * CLEARLY, True),  # a load on a spring, told as the truck on its tyres
    ],
)
def test_an_effect_of_next_to_nothing_is_accepted_only_if_recordings_held_out_show_it(size, gained, accepted):
    best = Tried((), 1000.0, complete=True)
    tried = Tried((LEAK,), 1000.0 - gained, complete=True, loo_log_score=100.0, sizes={"leak": size})
    assert helps(cast(Refit, tried), cast(Refit, best), 0.1) is accepted


@pytest.mark.parametrize(
    ("score", "gained", "accepted"),
    [
        (15.0, -0.9 * AS_NEAR, True),
        (15.0, -1.1 * AS_NEAR, False),  # those held out lose as much as all gain
        (1642.0, -30.0, True),  # a cushion that one recording meets, and that was fitted
        (1642.0, -500.0, False),
    ],
)
def test_recordings_held_out_object_if_they_lose_much_of_what_all_gain(score, gained, accepted):
    best = Tried((), 5004.0, complete=True)
    tried = Tried((LEAK,), 5004.0 - gained, complete=True, loo_log_score=score, sizes={"leak": 1.0})
    assert helps(cast(Refit, tried), cast(Refit, best), 0.1) is accepted


@pytest.mark.parametrize(
    ("score", "gained", "excess", "accepted"),
    [
        (167.0, -6.0, 1700.0, True),  # a viscosity that falls by another law
        (167.0, -2.0 * AS_NEAR, 1700.0, False),  # recordings held out object
        (50.0, -6.0, 1700.0, False),  # a tenth of what is left over is asked for
        (13.0, -6.0, 100.0, False),
    ],
)
def test_what_all_recordings_bear_out_is_accepted_where_hardly_anything_is_left_over(
    score, gained, excess, accepted
):
    """Each recording's own load and temperature follow what is missing, so that those held out are explained
    as well without it: but without it they do not foretell each other."""
    best = Tried((), 18865.0, excess, slight=True, worst=SimpleNamespace(mean_square=1.35))
    tried = replace(best, hypotheses=(LEAK,), squares=18865.0 - gained, loo_log_score=score)
    refitter = SimpleNamespace(together=1.0, later=0.1)
    found = helping([cast(Refit, tried)], cast(Refit, best), cast(Refitter, refitter), ())
    assert bool(found) is accepted


@pytest.mark.parametrize(
    ("left", "removed", "asked"),
    [
        (2.0 * MISFIT, None, False),
        (2.0 * MISFIT, 0.11, False),  # it helps, and is no measure: the tyres were never tried beside it
        (2.0 * MISFIT, 0.8, True),
        (0.9 * MISFIT, None, True),
    ],
)
def test_what_a_recording_held_out_leaves_is_a_measure_if_it_is_little_or_a_curve_removes_it(
    left, removed, asked
):
    best = Tried((), 2000.0, 1000.0, worst=SimpleNamespace(mean_square=left))
    shapes = [] if removed is None else [Tried((CURVE,), 2000.0 - 1000.0 * removed)]
    assert measures(cast(Refit, best), cast(list[Refit], shapes)) is asked


@pytest.mark.parametrize(("left_out", "chosen"), [(0.5, True), (2.0, False)])
def test_a_curve_must_hold_in_groups_that_are_left_out(monkeypatch, left_out, chosen):
    untold = GroupFold("c", nan, nan, 1.0, (), untold=1e3)  # the others do not tell what it depends on
    folds = (GroupFold("a", 1.0, left_out, 1.0, ()), GroupFold("b", 1.0, 0.9, 1.0, ()), untold)
    monkeypatch.setattr("forklift.diagnosis.rules.group_folds", lambda *given: folds)
    refits = [cast(Refit, Tried()), cast(Refit, Tried((CURVE,)))]
    assert foresees(cast(Refitter, SimpleNamespace(strict=True)), *refits) is chosen
    assert foresees(cast(Refitter, SimpleNamespace(strict=False)), *refits)


@pytest.mark.parametrize(
    ("left", "slight", "most"), [(900.0, False, False), (400.0, False, True), (900.0, True, True)]
)
def test_where_names_leave_most_over_they_do_not_say_where_it_acts(left, slight, most) -> None:
    baseline, final = Tried((), 3000.0, 1000.0), Tried((LEAK,), 2000.0 + left, left, slight=slight)
    assert Selection(cast(Refit, baseline), (), cast(Refit, final)).explains_most is most

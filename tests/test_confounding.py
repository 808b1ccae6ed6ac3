"""What stands for a free curve: the same curve at another place, as far as recordings cannot part the two."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosed import diagnosed
from forklift import Truck
from forklift.diagnosis.confounding import confounded
from forklift.diagnosis.criteria import STANDS
from forklift.diagnosis.curves import FreeCurves
from forklift.diagnosis.hypothesis import carry, with_hypotheses
from forklift.plant.forklift.effects import EFFECTS
from forklift.plant.forklift.hypotheses import hypotheses
from forklift.plant.forklift.model import Forklift
from forklift.plant.protocol import Hypothesis

BARS = 1e5


@pytest.fixture(scope="module")
def complete():
    """A fitted machine that lacks nothing: its baseline."""
    return diagnosed("null").selection.baseline


def curve(complete, port: str, variable: str = "pressure") -> Hypothesis:
    machine = complete.found.problem.machine
    place = next(one for one in machine.places if one.name == f"free.{port}")
    return machine.curves(place, variable, 10.0 * BARS, 120.0 * BARS)[0]


def stand_for(complete, found: Hypothesis, others: list[Hypothesis]):
    """Of a curve of a third of what is usual, falling from its lower to its upper end."""
    start = complete.found.problem
    problem = with_hypotheses(start, [found])
    x = carry(complete.found.x, start, problem)
    names = [one.name for one in problem.unknowns]
    x[[names.index(name) for name in found.amplitudes]] = 0.3 * np.linspace(1.0, -1.0, len(found.amplitudes))
    refit = SimpleNamespace(hypotheses=(found,), found=SimpleNamespace(problem=problem, x=x))
    return confounded(cast(Any, refit), [], others, start)


def test_what_acts_on_the_flow_stands_for_what_acts_on_the_flow_and_not_for_a_force(complete):
    viscosity = curve(complete, "viscosity")
    stands = stand_for(complete, viscosity, [curve(complete, port) for port in ("opening", "force")])
    assert [(one.other.equation, one.accepted) for one in stands] == [("valve-flow", viscosity)]
    assert STANDS <= stands[0].share <= 1.0 + 1e-9


def test_a_curve_stands_for_itself_entirely(complete):
    opening = curve(complete, "opening")
    (found,) = stand_for(complete, opening, [opening])
    assert found.share == pytest.approx(1.0)


def test_elsewhere_are_the_other_places_of_the_same_lift_where_the_variable_acts(complete):
    machine = complete.found.problem.machine
    offered = FreeCurves(machine, {})
    speed = curve(complete, "opening", "speed")
    assert offered.elsewhere(speed) == []  # it was not made here
    offered.made[speed] = ("speed", 0.0, 0.4)
    found = offered.elsewhere(speed)
    assert {one.where for one in found} == {"free"}
    assert {one.over for one in found} == {speed.over}
    told = {one.equation for one in found}
    assert {"viscosity", "compensator", "tank", "friction", "force-balance"} == told


@pytest.mark.parametrize("variable", ["other_command", "position"])
def test_twins_are_the_same_place_of_the_other_lift_over_its_own_variable(monkeypatch, variable):
    machine = Forklift(Truck.read("thesis"), ("free", "main"))
    offered, refit = FreeCurves(machine, {}), cast(Any, SimpleNamespace(told_from=None))
    ends = {"free": (0.0, 0.5), "main": (0.1, 1.4)}
    monkeypatch.setattr("forklift.diagnosis.curves.ranges_of", lambda found, part: {variable: ends[part]})
    free, main = (
        next(one for one in machine.places if one.name == f"{lift}.current") for lift in ("free", "main")
    )
    for one in machine.curves(free, variable, *ends["free"]):
        assert offered.twins(refit, one) == []  # it was not made here
        offered.made[one] = (variable, *ends["free"])
        found = offered.twins(refit, one)
        like = machine.curves(main, variable, *ends["main"])
        assert found == [two for two in like if len(two.amplitudes) == len(one.amplitudes)] != []
        assert offered.twins(refit, found[0]) == [one]


def test_pressure_that_is_lost_before_the_valve_is_mended_by_a_curve_behind_it(complete):
    machine = complete.found.problem.machine
    offered = hypotheses(machine.truck, machine.lifts, ("position_free_m",), {})
    lost = [one for one in offered if one.id in ("hose_resistance", "hose_inertance")]
    assert lost
    for one in lost:
        assert one.equations == ("valve-flow", "tank")
        assert set(machine.acted_on(one)) == {"free.opening", "free.return_pressure"}
    assert {one.id for one in EFFECTS if one.also_in} == {"hose_resistance", "hose_inertance"}

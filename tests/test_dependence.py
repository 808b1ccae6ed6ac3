"""Where an unknown input acts, and of which variable it is a function."""

from __future__ import annotations

import numpy as np

from forklift.diagnosis.dependence import dependences
from forklift.diagnosis.locate import UnknownInput, sensors_behind


def test_a_variable_that_not_all_recordings_have_is_none():
    times = np.linspace(0.0, 1.0, 50)
    values = (np.sin(times), np.cos(times))
    found = UnknownInput("a", 1.0, 1.0, 1.0, (times, times), values, (np.ones(50), np.ones(50)))
    tells = [{"x": values[0], "warm": times}, {"x": values[1]}]
    assert [one.variable for one in dependences(found, tells)] == ["x"]


def test_what_was_a_while_ago_comes_first_only_if_it_explains_clearly_more():
    """Of what moves slowly the past tells nearly as much as the moment."""
    random = np.random.default_rng(1)
    times = np.linspace(0.0, 20.0, 400)
    values = tuple(np.sin(times + phase) for phase in (0.0, 1.0, 2.0))
    found = UnknownInput("a", 1.0, 1.0, 1.0, (times,) * 3, values, (np.ones(400),) * 3)

    def order(noise: float) -> list[str]:
        now = [one + noise * random.standard_normal(400) for one in values]
        tells = [{"now": one, "earlier": exact} for one, exact in zip(now, values, strict=True)]
        return [one.variable for one in dependences(found, tells, past=("earlier",))]

    assert order(0.05) == ["now", "earlier"]
    assert order(1.0) == ["earlier", "now"]


def test_a_sensor_is_told_where_no_place_of_the_machine_explains_nearly_as_much():
    def told(**evidence: float) -> list[str]:
        inputs = [UnknownInput(port, each, 1.0, 1.0, (), (), ()) for port, each in evidence.items()]
        return [one.port for one in sensors_behind(inputs, ["pressure", "position"])]

    assert told(pressure=1137.0, force=1116.0, friction=973.0) == ["force", "pressure", "friction"]
    assert told(pressure=1137.0, position=1130.0, force=800.0) == ["pressure", "position", "force"]
    assert told(force=900.0, pressure=899.0) == ["force", "pressure"]

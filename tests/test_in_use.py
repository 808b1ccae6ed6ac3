"""What a cause does in use: the machine as it was found, with and without it."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosed import diagnosed
from forklift.diagnosis.in_use import in_use


def test_a_leak_lets_the_forks_sink_by_its_flow_over_the_area():
    found = diagnosed("leak")
    (cause,) = found.causes
    used = found.in_use[cause.hypothesis.label]
    lift = cause.hypothesis.where
    assert used.signal == f"velocity_{lift}_m_s"
    told = next(one for one in found.after.predictions if one.recording.file == used.file)
    np.testing.assert_allclose(used.present, np.nanmean(told.signal(used.signal).simulated), rtol=1e-9)
    values = found.machine.at(found.values).values
    (coefficient,) = (one.value for one in found.numbers if one.name == f"{lift}.leakage.coefficient")
    over = np.nanmean(told.outputs[f"pressure_{lift}_pa"]) - values[f"{lift}.tank.pressure"]
    forks = {"free": 2.0, "main": 1.0}[lift]  # position_free is of the forks, position_main of the stage
    sinks = forks * coefficient * over / values[f"{lift}.cylinder.area"]
    assert used.absent - used.present == pytest.approx(sinks, rel=0.1)
    assert used.most >= abs(used.absent - used.present)


def test_of_a_complete_machine_there_is_nothing_to_tell():
    found = diagnosed("null")
    assert found.causes == ()
    assert found.in_use == {}


def test_of_causes_taken_out_together_each_group_is_told_and_a_sensor_does_nothing():
    found = diagnosed("leak")
    problem, x = found.final.found.problem, found.final.found.x
    (cause,) = found.causes
    sensor = next(one.hypotheses[0] for one in found.screening.singles if one.hypotheses[0].kind == "sensor")
    both, one, none = in_use(
        found.machine, problem, x, [[cause.hypothesis, sensor], [cause.hypothesis], [sensor]]
    )
    assert both == one
    assert none is None

"""Hats over time at the ports, and which equation they point to."""

import numpy as np
import pytest

from forklift import Truck, _core, commands
from forklift.base.errors import ForkliftError

WIDTH = 0.2


@pytest.fixture(scope="module")
def case():
    command = commands.generate("prms", "free", duration_s=6.0, seed=3)
    time = np.asarray(command.time_s)
    temperature = np.full(len(time), 40.0)
    return _core.Case(time, time, np.ascontiguousarray(command.currents), temperature), time


def test_hats_that_add_up_to_one_answer_as_the_parameter_that_the_port_multiplies(case):
    """ν·∂/∂ν of the model and the sum over all hats at the viscosity's port are the same derivative."""
    recording, time = case
    truck = Truck.read("thesis")
    own = np.array([800.0, 0.0, 0.0, 0.98, 1.96])
    centres = np.arange(time[0] - WIDTH, time[-1] + 2.0 * WIDTH, WIDTH)
    for port, parameter, factor in (
        ("viscosity", "viscosity.nu_0", True),
        ("viscous_friction", "friction.sigma_2", True),
        ("preset_pressure", "compensator.p_set", False),
        ("return_pressure", "tank.pressure", False),
    ):
        names = [f"free.{parameter}"]
        answers = truck.core.responses(recording, own, [f"free.{port}"], centres, WIDTH, substeps=4)
        ((_, slopes),) = truck.core.differentiate([recording], own[None], names, substeps=4)
        value = truck.values[names[0]] if factor else 1.0
        whole = slopes[:, :, 0] * value
        assert np.abs(whole).max() > 0.0, port
        for output in range(whole.shape[1]):
            size = np.abs(whole[:, output]).max()
            assert answers[:, output, 0].sum(axis=1) == pytest.approx(
                whole[:, output], abs=1e-6 * size + 1e-12
            )


def test_nothing_answers_before_its_cause(case):
    recording, time = case
    answers = Truck.read("thesis").core.responses(
        recording, np.array([0.0, 0.0, 0.0, 0.98, 1.96]), ["free.force"], np.array([3.0]), WIDTH, substeps=4
    )[:, :, 0, 0]
    assert np.all(answers[time < 3.0 - WIDTH - 0.02] == 0.0)
    assert np.abs(answers[time > 3.0]).max() > 0.0


@pytest.mark.parametrize(("port", "width"), [("free.nothing", 0.2), ("force", 0.2), ("free.force", 0.0)])
def test_a_port_that_is_not_there_is_refused(case, port, width):
    with pytest.raises(ForkliftError):
        Truck.read("thesis").core.responses(case[0], np.zeros(5), [port], np.array([1.0]), width)

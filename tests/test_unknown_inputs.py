"""Hats over time at the ports, and which equation they point to."""

import numpy as np
import pytest

from forklift import Truck, _core, commands
from forklift.base.errors import ForkliftError

WIDTH = 0.2
SINGLE = 1e-5
"""Of the largest over time: derivatives along hats by themselves are in single precision."""


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


PORTS = [
    "force",
    "cylinder_flow",
    "viscosity",
    "opening",
    "current",
    "preset_pressure",
    "friction",
    "inertia",
]
TRUCKS = {
    "thesis": {},
    "with an effect that has states": {
        "main.hose_inertance.inertance": 1e8,
        "free.valve_lag.share": 0.5,
        "free.valve_lag.time": 0.05,
    },
    "with lifts that are joined": {"mast_coupling.factor": 0.5},
}


@pytest.mark.parametrize("given", TRUCKS.values(), ids=TRUCKS)
def test_hats_side_by_side_answer_as_each_alone_at_every_port(case, given):
    """Put together from rise, fall and what is remembered: the derivative along each hat, to rounding."""
    recording, time = case
    core = Truck.read("thesis").with_values(given).core
    own = np.array([800.0, 0.3, -0.4, 0.98, 1.96])
    centres = np.arange(time[0], time[-1] + 0.5 * WIDTH, WIDTH)
    ports = [f"{lift}.{port}" for lift in ("free", "main") for port in PORTS]
    together = core.hat_responses(recording, own, ports, centres, WIDTH, substeps=4)
    for port in ports:
        alone = core.responses(recording, own, [port], centres, WIDTH, substeps=4)[:, :, 0, :]
        size = np.abs(alone).max(axis=(0, 2), keepdims=True)
        assert np.abs(together.at(port) - alone).max(initial=0.0, where=size == 0.0) == 0.0, port
        assert np.all(np.abs(together.at(port) - alone) <= SINGLE * size + 1e-30), port


def test_hats_side_by_side_are_read_on_any_clock(case):
    """Between two substeps, before the first top and behind the last."""
    _, time = case
    command = commands.generate("prms", "free", duration_s=6.0, seed=3)
    read = np.arange(0.013, 6.0, 0.031)
    late = _core.Case(read, time, np.ascontiguousarray(command.currents), np.full(len(time), 40.0))
    centres = np.arange(0.5, 4.0, WIDTH)
    core, own = Truck.read("thesis").core, np.array([800.0, 0.0, 0.0, 0.98, 1.96])
    together = core.hat_responses(late, own, ["free.force"], centres, WIDTH, substeps=4).at("free.force")
    alone = core.responses(late, own, ["free.force"], centres, WIDTH, substeps=4)[:, :, 0, :]
    size = np.abs(alone).max(axis=(0, 2), keepdims=True)
    assert np.all(np.abs(together - alone) <= SINGLE * size + 1e-30)


def test_all_hats_at_all_ports_cost_one_run_along_few_directions(case):
    """What a lift remembers, and two hats a port: however many hats there are."""
    recording, time = case
    asked = ["free.force", "free.opening", "free.viscosity"]
    core, own = Truck.read("thesis").core, np.array([800.0, 0.0, 0.0, 0.98, 1.96])
    for width in (WIDTH, 0.05):
        centres = np.arange(time[0], time[-1], width)
        found = core.hat_responses(recording, own, asked, centres, width, substeps=4)
        assert found.directions == 24 + 2 * len(asked)


def test_hats_that_are_not_side_by_side_are_refused(case):
    core, own = Truck.read("thesis").core, np.array([800.0, 0.0, 0.0, 0.98, 1.96])
    with pytest.raises(ForkliftError):
        core.hat_responses(case[0], own, ["free.force"], np.array([1.0, 1.3]), WIDTH)


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

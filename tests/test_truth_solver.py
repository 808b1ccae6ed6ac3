"""The compiled step against the equations as they are written: SciPy's integrator, order, independence."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from forklift import ForkliftError
from forklift.ensemble.proof import amplitude, kinds, prove, tools
from forklift.ensemble.proof.truth import expressions, model, run
from forklift.ensemble.proof.truth.truck import THESIS, scattered

LAWS = [name for kind in ("effect", "shape", "stranger") for name in kinds.of_kind(kind)]
TICKS = 12


def loud(name):
    """A law at half of its most on both lifts, if it concerns them."""
    return amplitude.law_of(name, "both", 0.5 * amplitude.most(name), np.random.default_rng(1))


def conditions(ticks=TICKS, loads=(800.0,), at=0.65):
    return [run.Condition(np.full((2, ticks), at), load, 35.0) for load in loads]


def by_scipy(law, condition):
    """x, v and p_A at the end, by Radau IIA of order five on the equations in NumPy."""
    k, last = run.parameters(THESIS, (law,), [condition]), condition.command.shape[1] - 1
    y = model.at_rest((law,), k, np.array(run.START_M)[:, None, None])
    u, T = condition.command[:, 0][:, None, None], np.array([[condition.temperature_degc + 273.0]])
    late = float(run.dead_times(k, (law,)).max())
    scale = model.scales((law,))

    def rates(_, s):
        return model.rates((s * scale)[:, None, None], u, T, k, (law,))[:, 0, 0] / scale

    span = last * run.TICK_S
    assert late == 0.0 or (condition.command == condition.command[:, :1]).all()
    found = solve_ivp(rates, (0.0, span), y[:, 0, 0] / scale, "Radau", rtol=1e-9, atol=1e-10)
    assert found.success
    end = model.split((found.y[:, -1] * scale)[:, None, None], (law,))
    return end.x[:, 0, 0], end.v[:, 0, 0], end.p_A[:, 0, 0]


@pytest.mark.parametrize("name", LAWS)
def test_every_law_moves_the_truck_as_scipy_has_it(name):
    law, (given,) = loud(name), conditions()
    (found,) = run.simulate(THESIS, (law,), [given], 1e-7)
    x, v, p_A = by_scipy(law, given)
    np.testing.assert_allclose(found.x[:, -1], x, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(found.v[:, -1], v, rtol=0.0, atol=2e-6)
    np.testing.assert_allclose(found.p_A[:, -1], p_A, rtol=0.0, atol=50.0)


def test_the_error_falls_with_the_tolerance():
    """Each step keeps to its tolerance: ten times less of it is less than half the error."""
    (exact,) = run.simulate(THESIS, (), conditions(100), 3e-8)
    errors = []
    for tolerance in (1e-4, 1e-5, 1e-6):
        (found,) = run.simulate(THESIS, (), conditions(100), tolerance)
        errors.append(np.abs(found.v - exact.v).max())
    assert np.all(np.diff(np.log10(errors)) < np.log10(0.5))
    assert errors[-1] < 2e-6  # [m/s], of a tolerance of 1e-6


def test_a_recording_is_the_same_whatever_stands_beside_it():
    """To the bit: other loads, other trucks, longer ones."""
    law = loud("friction_position")
    alone = run.simulate(THESIS, (law,), conditions(40, (300.0,)))[0]
    others = [*conditions(90, (0.0, 1500.0)), *conditions(25)]
    others[0].trucks = scattered(4)
    beside = run.simulate(THESIS, (law,), [others[0], *conditions(40, (300.0,)), *others[1:]])[1]
    for signal in ("x", "v", "p_A"):
        np.testing.assert_array_equal(getattr(alone, signal), getattr(beside, signal))


def test_a_late_command_is_the_same_command_later():
    """A dead time that is no whole number of ticks."""
    command = np.zeros((2, 80))
    command[:, 20:] = 0.7
    law = amplitude.law_of("valve_delay", "both", 0.03, np.random.default_rng(1))
    (late,) = run.simulate(THESIS, (law,), [run.Condition(command, 500.0, 30.0)], 1e-7)
    # Twice as many ticks of half the length: the same delay is three of them.
    shifted = np.concatenate([np.zeros((2, 3)), np.repeat(command, 2, axis=1)], axis=1)[:, :159]
    (moved,) = run.simulate(THESIS, (), [run.Condition(shifted, 500.0, 30.0)], 1e-7, run.TICK_S / 2)
    np.testing.assert_allclose(late.v, moved.v[:, ::2], atol=1e-6)


def test_values_that_are_no_numbers_end_a_run():
    broken = dict(THESIS[0], sigma_2=float("nan")), THESIS[1]
    with pytest.raises(FloatingPointError, match="a step of less than"):
        run.simulate(broken, (), conditions())


def test_what_no_expression_answers_is_a_type_error():
    with pytest.raises(TypeError):
        np.arctan(expressions.symbols("y", (2, 1, 1)))
    with pytest.raises(TypeError):
        np.median(expressions.symbols("y", (2, 1, 1)))


def test_a_proof_without_its_tools_says_so_before_it_begins(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ForkliftError, match="C compiler") as told:
        prove.prove(7, campaigns=1, out=tmp_path / "proof")
    assert told.value.code == "compiler-missing"
    monkeypatch.setattr(tools, "find_spec", lambda _: None)
    with pytest.raises(ForkliftError, match="pip install") as told:
        prove.prove(7, campaigns=1, out=tmp_path / "proof")
    assert told.value.code == "extra-missing"
    assert not (tmp_path / "proof").exists()

"""The linear view: exact sampling, eigenvalues against differenced simulations, margins of textbook loops."""

import control
import numpy as np
import pytest

from forklift import _core
from forklift.base.errors import ForkliftError
from forklift.ensemble.stability import (
    StateSpace,
    closed,
    describing_function,
    least_damped,
    margins,
    operating_point,
    plant,
    sampled,
)
from forklift.plant.forklift.tables import states
from forklift.plant.forklift.truck import Truck

THESIS = Truck.read("thesis")
TICK = 0.02


def loop(point, proportional, integral):
    """A PI controller by forward Euler before the plant and its delay, by python-control."""
    late = sampled(plant(point), delay_s=0.16)
    pi = control.StateSpace(1.0, TICK, integral, proportional, TICK)
    both = control.series(pi, control.StateSpace(late.a, late.b[:, :1], late.c[:1], late.d[:1, :1], TICK))
    return StateSpace(both.A, both.B, both.C, both.D, TICK, ("",) * len(both.A))


def lag(rate):
    """1/(1 + s/rate)."""
    one = np.ones((1, 1))
    return StateSpace(-rate * one, rate * one, one, 0.0 * one, None, ("y",))


@pytest.mark.parametrize("delay_s", [0.0, 0.02, 0.16, 0.005, 0.033])
def test_a_late_held_input_is_sampled_exactly(delay_s):
    rate = 7.0
    system = sampled(lag(rate), TICK, delay_s)
    x = np.zeros(len(system.a))
    found = []
    for _ in range(40):
        found.append(float((system.c @ x)[0]))
        x = system.a @ x + system.b[:, 0]
    time = np.arange(40) * TICK
    exact = np.where(time > delay_s, 1.0 - np.exp(-rate * np.maximum(time - delay_s, 0.0)), 0.0)
    assert found == pytest.approx(exact, abs=1e-12)


def test_margins_of_an_integrator_with_delay():
    """L = k e^(−sT)/s, sampled finely: gain margin π/(2 k T), delay margin π/(2 k) − T (Åström & Murray
    2008)."""
    zero, one = np.zeros((1, 1)), np.ones((1, 1))
    loop = sampled(StateSpace(zero, 2.0 * one, one, zero, None, ("y",)), 1e-3, 0.2)
    found = margins(loop)
    assert found.gain == pytest.approx(np.pi / (2.0 * 2.0 * 0.2), rel=5e-3)
    assert found.delay_s == pytest.approx((np.pi / 2.0) / 2.0 - 0.2, rel=5e-3)
    assert 0.0 < found.disk < 1.0


def test_the_least_damped_mode_is_that_of_an_oscillator():
    omega, damping = 2.0 * np.pi * 1.5, 0.1
    a = np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]])
    system = sampled(StateSpace(a, np.array([[0.0], [1.0]]), np.eye(2)[:1], np.zeros((1, 1)), None), TICK)
    mode = least_damped(system)
    assert mode.damping == pytest.approx(damping, rel=1e-9)
    assert mode.frequency_hz == pytest.approx(1.5 * np.sqrt(1.0 - damping**2), rel=1e-9)


@pytest.fixture(scope="module")
def point():
    return operating_point(THESIS, "main", command_a=0.7, load_kg=1500, oil_temperature_degc=20)


def test_the_plant_stands_still_where_it_is_linearised_but_for_its_position(point):
    rates, a, b = _core.linearise(THESIS.core, "main", point.state, 0.7, 1500.0, 20.0)
    names = list(states())
    assert a.shape == (9, 9)
    assert b.nonzero()[0].tolist() == [names.index("valve_current_rate")]
    # The forks move twice as fast.
    assert rates[names.index("position")] == pytest.approx(-point.speed_m_s / 2.0)
    assert abs(rates[names.index("velocity")]) < 1e-3
    assert abs(rates[names.index("cylinder_pressure")]) < 1e5


def test_eigenvalues_are_those_of_differenced_ticks(point):
    """The adaptive solver over one tick from states moved a little: its derivative is e^(A T)."""
    from scipy.linalg import expm

    names = list(states())
    kept = [k for k, name in enumerate(names) if not name.startswith("valve")]
    exact = expm(plant(point).a * TICK)[np.ix_(kept, kept)]
    scale = np.array([spec["scale"] for spec in states().values()])

    def tick(start):
        time = np.array([0.0, TICK])
        oil, command = np.array([20.0]), np.array([[0.0, 0.7]])
        run = THESIS.core.simulate(
            time,
            np.zeros(1),
            command,
            oil,
            1500.0,
            lifts="main",
            solver="adaptive",
            tolerance=1e-11,
            start=start,
        )
        return run["states"][1]

    columns = []
    for k in kept:
        step = np.zeros(len(names))
        step[k] = 1e-5 * scale[k]
        columns.append((tick(point.state + step) - tick(point.state - step))[kept] / (2.0 * step[k]))
    differenced = np.stack(columns, axis=1)
    found, expected = (np.sort_complex(np.linalg.eigvals(m)) for m in (differenced, exact))
    large = np.abs(expected) > 0.1
    assert large.sum() >= 3
    assert found[large] == pytest.approx(expected[large], rel=2e-2)


def test_a_small_kick_decays_as_the_slowest_oscillation_says(point):
    """The lift's pressure and velocity, kicked along its oscillation, shrink by |λ| a tick."""
    system = sampled(plant(point))
    values, vectors = np.linalg.eig(system.a)
    swings = [k for k in range(len(values)) if values[k].imag > 1e-6]
    slowest = max(swings, key=lambda k: abs(values[k]))
    direction = vectors[:, slowest]
    velocity = list(states()).index("velocity")
    kick = 1e-5 * direction / abs(direction[velocity])
    time = TICK * np.arange(13)
    oil, command = np.array([20.0]), np.array([[0.0, 0.7]])

    def lower(start):
        return THESIS.core.simulate(
            time,
            np.zeros(1),
            command,
            oil,
            1500.0,
            lifts="main",
            solver="adaptive",
            tolerance=1e-11,
            start=start,
        )["states"]

    away = lower(point.state + kick.real) - lower(point.state)
    expected = np.array([(kick * values[slowest] ** k).real for k in range(len(time))])
    largest = np.abs(expected[:, velocity]).max()
    assert away[:, velocity] == pytest.approx(expected[:, velocity], abs=2e-2 * largest)


def test_a_slower_loop_is_further_from_instability(point):
    far, near = (margins(loop(point, factor * 0.5, factor * 1.0)) for factor in (0.1, 0.5))
    assert far.gain > near.gain
    assert far.disk > near.disk
    # Twice beyond its margin it is unstable, and has none.
    beyond = loop(point, near.gain, 2.0 * near.gain)
    assert np.abs(closed(beyond).eigenvalues).max() > 1.0
    assert margins(beyond).gain == margins(beyond).disk == 0.0


def test_hysteresis_lets_no_small_sine_through_and_a_large_one_whole():
    found = describing_function(np.array([0.5, 1.0, 1.0001, 100.0]), 1.0)
    assert found[:2] == pytest.approx([0.0, 0.0])
    assert abs(found[2]) < 0.01
    assert abs(found[3] - 1.0) < 0.05


def test_backlash_by_its_formula_is_that_of_a_simulated_one():
    amplitude, half = 1.0, 0.3
    theta = np.linspace(0.0, 6.0 * np.pi, 300_001)
    x, y = amplitude * np.sin(theta), np.zeros_like(theta)
    for k in range(1, len(theta)):
        y[k] = min(max(y[k - 1], x[k] - half), x[k] + half)
    last = theta >= 4.0 * np.pi
    fundamental = 2.0 * np.mean(y[last] * np.exp(-1j * theta[last])) * 1j / amplitude
    assert describing_function(np.array([amplitude]), half)[0] == pytest.approx(fundamental, abs=1e-3)


def test_a_current_that_moves_nothing_is_refused():
    with pytest.raises(ForkliftError) as caught:
        operating_point(THESIS, "free", command_a=0.1, load_kg=0.0, oil_temperature_degc=40.0)
    assert caught.value.code == "no-steady-state"


def test_python_control_agrees(point):
    opened = loop(point, 0.3, 0.8)
    theirs = control.StateSpace(opened.a, opened.b, opened.c, opened.d, opened.dt)
    gain, _, _, _, _, _ = control.stability_margins(theirs)
    ours = margins(opened)
    assert ours.gain == pytest.approx(gain, rel=1e-2)
    omega = np.geomspace(0.1, 100.0, 50)
    assert opened.response(omega) == pytest.approx(theirs(np.exp(1j * omega * TICK)), rel=1e-6)


def test_the_gain_margin_knows_half_the_sampling_rate():
    """Of x' = x/2 + k u: closed by −1 it has the eigenvalue 1/2 − k, which leaves the circle at k = 3/2."""
    for k in (0.5, 1.0, 1.49):
        loop = StateSpace(np.array([[0.5]]), np.array([[k]]), np.eye(1), np.zeros((1, 1)), 0.02)
        assert margins(loop).gain == pytest.approx(1.5 / k, rel=1e-6)

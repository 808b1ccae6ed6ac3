"""The truth plant keeps to mechanics and to its own word: limits, silence at zero, and sources."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from forklift.ensemble.proof import amplitude, imitation, kinds
from forklift.ensemble.proof.draw import draw
from forklift.ensemble.proof.truth import drive, effects, model, others, run, sensors, strangers
from forklift.ensemble.proof.truth.truck import THESIS, scattered
from reference.witness import FREE, MAIN

GIVEN = [run.Condition(np.full((2, 5), 0.7), load, 40.0) for load in (200.0, 1000.0)]


def moving(laws, seed=1):
    """Parameters, and a state about rest in which everything moves."""
    k = run.parameters(THESIS, laws, GIVEN)
    start = np.array(run.START_M)[:, None, None] * np.ones((2, 1, 2)) - 0.2
    y = model.at_rest(laws, k, start)
    random = np.random.default_rng(seed)
    y = y + 0.1 * model.scales(laws)[:, None, None] * random.standard_normal(y.shape)
    place = 2 * model.STATES.index("v")
    y[place : place + 2] = -0.3  # fast on its way down, where every law acts
    return k, y


def rates(laws, y, k):
    return model.rates(
        y, np.array([0.7, 0.5])[:, None, None] * np.ones((2, 1, 2)), np.full((1, 1, 2), 313.0), k, laws
    )


def test_the_values_are_the_thesis_as_the_witness_has_them():
    for lift, known in zip(THESIS, (FREE, MAIN), strict=True):
        for name, value in lift.items():
            np.testing.assert_allclose(value, known[name], rtol=1e-12)


@pytest.mark.parametrize("name", strangers.SPECS)
def test_a_stranger_is_silent_at_zero_and_acts_at_its_most(name):
    spec = strangers.SPECS[name]
    silent, loud = strangers.law(name, 0.0), strangers.law(name, spec.most)
    k, y = moving((silent,))
    kept = 2 * len(model.STATES)
    y[kept:] = 0.0  # a law's own states rest at zero
    plain = rates((), y[:kept], run.parameters(THESIS, (), GIVEN))
    np.testing.assert_allclose(rates((silent,), y, k)[:kept], plain, rtol=1e-9, atol=1e-9)
    y[kept:] = 0.3 * model.scales((loud,))[kept:, None, None]
    scale = model.scales(())[:, None, None]
    changed = np.abs(rates((loud,), y, run.parameters(THESIS, (loud,), GIVEN))[:kept] - plain) / scale
    assert changed.max() > 1e-3


@pytest.mark.parametrize("name", strangers.SPECS)
def test_a_stranger_has_a_source_and_its_place_is_an_equation(name):
    spec = strangers.SPECS[name]
    assert re.search(r"\((1[89]|20)\d\d\)|ISO \d+|IEC \d+", spec.law.__doc__)
    known = {one for each in kinds.EQUATIONS.values() for one in each}
    assert set(spec.equations) <= known
    assert spec.of


def test_at_least_a_dozen_strangers_and_none_of_them_in_the_catalogue():
    assert len(strangers.SPECS) >= 12
    assert not set(strangers.SPECS) & set(kinds.of_kind("effect"))
    assert {kinds.nearest(name) for name in others.OTHERS} <= set(kinds.of_kind("effect"))


def test_a_load_on_a_soft_spring_is_no_inertia_and_on_a_stiff_one_all_of_it():
    """Lagrange's two degrees of freedom in both limits of the spring."""
    k = {"m_c": np.full((2, 1, 1), 12.0), "m": np.full((2, 1, 1), 500.0), "load": np.full((2, 1, 1), 400.0)}
    k |= {"bouncing_load.share": np.array([0.5, 0.0])[:, None, None]}
    k |= {"bouncing_load.frequency": np.ones((2, 1, 1)), "bouncing_load.damping": np.zeros((2, 1, 1))}
    law, force = strangers.law("bouncing_load", (0.5, 0.0)), np.full((2, 1, 1), 1000.0)
    s = SimpleNamespace(F=force, bounce=np.zeros((1, 1)), bounce_rate=np.zeros((1, 1)))
    soft = model.accelerations(s, k, (law,))
    np.testing.assert_allclose(soft[0], 1000.0 / (12.0 + 4 * 300.0))  # the 200 kg stay where they are
    # Compressed so that it follows: r'' = 0 where omega² r = -2 x''.
    a = 1000.0 / (12.0 + 4 * 500.0)
    s.bounce = np.full((1, 1), -2 * a / (2 * np.pi) ** 2)
    np.testing.assert_allclose(model.accelerations(s, k, (law,))[0], a)
    np.testing.assert_allclose(soft[1], 1000.0 / (12.0 + 4 * 500.0))  # the other lift feels nothing


def test_commands_are_in_steps_start_at_rest_and_depend_on_the_stream_alone():
    for kind in drive.KINDS:
        one, other = (drive.command(kind, np.random.default_rng(5), 400, 0.02) for _ in range(2))
        np.testing.assert_array_equal(one, other)
        assert (one[: drive.REST_TICKS] == 0.0).all()
        np.testing.assert_allclose(np.round(one / drive.STEP_A), one / drive.STEP_A, atol=1e-9)
        assert 0.6 < one.max() < 1.25


def test_sensors_fail_as_told():
    n = 400
    still = run.Trajectory(
        np.arange(n) * run.TICK_S, np.full((2, n), 0.5), np.zeros((2, n)), np.full((2, n), 5e6),
        np.full(n, 2.0), np.linspace(20.0, 22.0, n),
    )  # fmt: skip
    seen = sensors.measured(
        still,
        sensors.Sensors(offsets=(("pressure_free_pa", 2e5),), temperature_stuck_degc=30.0),
        np.random.default_rng(2),
    )
    assert np.mean(seen["pressure_free_pa"]) == pytest.approx(5.2e6, abs=1e4)
    assert set(seen["oil_temperature_degc"]) <= {29.5, 30.0, 30.5}
    slid = sensors.slipped(seen["position_free_m"], 4.0, 0.1)
    assert np.ptp(slid) == pytest.approx(0.1, abs=sensors.COUNT_M)
    assert slid[199] == seen["position_free_m"][199] != slid[200]


def test_an_imitation_leaves_what_is_orthogonal_and_pays_for_its_prior():
    d = np.array([3.0, 4.0, 0.0])
    free = np.array([[1e6, 0.0, 0.0]]).T  # one standard deviation explains anything along the first
    assert imitation.imitated(d, free) == pytest.approx(16.0, rel=1e-6)
    assert imitation.imitated(d, np.zeros((3, 0))) == 25.0
    held = np.array([[1.0, 0.0, 0.0]]).T
    assert imitation.imitated(d, held) == pytest.approx(16.0 + 4.5)  # 9/(1 + 1)


@pytest.mark.parametrize(("beside", "hidden"), [(0.0, True), (3.0, True), (40.0, False)])
def test_trucks_far_apart_are_followed_along_their_bend(beside, hidden):
    """A swing of another height and frequency: one linear step leaves a thousand times what a few leave."""
    time = np.linspace(0.0, 1.0, 400)

    def swing(theta):
        return 40.0 * np.exp(0.3 * theta[0]) * np.sin(20.0 * np.exp(0.05 * theta[1]) * time)

    odd = beside / np.linalg.norm(np.cos(90.0 * time)) * np.cos(90.0 * time)  # what none of them does
    at_none, truth = swing(np.zeros(2)), np.array([0.8, -1.5])
    d = swing(truth) - at_none + odd
    steps = np.array([swing(1e-4 * one) - at_none for one in np.eye(2)]).T / 1e-4
    assert imitation.imitated(d, steps) > 1000.0
    left = imitation.least(d, lambda thetas: [swing(one) for one in thetas], at_none, 2, 20.0)
    assert (left <= 20.0) is hidden


def test_a_law_that_does_as_much_as_one_parameter_far_away_is_followed_from_there():
    """What is left swings on the way: from the middle each step only leads into the next trough."""

    def answers(thetas):
        return [100.0 * np.array([one[0], 2.0 * np.sin(4.0 * one[0])]) for one in thetas]

    at_none, (d,) = np.zeros(2), answers([np.array([2.2])])
    assert imitation.least(d, answers, at_none, 1, 20.0) > 1000.0
    assert imitation.least(d, answers, at_none, 1, 20.0, [np.ones(1)]) < 20.0


@pytest.mark.parametrize(("told", "apart"), [(10.0, 3.0), (5.0, 3.0), (6.0, 3.5)])
def test_trucks_along_a_bent_valley_are_reached(told, apart):
    """What the recordings tell well is bent: each step long enough leaves more than the one before."""

    def answers(thetas):
        return [np.array([told * one[0], 1e4 * (one[1] - 0.2 * one[0] ** 2)]) for one in thetas]

    (d,) = answers([np.array([apart, 0.2 * apart**2])])
    assert imitation.least(d, answers, np.zeros(2), 2, 20.0) < 20.0


def test_a_truck_that_no_solver_follows_is_none_that_imitates():
    """The longest steps lead beyond what runs; a shorter one does as well."""
    asked = []

    def answers(thetas):
        asked.append(len(thetas))
        if any(abs(one[0]) > 1.0 for one in thetas):
            raise FloatingPointError
        return [np.array([20.0 * one[0] + 200.0 * one[0] ** 3]) for one in thetas]

    left = imitation.least(np.array([60.0]), answers, np.zeros(1), 1, 20.0)
    assert left <= 20.0
    assert len(imitation.DAMPINGS) in asked  # all were tried together, and then in parts
    assert len(imitation.DAMPINGS) // 2 in asked


@pytest.mark.parametrize(("length_m", "shows"), [(0.004, False), (0.2, True)])
def test_what_acts_beyond_the_recorded_end_shows_in_no_recording(length_m, shows):
    """A recording ends 5 mm before the stop where a cushion is concealed, though the lift runs into it."""
    given = draw(5, 0)
    plans = tuple(replace(plan, ticks=650, lift="free") for plan in given.plans[:2])
    given = replace(given, concealed=("end_cushion",), lift="free", plans=plans)
    command = np.zeros((2, 650))
    command[0, 20:] = 0.8
    conditions = [run.Condition(command, load, 40.0) for load in (200.0, 1000.0)]
    cushion = effects.law("end_cushion", run.on("free", 2e5), length=length_m)
    assert min(run.simulate(THESIS, (cushion,), conditions)[1].x[0]) < 0.004
    left = imitation.left(given, (cushion,), 0, THESIS, conditions, run.TICK_S)
    assert (left > imitation.HIDDEN) if shows else (left == 0.0)


def test_another_truck_has_rising_openings_and_differs():
    one, other = scattered(3), scattered(4)
    for lift in (*one, *other):
        assert (np.diff(lift["current"]) > 0.0).all()
        assert (np.diff(lift["area"]) >= 0.0).all()
    assert one[0]["sigma_2"] != other[0]["sigma_2"]


LAWS = [name for kind in ("effect", "shape", "stranger") for name in kinds.of_kind(kind)]


@pytest.mark.parametrize("name", LAWS)
def test_every_law_can_be_run_at_its_most_from_cold_to_warm(name):
    # A valve that cavitates so much lets oil flow back: campaigns get less of it, see test_truth_chatters.
    share = 0.5 if name == "choked_flow" else 1.0
    law = amplitude.law_of(name, "main", share * amplitude.most(name), np.random.default_rng(1))
    command = np.full((2, 25), 0.7)
    given = [run.Condition(command, load, degc) for load in (0.0, 1500.0) for degc in (-5.0, 65.0)]
    for one in run.simulate(THESIS, (law,), given, 1e-3):
        assert np.isfinite(one.v).all()
        assert np.isfinite(one.p_A).all()


@pytest.mark.parametrize("module", [effects, others, strangers])
def test_every_law_acts_at_a_place_that_the_model_asks(module):
    """A method of another name would never be called, and the law do nothing."""
    known = {*model.PLACES, *vars(model.Law)}
    laws = [one for one in vars(module).values() if isinstance(one, type) and issubclass(one, model.Law)]
    assert len(laws) > 5
    for law in laws:
        own = {name for name, what in vars(law).items() if callable(what) and not name.startswith("_")}
        assert own <= known, f"{law.__name__}: {own - known}"
        assert own & {*model.PLACES, "lagrange"} or law.seen or law.shown or law.dead_time or law is model.Law

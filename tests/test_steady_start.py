"""States that start steady start where their rates are zero, whatever the parameters are."""

import numpy as np
import pytest

from forklift.base.errors import ForkliftError
from forklift.diagnosis.diagnose import diagnose
from forklift.diagnosis.hypothesis import carry
from forklift.fitting.posing import pose
from forklift.plant import Effect, Input, Output, Param, Plant, Port, Recording, State
from forklift.plant.hypotheses import of_effect
from forklift.plant.machine import NumpyMachine
from forklift.plant.sensors import sensors
from forklift.plant.simulate import simulate_plant

TIME = np.linspace(0.0, 10.0, 101)
PUMP = np.where(TIME < 2.0, 2.0, 3.0)


def tank(**changed):
    """h' = q u − k √h, which rests at (q u / k)²."""
    given = {
        "name": "vessel",
        "states": (State("h", "m", "steady", lower=0.0),),
        "params": (Param("q", "m/s", 1.0, 0.1, 10.0), Param("k", "m^0.5/s", 1.0, 0.1, 10.0)),
        "inputs": (Input("u"),),
        "outputs": (Output("y", "m", sigma=0.01),),
        "ports": (Port("outflow", "m/s"),),
        "rhs": lambda t, x, u, w, p, bus: {
            "h": p["q"] * u["u"] - p["k"] * np.sqrt(np.maximum(x["h"], 0.0)) + w["outflow"]
        },
        "out": lambda t, x, u, w, p, bus: {"y": x["h"]},
    }
    return Plant(**{**given, **changed})


LEAK = Effect(
    "leak", "it leaks", (Param("c", "1/s", 0.0, 0.0, 2.0),), ("outflow",),
    lambda x, u, p, bus: {"outflow": -p["c"] * x["h"]},
)  # fmt: skip
SLOW = Effect(
    "slow", "the inflow is slow", (Param("share", "1", 0.0, 0.0, 1.0), Param("time", "s", 2.0, 0.5, 5.0)),
    ("outflow",),
    lambda x, u, p, bus: {
        "outflow": p["share"] * p["q"] * (x["late"] - u["u"]), "late": (u["u"] - x["late"]) / p["time"],
    },
    (State("late", start="steady"),),
)  # fmt: skip


def two(guess=None):
    """Two levels that feed each other, linear: A x + b u = 0."""
    return Plant(
        "pair",
        (Param("a", "1/s", 2.0, 0.2, 20.0), Param("c", "1/s", 0.5, 0.05, 5.0)),
        (Input("u"),),
        (Output("y1"), Output("y2")),
        lambda t, x, u, w, p, bus: {"y1": x["x1"], "y2": x["x2"]},
        states=(
            State("x1", start="steady", guess=guess),
            State("x2", start="steady"),
            State("x3", start=0.7),
        ),
        rhs=lambda t, x, u, w, p, bus: {
            "x1": -p["a"] * x["x1"] + p["c"] * x["x2"] + u["u"],
            "x2": x["x1"] - x["x2"] + x["x3"],
            "x3": -x["x3"],
        },
    )


def test_a_vessel_rests_where_what_flows_in_flows_out():
    for q, k in ((1.0, 1.0), (0.3, 2.0), (4.0, 0.4)):
        y = simulate_plant(tank(), TIME, {"u": PUMP}, {"q": q, "k": k})["y"]
        np.testing.assert_allclose(y[:21], (q * 2.0 / k) ** 2, rtol=1e-8)
        assert y[-1] > 1.05 * y[0]


@pytest.mark.parametrize("guess", [None, -300.0, 1e4])
def test_several_states_rest_together_beside_one_that_starts_elsewhere(guess):
    said = simulate_plant(two(guess), TIME, {"u": PUMP})
    x1 = (2.0 + 0.5 * 0.7) / (2.0 - 0.5)
    assert (said["y1"][0], said["y2"][0]) == pytest.approx((x1, x1 + 0.7), rel=1e-9)


def test_what_is_pressed_against_an_end_rests_there():
    full = tank(states=(State("h", "m", "steady", lower=0.0, upper=1.5),))
    assert simulate_plant(full, TIME, {"u": PUMP})["y"][0] == 1.5
    assert simulate_plant(full, TIME, {"u": -PUMP})["y"][0] == 0.0
    assert simulate_plant(tank(), TIME, {"u": 0.0 * PUMP})["y"] == pytest.approx(0.0, abs=1e-12)


def test_a_number_takes_its_place():
    assert simulate_plant(tank(), TIME, {"u": PUMP}, {"h.start": 1.0})["y"][0] == 1.0


@pytest.mark.parametrize(
    "rate",
    [
        lambda x, u: u,  # nothing but an input fills it
        lambda x, u: 0.0 * x,  # anywhere
        lambda x, u: 1.0 + x**2,
    ],
)
def test_without_a_steady_state_the_error_says_which(rate):
    plant = tank(
        states=(State("h", "m", "steady"),), rhs=lambda t, x, u, w, p, bus: {"h": rate(x["h"], u["u"])}
    )
    with pytest.raises(ForkliftError) as error:
        simulate_plant(plant, TIME, {"u": PUMP})
    assert (error.value.code, error.value.name) == ("no-steady-state", "h")
    assert "u = 2" in str(error.value)


@pytest.mark.parametrize("effects", [(), (LEAK,), (SLOW,)], ids=["alone", "leak", "slow"])
def test_slopes_follow_the_start(effects):
    """Derivatives along every unknown against central differences of whole simulations."""
    plant = tank(effects=effects)
    other = np.where(TIME < 2.0, 1.0, 3.0)  # recordings side by side rest at levels of their own
    recordings = [
        Recording("one", TIME, {"u": PUMP}, {"y": np.zeros(101)}),
        Recording("two", TIME, {"u": other}, {"y": np.zeros(101)}),
    ]
    start = pose(
        NumpyMachine(plant), recordings, NumpyMachine(plant).unknowns(), sensors(plant, recordings)
    ).weighted({"y": 1.0})
    problem = start
    for effect in effects:
        (hypothesis,) = of_effect(plant, effect)
        problem = problem.with_addition(hypothesis.addition)
    x = carry(np.array([0.3, -0.2]), start, problem)
    x[2:] = 0.4
    assert len(x) == 2 + sum(len(effect.params) for effect in effects)
    slopes = [run.slope["y"] for run in problem.linearise(x)]
    step = 1e-3
    for k in range(len(x)):
        sides = [problem.said(x + sign * step * np.eye(len(x))[k]) for sign in (1.0, -1.0)]
        for slope, above, below in zip(slopes, *sides, strict=True):
            np.testing.assert_allclose(
                slope[:, k], (above["y"] - below["y"]) / (2.0 * step), rtol=2e-3, atol=2e-3
            )
    q, k, leak = (
        problem.machine.parameters(problem.values(x)).get(name, 0.0) for name in ("q", "k", "leak.c")
    )
    root = 2.0 * q * 2.0 / (k + np.sqrt(k**2 + 4.0 * leak * q * 2.0))
    assert problem.said(x)[0]["y"][0] == pytest.approx(root**2, rel=1e-8)


def test_a_fit_finds_the_parameters_from_the_start_on():
    plant = tank()
    recordings = []
    for seed, role in ((1, "estimate"), (2, "validate")):
        random = np.random.default_rng(seed)
        u = np.repeat(random.uniform(1.0, 4.0, 5), 20)[: len(TIME) - 1]
        u = np.append(u, u[-1])
        y = simulate_plant(plant, TIME, {"u": u}, {"q": 1.4, "k": 0.8})["y"]
        recordings.append(
            Recording(f"r{seed}", TIME, {"u": u}, {"y": y + random.normal(0.0, 0.01, len(TIME))}, role)
        )
    found = diagnose(plant, recordings)
    assert (found.verdict, found.causes) == ("no-mismatch", ())
    for number, truth in zip(found.numbers, (1.4, 0.8), strict=True):
        assert number.value == pytest.approx(truth, rel=0.01)
        assert number.lower <= truth <= number.upper

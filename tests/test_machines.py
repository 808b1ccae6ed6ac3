"""Machines of one's own run through the same engine as the forklift, and what they conceal is found."""

import contextlib
import io
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import forklift
from bent_line import BEND, LINE
from forklift.base.errors import ForkliftError
from forklift.diagnosis.criteria import NAMED_RIGHTLY
from forklift.diagnosis.diagnose import diagnose
from forklift.fitting import likelihood
from forklift.fitting.posing import pose
from forklift.plant import Effect, Input, Output, Param, Plant, Port, Recording, State
from forklift.plant.hypotheses import hypotheses
from forklift.plant.machine import NumpyMachine
from forklift.plant.sensors import sensors
from forklift.plant.simulate import simulate_plant
from forklift.report.of_diagnosis import diagnosis_page

ROOT = Path(__file__).parents[1]
REAL = Path(os.environ.get("FORKLIFT_REAL") or ROOT.parent / "shared" / "real")


def decay(**changed):
    """x' = −a x + b u, seen as y."""
    given = {
        "name": "decay",
        "states": (State("x", start="free", lower=-5.0, upper=5.0, guess=1.0),),
        "params": (Param("a", "1/s", 0.5, 0.05, 5.0), Param("b", "1/s", 1.0, 0.1, 10.0)),
        "inputs": (Input("u", hold="linear"),),
        "outputs": (Output("y"),),
        "ports": (Port("balance"),),
        "rhs": lambda t, x, u, w, p, bus: {"x": -p["a"] * x["x"] + p["b"] * u["u"] + w["balance"]},
        "out": lambda t, x, u, w, p, bus: {"y": x["x"]},
    }
    return Plant(**{**given, **changed})


def with_state(start):
    """An effect whose own state starts there."""
    late = State("late", start=start)
    return Effect("e", "e", (Param("c", "1", 0.0),), ("balance",), lambda *_: {}, states=(late,))


def recording(plant, seed=1, role="estimate", time=None, values=None, present=(), noise=0.01):
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 20.0, 201) if time is None else time
    u = np.cumsum(random.normal(0.0, 0.2, len(time)))
    y = simulate_plant(plant, time, {"u": u}, values, present)["y"] + random.normal(0.0, noise, len(time))
    return Recording(f"r{seed}", time, {"u": u}, {"y": y}, role)


def tutorial():
    """Its text, and the blocks of its program: the plant first."""
    page = (ROOT / "docs" / "machines.md").read_text(encoding="utf-8")
    return page, re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)


def test_the_tutorial_finds_what_it_conceals_in_under_eighty_lines():
    page, blocks = tutorial()
    assert sum(len(block.splitlines()) for block in blocks) < 80
    names: dict[str, object] = {}
    with contextlib.redirect_stdout(io.StringIO()) as out:
        for block in blocks:
            exec(compile(block, "machines.md", "exec"), names)
    expected = re.findall(r"^```text\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert out.getvalue() == expected[0]
    found = names["found"]
    drag = next(one for one in found.numbers if one.name == "drag.factor")
    assert drag.lower <= 0.01 <= drag.upper
    assert found.dependences[0].variable == "speed"
    assert found.to_dict()["verdict"] == "missing-physics"


def test_a_drag_of_another_power_is_told_by_a_curve_over_the_speed():
    names: dict[str, object] = {}
    exec(compile(tutorial()[1][0], "machines.md", "exec"), names)
    plant = names["plant"]
    steeper = Effect(
        "steeper", "drag", (Param("factor", "1", 0.0, 0.0, 1.0),), ("torque",),
        lambda x, u, p, bus: {"torque": -p["factor"] * np.sign(x["speed"]) * np.abs(x["speed"]) ** 2.3},
    )  # fmt: skip
    true = replace(plant, effects=(steeper,))
    recordings = []
    for seed, role in ((1, "estimate"), (2, "estimate"), (3, "validate"), (4, "validate")):
        random, time = np.random.default_rng(seed), 0.1 * np.arange(300)
        u = {"u": np.repeat(random.uniform(0.0, 12.0, 15), 20)}
        values = {"k": 5.0, "b": 0.3, "steeper.factor": 0.003, "speed.start": 0.0}
        omega = simulate_plant(true, time, u, values, ["steeper"])["omega"]
        recordings.append(
            Recording(f"r{seed}", time, u, {"omega": omega + random.normal(0.0, 0.2, 300)}, role)
        )
    found = diagnose(plant, recordings)
    (cause,) = found.causes
    assert (cause.hypothesis.label, cause.form) == ("drag", "uncertain")
    assert cause.curve
    assert cause.curve.over == "speed"
    assert found.final.complete
    assert "by another law" in found.sentence
    page = diagnosis_page(found)
    assert "beside it explains all recordings better" in page
    assert f"{100.0 * NAMED_RIGHTLY:.0f} % were named rightly" in page
    (row,) = found.to_dict()["causes"]
    assert row["credibility"] == pytest.approx(NAMED_RIGHTLY * row["share"])


def test_derivatives_are_those_of_the_solution():
    """Of x' = −a x from x₀: x = x₀ e^(−a t), with ∂x/∂a = −t x and ∂x/∂x₀ = e^(−a t)."""
    plant = decay()
    time = np.sort(np.random.default_rng(3).uniform(0.0, 5.0, 60))  # irregular
    quiet = Recording("r", time, {"u": np.zeros(60)}, {"y": np.zeros(60)})
    machine = NumpyMachine(plant)
    known = sensors(decay(outputs=(Output("y", sigma=1.0),)), [quiet])
    problem = pose(machine, [quiet], machine.unknowns(), known)
    problem = problem.weighted({"y": 1.0})
    run = problem.linearise(np.zeros(problem.starts[-1]))[0]
    exact = np.exp(-0.5 * (time - time[0]))
    np.testing.assert_allclose(run.model["y"], exact, rtol=1e-4)
    along_a = problem.unknowns[0].slopes(0.0)[0] * -(time - time[0]) * exact
    np.testing.assert_allclose(run.slope["y"][:, 0], along_a, atol=2e-3)
    np.testing.assert_allclose(run.slope["y"][:, 2], 2.5 * exact, rtol=1e-4)


def test_halving_the_step_divides_the_error_by_sixteen():
    errors = []
    for count in (20, 40):
        time = np.linspace(0.0, 8.0, count + 1)
        y = simulate_plant(decay(), time, {"u": np.zeros(count + 1)}, {"a": 1.0, "x.start": 1.0})["y"]
        errors.append(abs(y[-1] - np.exp(-8.0)))
    assert 12.0 < errors[0] / errors[1] < 24.0


def test_a_gap_of_the_clock_is_crossed_in_steps_of_a_sample():
    """x' = (u − x)/T over a hole of twenty time constants, beside a recording that is slower and even."""
    lag = {"a": 10.0, "b": 10.0}
    gap = np.r_[0.01 * np.arange(100), 3.0 + 0.01 * np.arange(100)]
    held = decay(inputs=(Input("u", hold="zero"),), states=(State("x", start=0.0),))
    said = simulate_plant(held, gap, {"u": np.r_[np.ones(99), np.zeros(101)]}, lag)["y"]
    np.testing.assert_allclose(said[99], 1.0 - np.exp(-9.9), rtol=1e-6)
    np.testing.assert_allclose(said[100], said[99] * np.exp(-10.0 * (gap[100] - gap[99])), rtol=1e-3)
    machine, slow = NumpyMachine(held), 0.02 * np.arange(200)
    recordings = [
        Recording("r", time, {"u": np.ones(len(time))}, {"y": np.zeros(len(time))}) for time in (gap, slow)
    ]
    cases = [machine.case(one, {}) for one in recordings]
    both = machine.run(lag, cases, [one.centre for one in cases], substeps=1)
    for one, run in zip(recordings, both, strict=True):
        np.testing.assert_allclose(run.outputs[:, 0], 1.0 - np.exp(-10.0 * one.time_s), atol=1e-5)


def test_missing_samples_and_a_ceiling_cost_nothing_and_do_not_bend_the_fit():
    limited = decay(outputs=(Output("y", sigma=0.01, upper=1.0),))
    seen = []
    for seed, role in ((1, "estimate"), (2, "validate")):
        one = recording(limited, seed, role, values={"x.start": 1.5})
        y = np.minimum(one.y["y"], 1.0)
        y[30:60] = np.nan
        seen.append(Recording(one.file, one.time_s, one.u, {"y": y}, role))
    assert (seen[0].y["y"] == 1.0).sum() > 5
    found = diagnose(limited, seen)
    assert (found.verdict, found.causes) == ("no-mismatch", ())
    for number, truth in zip(found.numbers, (0.5, 1.0), strict=True):
        assert number.lower <= truth <= number.upper
        assert number.value == pytest.approx(truth, rel=0.02)


def test_a_restart_begins_anew_at_what_was_measured():
    plant = decay(states=(State("x", start="y"),), score="restart", horizon_s=5.0)
    known = sensors(plant, [recording(plant)])
    problem = pose(NumpyMachine(plant), [recording(plant)], NumpyMachine(plant).unknowns(), known)
    assert len(problem.samples) == 4
    assert [one.recording.time_s[0] for one in problem.samples] == pytest.approx([0.0, 5.0, 10.0, 15.0])


def test_a_plant_without_states_and_groups_left_out():
    recordings = []
    for k in range(3):
        random = np.random.default_rng(k)
        u = random.uniform(-2.0, 2.0, 200)
        y = 2.0 * u + 0.3 * u**2 + random.normal(0.0, 0.05, 200)
        whole = Recording(f"g{k}", np.arange(200.0), {"u": u}, {"y": y}, group=f"g{k}")
        recordings += whole.split(0.6)
    found = diagnose(LINE, recordings)
    assert [cause.hypothesis.label for cause in found.causes] == ["bend"]
    assert [(one.group, one.holds) for one in found.groups] == [("g0", True), ("g1", True), ("g2", True)]
    assert found.outlying_groups == ()
    assert "Left out g1" in str(found)


def test_a_group_whose_own_parameters_no_other_tells_is_not_asked():
    plant = Plant(
        "two", (Param("a", "1", 1.0, 0.1, 10.0), Param("b", "1", 1.0, 0.1, 10.0)),
        (Input("u"), Input("which")), (Output("y", sigma=0.05),),
        lambda t, x, u, w, p, bus: {
            "y": np.where(u["which"] > 0.5, p["a"], p["b"]) * u["u"] + w["law"]
        },
        ports=(Port("law", kind="law"),), effects=(BEND,), score="algebraic",
    )  # fmt: skip
    recordings = []
    for k in range(4):
        random = np.random.default_rng(k)
        u, first = random.uniform(-2.0, 2.0, 200), k < 2
        y = (2.0 if first else 3.0) * u + 0.3 * u**2 + random.normal(0.0, 0.05, 200)
        inputs = {"u": u, "which": np.full(200, float(first))}
        whole = Recording(f"r{k}", np.arange(200.0), inputs, {"y": y}, group="first" if first else "second")
        recordings += whole.split(0.6)
    found = diagnose(plant, recordings)
    assert [cause.hypothesis.label for cause in found.causes] == ["bend"]
    assert [(one.group, one.asked, one.holds, one.fails) for one in found.groups] == [
        ("first", False, False, False), ("second", False, False, False)
    ]  # fmt: skip
    assert all(one["holds"] is None and one["untold"] >= 1.0 for one in found.to_dict()["groups"])
    assert "Left out first: not asked, the others do not tell what it depends on" in str(found)


def test_a_censored_sample_tells_that_the_truth_is_beyond():
    model = np.linspace(8.0, 12.0, 41)
    for sign in (1.0, -1.0):
        rho, slope = likelihood.censored(10.0, model, 0.5, sign)
        step = 1e-6
        there, _ = likelihood.censored(10.0, model + step, 0.5, sign)
        np.testing.assert_allclose((there - rho) / step, slope, atol=1e-4)
        beyond = sign * (model - 10.0) > 1.5
        assert np.abs(rho[beyond]).max() < 0.1
    rho, _ = likelihood.censored(10.0, np.array([9.0]), 0.5, 1.0)
    assert rho[0] < -2.0


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"rhs": None}, "rhs"),
        ({"params": (Param("x", "1", 1.0),)}, "x"),
        ({"score": "algebraic"}, "score"),
        ({"score": "restart"}, "horizon_s"),
        ({"states": (State("x", start="nothing"),)}, "x"),
        ({"states": (State("x", start="free"),)}, "x"),
        ({"effects": (Effect("e", "e", (Param("c", "1", 0.0),), ("nowhere",), lambda *_: {}),)}, "e"),
        ({"effects": (Effect("e", "e", (), ("balance",), lambda *_: {}),)}, "e"),
        ({"params": (Param("a", "1/s", 0.0, 1.0, 10.0), Param("b", "1/s", 1.0, 0.1, 10.0))}, "a"),
        ({"params": (Param("a", "1/s", 1.0, 1.0, 1.0), Param("b", "1/s", 1.0, 0.1, 10.0))}, "a"),
        ({"score": "Free"}, "score"),
        ({"order": 3}, "order"),
        ({"inputs": (Input("u", hold="first"),)}, "u"),
        ({"ports": (Port("balance", kind="flow"),)}, "balance"),
        ({"ports": (Port("balance", size=0.0),)}, "balance"),
        ({"params": (Param("a", "1/s", 0.5, per="day"),)}, "a"),
        ({"max_dt": 0.0}, "max_dt"),
        ({"max_dt": np.nan}, "max_dt"),
        ({"score": "restart", "horizon_s": -1.0}, "horizon_s"),
        ({"outputs": (Output("y", sigma=0.0),)}, "y"),
        ({"outputs": (Output("y", sigma=np.inf),)}, "y"),
        ({"params": (Param("a", "1/s", 0.5, 0.05, 5.0, spread=0.0),)}, "a"),
        ({"states": (State("x", start="free", lower=-5.0, upper=5.0, spread=0.0),)}, "x"),
        ({"effects": (with_state("nothing"),)}, "late"),
        ({"effects": (with_state("y"),)}, "late"),
        ({"effects": (with_state("free"),)}, "late"),
    ],
)
def test_a_plant_that_cannot_be_is_refused(changed, name):
    with pytest.raises(ForkliftError) as error:
        decay(**changed)
    assert (error.value.code, error.value.name) == ("plant-invalid", name)


@pytest.mark.parametrize(
    "changed", [{"rhs": lambda *_: {}}, {"out": lambda *_: {}}], ids=["no rate of a state", "no output"]
)
def test_a_law_that_leaves_something_out_is_told(changed):
    with pytest.raises(ForkliftError) as error:
        forklift.compare(decay(**changed), [recording(decay())])
    assert error.value.code == "plant-invalid"


def test_a_start_that_all_recordings_share_is_replayed_at_its_guess_and_may_be_held():
    plant = decay(states=(State("x", start="free", lower=-5.0, upper=5.0, guess=1.0, shared=True),))
    recordings = [recording(plant, seed) for seed in (1, 2)]
    replayed = forklift.compare(plant, recordings)
    assert replayed.validation("y")["nrmse_percent"].min() > 90.0
    assert set(forklift.fit(plant, recordings, hold=["x.start"], starts=1).values) == {"a", "b"}


def test_a_recording_in_which_nothing_was_measured_is_refused():
    plant = decay()
    whole = recording(plant)
    empty = Recording("empty", whole.time_s, whole.u, {"y": np.full(len(whole.time_s), np.nan)}, "validate")
    for verb in (forklift.fit, forklift.diagnose):
        with pytest.raises(ForkliftError) as error:
            verb(plant, [whole, empty])
        assert (error.value.code, error.value.file) == ("nothing-measured", "empty")


def test_an_offset_is_asked_for_by_recordings_that_have_the_output():
    plant = decay()
    whole = recording(plant)
    empty = Recording("empty", whole.time_s, whole.u, {"y": np.full(len(whole.time_s), np.nan)})
    bounds = [
        {one.id: one.addition.free[0].upper for one in hypotheses(plant, found) if "offset" in one.id}
        for found in ([whole, empty], [empty, whole])
    ]
    assert bounds[0] == bounds[1]
    assert all(np.isfinite(list(bounds[0].values())))


def test_recordings_are_told_by_names_of_their_own():
    plant = decay()
    one, other = recording(plant, 1), recording(plant, 2)
    for given, code in (
        ([one, replace(other, file=one.file)], "recording-repeated"),
        ([one, replace(other, file="../r2")], "argument-invalid"),
        ([one, replace(other, file="/r2")], "argument-invalid"),
        ([one, replace(other, file="")], "argument-invalid"),
        (["a.csv"], "argument-invalid"),
    ):
        with pytest.raises(ForkliftError) as error:
            forklift.compare(plant, given)
        assert error.value.code == code


@pytest.mark.parametrize(
    ("u", "time", "facts"),
    [
        ({"u": [0.0, np.nan, 0.0]}, [0.0, 1.0, 2.0], {"name": "u", "sample": 2, "time_s": 1.0}),
        ({"u": [0.0]}, [0.0, 1.0, 2.0], {"name": "u"}),
        ({}, [0.0, 2.0, 1.0], {"name": "time_s", "sample": 3, "value": 1.0, "lower": 2.0}),
        ({}, [0.0, np.nan, 1.0], {"name": "time_s", "sample": 2, "lower": 0.0}),
        ({}, [0.0], {"name": "time_s", "value": 1, "lower": 2}),
        ({}, 0.0, {"name": "time_s", "lower": 2}),
    ],
)
def test_a_recording_that_cannot_be_is_refused(u, time, facts):
    with pytest.raises(ForkliftError) as error:
        Recording("r", time, u, {})
    assert (error.value.code, error.value.file) == ("recording-invalid", "r")
    assert {name: error.value.facts[name] for name in facts} == facts


def test_a_run_that_leaves_the_numbers_tells_when_it_does():
    """x' = x² from 1 is at infinity after 1 s."""
    plant = decay(rhs=lambda t, x, u, w, p, bus: {"x": x["x"] ** 2}, states=(State("x", start=1.0),))
    with pytest.raises(ForkliftError) as error:
        simulate_plant(plant, 0.01 * np.arange(300), {"u": np.zeros(300)})
    assert (error.value.code, error.value.name) == ("not-finite", "y")
    assert 1.0 < error.value.time_s < 1.1


def test_recordings_that_are_only_judged_on_are_refused_by_a_fit():
    with pytest.raises(ForkliftError) as error:
        forklift.fit(decay(), [recording(decay(), role="validate")])
    assert (error.value.code, error.value.value, error.value.lower) == ("estimate-missing", 0, 1)


def folder(name):
    path = REAL / name
    if not path.is_dir():
        pytest.skip(f"no recordings of {name}: set FORKLIFT_REAL to the folder that holds {name}/")
    return path


@pytest.mark.parametrize("seal", ["O-ring", "O-ring257"])
def test_a_seals_friction_grows_with_pressure_at_every_pressure_left_out(seal):
    from forklift.plant.rigs import pneumatic_seal

    recordings = pneumatic_seal.read(folder("pneumatic_seal"), seal)
    floors = pneumatic_seal.repeatability(recordings)
    sigma = float(np.median(list(floors.values())))
    found = diagnose(pneumatic_seal.plant(sigma), recordings, candidates=pneumatic_seal.candidates())
    assert found.causes[0].hypothesis.label == "pressure_friction"
    assert pneumatic_seal.gone(found, recordings) >= 0.75
    assert pneumatic_seal.gone_left_out(found, recordings, sigma) >= 0.75
    assert found.groups
    assert all(one.holds for one in found.groups)
    assert found.outlying_groups == ()
    assert found.proposal is not None  # candidates were weighed, whether or not one parts what is left


def test_a_file_that_fits_no_law_is_flagged():
    from forklift.plant.rigs import pneumatic_seal

    recordings = pneumatic_seal.read(folder("pneumatic_seal"), "X-ring257")
    sigma = float(np.median(list(pneumatic_seal.repeatability(recordings).values())))
    assert diagnose(pneumatic_seal.plant(sigma), recordings).outlying_groups == ("7 bar",)


def test_the_tanks_lack_more_than_one_thing():
    """A small part of the catalogue, for the time it takes; `proofs/rigs.py` asks all of it."""
    if not os.environ.get("FORKLIFT_SLOW"):
        pytest.skip("takes minutes: set FORKLIFT_SLOW")
    from dataclasses import replace

    from forklift.plant.rigs import cascaded_tanks

    recordings = cascaded_tanks.read(folder("cascaded_tanks"))
    whole = cascaded_tanks.plant()
    asked = {"sensor_curve", "upper_overflow"}
    small = replace(
        whole,
        effects=tuple(one for one in whole.effects if one.id in asked),
        inputs=tuple(replace(one, gain_range=0.0, offset_range=0.0) for one in whole.inputs),
        outputs=tuple(replace(one, gain_range=0.0, offset_range=0.0, lag_range=0.0) for one in whole.outputs),
    )
    found = diagnose(small, recordings)
    before, after = found.rmse()
    assert 0.6 < before < 0.72
    assert after <= 0.35
    assert {cause.hypothesis.label for cause in found.causes} == {"sensor_curve", "upper_overflow"}
    assert all(cause.form == "uncertain" for cause in found.causes)

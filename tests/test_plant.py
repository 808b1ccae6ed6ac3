"""The second plant agrees with the witness, and forklift's effects with the second plant's."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from forklift import Campaign, Truck, _core, simulate
from forklift.ensemble.proof.truth import effects, model, others, run, sensors
from forklift.ensemble.proof.truth.truck import LIFTS, THESIS, scattered
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.effects import EFFECTS
from reference import trajectory
from reference.plant import campaign

TABLE = [spec for spec in _core.effect_table() if spec["id"] in effects.CATALOGUE]
BETWEEN_LIFTS = {spec["id"] for spec in TABLE if spec["scope"] == "mast"}
UPPER = {spec["id"]: spec["parameters"][0]["plausible_upper"] for spec in TABLE}


def shipped() -> Truck:
    return Truck.read("thesis")


def command(seconds: float, lift: str = "both", most: float = 0.9) -> np.ndarray:
    """Down, a stop, down faster: (2, n) [A]."""
    time = np.arange(round(seconds / run.TICK_S)) * run.TICK_S
    current = np.interp(time, [0.1, 0.6, 1.4, 1.5, 1.9, 2.2], [0.0, 0.6, 0.6, 0.0, 0.0, most])
    return np.array([current if lift in (name, "both") else 0.0 * current for name in LIFTS])


def every_law(quiet: bool) -> list[model.Law]:
    """Both lists, at the quiet value or at the end of what is plausible."""
    made = []
    for name in effects.CATALOGUE:
        made.append(effects.law(name, 0.0 if quiet else UPPER[name]))
    for name in others.OTHERS:
        made.append(others.law(name, 0.0 if quiet else others.MOST[name]))
    return made


def test_the_list_is_the_catalogues():
    assert list(effects.CATALOGUE) == [effect.id for effect in EFFECTS if not effect.general]
    for spec in TABLE:
        assert list(effects.QUIET[spec["id"]]) == [parameter["name"] for parameter in spec["parameters"]]
        assert next(iter(effects.QUIET[spec["id"]].values())) == spec["quiet"]
    assert set(others.OTHERS) == set(others.QUIET) == set(others.MOST)
    assert {name.partition("__")[0] for name in others.OTHERS} <= set(effects.CATALOGUE)


@pytest.mark.parametrize("name", ["free_prms1_800kg_40c", "main_steps_1500kg_60c"])
def test_without_effects_it_is_the_reference(name):
    known = trajectory.read(name, 5.0)
    place = LIFTS.index(known.lift)
    current = np.zeros((2, len(known.time_s)))
    current[place] = known.command_a
    condition = run.Condition(current, known.load_kg, known.temperature_degc)
    (found,) = run.simulate(THESIS, (), [condition], tolerance=1e-7)
    np.testing.assert_allclose(found.v[place], known.cylinder_velocity_m_s, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.x[place], known.cylinder_position_m, rtol=0, atol=1e-7)
    np.testing.assert_allclose(found.p_A[place], known.cylinder_pressure_pa, rtol=1e-5)
    (proof,) = run.simulate(THESIS, (), [condition])
    np.testing.assert_allclose(proof.v[place], known.cylinder_velocity_m_s, rtol=0, atol=1e-5)
    np.testing.assert_allclose(proof.p_A[place], known.cylinder_pressure_pa, rtol=1e-4)


@pytest.mark.parametrize("law", every_law(quiet=True), ids=lambda law: law.name)
def test_at_its_quiet_value_a_law_changes_nothing(law):
    random = np.random.default_rng(1)
    given = [run.Condition(command(1.0), load, 40.0) for load in (0.0, 1000.0)]
    plain, k = run.parameters(THESIS, (), given), run.parameters(THESIS, (law,), given)
    start = np.array(run.START_M)[:, None, None] * np.ones((2, 1, 2))
    y = model.at_rest((law,), k, start)
    kept = 2 * len(model.STATES)  # the law's own states are at zero, where they stay
    y[:kept] += 0.1 * model.scales(())[:, None, None] * random.standard_normal(y[:kept].shape)
    u, T = np.full((2, 1, 2), 0.7), np.full((1, 1, 2), 313.0)
    without = model.rates(y[:kept], u, T, plain, ())
    np.testing.assert_allclose(model.rates(y, u, T, k, (law,))[:kept], without, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", effects.CATALOGUE)
def test_forklift_and_the_plant_have_the_same_effect(name):
    """To 3e-5 m/s and 2e-4 of the pressure: a third of what is wanted, and far below any sensor."""
    trucks = scattered(zlib.crc32(name.encode()))
    law = effects.law(name, 0.5 * UPPER[name])
    low = name == "end_cushion"
    given = [
        run.Condition(command(3.0), 1500.0, 55.0, start_m=(0.35, 0.35) if low else run.START_M),
        run.Condition(command(3.0, most=1.2), 0.0, 12.0, start_m=(0.35, 0.35) if low else run.START_M),
    ]
    found = run.simulate(trucks, (law,), given, tolerance=1e-6)
    without = run.simulate(trucks, (), given, tolerance=1e-5)
    truck = like(trucks, law)
    for condition, plant in zip(given, found, strict=True):
        core = forklifts(truck, condition)
        v = np.array([core[f"{lift}.velocity"] for lift in LIFTS])
        p = np.array([core[f"{lift}.cylinder_pressure"] for lift in LIFTS])
        n = len(campaign.cut(plant, "both", 0.01).time_s)
        np.testing.assert_allclose(v[:, :n], plant.v[:, :n], rtol=0, atol=3e-5)
        np.testing.assert_allclose(p[:, :n], plant.p_A[:, :n], rtol=2e-4)
        np.testing.assert_allclose(core["fork_height_m"][:n], plant.fork_height[:n], rtol=0, atol=1e-5)
    # The comparison is of something: the effect is there.
    assert max(np.abs(one.v - other.v).max() for one, other in zip(found, without, strict=True)) > 1e-3


def like(trucks: tuple[dict, dict], law: model.Law) -> Truck:
    """forklift's truck with the plant's values, and the effect on both lifts."""
    from test_core_against_witness import values

    given = {
        name: value
        for lift, own in zip(LIFTS, trucks, strict=True)
        for name, value in values(lift, own).items()
    }
    heads = [""] if law.name in BETWEEN_LIFTS else [f"{lift}." for lift in LIFTS]
    given |= {f"{head}{law.name}.{name}": value for head in heads for name, value in law.values.items()}
    return shipped().with_values(given, source="second plant")


def forklifts(truck: Truck, condition: run.Condition):
    """forklift's simulation of the same, by its adaptive solver."""
    commanded = Command(np.arange(condition.command.shape[1]) * run.TICK_S, *condition.command)
    told = dict(load_kg=condition.load_kg, oil_temperature_degc=condition.temperature_degc)
    told |= dict(solver="adaptive", tolerance=1e-8)
    first = simulate(truck, commanded, **told)
    if condition.start_m == run.START_M:
        return first
    start = np.array(first.states[0])
    for lift, x in zip(LIFTS, condition.start_m, strict=True):
        start[first.state_names.index(f"{lift}.position")] = x
    return simulate(truck, commanded, start=start, **told)


@pytest.mark.parametrize("law", every_law(quiet=False)[len(effects.CATALOGUE) :], ids=lambda law: law.name)
def test_laws_of_another_shape_do_something_smaller_than_all(law):
    given = [run.Condition(command(3.0), load, 55.0) for load in (0.0, 1500.0)]
    found, plain = (run.simulate(THESIS, laws, given, tolerance=1e-5) for laws in ((law,), ()))
    moved = max(np.abs(one.v - other.v).max() for one, other in zip(found, plain, strict=True))
    assert 1e-4 < moved < 0.5  # the solver errs by some 1e-5 m/s


def test_recordings_do_not_depend_on_their_neighbours():
    short = run.Condition(command(1.0), 0.0, 20.0)
    long = run.Condition(command(2.0), 1500.0, 60.0)
    alone, beside = run.simulate(THESIS, (), [short]), run.simulate(THESIS, (), [long, short])
    assert len(beside[1].time_s) == len(alone[0].time_s) == 50
    np.testing.assert_allclose(beside[1].v, alone[0].v, rtol=0, atol=1e-9)


def test_sensors_read_as_told():
    n = 5000
    still = run.Trajectory(
        np.arange(n) * run.TICK_S,
        np.full((2, n), 0.5),
        np.zeros((2, n)),
        np.full((2, n), 5e6),
        np.full(n, 2.0),
        np.linspace(20.0, 22.0, n),
    )
    seen = sensors.measured(still, sensors.Sensors(), np.random.default_rng(1))
    assert 0.0 <= 1.0 - seen["position_free_m"][0] < sensors.COUNT_M
    assert np.std(seen["pressure_main_pa"]) == pytest.approx(0.3e5, rel=0.05)
    assert np.ptp(np.mod(seen["pressure_main_pa"] / 6e3 + 0.5, 1.0)) < 1e-6
    assert np.std(seen["fork_height_m"]) == pytest.approx(0.5e-3, rel=0.05)
    assert set(seen["oil_temperature_degc"]) <= {19.5, 20.0, 20.5, 21.0, 21.5, 22.0, 22.5}
    worse = sensors.Sensors(
        noise=2.0,
        colour_s=0.1,
        temperature_lag_s=1e6,
        gains=(("pressure_free_pa", 1.08),),
        lates_s=(("fork_height_m", 0.06),),
    )
    seen = sensors.measured(still, worse, np.random.default_rng(1))
    pressure = seen["pressure_free_pa"] - 5.4e6
    assert abs(np.mean(pressure)) < 2e4
    assert np.std(pressure) == pytest.approx(0.6e5, rel=0.15)
    assert np.corrcoef(pressure[1:], pressure[:-1])[0, 1] == pytest.approx(np.exp(-0.2), abs=0.05)
    assert set(seen["oil_temperature_degc"]) <= {19.5, 20.0, 20.5}
    assert np.ptp(sensors.stuck(pressure, 1.0, 2.0)[50:150]) == 0.0


def test_a_campaign_is_what_forklift_reads(tmp_path):
    planned = campaign.plans("main")[:2]
    case = campaign.Case("", "main", 7, load_off_kg=120.0, end_m=1.8)
    true = campaign.record(case, tmp_path / "campaign", planned)
    read = Campaign.read(tmp_path / "campaign")
    assert [one.load_kg for one in read.recordings] == [0.0, 800.0]  # as entered, not as it was
    for recording, driven in zip(read.recordings, true, strict=True):
        assert len(recording.time_s) == len(driven.time_s) < 520
        assert driven.x[1].min() > 1.8
    again = campaign.record(case, tmp_path / "again", planned)
    np.testing.assert_array_equal(true[0].v, again[0].v)
    for path in (tmp_path / "campaign").iterdir():
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes()


def test_a_dead_time_shifts_the_command():
    command = np.arange(10.0)[None, :, None] * np.array([1.0, 10.0])[:, None, None]
    late, column = np.array([[0.03], [0.0]]), np.array([0])
    for tick, since, value, until in [
        (0, 0.0, 0.0, 0.01),
        (4, 0.0, 2.0, 0.01),  # 80 ms less 30 ms: the sample of 40 ms, for another 10 ms
        (4, 0.01, 3.0, 0.01),  # until the other lift's next tick
        (4, 0.015, 3.0, 0.005),
    ]:
        u, rest = run.held(command, tick, np.array([since]), late, column)
        assert u[:, 0].tolist() == [value, 10.0 * tick]
        assert rest[0] == pytest.approx(until)


def test_a_sensor_that_would_fail_after_the_recording_ended_fails_in_its_middle():
    """What is concealed must be there."""
    pressure = np.linspace(1e7, 2e7, 150)
    held = sensors.stuck(pressure, 3.9, 2.0)
    assert (held[:76] == pressure[:76]).all()
    assert np.ptp(held[75:]) == 0.0
    slipped = sensors.slipped(np.linspace(1.0, 0.5, 150), 3.9, 0.1)
    assert np.flatnonzero(np.diff(slipped) > 0.0).tolist() == [74]

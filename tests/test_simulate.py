"""Simulations: against the reference trajectories, with units, and started where a recording starts."""

import numpy as np
import polars as pl
import pytest

from forklift import ForkliftError, Truck, _core, commands, predict, simulate
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.geometry import FORKS_PER_CYLINDER, FORKS_PER_SENSOR
from forklift.plant.forklift.tables import outputs
from forklift.recordings.channels import LIFTS
from forklift.recordings.recording import Recording
from reference import trajectory

COMMAND = commands.generate("prms", "free", duration_s=4.0)


@pytest.fixture(scope="module")
def thesis() -> Truck:
    return Truck.read("thesis")


@pytest.fixture(scope="module")
def lowering(thesis):
    return simulate(thesis, COMMAND, load_kg=800, oil_temperature_degc=40)


def recording(**channels) -> Recording:
    n = len(COMMAND.time_s)
    known = {name: getattr(COMMAND, name) for name in ("current_free_a", "current_main_a")}
    known |= {"oil_temperature_degc": np.full(n, 40.0)} | channels
    return Recording("a.csv", "free", 800.0, "estimate", COMMAND.time_s, known)


@pytest.mark.parametrize("name", trajectory.NAMES)
def test_the_shipped_truck_lowers_as_the_reference_does(thesis, name):
    reference = trajectory.read(name)
    result = simulate(
        thesis,
        Command(
            reference.time_s,
            reference.command_a if reference.lift == "free" else np.zeros_like(reference.time_s),
            reference.command_a if reference.lift == "main" else np.zeros_like(reference.time_s),
        ),
        load_kg=reference.load_kg,
        oil_temperature_degc=reference.temperature_degc,
        tolerance=1e-7,
    )
    velocity = result[f"{reference.lift}.velocity"]
    np.testing.assert_allclose(velocity, reference.cylinder_velocity_m_s, rtol=0, atol=1e-4)
    pressure = result[f"pressure_{reference.lift}_pa"]
    np.testing.assert_allclose(pressure, reference.cylinder_pressure_pa, rtol=1e-3)


def test_a_dataset_has_units_and_meanings_from_the_cores_tables(lowering):
    dataset = lowering.dataset
    for name, spec in outputs().items():
        assert dataset[name].attrs == {"units": spec["unit"], "long_name": spec["meaning"]}
    assert dataset["free.position"].attrs["units"] == "m"
    assert dataset["current_free_a"].attrs["units"] == "A"
    assert dataset.attrs["truck"] == "thesis"
    assert dataset.sizes == {"time_s": len(COMMAND.time_s)}


def test_the_fork_height_is_composed_of_both_positions(lowering):
    height = 2 * lowering["position_main_m"] + lowering["position_free_m"]
    np.testing.assert_allclose(lowering["fork_height_m"], height, rtol=1e-12)


def test_lowering_is_negative(lowering):
    assert lowering["velocity_free_m_s"].min() < -0.05
    assert lowering["position_free_m"][-1] < lowering["position_free_m"][0]


def test_results_are_where_they_are_wanted(thesis, lowering):
    some = simulate(thesis, COMMAND, load_kg=800, oil_temperature_degc=40, time=COMMAND.time_s[::7])
    np.testing.assert_allclose(some["velocity_free_m_s"], lowering["velocity_free_m_s"][::7], atol=1e-3)
    assert np.array_equal(some.to_polars()["current_free_a"], COMMAND.current_free_a[::7])


def test_both_solvers_agree(thesis, lowering):
    fixed = simulate(thesis, COMMAND, load_kg=800, oil_temperature_degc=40, solver="fixed")
    np.testing.assert_allclose(fixed["velocity_free_m_s"], lowering["velocity_free_m_s"], atol=2e-3)


def test_one_lift_alone_moves_as_with_the_other(thesis, lowering):
    alone = simulate(thesis, COMMAND, load_kg=800, oil_temperature_degc=40, lifts="free")
    np.testing.assert_allclose(alone["velocity_free_m_s"], lowering["velocity_free_m_s"], atol=1e-3)
    assert not any(name.startswith("main.") for name in alone.state_names)


def test_the_oil_temperature_may_change_on_the_way(thesis):
    warming = simulate(
        thesis, COMMAND, load_kg=800, oil_temperature_degc=np.linspace(20, 60, len(COMMAND.time_s))
    )
    assert warming.to_polars()["oil_temperature_degc"][-1] == 60.0


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_written_simulation_reads_back_equal(tmp_path, lowering, suffix):
    path = lowering.write(tmp_path / f"lowering{suffix}", with_states=True)
    read = pl.read_csv(path, infer_schema_length=None) if suffix == ".csv" else pl.read_parquet(path)
    assert read.columns == lowering.to_polars(with_states=True).columns
    np.testing.assert_array_equal(read["pressure_free_pa"], lowering["pressure_free_pa"])
    assert list(tmp_path.iterdir()) == [path]


def test_a_simulation_is_immutable(lowering):
    with pytest.raises(ValueError, match="read-only"):
        lowering["velocity_free_m_s"][0] = 1.0
    lowering.dataset["velocity_free_m_s"].mean()


def test_a_simulation_tells_what_it_is(lowering):
    assert "800 kg" in repr(lowering)
    assert lowering.to_dict()["outputs"]["velocity_free_m_s"]["unit"] == "m/s"
    assert lowering.statistics


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"load_kg": -1.0}, "load"),
        ({"load_kg": float("nan")}, "load"),
        ({"load_kg": "heavy"}, "load_kg"),
        ({"oil_temperature_degc": 400.0}, "temperature"),
        ({"oil_temperature_degc": np.zeros(3)}, "temperature"),
        ({"time": [2.0, 1.0]}, "time"),
        ({"time": [-1.0, 1.0]}, "time"),
        ({"lifts": "side"}, "lifts"),
        ({"solver": "euler"}, "solver"),
        ({"tolerance": -1e-4}, "tolerance"),
        ({"solver": "fixed", "substeps": 0}, "substeps"),
        ({"solver": "fixed", "tolerance": 1e-4}, "tolerance belongs to the adaptive solver"),
        ({"substeps": 4}, "substeps belongs to the fixed solver"),
        ({"solver": "fixed", "substeps": -1}, "simulate"),
        ({"time": [[0.0, 1.0]]}, "simulate"),
        ({"start": [1.0, 2.0]}, "start"),
    ],
)
def test_a_bad_call_is_one_clear_error(thesis, change, told):
    call = {"load_kg": 800.0, "oil_temperature_degc": 40.0} | change
    with pytest.raises(ForkliftError) as caught:
        simulate(thesis, COMMAND, **call)
    assert caught.value.code in ("argument-invalid", "argument-shape")
    assert told in caught.value.message


def test_an_effect_between_the_lifts_needs_both(thesis):
    with pytest.raises(ForkliftError) as caught:
        simulate(
            thesis.with_values({"mast_coupling.factor": 1.0}),
            COMMAND,
            load_kg=800,
            oil_temperature_degc=40,
            lifts="free",
        )
    assert caught.value.code == "effect-needs-both-lifts"


def test_an_unknown_output_is_refused_with_the_known_ones(lowering):
    with pytest.raises(ForkliftError) as caught:
        lowering["speed"]
    assert "velocity_free_m_s" in caught.value.message


def test_a_file_of_another_kind_is_refused_and_nothing_written(tmp_path, lowering):
    with pytest.raises(ForkliftError) as caught:
        lowering.write(tmp_path / "lowering.xlsx")
    assert caught.value.code == "format-unknown"
    assert list(tmp_path.iterdir()) == []


def test_a_prediction_is_the_simulation_of_the_recorded_command(thesis, lowering):
    np.testing.assert_array_equal(predict(thesis, recording()).outputs, lowering.outputs)


def test_missing_temperatures_are_left_out_of_the_mean(thesis, lowering):
    temperature = np.full(len(COMMAND.time_s), 40.0)
    temperature[::3] = np.nan
    np.testing.assert_array_equal(
        predict(thesis, recording(oil_temperature_degc=temperature)).outputs, lowering.outputs
    )


def test_a_recording_without_oil_temperature_asks_for_one(thesis, lowering):
    channels = {name: getattr(COMMAND, name) for name in ("current_free_a", "current_main_a")}
    cold = Recording("cold.csv", "free", 800.0, "estimate", COMMAND.time_s, channels)
    with pytest.raises(ForkliftError) as caught:
        predict(thesis, cold)
    assert caught.value.code == "temperature-missing"
    assert caught.value.file == "cold.csv"
    np.testing.assert_array_equal(predict(thesis, cold, oil_temperature_degc=40.0).outputs, lowering.outputs)


@pytest.mark.parametrize(("lift", "usual"), [("free", 1.96), ("main", 1.96)])
def test_a_prediction_starts_where_the_recording_does(thesis, lift, usual):
    count = _core.ENCODER_COUNT_M
    here = np.full(len(COMMAND.time_s), usual - 1.5 * count)
    elsewhere = np.full(len(COMMAND.time_s), 100 * count)
    near = predict(thesis, recording(**{f"position_{lift}_m": here}))
    far = predict(thesis, recording(**{f"position_{lift}_m": elsewhere}))
    assert near[f"position_{lift}_m"][0] == pytest.approx(usual)
    assert far[f"position_{lift}_m"][0] == pytest.approx(100.5 * count)
    other = LIFTS[1 - LIFTS.index(lift)]
    assert far[f"position_{other}_m"][0] == pytest.approx(1.96)


@pytest.mark.parametrize(("lift", "stroke"), [("free", "0 to 2.2 m"), ("main", "0 to 2.2 m")])
@pytest.mark.parametrize("recorded", [-0.2, 3.1])
def test_a_start_beyond_the_stroke_is_refused(thesis, lift, stroke, recorded):
    with pytest.raises(ForkliftError) as caught:
        predict(thesis, recording(**{f"position_{lift}_m": np.full(len(COMMAND.time_s), recorded)}))
    assert caught.value.code == "value-out-of-bounds"
    assert caught.value.file == "a.csv"
    for told in (f"position_{lift}_m", f"{recorded:g} m", stroke):
        assert told in caught.value.message


@pytest.mark.parametrize(("missing", "start"), [(1, 1.0), (40, 1.0), (60, 1.96)])
def test_only_the_first_second_tells_the_start(thesis, missing, start):
    position = np.full(len(COMMAND.time_s), 1.0)
    position[:missing] = np.nan
    found = predict(thesis, recording(position_free_m=position))["position_free_m"][0]
    assert found == pytest.approx(start, abs=_core.ENCODER_COUNT_M)


def test_forks_move_as_far_as_the_core_says():
    both = Command.of_samples(50.0, free=np.full(201, 0.9), main=np.full(201, 0.9))
    run = simulate("thesis", both, load_kg=800, oil_temperature_degc=40)
    forks = run["fork_height_m"] - run["fork_height_m"][0]
    for head, factors in (
        ("position_{}_m", FORKS_PER_SENSOR),
        ("{}.position", dict.fromkeys(LIFTS, FORKS_PER_CYLINDER)),
    ):
        gone = {lift: run[head.format(lift)] - run[head.format(lift)][0] for lift in LIFTS}
        assert np.ptp(gone["free"]) > 0.1
        assert np.ptp(gone["main"]) > 0.1
        np.testing.assert_allclose(forks, sum(factors[lift] * gone[lift] for lift in LIFTS), atol=1e-9)

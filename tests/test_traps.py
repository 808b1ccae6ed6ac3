"""What is wrong with the recordings, and not with the physics, is called so: `null` is a complete truck."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from campaigns import CAMPAIGNS
from forklift import Campaign, Recording, Truck, diagnose
from forklift.diagnosis.result import Diagnosis
from forklift.report.of_diagnosis import diagnosis_page

Columns = dict[str, np.ndarray]


def diagnosed(
    spoil: Callable[[Recording, Columns], float | None],
    keep: Callable[[Recording], bool] = lambda _: True,
) -> Diagnosis:
    """The diagnosis of `null` with each recording's columns spoilt; what `spoil` gives is its new load."""
    campaign = Campaign.read(CAMPAIGNS / "null")
    recordings = []
    for recording in filter(keep, campaign.recordings):
        columns = {name: values.copy() for name, values in recording.channels.items()}
        load = spoil(recording, columns)
        recordings.append(
            replace(recording, channels=columns, load_kg=recording.load_kg if load is None else load)
        )
    return diagnose(replace(campaign, recordings=tuple(recordings)), Truck.read("thesis"))


def late(values: np.ndarray, samples: int) -> np.ndarray:
    return np.concatenate([np.full(samples, values[0]), values[:-samples]])


def test_a_pressure_sensor_whose_gain_is_off_is_named():
    def spoil(_: Recording, columns: Columns) -> None:
        columns["pressure_free_pa"] *= 1.08

    found = diagnosed(spoil)
    assert found.verdict == "sensor-fault"
    (cause,) = found.causes
    assert cause.hypothesis.label == "pressure_free_pa.pressure_gain"
    assert cause.form == "complete"
    assert found.location
    assert found.location.signal == "pressure_free_pa"


def test_a_load_that_was_entered_too_low_is_named():
    found = diagnosed(lambda recording, _: max(recording.load_kg - 120.0, 0.0))
    assert (found.verdict, [cause.hypothesis.id for cause in found.causes]) == (
        "parameter-error",
        ["load_entered"],
    )
    sentence, page = found.sentence, " ".join(diagnosis_page(found).split())
    assert sentence.startswith("The load was entered 120 kg too low;")
    # Each recording's load is its own in every fit: the fit was as good before, by loads that nobody enters.
    assert "further from those entered than is plausible" in sentence
    assert "It does not: it fits as well before" in page
    assert "So in all 9 recordings (5 fitted, 4 held out) with a load; right in the 5 without." in page
    assert "What was entered is wrong, neither the machine nor a sensor." in page
    assert "Each recording tells its own load: in the 9 where it is wrong, 120 kg in each" in page
    assert "First check what was entered." in page
    assert "Weigh the load, with the pallet" in page
    assert "What the recordings ask for" not in page  # no one place stands for what acts in many


@pytest.mark.parametrize("channel", ["pressure_free_pa", "position_free_m"])
def test_two_seconds_of_a_stuck_sensor_are_taken_out_and_named(channel):
    def spoil(recording: Recording, columns: Columns) -> None:
        if recording.file == "free_prms1_800kg_20c.csv":
            columns[channel][100:200] = columns[channel][100]

    found = diagnosed(spoil)
    assert found.verdict == "sensor-fault"
    assert [cause.hypothesis.label for cause in found.causes] == [f"{channel}.sensor_stuck"]
    assert found.location
    assert "free_prms1_800kg_20c.csv" in found.location.region
    assert found.final.complete


def test_an_encoder_that_loses_counts_is_taken_out_from_there_on_and_named():
    def spoil(recording: Recording, columns: Columns) -> None:
        if recording.file == "free_prms1_800kg_20c.csv":
            columns["position_free_m"][250:] -= 0.06

    found = diagnosed(spoil)
    assert found.verdict == "sensor-fault"
    assert [cause.hypothesis.label for cause in found.causes] == ["position_free_m.sensor_slip"]
    assert "slips in free_prms1_800kg_20c.csv at 5.00 s" in found.sentence
    assert found.final.complete


def test_all_signals_late_and_a_dead_time_cannot_be_parted():
    def spoil(_: Recording, columns: Columns) -> None:
        for name, values in columns.items():
            if not name.startswith("current"):
                columns[name] = late(values, 3)

    found = diagnosed(spoil)
    first = found.causes[0]
    assert first.hypothesis.id == "valve_delay"
    assert first.form == "uncertain"  # what the signals do as well leaves its law open
    assert "sensor_lag" in [one.id for one in first.not_separable_from]
    (row,) = found.to_dict()["causes"][0]["parameters"]
    assert row["value"] == pytest.approx(0.06, abs=0.003)


def test_doubled_noise_is_no_mismatch():
    random = np.random.default_rng(5)

    def spoil(_: Recording, columns: Columns) -> None:
        for name, noise in (("pressure_free_pa", 3e4), ("pressure_main_pa", 3e4), ("fork_height_m", 5e-4)):
            columns[name] += np.sqrt(3.0) * noise * random.standard_normal(len(columns[name]))

    assert diagnosed(spoil).verdict == "no-mismatch"


def test_recordings_that_excite_nothing_tell_nothing_of_any_effect():
    def spoil(_: Recording, columns: Columns) -> None:
        still = columns["current_free_a"] == 0.0
        for name, values in columns.items():
            columns[name] = np.where(still, values, values[0])
        columns["current_free_a"][:] = 0.0

    found = diagnosed(spoil, lambda recording: "prms" in recording.file)
    assert (found.verdict, found.causes) == ("no-mismatch", ())
    untestable = {hypothesis.id for hypothesis in found.untestable}
    assert {"leakage", "friction_temperature", "valve_delay", "entrained_air", "load_entered"} <= untestable
    assert "nothing be told of any effect" in found.sentence


def test_at_one_temperature_no_effect_of_temperature_can_be_told():
    found = diagnosed(lambda _, __: None, lambda recording: "20c" in recording.file)
    assert found.verdict == "no-mismatch"
    assert any(caution.code == "one-temperature" for caution in found.findings.cautions)
    assert {"bulk_modulus_temperature", "friction_temperature"} <= {one.id for one in found.untestable}
    assert found.next_recording
    assert found.next_recording.oil_temperature_degc > 40.0

"""Campaigns are read, written, compared and looked into."""

from __future__ import annotations

import json
import pickle
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from campaigns import CAMPAIGNS
from forklift import Campaign, Recording, convert
from forklift.base import output
from forklift.recordings.channels import COMMANDS, REQUIRED, TIME, conversions, table
from small_campaign import ROWS, make, raised, signals, snapshot

NAMES = ("coupling", "leak", "null", "thermfric")


@pytest.fixture
def folder(tmp_path):
    return make(tmp_path / "small")


def recording(**changes) -> Recording:
    columns = signals()
    time_s = columns.pop("time_s")
    given = {
        "file": "free.csv",
        "lift": "free",
        "load_kg": 0.0,
        "role": "estimate",
        "time_s": time_s,
        "channels": columns,
    }
    return Recording(**given | changes)


def test_a_campaign_is_read_from_its_folder_or_its_file(folder):
    campaign = Campaign.read(folder)
    assert campaign == Campaign.read(str(folder / "campaign.toml"))
    assert (campaign.name, campaign.sample_rate_hz, campaign.folder) == ("small", 50.0, folder)
    assert [found.file for found in campaign] == ["free.csv", "main.csv"]
    assert [found.file for found in campaign.estimate] == ["free.csv"]
    assert [found.file for found in campaign.validate] == ["main.csv"]


def test_every_sample_is_read_as_written(folder):
    found = Campaign.read(folder)["free.csv"]
    expected = signals()
    np.testing.assert_array_equal(found.time_s, expected.pop(TIME))
    assert set(found.channels) == set(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(found.channels[name], values)


def test_an_empty_cell_of_a_measurement_is_a_missing_sample(folder):
    text = (folder / "free.csv").read_text().splitlines()
    text[5] = text[5].rpartition(",")[0] + ","
    (folder / "free.csv").write_text("\n".join(text))
    found = Campaign.read(folder)[0]
    assert np.flatnonzero(np.isnan(found["oil_temperature_degc"])).tolist() == [4]
    assert found.to_polars()["oil_temperature_degc"].null_count() == 1
    assert found.to_dict()["channels"]["oil_temperature_degc"]["missing"] == 1


def test_quotes_blanks_line_ends_and_a_byte_order_mark_are_understood(folder):
    plain = Campaign.read(folder)
    text = (folder / "free.csv").read_text()
    quoted = text.replace("0.02,", '"0.02", ', 1).replace("time_s", '"time_s"').replace("\n", "\r\n")
    (folder / "free.csv").write_bytes(b"\xef\xbb\xbf" + quoted.encode() + b"\r\n\r\n")
    assert Campaign.read(folder) == plain


def test_a_recording_may_stand_in_a_folder_below(folder):
    (folder / "day 1").mkdir()
    (folder / "free.csv").rename(folder / "day 1" / "free.csv")
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace('"free.csv"', '"./day 1/free.csv"'))
    campaign = Campaign.read(folder)
    assert campaign[0].file == "day 1/free.csv"
    campaign.write(folder.parent / "copy")
    assert Campaign.read(folder.parent / "copy") == campaign


def test_a_written_campaign_reads_back_equal(folder, tmp_path):
    campaign = Campaign.read(folder)
    assert campaign.write(tmp_path / "copy") == tmp_path / "copy"
    copy = Campaign.read(tmp_path / "copy")
    assert copy == campaign
    assert hash(copy) == hash(campaign)
    assert copy.write(tmp_path / "again")
    assert Campaign.read(tmp_path / "again").sha256 == copy.sha256


doubles = st.floats(-0.5, 9.9, allow_subnormal=True)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    name=st.text(st.characters(exclude_categories=["Cs"]), max_size=20),
    load=st.floats(0, 1e4),
    rows=st.lists(st.tuples(doubles, st.one_of(doubles, st.just(np.nan))), min_size=2, max_size=20),
)
def test_any_recording_written_reads_back_to_the_bit(tmp_path_factory, name, load, rows):
    values = np.array(rows)
    channels = {
        "current_free_a": np.abs(values[:, 0]) / 4,
        "current_main_a": 0 * values[:, 0],
        "position_free_m": values[:, 1],
    }
    made = recording(load_kg=load, time_s=np.arange(len(rows)) / 50.0, channels=channels)
    campaign = Campaign(name, 50.0, (made,))
    out = campaign.write(tmp_path_factory.mktemp("out") / "campaign")
    copy = Campaign.read(out)
    assert copy == campaign
    assert copy[0].sha256 == made.sha256
    assert copy[0]["position_free_m"].tobytes() == made["position_free_m"].tobytes()


def test_a_campaign_is_not_written_over_anything(folder, tmp_path):
    campaign = Campaign.read(folder)
    before = snapshot(tmp_path)
    assert raised(campaign.write, folder).code == "output-exists"
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").write_text("mine")
    assert raised(campaign.write, tmp_path / "other", overwrite=True).code == "output-exists"
    assert raised(campaign.write, tmp_path / "no" / "parent").code == "not-writable"
    (folder / "notes.txt").write_text("mine")
    assert raised(campaign.write, folder, overwrite=True).code == "output-exists"
    assert snapshot(tmp_path) == before | {"other/notes.txt": b"mine", "small/notes.txt": b"mine"}


def test_a_place_that_cannot_be_written_is_told_before_the_work(tmp_path, monkeypatch):
    def check(name):
        return raised(output.check_folder, tmp_path / name, (), "campaign.toml").code

    small = make(tmp_path / "small")
    assert check("x" * 300) == "not-writable"
    assert raised(convert, small, tmp_path / ("x" * 300)).code == "not-writable"
    assert raised(Campaign.read(small).write, tmp_path / ("x" * 300)).code == "not-writable"
    assert output.check_folder(tmp_path / "out", (), "campaign.toml") == tmp_path / "out"
    monkeypatch.setattr(Path, "mkdir", lambda *_, **__: (_ for _ in ()).throw(PermissionError(13, "Denied")))
    assert check("out") == "not-writable"
    assert list(tmp_path.iterdir()) == [small]


def test_a_foreign_file_deep_in_an_earlier_campaign_is_not_deleted(folder, tmp_path):
    first = Campaign.read(folder).recordings[0]
    campaign = Campaign("deep", 50.0, (replace(first, file="day1/free.csv"),))
    out = campaign.write(tmp_path / "out")
    campaign.write(out, overwrite=True)
    (out / "day1" / "notes.txt").write_text("mine")
    error = raised(campaign.write, out, overwrite=True)
    assert error.code == "output-exists"
    assert "day1/notes.txt" in error.message
    assert (out / "day1" / "notes.txt").read_text() == "mine"


def test_an_earlier_campaign_is_replaced_when_asked_for(folder, tmp_path):
    campaign = Campaign.read(folder)
    half = Campaign("half", 50.0, campaign.estimate)
    half.write(tmp_path / "out")
    campaign.write(tmp_path / "out", overwrite=True)
    assert Campaign.read(tmp_path / "out") == campaign
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "small"]


def test_nothing_is_left_of_a_campaign_that_could_not_be_written(folder, tmp_path, monkeypatch):
    campaign = Campaign.read(folder)
    before = snapshot(tmp_path)
    monkeypatch.setattr(Path, "write_bytes", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left")))
    error = raised(campaign.write, tmp_path / "out")
    monkeypatch.undo()
    assert error.code == "not-writable"
    assert "no space left" in error.message
    assert snapshot(tmp_path) == before
    assert [path.name for path in tmp_path.iterdir()] == ["small"]


def test_a_campaign_that_would_not_read_back_is_not_written(tmp_path):
    campaign = Campaign("bad", 50.0, (recording(file="../free.csv"),))
    assert raised(campaign.write, tmp_path / "out").code == "path-escapes"
    assert not list(tmp_path.iterdir())


def test_the_hash_is_of_everything(folder):
    hashes = {Campaign.read(folder).sha256}
    toml = (folder / "campaign.toml").read_text()
    for old, new in (("800.0", "801.0"), ("validate", "estimate"), ('"small"', '"little"')):
        (folder / "campaign.toml").write_text(toml.replace(old, new))
        hashes.add(Campaign.read(folder).sha256)
    (folder / "campaign.toml").write_text(toml)
    csv = folder / "main.csv"
    csv.write_text(csv.read_text().replace("20.5", "20.0", 1))
    hashes.add(Campaign.read(folder).sha256)
    assert len(hashes) == 5
    assert all(len(sha) == 64 for sha in hashes)


def test_recordings_are_looked_up_by_file_and_by_number(folder):
    campaign = Campaign.read(folder)
    assert campaign["main.csv"] is campaign[1]
    assert len(campaign) == 2
    assert "main.csv" in campaign
    assert campaign[0] in campaign
    assert "else.csv" not in campaign
    error = raised(campaign.__getitem__, "mian.csv")
    assert error.code == "recording-unknown"
    assert error.file == "mian.csv"
    assert "'main.csv'" in error.message
    for unknown in (slice(0, 1), 2, -3, None):
        assert raised(campaign.__getitem__, unknown).code == "recording-unknown"


def test_results_are_frozen_and_can_be_sent_to_another_process(folder):
    campaign = Campaign.read(folder)
    with pytest.raises(AttributeError):
        campaign.name = "other"
    with pytest.raises(TypeError):
        campaign[0].channels["current_free_a"] = np.zeros(ROWS)
    with pytest.raises(ValueError, match="read-only"):
        campaign[0]["current_free_a"][0] = 1.0
    copy = pickle.loads(pickle.dumps(campaign))
    assert copy == campaign
    assert copy.sha256 == campaign.sha256


def test_a_recording_tells_itself(folder):
    found = Campaign.read(folder)[0]
    assert (found.duration_s, found.sample_rate_hz) == (pytest.approx(59 / 50), pytest.approx(50.0))
    assert len(found) == ROWS
    assert found.command.shape == (ROWS, 2)
    assert found.format == "csv"
    assert "pressure_free_pa" in found
    assert "fork_height_m" not in found
    assert repr(found).startswith("Recording('free.csv', free lift, 0 kg, estimate, 60 samples in 1.18 s; ")
    error = raised(found.__getitem__, "fork_height_m")
    assert (error.code, error.file, error.channel) == ("column-missing", "free.csv", "fork_height_m")
    assert repr(Campaign.read(folder)) == (
        "Campaign('small', 2 recordings (1 estimate, 1 validate) at 50 Hz)"
    )


def test_a_dataset_has_the_core_s_units_and_meanings(folder):
    found = Campaign.read(folder)[0]
    dataset = found.to_xarray()
    for name in (TIME, *found.channels):
        assert dataset[name].attrs == {"units": table()[name].unit, "long_name": table()[name].meaning}
    assert dataset.attrs["load_kg"] == 0.0
    assert found.to_polars().columns == [TIME, *found.channels]


def test_summaries_are_plain_data(folder):
    campaign = Campaign.read(folder)
    told = json.loads(json.dumps(campaign.to_dict(), allow_nan=False))
    assert told["sha256"] == campaign.sha256
    assert told["recordings"][1]["load_kg"] == 800.0
    assert told["recordings"][0]["channels"]["current_free_a"] == {
        "unit": "A",
        "samples": 60,
        "sample_rate_hz": 50.0,
        "missing": 0,
        "least": 0.0,
        "greatest": 0.75,
    }


def test_a_recording_made_in_memory_is_checked():
    columns = signals()
    del columns[TIME]
    assert recording().format == "memory"
    assert recording() == recording()
    assert recording(load_kg=1.0) != recording()
    assert raised(recording, channels=columns | {"speed": columns[COMMANDS[0]]}).code == "channel-unknown"
    assert raised(recording, channels={COMMANDS[0]: columns[COMMANDS[0]]}).code == "column-missing"
    assert raised(recording, time_s=np.arange(3.0)).code == "lengths-differ"


def test_required_channels_are_in_the_core_s_table():
    assert set(REQUIRED) <= set(table())
    assert {table()[name].unit for name in COMMANDS} == {"A"}
    assert all(row.lower < row.upper for row in table().values())
    assert all(conversions(row.unit) for row in table().values())


@pytest.mark.parametrize("name", NAMES)
def test_every_simulated_campaign_is_read_and_its_copy_reads_back_equal(name, tmp_path):
    campaign = Campaign.read(CAMPAIGNS / name)
    assert campaign.estimate
    assert campaign.validate
    campaign.write(tmp_path / "copy")
    assert Campaign.read(tmp_path / "copy") == campaign


def test_a_campaign_of_fourteen_recordings_is_read_in_a_tenth_of_a_second():
    folder = CAMPAIGNS / "null"
    assert len(Campaign.read(folder)) >= 14
    times = []
    for _ in range(5):
        start = time.process_time()
        Campaign.read(folder)
        times.append(time.process_time() - start)
    assert min(times) < 0.1


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"lift": "Main"}, "lift-unknown"),
        ({"role": "test"}, "role-unknown"),
        ({"load_kg": "800"}, "value-invalid"),
        ({"load_kg": np.nan}, "load-out-of-bounds"),
        ({"load_kg": -5000.0}, "load-out-of-bounds"),
        ({"time_s": np.where(np.arange(ROWS) == 5, np.nan, np.arange(ROWS))}, "sample-missing"),
        ({"time_s": np.arange(ROWS)[::-1]}, "time-not-increasing"),
        ({"time_s": [0.0], "channels": {name: [0.0] for name in COMMANDS}}, "recording-too-short"),
        ({"time_s": [], "channels": {name: [] for name in COMMANDS}}, "recording-empty"),
    ],
)
def test_a_recording_made_in_memory_is_checked_as_one_that_is_read(changes, code):
    assert raised(recording, **changes).code == code

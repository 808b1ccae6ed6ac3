"""What is converted is there in the end, whole; what stood there before is not lost."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress

import numpy as np
import polars as pl
import pytest
from scipy.io import savemat

from forklift import Campaign, Recording, compare, convert
from forklift.app.main import main
from forklift.recordings.inspect import inspect
from small_campaign import RATE_HZ, csv_text, foreign, make, make_mapped, raised, signals, snapshot

LONG_ROWS = 1500


@pytest.fixture
def log(tmp_path):
    """A further recording of a plain campaign, its lift and load in its name."""
    pl.DataFrame(signals()).write_csv(tmp_path / "free_800kg.csv")
    return tmp_path / "free_800kg.csv"


def long_log(path, oil_at, second="free"):
    """A lowering of the free lift, after a pause one of the second; an oil temperature at some times [s]."""
    time = np.arange(LONG_ROWS) / RATE_HZ
    command = np.zeros(LONG_ROWS)
    command[100:200] = command[1000:1300] = 0.5
    free = np.where((second == "free") | (time < 10.0), command, 0.0)
    columns = {
        "time_s": time, "current_free_a": free, "current_main_a": command - free,
        "position_free_m": 1.0 - np.cumsum(command) / 1000.0,
        "oil_temperature_degc.time_s": time * np.nan, "oil_temperature_degc": time * np.nan,
    }  # fmt: skip
    columns["oil_temperature_degc.time_s"][: len(oil_at)] = oil_at
    columns["oil_temperature_degc"][: len(oil_at)] = 21.0
    path.write_text(csv_text(columns))
    return path


@pytest.mark.parametrize("suffix", [".csv", ".mat"])
def test_a_campaign_with_a_mapping_is_not_extended_and_stays_as_it_was(tmp_path, log, suffix):
    folder = make_mapped(tmp_path / "mapped", suffix)
    before = snapshot(folder)
    assert raised(convert, log, folder, extend=True).code == "option-not-wanted"
    assert snapshot(folder) == before


def test_a_campaign_that_is_extended_keeps_its_files_and_its_text(tmp_path, log):
    folder = make(tmp_path / "small")
    text = folder / "campaign.toml"
    text.write_text("# as measured in May\n" + text.read_text())
    before, earlier = snapshot(folder), Campaign.read(folder)
    found = convert(log, folder, extend=True)
    after = snapshot(folder)
    assert after.pop("free_800kg.csv")
    assert after.pop("campaign.toml").startswith(before.pop("campaign.toml").rstrip())
    assert after == before
    assert found.recordings[:-1] == earlier.recordings
    assert found == Campaign.read(folder)
    assert (found.name, found[-1].load_kg, found.folder) == (earlier.name, 800.0, folder)


def test_a_recording_that_the_campaign_already_has_is_not_added(tmp_path):
    folder = make(tmp_path / "small")
    (tmp_path / "free.csv").write_bytes((folder / "free.csv").read_bytes())
    before = snapshot(folder)
    told = {"lift": "free", "load_kg": 0.0, "extend": True}
    assert raised(convert, tmp_path / "free.csv", folder, **told).code == "recording-repeated"
    assert raised(convert, tmp_path / "free.csv", folder, name="other", **told).code == "option-not-wanted"
    assert snapshot(folder) == before


def test_a_log_is_not_replaced_by_what_is_made_of_it(tmp_path):
    folder = make_mapped(tmp_path / "mapped", ".mat")
    before = snapshot(folder)
    told = {"lift": "free", "load_kg": 0.0, "channels": dict.fromkeys(foreign(), "time_s")}
    assert raised(convert, folder / "run.mat", folder, overwrite=True, **told).code == "output-exists"
    assert snapshot(folder) == before


def test_a_part_without_an_oil_temperature_is_cut_out_all_the_same(tmp_path):
    log = long_log(tmp_path / "free_0kg.csv", [9.9, 20.9])
    first, second = convert(log, tmp_path / "parts", cut=True)
    assert "oil_temperature_degc" not in first
    assert second.own("oil_temperature_degc").values.tolist() == [21.0]
    assert compare(Campaign("second", RATE_HZ, (second,)), "thesis").fits.height
    whole = convert(log, tmp_path / "whole")
    assert len(whole[0].own("oil_temperature_degc").time) == 2


def test_what_could_not_be_read_back_is_not_left_behind(tmp_path, monkeypatch):
    log = long_log(tmp_path / "free_0kg.csv", [9.9])
    monkeypatch.setattr(Recording, "to_csv", lambda _: "time_s,current_free_a\n0,1\n")
    assert raised(convert, log, tmp_path / "out").code == "column-missing"
    assert [path.name for path in tmp_path.iterdir()] == ["free_0kg.csv"]


@pytest.mark.skipif(os.name == "nt", reason="asks in a pseudo-terminal")
def test_a_question_is_not_erased_while_it_is_answered(tmp_path):
    import pty
    import select

    pl.DataFrame(signals()).write_csv(tmp_path / "run.csv")
    here, there = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "forklift", "convert", tmp_path / "run.csv", "--out", tmp_path / "out"],
        stdin=there, stdout=subprocess.DEVNULL, stderr=there, env=os.environ | {"TERM": "xterm"},
    )  # fmt: skip
    os.close(there)
    for mark, answer in ((b"both)?", b"free\n"), (b"forks?", b"800\n")):
        told = b""
        while mark not in told:
            told += os.read(here, 4096)
        if select.select([here], [], [], 0.3)[0]:  # the rest of the question
            os.read(here, 4096)
        assert not select.select([here], [], [], 0.5)[0], "what is typed is written over"
        os.write(here, answer)
    with suppress(OSError):  # its end
        while os.read(here, 4096):
            pass
    assert process.wait() == 0
    assert Campaign.read(tmp_path / "out")[0].load_kg == 800.0


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_proposal_passes_over_the_columns_that_are_no_channels(tmp_path, suffix):
    own = foreign()
    columns = {"Time [s]": own["t"], "Valve current FL [mA]": own["ValveCurrFL"],
               "Valve current ML [mA]": own["ValveCurrML"], "pressure_free_pa": own["pA"] * 1e5,
               "Engine speed [rpm]": own["t"] * 0.0 + 800.0, "Comment": ["ok"] * len(own["t"])}  # fmt: skip
    table, log = pl.DataFrame(columns), tmp_path / f"free_800kg{suffix}"
    table.write_csv(log) if suffix == ".csv" else table.write_parquet(log)
    (found,) = convert(log, tmp_path / "campaign", propose=True)
    assert set(found.channels) == {"current_free_a", "current_main_a", "pressure_free_pa"}
    (tmp_path / "channels.toml").write_text(inspect(log).mapping())
    (again,) = convert(log, tmp_path / "again", channels=tmp_path / "channels.toml")
    assert again == found


def test_the_currents_tell_the_lift_of_a_lowering_that_is_cut_out(tmp_path):
    log = long_log(tmp_path / "main_hall_0kg.csv", [9.9], second="main")
    assert [one.lift for one in convert(log, tmp_path / "parts", cut=True)] == ["free", "main"]
    told = {"cut": True, "lift": "main"}
    assert raised(convert, log, tmp_path / "told", **told).code == "lift-contradicts-current"


def test_a_table_that_tells_of_none_of_the_recordings_is_not_passed_over(tmp_path, log):
    table = tmp_path / "list.csv"
    table.write_text("file,lift,load_kg,role\nother.csv,free,800,estimate\n")
    error = raised(convert, log, tmp_path / "made", table=table)
    assert error.code == "table-invalid"
    assert error.value == ["other.csv"]
    assert not (tmp_path / "made").exists()


def test_a_dbc_is_not_passed_over_where_there_are_no_frames(tmp_path, log, capsys):
    assert raised(convert, log, tmp_path / "made", dbc="truck.dbc").code == "option-not-wanted"
    with pytest.raises(SystemExit) as ended:
        main(["info", str(log), "--dbc", "truck.dbc"])
    assert ended.value.code == 2
    assert "[option-not-wanted]" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"data": np.zeros((100, 4))}, "data is an array of 100 x 4"),
        ({}, "no signal"),
        ({"t": "x"}, "no signal"),
    ],
)
def test_a_file_without_a_signal_is_told_as_such(tmp_path, variables, said):
    savemat(tmp_path / "log.mat", variables)
    error = raised(inspect, tmp_path / "log.mat")
    assert error.code == "recording-empty"
    assert said in str(error)


def test_an_array_beside_signals_is_named(tmp_path):
    savemat(tmp_path / "log.mat", {"log": {"time": np.arange(9.0), "p": np.ones(9), "raw": np.zeros((9, 2))}})
    found = inspect(tmp_path / "log.mat")
    assert found.passed == {"log.raw": "an array of 9 x 2"}
    assert [one.name for one in found.signals] == ["log.p"]


def test_an_array_of_a_newer_mat_file_is_named_whatever_unit_it_states(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.mat", "w", userblock_size=512) as file:
        file["p"] = np.ones(9)
        file["raw"] = np.zeros((9, 2))
        file["raw"].attrs["unit"] = "bar"
    assert inspect(tmp_path / "log.mat").passed == {"raw": "an array of 9 x 2"}


def test_a_table_without_rows_holds_no_signal(tmp_path):
    (tmp_path / "log.csv").write_text("time_s,current_free_a\n")
    assert raised(inspect, tmp_path / "log.csv").code == "recording-empty"

"""From a stranger's log to a diagnosis in four commands: CAN with a DBC, MDF4 in other units, MAT 7.3."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

import bus
from campaigns import CAMPAIGNS
from forklift import Campaign
from forklift.app.main import main
from forklift.recordings.inspect import inspect, sketch
from forklift.recordings.recording import Recording

FILES = ("free_prms1_800kg_20c.csv", "free_prms2_800kg_60c.csv")


@cache
def recordings() -> tuple[Recording, ...]:
    campaign = Campaign.read(CAMPAIGNS / "null")
    return tuple(campaign[file] for file in FILES)


def columns(recording: Recording) -> dict[str, tuple[np.ndarray, str]]:
    """As a vehicle's logger calls and scales it, with the unit."""
    return {
        "ValveCurrFL": (recording["current_free_a"] * 1e3, "mA"),
        "ValveCurrML": (recording["current_main_a"] * 1e3, "mA"),
        "pA_FL": (recording["pressure_free_pa"] / 1e5, "bar"),
        "xFL": (recording["position_free_m"] * 1e3, "mm"),
        "TOil": (recording["oil_temperature_degc"] * 1.8 + 32.0, "°F"),
        "EngineSpeed": (np.full(len(recording), 800.0), "rpm"),
    }


def blf(folder, recording, name):
    pytest.importorskip("cantools", reason="cantools (the extra can) is not installed")
    path = folder / f"{name}.blf"
    plain = {key: values for key, (values, _) in columns(recording).items() if key != "EngineSpeed"}
    bus.write(path, bus.frames(recording.time_s, plain))
    (folder / "truck.dbc").write_text(bus.DBC)
    return path


def mf4(folder, recording, name):
    asammdf = pytest.importorskip("asammdf", reason="asammdf (the extra mdf) is not installed")
    path = folder / f"{name}.mf4"
    with asammdf.MDF(version="4.10") as file:
        for key, (values, unit) in columns(recording).items():
            file.append([asammdf.Signal(values, recording.time_s, name=key, unit=unit)], acq_name="ECU")
        file.save(path, overwrite=True)
    return path


def mat(folder, recording, name):
    h5py = pytest.importorskip("h5py", reason="h5py (the extra mat) is not installed")
    path = folder / f"{name}.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["log/time"] = recording.time_s[None, :]
        for key, (values, unit) in columns(recording).items():
            file[f"log/{key}"] = values[None, :]
            file[f"log/{key}"].attrs["unit"] = unit
    return path


LOGS = {"blf": blf, "mf4": mf4, "mat": mat}


@pytest.fixture(params=LOGS)
def logs(request, tmp_path):
    """Two logs whose names say lift, load and role."""
    names = ("free_800kg_20c", "free_800kg_60c_val")
    return [LOGS[request.param](tmp_path, one, name) for one, name in zip(recordings(), names, strict=True)]


def run(*arguments):
    """One command; its exit status."""
    try:
        main([str(one) for one in arguments])
    except SystemExit as end:
        return end.code or 0
    return 0


def test_a_stranger_s_log_is_compared_and_diagnosed_in_four_commands(logs, tmp_path, capsys):
    dbc = ["--dbc", tmp_path / "truck.dbc"] if logs[0].suffix == ".blf" else []
    mapping, out = tmp_path / "channels.toml", tmp_path / "campaign"
    assert run("info", logs[0], *dbc, "--write", mapping) == 0
    said = capsys.readouterr().out
    assert "ValveCurrFL" in said
    assert "pressure_free_pa" in said
    assert run("convert", *logs, "--channels", mapping, "--out", out) == 0
    campaign = Campaign.read(out)
    assert [(one.lift, one.load_kg, one.role) for one in campaign] == [
        ("free", 800.0, "estimate"),
        ("free", 800.0, "validate"),
    ]
    for before, after in zip(recordings(), campaign, strict=True):
        assert set(after.channels) == {
            "current_free_a", "current_main_a", "pressure_free_pa", "position_free_m", "oil_temperature_degc"
        }  # fmt: skip
        for name in after.channels:
            own = after.own(name).values
            of_all = {name: before[name][::5] if name.startswith("oil") and dbc else before[name]}
            resolution = {"pressure_free_pa": 600.0, "position_free_m": 6e-5}.get(name, 0.06)
            np.testing.assert_allclose(
                own, of_all[name][: len(own)], atol=resolution if dbc else 1e-6 * resolution + 1e-7
            )
    capsys.readouterr()
    assert run("compare", out, "--json") == 0
    fits = json.loads(capsys.readouterr().out)["fits"]
    assert {one["channel"] for one in fits} >= {"velocity_free_m_s", "pressure_free_pa"}
    assert run("diagnose", out, "--out", tmp_path / "found") == 0
    assert (tmp_path / "found" / "report.html").is_file()
    found = json.loads((tmp_path / "found" / "diagnosis.json").read_text())
    assert (found["verdict"], found["causes"]) == ("no-mismatch", [])
    off = [one["facts"] for one in found["cautions"] if one["code"] == "clocks-apart"]
    if not dbc:
        assert not off
        return
    # On the bus the sensors' frames are stamped after they were sampled; just that is told.
    (clock,) = off
    assert set(clock) == {"clock", "shift_s"}
    assert clock["shift_s"]["agree"]
    assert clock["shift_s"]["lower"] <= bus.SENSORS_LATE_S <= clock["shift_s"]["upper"]


def test_a_campaign_is_extended_with_the_mapping_it_was_made_with(logs, tmp_path, capsys):
    dbc = ["--dbc", tmp_path / "truck.dbc"] if logs[0].suffix == ".blf" else []
    out = tmp_path / "campaign"
    assert run("convert", logs[0], *dbc, "--propose", "--out", out) == 0
    assert run("convert", logs[1], "--out", out) == 2
    assert run("convert", logs[1], "--extend", "--out", out) == 0
    capsys.readouterr()
    assert [one.file for one in Campaign.read(out)] == [f"{log.stem}.csv" for log in logs]
    assert (out / "channels.toml").exists()


def test_one_long_log_is_cut_into_its_lowerings(tmp_path, capsys):
    asammdf = pytest.importorskip("asammdf", reason="asammdf (the extra mdf) is not installed")
    one = recordings()[0]
    rest = 6.0
    step = one.time_s[1] - one.time_s[0]
    pause = round(rest / step)
    length = len(one) + pause
    path = tmp_path / "day_800kg.mf4"
    with asammdf.MDF(version="4.10") as file:
        for name, values in one.channels.items():
            held = np.full(pause, 0.0 if "current" in name else values[-1])
            long = np.tile(np.r_[held, values], 3)
            file.append([asammdf.Signal(long, step * np.arange(3 * length), name=name)])
        file.save(path, overwrite=True)
    assert run("convert", path, "--cut", "--out", tmp_path / "campaign") == 0
    campaign = Campaign.read(tmp_path / "campaign")
    assert [one.file for one in campaign] == [f"day_800kg_{k}.csv" for k in (1, 2, 3)]
    assert {(one.lift, one.load_kg) for one in campaign} == {("free", 800.0)}
    for part in campaign:
        assert part.command[: round(0.5 / step)].max() <= 0.2
        np.testing.assert_allclose(part.command.max(axis=0), one.command.max(axis=0))


def test_lift_and_load_come_from_a_table_or_the_lack_is_told(tmp_path, capsys):
    log = mf4(tmp_path, recordings()[0], "run7")
    assert run("convert", log, "--propose", "--out", tmp_path / "campaign") == 2
    assert "nothing tells lift of run7.mf4" in capsys.readouterr().err
    table = tmp_path / "runs.csv"
    table.write_text("file,lift,load_kg,role\nrun7.mf4,free,750,validate\n")
    assert run("convert", log, "--propose", "--table", table, "--out", tmp_path / "campaign") == 0
    assert (lambda one: (one.lift, one.load_kg, one.role))(Campaign.read(tmp_path / "campaign")[0]) == (
        "free", 750.0, "validate"
    )  # fmt: skip
    table.write_text("file,lift,load_kg\nrun7.mf4,up,750\n")
    assert run("convert", log, "--propose", "--table", table, "--out", tmp_path / "other") == 2
    assert "lift is 'up'" in capsys.readouterr().err


def test_what_is_proposed_is_right_for_every_channel(tmp_path):
    log = inspect(mf4(tmp_path, recordings()[0], "x"))
    assert {one.name: one.proposal.channel for one in log.signals if one.proposal} == {
        "ValveCurrFL": "current_free_a",
        "ValveCurrML": "current_main_a",
        "pA_FL": "pressure_free_pa",
        "xFL": "position_free_m",
        "TOil": "oil_temperature_degc",
    }
    assert {one.rate_hz for one in log.signals} == {50.0}
    assert log.signals[0].unit == "mA"


def test_a_table_s_proposals_stand_beside_its_text(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("Time [s],Strom Freihub [mA],Bemerkung\n0.00,500,ok\n0.02,510,ok\n0.04,520,ok\n")
    log = inspect(path)
    assert {one.name: one.proposal.channel for one in log.signals if one.proposal} == {
        "Time [s]": "time_s",
        "Strom Freihub [mA]": "current_free_a",
    }
    assert "nothing looks like current_main_a" in log.mapping()


def test_a_character_that_a_redirected_output_does_not_know_is_no_mistake(tmp_path):
    (tmp_path / "log.csv").write_text("time_s,current_free_a\n0.00,0.5\n0.02,0.6\n0.04,0.7\n")
    told = subprocess.run(
        [sys.executable, "-m", "forklift", "info", tmp_path / "log.csv"],
        env=os.environ | {"PYTHONIOENCODING": "cp1252"},
        capture_output=True,
    )
    assert (told.returncode, told.stderr) == (0, b"")
    assert b"current_free_a" in told.stdout


def test_a_sketch_goes_from_least_to_greatest():
    assert sketch(np.arange(8.0)) == "▁▂▃▄▅▆▇█"
    assert sketch(np.array([1.0, np.nan, 1.0])) == "▁ ▁"
    assert sketch(np.array([np.nan])) == ""


def test_compare_and_convert_tell_first_what_is_wrong(tmp_path, capsys):
    one = recordings()[0]
    swapped = Recording(
        one.file, one.lift, one.load_kg, one.role, one.time_s,
        dict(one.channels)
        | {"pressure_free_pa": one["pressure_main_pa"], "pressure_main_pa": one["pressure_free_pa"]},
    )  # fmt: skip
    folder = Campaign("swapped", 50.0, (swapped,)).write(tmp_path / "swapped")
    assert run("compare", folder) == 0
    assert capsys.readouterr().out.startswith("Check [lifts-swapped]: ")
    assert run("convert", folder, "--out", tmp_path / "plain") == 0
    assert capsys.readouterr().out.startswith("Check [lifts-swapped]: ")
    assert run("compare", folder, "--json") == 0
    assert json.loads(capsys.readouterr().out)["findings"][0]["code"] == "lifts-swapped"

"""Every format gives the same recording, whatever its names, units and clocks."""

from __future__ import annotations

import csv as stdlib_csv
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from forklift import Campaign, ForkliftError, convert
from forklift.recordings.clocks import SAME_INSTANT_S, Sampled, driving, union
from forklift.recordings.formats import FORMATS, format_of, isolation, mdf4
from forklift.recordings.formats.csv import carefully, quickly
from forklift.recordings.formats.signals import Place, Signals
from forklift.recordings.inspect import inspect
from small_campaign import (
    MAPPED,
    RATE_HZ,
    ROWS,
    TOML,
    csv_text,
    foreign,
    make,
    make_mapped,
    raised,
    signals,
    snapshot,
    write_mat73,
)

SUFFIXES = (".csv", ".parquet", ".mat", ".mf4")


def expected() -> dict[str, np.ndarray]:
    own = signals()
    return {name: own[name] for name in ("current_free_a", "current_main_a", "pressure_free_pa")}


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_mapped_recording_is_read_in_si_units(suffix, tmp_path):
    found = Campaign.read(make_mapped(tmp_path / "mapped", suffix))[0]
    assert found.format == format_of(f"x{suffix}").name
    np.testing.assert_array_equal(found.time_s, signals()["time_s"])
    assert set(found.channels) == set(expected())
    for name, values in expected().items():
        np.testing.assert_allclose(found.channels[name], values, rtol=1e-15)


def test_mat_7_3_is_read_like_mat_5(tmp_path):
    folder = make_mapped(tmp_path / "mapped", ".mat")
    five = Campaign.read(folder)[0]
    write_mat73(folder / "run.mat", foreign())
    assert (folder / "run.mat").read_bytes()[512:520] == b"\x89HDF\r\n\x1a\n"
    assert Campaign.read(folder)[0] == five


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_missing_sample_stays_missing(suffix, tmp_path):
    columns = foreign()
    columns["pA"][7] = np.nan
    found = Campaign.read(make_mapped(tmp_path / "mapped", suffix, columns))[0]
    assert np.flatnonzero(np.isnan(found["pressure_free_pa"])).tolist() == [7]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_conversion_gives_a_plain_campaign(suffix, tmp_path):
    folder = make_mapped(tmp_path / "mapped", suffix)
    plain = convert(folder, tmp_path / "plain")
    assert plain == Campaign.read(tmp_path / "plain")
    assert [path.name for path in sorted((tmp_path / "plain").iterdir())] == ["campaign.toml", "run.csv"]
    assert "channels" not in (tmp_path / "plain" / "campaign.toml").read_text()
    source = Campaign.read(folder)[0]
    for name, values in source.channels.items():
        np.testing.assert_array_equal(plain[0][name], values)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_single_files_are_converted(suffix, tmp_path):
    folder = make_mapped(tmp_path / "mapped", suffix)
    channels = {
        "t": "time_s",
        "ValveCurrFL": {"channel": "current_free_a", "scale": 1e-3},
        "ValveCurrML": {"channel": "current_main_a", "scale": 1e-3},
        "pA": {"channel": "pressure_free_pa", "scale": 1e5},
    }
    told = {"lift": "free", "load_kg": 100.0, "channels": channels}
    plain = convert(folder / f"run{suffix}", tmp_path / "plain", **told)
    assert (plain.name, plain.sample_rate_hz, plain[0].role) == ("plain", 50.0, "estimate")
    assert {name: list(values) for name, values in plain[0].channels.items()} == {
        name: list(values) for name, values in Campaign.read(folder)[0].channels.items()
    }


def test_conversion_says_what_it_needs_and_writes_nothing(tmp_path):
    folder = make_mapped(tmp_path / "mapped", ".csv")
    before = snapshot(tmp_path)
    file, out = folder / "run.csv", tmp_path / "out"
    assert raised(convert, file, out, load_kg=0.0).name == "lift"
    assert raised(convert, file, out, lift="free").code == "option-missing"
    assert raised(convert, folder, out, lift="free").code == "option-not-wanted"
    assert raised(convert, folder, out, sample_rate_hz=-1.0).code == "sample-rate-out-of-bounds"
    assert raised(convert, folder, folder, overwrite=True).code == "output-exists"
    assert raised(convert, [], out, lift="free", load_kg=0.0).code == "recordings-missing"
    assert raised(convert, [file, file], out, lift="free", load_kg=0.0).code == "recording-repeated"
    assert raised(convert, tmp_path / "no.csv", out, lift="free", load_kg=0.0).code == "recording-missing"
    assert raised(convert, file, out, lift="free", load_kg=0.0).code == "column-unknown"
    assert raised(convert, file, out, lift="up", load_kg=0.0).code == "lift-unknown"
    assert snapshot(tmp_path) == before
    assert [path.name for path in tmp_path.iterdir()] == ["mapped"]


def test_conversion_brings_a_recording_to_another_rate(tmp_path):
    folder = make(tmp_path / "small")
    slow = convert(folder, tmp_path / "slow", sample_rate_hz=25.0)
    for before, after in zip(Campaign.read(folder), slow, strict=True):
        assert after.sample_rate_hz == pytest.approx(25.0)
        for name, values in before.channels.items():
            np.testing.assert_array_equal(after[name], values[: 2 * len(after) : 2])


def test_conversion_evens_a_clock_that_lost_samples(tmp_path):
    folder = make(tmp_path / "small")
    lines = (folder / "free.csv").read_text().splitlines()
    del lines[11:15]
    (folder / "free.csv").write_text("\n".join(lines))
    assert raised(Campaign.read, folder).code == "clock-jump"
    found = convert(folder, tmp_path / "even", sample_rate_hz=50.0)[0]
    assert len(found) == ROWS
    assert np.flatnonzero(np.isnan(found["pressure_free_pa"])).tolist() == [10, 11, 12, 13]
    np.testing.assert_array_equal(found["current_free_a"][9:14], found["current_free_a"][9])


def test_unmapped_columns_are_passed_over_only_where_that_is_meant(tmp_path):
    columns = foreign() | {"EngineSpeed": np.full(ROWS, 800.0)}
    for suffix in (".mat", ".mf4"):
        assert len(Campaign.read(make_mapped(tmp_path / suffix, suffix, columns))[0].channels) == 3
    for suffix in (".csv", ".parquet"):
        folder = make_mapped(tmp_path / suffix, suffix, columns)
        error = raised(Campaign.read, folder)
        assert (error.code, error.value, error.file) == ("column-unknown", "EngineSpeed", f"run{suffix}")
        toml = folder / "campaign.toml"
        toml.write_text(toml.read_text().replace("[channels]", 'ignore = ["EngineSpeed"]\n[channels]'))
        assert len(Campaign.read(folder)[0].channels) == 3


def test_an_ignored_column_may_hold_anything(tmp_path):
    folder = make(tmp_path / "small")
    lines = (folder / "free.csv").read_text().splitlines()
    lines = [lines[0] + ",remark", *(line + ",ok" for line in lines[1:])]
    (folder / "free.csv").write_text("\n".join(lines))
    assert raised(Campaign.read, folder).code == "column-unknown"
    (folder / "campaign.toml").write_text('ignore = ["remark"]\n' + TOML)
    assert "remark" not in Campaign.read(folder)[0].channels


def test_a_channel_s_own_name_needs_no_mapping(tmp_path):
    columns = foreign() | {"fork_height_m": np.full(ROWS, 3.0)}
    found = Campaign.read(make_mapped(tmp_path / "mapped", ".csv", columns))[0]
    np.testing.assert_array_equal(found["fork_height_m"], 3.0)


def test_temperature_is_mapped_with_its_offset(tmp_path):
    columns = foreign() | {"T": np.full(ROWS, 293.15)}
    folder = make_mapped(tmp_path / "mapped", ".parquet", columns)
    line = '[channels]\nT = { channel = "oil_temperature_degc", offset = -273.15 }'
    (folder / "campaign.toml").write_text(MAPPED.format(file="run.parquet").replace("[channels]", line))
    np.testing.assert_allclose(Campaign.read(folder)[0]["oil_temperature_degc"], 20.0)


def mdf_on_three_clocks(path):
    """Currents at 50 Hz, pressure at 1 kHz with a gap from 0.5 to 0.6 s, temperature at 10 Hz."""
    asammdf = pytest.importorskip("asammdf", reason="asammdf (the extra mdf) is not installed")
    columns = foreign()
    currents = [
        asammdf.Signal(columns[name], columns["t"], name=name) for name in ("ValveCurrFL", "ValveCurrML")
    ]
    fast = np.arange(0.0005, 1.2, 0.001)
    fast = fast[(fast < 0.5) | (fast > 0.6)]
    slow = np.arange(0.0, 1.25, 0.1)
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append(currents, acq_name="ECU")
        mdf.append([asammdf.Signal(100.0 + fast, fast, name="pA")], acq_name="DAQ")
        invalid = asammdf.Signal(20.0 + slow, slow, name="T", invalidation_bits=np.arange(len(slow)) == 3)
        mdf.append([invalid], acq_name="Tank")
        mdf.save(path, overwrite=True)


def test_channels_on_their_own_clocks_keep_them(tmp_path):
    folder = make_mapped(tmp_path / "mapped", ".mf4")
    mdf_on_three_clocks(folder / "run.mf4")
    line = '[channels]\nT = { channel = "oil_temperature_degc" }'
    (folder / "campaign.toml").write_text(MAPPED.format(file="run.mf4").replace("[channels]", line))
    found = Campaign.read(folder)[0]
    clock, command = found.commanded
    np.testing.assert_array_equal(clock, np.arange(ROWS) / RATE_HZ)
    np.testing.assert_array_equal(command[:, 0], signals()["current_free_a"])
    fast = np.arange(0.0005, 1.2, 0.001)
    fast = fast[((fast < 0.5) | (fast > 0.6)) & (fast <= clock[-1])]
    pressure = found.own("pressure_free_pa")
    np.testing.assert_allclose(pressure.time, fast, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(pressure.values, (100.0 + fast) * 1e5)
    temperature = found.own("oil_temperature_degc")
    np.testing.assert_allclose(temperature.time, np.arange(0.0, 1.15, 0.1), atol=1e-12)
    assert np.flatnonzero(np.isnan(temperature.values)).tolist() == [3]
    held = np.searchsorted(clock, found.time_s, side="right") - 1
    np.testing.assert_array_equal(found["current_free_a"], signals()["current_free_a"][held])


def test_a_recording_on_several_clocks_is_written_and_read_back_the_same(tmp_path):
    folder = make_mapped(tmp_path / "mapped", ".mf4")
    mdf_on_three_clocks(folder / "run.mf4")
    line = '[channels]\nT = { channel = "oil_temperature_degc" }'
    (folder / "campaign.toml").write_text(MAPPED.format(file="run.mf4").replace("[channels]", line))
    plain = convert(folder, tmp_path / "plain")
    assert plain[0] == replace(Campaign.read(folder)[0], file="run.csv")
    header = (tmp_path / "plain" / "run.csv").read_text().splitlines()[0]
    assert header == (
        "time_s,current_free_a,current_main_a,pressure_free_pa.time_s,pressure_free_pa,"
        "oil_temperature_degc.time_s,oil_temperature_degc"
    )


def test_a_column_may_have_its_times_in_another_column(tmp_path):
    columns = foreign()
    columns |= {"t_p": columns["t"] + 0.007}
    columns["t_p"][-2:] = columns["pA"][-2:] = np.nan  # a shorter column
    for suffix in (".csv", ".parquet"):
        folder = make_mapped(tmp_path / suffix, suffix, columns)
        assert raised(Campaign.read, folder).code == "column-unknown"
        toml = folder / "campaign.toml"
        toml.write_text(toml.read_text().replace('"pressure_free_pa",', '"pressure_free_pa", time = "t_p",'))
        own = Campaign.read(folder)[0].own("pressure_free_pa")
        np.testing.assert_allclose(own.time, columns["t_p"][:-2], atol=1e-12)
        np.testing.assert_array_equal(own.values, (columns["pA"] * 1e5)[:-2])
        toml.write_text(toml.read_text().replace('time = "t_p"', 'time = "t_q"'))
        assert raised(Campaign.read, folder).code == "source-missing"
    columns["pA"][-1] = 20.0
    folder = make_mapped(tmp_path / "lost", ".csv", columns)
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace('"pressure_free_pa",', '"pressure_free_pa", time = "t_p",'))
    assert raised(Campaign.read, folder).code == "time-missing"


def sampled(*columns):
    return dict(zip(("current_free_a", "current_main_a", "pressure_free_pa"), columns, strict=False))


def test_a_commanded_current_is_held_until_its_next_sample():
    steps = Sampled(np.array([0.0, 0.1, 0.3]), np.array([0.0, 1.0, 2.0]))
    still = Sampled(np.array([0.0, 0.3]), np.zeros(2))
    fine = Sampled(np.arange(7) / 20, np.zeros(7))
    time, channels, rows = union(Place("x.mf4", "x.mf4"), sampled(steps, still, fine))
    np.testing.assert_allclose(time, np.arange(7) / 20)
    assert channels["current_free_a"].tolist() == [0, 0, 1, 1, 1, 1, 2]
    assert rows["current_free_a"].tolist() == [0, 2, 6]


@given(
    steps=st.lists(st.lists(st.floats(1e-3, 1.0), min_size=2, max_size=20), min_size=3, max_size=3),
    shift=st.floats(-1e3, 1e3),
)
def test_no_measurement_is_moved_or_made_up(steps, shift):
    clocks = [shift + np.cumsum(own) for own in steps]
    series = sampled(*(Sampled(time, np.sin(np.arange(len(time)) * 1.7)) for time in clocks))
    start = max(found.time[0] for name, found in series.items() if "current" in name)
    end = min(found.time[-1] for name, found in series.items() if "current" in name)
    if end <= start:
        assert raised(union, Place("x", "x"), series).code == "time-not-common"
        return
    time, channels, rows = union(Place("x", "x"), series)
    assert np.all(np.diff(time) > 0.0)
    own = series["pressure_free_pa"]
    there = (own.time >= start - SAME_INSTANT_S) & (own.time <= end + SAME_INSTANT_S)
    assert ("pressure_free_pa" in channels) == there.any()
    if there.any():
        pressure, at = channels["pressure_free_pa"], rows["pressure_free_pa"]
        np.testing.assert_array_equal(pressure[at], own.values[there])
        np.testing.assert_allclose(time[at] + start, own.time[there], atol=1.1e-6)
        assert np.isnan(np.delete(pressure, at)).all()
    for name in ("current_free_a", "current_main_a"):
        assert np.isfinite(channels[name]).all()


@given(
    steps=st.lists(st.floats(1e-3, 0.1), min_size=3, max_size=60),
    levels=st.lists(st.floats(0.0, 1.75), min_size=61, max_size=61),
)
def test_uneven_commands_drive_the_model_by_their_means(steps, levels):
    time = np.append(0.0, np.cumsum(steps))
    command = np.column_stack([levels[: len(time)], np.full(len(time), 0.3)])
    clock, driven = driving(time, command)
    assert np.all(np.diff(clock) > 0.0)
    assert np.all(driven[:, 1] == 0.3)
    charge = float(command[:-1, 0] @ np.diff(time))
    upto = np.append(np.diff(clock), time[-1] - clock[-1])
    # What is held after the last sample counts within the last step only.
    assert float(driven[:, 0] @ upto) == pytest.approx(charge, abs=1.75 * 0.006)


def test_currents_that_do_not_overlap_are_no_recording():
    early = Sampled(np.arange(5.0), np.zeros(5))
    late = Sampled(np.arange(5.0) + 10.0, np.zeros(5))
    assert raised(union, Place("x.mf4", "x.mf4"), sampled(early, late)).code == "time-not-common"


def test_a_signal_that_several_groups_have_must_be_named_with_its_group(tmp_path):
    asammdf = pytest.importorskip("asammdf", reason="asammdf (the extra mdf) is not installed")
    folder = make_mapped(tmp_path / "mapped", ".mf4")
    columns = foreign()
    with asammdf.MDF(version="4.10") as mdf:
        own = {name: asammdf.Signal(values, columns["t"], name=name) for name, values in columns.items()}
        mdf.append([own["ValveCurrFL"], own["ValveCurrML"], own["pA"]], acq_name="ECU")
        mdf.append([own["pA"]], acq_name="DAQ")
        mdf.save(folder / "run.mf4", overwrite=True)
    error = raised(Campaign.read, folder)
    assert (error.code, error.column, error.value) == ("column-repeated", "pA", ["0/pA", "1/pA"])
    for name in ("1/pA", "DAQ/pA"):
        (folder / "campaign.toml").write_text(MAPPED.format(file="run.mf4").replace('"pA"', f'"{name}"'))
        np.testing.assert_allclose(
            Campaign.read(folder)[0]["pressure_free_pa"], expected()["pressure_free_pa"]
        )


def test_a_struct_with_its_own_time_is_read_from_both_kinds_of_mat_file(tmp_path):
    h5py = pytest.importorskip("h5py", reason="h5py (the extra mat) is not installed")
    from scipy.io import savemat

    own = foreign()
    log = {"time": own["t"], "ValveCurrFL": own["ValveCurrFL"], "deep": {"ValveCurrML": own["ValveCurrML"]}}
    folder = make_mapped(tmp_path / "mapped", ".mat")
    text = (
        MAPPED.format(file="run.mat")
        .replace('"pA" = { channel = "pressure_free_pa", scale = 1e5 }\n', "")
        .replace('"ValveCurrFL"', '"log.ValveCurrFL"')
        .replace('"ValveCurrML"', '"log.deep.ValveCurrML"')
    )
    (folder / "campaign.toml").write_text(text)
    savemat(folder / "run.mat", {"log": log})
    five = Campaign.read(folder)[0]
    np.testing.assert_array_equal(five.time_s, own["t"])
    with h5py.File(folder / "run.mat", "w", userblock_size=512) as file:
        for name, values in (("time", log["time"]), ("ValveCurrFL", log["ValveCurrFL"])):
            file[f"log/{name}"] = values[None, :]
        file["log/deep/ValveCurrML"] = own["ValveCurrML"][:, None]
    assert Campaign.read(folder)[0] == five


def test_vectors_of_other_length_than_their_time_are_refused(tmp_path):
    columns = foreign()
    columns["pA"] = columns["pA"][:-1]
    error = raised(Campaign.read, make_mapped(tmp_path / "mapped", ".mat", columns))
    assert (error.code, error.channel, error.value, error.expected) == (
        "lengths-differ",
        "pressure_free_pa",
        ROWS - 1,
        ROWS,
    )


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (np.full(ROWS, 1.0 + 1.0j), "complex"),
        (3.0, "a single value"),
        (np.zeros((0, 0)), "empty"),
        (np.zeros((ROWS, 2)), f"an array of {ROWS} x 2"),
        ({"value": np.zeros(ROWS)}, "a struct"),
    ],
)
def test_a_mat_variable_named_as_a_channel_is_not_passed_over(values, said, tmp_path):
    folder = make_mapped(tmp_path / "mapped", ".mat", foreign() | {"position_free_m": values})
    error = raised(Campaign.read, folder)
    assert (error.code, error.channel) == ("column-no-signal", "position_free_m")
    assert f"position_free_m is {said}, where" in error.message


def test_a_mat_file_without_time_is_refused(tmp_path):
    columns = foreign()
    del columns["t"]
    error = raised(Campaign.read, make_mapped(tmp_path / "mapped", ".mat", columns))
    assert (error.code, error.channel) == ("column-missing", "time_s")


def test_a_parquet_column_of_text_is_refused(tmp_path):
    import polars

    folder = make_mapped(tmp_path / "mapped", ".parquet")
    polars.DataFrame(foreign()).with_columns(pA=polars.lit("x")).write_parquet(folder / "run.parquet")
    error = raised(Campaign.read, folder)
    assert (error.code, error.column) == ("cell-not-a-number", "pA")


def test_instants_of_a_parquet_file_are_seconds_from_the_first(tmp_path):
    import polars

    folder = make_mapped(tmp_path / "mapped", ".parquet")
    frame = polars.DataFrame(foreign()).with_columns(
        t=polars.lit("2026-11-23").str.to_datetime() + polars.duration(milliseconds=polars.col("t") * 1e3)
    )
    assert frame["t"].dtype.is_temporal()
    frame.write_parquet(folder / "run.parquet")
    np.testing.assert_allclose(Campaign.read(folder)[0].time_s, signals()["time_s"], atol=1e-6)


@pytest.mark.parametrize("zone", ["", "+01:00", "Z"])
@pytest.mark.parametrize("between", [" ", "T"])
def test_instants_of_a_csv_file_are_seconds_from_the_first(tmp_path, between, zone):
    folder = make_mapped(tmp_path / "mapped", ".csv")
    time = signals()["time_s"]
    lines = (folder / "run.csv").read_text().splitlines()
    rows = [
        f"2026-11-23{between}09:59:{59 + t:09.6f}{zone},{line.partition(',')[2]}"
        if t < 0.99
        else f"2026-11-23{between}10:00:{t - 1:09.6f}{zone},{line.partition(',')[2]}"
        for t, line in zip(time, lines[1:], strict=True)
    ]
    (folder / "run.csv").write_text("\n".join([lines[0], *rows]) + "\n")
    np.testing.assert_allclose(Campaign.read(folder)[0].time_s, time, atol=1e-6)
    assert inspect(folder / "run.csv").duration_s == pytest.approx(time[-1])
    broken = "\n".join([lines[0], rows[0], "12.5" + rows[1][rows[1].index(",") :], *rows[2:]])
    (folder / "run.csv").write_text(broken + "\n")
    assert raised(Campaign.read, folder).code == "cell-not-a-number"


def test_a_missing_library_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "asammdf", None)
    error = raised(mdf4.read, Place("x.mf4", "x.mf4"), list)
    assert (error.code, error.extra, error.module) == ("extra-missing", "mdf", "asammdf")
    # By the library's own name: a checkout is no package of a registry.
    assert f"{sys.executable} -m pip install 'asammdf>=" in error.message


def test_formats_are_found_by_suffix_and_no_two_share_one():
    suffixes = [suffix for format in FORMATS for suffix in format.suffixes]
    assert len(set(suffixes)) == len(suffixes)
    assert format_of("A.MF4").name == "mdf4"
    error = raised(format_of, "a.xlsx")
    assert (error.code, error.value) == ("format-unknown", ".xlsx")
    assert all(suffix in error.message for suffix in suffixes)


def test_a_mixed_campaign_takes_each_file_by_its_suffix(tmp_path):
    folder = make_mapped(tmp_path / "mapped", ".csv")
    toml = folder / "campaign.toml"
    text = toml.read_text()
    _, _, entry = text.partition("[[recording]]")
    for suffix in SUFFIXES[1:]:
        other = make_mapped(tmp_path / f"mapped{suffix}", suffix)
        (other / f"run{suffix}").rename(folder / f"other_{suffix[1:]}{suffix}")
        text += "\n[[recording]]" + entry.replace("run.csv", f"other_{suffix[1:]}{suffix}")
    toml.write_text(text)
    first, *others = Campaign.read(folder)
    assert [found.format for found in others] == ["parquet", "mat", "mdf4"]
    for found in others:
        np.testing.assert_array_equal(found["pressure_free_pa"], first["pressure_free_pa"])


numbers = st.text("0123456789.eE+-naifINF_ \t", max_size=9)


@settings(deadline=None)
@given(cells=st.lists(st.tuples(numbers, numbers), min_size=1, max_size=4))
@example(cells=[("1e400", "-nan"), (" 1", "2 ")])
@example(cells=[("infinity", "+.5e+3")])
@example(cells=[("", "")])
def test_the_quick_reading_of_a_csv_file_is_the_careful_one_or_none(cells):
    text = "a,b\n" + "\n".join(",".join(row) for row in cells)
    place = Place("x.csv", "x.csv")
    quick = quickly(text.encode(), 2, [0, 1])
    try:
        careful, lines = carefully(text, ["a", "b"], [0, 1], place)
    except ForkliftError:
        assert quick is None
    else:
        assert list(lines) == list(range(2, 2 + careful.shape[1]))
        if quick is not None:
            np.testing.assert_array_equal(quick, careful)


@given(values=st.lists(st.floats(), min_size=1, max_size=50), digits=st.integers(1, 25))
@settings(deadline=None)
def test_numbers_are_read_correctly_rounded(values, digits):
    cells = [f"{value:.{digits}g}" for value in values]
    quick = quickly(("a\n" + "\n".join(cells) + "\n").encode(), 1, [0])
    assert quick is not None
    np.testing.assert_array_equal(quick[0], [float(cell) for cell in cells])


def test_the_csv_of_a_recording_is_what_the_standard_library_reads(tmp_path):
    folder = make(tmp_path / "small")
    found = Campaign.read(folder)[0]
    rows = list(stdlib_csv.reader(found.to_csv().splitlines()))
    assert rows[0] == ["time_s", *found.channels]
    assert [float(row[0]) for row in rows[1:]] == list(found.time_s)


READERS = """\
import os, time
from forklift.recordings.formats.signals import Signals


def read(place, choose):
    print("libraries print")
    if "crash" in place.file:
        os.abort()
    if "hang" in place.file:
        time.sleep(60)
    if "raise" in place.file:
        raise MemoryError("too much")
    if "exit" in place.file:
        raise SystemExit(3)
    return Signals({})
"""


@pytest.fixture
def readers(tmp_path, monkeypatch):
    """A module whose reader does what the file's name says, for the child process to load."""
    (tmp_path / "misbehaving_reader.py").write_text(READERS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(isolation, "LONGEST_S", 3.0)
    isolation.end()

    def read(name: str) -> Signals:
        (tmp_path / name).write_text("x")
        return isolation.read("misbehaving_reader", Place(name, str(tmp_path / name)), list)

    yield read
    isolation.end()


def test_a_library_that_crashes_hangs_or_exits_is_one_error(readers):
    assert readers("good.x") == Signals({})
    for name, cause in (
        ("crash.x", "crash"),
        ("hang.x", "no end"),
        ("raise.x", "MemoryError: too much"),
        ("exit.x", "SystemExit: 3"),
    ):
        error = raised(readers, name)
        assert error.code == "recording-unreadable"
        assert (error.file, cause in error.cause) == (name, True)
        assert readers("good.x") == Signals({})


def test_nothing_is_left_of_a_reader_s_temporary_files(readers):
    assert readers("good.x") == Signals({})
    folder = Path(isolation.folder())
    (folder / "left by a library").touch()
    raised(readers, "crash.x")
    assert not folder.exists()


def test_without_a_process_the_file_is_read_here(readers, monkeypatch, capsys):
    def refuse(*_, **__):
        raise OSError("no processes here")

    monkeypatch.setattr(isolation.subprocess, "Popen", refuse)
    assert readers("good.x") == Signals({})
    assert capsys.readouterr().out
    assert raised(readers, "raise.x").code == "recording-unreadable"


def test_an_interrupt_leaves_no_answer_for_the_next_file(readers, monkeypatch):
    def interrupt(_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(isolation.pickle, "load", interrupt)
        with pytest.raises(KeyboardInterrupt):
            readers("good.x")
    assert readers("good.x") == Signals({})


def test_a_damaged_file_is_told_in_one_sentence(tmp_path):
    for suffix in SUFFIXES[1:]:
        folder = make_mapped(tmp_path / f"of{suffix}", suffix)
        (folder / f"run{suffix}").write_bytes(os.urandom(300))
        error = raised(Campaign.read, folder)
        assert error.code == "recording-unreadable"
        assert error.message.startswith(f"run{suffix}: the file is damaged or is not ")
        assert "\n" not in error.message


def test_a_time_column_given_as_text_csv_of_another_locale_is_explained(tmp_path):
    folder = make(tmp_path / "small")
    text = csv_text(signals()).replace(",", ";").replace(".", ",")
    (folder / "free.csv").write_text(text)
    error = raised(Campaign.read, folder)
    assert (error.code, error.value, error.line) == ("separator-wrong", ";", 1)

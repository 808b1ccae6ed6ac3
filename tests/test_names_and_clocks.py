"""Files as loggers write them: instants of several clocks, absolute pressures, loads in names, rates."""

from datetime import datetime, timedelta

import numpy as np
import polars as pl
import pytest

from forklift import Campaign, convert
from forklift.base.errors import ForkliftError
from forklift.recordings import formats, units
from forklift.recordings.entered import of_name
from forklift.recordings.formats.signals import Everything, Place
from small_campaign import csv_text, foreign, make_mapped, raised, signals

NOON = datetime(2026, 3, 2, 12, 0, 0)


def instants(after_s):
    return [NOON + timedelta(seconds=after_s + k) for k in range(5)]


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize("choose", [Everything(), list])
def test_columns_of_instants_count_from_one_instant(tmp_path, suffix, choose):
    frame = pl.DataFrame({"late.time_s": instants(0.7), "time_s": instants(0.0), "x": np.arange(5.0)})
    path = tmp_path / f"run{suffix}"
    if suffix == ".csv":
        frame.write_csv(path, datetime_format="%Y-%m-%dT%H:%M:%S%.3f")
    else:
        frame.write_parquet(path)
    found, _ = formats.read(Place(path.name, str(path)), choose)
    np.testing.assert_allclose(found.series["time_s"].values, np.arange(5.0), atol=1e-9)
    np.testing.assert_allclose(found.series["late.time_s"].values, 0.7 + np.arange(5.0), atol=1e-9)
    np.testing.assert_allclose(found.series["x"].values, np.arange(5.0))


@pytest.mark.parametrize(
    ("unit", "to", "offset"),
    [("bar(a)", "Pa", -101325.0), ("bar(a)", "bar", -1.01325), ("kPa(a)", "kPa", -101.325),
     ("bar", "bara", 1.01325), ("psia", "psi", -14.6959), ("bara", "bara", 0.0)],
)  # fmt: skip
def test_an_absolute_pressure_has_one_atmosphere_more_in_whatever_unit(unit, to, offset):
    assert units.conversion(unit, to).offset == pytest.approx(offset, rel=1e-5)


@pytest.mark.parametrize(
    ("file", "load_kg"),
    [
        ("2024-05-01T12-30-00_free_800kg.mf4", 800.0),
        ("run_3t_free.csv", 3000.0),
        ("run_3t_free_800kg.csv", None),  # one of both is not the load
        ("free_800kg_again_800kg.csv", 800.0),
        ("main_1,5t_val.mat", 1500.0),
    ],
)
def test_a_load_is_a_number_with_a_unit_and_no_part_of_a_date(file, load_kg):
    assert of_name(file).load_kg == load_kg


def test_a_campaign_is_not_extended_at_another_rate_and_stays_as_it_was(tmp_path):
    for name in ("free_0kg.csv", "free_800kg.csv"):
        pl.DataFrame(signals()).write_csv(tmp_path / name)
    out = tmp_path / "campaign"
    convert(tmp_path / "free_0kg.csv", out)
    before = (out / "campaign.toml").read_bytes()
    with pytest.raises(ForkliftError) as caught:
        convert(tmp_path / "free_800kg.csv", out, extend=True, sample_rate_hz=100.0)
    assert caught.value.code == "sample-rate-mismatch"
    assert (out / "campaign.toml").read_bytes() == before
    assert len(Campaign.read(out).recordings) == 1


def test_a_mapping_is_proposed_or_given(tmp_path):
    pl.DataFrame(signals()).write_csv(tmp_path / "free_0kg.csv")
    with pytest.raises(ForkliftError) as caught:
        convert(tmp_path / "free_0kg.csv", tmp_path / "out", propose=True, channels={"x": "current_free_a"})
    assert caught.value.code == "option-not-wanted"


@pytest.mark.parametrize(("unit", "per_second"), [("ms", 1e3), ("µs", 1e6), ("s", 1.0)])
@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_column_of_times_is_in_the_unit_of_its_brackets(tmp_path, suffix, unit, per_second):
    columns = foreign()
    columns[f"t_p [{unit}]"] = columns["t"] * per_second
    folder = make_mapped(tmp_path / "mapped", suffix, columns)
    toml = folder / "campaign.toml"
    entry = f'"pressure_free_pa", time = "t_p [{unit}]",'
    toml.write_text(toml.read_text().replace('"pressure_free_pa",', entry), encoding="utf-8")
    own = Campaign.read(folder)[0].own("pressure_free_pa")
    np.testing.assert_allclose(own.time, columns["t"], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "times", "code"),
    [("t_p [bar]", 1.0, "unit-of-another-kind"), ("t_p", 1e12, "unit-wrong")],
)
def test_a_column_that_is_no_time_is_refused(tmp_path, name, times, code):
    columns = foreign()
    columns[name] = columns["t"] * times
    folder = make_mapped(tmp_path / "mapped", ".csv", columns)
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace('"pressure_free_pa",', f'"pressure_free_pa", time = "{name}",'))
    assert raised(Campaign.read, folder).code == code


def test_a_time_of_the_day_counts_from_the_first_and_a_date_of_another_age_is_no_damage(tmp_path):
    noon = [(NOON + timedelta(seconds=0.5 * k)).time() for k in range(3)]
    never = [datetime(1500, 1, 1), None, datetime(9999, 12, 31)]
    frame = pl.DataFrame({"clock": noon, "due": never, "day": [datetime(1500, 1, 1).date()] * 3})
    frame.with_columns(fine=pl.Series([0, 7, 14]).cast(pl.Duration("ns"))).write_parquet(
        tmp_path / "run.parquet"
    )
    found, _ = formats.read(Place("run.parquet", str(tmp_path / "run.parquet")), Everything())
    np.testing.assert_allclose(found.series["clock"].values, [0.0, 0.5, 1.0], atol=1e-9)
    np.testing.assert_array_equal(np.isnan(found.series["due"].values), [False, True, False])
    np.testing.assert_array_equal(found.series["day"].values, 0.0)
    np.testing.assert_allclose(found.series["fine"].values, [0.0, 7e-9, 14e-9])


@pytest.mark.parametrize(("asked", "near"), [(30.0, ("50 Hz", "25 Hz")), (80.0, ("50 Hz",))])
def test_a_rate_that_is_no_whole_part_of_the_recordings_is_refused_with_those_that_are(tmp_path, asked, near):
    pl.DataFrame(signals()).write_csv(tmp_path / "free_0kg.csv")
    error = raised(convert, tmp_path / "free_0kg.csv", tmp_path / "out", sample_rate_hz=asked)
    assert error.code == "sample-rate-mismatch"
    assert error.value == pytest.approx(50.0)
    assert all(one in error.message for one in near)


def test_a_channel_that_has_times_and_no_sample_is_named(tmp_path):
    columns = signals()
    columns["pressure_free_pa.time_s"] = columns["pressure_free_pa"] = columns["time_s"] * np.nan
    (tmp_path / "free_0kg.csv").write_text(csv_text(columns))
    error = raised(convert, tmp_path / "free_0kg.csv", tmp_path / "out")
    assert (error.code, error.channel) == ("recording-empty", "pressure_free_pa")

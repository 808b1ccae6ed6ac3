"""What a fit leaves behind: a folder that says what the fit says, readable by everything else."""

import html
import json
import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from plotly.offline import get_plotlyjs

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, commands, fit, simulate
from forklift.fitting.files import command
from forklift.fitting.fit_tables import PARAMETER_COLUMNS
from forklift.plant.forklift.tables import parameters
from forklift.report.tables import change_table, fit_tables, parameters_table, plain
from small_campaign import raised, snapshot

ROOMY_BYTES = 8_000_000
"""More than a page may weigh: a mail's attachment."""


@pytest.fixture(scope="module")
def folder(null_fit, tmp_path_factory):
    return null_fit.write(tmp_path_factory.mktemp("fit") / "fitted")


@pytest.fixture(scope="module")
def told(folder):
    return json.loads((folder / "fit.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def page(folder):
    """The page without the script of plotly."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert get_plotlyjs() in text
    return text.replace(get_plotlyjs(), "")


@pytest.fixture(scope="module")
def stopped():
    """A fit of the main lift, two parameters moving together, stopped at its third evaluation, and what was
    told on the way."""
    seen = []

    def stop(progress):
        seen.append(progress)
        if len(seen) == 3:
            raise KeyboardInterrupt

    campaign, thesis = Campaign.read(CAMPAIGNS / "leak"), Truck.read("thesis")
    pair = ["main.friction.sigma_1", "main.friction.sigma_2"]
    return fit(campaign, thesis, together=[pair], progress=stop), seen


def test_the_folder_holds_what_the_docstring_says(null_fit, folder):
    predictions = {f"predictions/baseline/{found.file}" for found in null_fit.recordings}
    assert set(snapshot(folder)) == predictions | {
        "truck.toml", "report.html", "fit.json", "fit.csv", "parameters.csv", "speed_table_free.csv",
    }  # fmt: skip


def test_the_truck_reads_back_and_simulates_the_same_to_the_bit(null_fit, folder):
    read = Truck.read(folder / "truck.toml")
    assert read.values == null_fit.truck.values
    assert read.sha256 == null_fit.truck.sha256
    prms = commands.generate("prms", "free", duration_s=3.0, seed=2)
    lowered = [
        simulate(truck, prms, load_kg=800.0, oil_temperature_degc=40.0) for truck in (null_fit.truck, read)
    ]
    for name in ("position_free_m", "pressure_free_pa"):
        assert np.array_equal(lowered[0][name], lowered[1][name])


def test_a_value_in_the_truck_says_its_interval_or_that_it_is_not_told(null_fit):
    sources = null_fit.truck.sources
    omega = next(found for found in null_fit.knowledge.estimates if found.name == "free.valve.omega")
    assert f"95 % interval {omega.lower:.6g} to {omega.upper:.6g}" in sources["free.valve.omega"]
    assert null_fit.origin.sha256[:12] in sources["free.valve.omega"]
    assert sources["free.viscosity.nu_0"].startswith("not identifiable from campaign")
    assert sources["main.valve.omega"] == null_fit.machine.truck.sources["main.valve.omega"]


def test_intervals_are_ordered_hold_the_value_and_keep_to_the_bounds(null_fit):
    table = null_fit.parameters
    assert dict(table.schema) == PARAMETER_COLUMNS
    for row in table.iter_rows(named=True):
        name = row["name"].rpartition(".")[0] if ".table_" in row["name"] else row["name"]
        spec = parameters()[name]
        assert spec["lower"] <= row["lower"] <= row["value"] <= row["upper"] <= spec["upper"], row
        assert row["start_lower"] <= row["start"] <= row["start_upper"], row
        assert row["unit"] == spec["unit"]
        assert 0.0 < row["alone"] <= row["deviation"] * (1.0 + 1e-9), row


def test_what_is_known_only_together_or_not_at_all_is_marked_so(null_fit):
    known = dict(zip(null_fit.parameters["name"], null_fit.parameters["told"], strict=True))
    assert known["free.valve.omega"] == "yes"
    assert known["free.viscosity.nu_0"] == known["free.compensator.Re_cr"] == "together"
    assert known["free.valve.table_area.7"] == "no"  # no recording opens the valve that far


def test_tables_on_disk_are_those_of_the_fit(null_fit, folder):
    for name, table in (("parameters", null_fit.parameters), ("fit", null_fit.fits)):
        read = pl.read_csv(folder / f"{name}.csv", schema=table.schema)
        assert read.equals(table), name


def test_fits_before_and_after_are_those_of_the_comparisons(null_fit):
    for when, comparison in (("before", null_fit.before), ("after", null_fit.after)):
        for name in ("file", "channel", "role", "unit"):
            assert null_fit.fits[name].to_list() == comparison.fits[name].to_list()
        assert null_fit.fits[f"rmse_{when}"].equals(comparison.fits["rmse"], check_names=False)


def test_predictions_on_disk_are_those_of_the_fitted_truck(null_fit, folder):
    first = null_fit.after.predictions[0]
    read = pl.read_csv(folder / "predictions" / "baseline" / first.recording.file)
    assert read["pressure_free_pa"].to_numpy() == pytest.approx(first.outputs["pressure_free_pa"])


def test_the_speed_table_is_the_fitted_trucks(folder):
    table = pl.read_csv(folder / "speed_table_free.csv")
    assert len(table) > 5
    currents = table[next(name for name in table.columns if name.startswith("current"))]
    assert (currents.diff().drop_nulls() >= 0.0).all()


def test_the_json_says_what_the_fit_says(null_fit, told):
    assert set(told) == {
        "schema", "forklift", "campaign", "start", "truck", "options", "command", "seconds", "evaluations",
        "interrupted", "complete", "verdict", "parameters", "known_only_together", "unidentifiable",
        "correlation",
        "sensors", "judged", "starts", "profiles", "cautions", "validation", "fits", "tables",
    }  # fmt: skip
    assert told == json.loads(json.dumps(null_fit.to_dict(), allow_nan=False))
    assert told["verdict"] == list(null_fit.sentences)
    assert told["complete"] is True
    assert told["interrupted"] is False
    assert told["truck"]["sha256"] == null_fit.truck.sha256
    assert len(told["judged"]) == len(null_fit.judged) == 14 * 5
    assert [row["name"] for row in told["parameters"]] == null_fit.parameters["name"].to_list()
    matrix = np.array(told["correlation"]["matrix"])
    assert matrix.shape == (len(null_fit.unknowns),) * 2
    assert matrix == pytest.approx(matrix.T)
    assert np.diag(matrix) == pytest.approx(1.0)


def test_the_command_in_the_json_repeats_the_fit(null_fit):
    again = replace(
        null_fit,
        options={
            **null_fit.options, "starts": 2, "hold": ["free.valve.omega"], "profiles": ["free.bulk.a_1"],
            "together": [["free.bulk.a_1", "free.cylinder.V_0"]],
        },
        machine=replace(null_fit.machine, load_width_kg=5.0),
    )  # fmt: skip
    assert command(again) == (
        f"forklift fit {null_fit.origin.folder} --truck thesis --starts 2 --profile free.bulk.a_1 "
        "--hold free.valve.omega --together free.bulk.a_1,free.cylinder.V_0 --load-width 5.0 --out fitted"
    )


def test_other_commands_are_told_without_what_only_a_fit_takes(null_fit):
    wide = replace(null_fit.machine, load_width_kg=5.0)
    assert null_fit.origin.command(wide, "diagnose") == null_fit.origin.command(null_fit.machine, "diagnose")
    assert "--load-width" in null_fit.origin.command(wide, "fit")


def test_tables_are_laid_out_as_the_thesis_lays_them_out(null_fit):
    said = "\n".join(map(plain, fit_tables(null_fit)))
    assert "Estimated parameters of the free lift, as Table 5.1" in said
    assert "Velocity of the free lift, as Table 5.4" in said
    assert "main lift" not in said
    told = null_fit.validation("velocity_free_m_s")
    assert told["role"].to_list() == ["validate"] * 6
    assert told["load_kg"].to_list() == [0.0, 800.0, 1500.0] * 2
    assert told["nrmse_percent_after"].min() > 97.0 > told["nrmse_percent_before"].max()
    first = told.row(0, named=True)
    assert f"{first['nrmse_percent_before']:.1f} → {first['nrmse_percent_after']:.1f}" in said


def test_what_is_left_over_is_counted_by_signal_and_role(null_fit):
    table = null_fit.signals
    row = table.row(by_predicate=(pl.col("channel") == "pressure_free_pa") & (pl.col("role") == "validate"),
                    named=True)  # fmt: skip
    seen = [
        found for found in null_fit.judged if (found.channel, found.role) == ("pressure_free_pa", "validate")
    ]
    assert (row["recordings"], row["explained"], row["tested"]) == (6, 6, 6)
    assert row["worst"] == max(found.mean_square for found in seen)
    assert row["mean_square"] == pytest.approx(
        sum(float(found.left @ found.left) for found in seen) / sum(found.samples for found in seen)
    )


def test_the_page_fetches_nothing_and_is_small_enough_to_send(folder, page):
    assert (folder / "report.html").stat().st_size < ROOMY_BYTES
    for fetching in ("http:", "https:", "<link", "src=", "@import", "url("):
        assert fetching not in page


def test_the_page_says_verdict_parameters_and_every_recording(null_fit, page):
    said = html.unescape(page)
    for sentence in null_fit.sentences:
        assert sentence in said
    for name in [*null_fit.parameters["name"], *(found.file for found in null_fit.recordings)]:
        assert name in said
    assert "as Table 5.4" in said
    for name in ("measured", "before", "after"):
        assert f'"{name}":[' in page
    assert (
        page.count('class="plot"') == 3
    )  # recordings to choose from, where the difference lies, correlations


def test_an_earlier_fit_is_replaced_and_nothing_else(null_fit, folder, tmp_path):
    out = null_fit.write(tmp_path / "fitted")
    (out / "truck.toml").unlink()
    null_fit.write(out)
    assert set(snapshot(out)) == set(snapshot(folder))
    (out / "notes.txt").write_text("mine")
    before = snapshot(out)
    assert raised(null_fit.write, out).code == "output-exists"
    assert snapshot(out) == before
    assert [path.name for path in tmp_path.iterdir()] == ["fitted"]


def test_a_profile_bounds_the_value_and_is_drawn(null_fit, tmp_path):
    name = "free.compensator.theta"  # carried on a scale that falls as it rises
    found = null_fit.profile(name)
    row = null_fit.parameters.row(by_predicate=pl.col("name") == name, named=True)
    assert found.rise.min() == 0.0
    assert found.values[int(np.argmin(found.rise))] == pytest.approx(row["value"])
    assert (np.diff(found.values) > 0.0).all()
    assert found.lower < row["value"] < found.upper
    assert found.lower == pytest.approx(row["lower"], rel=0.05)
    assert found.upper == pytest.approx(row["upper"], rel=0.05)
    out = replace(null_fit, profiles=(found,)).write(tmp_path / "fitted")
    written = json.loads((out / "fit.json").read_text(encoding="utf-8"))["profiles"][0]
    assert (written["name"], written["values"]) == (name, found.values.tolist())
    assert "95 % interval from the profile" in (out / "report.html").read_text(encoding="utf-8")


def test_a_profile_of_what_is_not_estimated_is_refused_with_a_hint(null_fit):
    error = raised(null_fit.profile, "free.bulk.a_9")
    assert error.code == "parameter-unknown"
    assert "did you mean free.bulk.a_" in error.message


def test_a_stopped_fit_keeps_the_best_so_far_and_says_so(stopped, tmp_path):
    found, seen = stopped
    assert found.interrupted
    assert found.sentences[0].startswith("Interrupted after 3 evaluations: this is the best truck so far")
    assert not any("no values" in sentence or "same place" in sentence for sentence in found.sentences)
    assert found.options["starts"] is None
    before, after = (
        side.validation("velocity_main_m_s")["nrmse_percent"].mean() for side in (found.before, found.after)
    )
    assert after > before
    assert [told.evaluation for told in seen] == [1, 2, 3]
    assert {(told.start, told.starts, told.stage) for told in seen} == {(0, 1, 1)}
    assert all(math.isfinite(told.cost) for told in seen)
    assert seen[-1].misfit < seen[0].misfit
    written = json.loads((found.write(tmp_path / "out") / "fit.json").read_text(encoding="utf-8"))
    assert written["interrupted"] is True


def test_what_moves_together_has_one_factor_and_an_interval_each(stopped):
    found, _ = stopped
    rows = {row["name"]: row for row in found.parameters.iter_rows(named=True)}
    first, second = (rows[f"main.friction.sigma_{k}"] for k in (1, 2))
    assert second["moves_with"] == first["name"]
    for end in ("value", "lower", "upper"):
        assert first[end] / first["start"] == pytest.approx(second[end] / second["start"])
    said = found.truck.sources[second["name"]]
    assert f"95 % interval {second['lower']:.6g} to {second['upper']:.6g}" in said


def test_the_main_lifts_tables_are_5_2_and_5_5(stopped):
    found, _ = stopped
    said = plain(parameters_table(found, "main")) + plain(change_table(found, "velocity_main_m_s"))
    assert "Estimated parameters of the main lift, as Table 5.2" in said
    assert "as Table 5.5" in said
    assert set(found.parameters["part"]) == {"main"}

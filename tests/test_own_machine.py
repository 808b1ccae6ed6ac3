"""A machine of one's own has the commands that a truck has: compare, fit and simulate, with one page each."""

import json

import polars as pl
import pytest

from forklift import compare, fit
from forklift.app import main as cli
from forklift.plant import campaign as own
from motor_bench import motor_bench
from pages import FETCHING, Text


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return motor_bench(tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def fitted(bench, tmp_path_factory):
    """The folder of a fit by the command."""
    out = tmp_path_factory.mktemp("fit") / "fitted"
    assert cli.run(["fit", str(bench), "--machine", str(bench / "motor.py"), "--out", str(out)]) == 0
    return out


def test_compare_replays_it_and_says_how_well_each_output_fits(bench, tmp_path, capsys):
    out = tmp_path / "out"
    call = ["compare", str(bench), "--machine", str(bench / "motor.py"), "--out", str(out)]
    assert cli.run(call) == 0
    assert "omega fits to" in capsys.readouterr().out
    told = json.loads((out / "compare.json").read_text(encoding="utf-8"))
    assert told["command"].startswith(f"forklift compare {bench} --machine")
    assert set(told["validation"]) <= {"omega", "current"}
    assert {row["channel"] for row in told["fits"]} == set(told["validation"])
    page = (out / "report.html").read_text(encoding="utf-8")
    said = Text(page)
    assert said.of("h2") == ["Measured and simulated", "Provenance"]
    assert "lift" not in said.everything.replace("forklift", "").lower()
    recordings = {path.name for path in bench.glob("*.csv")}
    assert {path.name for path in (out / "predictions" / "baseline").iterdir()} == recordings


def test_fit_estimates_it_and_no_worse_fit_comes_out(fitted, bench):
    told = json.loads((fitted / "fit.json").read_text(encoding="utf-8"))
    assert told["schema"] == 2
    for rows in told["validation"].values():
        assert all(row["nrmse_percent_after"] >= row["nrmse_percent_before"] - 0.1 for row in rows)
    for row in told["parameters"]:
        assert row["lower"] <= row["value"] <= row["upper"]
    assert told["complete"] is False  # the drag is missing
    assert told["tables"] == {}
    found = json.loads((fitted / "parameters.json").read_text(encoding="utf-8"))
    assert found["present"] == []
    assert {row["name"] for row in told["parameters"]} <= set(found["values"])
    said = Text((fitted / "report.html").read_text(encoding="utf-8"))
    assert said.of("h2") == ["Evidence", "Parameters", "Doubts", "Provenance"]
    assert "lift" not in said.everything.replace("forklift", "").lower()


def test_simulate_runs_it_with_what_was_fitted_through_the_inputs_of_a_file(fitted, bench, tmp_path):
    first = next(iter(sorted(bench.glob("*.csv"))))
    call = ["simulate", "--machine", str(bench / "motor.py"), "--command", str(first)]
    call += ["--values", str(fitted / "parameters.json"), "--out", str(tmp_path / "run.csv")]
    assert cli.run([*call, "--plot", str(tmp_path / "run.html")]) == 0
    run = pl.read_csv(tmp_path / "run.csv")
    plant = own.machine(bench / "motor.py")
    assert set(run.columns) >= {"time_s", *(one.name for one in plant.outputs)}
    page = (tmp_path / "run.html").read_text(encoding="utf-8")
    assert not FETCHING.search(page.split("plotly.js v")[0])


def test_python_takes_the_plant_and_its_folder_in_either_order(bench):
    plant = own.machine(bench / "motor.py")
    recordings = own.read(bench, plant)
    one, other = compare(plant, recordings), compare(recordings, plant)
    assert one.to_dict() == other.to_dict()
    held = [row.name for row in plant.params if not row.known][1:]
    found = fit(plant, recordings, hold=held, starts=1)
    assert set(found.values) == {row.name for row in plant.params if not row.known} - set(held)
    assert found.truck.name == found.title


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (["compare", "BENCH", "--machine", "no.py", "--out", "x"], "there is no file no.py"),
        (["fit", "BENCH", "--machine", "MOTOR", "--out", "x", "--hold", "speed"], "has no parameter speed"),
        (["fit", "BENCH", "--machine", "MOTOR", "--out", "x", "--load-width", "5"], "is a truck's"),
        (["simulate", "--machine", "MOTOR"], "name by --command a file with the inputs"),
        (["simulate", "--machine", "MOTOR", "--command", "CSV", "--values", "MOTOR"], "no parameters.json"),
        (["simulate", "--load", "5"], "missing option --temperature"),
        (["simulate", "--machine", "MOTOR", "--command", "CSV", "--load", "5"], "--load is of a truck"),
        (
            ["simulate", "--machine", "MOTOR", "--command", "CSV", "--truck", "thesis"],
            "--truck is of a truck",
        ),
        (["simulate", "--machine", "MOTOR", "--command", "CSV", "--seed", "1"], "--seed is of a truck"),
        (["compare", "BENCH", "--machine", "MOTOR", "--truck", "thesis"], "--truck is of a truck"),
        (["diagnose", "BENCH", "--machine", "MOTOR", "--truck", "mine.toml", "--out", "x"], "--truck is of"),
        (
            ["fit", "BENCH", "--machine", "MOTOR", "--truck", "mine.toml", "--out", "x"],
            "--truck is of a truck",
        ),
        (["info", "thesis", "--write", "x.toml"], "--write is of a log"),
        (["info", "--dbc", "x.dbc"], "--dbc is of a log"),
        (["simulate", "--load", "5", "--temperature", "40", "--values", "MOTOR"], "name it by --machine"),
    ],
)
def test_what_is_wrong_is_told_in_one_sentence(bench, capsys, call, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    places = {"BENCH": bench, "MOTOR": bench / "motor.py", "CSV": next(bench.glob("*.csv"))}
    assert cli.run([str(places.get(word, word)) for word in call]) == cli.REFUSED
    said = capsys.readouterr().err
    assert code in said
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []

"""`forklift fit`: what it prints and leaves, what Ctrl-C keeps, and what is refused at once."""

import json
import os
import shutil
import subprocess
import sys

import pytest

import forklift
from campaigns import CAMPAIGNS
from forklift import Truck
from forklift.app import main as cli
from small_campaign import snapshot

NULL = str(CAMPAIGNS / "null")

STOPPED = """
import signal
from forklift.app import main as cli
from importlib import import_module

module = import_module({module!r})
real, count = module.{name}, 0

def counted(*arguments, **options):
    global count
    count += 1
    if count == {at}:
        signal.raise_signal(signal.{signal})
    return real(*arguments, **options)

module.{name} = counted
cli.main({arguments!r})
"""
"""A command line that presses Ctrl-C itself when a function is called for the so-manieth time."""


def called(capfd, *arguments: object) -> tuple[int, str, str]:
    """Exit status, stdout and stderr of ``forklift fit`` within this process."""
    status = cli.run(["fit", *map(str, arguments)])
    told = capfd.readouterr()
    return status, told.out, told.err


def stopped(
    tmp_path, module: str, name: str, at: int, *options: str, by: str = "SIGINT"
) -> subprocess.CompletedProcess[str]:
    script = STOPPED.format(
        module=module,
        name=name,
        at=at,
        signal=by,
        arguments=["fit", NULL, "--out", str(tmp_path / "out"), *options],
    )
    call = [sys.executable, "-c", script]
    return subprocess.run(call, capture_output=True, text=True, check=False, timeout=120)


@pytest.fixture
def fitted(monkeypatch, null_fit):
    """The verb gives the shared fit; what it was called with."""
    options = {}

    def verb(machine, recordings, **given):
        options.update(given)
        return null_fit

    monkeypatch.setattr(forklift, "fit", verb)
    return options


def test_it_prints_verdict_and_tables_and_says_what_it_wrote(capfd, tmp_path, null_fit, fitted):
    out = tmp_path / "out"
    status, told, err = called(capfd, NULL, "--out", out)
    assert (status, err) == (0, "")
    assert told.startswith("\n".join(null_fit.sentences))
    for title in ("as Table 5.1", "as Table 5.4", "What is left over"):
        assert title in told
    assert told.endswith(
        "".join(f"Written: {out / name}\n" for name in ("report.html", "truck.toml", "fit.json"))
    )


def test_options_reach_the_verb(capfd, tmp_path, fitted):
    called(
        capfd, NULL, "--out", tmp_path / "out", "--hold", "free.valve.omega", "--hold", "free.bulk.a_1",
        "--also", "free.volume.E", "--together", "free.bulk.a_2,free.bulk.a_3", "--starts", 4,
        "--profile", "free.cylinder.V_0", "--load-width", 7.5, "--temperature", 31, "--seed", 9,
    )  # fmt: skip
    assert fitted.pop("progress") is None  # no terminal
    assert fitted == {
        "hold": ["free.valve.omega", "free.bulk.a_1"],
        "also": ["free.volume.E"],
        "together": [["free.bulk.a_2", "free.bulk.a_3"]],
        "starts": 4,
        "profiles": ["free.cylinder.V_0"],
        "load_width_kg": 7.5,
        "oil_temperature_degc": 31.0,
        "seed": 9,
    }


def test_json_is_all_that_is_printed_and_what_is_written(capfd, tmp_path, fitted):
    status, told, err = called(capfd, NULL, "--out", tmp_path / "out", "--json")
    assert (status, err) == (0, "")
    assert json.loads(told) == json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf-8"))


def test_the_fitted_truck_is_read_by_every_command(capfd, tmp_path, null_fit):
    truck = null_fit.truck.write(tmp_path / "truck.toml")
    for call in (
        ["info", truck],
        ["compare", NULL, "--truck", truck],
        ["simulate", "--truck", truck, "--load", "0", "--temperature", "40", "--duration", "2"],
    ):
        assert cli.run([*map(str, call)]) == 0
    assert "campaign fitted from thesis" in capfd.readouterr().out


@pytest.mark.skipif(os.name == "nt", reason="sends signals to a process")
@pytest.mark.parametrize(("by", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_stop_in_the_search_writes_the_best_so_far_and_says_so(tmp_path, by, status):
    done = stopped(tmp_path, "forklift.fitting.levenberg_marquardt", "cost", 3, "--json", by=by)
    out = tmp_path / "out"
    assert done.returncode == status, done.stderr
    assert done.stderr == f"forklift: interrupted; the best truck so far is in {out}.\n"
    told = json.loads(done.stdout)
    assert told["interrupted"] is True
    assert told["verdict"][0].startswith("Interrupted after ")
    assert told == json.loads((out / "fit.json").read_text(encoding="utf-8"))
    assert Truck.read(out / "truck.toml").sha256 == told["truck"]["sha256"] != told["start"]["sha256"]
    assert len(snapshot(out)) == 6 + 14
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT to a process")
@pytest.mark.parametrize(
    ("module", "name"),
    [("forklift.plant.forklift.checks.suitability", "faults"), ("forklift.fitting.search", "temper")],
)
def test_ctrl_c_before_the_first_evaluation_leaves_nothing(tmp_path, module, name):
    done = stopped(tmp_path, module, name, 1)
    assert done.returncode == cli.INTERRUPTED
    assert done.stderr == "forklift: interrupted; nothing was left half-written.\n"
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--hold", "free.nonsense"], "there is no parameter free.nonsense"),
        (["--also", "free.nonsense"], "there is no parameter free.nonsense"),
        (["--also", "free.valve.table_current"], "did you mean free.valve.table_current."),
        (["--together", "free.bulk.a_1"], "together has a group of free.bulk.a_1"),
        (["--together", "free.bulk.a_1,free.nonsense"], "there is no parameter free.nonsense"),
        (["--together", "free.bulk.a_1,main.bulk.a_1"], "main.bulk.a_1 is not estimated"),
        (["--together", "free.bulk.a_1,free.compensator.theta"], "their scales differ"),
        (["--together", "free.bulk.a_1,free.bulk.a_1"], "in two groups"),
        (["--profile", "free.bulk.a_9"], "did you mean free.bulk.a_"),
        (["--profile", "main.bulk.a_1"], "main.bulk.a_1 is not estimated"),
        (["--starts", "0"], "--starts"),
        (["--load-width", "-1"], "-1 kg"),
        (["--load-width", "nan"], "nan kg"),
        (["--temperature", "900"], "900 °C"),
        (["--truck", "nobody"], "nobody"),
    ],
)
def test_a_bad_call_is_refused_in_one_sentence_and_writes_nothing(capfd, tmp_path, options, said):
    status, out, err = called(capfd, NULL, "--out", tmp_path / "out", *options)
    assert (status, out) == (cli.REFUSED, "")
    assert err.startswith("forklift: ")
    assert said in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_holds_other_things_is_refused_before_the_fit(capfd, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    status, _, err = called(capfd, NULL, "--out", tmp_path)
    assert status == cli.REFUSED
    assert "notes.txt" in err
    assert snapshot(tmp_path) == {"notes.txt": b"mine"}


def test_a_campaign_that_cannot_support_a_fit_is_refused(capfd, tmp_path):
    campaign = tmp_path / "campaign"
    shutil.copytree(NULL, campaign)
    told = campaign / "campaign.toml"
    told.write_text(told.read_text().replace('"estimate"', '"validate"'))
    status, out, err = called(capfd, campaign, "--out", tmp_path / "out")
    assert (status, out) == (cli.REFUSED, "")
    assert "may be fitted on" in err
    assert [path.name for path in tmp_path.iterdir()] == ["campaign"]


def test_everything_held_is_refused(capfd, tmp_path, null_fit):
    held = [word for name in null_fit.parameters["name"] for word in ("--hold", name)]
    status, _, err = called(capfd, NULL, "--out", tmp_path / "out", *held)
    assert status == cli.REFUSED
    assert "every parameter is held" in err
    assert list(tmp_path.iterdir()) == []

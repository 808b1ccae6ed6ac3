"""The command line: results on stdout, one sentence on stderr and exit status 2, never a traceback."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import polars as pl
import pytest

from campaigns import CAMPAIGNS
from forklift import Truck, commands
from forklift.app import main as cli
from forklift.app.demo import RECORDINGS
from forklift.plant.forklift.truck import SHIPPED

COMMANDS = ("simulate", "compare", "fit", "info", "convert", "demo")


def called(capfd, *arguments: object) -> tuple[int, str, str]:
    """Exit status, stdout and stderr of a call within this process."""
    status = cli.run([str(argument) for argument in arguments])
    told = capfd.readouterr()
    return status, told.out, told.err


def refused(capfd, *arguments: object, code: str = r" \[[a-z0-9-]+\]") -> str:
    """The one sentence with which a call is refused, and its code."""
    status, out, err = called(capfd, *arguments)
    assert status == cli.REFUSED, (status, err)
    assert out == ""
    assert err.startswith("forklift: ")
    assert re.search(rf"[.?]{code}\n$", err), err
    assert err.count("\n") == 1
    assert "Traceback" not in err
    return err


@pytest.fixture(scope="module")
def demo(tmp_path_factory) -> Path:
    """A demonstration's folder."""
    out = tmp_path_factory.mktemp("cli") / "demo"
    assert cli.run(["demo", str(out)]) == 0
    return out


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example(capfd, command):
    status, out, _ = called(capfd, command, "--help")
    assert status == 0
    assert f"Example: forklift {command}" in " ".join(out.replace("│", " ").split())


def test_version_and_help(capfd):
    status, out, _ = called(capfd, "--version")
    assert (status, out.split()[0]) == (0, "forklift")
    status, out, _ = called(capfd, "--help")
    assert status == 0
    assert all(command in out for command in COMMANDS)


def test_simulate_writes_a_table_and_a_page(capfd, tmp_path):
    out, page = tmp_path / "lowering.parquet", tmp_path / "lowering.html"
    status, told, _ = called(
        capfd, "simulate", "--lift", "free", "--load", 800, "--temperature", 40, "--seed", 3,
        "--duration", 5, "--out", out, "--plot", page,
    )  # fmt: skip
    assert status == 0
    assert "velocity_free_m_s" in told
    assert "pressure_main_pa" not in told
    assert len(pl.read_parquet(out)) == 250
    assert "plotly.js v" in page.read_text(encoding="utf-8")


def test_simulate_takes_a_command_from_a_file(capfd, tmp_path):
    command = commands.generate("staircase", "both", duration_s=4.0)
    path = command.write(tmp_path / "command.csv")
    status, out, _ = called(
        capfd, "simulate", "--load", 0, "--temperature", 20, "--command", path, "--json",
        "--out", tmp_path / "lowering.csv", "--states", "--solver", "fixed", "--substeps", 4,
    )  # fmt: skip
    assert status == 0
    assert json.loads(out)["samples"] == 200
    table = pl.read_csv(tmp_path / "lowering.csv", infer_schema_length=None)
    assert table["current_main_a"].to_list() == command.current_main_a.tolist()
    assert "main.cylinder_pressure" in table.columns


def test_the_same_seed_gives_the_same_lowering(capfd):
    call = ("simulate", "--load", 800, "--temperature", 40, "--duration", 4, "--json")
    first, again, other = (called(capfd, *call, "--seed", seed)[1] for seed in (1, 1, 2))
    assert first == again != other


def test_demo_makes_a_campaign_that_compare_and_info_read(capfd, demo, tmp_path):
    assert {path.name for path in demo.iterdir()} == {"campaign", "compare", "found", "truth.toml"}
    status, out, _ = called(
        capfd, "compare", demo / "campaign", "--truck", "thesis", "--out", tmp_path / "out"
    )
    assert status == 0
    assert out.startswith("The velocity of the free lift fits to ")
    assert "as Table 5.5" in out
    written = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert written == json.loads((demo / "compare" / "compare.json").read_text())
    status, out, _ = called(capfd, "info", demo / "campaign", "--json")
    assert len(json.loads(out)["recordings"]) == len(RECORDINGS)
    status, out, _ = called(capfd, "info", demo / "campaign")
    assert RECORDINGS[0].file in out


def test_the_recorded_truck_explains_the_demonstration(capfd, demo):
    status, out, _ = called(capfd, "compare", demo / "campaign", "--truck", demo / "truth.toml", "--json")
    assert status == 0
    rows = [row for row in json.loads(out)["fits"] if row["channel"].startswith("velocity")]
    assert min(row["nrmse_percent"] for row in rows) > 92


def test_demo_replaces_only_a_demonstration(capfd, demo, tmp_path):
    assert called(capfd, "demo", demo)[0] == 0
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    assert "letter.txt" in refused(capfd, "demo", tmp_path / "mine")
    mine = demo / "campaign" / "mine.csv"
    mine.write_text("time_s")
    assert "campaign/mine.csv" in refused(capfd, "demo", demo)
    mine.unlink()


def test_info_tells_of_trucks_effects_and_parameters(capfd):
    status, out, _ = called(capfd, "info")
    assert status == 0
    assert "mast_coupling.factor" in out
    assert "viscosity.nu_0" in out
    assert "[free]" in out
    about = json.loads(called(capfd, "info", "--json")[1])
    assert about["trucks"] == ["thesis"]
    truck = json.loads(called(capfd, "info", "thesis", "--json")[1])
    assert truck["parameters"]["free.gravity.g"]["value"] == 9.82
    assert "Table 5.1" in called(capfd, "info", SHIPPED / "thesis.toml")[1]


def test_convert_makes_a_plain_campaign(capfd, demo, tmp_path):
    source = demo / "campaign" / RECORDINGS[0].file
    table = pl.read_csv(source, infer_schema_length=None)
    foreign = table.rename({"current_free_a": "Valve"}).with_columns(pl.col("Valve") * 1000)
    foreign.write_csv(tmp_path / "day1.csv")
    status, out, err = called(
        capfd, "convert", tmp_path / "day1.csv", "--lift", "free", "--load", 0, "--out", tmp_path / "plain",
        "--channel", "Valve=current_free_a,0.001", "--json",
    )  # fmt: skip
    assert status == 0, err
    assert json.loads(out)["recordings"][0]["load_kg"] == 0
    assert called(capfd, "compare", tmp_path / "plain")[0] == 0


def test_every_wrong_call_is_one_sentence_and_status_2(capfd, demo, tmp_path):
    simulate = ("simulate", "--load", 800, "--temperature", 40)
    wrong = {
        "nothing": (),
        "an unknown command": ("lower",),
        "an unknown option": ("compare", demo / "campaign", "--trick", "thesis"),
        "a missing option": ("simulate", "--load", 800),
        "a word for a number": ("simulate", "--load", "heavy", "--temperature", 40),
        "an unknown lift": (*simulate, "--lift", "side"),
        "a negative load": ("simulate", "--load", -5, "--temperature", 40),
        "a load that is no number": ("simulate", "--load", "nan", "--temperature", 40),
        "boiling oil": ("simulate", "--load", 800, "--temperature", 400),
        "a tolerance of nothing": (*simulate, "--tolerance", 0),
        "too short a run": (*simulate, "--duration", 0),
        "an endless run": (*simulate, "--duration", "inf"),
        "a run of eleven days": (*simulate, "--duration", 1e6),
        "a run that no memory holds": (*simulate, "--duration", 1e12),
        "substeps of the adaptive solver": (*simulate, "--substeps", 4),
        "a tolerance of the fixed solver": (*simulate, "--solver", "fixed", "--tolerance", 1e-4),
        "a page that is none": (*simulate, "--plot", tmp_path / "a.png"),
        "a page in no folder": (*simulate, "--out", tmp_path / "a.csv", "--plot", tmp_path / "no" / "a.html"),
        "an output without a name": (*simulate, "--out", ""),
        "a result without a name": ("compare", demo / "campaign", "--out", ""),
        "an output below a file": (*simulate, "--out", demo / "truth.toml" / "a.csv"),
        "a temperature that is no number": ("compare", demo / "campaign", "--temperature", "nan"),
        "an impossible temperature": ("compare", demo / "campaign", "--temperature", -400),
        "an unknown command file": (*simulate, "--command", tmp_path / "none.csv"),
        "a folder for a command": (*simulate, "--command", tmp_path),
        "a huge seed": (*simulate, "--seed", 2**80),
        "an unknown format": (*simulate, "--out", tmp_path / "a.xlsx"),
        "an output in no folder": (*simulate, "--out", tmp_path / "no" / "a.csv"),
        "an output that is a folder": (*simulate, "--plot", tmp_path),
        "an unknown truck": ("compare", demo / "campaign", "--truck", "thesiss"),
        "no campaign": ("compare", tmp_path / "none"),
        "a folder without campaign.toml": ("compare", tmp_path),
        "an output that holds something else": ("compare", demo / "campaign", "--out", demo / "campaign"),
        "an output that is a file": ("compare", demo / "campaign", "--out", demo / "truth.toml"),
        "information on nothing": ("info", "nothing"),
        "a channel that says nothing": (
            "convert", demo / "campaign" / RECORDINGS[0].file, "--out", tmp_path / "c", "--channel", "Valve",
        ),
        "a conversion with a load that the campaign tells": (
            "convert", demo / "campaign", "--load", 800, "--out", tmp_path / "c",
        ),
        "a table that is not there": (
            "convert", demo / "campaign" / RECORDINGS[0].file, "--table", tmp_path / "no.csv",
            "--out", tmp_path / "c",
        ),
        "a lowering under a controller to an unknown format": (
            "control", "simulate", "thesis", "--load", 0, "--temperature", 20, "--out", tmp_path / "a.txt",
        ),
        "controllers side by side where something else stands": (
            "control", "compare", "thesis", "--out", demo / "campaign",
        ),
    }  # fmt: skip
    for what, arguments in wrong.items():
        if what != "nothing":
            assert refused(capfd, *arguments), what
    assert called(capfd)[0] == cli.REFUSED
    assert [path.name for path in tmp_path.iterdir()] == []


def test_an_unwritable_place_is_told_apart(capfd, tmp_path):
    call = ("simulate", "--load", 800, "--temperature", 40, "--duration", 2, "--out")
    (tmp_path / "file").write_text("")
    assert "file is a file, not a folder" in refused(capfd, *call, tmp_path / "file" / "a.csv")
    assert "does not exist; make it first" in refused(capfd, *call, tmp_path / "no" / "a.csv")
    assert "is empty" in refused(capfd, *call, "")
    assert "error" not in refused(capfd, *call, tmp_path / f"{'a' * 245}.parquet")


def test_a_question_ends_with_its_own_mark(capfd, tmp_path):
    path = Truck.read("thesis").write(tmp_path / "mine.toml")
    path.write_text(path.read_text() + '[mast_coupling]\nfactr = { value = 1.0, source = "a slip" }\n')
    status, _, err = called(capfd, "info", path)
    assert status == cli.REFUSED
    assert err.endswith("did you mean mast_coupling.factor? [parameter-unknown]\n")


def test_a_recording_of_an_unknown_format_is_told_the_known_ones(capfd, tmp_path):
    path = tmp_path / "day1.xlsx"
    path.write_text("")
    assert ".mf4" in refused(capfd, "convert", path, "--out", tmp_path / "plain")


def test_commands_alone_say_why_no_velocity_can_be_judged(capfd, demo, tmp_path):
    table = pl.read_csv(demo / "campaign" / RECORDINGS[0].file, infer_schema_length=None)
    table.select("time_s", "current_free_a", "current_main_a", "oil_temperature_degc").write_csv(
        tmp_path / "bare.csv"
    )
    call = ("convert", tmp_path / "bare.csv", "--lift", "free", "--load", 0, "--out", tmp_path / "plain")
    assert called(capfd, *call)[0] == 0
    status, out, _ = called(capfd, "compare", tmp_path / "plain", "--out", tmp_path / "out")
    assert status == 0
    assert out.startswith("The free lift: no velocity can be judged: no recording of it has fork_height_m")
    assert "no velocity can be judged" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_a_broken_truck_file_is_told_with_file_and_line(capfd, demo, tmp_path):
    path = Truck.read("thesis").write(tmp_path / "mine.toml")
    path.write_text(path.read_text().replace("9.82", "-9.82", 1))
    sentence = refused(capfd, "compare", demo / "campaign", "--truck", path)
    assert f"{path}, line " in sentence
    assert "-9.82" in sentence
    assert "9.9" in sentence


def test_a_broken_recording_is_told_and_nothing_written(capfd, demo, tmp_path):
    campaign = tmp_path / "campaign"
    campaign.mkdir()
    for path in (demo / "campaign").iterdir():
        (campaign / path.name).write_bytes(path.read_bytes())
    broken = campaign / RECORDINGS[2].file
    broken.write_text(broken.read_text().replace("\n1.0,", "\none,", 1))
    sentence = refused(capfd, "compare", campaign, "--out", tmp_path / "out")
    assert f"{RECORDINGS[2].file}, line 52" in sentence
    assert [path.name for path in tmp_path.iterdir()] == ["campaign"]


def test_an_unforeseen_mistake_is_one_sentence_too(capfd, demo, monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("forklift.recordings.campaign.Campaign.read", broken)
    assert "ZeroDivisionError" in refused(capfd, "compare", demo / "campaign", code="")


def test_a_closed_pipe_is_no_traceback(demo):
    reader, writer = os.pipe()
    os.close(reader)
    call = [sys.executable, "-m", "forklift", "info"]
    done = subprocess.run(call, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert done.stderr == ""
    assert done.returncode == 1


@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT to a process")
def test_ctrl_c_ends_with_130_and_one_sentence_and_leaves_nothing(tmp_path):
    call = [
        sys.executable, "-m", "forklift", "simulate", "--load", "800", "--temperature", "40",
        "--duration", "3600", "--solver", "fixed", "--substeps", "1000", "--out", str(tmp_path / "long.csv"),
    ]  # fmt: skip
    process = subprocess.Popen(call, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    time.sleep(2.5)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert process.returncode == cli.INTERRUPTED, err
    assert err == "forklift: interrupted; nothing was left half-written.\n"
    assert out == ""
    assert list(tmp_path.iterdir()) == []


def test_importing_forklift_loads_nothing_heavy():
    script = (
        "import sys, forklift; print(*(set(sys.modules) & {'numpy', 'polars', 'xarray', 'plotly', 'typer'}))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_a_diagnosis_loads_no_part_of_scipy_that_takes_longer_than_all_others():
    heavy = "{'scipy.stats', 'scipy.signal', 'plotly', 'xarray', 'asammdf'}"
    script = f"import sys, forklift.app.main, forklift.diagnosis.files; print(*(set(sys.modules) & {heavy}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_every_name_of_the_package_is_there_and_stays_the_verb():
    script = (
        "import forklift\n"
        "assert all(getattr(forklift, name) is not None for name in forklift.__all__)\n"
        "assert callable(forklift.simulate) and callable(forklift.compare) and callable(forklift.convert)\n"
        "assert set(forklift.__all__) <= set(dir(forklift))\n"
        "from forklift import Campaign, Recording, Truck, ForkliftError, commands\n"
        "from forklift import compare, convert, simulate\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_compare_takes_less_than_5_s_with_start_up(tmp_path):
    """The first requirement of a tool that is called in a loop. Counted on the processor: other tests run
    beside it."""
    campaign = CAMPAIGNS / "null"
    call = [sys.executable, "-m", "forklift", "compare", str(campaign), "--out", str(tmp_path / "out")]
    before = os.times()
    subprocess.run(call, check=True, capture_output=True)
    after = os.times()
    assert after.children_user + after.children_system - before.children_user - before.children_system < 5.0


@pytest.mark.parametrize(
    "given",
    [
        ("--score-open", "open", "--sensitivity"),
        ("--answers", "answers.json"),
        ("--sensitivity", "--keep"),
        *(
            ("--score-open", "open", *one)
            for one in (("--seed", 1), ("--campaigns", 20), ("--jobs", 1), ("--keep",))
        ),
    ],
)
def test_options_of_a_proof_that_contradict_each_other_are_refused(capfd, tmp_path, given):
    assert refused(capfd, "prove", "--out", tmp_path / "proof", *given, code=r" \[option-not-wanted\]")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "given",
    [
        ("--command", RECORDINGS[0].file, "--seed", 2),
        ("--command", RECORDINGS[0].file, "--duration", 2),
        ("--states",),
    ],
)
def test_options_of_a_simulation_that_have_no_meaning_are_refused(capfd, demo, monkeypatch, given):
    monkeypatch.chdir(demo / "campaign")
    call = ("simulate", "--load", 800, "--temperature", 40, *given)
    assert refused(capfd, *call, code=r" \[option-not-wanted\]")

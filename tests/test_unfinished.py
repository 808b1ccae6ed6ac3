"""A diagnosis that is interrupted answers at once, and made again it goes on to the same bytes."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from forklift.diagnosis import files
from forklift.diagnosis.diagnose import diagnose
from forklift.plant.campaign import machine, read
from motor_bench import motor_bench
from small_campaign import raised

pytestmark = pytest.mark.skipif(os.name == "nt", reason="sends signals to a process")

MOMENTS = ("Fitting the model", "Locating the mismatch", "trial 1 of", "trial 2 of", "Testing what is left")
"""What the command says when it is interrupted, one call after the other."""
ANSWERED_S = 2.0


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Path:
    """The tutorial's motor and its recordings."""
    return motor_bench(tmp_path_factory.mktemp("bench"))


def command(bench: Path, out: Path) -> subprocess.Popen[str]:
    call = [sys.executable, "-m", "forklift", "diagnose", str(bench), "--machine", str(bench / "motor.py")]
    return subprocess.Popen(
        [*call, "--out", str(out)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def interrupted(process: subprocess.Popen[str], moment: str, number: int) -> tuple[float, str]:
    """Seconds until the command that said this has ended, and its last line.

    Counted on the processor: other tests run beside it.
    """
    assert process.stderr is not None
    before = os.times()
    for line in process.stderr:
        if moment in line:
            break
    else:
        raise AssertionError(f"ended before it said {moment}")
    time.sleep(0.1)
    spent = psutil.Process(process.pid).cpu_times()
    process.send_signal(number)
    told = process.communicate(timeout=20)[1]
    after = os.times()
    whole = after.children_user + after.children_system - before.children_user - before.children_system
    return whole - spent.user - spent.system, told.splitlines()[-1]


@pytest.fixture(scope="module")
def whole(bench, tmp_path_factory) -> tuple[Path, str]:
    """A diagnosis that was left alone, and what it said of how far it was."""
    out = tmp_path_factory.mktemp("whole") / "found"
    process = command(bench, out)
    told = process.communicate(timeout=120)[1]
    assert process.returncode == 0, told
    return out, told


def test_in_a_pipe_it_says_which_trial_of_how_many_and_what_is_left(whole):
    lines = whole[1].splitlines()
    assert lines[0] == "Fitting the model"
    trials = [line for line in lines if "trial" in line]
    assert trials
    for number, line in enumerate(trials, 1):
        assert f"trial {number} of " in line
        assert line.endswith(" left)")
    assert len(lines) == len(set(lines))


def test_ctrl_c_at_five_moments_and_the_same_bytes_in_the_end(bench, whole, tmp_path):
    out = tmp_path / "found"
    kept = 0
    for moment in MOMENTS:
        process = command(bench, out)
        seconds, last = interrupted(process, moment, signal.SIGINT)
        assert process.returncode == 130, last
        assert seconds < ANSWERED_S, moment
        assert last.startswith("forklift: interrupted; ")
        assert last.endswith(".")
        files = [path for path in out.rglob("*") if path.is_file()]
        assert all(path.parent.name == "unfinished" for path in files)
        if files:
            assert str(out / "unfinished") in last
        assert len(files) >= kept, "what was computed is never lost"
        kept = len(files)
    assert kept > 5
    process = command(bench, out)
    told = process.communicate(timeout=120)[1]
    assert process.returncode == 0, told
    names = {path.relative_to(whole[0]) for path in whole[0].rglob("*")}
    assert {path.relative_to(out) for path in out.rglob("*")} == names
    for name in names - {Path("times.json"), Path("report.html")}:
        if (out / name).is_file():
            assert (out / name).read_bytes() == (whole[0] / name).read_bytes(), name


def test_sigterm_keeps_the_work_too(bench, tmp_path):
    process = command(bench, tmp_path / "found")
    seconds, last = interrupted(process, "Locating the mismatch", signal.SIGTERM)
    assert process.returncode == 128 + signal.SIGTERM, last
    assert seconds < ANSWERED_S
    assert "goes on from there" in last


def test_only_its_own_work_may_stand_in_the_folder(tmp_path):
    work = tmp_path / "found" / "unfinished"
    work.mkdir(parents=True)
    for name in ("of.json", "0000.json", "0001.json", ".0002.json.123.tmp"):
        (work / name).write_text("{}")
    assert files.check(tmp_path / "found") == (tmp_path / "found").resolve()
    (work / "letter.txt").write_text("dear")
    error = raised(files.check, tmp_path / "found")
    assert error.code == "output-exists"
    assert "unfinished/letter.txt" in error.message
    (work / "letter.txt").unlink()
    (tmp_path / "found" / "letter.txt").write_text("dear")
    assert raised(files.check, tmp_path / "found").code == "output-exists"


def test_work_of_another_input_is_replaced(bench, whole, tmp_path):
    out = tmp_path / "found"
    process = command(bench, out)
    interrupted(process, "Locating the mismatch", signal.SIGINT)
    of = out / "unfinished" / "of.json"
    before = json.loads(of.read_text())
    plant = machine(bench / "motor.py")
    asked = []

    class Enough(Exception):
        pass

    def progress(now):
        asked.append(str(now))
        if len(asked) > 1:
            raise Enough

    with pytest.raises(Enough):
        diagnose(plant, read(bench, plant).recordings[:3], out=out, progress=progress)
    assert json.loads(of.read_text()) != before


@pytest.mark.parametrize(
    ("first", "ends"),
    [
        pytest.param("from forklift import _core", "done", id="before"),
        pytest.param("pass", "KeyboardInterrupt", id="while"),
    ],
)
def test_ctrl_c_while_numpy_is_looked_up_is_an_interrupt_and_no_panic(first, ends):
    """What looks NumPy's version up is interrupted: after the module was imported nobody asks any more."""
    script = f"""
import numpy.lib
{first}
def interrupted(*given):
    raise KeyboardInterrupt
numpy.lib.NumpyVersion = interrupted
from forklift import _core
_core.quantise_current(numpy.zeros(3))
print("done")
"""
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (ended.stdout + ended.stderr).splitlines()[-1] == ends
    assert "panic" not in ended.stderr.lower()

"""The processes that diagnose for a proof: none outlives it, none that was ended counts as an answer."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from forklift.ensemble.proof import prove
from forklift.ensemble.proof.processes import Processes


@pytest.mark.parametrize("status", [130, 143, -15])
def test_a_diagnosis_that_someone_ended_is_no_answer(monkeypatch, tmp_path, status):
    """It is diagnosed again by the next call, as after a kill."""
    monkeypatch.setattr(Processes, "run", lambda *_, **__: (status, "forklift: interrupted"))
    with pytest.raises(KeyboardInterrupt):
        prove.diagnosed(tmp_path, tmp_path / "found", None, 1, 10.0)


def test_no_diagnosis_outlives_the_proof_that_is_told_to_stop(tmp_path):
    """Nor is one begun after that."""
    processes, script = Processes(), "import time; open('here', 'w').close(); time.sleep(600)"

    def run():
        return processes.run([sys.executable, "-c", script], cwd=tmp_path, environment={}, limit_s=600.0)

    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(run)
        while not (tmp_path / "here").exists() and not running.done():
            time.sleep(0.05)
        processes.end()
        status, _ = running.result(timeout=60.0)
    assert status == -signal.SIGTERM
    with pytest.raises(KeyboardInterrupt):
        run()


def test_a_diagnosis_beyond_its_time_is_killed(tmp_path):
    with pytest.raises(subprocess.TimeoutExpired):
        Processes().run(
            [sys.executable, "-c", "import time; time.sleep(600)"], cwd=tmp_path, environment={}, limit_s=1.0
        )


@pytest.mark.parametrize(("status", "verdict"), [(2, "refused"), (None, "timeout")])
def test_an_earlier_diagnosis_in_the_folder_is_no_answer(monkeypatch, tmp_path, status, verdict):
    def run(*_, **__):
        if status is None:
            raise subprocess.TimeoutExpired("forklift", 10.0)
        return status, "forklift: refused"

    monkeypatch.setattr(Processes, "run", run)
    (tmp_path / "found").mkdir()
    (tmp_path / "found" / "diagnosis.json").write_text('{"verdict": "no-mismatch"}')
    told = prove.diagnosed(tmp_path, tmp_path / "found", None, 1, 10.0)
    assert (told["verdict"], told["causes"]) == (verdict, [])

"""What docs/tutorial.md and README.md tell a reader to do works, and prints what they say it prints."""

import contextlib
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(bash|python|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def bash(block: str, folder: Path) -> str:
    """What a block of shell commands prints, with the programs of the Python that runs the tests."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["bash", "-euc", block],
        cwd=folder,
        env=os.environ | {"PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{block}\nsaid: {done.stderr}"
    return done.stdout


def python(block: str, names: dict[str, object]) -> str:
    """What a block of Python prints."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        exec(compile(block, "page", "exec"), names)
    return out.getvalue()


def missing(expected: str, printed: str) -> str | None:
    """The first expected line that is not printed, in this order; lines between may be left out."""
    lines = iter(line.rstrip() for line in printed.splitlines())
    return next((line for line in expected.splitlines() if line.rstrip() not in lines), None)


@pytest.mark.parametrize("page", ["docs/tutorial.md", "docs/fitting.md", "README.md"])
def test_every_block_of_a_page_runs_and_prints_what_the_page_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")  # as in a checkout
    names: dict[str, object] = {}
    printed = ""
    blocks = BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))
    assert {kind for kind, _ in blocks} >= {"bash", "python"}
    for kind, block in blocks:
        if kind == "bash":
            printed = bash(block, tmp_path)
        elif kind == "python":
            printed = python(block, names)
        else:
            line = missing(block, printed)
            assert line is None, f"{page} says {line!r}, but this is printed:\n{printed}"

"""Campaigns made in a process of their own, so that several are made at once.

    python -m forklift.ensemble.proof.apart < ORDER > MADE

Both are pickled, and each is read by the process alone that asked or was asked.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

from forklift.ensemble.proof.conceal import Made, conceal
from forklift.ensemble.proof.draw import Draw

STOPPED = 130
"""Status of a process that Ctrl-C ended."""


def conceal_apart(given: Draw, folder: Path, *, judge_hidden: bool) -> Made:
    """As `forklift.ensemble.proof.conceal.conceal`.

    Raises
    ------
    KeyboardInterrupt
        If Ctrl-C reached the other process.
    RuntimeError
        If it failed, with what it said.
    """
    ran = subprocess.run(
        [sys.executable, "-m", __name__],
        input=pickle.dumps((given, folder, judge_hidden)),
        capture_output=True,
        check=False,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )
    if ran.returncode == STOPPED:
        raise KeyboardInterrupt
    if ran.returncode:
        raise RuntimeError(
            f"campaign {given.number} of {given.seed} was not made: {ran.stderr.decode()[-3000:]}"
        )
    made = pickle.loads(ran.stdout)
    assert isinstance(made, Made)
    return made


def main() -> None:
    """Make the campaign that stands in the standard input, and tell it in the standard output."""
    given, folder, judge_hidden = pickle.load(sys.stdin.buffer)
    try:
        made = conceal(given, folder, judge_hidden=judge_hidden)
    except KeyboardInterrupt:
        sys.exit(STOPPED)
    sys.stdout.buffer.write(pickle.dumps(made))


if __name__ == "__main__":
    main()

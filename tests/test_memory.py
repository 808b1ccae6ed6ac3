"""Memory that the command line frees stays with it: pages are not fetched from the system again."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

ASKED = """
import resource, sys
import numpy as np
from forklift.base.memory import keep_freed
if sys.argv[1] == "kept":
    assert keep_freed()
for k in range(20):
    slopes = [np.ones(600_000) for recording in range(14)]  # 67 MB, as of 14 recordings
    del slopes
    if k == 9:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(how: str) -> int:
    """Pages fetched in ten rounds, when ten are over."""
    done = subprocess.run([sys.executable, "-c", ASKED, how], capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="what is asked is glibc's")
def test_pages_of_freed_blocks_are_used_again() -> None:
    assert faults("kept") < 0.1 * faults("given back")

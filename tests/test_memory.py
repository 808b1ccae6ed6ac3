"""Memory that the command line frees stays with it, and Python looks through it seldom."""

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


LOOKED = """
import gc, sys
from forklift.base.memory import collect_seldom
if sys.argv[1] == "seldom":
    collect_seldom()
living = [[k] for k in range(400_000)]  # as many objects as the libraries have
loops = []
for k in range(100_000):
    loops = [loops[-1:]]
    loops.append(loops)
print(sum(of["collections"] for of in gc.get_stats()), sum(of["collected"] for of in gc.get_stats()))
"""


def test_objects_are_looked_through_seldom_and_what_refers_to_itself_still_goes() -> None:
    def looked(how: str) -> tuple[int, int]:
        ran = subprocess.run([sys.executable, "-c", LOOKED, how], capture_output=True, text=True, check=True)
        looks, collected = map(int, ran.stdout.split())
        return looks, collected

    (often, all_of_them), (seldom, most) = looked("often"), looked("seldom")
    assert 0 < seldom < often / 5  # Pythons of other years look less often by themselves
    assert most > 0.5 * all_of_them

"""Memory that is freed stays with the process, and what refers to itself is looked for seldom.

Runs with slopes take and give back megabytes each. Left to itself glibc returns them to the system, which has
to clear every page before it hands it out again.

Python looks for objects that keep each other alive whenever some hundreds more live than before, and now and
then through all there are: with the libraries loaded that is some hundred thousand, though a diagnosis leaves
hardly any behind.
"""

from __future__ import annotations

import ctypes
import gc
import sys

TRIM_THRESHOLD, TOP_PAD, MMAP_THRESHOLD = -1, -2, -3
"""What glibc's mallopt(3) calls M_TRIM_THRESHOLD, M_TOP_PAD and M_MMAP_THRESHOLD."""
LARGEST = 32 << 20
"""Bytes of a block beyond which it is given back at once: the greatest that mallopt takes."""
KEPT = 1 << 30
"""Bytes that may lie idle at the heap's end."""
AT_ONCE = 64 << 20
"""Bytes by which the heap grows."""
SELDOM = (50_000, 20, 100)
"""How many more objects live before Python looks through the youngest; how many such looks make one at those
that outlived one, and how many of these one at all. CPython 3.11's own are 700, 10 and 10."""


def keep_freed() -> bool:
    """Ask the C library for that; whether it does so.

    Nothing happens where it is not glibc. The command line calls this; a program that imports `forklift` has
    its memory to itself.
    """
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return False
    settings = ((MMAP_THRESHOLD, LARGEST), (TRIM_THRESHOLD, KEPT), (TOP_PAD, AT_ONCE))
    return all([mallopt(which, size) == 1 for which, size in settings])


def collect_seldom() -> None:
    """Look for objects that keep each other alive as `SELDOM` has it. The command line calls this, too."""
    gc.set_threshold(*SELDOM)

"""A digest of values and functions is equal for what computes the same."""

import subprocess
import sys
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

from forklift import Truck
from forklift.base.fingerprint import fingerprint

LEVEL = 3.0
SCRIPT = """
from dataclasses import dataclass
import numpy as np
from forklift.base.fingerprint import fingerprint
LEVEL = {level}
def inner(x):
    return LEVEL * x
def outer(x, gain=2.0):
    return [inner(each) for each in x] if gain else {{"a", "b"}}
print(fingerprint(outer, [1, 2.5, None, "a"], {{"b": 1, "a": np.arange(3.0)}}))
"""


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("np.int64(3)", "np.int64(4)"),
        ("frozenset({1})", "frozenset({2})"),
        ("Pair(1)", "Pair(2)"),
        ("abs", "len"),
    ],
)
def test_a_function_has_another_if_what_it_refers_to_differs(one, other):
    start = "@dataclass\nclass Pair:\n    one: object\n" if one.startswith("Pair") else ""
    scripts = [SCRIPT.format(level=value).replace("LEVEL =", f"{start}LEVEL =") for value in (one, other)]
    first, second = (
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
        for script in scripts
    )
    assert first != second


def made(level: str) -> str:
    script = SCRIPT.format(level=level)
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout


def test_it_is_the_same_in_another_process_and_knows_what_a_function_refers_to():
    assert made("3.0") == made("3.0") != made("3.1")


@dataclass
class Pair:
    first: object
    second: object


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1.0, 1.0 + 2.0**-52),
        (np.zeros(3), np.zeros((3, 1))),
        (np.zeros(3), np.zeros(3, np.float32)),
        ({"a": 1}, {"a": 2}),
        (Pair(1, 2), Pair(2, 1)),
        (lambda x: x + 1, lambda x: x + 2),
        (lambda x: x.min(), lambda x: x.max()),
        (lambda x, *, gain=1.0: gain * x, lambda x, *, gain=2.0: gain * x),
        (partial(pow, 2), partial(pow, 3)),
        (partial(pow, 2), partial(pow, exp=2)),
        (float, int),
        (Truck.read("thesis"), Truck.read("thesis").with_values({"free.gravity.g": 9.81}, source="x")),
    ],
)
def test_what_differs_has_another(one, other):
    assert fingerprint(one) == fingerprint(one)
    assert fingerprint(one) != fingerprint(other)


def test_what_holds_itself_ends():
    inside: list[object] = []
    inside.append(inside)
    assert fingerprint(inside)

"""A digest of values and functions is equal for what computes the same."""

import importlib
import subprocess
import sys
import threading
from collections import deque
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

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


class Table:
    """A law in a table, as somebody's machine has it."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def out(self, x: float) -> float:
        return self.factor * x


class Slotted:
    __slots__ = ("factor",)

    def __init__(self, factor: float) -> None:
        self.factor = factor


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (Table(1.0), Table(2.0)),
        (Table(1.0).out, Table(2.0).out),
        (Slotted(1.0), Slotted(2.0)),
        (np.poly1d([1.0, 2.0]), np.poly1d([1.0, 3.0])),
        (partial(np.poly1d([1.0, 2.0]), 1.0), partial(np.poly1d([1.0, 3.0]), 1.0)),
        (CubicSpline([0.0, 1.0, 2.0], [0.0, 1.0, 4.0]), CubicSpline([0.0, 1.0, 2.0], [0.0, 1.0, 5.0])),
        (deque([1.0, 2.0]), deque([1.0, 3.0])),
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


LAW = """
from functools import lru_cache
class Law:
    share = {share}
    @property
    def size(self):
        return {size}
    @staticmethod
    def turned(x):
        return {sign}x
    def __call__(self, x):
        return self.size * x
@lru_cache
def kept(x):
    return {sign}x
law = Law()
def rhs(x):
    return {used}
"""


@pytest.mark.parametrize("used", ["law(x)", "Law()(x)", "law.turned(x)"])
def test_the_code_of_a_class_counts(used):
    def made(**changed):
        names: dict[str, object] = {"__name__": "machine"}
        exec(LAW.format(**{"share": 1.0, "size": 2.0, "sign": "+", "used": used, **changed}), names)
        return fingerprint(names["rhs"])

    assert made() == made()
    assert len({made(), made(share=1.5), made(size=3.0), made(sign="-")}) == 4


def test_a_function_that_remembers_its_answers_is_taken_by_its_code():
    first, second, third = {}, {}, {}
    for names, sign in ((first, "+"), (second, "-"), (third, "+")):
        exec(LAW.format(share=1.0, size=2.0, sign=sign, used="kept(x)"), names)
    one, other, same = (fingerprint(names["rhs"]) for names in (first, second, third))
    assert one == same != other


def test_a_module_that_is_not_installed_counts_with_its_file(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    found = []
    for factor in (1.0, 1.0, 2.0):
        (tmp_path / "laws_of_a_test.py").write_text(f"def law(x):\n    return {factor} * x\n")
        sys.modules.pop("laws_of_a_test", None)
        importlib.invalidate_caches()
        laws = importlib.import_module("laws_of_a_test")
        found.append(fingerprint(lambda x, laws=laws: laws.law(x)))
    assert found[0] == found[1] != found[2]


def test_an_object_has_the_same_in_another_process():
    script = LAW.format(share=1.0, size=2.0, sign="+", used="law(x) + kept(x) + np.sin(x)")
    script += "import numpy as np\nfrom forklift.base.fingerprint import fingerprint\n"
    script += "print(fingerprint(rhs, law.turned, np.poly1d([1.0, 2.0]), np.sin, len))"
    first, second = (
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert first == second


def test_what_cannot_be_told_is_equal_to_nothing():
    lock = threading.Lock()
    assert fingerprint(lock) != fingerprint(lock)


def test_what_holds_itself_ends():
    inside: list[object] = []
    inside.append(inside)
    assert fingerprint(inside)

"""The plan of the house: rooms, the arrows between them, and no circle of files.

Every import counts, inside functions and for type checking too.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "python" / "forklift"

ARROWS = {
    "base": (),
    "recordings": ("base",),
    "plant": ("base", "recordings"),
    "fitting": ("base", "recordings", "plant"),
    "diagnosis": ("base", "recordings", "plant", "fitting"),
    "control": ("base", "recordings", "plant", "fitting"),
    "ensemble": ("base", "recordings", "plant", "fitting", "diagnosis", "control"),
    "report": ("base", "recordings", "plant", "fitting", "diagnosis", "control", "ensemble"),
    "app": ("base", "recordings", "plant", "fitting", "diagnosis", "control", "ensemble", "report"),
}
"""By room, from the ground up: the rooms it may import from."""

BLIND = ("fitting", "diagnosis", "report")
"""Rooms that know no forklift: they import nothing of `forklift.plant.forklift`."""


@cache
def modules() -> dict[str, Path]:
    """Every module of the package by its dotted name, without the package's own."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        if name and name != "__main__":
            found[name] = path
    return found


@cache
def imports(name: str) -> frozenset[str]:
    """The modules of the package that a module imports, wherever the import stands."""
    seen = set()
    for node in ast.walk(ast.parse(modules()[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            seen |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{name} has a relative import"
            home = node.module or ""
            inner = {f"{home}.{alias.name}" for alias in node.names}
            # The package's own file runs too.
            seen |= {one for one in inner if one.removeprefix("forklift.") in modules()} | {home}
    own = {one.removeprefix("forklift.") for one in seen if one.startswith("forklift.")}
    return frozenset(own & set(modules()))


def room(name: str) -> str:
    return name.partition(".")[0]


def against_the_plan() -> set[tuple[str, str]]:
    found = set()
    for name in modules():
        for other in imports(name):
            upward = room(other) != room(name) and room(other) not in ARROWS[room(name)]
            seeing = room(name) in BLIND and other.startswith("plant.forklift")
            if upward or seeing:
                found.add((name, other))
    return found


def circles() -> list[set[str]]:
    """Sets of files each of which reaches all others by imports (Tarjan 1972)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in imports(name):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            ring = set()
            while name not in ring:
                ring.add(stack.pop())
            if len(ring) > 1:
                found.append(ring)

    for name in modules():
        if name not in index:
            visit(name)
    return found


def test_there_are_nine_rooms_or_fewer_and_each_is_in_the_plan():
    rooms = {room(name) for name in modules()}
    assert rooms <= set(ARROWS)
    assert len(ARROWS) <= 9


def test_arrows_go_down_only():
    assert against_the_plan() == set()


def test_no_circle_of_files():
    assert circles() == []


OF_A_MACHINE = re.compile(r"truck|(?<!fork)lift|tank|seal|hydraul|cylinder|valve|oil", re.IGNORECASE)
ENGINE = sorted(name for name in modules() if room(name) in ("fitting", "diagnosis"))
"""What knows no machine already: its words must not come back."""


@pytest.mark.parametrize("name", ENGINE)
def test_the_engine_knows_no_machine(name):
    """No name and no compared word of one; words in comments are free."""
    for node in ast.walk(ast.parse(modules()[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Compare):
            words = [one.value for one in ast.walk(node) if isinstance(one, ast.Constant)]
            assert not [word for word in words if isinstance(word, str) and OF_A_MACHINE.search(word)]
        if isinstance(node, ast.Name | ast.Attribute | ast.arg):
            word = getattr(node, "id", None) or getattr(node, "attr", None) or getattr(node, "arg", "")
            assert not OF_A_MACHINE.search(word), word


TREE = Path(__file__).parents[1]
OUTSIDE = sorted(path for room in ("tests", "proofs", "benches") for path in (TREE / room).rglob("*.py"))
"""What uses the package as its users do."""


BY_WORD = re.compile(r"(attr|patch|patch\.object|attrgetter|import_module)$")
"""Functions that are given a name as a word."""
DOTTED = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")


def private(name: str) -> bool:
    """Whether any part of a dotted name is private. `forklift._core` is the core's public face."""
    parts = name.removeprefix("forklift._core").split(".")
    return any(part.startswith("_") and not part.endswith("__") for part in parts)


def names_of_others(tree: ast.AST) -> Iterator[str]:
    """Every name in a file that it took from elsewhere: imported, read from an object, or patched."""
    mine = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    mine |= {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and own(node.value)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module != "__future__":
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Attribute) and not (own(node.value) and node.attr in mine):
            yield node.attr
        elif isinstance(node, ast.Call) and BY_WORD.search(ast.unparse(node.func)):
            words = [one.value for one in node.args if isinstance(one, ast.Constant)]
            yield from (word for word in words if isinstance(word, str) and DOTTED.fullmatch(word))


def own(node: ast.AST) -> bool:
    """Whether it is the object of the method that is looked at."""
    return isinstance(node, ast.Name) and node.id in ("self", "cls")


@pytest.mark.parametrize("path", OUTSIDE, ids=[str(path.relative_to(TREE)) for path in OUTSIDE])
def test_nothing_outside_uses_a_private_name(path):
    found = names_of_others(ast.parse(path.read_text(encoding="utf-8")))
    assert [name for name in found if private(name)] == []


@pytest.mark.parametrize(
    "line",
    [
        "from forklift.base.present import _load",
        "import forklift._hidden",
        "forklift._core._hidden",
        "result._repr_html_()",
        "patch('forklift.base.present._load', None)",
        "patched.setattr(present, '_load', None)",
        "class Mine:\n    def see(self):\n        return self._of_its_parent",
    ],
)
def test_a_private_name_is_seen(line):
    assert any(private(name) for name in names_of_others(ast.parse(line)))


@pytest.mark.parametrize(
    "line",
    [
        "from forklift import _core",
        "result.__class__",
        "class Mine:\n    def __init__(self):\n        self._mine = 1\n        print(self._mine)",
    ],
)
def test_what_is_public_or_its_own_is_not(line):
    assert not any(private(name) for name in names_of_others(ast.parse(line)))

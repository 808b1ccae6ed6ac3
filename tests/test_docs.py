"""The documentation says what the source says."""

import ast
import re
from pathlib import Path
from typing import get_args

from forklift.diagnosis.engine import Verdict
from forklift.diagnosis.ledger import Untold
from forklift.plant.forklift.effects import Equation

ROOT = Path(__file__).parents[1]
PYTHON = sorted((ROOT / "python" / "forklift").rglob("*.py"))
CODE = re.compile(r"[a-z]+(-[a-z]+)+")

OTHER_WORDS = {
    "utf-8-sig",
    "export-c",
    "for-truck",
    *get_args(Equation),
    *get_args(Verdict),
    *get_args(Untold),
}
"""Hyphenated strings in the source that are no error codes."""


def documented() -> list[str]:
    page = (ROOT / "docs" / "errors.md").read_text(encoding="utf-8")
    return re.findall(r"^\| `([a-z-]+)` \|", page, re.MULTILINE)


def of_rust() -> set[str]:
    source = (ROOT / "crates" / "hydro_core" / "src" / "error.rs").read_text(encoding="utf-8")
    return set(re.findall(r'Error::\w+ \{ \.\. \} => "([a-z-]+)"', source))


def of_python() -> set[str]:
    """Every string that is hyphenated like a code, and every code that a docstring names.

    Codes reach the exception by more than one way, some put together from two words.
    """
    texts = {
        node.value
        for path in PYTHON
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    plain = {text for text in texts if CODE.fullmatch(text)}
    named = {code for text in texts for code in re.findall(r'``"([a-z-]+)"``', text) if CODE.fullmatch(code)}
    return (plain | named) - OTHER_WORDS


def test_every_error_code_of_the_source_is_documented_and_no_other():
    assert set(documented()) == of_rust() | of_python()


def test_no_error_code_is_documented_twice():
    assert len(documented()) == len(set(documented()))


def test_every_file_that_the_pages_name_exists():
    found = 0
    for page in [*(ROOT / "docs").glob("*.md"), ROOT / "README.md", ROOT / "ARCHITECTURE.md"]:
        text = page.read_text(encoding="utf-8").replace("docs/_build/html", "")  # made from these pages
        for name in re.findall(r"`((?:crates|python|tests|docs|benches|proofs|examples)/[\w./-]+)`", text):
            assert (ROOT / name).exists(), f"{page.name} names {name}"
            found += 1
    assert found > 50


def test_the_tables_that_pages_take_or_point_to_have_rows():
    tables = [ROOT / "proofs" / "variations.md", *sorted((ROOT / "benches").glob("*.md"))]
    assert len(tables) > 4
    for path in tables:
        rows = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
        assert len(rows) > 2, path.name


def test_the_interface_page_has_whatever_the_package_offers_and_every_command_is_in_the_readme():
    import forklift
    from forklift.app.main import app

    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    module, shown = "", set()
    for line in text.splitlines():
        if current := re.match(r"\.\. (currentmodule|automodule):: ([\w.]+)$", line):
            module = current[2]
        elif named := re.match(r"\.\. auto(?:class|function):: ([\w.]+)$", line):
            shown.add(named[1] if named[1].startswith("forklift.") else f"{module}.{named[1]}")
        elif members := re.match(r"   :members: (.+)$", line):
            shown |= {f"{module}.{name}" for name in members[1].split(", ")}
        elif line == "   :members:" and module == "forklift.plant.forklift.commands":
            shown.add(f"{module}.Command")
    offered = {
        getattr(forklift, name) for name in forklift.__all__ if name not in ("__version__", "commands")
    }
    assert {f"{one.__module__}.{one.__name__}" for one in offered} <= shown
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    commands = {one.name or one.callback.__name__ for one in app.registered_commands}
    groups = {one.name or one.typer_instance.info.name for one in app.registered_groups}
    assert {name for name in commands | groups if f"forklift {name}" not in readme} == set()


def test_every_option_of_every_command_stands_on_a_page():
    import typer.main

    from forklift.app.main import app

    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    shown = set(re.findall(r"--[a-z][a-z-]*", " ".join(page.read_text(encoding="utf-8") for page in pages)))
    groups, options = [typer.main.get_command(app)], set()
    while groups:
        for name, command in groups.pop().commands.items():
            if hasattr(command, "commands"):
                groups.append(command)
            options |= {
                f"{name} {one}" for each in command.params for one in each.opts if one.startswith("--")
            }
    assert len(options) > 50
    assert {option for option in options if option.split()[1] not in shown} == set()

"""What is wrong in a sweep's, a controller's or a machine's file is told in the words of whoever wrote it."""

from __future__ import annotations

from pathlib import Path

import pytest

from forklift.base.errors import ForkliftError
from forklift.control.controller import Controller
from forklift.ensemble import specification
from test_sweep import document


@pytest.mark.parametrize(
    ("change", "code", "name", "said"),
    [
        ({"membres": 3}, "key-unknown", "membres", "did you mean members?"),
        (
            {"vary": {"load_kg": {"uniform": [1.0]}}},
            "value-invalid",
            "vary.load_kg.uniform",
            "has 1 value; add",
        ),
        ({"vary": {"load_kg": {"unifrom": [1.0, 2.0]}}}, "key-unknown", "vary.load_kg.unifrom", "uniform?"),
        ({"members": "many"}, "value-invalid", "members", "'many'; write a number"),
        ({"lifts": "third"}, "value-invalid", "lifts", "'third'; write 'both', 'free' or 'main'"),
        ({"profile": 3}, "value-invalid", "profile", "3; write a list in brackets"),
        ({"name": 3}, "value-invalid", "name", "3; write text in quotes"),
    ],
)
def test_a_sweeps_file(change: dict, code: str, name: str, said: str) -> None:
    with pytest.raises(ForkliftError) as told:
        specification.check(document(**change), "mine.toml")
    assert (told.value.code, told.value.facts["name"]) == (code, name)
    assert told.value.message.startswith("mine.toml: ")
    assert said in told.value.message


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("[shared", "[shard", "the key shared is missing"),
        ("word = ", "wrod = ", "there is no key wrod (did you mean word?)"),
        ("word = 16", 'word = "16"', "word is '16'; write a number"),
    ],
)
def test_a_controllers_file(tmp_path: Path, before: str, after: str, said: str) -> None:
    path = tmp_path / "mine.toml"
    Controller.read("thesis").write(path)
    text = path.read_text(encoding="utf-8")
    assert before in text
    path.write_text(text.replace(before, after), encoding="utf-8")
    with pytest.raises(ForkliftError) as told:
        Controller.read(path)
    assert told.value.code == "controller-malformed"
    assert said in told.value.message

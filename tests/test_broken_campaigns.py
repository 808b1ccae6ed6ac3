"""Every mistake in a campaign is one sentence with a stable code and its facts, and nothing is written."""

from __future__ import annotations

import json
import pickle
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from forklift import Campaign, convert
from forklift.recordings.channels import table
from small_campaign import MAPPED, ROWS, TOML, csv_text, foreign, make, make_mapped, raised, signals, snapshot

MAKERS = {"plain": make, "csv": lambda folder: make_mapped(folder, ".csv")}


@dataclass(frozen=True)
class Broken:
    """What breaks a campaign, and what is said of it."""

    name: str
    code: str
    damage: Callable[[Path], object]
    facts: dict[str, Any] = field(default_factory=dict)
    says: tuple[str, ...] = ()
    made: str = "plain"


def toml(*changes: tuple[str, str]) -> Callable[[Path], None]:
    """Replace text in campaign.toml, once each."""

    def damage(folder: Path) -> None:
        text = (folder / "campaign.toml").read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        (folder / "campaign.toml").write_text(text)

    return damage


def column(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Path], None]:
    """Change a column of free.csv."""

    def damage(folder: Path) -> None:
        columns = signals()
        columns[name] = change(columns[name])
        (folder / "free.csv").write_text(csv_text(columns))

    return damage


def lines(change: Callable[[list[str]], list[str]], file: str = "free.csv") -> Callable[[Path], None]:
    """Change the lines of free.csv."""

    def damage(folder: Path) -> None:
        (folder / file).write_text("\n".join(change((folder / file).read_text().splitlines())) + "\n")

    return damage


def cell(line: int, name: str, text: str) -> Callable[[Path], None]:
    """Write `text` into a cell of free.csv; the header is line 1."""

    def change(rows: list[str]) -> list[str]:
        cells = rows[line - 1].split(",")
        cells[rows[0].split(",").index(name)] = text
        return [*rows[: line - 1], ",".join(cells), *rows[line:]]

    return lines(change)


def header(old: str, new: str) -> Callable[[Path], None]:
    return lines(lambda rows: [rows[0].replace(old, new), *rows[1:]])


def at(*places: int, by: float) -> Callable[[np.ndarray], np.ndarray]:
    """Add `by` to everything from each place on."""

    def change(values: np.ndarray) -> np.ndarray:
        for place in places:
            values = np.concatenate([values[:place], values[place:] + by])
        return values

    return change


def put(index: int, value: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: np.concatenate([values[:index], [value], values[index + 1 :]])


def raw(data: bytes, file: str = "free.csv") -> Callable[[Path], object]:
    return lambda folder: (folder / file).write_bytes(data)


TOO_LONG = f'name = "{"x" * 10}"\n' + "load_kg = " + "9" * 5000
C = "campaign.toml"
F = "free.csv"

BROKEN = [
    # the folder and its campaign.toml
    Broken("no campaign.toml", "campaign-file-missing", lambda f: (f / C).unlink(), says=("holds no", C)),
    Broken(
        "not TOML",
        "campaign-syntax",
        toml(("load_kg = 0.0", "load_kg =")),
        {"file": C, "line": 7},
        ("not TOML",),
    ),
    Broken("key given twice", "campaign-syntax", toml(('lift = "free"', 'file = "x.csv"')), {"line": 6}),
    Broken("half a file", "campaign-syntax", raw(TOML[:66].encode(), C), {"file": C, "line": 5}),
    Broken("a number of 5000 digits", "campaign-syntax", raw(TOO_LONG.encode(), C), {"file": C}),
    Broken("nested beyond reason", "campaign-syntax", raw(b"name = " + b"[" * 9999, C), {"file": C}),
    Broken(
        "TOML not UTF-8", "campaign-unreadable", raw(b'name = "a"\nx = "\xe4"', C), {"line": 2}, ("UTF-8",)
    ),
    Broken("empty campaign.toml", "key-missing", raw(b"", C), {"file": C, "key": "name"}),
    Broken(
        "unknown key",
        "key-unknown",
        toml(("role", "rolle")),
        {"file": C, "key": "rolle", "line": 8},
        ("'rolle'", "did you mean role?", "recording 1 ('free.csv')"),
    ),
    Broken(
        "unknown key on top", "key-unknown", toml(("name", "nmae")), {"key": "nmae", "line": 1}, ("name?",)
    ),
    Broken(
        "missing key",
        "key-missing",
        toml(("load_kg = 0.0\n", "")),
        {"key": "load_kg", "line": 4},
        ("load_kg",),
    ),
    Broken("missing rate", "key-missing", toml(("sample_rate_hz = 50.0\n", "")), {"key": "sample_rate_hz"}),
    Broken(
        "wrong role",
        "role-unknown",
        toml(('"validate"', '"test"')),
        {"value": "test", "line": 14, "known": ["estimate", "validate"]},
        ("'test'", "'estimate' or 'validate'"),
    ),
    Broken(
        "wrong lift", "lift-unknown", toml(('"main"', '"mian"')), {"value": "mian", "line": 12}, ("'main'",)
    ),
    Broken("lift is a number", "lift-unknown", toml(('"free"', "1")), {"value": 1, "line": 6}),
    Broken(
        "load is text", "value-invalid", toml(("800.0", '"800"')), {"value": "800", "line": 13}, ("number",)
    ),
    Broken("load is true", "value-invalid", toml(("800.0", "true")), {"value": True, "key": "load_kg"}),
    Broken(
        "negative load",
        "load-out-of-bounds",
        toml(("800.0", "-800.0")),
        {"value": -800.0, "lower": 0.0, "upper": 1e4, "unit": "kg", "line": 13, "recording": "main.csv"},
        ("-800", "0 to 10000 kg"),
    ),
    Broken("absurd load", "load-out-of-bounds", toml(("800.0", "800000")), {"value": 8e5, "line": 13}),
    Broken("load is not a number", "load-out-of-bounds", toml(("800.0", "nan")), {"line": 13}),
    Broken("rate of zero", "sample-rate-out-of-bounds", toml(("50.0", "0")), {"value": 0.0, "line": 2}),
    Broken("infinite rate", "sample-rate-out-of-bounds", toml(("50.0", "inf")), {"line": 2}),
    Broken(
        "no recordings",
        "recordings-missing",
        raw(b'name = "a"\nsample_rate_hz = 50', C),
        says=("[[recording]]",),
    ),
    Broken(
        "empty recordings", "recordings-missing", raw(b'name = "a"\nsample_rate_hz = 50\nrecording = []', C)
    ),
    Broken(
        "[recording]",
        "value-invalid",
        toml((TOML[TOML.rindex("[[") :], ""), ("[[recording]]", "[recording]")),
        {"line": 4},
    ),
    Broken(
        "file listed twice",
        "recording-repeated",
        toml(('"main.csv"', '"./free.csv"')),
        {"value": F, "line": 11},
        ("listed twice",),
    ),
    Broken("same name but suffix", "recording-repeated", toml(('"main.csv"', '"free.mat"')), {"line": 11}),
    *(
        Broken(f"path {path}", "path-escapes", toml(('"main.csv"', f"'{path}'")), {"value": path, "line": 11})
        for path in (
            "../main.csv",
            "/etc/passwd",
            "a/../../main.csv",
            "C:\\main.csv",
            "C:main.csv",
            "a\\b.csv",
        )
    ),
    Broken("empty file name", "value-invalid", toml(('"main.csv"', '""')), {"name": "file", "line": 11}),
    Broken("file name with a NUL", "value-invalid", toml(('"main.csv"', '"a\\u0000.csv"')), {"line": 11}),
    Broken(
        "unknown format", "format-unknown", toml(('"main.csv"', '"main.xlsx"')), {"value": ".xlsx"}, (".mf4",)
    ),
    Broken("missing file", "recording-missing", lambda f: (f / F).unlink(), {"file": F}, ("no such file",)),
    Broken(
        "a folder for a file", "recording-missing", lambda f: [(f / F).unlink(), (f / F).mkdir()], {"file": F}
    ),
    # the file as such
    Broken("empty file", "recording-empty", raw(b""), {"file": F}, ("empty",)),
    Broken("file of blank lines", "recording-empty", raw(b"\n\n \n"), {"file": F}),
    Broken("header alone", "recording-empty", lines(lambda rows: rows[:1]), {"file": F}),
    Broken(
        "one row",
        "recording-too-short",
        lines(lambda rows: rows[:2]),
        {"value": 1, "lower": 2},
        ("1 sample,",),
    ),
    Broken(
        "not UTF-8",
        "text-invalid",
        raw(b"time_s,current_free_a\n0,\xff\n"),
        {"line": 2, "value": 255},
        ("byte 25",),
    ),
    Broken("binary garbage", "text-invalid", raw(bytes(range(256))), {"file": F, "line": 2}),
    Broken("UTF-16", "text-invalid", raw(csv_text(signals()).encode("utf-16")), {"line": 1}),
    Broken("no header", "header-missing", lines(lambda rows: rows[1:]), {"line": 1}, ("time_s",)),
    Broken(
        "semicolons", "separator-wrong", lines(lambda rows: [r.replace(",", ";") for r in rows]), {"line": 1}
    ),
    Broken(
        "open quote", "recording-unreadable", lines(lambda rows: [*rows, '"0']), {"file": F, "line": ROWS + 2}
    ),
    # its columns
    Broken(
        "unknown column",
        "column-unknown",
        header("pressure_free_pa", "presure_free_pa"),
        {"file": F, "column": "presure_free_pa", "line": 1},
        ("'presure_free_pa'", "did you mean 'pressure_free_pa'?", "ignore"),
    ),
    Broken(
        "column without name",
        "column-unknown",
        lines(lambda rows: [row + "," for row in rows]),
        {"column": ""},
    ),
    Broken(
        "missing required column",
        "column-missing",
        lines(lambda rows: [",".join(row.split(",")[:2] + row.split(",")[3:]) for row in rows]),
        {"file": F, "channel": "current_main_a"},
        ("current_main_a", "[channels]"),
    ),
    Broken(
        "missing time",
        "column-missing",
        lines(lambda rows: [row.partition(",")[2] for row in rows]),
        {"channel": "time_s"},
    ),
    Broken(
        "duplicate column",
        "column-repeated",
        header("position_free_m", "pressure_free_pa"),
        {"column": "pressure_free_pa", "value": 2, "line": 1},
    ),
    # its cells
    Broken(
        "a word in a cell",
        "cell-not-a-number",
        cell(7, "pressure_free_pa", "n/a"),
        {"file": F, "line": 7, "column": "pressure_free_pa", "value": "n/a"},
        ("free.csv, line 7", "'n/a'", "not a number"),
    ),
    Broken("1_000", "cell-not-a-number", cell(9, "time_s", "1_000"), {"line": 9, "value": "1_000"}),
    Broken(
        "ragged row, short",
        "row-ragged",
        lines(lambda r: [*r[:9], r[9][:9], *r[10:]]),
        {"line": 10, "expected": 6},
    ),
    Broken(
        "ragged row, long",
        "row-ragged",
        lines(lambda r: [*r[:9], r[9] + ",1", *r[10:]]),
        {"line": 10, "value": 7},
    ),
    Broken(
        "blank line inside", "row-ragged", lines(lambda r: [*r[:9], "", *r[9:]]), {"line": 10, "value": 0}
    ),
    Broken(
        "empty time", "sample-missing", cell(5, "time_s", ""), {"line": 5, "channel": "time_s"}, ("time_s",)
    ),
    Broken("NaN time", "sample-missing", cell(5, "time_s", "NaN"), {"line": 5, "channel": "time_s"}),
    Broken(
        "empty current",
        "sample-missing",
        cell(6, "current_main_a", ""),
        {"line": 6, "channel": "current_main_a"},
    ),
    Broken("NaN current", "sample-missing", cell(6, "current_free_a", "nan"), {"line": 6, "count": 1}),
    Broken(
        "infinite value",
        "value-infinite",
        cell(8, "position_free_m", "-inf"),
        {"line": 8, "channel": "position_free_m", "value": -np.inf},
    ),
    Broken("1e999", "value-infinite", cell(8, "pressure_free_pa", "1e999"), {"line": 8, "value": np.inf}),
    # its clock
    Broken(
        "time stands still",
        "time-not-increasing",
        cell(12, "time_s", "0.18"),
        {"line": 12, "value": 0.18, "lower": 0.18, "channel": "time_s"},
        ("line 12", "0.18 s after 0.18 s"),
    ),
    Broken("time goes back", "time-not-increasing", column("time_s", at(30, by=-0.3)), {"line": 32}),
    Broken(
        "clock jumps",
        "clock-jump",
        column("time_s", at(30, by=0.4)),
        {"line": 32, "value": pytest.approx(0.42), "upper": pytest.approx(0.03), "unit": "s"},
        ("0.58 to 1 s", "0.02 s"),
    ),
    Broken("clock jumps little", "clock-jump", column("time_s", at(30, by=0.02)), {"line": 32}),
    Broken(
        "another sample rate",
        "sample-rate-mismatch",
        column("time_s", lambda t: t / 2),
        {"value": pytest.approx(100.0), "channel": "time_s", "unit": "Hz"},
        ("100 Hz", "sample_rate_hz = 50"),
    ),
    Broken("a clock two per cent slow", "sample-rate-mismatch", column("time_s", lambda t: 1.02 * t)),
    # its units
    Broken(
        "time in ms",
        "unit-wrong",
        column("time_s", lambda t: 1000 * t),
        {"channel": "time_s", "looks_like": ["ms"], "scale": 1e-3},
        ("looks like ms",),
    ),
    Broken(
        "pressure in bar",
        "unit-wrong",
        column("pressure_free_pa", lambda p: p / 1e5),
        {"channel": "pressure_free_pa", "scale": 1e5, "unit": "Pa", "file": F},
        ("looks like bar", "multiply it by 100000"),
    ),
    Broken(
        "position in mm",
        "unit-wrong",
        column("position_free_m", lambda x: 1e3 * x),
        {"channel": "position_free_m", "looks_like": ["mm", "cm"], "scale": 1e-3, "line": 2, "value": 980.0},
        ("980 m", "looks like mm", "multiply it by 0.001 if it is mm, multiply it by 0.01 if it is cm"),
    ),
    Broken(
        "encoder that counts downward",
        "unit-wrong",
        column("position_free_m", lambda x: -x),
        {"channel": "position_free_m", "scale": -1.0, "line": 2, "value": -0.98},
        ("looks like a signal of the other sign", "multiply it by -1;"),
    ),
    Broken(
        "temperature in kelvin",
        "unit-wrong",
        column("oil_temperature_degc", lambda x: x + 273.15),
        {"channel": "oil_temperature_degc", "looks_like": ["K"], "offset": -273.15, "line": 2},
        ("looks like K", "add -273.15"),
    ),
    Broken(
        "current in mA",
        "unit-wrong",
        column("current_free_a", lambda i: 1e3 * i),
        {"channel": "current_free_a", "looks_like": ["mA"], "line": 14, "value": 500.0},
        ("looks like mA",),
    ),
    Broken(
        "one sample that would fit another unit",
        "value-out-of-bounds",
        column("position_free_m", put(20, 100.0)),
        {"line": 22, "value": 100.0},
    ),
    Broken(
        "one impossible sample",
        "value-out-of-bounds",
        column("position_free_m", put(20, 1e9)),
        {"line": 22, "value": 1e9, "unit": "m"},
        ("1e+09 m",),
    ),
    Broken(
        "the other lift",
        "lift-contradicts-current",
        toml(('lift = "free"', 'lift = "main"')),
        {"file": F, "channel": "current_free_a", "value": "main"},
        ('lift = "free"',),
    ),
    Broken(
        "both lifts as one",
        "lift-contradicts-current",
        column("current_main_a", put(20, 0.5)),
        {"file": F, "channel": "current_main_a", "value": "free"},
        ('lift = "both"',),
    ),
    # [channels]
    Broken(
        "unknown channel",
        "channel-unknown",
        toml(('"pressure_free_pa"', '"pressure_free"')),
        {"value": "pressure_free", "column": "pA", "line": 8},
        ("did you mean pressure_free_pa?",),
        "csv",
    ),
    Broken(
        "no channel",
        "key-missing",
        toml(('channel = "time_s"', "")),
        {"key": "channel", "line": 5},
        made="csv",
    ),
    Broken(
        "unknown key of a channel", "key-unknown", toml(("scale", "factor")), {"line": 6}, ("scale",), "csv"
    ),
    Broken(
        "a channel as text",
        "value-invalid",
        toml(('{ channel = "time_s" }', "7")),
        {"line": 5},
        made="csv",
    ),
    Broken(
        "missing source",
        "source-missing",
        toml(('"pA"', '"pB"')),
        {"file": "run.csv", "value": "pB", "channel": "pressure_free_pa"},
        ("'pB'", "[channels]"),
        "csv",
    ),
    Broken(
        "zero scale",
        "scale-invalid",
        toml(("0.001", "0.0")),
        {"value": 0.0, "line": 6, "unit": "A"},
        made="csv",
    ),
    Broken(
        "infinite offset", "scale-invalid", toml(("offset = 0.0", "offset = inf")), {"line": 7}, made="csv"
    ),
    Broken(
        "two sources for one channel",
        "channel-repeated",
        toml(("current_main_a", "current_free_a")),
        {"value": ["ValveCurrFL", "ValveCurrML"], "channel": "current_free_a", "line": 7},
        ("both",),
        "csv",
    ),
    Broken(
        "a mapped column beside the channel's own",
        "channel-repeated",
        lambda f: (f / "run.csv").write_text(csv_text(foreign() | {"time_s": foreign()["t"]})),
        {"channel": "time_s", "file": "run.csv"},
        made="csv",
    ),
    Broken(
        "mapped and ignored",
        "source-ignored",
        toml(("[channels]", 'ignore = ["pA"]\n[channels]')),
        {"value": "pA", "line": 9},
        made="csv",
    ),
    Broken(
        "a wrong scale",
        "unit-wrong",
        toml(("scale = 0.001", "scale = 1.0")),
        {"channel": "current_free_a", "column": "ValveCurrFL", "looks_like": ["mA"]},
        ("current_free_a (column 'ValveCurrFL')",),
        "csv",
    ),
]


@pytest.mark.parametrize("broken", BROKEN, ids=lambda broken: broken.name)
def test_a_broken_campaign_is_told_in_one_sentence_and_nothing_is_written(broken, tmp_path):
    folder = MAKERS[broken.made](tmp_path / "campaign")
    Campaign.read(folder)
    broken.damage(folder)
    before = snapshot(tmp_path)
    error = raised(Campaign.read, folder)
    assert error.code == broken.code, error
    assert error.file, error
    for name, value in broken.facts.items():
        assert error.facts[name] == value, (name, error.facts)
    for words in broken.says:
        assert words in error.message
    check_sentence(error)
    assert raised(convert, folder, tmp_path / "out").code == broken.code
    assert snapshot(tmp_path) == before
    assert [path.name for path in tmp_path.iterdir()] == ["campaign"]


def check_sentence(error) -> None:
    """It is one line that says what to do, and its facts are plain data that survive a process boundary."""
    assert error.message.isprintable()
    assert not error.message.endswith(".")
    assert ";" in error.message
    assert len(error.message) < 500
    assert error.facts.get("line", 1) >= 1
    json.dumps(error.to_dict())
    assert repr(pickle.loads(pickle.dumps(error)).to_dict()) == repr(error.to_dict())


def test_a_missing_folder_is_told(tmp_path):
    error = raised(Campaign.read, tmp_path / "nowhere")
    assert (error.code, error.file) == ("campaign-missing", str(tmp_path / "nowhere"))
    check_sentence(error)


def test_a_recording_is_no_campaign(tmp_path):
    folder = make(tmp_path / "small")
    error = raised(Campaign.read, folder / "free.csv")
    assert error.code == "campaign-file-missing"
    check_sentence(error)


@pytest.mark.parametrize("path", ["\0", "x" * 5000])
def test_an_impossible_path_is_told(path):
    assert raised(Campaign.read, path).code in ("campaign-missing", "campaign-unreadable")


@pytest.mark.parametrize("role", ["estimate", "validate"])
def test_a_campaign_of_one_role_is_whole(role, tmp_path):
    folder = make(tmp_path / "small")
    other = {"estimate": "validate", "validate": "estimate"}[role]
    toml((f'"{other}"', f'"{role}"'))(folder)
    assert len(getattr(Campaign.read(folder), role)) == 2


def test_a_sensor_that_reads_nothing_is_no_wrong_unit(tmp_path):
    folder = make(tmp_path / "small")
    column("pressure_free_pa", np.zeros_like)(folder)
    assert not Campaign.read(folder)[0]["pressure_free_pa"].any()


def test_limits_are_the_core_s_own(tmp_path):
    folder = make(tmp_path / "small")
    for name in ("position_free_m", "oil_temperature_degc"):
        for limit, beyond in ((table()[name].lower, -1e-6), (table()[name].upper, 1e-6)):
            column(name, put(20, limit))(folder)
            assert Campaign.read(folder)[0][name][20] == limit
            column(name, put(20, limit + beyond))(folder)
            error = raised(Campaign.read, folder)
            assert (error.lower, error.upper, error.line) == (table()[name].lower, table()[name].upper, 22)


def test_lines_are_found_in_tables_of_their_own(tmp_path):
    folder = make_mapped(tmp_path / "mapped", ".csv")
    text = MAPPED.format(file="run.csv")
    entry = '"pA" = { channel = "pressure_free_pa", scale = 1e5 }\n'
    own = '[channels."pA"]\nchannel = "pressure_free_pa"\nscale = 1e5\ngain = 1\n'
    (folder / "campaign.toml").write_text(text.replace(entry, own))
    assert raised(Campaign.read, folder).code == "key-unknown"
    (folder / "campaign.toml").write_text(text.replace(entry, own.replace("gain = 1\n", "")))
    assert len(Campaign.read(folder)[0].channels) == 3


@pytest.mark.parametrize("text", ["a = " + "[" * 500_000, "x" * 3_000_000, 'name = "' + "a" * 2_000_000])
def test_a_toml_of_absurd_size_or_depth_is_refused_in_a_second(text, tmp_path):
    folder = MAKERS["plain"](tmp_path / "campaign")
    (folder / "campaign.toml").write_text(text)
    start = time.perf_counter()
    assert raised(Campaign.read, folder).code in ("campaign-unreadable", "campaign-syntax")
    assert time.perf_counter() - start < 10.0  # of a loaded machine; alone a hundredth of it

"""The page of bad inputs: what was tried, what is said; the page is made by this file's main."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from forklift import Campaign, ForkliftError
from forklift.plant.forklift.checks.faults import findings
from forklift.plant.forklift.checks.suitability import suitability
from invalid_campaign import THESIS, good, with_channels
from test_broken_campaigns import BROKEN, MAKERS
from test_unfit_campaigns import BROKEN as UNFIT

PAGE = Path(__file__).parents[1] / "docs" / "bad-inputs.md"
FEWEST = 100
FIT_ALONE = {"estimate-missing", "no-excitation"}
"""Whoever only looks at recordings needs none to fit on."""

HEAD = """\
# Bad inputs

What was done to a good campaign, and what is said of it. Every row is a test of its own; this page is made by
`python tests/test_bad_inputs.py`, and a test holds it to the program. The codes are those of [](errors.md).
"""


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "\\<").replace("\n", " ")


def _rows_of_files(folder: Path) -> list[tuple[str, str, str]]:
    rows = []
    for k, broken in enumerate(BROKEN):
        made = MAKERS[broken.made](folder / f"c{k}")
        broken.damage(made)
        with pytest.raises(ForkliftError) as told:
            Campaign.read(made)
        rows.append((broken.name, told.value.code, told.value.message.replace(str(made), "campaign")))
    return rows


def _rows_of_recordings() -> list[tuple[str, str, str]]:
    rows = []
    for broken in UNFIT:
        with pytest.raises(ForkliftError) as told:
            suitability(tuple(broken.mutation(good())), THESIS)
        rows.append((broken.name, told.value.code, told.value.message))
    return rows


def page(folder: Path) -> str:
    """The page as it should be."""
    parts = [HEAD]
    for title, rows in (
        ("Files and entries: `compare`, `convert`, `fit` and `diagnose` refuse them", _rows_of_files(folder)),
        (
            "Recordings: `fit` refuses them (`diagnose` but for three, [](errors.md)), "
            "`compare` and `convert` tell it first",
            _rows_of_recordings(),
        ),
    ):
        lines = [f"## {title}", "", "| what is wrong | code | what is said |", "|---|---|---|"]
        lines += [f"| {_cell(name)} | `{code}` | {_cell(said)} |" for name, code, said in rows]
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def test_the_page_says_what_the_program_says(tmp_path):
    text = PAGE.read_text(encoding="utf-8")
    assert text == page(tmp_path)
    assert sum(line.startswith("| ") for line in text.splitlines()) - 2 >= FEWEST


@pytest.mark.parametrize(
    "broken", [one for one in UNFIT if one.code not in FIT_ALONE], ids=lambda one: one.name
)
def test_who_only_looks_is_told_what_a_fit_refuses(broken):
    told = findings(tuple(broken.mutation(good())), THESIS)
    assert [one.code for one in told] == [broken.code]


def test_a_position_that_counts_the_other_way_is_told():
    one = good()[0]
    turned = with_channels(one, position_free_m=one["position_free_m"].max() - one["position_free_m"])
    assert findings((turned,), THESIS)[0].code == "position-reversed"


def test_a_load_entered_in_tonnes_is_told():
    from dataclasses import replace

    loaded = next(one for one in good() if one.load_kg >= 1500.0)
    told = findings((replace(loaded, load_kg=loaded.load_kg / 1000.0, sha256=""),), THESIS)
    assert "load-doubtful" in [one.code for one in told]


if __name__ == "__main__":
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as made:
        PAGE.write_text(page(Path(made)), encoding="utf-8", newline="\n")
    sys.stdout.write(f"{PAGE}\n")

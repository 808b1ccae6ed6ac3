"""A single file that is written replaces an earlier one of its kind, and nothing that somebody recorded,
listed or wrote down."""

from __future__ import annotations

from pathlib import Path

import pytest

from forklift import Truck
from forklift.app.main import run
from forklift.base import output
from forklift.control.controller import Controller
from forklift.control.own_truck import for_truck
from small_campaign import raised

THESIS = Truck.read("thesis")


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    folder = tmp_path / "campaign"
    (folder / "runs").mkdir(parents=True)
    (folder / "campaign.toml").write_text(
        "[[recording]]\nfile = \"a.csv\"\n\n[[recording]]\nfile = 'runs/b.csv'\n", encoding="utf-8"
    )
    for name in ("a.csv", "runs/b.csv", "notes.csv"):
        (folder / name).write_text("time_s\n", encoding="utf-8")
    return folder


@pytest.mark.parametrize("name", ["campaign.toml", "a.csv", "runs/b.csv"])
def test_what_belongs_to_a_campaign_is_left_alone(campaign: Path, name: str) -> None:
    before = (campaign / name).read_bytes()
    error = raised(output.write_text, campaign / name, "lost")
    assert error.code == "output-exists"
    assert str(campaign) in error.message
    assert (campaign / name).read_bytes() == before


def test_what_a_campaign_does_not_list_is_replaced(campaign: Path) -> None:
    for name in ("notes.csv", "new.csv", "runs/new.csv"):
        output.write_text(campaign / name, "new")
        assert (campaign / name).read_text(encoding="utf-8") == "new"


@pytest.mark.parametrize(
    "words",
    [
        ["truck", "new", "mine", "--out", "{}/campaign.toml"],
        ["simulate", "--load", "800", "--temperature", "40", "--out", "{}/a.csv"],
    ],
)
def test_a_command_does_not_write_over_a_campaign(campaign: Path, words: list[str]) -> None:
    assert run([word.format(campaign) for word in words]) == 2
    assert (campaign / "a.csv").read_text(encoding="utf-8") == "time_s\n"
    assert "[[recording]]" in (campaign / "campaign.toml").read_text(encoding="utf-8")


def test_a_controller_does_not_replace_a_truck_nor_a_truck_a_controller(tmp_path: Path) -> None:
    truck, controller = tmp_path / "truck.toml", tmp_path / "controller.toml"
    THESIS.write(truck)
    Controller.read("thesis").write(controller)
    made = for_truck(Controller.read("today"), THESIS)
    assert raised(made.write, truck).code == "output-exists"
    assert raised(THESIS.write, controller).code == "output-exists"
    assert Truck.read(truck).values == THESIS.values
    made.write(controller)
    assert Controller.read(controller).hash == made.hash
    words = ["control", "for-truck", "thesis", "--truck", str(truck), "--out", str(truck)]
    assert run(words) == 2
    assert Truck.read(truck).values == THESIS.values


def test_a_truck_of_ones_own_is_written_once(tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    words = ["truck", "new", "mine", "--set", "free.bore=55 mm # data sheet 7", "--out", str(out)]
    assert run(words) == 0
    before = out.read_bytes()
    assert "data sheet 7" in before.decode()
    assert before.decode().count("# data sheet") == 0  # the source, not what it was told behind
    assert run(words) == 2
    assert out.read_bytes() == before

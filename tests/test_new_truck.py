"""A truck of one's own is what its owner tells, with sources; nothing of it is silently another truck's."""

from __future__ import annotations

from math import pi

import pytest

from forklift import Truck
from forklift.app.main import main
from forklift.plant.forklift.new_truck import new_truck, still_of
from small_campaign import raised

THESIS = Truck.read("thesis")


def test_what_is_told_is_taken_with_unit_and_source():
    made = new_truck(
        "mine",
        {
            "free.bore": "60 mm # drawing 12",
            "main.bore": "2 in",
            "main.cylinders": "2",
            "free.mass.moving": "700 lb # weighed",
            "free.cylinder.stroke_upper": "1.05",
            "free.compensator.p_set": "7 bar",
            "free.oil.density": "0.87 kg/l",
            "main.volume.V": "20 cm3",
        },
        THESIS,
    )
    assert made.values["free.cylinder.area"] == pytest.approx(pi * 0.03**2)
    assert made.values["main.cylinder.area"] == pytest.approx(2 * pi * 0.0254**2)
    assert made.values["free.mass.moving"] == pytest.approx(317.51466)
    assert made.values["free.compensator.p_set"] == 7e5
    assert made.values["free.oil.density"] == pytest.approx(870.0)
    assert made.values["main.volume.V"] == pytest.approx(2e-5)
    assert made.sources["free.mass.moving"] == "weighed (700 lb)"
    assert "drawing 12" in made.sources["free.cylinder.area"]
    assert made.values["main.mass.moving"] == THESIS.values["main.mass.moving"]
    assert made.sources["main.mass.moving"].startswith("as thesis: ")
    assert "main.mass.moving" in still_of(made, THESIS)
    assert "free.mass.moving" not in still_of(made, THESIS)


def test_table_points_are_taken():
    made = new_truck("mine", {"free.valve.points": "0.3:0, 0.6:3e-6, 1.2:2e-5 # flow bench"}, THESIS)
    assert made.values["free.valve.table_current"] == (0.3, 0.6, 1.2)
    assert made.values["free.valve.table_area"] == (0.0, 3e-6, 2e-5)
    assert made.sources["free.valve.table_area"] == "flow bench"


def test_the_nearest_name_is_told_also_of_what_stands_for_another():
    assert "'free.bore'" in raised(lambda: new_truck("mine", {"free.bor": "55 mm"}, THESIS)).message


def test_a_tables_column_is_told_how_it_is_written():
    error = raised(lambda: new_truck("mine", {"main.valve.table_area": "2e-6"}, THESIS))
    assert "main.valve.points" in error.message


@pytest.mark.parametrize(
    ("told", "code"),
    [
        ({"free.cylinder.aera": "0.002"}, "parameter-unknown"),
        ({"free.valve.table_area": "2e-6"}, "parameter-unknown"),
        ({"free.mass.moving": "heavy"}, "parameter-not-a-number"),
        ({"free.mass.moving": "310 bar"}, "parameter-unit"),
        ({"free.mass.moving": "-5 kg"}, "parameter-out-of-bounds"),
        ({"free.valve.points": "0.3, 0.6"}, "parameter-not-a-number"),
        ({"free.valve.points": "0.6:0, 0.3:1e-6"}, "table-not-rising"),
        ({"free.bore": "6 kg"}, "parameter-unit"),
        ({"free.cylinders": "2"}, "parameter-malformed"),
        ({"free.bore": "60 mm", "free.cylinder.area": "23.8 cm^2"}, "parameter-malformed"),
    ],
)
def test_what_cannot_be_is_refused(told, code):
    assert raised(new_truck, "mine", told, THESIS).code == code


def test_the_command_writes_a_file_that_reads_back(tmp_path, capsys):
    out = tmp_path / "mine.toml"
    with pytest.raises(SystemExit) as end:
        main(["truck", "new", "mine", "--set", "free.mass.moving=310 kg # weighed", "--out", str(out)])
    assert not end.value.code
    assert "main.mass.moving" in capsys.readouterr().out
    made = Truck.read(out)
    assert (made.name, made.values["free.mass.moving"]) == ("mine", 310.0)
    assert made.sources["free.mass.moving"].startswith("weighed")


@pytest.mark.parametrize("name", ["", " "])
def test_a_truck_without_a_name_is_not_written(name, tmp_path):
    assert raised(new_truck, name, {}, THESIS).code == "truck-malformed"
    with pytest.raises(SystemExit) as end:
        main(["truck", "new", name, "--out", str(tmp_path / "mine.toml")])
    assert end.value.code == 2
    assert not list(tmp_path.iterdir())

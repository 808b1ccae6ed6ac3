"""A truck's file is read with every check, and says where it is wrong."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forklift import ForkliftError, Truck, _core
from forklift.plant.forklift.tables import of_effect, parameters
from forklift.plant.forklift.truck import SHIPPED
from forklift.recordings.channels import LIFTS

THESIS = (SHIPPED / "thesis.toml").read_text(encoding="utf-8")
NU_0 = "nu_0 = { value = 4.45e-5, source"


def written(folder: Path, old: str, new: str) -> Path:
    """The thesis's file with its first `old` replaced."""
    assert old in THESIS
    path = folder / "truck.toml"
    path.write_text(THESIS.replace(old, new, 1), encoding="utf-8")
    return path


def refused(path: Path | str) -> ForkliftError:
    with pytest.raises(ForkliftError) as caught:
        Truck.read(path)
    return caught.value


def test_the_thesis_truck_has_every_parameter_of_both_lifts_with_a_source():
    truck = Truck.read("thesis")
    thesis = {name for name in parameters() if name.partition(".")[0] in LIFTS}
    of_effects = {name for effect in _core.effect_table() for name in of_effect(effect)}
    assert set(truck.values) == thesis - of_effects
    assert all(
        "Table 5." in source or "Figure" in source or "chosen" in source for source in truck.sources.values()
    )
    assert truck.effects == ()
    assert truck.origin == "shipped"


def test_the_thesis_truck_holds_the_readings_and_not_the_misprints():
    values = Truck.read("thesis").values
    assert values["main.cylinder.area"] == 2 * math.pi * (0.04 / 2) ** 2
    assert values["free.cylinder.area"] == math.pi * (0.055 / 2) ** 2
    assert values["free.gravity.g"] == 9.82
    assert values["main.friction.f_cfr"] == 2.68e-5
    assert values["free.valve.table_area"][-1] == 4.4e-5


def test_a_parameter_without_a_source_is_refused(tmp_path):
    error = refused(written(tmp_path, NU_0, "nu_0 = { value = 4.45e-5 } # { source"))
    assert error.code == "parameter-malformed"
    assert "source" in error.message


@pytest.mark.parametrize(
    ("old", "new", "code", "told"),
    [
        (NU_0, NU_0.replace("4.45e-5", "44.5"), "parameter-out-of-bounds", "44.5"),
        (NU_0, NU_0.replace("4.45e-5", "nan"), "parameter-not-a-number", "finite"),
        (NU_0, NU_0.replace("4.45e-5", "inf"), "parameter-not-a-number", "finite"),
        (NU_0, NU_0.replace("4.45e-5", '"thick"'), "parameter-not-a-number", "thick"),
        (NU_0, NU_0.replace("4.45e-5", "true"), "parameter-not-a-number", "True"),
        (NU_0, NU_0.replace("4.45e-5", "[4.45e-5, 1e-5]"), "parameter-malformed", "list"),
        (NU_0, NU_0.replace("nu_0", "nu_O"), "parameter-unknown", "did you mean free.viscosity.nu_0"),
        (NU_0, "nu_0 = 4.45e-5 # ", "parameter-malformed", "free.viscosity.nu_0"),
        (NU_0, 'nu_0 = { value = 4.45e-5, unit = "cSt", source', "parameter-unit", "m2/s"),
        (NU_0, "nu_0 = { value = 4.45e-5, bound = 1, source", "parameter-malformed", "bound"),
        (NU_0, "nu_0 = { value = , source", "toml-syntax", "TOML"),
        (NU_0, "T_0 = { value = 293.0, source", "toml-syntax", "TOML"),
        ("[free.viscosity]", "[fre.viscosity]", "parameter-unknown", "did you mean"),
        ("[0.0, 0.36, 0.45,", "[0.0, 0.46, 0.45,", "table-not-rising", "table_current"),
        ("[0.0, 0.36, 0.45,", "[0.36, 0.45,", "table-length", "table_"),
        ("[0.0, 0.0, 0.13e-5,", "[0.0, 0.0, -0.13e-5,", "parameter-out-of-bounds", "table_area"),
        ('name = "thesis"', "name = 3", "truck-malformed", "name"),
    ],
)
def test_a_broken_file_is_refused_in_one_sentence_with_file_and_line(tmp_path, old, new, code, told):
    path = written(tmp_path, old, new)
    error = refused(path)
    assert error.code == code
    assert told in error.message
    assert str(path) in error.message
    assert error.file == str(path)
    changed = THESIS[: THESIS.index(old)].count("\n") + 1
    assert error.line in (changed, changed + 1)  # after a misspelt heading or a repeated key, the next line
    assert "\n" not in error.message


def test_a_missing_parameter_is_named(tmp_path):
    error = refused(written(tmp_path, NU_0, f"# {NU_0}"))
    assert error.code == "parameter-missing"
    assert error.name == "free.viscosity.nu_0"


def test_bytes_that_are_not_text_are_refused(tmp_path):
    path = tmp_path / "truck.toml"
    path.write_bytes(b'name = "\xff\xfe"\n')
    assert refused(path).code == "file-unreadable"


def test_a_truck_that_does_not_exist_is_refused_with_those_that_ship():
    error = refused("thesiss")
    assert error.code == "truck-unknown"
    assert "thesis" in error.shipped


def test_values_set_in_python_are_checked_and_leave_the_truck_as_it_was():
    truck = Truck.read("thesis")
    other = truck.with_values({"free.friction.sigma_2": 4000.0}, source="a guess")
    assert truck.values["free.friction.sigma_2"] == 4137.8
    assert other.values["free.friction.sigma_2"] == 4000.0
    assert other.sources["free.friction.sigma_2"] == "a guess"
    assert other != truck
    for name, value, code in [
        ("free.friction.sigma_2", -1.0, "parameter-out-of-bounds"),
        ("free.friction.sigma_2", math.nan, "parameter-not-a-number"),
        ("free.friction.sigma_2", "much", "parameter-not-a-number"),
        ("free.friction.sigma_2", None, "parameter-not-a-number"),
        ("free.friction.sigma_3", 1.0, "parameter-unknown"),
    ]:
        with pytest.raises(ForkliftError) as caught:
            truck.with_values({name: value})
        assert caught.value.code == code
        assert name in caught.value.message


def test_an_effect_is_present_if_its_parameter_is_given():
    truck = Truck.read("thesis").with_values({"mast_coupling.factor": 1.0})
    assert len(truck.effects) == 1
    assert "mast_coupling" in truck.effects[0]


def test_a_truck_is_immutable_and_survives_pickling():
    truck = Truck.read("thesis")
    with pytest.raises(TypeError):
        truck.values["free.gravity.g"] = 1.6
    assert pickle.loads(pickle.dumps(truck)) == truck
    assert hash(truck) == hash(Truck.read("thesis"))


def test_the_hash_tells_values_apart_and_nothing_else():
    truck = Truck.read("thesis")
    assert truck.with_values({"free.gravity.g": 9.82}).sha256 == truck.sha256
    assert truck.with_values({"free.gravity.g": np.nextafter(9.82, 10)}).sha256 != truck.sha256


@given(
    factor=st.floats(0.5, 2.0),
    source=st.text(st.characters(exclude_categories=["Cs"]), max_size=40),
    knots=st.lists(st.floats(0, 5e-5), min_size=8, max_size=8),
)
def test_a_written_truck_reads_back_equal(tmp_path_factory, factor, source, knots):
    path = tmp_path_factory.mktemp("truck") / "truck.toml"
    truck = Truck.read("thesis").with_values(
        {"free.viscosity.nu_0": 4.45e-5 * factor, "main.valve.table_area": sorted(knots)}, source=source
    )
    again = Truck.read(truck.write(path))
    assert again == truck
    assert again.sources == truck.sources
    assert list(path.parent.iterdir()) == [path]


def test_a_truck_that_cannot_be_written_leaves_nothing(tmp_path):
    with pytest.raises(ForkliftError) as caught:
        Truck.read("thesis").write(tmp_path / "nowhere" / "truck.toml")
    assert caught.value.code == "not-writable"
    assert list(tmp_path.iterdir()) == []


def test_a_truck_prints_itself_as_a_table_with_units():
    text = str(Truck.read("thesis"))
    assert "free.viscosity.nu_0" in text
    assert "m2/s" in text
    assert "Table 5.1" in text

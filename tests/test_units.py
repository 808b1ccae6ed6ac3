"""Units are read: from the file, from the mapping, never guessed; what contradicts is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forklift import Campaign
from forklift.plant.forklift.tables import parameters
from forklift.recordings import units
from forklift.recordings.inspect import inspect
from small_campaign import MAPPED, csv_text, foreign, make_mapped, raised, signals

# BIPM, The International System of Units, 9th edition (2019); NIST SP 811 (2008), appendix B.
CONVERSIONS = [
    ("bar", "Pa", 20.0, 2e6),
    ("MPa", "Pa", 2.0, 2e6),
    ("mbar", "Pa", 1.0, 100.0),
    ("psi", "Pa", 1.0, 6894.757293168),
    ("PSI", "Pa", 1.0, 6894.757293168),
    ("bara", "Pa", 2.01325, 1e5),
    ("kgf/cm²", "Pa", 1.0, 98066.5),
    ("°F", "degC", 68.0, 20.0),
    ("degF", "degC", -40.0, -40.0),
    ("F", "degC", 212.0, 100.0),
    ("K", "degC", 293.15, 20.0),
    ("°C", "degC", 20.5, 20.5),
    ("C", "degC", 20.5, 20.5),
    ("mA", "A", 750.0, 0.75),
    ("in", "m", 1.0, 0.0254),
    ("ft", "m", 1.0, 0.3048),
    ("mm", "m", 980.0, 0.98),
    ("ms", "s", 20.0, 0.02),
    ("µs", "s", 20.0, 2e-5),
    ("cm^2", "m2", 23.8, 2.38e-3),
    ("cm2", "m2", 23.8, 2.38e-3),
    ("l/min", "m3/s", 60.0, 1e-3),
    ("mm²/s", "m2/s", 46.0, 4.6e-5),
    ("mm2 s-1", "m2/s", 46.0, 4.6e-5),
    ("kg/dm3", "kg/m3", 0.87, 870.0),
    ("l", "m3", 2.0, 2e-3),
    ("mmH2O", "Pa", 1.0, 9.80665),
]


@pytest.mark.parametrize(("unit", "to", "raw", "value"), CONVERSIONS)
def test_units_are_converted_as_the_standards_have_them(unit, to, raw, value):
    found = units.conversion(unit, to)
    assert found is not None
    assert raw * found.scale + found.offset == pytest.approx(value, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("unit", "to", "scale"),
    [
        ("mPa", "Pa", 1e-3), ("[mPa]", "Pa", 1e-3), ("MPa", "Pa", 1e6), ("mT", "T", 1e-3), ("mS", "S", 1e-3),
        ("Mm", "m", 1e6), ("ma", "A", 1e-3), ("KG", "kg", 1.0), ("MM", "m", 1e-3), ("C", "degC", 1.0),
    ],
)  # fmt: skip
def test_a_unit_that_is_taken_as_it_is_spelt_is_read_without_regard_to_case_only_if_it_must_be(
    unit, to, scale
):
    found = units.conversion(unit, to, exact=True)
    assert found is not None
    assert (found.scale, found.offset) == (pytest.approx(scale), pytest.approx(0.0, abs=1e-9))
    assert units.conversion("t", "T", exact=True) is None


def test_every_unit_of_a_truck_s_parameters_converts():
    stated = {one["unit"] for one in parameters().values()} - {"1", "variable's"}
    for unit in stated:
        found = units.conversion(f"({unit})*cm/m", unit)
        assert found is not None, unit
        assert found.scale == pytest.approx(0.01), unit


@given(st.text(max_size=12))
def test_any_text_is_a_unit_or_none(text):
    found = units.conversion(text, "Pa")
    assert found is None or np.isfinite([found.scale, found.offset]).all()


def mapped(folder, suffix, entry, columns=None):
    made = make_mapped(folder, suffix, columns)
    line = '"pA" = { channel = "pressure_free_pa", scale = 1e5 }'
    (made / "campaign.toml").write_text(MAPPED.format(file=f"run{suffix}").replace(line, entry))
    return made


def mdf(folder, entry, unit):
    asammdf = pytest.importorskip("asammdf", reason="asammdf (the extra mdf) is not installed")
    made = mapped(folder, ".mf4", entry)
    own, stated = foreign(), {"ValveCurrFL": "mA", "ValveCurrML": "mA", "pA": unit}
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(own[n], own["t"], name=n, unit=u) for n, u in stated.items()])
        file.save(made / "run.mf4", overwrite=True)
    return made


def mat(folder, entry, unit):
    from scipy.io import savemat

    made = mapped(folder, ".mat", entry.replace('"pA"', '"log.pA"'))
    own = foreign()
    columns = {name: own[name] for name in ("t", "ValveCurrFL", "ValveCurrML")}
    savemat(made / "run.mat", columns | {"log": {"pA": own["pA"], "unit": unit}})
    return made


def mat73(folder, entry, unit):
    h5py = pytest.importorskip("h5py", reason="h5py (the extra mat) is not installed")
    made = mapped(folder, ".mat", entry.replace('"pA"', '"log.pA"'))
    own = foreign()
    with h5py.File(made / "run.mat", "w", userblock_size=512) as file:
        for name in ("t", "ValveCurrFL", "ValveCurrML"):
            file[name] = own[name][None, :]
        file["log/pA"] = own["pA"][None, :]
        text = np.frombuffer(unit.encode("utf-16le"), np.uint16)
        file["log/unit"] = text[:, None]
        file["log/unit"].attrs["MATLAB_class"] = np.bytes_("char")
    return made


def header(folder, entry, unit):
    own = foreign()
    own[f"pA [{unit}]"] = own.pop("pA")
    return mapped(folder, ".csv", entry.replace('"pA"', f'"pA [{unit}]"'), own)


STATED = {"mdf4": mdf, "mat 5": mat, "mat 7.3": mat73, "header": header}


@pytest.mark.parametrize("made", STATED.values(), ids=STATED)
def test_the_unit_a_file_states_converts_the_values(made, tmp_path):
    found = Campaign.read(made(tmp_path / "m", '"pA" = "pressure_free_pa"', "bar"))[0]
    np.testing.assert_allclose(found["pressure_free_pa"], signals()["pressure_free_pa"], rtol=1e-12)


@pytest.mark.parametrize("made", STATED.values(), ids=STATED)
@pytest.mark.parametrize(
    ("entry", "unit", "code"),
    [
        ('"pA" = { channel = "pressure_free_pa", scale = 1e6 }', "bar", "unit-contradicts-scale"),
        ('"pA" = { channel = "pressure_free_pa", unit = "psi" }', "bar", "unit-contradicts-unit"),
        ('"pA" = "pressure_free_pa"', "mm", "unit-of-another-kind"),
    ],
)
def test_what_contradicts_the_unit_of_the_file_is_refused(made, entry, unit, code, tmp_path):
    error = raised(Campaign.read, made(tmp_path / "m", entry, unit))
    assert (error.code, error.channel) == (code, "pressure_free_pa")
    assert repr(unit) in error.message


@pytest.mark.parametrize(
    "entry",
    [
        '"pA" = { channel = "pressure_free_pa", scale = 1e5 }',
        '"pA" = { channel = "pressure_free_pa", unit = "bar" }',
        '"pA" = { channel = "pressure_free_pa", unit = "bar", scale = 1e5 }',
        '"pA" = { channel = "pressure_free_pa", unit = "raw", scale = 1e5 }',
    ],
)
def test_a_scale_and_a_unit_that_agree_are_one(entry, tmp_path):
    found = Campaign.read(mdf(tmp_path / "m", entry, "bar"))[0]
    np.testing.assert_allclose(found["pressure_free_pa"], signals()["pressure_free_pa"], rtol=1e-12)


def test_a_channel_under_its_own_name_may_have_another_unit(tmp_path):
    columns = foreign() | {"fork_height_m": np.linspace(3000.0, 2000.0, 60)}
    folder = make_mapped(tmp_path / "m", ".csv", columns)
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace("[channels]", '[channels]\nfork_height_m = "mm"'))
    np.testing.assert_allclose(Campaign.read(folder)[0]["fork_height_m"][[0, -1]], [3.0, 2.0])


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        ('"pA" = { channel = "pressure_free_pa", unit = "%" }', "unit-needs-scale"),
        ('"pA" = { channel = "pressure_free_pa", unit = "bananas" }', "unit-unknown"),
        ('"pA" = { channel = "pressure_free_pa", unit = "A" }', "unit-of-another-kind"),
        ('"pA" = { channel = "pressure_free_pa", unit = "bar", scale = 1e6 }', "unit-contradicts-scale"),
    ],
)
def test_a_unit_of_the_mapping_that_cannot_be_is_refused(entry, code, tmp_path):
    assert raised(Campaign.read, mapped(tmp_path / "m", ".csv", entry)).code == code
    share = '"pA" = { channel = "pressure_free_pa", unit = "%", scale = 1e5 }'
    found = Campaign.read(mapped(tmp_path / "share", ".csv", share))[0]
    np.testing.assert_allclose(found["pressure_free_pa"], signals()["pressure_free_pa"], rtol=1e-12)


@pytest.mark.parametrize("said", ["ML", "min", "h", "t", "fl"])
def test_round_brackets_hold_a_unit_only_if_it_is_one_of_the_channels_kind(said, tmp_path):
    columns = foreign()
    columns[f"I ({said})"] = columns.pop("ValveCurrML")
    columns["p (bar)"] = columns.pop("pA")
    folder = make_mapped(tmp_path / "m", ".csv", columns)
    toml = folder / "campaign.toml"
    text = toml.read_text().replace('"ValveCurrML"', f'"I ({said})"').replace(", scale = 1e5", "")
    toml.write_text(text.replace('"pA"', '"p (bar)"'))
    found = Campaign.read(folder)[0]
    np.testing.assert_allclose(found["current_main_a"], signals()["current_main_a"])
    np.testing.assert_allclose(found["pressure_free_pa"], signals()["pressure_free_pa"], rtol=1e-12)


def test_a_lift_in_round_brackets_is_proposed_as_one(tmp_path):
    columns = {"Time (s)": signals()["time_s"], "Valve current (ML)": signals()["current_free_a"]}
    (tmp_path / "log.csv").write_text(csv_text(columns))
    found = {one.name: one for one in inspect(tmp_path / "log.csv").signals}
    proposed = {name: one.proposal and one.proposal.channel for name, one in found.items()}
    assert proposed == {"Time (s)": "time_s", "Valve current (ML)": "current_main_a"}
    assert found["Valve current (ML)"].unit == ""

"""CAN logs decoded with a DBC, as python-can's own writers write them."""

from __future__ import annotations

import numpy as np
import pytest

import bus
from forklift import Campaign, convert
from small_campaign import raised, signals

can = pytest.importorskip("can", reason="python-can (the extra can) is not installed")
pytest.importorskip("cantools", reason="cantools (the extra can) is not installed")

SUFFIXES = (".blf", ".asc", ".mf4")


def columns() -> dict[str, np.ndarray]:
    own = signals()
    return {
        "ValveCurrFL": own["current_free_a"] * 1e3,
        "ValveCurrML": own["current_main_a"] * 1e3,
        "pA_FL": own["pressure_free_pa"] * 1e-5,
        "xFL": own["position_free_m"] * 1e3,
        "TOil": own["oil_temperature_degc"] * 1.8 + 32.0,
    }


def campaign(folder, suffix, change=lambda made: made, dbc=bus.DBC):
    folder.mkdir()
    (folder / "campaign.toml").write_text(bus.MAPPING.format(file=f"run{suffix}"))
    (folder / "truck.dbc").write_text(dbc)
    bus.write(folder / f"run{suffix}", change(bus.frames(signals()["time_s"], columns())))
    return folder


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_signals_are_decoded_in_si_units_at_their_own_times(suffix, tmp_path):
    found = Campaign.read(campaign(tmp_path / "bus", suffix))[0]
    own = signals()
    clock, command = found.commanded
    np.testing.assert_allclose(clock, own["time_s"], atol=2e-6)
    np.testing.assert_allclose(command[:, 0], own["current_free_a"], atol=1e-4)
    pressure = found.own("pressure_free_pa")
    np.testing.assert_allclose(pressure.time, own["time_s"][:-1] + 0.002, atol=2e-6)
    np.testing.assert_allclose(pressure.values, own["pressure_free_pa"][:-1], atol=500.0)
    np.testing.assert_allclose(found.own("position_free_m").values, own["position_free_m"][:-1], atol=1e-4)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_multiplexed_signal_has_samples_where_it_is_sent(suffix, tmp_path):
    oil = Campaign.read(campaign(tmp_path / "bus", suffix))[0].own("oil_temperature_degc")
    np.testing.assert_allclose(oil.time, signals()["time_s"][::5] + 0.003, atol=2e-6)
    np.testing.assert_allclose(oil.values, 20.5, atol=0.05)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_multiplexers_value_that_the_dbc_lacks_is_no_damage(suffix, tmp_path):
    def strange(made):
        diagnostics = [message for message in made if message.arbitration_id == 512]
        diagnostics[1].data[0] = 7
        return made

    oil = Campaign.read(campaign(tmp_path / "bus", suffix, strange))[0].own("oil_temperature_degc")
    np.testing.assert_allclose(oil.values, 20.5, atol=0.05)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_29_bit_identifier_is_not_the_11_bit_one_of_the_same_number(suffix, tmp_path):
    standard = [
        can.Message(timestamp=1.7e9, arbitration_id=0x100, is_extended_id=True, data=[255] * 8, channel=1)
    ]
    found = Campaign.read(campaign(tmp_path / "bus", suffix, lambda made: standard + made))[0]
    np.testing.assert_allclose(found.commanded[1][:, 0], signals()["current_free_a"], atol=1e-4)


@pytest.mark.parametrize("suffix", [".blf", ".asc"])
def test_error_frames_hold_no_signals(suffix, tmp_path):
    def spoilt(made):
        errors = [
            can.Message(timestamp=one.timestamp + 1e-3, is_error_frame=True, channel=1) for one in made[::7]
        ]
        return sorted(made + errors, key=lambda one: one.timestamp)

    clean = Campaign.read(campaign(tmp_path / "clean", suffix))[0]
    found = Campaign.read(campaign(tmp_path / "bus", suffix, spoilt))[0]
    for name in clean.channels:
        np.testing.assert_array_equal(found.own(name).values, clean.own(name).values)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_of_frames_with_one_stamp_the_last_counts(suffix, tmp_path):
    def repeated(made):
        stale = can.Message(
            timestamp=made[0].timestamp, arbitration_id=0x100, is_extended_id=False, data=[1] * 8, channel=1
        )
        return [stale, *made]

    found = Campaign.read(campaign(tmp_path / "bus", suffix, repeated))[0]
    np.testing.assert_allclose(found.commanded[1][:, 0], signals()["current_free_a"], atol=1e-4)


def test_a_log_is_converted_with_its_dbc(tmp_path):
    folder = campaign(tmp_path / "bus", ".blf")
    told = {"lift": "free", "load_kg": 800.0, "dbc": folder / "truck.dbc"}
    channels = {"ValveCurrFL": "current_free_a", "ValveCurrML": "current_main_a", "pA_FL": "pressure_free_pa"}
    plain = convert(folder / "run.blf", tmp_path / "plain", channels=channels, **told)
    own = Campaign.read(folder)[0].own("pressure_free_pa")
    np.testing.assert_array_equal(plain[0].own("pressure_free_pa").values, own.values)


def test_what_is_wrong_with_a_dbc_is_told(tmp_path):
    folder = campaign(tmp_path / "bus", ".blf")
    toml = folder / "campaign.toml"
    text = toml.read_text()
    toml.write_text(text.replace('dbc = "truck.dbc"\n', ""))
    assert raised(Campaign.read, folder).code == "dbc-missing"
    toml.write_text(text.replace("truck.dbc", "no.dbc"))
    assert raised(Campaign.read, folder).code == "dbc-missing"
    toml.write_text(text.replace("truck.dbc", "../truck.dbc"))
    assert raised(Campaign.read, folder).code == "path-escapes"
    toml.write_text(text)
    (folder / "truck.dbc").write_text("BO_ 1 x")
    assert raised(Campaign.read, folder).code == "dbc-unreadable"
    (folder / "truck.dbc").write_text(
        bus.DBC.replace("BO_ 256", "BO_ 257")
        .replace("BO_ 512", "BO_ 513")
        .replace("2566844672", "2566844673")
    )
    assert raised(Campaign.read, folder).code == "dbc-of-another-bus"
    (folder / "truck.dbc").write_text(bus.DBC)
    (folder / "run.blf").write_bytes(b"LOGG" + b"\0" * 200)
    assert raised(Campaign.read, folder).code == "recording-unreadable"


def test_a_signal_that_several_messages_have_must_be_named_with_its_message(tmp_path):
    folder = campaign(tmp_path / "bus", ".blf", dbc=bus.DBC.replace("SG_ xFL", "SG_ ValveCurrFL"))
    error = raised(Campaign.read, folder)
    assert (error.code, error.column) == ("source-missing", "xFL")
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace('xFL = "position_free_m"\n', ""))
    error = raised(Campaign.read, folder)
    assert (error.code, error.value) == (
        "column-repeated",
        ["ValveCommand.ValveCurrFL", "LiftSensors.ValveCurrFL"],
    )
    toml.write_text(toml.read_text().replace("ValveCurrFL =", '"ValveCommand.ValveCurrFL" ='))
    assert len(Campaign.read(folder)[0].channels) == 4


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
def test_a_dbc_states_its_units_in_either_encoding(encoding, tmp_path):
    folder = campaign(tmp_path / "bus", ".blf")
    (folder / "truck.dbc").write_bytes(bus.DBC.replace("degF", "°F").encode(encoding))
    np.testing.assert_allclose(Campaign.read(folder)[0].own("oil_temperature_degc").values, 20.5, atol=0.05)

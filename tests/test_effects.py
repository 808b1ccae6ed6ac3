"""Both sides of an effect, in Rust and in Python, tell of the same one, and its signature is true."""

import re
from string import Formatter

import numpy as np
import pytest

from forklift import Truck, _core, commands, simulate
from forklift.effects import EFFECTS
from forklift.names import of_effect

SPECS = {spec["id"]: spec for spec in _core.effect_table()}
THESIS = Truck.read("thesis")


def lowering(truck, *, lift="free", temperature=60.0, load_kg=1500.0):
    """Three seconds at one opening after one at rest, then shut."""
    steps = np.repeat([0, 105, 0], [50, 150, 50])
    current = commands.low_pass(commands.steps_to_current(steps), 50.0, 3.0)
    command = commands.Command.of_samples(50.0, **{lift: current})
    return simulate(truck, command, load_kg=load_kg, oil_temperature_degc=temperature)


def test_both_sides_list_the_same_effects_in_the_same_order():
    assert [effect.id for effect in EFFECTS] == list(SPECS)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_a_sentence_names_the_amplitude_and_no_parameter_that_is_not_there(effect):
    spec = SPECS[effect.id]
    parameters = [parameter["name"] for parameter in spec["parameters"]]
    places = {"lift"} if spec["scope"] == "lift" else set()
    named = {name for _, name, _, _ in Formatter().parse(effect.sentence) if name}
    assert {parameters[0], *places} <= named <= {*parameters, *places}
    assert effect.sentence.endswith(".")
    assert effect.signature.endswith(".")


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_what_an_effect_is_confused_with_is_named_by_ids_other_than_its_own(effect):
    assert effect.confused_with
    assert effect.id not in effect.confused_with
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)*", other) for other in effect.confused_with)


@pytest.mark.parametrize("solver", ["adaptive", "fixed"])
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_at_its_quiet_value_an_effect_changes_no_bit(effect, solver):
    spec = SPECS[effect.id]
    amplitude = spec["parameters"][0]["name"]
    values = {
        name: spec["quiet"] if name.endswith(f".{amplitude}") else (row["lower"] + row["upper"]) / 2
        for name, row in of_effect(spec).items()
    }
    command = commands.generate("prms", "both", duration_s=4.0)
    plain, quiet = (
        simulate(truck, command, load_kg=800.0, oil_temperature_degc=45.0, solver=solver)
        for truck in (THESIS, THESIS.with_values(values))
    )
    np.testing.assert_array_equal(quiet.outputs, plain.outputs)


def test_friction_that_falls_with_temperature_shows_in_the_pressure_and_hardly_in_the_steady_speed():
    rate, sigma_2 = 0.02, THESIS.values["free.friction.sigma_2"]
    effective = THESIS.with_values({"free.friction_temperature.rate": rate})
    last_second = slice(145, 195)  # before the valve shuts
    for temperature in (60.0, 5.0):
        plain, other = (
            lowering(truck, temperature=temperature, load_kg=0.0) for truck in (THESIS, effective)
        )
        speed = plain["velocity_free_m_s"][last_second].mean()
        assert other["velocity_free_m_s"][last_second].mean() == pytest.approx(speed, rel=0.02)
        pressure = (other["pressure_free_pa"] - plain["pressure_free_pa"])[last_second].mean()
        force = sigma_2 * (1 - np.exp(-rate * (temperature - 20.0))) * (-speed / 2)  # the cylinder's speed
        assert pressure == pytest.approx(force / THESIS.values["free.cylinder.area"], rel=0.1)


def test_joined_lifts_show_in_the_pressure_of_the_lift_whose_valve_is_shut_and_not_in_steady_lowering():
    joined = THESIS.with_values({"mast_coupling.factor": 1.0})
    other = lowering(joined, lift="main")["pressure_free_pa"]
    alone = lowering(THESIS, lift="main")["pressure_free_pa"]
    assert np.abs(other - alone)[50:100].max() > 1e5
    assert np.ptp(alone) < 1e3
    light = lowering(joined, lift="main", load_kg=0.0)["pressure_free_pa"]
    assert np.ptp(light) < np.ptp(other)


def test_a_leaking_cylinder_sinks_at_the_speed_of_its_leakage_with_the_valve_shut():
    coefficient = 1.5e-12
    leaking = THESIS.with_values({"main.leakage.coefficient": coefficient})
    still = commands.Command.of_samples(50.0, main=np.zeros(500))
    for load in (0.0, 1500.0):
        plain, sinking = (
            simulate(truck, still, load_kg=load, oil_temperature_degc=40.0) for truck in (THESIS, leaking)
        )
        over_tank = plain["pressure_main_pa"][-1] - THESIS.values["main.tank.pressure"]
        sunk = (sinking["position_main_m"] - plain["position_main_m"])[[250, -1]]
        speed = (sunk[0] - sunk[1]) / (sinking.time_s[-1] - sinking.time_s[250])
        assert speed == pytest.approx(coefficient * over_tank / THESIS.values["main.cylinder.area"], rel=0.1)

"""The Python and the Rust side of an effect tell of the same effect, and the traces told are those it leaves."""

import re
from string import Formatter

import numpy as np
import pytest

from forklift import Truck, _core, commands, simulate
from forklift.effects import EFFECTS

SPECS = {spec["id"]: spec for spec in _core.effect_table()}
THESIS = Truck.read("thesis")


def lowering(truck, *, lift="free", temperature=60.0, load_kg=1500.0):
    """Three seconds at one opening after one at rest, then shut."""
    steps = np.repeat([0, 120, 0], [50, 150, 50])
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


def test_friction_that_falls_with_temperature_shows_in_the_pressure_and_hardly_in_the_steady_speed():
    steady = slice(150, 195)  # the last second before the valve shuts
    warm, cold = (
        {
            "pressure": (effect["pressure_free_pa"] - plain["pressure_free_pa"])[steady].mean(),
            "speed": (effect["velocity_free_m_s"] / plain["velocity_free_m_s"])[steady].mean() - 1.0,
        }
        for effect, plain in (
            (lowering(truck, temperature=t), lowering(THESIS, temperature=t))
            for truck in [THESIS.with_values({"free.friction_temperature.rate": 0.02})]
            for t in (60.0, 5.0)
        )
    )
    assert warm["pressure"] > 1e5
    assert cold["pressure"] < -1e5
    assert abs(warm["speed"]) < 0.02
    assert abs(cold["speed"]) < 0.02


def test_joined_lifts_show_in_the_pressure_of_the_lift_whose_valve_is_shut_and_not_in_steady_lowering():
    joined = THESIS.with_values({"mast_coupling.factor": 1.0})
    other = lowering(joined, lift="main")["pressure_free_pa"]
    alone = lowering(THESIS, lift="main")["pressure_free_pa"]
    assert np.abs(other - alone)[50:100].max() > 1e5
    assert np.ptp(alone) < 1e3
    light = lowering(joined, lift="main", load_kg=0.0)["pressure_free_pa"]
    assert np.ptp(light) < np.ptp(other)

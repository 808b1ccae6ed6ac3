"""Both sides of an effect, in Rust and in Python, tell of the same one, and its signature is true."""

import re
from string import Formatter
from typing import get_args

import numpy as np
import pytest

from forklift import Truck, _core, commands, simulate
from forklift.plant.forklift.effects import EFFECTS, Equation
from forklift.plant.forklift.hypotheses import hypotheses
from forklift.plant.forklift.tables import of_effect
from forklift.recordings.channels import LIFTS

SPECS = {spec["id"]: spec for spec in _core.effect_table()}
THESIS = Truck.read("thesis")


def lowering(truck, *, lift="free", temperature=60.0, load_kg=1500.0, shut_s=1):
    """Three seconds at one opening after one at rest, then shut."""
    steps = np.repeat([0, 105, 0], [50, 150, 50 * shut_s])
    current = commands.low_pass(commands.steps_to_current(steps), 50.0, 3.0)
    command = commands.Command.of_samples(50.0, **{lift: current})
    return simulate(truck, command, load_kg=load_kg, oil_temperature_degc=temperature)


def test_both_sides_list_the_same_effects_in_the_same_order():
    assert [effect.id for effect in EFFECTS] == list(SPECS)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_a_sentence_names_the_amplitudes_and_no_parameter_that_is_not_there(effect):
    spec = SPECS[effect.id]
    parameters = [parameter["name"] for parameter in spec["parameters"]]
    places = {"lift"} if spec["scope"] == "lift" else set()
    named = {name for _, name, _, _ in Formatter().parse(effect.sentence) if name}
    assert {*parameters[: spec["amplitudes"]], *places} <= named <= {*parameters, *places}
    assert effect.sentence.endswith(".")
    assert effect.signature.endswith(".")


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_what_an_effect_is_confused_with_is_named_by_ids_other_than_its_own(effect):
    assert effect.confused_with
    assert effect.id not in effect.confused_with
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)*", other) for other in effect.confused_with)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_what_is_plausible_of_an_effect_lies_within_its_bounds_and_is_not_silent(effect):
    spec = SPECS[effect.id]
    for row in spec["parameters"]:
        assert row["lower"] <= row["plausible_lower"] < row["plausible_upper"] <= row["upper"]
    for row in spec["parameters"][: spec["amplitudes"]]:
        assert spec["quiet"] not in (row["plausible_lower"], row["plausible_upper"])


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_an_effect_names_an_equation_of_the_diagnosis(effect):
    assert effect.equation in get_args(Equation)


@pytest.mark.parametrize("solver", ["adaptive", "fixed"])
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_at_its_quiet_value_an_effect_changes_no_bit(effect, solver):
    spec = SPECS[effect.id]
    amplitudes = [row["name"] for row in spec["parameters"][: spec["amplitudes"]]]
    values = {
        name: spec["quiet"] if row["name"] in amplitudes else row["plausible_lower"]
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


def effective(lift, effect, **parameters):
    """The thesis's truck with an effect on one lift, or on the mast where `lift` is None."""
    head = f"{lift}.{effect}" if lift else effect
    return THESIS.with_values({f"{head}.{name}": value for name, value in parameters.items()})


def test_a_late_valve_starts_the_lift_late_by_its_delay():
    delay = 0.06
    runs = [lowering(truck) for truck in (THESIS, effective("free", "valve_delay", delay=delay))]
    plain, late = (run["velocity_free_m_s"] for run in runs)
    time = runs[0].time_s
    shifted = np.interp(time - delay, time, plain)
    apart = np.abs(late - plain)[50:150].max()
    assert apart > 0.05
    assert np.abs(late - shifted)[50:150].max() < 0.3 * apart


def test_a_share_that_lags_leaves_the_lift_slower_at_first_and_not_at_length():
    lagging = lowering(effective("free", "valve_lag", share=0.3, time=0.3))["velocity_free_m_s"]
    plain = lowering(THESIS)["velocity_free_m_s"]
    assert np.abs(lagging[70]) < 0.9 * np.abs(plain[70])
    assert lagging[195] == pytest.approx(plain[195], rel=0.01)


def test_a_limited_current_limits_the_speed_at_high_commands_only():
    limited = effective("free", "valve_current_limit", share=1.0, limit=0.6, warming=0.0, time=10.0)
    steady = lowering(limited)["velocity_free_m_s"][145:195].mean()
    plain = lowering(THESIS)["velocity_free_m_s"][145:195].mean()
    assert abs(steady) < 0.9 * abs(plain)


def test_seals_hold_the_pressure_down_the_more_of_it_there_is():
    coefficient = 1e-4
    seals = effective("main", "friction_pressure", coefficient=coefficient)
    last_second = slice(145, 195)
    changes = []
    for load in (0.0, 1500.0):
        plain, held = (lowering(truck, lift="main", load_kg=load) for truck in (THESIS, seals))
        pressure = held["pressure_main_pa"][last_second].mean()
        changes.append(plain["pressure_main_pa"][last_second].mean() - pressure)
        # The bristles of the heavier friction have yet to bend all of their way.
        whole = coefficient * pressure / THESIS.values["main.cylinder.area"]
        assert 0.5 * whole < changes[-1] < 1.3 * whole
    assert changes[1] > 2.0 * changes[0]


def test_a_dent_shows_in_the_pressure_where_the_lift_comes_by_it():
    dent = effective("main", "friction_position", rise=1.0, centre=1.8, width=0.03)
    plain, other = (lowering(truck, lift="main") for truck in (THESIS, dent))
    apart = np.abs(other["pressure_main_pa"] - plain["pressure_main_pa"])
    assert other["position_main_m"][apart.argmax()] == pytest.approx(1.8, abs=0.05)
    assert apart.max() > 5e4


@pytest.mark.parametrize(
    ("effect", "parameters"),
    [
        ("entrained_air", {"fraction": 0.03, "exponent": 1.3}),
        ("chain_elasticity", {"compliance": 3e-6}),
        ("bulk_modulus_temperature", {"rate": 0.01}),
    ],
)
def test_softer_oil_and_chains_swing_more_slowly_and_lower_as_fast(effect, parameters):
    plain, soft = (lowering(truck) for truck in (THESIS, effective("free", effect, **parameters)))
    pressure = soft["pressure_free_pa"] - plain["pressure_free_pa"]
    assert np.abs(pressure).max() > 1e5
    speeds = [run["velocity_free_m_s"][145:195].mean() for run in (plain, soft)]
    assert speeds[1] == pytest.approx(speeds[0], rel=0.01)


def test_a_cushion_slows_the_lift_before_its_stop_and_nowhere_else():
    low = {"free.cylinder.stroke_lower": 0.75}
    cushion = {"free.end_cushion.coefficient": 5e4, "free.end_cushion.length": 0.1}
    plain, braked = (lowering(THESIS.with_values(values)) for values in (low, low | cushion))
    position = plain["position_free_m"] / 2
    before = position > 0.85
    np.testing.assert_array_equal(
        braked["velocity_free_m_s"][before][:60], plain["velocity_free_m_s"][before][:60]
    )
    assert (braked["pressure_free_pa"] - plain["pressure_free_pa"])[~before].min() < -3e4


def test_on_its_tyres_the_truck_shows_in_the_fork_height_and_in_the_resting_lift():
    soft = effective(None, "chassis_compliance", compliance=1e-6, frequency=2.5, damping_ratio=0.05)
    plain, other = (lowering(truck, lift="main") for truck in (THESIS, soft))
    forks = 2 * other["position_main_m"] + other["position_free_m"]
    assert 1e-3 < np.abs(other["fork_height_m"] - forks).max() < 0.1
    np.testing.assert_array_equal(
        plain["fork_height_m"], 2 * plain["position_main_m"] + plain["position_free_m"]
    )
    assert np.ptp(other["pressure_free_pa"]) > 1e5
    assert np.ptp(plain["pressure_free_pa"]) < 1e3


@pytest.mark.parametrize("effect", ["hose_resistance", "return_back_pressure"])
def test_a_lossy_line_slows_a_light_lift_with_its_valve_wide_open(effect):
    line = effective("free" if effect == "hose_resistance" else None, effect, coefficient=2e12)
    wide = commands.Command.of_samples(50.0, free=np.repeat([0.0, 1.4], [25, 75]))
    plain, slow = (
        simulate(truck, wide, load_kg=0.0, oil_temperature_degc=60.0)["velocity_free_m_s"][-1]
        for truck in (THESIS, line)
    )
    assert abs(slow) < 0.95 * abs(plain)


def test_vogels_law_slows_cold_lifts():
    law = effective("free", "viscosity_law", share=1.0, vogel=178.0, expansion=7e-4)
    speeds = {
        temperature: [
            lowering(truck, temperature=temperature)["velocity_free_m_s"][145:195].mean()
            for truck in (THESIS, law)
        ]
        for temperature in (20.0, -20.0)
    }
    assert speeds[20.0][1] == pytest.approx(speeds[20.0][0], rel=1e-6)
    assert abs(speeds[-20.0][1]) < 0.98 * abs(speeds[-20.0][0])


def test_oil_that_the_valve_heats_lets_the_lift_gain_speed():
    warm = effective("free", "oil_temperature_at_valve", resistance=5e-3, time=2.0)
    plain, other = (lowering(truck)["velocity_free_m_s"] for truck in (THESIS, warm))
    gained = [abs(other[k]) - abs(plain[k]) for k in (90, 195)]
    assert gained[1] > gained[0] > 0.0


def test_what_has_no_physics_of_its_own_is_no_suspect_by_name():
    general = {effect.id for effect in EFFECTS if effect.general}
    assert general == {"free_shape", "fine_shape", "hidden_resonance", "free_response"}
    offered = {
        hypothesis.id
        for hypothesis in hypotheses(Truck.read("thesis"), LIFTS, [], {})
        if hypothesis.kind == "physics"
    }
    assert offered == {effect.id for effect in EFFECTS} - general


def test_what_rings_shows_in_its_own_lifts_pressure_after_a_stop_and_not_in_the_steady_speed():
    frequency = 4.0
    ringing = effective("free", "hidden_resonance", mass=300.0, frequency=frequency, damping_ratio=0.02)
    plain, other = (lowering(truck, shut_s=3) for truck in (THESIS, ringing))
    last_second = slice(145, 195)
    speeds = [run["velocity_free_m_s"][last_second].mean() for run in (plain, other)]
    assert speeds[1] == pytest.approx(speeds[0], rel=5e-3)
    assert np.abs(other["pressure_free_pa"] - plain["pressure_free_pa"]).max() > 5e4
    np.testing.assert_allclose(other["pressure_main_pa"], plain["pressure_main_pa"], rtol=1e-3)
    # Beside the oil's swing, at 2 Hz with this load, it is the second one.
    after = (other["pressure_free_pa"] - plain["pressure_free_pa"])[215:]
    spectrum = np.abs(np.fft.rfft(after * np.hanning(len(after)), 4096))
    hertz = np.fft.rfftfreq(4096, 0.02)
    above = (hertz > 3.0) & (hertz < 8.0)
    assert hertz[above][spectrum[above].argmax()] == pytest.approx(frequency, rel=0.05)
    assert spectrum[above].max() > 0.2 * spectrum.max()


def opened(truck, current):
    """The main lift's velocity under a command of 50 samples a second."""
    command = commands.Command.of_samples(50.0, main=current)
    return simulate(truck, command, load_kg=800.0, oil_temperature_degc=40.0)["velocity_main_m_s"]


def answering(times):
    return effective(
        "main", "free_response", **{f"time_{k}": time for k, time in enumerate(times)}, range=0.8
    )


def test_a_valve_with_one_time_for_all_distances_lags_and_one_in_proportion_to_them_ramps():
    step = np.repeat([0.0, 0.8, 0.4], [25, 60, 40])
    plain = opened(THESIS, step)
    lag = opened(answering(7 * [0.06]), step)
    same = opened(effective("main", "valve_lag", share=1.0, time=0.06), step)
    assert np.abs(lag - same).max() < 1e-4 * np.abs(lag - plain).max()
    # 0.4 s/A, but for the rounded end.
    ramp = opened(answering([0.08 * max(k - 1, 0) for k in range(7)]), step)
    ramped = np.interp(np.arange(125) + 0.5, [25, 41, 85, 93], [0.0, 0.8, 0.8, 0.4])
    assert np.abs(ramp - opened(THESIS, ramped)).max() < 0.1 * np.abs(ramp - plain).max()

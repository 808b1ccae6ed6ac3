"""Controller tables: the inverse of the steady state, and its scaling with temperature."""

from __future__ import annotations

import json

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forklift import ForkliftError, Truck, commands, speed_to_current, temperature_scaling
from forklift.app import demo
from forklift.plant.forklift.speed_table import STILL_M_S

STEP_A = 1.75 / 255


def forward(table, current: np.ndarray, bend: float) -> np.ndarray:
    """Fork speed [m/s], downward positive, at the table's own conditions."""
    full = [np.full(len(current), value) for value in (bend, table.load_kg, table.oil_temperature_degc)]
    return -2.0 * table.truck.core.steady_state(table.lift, current, *full)[0][:, 0]


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    lift=st.sampled_from(["free", "main"]),
    load_kg=st.floats(0.0, 1500.0),
    temperature=st.floats(10.0, 70.0),
)
def test_a_table_composed_with_the_steady_speed_is_the_identity(seed, lift, load_kg, temperature):
    truck = demo.scattered(Truck.read("thesis"), seed)
    table = speed_to_current(truck, lift, load_kg=load_kg, oil_temperature_degc=temperature)
    moves = table.speed_m_s > 0.0
    for bend, current, step in (
        (1.0, table.rising_a, table.rising_step),
        (-1.0, table.falling_a, table.falling_step),
    ):
        assert (np.diff(current) >= 0.0).all()
        assert (np.diff(step) >= 0).all()
        assert np.abs(forward(table, current, bend) - table.speed_m_s)[moves].max() < 1e-6
        # By steps of the ECU: within what half a step more or less does.
        stepped = commands.steps_to_current(step)
        assert np.abs(stepped - current)[1:].max() <= STEP_A / 2 + 1e-9
        off = np.abs(forward(table, stepped, bend) - table.speed_m_s)[moves]
        reach = forward(table, current + STEP_A / 2, bend) - forward(table, current - STEP_A / 2, bend)
        assert (off <= reach[moves] + 1e-6).all()


@pytest.mark.parametrize("lift", ["free", "main"])
def test_zero_speed_has_the_largest_current_that_does_not_move_the_lift(lift):
    table = speed_to_current(Truck.read("thesis"), lift, load_kg=800.0)
    creep = forward(table, np.zeros(1), 1.0)[0]
    for bend, current, step in (
        (1.0, table.rising_a, table.rising_step),
        (-1.0, table.falling_a, table.falling_step),
    ):
        at, beyond = forward(table, current[0] + np.array([0.0, STEP_A]), bend)
        assert at <= creep + STILL_M_S * (1 + 1e-6) < beyond
        assert forward(table, commands.steps_to_current(step[:1]), bend)[0] <= creep + STILL_M_S
        assert current[0] > 0.3


def test_the_branches_lie_two_half_widths_of_the_hysteresis_apart():
    truck = Truck.read("thesis")
    table = speed_to_current(truck, "free", speeds=[0.1, 0.3, 0.5])
    assert table.speed_m_s.tolist() == [0.0, 0.1, 0.3, 0.5]
    apart = table.rising_a - table.falling_a
    assert apart == pytest.approx(np.full(4, 2 * truck.values["free.valve.f_hs"]), abs=1e-8)
    assert table.current_a == pytest.approx((table.rising_a + table.falling_a) / 2)


def test_the_table_of_a_lift_that_creeps_begins_at_zero():
    truck = Truck.read("thesis")
    narrow = [0.01 * area for area in truck.values["free.valve.table_area"]]
    table = speed_to_current(truck.with_values({"free.valve.table_area": narrow}, source="a guess"), "free")
    assert table.speed_m_s.tolist() == [0.0, table.fastest_m_s]
    assert 0.0 < table.fastest_m_s < 0.005


def test_speeds_that_cannot_be_reached_are_said_so():
    table = speed_to_current(Truck.read("thesis"), "free", speeds=[0.0, 0.5, 3.0, 4.0])
    assert table.reached.tolist() == [True, True, False, False]
    assert 0.5 < table.fastest_m_s < 1.0
    assert table.rising_a[2] == table.rising_a[3] <= 1.75
    assert forward(table, table.rising_a[2:3], 1.0)[0] == pytest.approx(table.fastest_m_s, abs=1e-6)
    assert "not reached" in str(table)


def test_the_load_hardly_matters_and_warm_oil_needs_less_current():
    # Section 4.3: the compensator holds the pressure over the valve; the temperature is not compensated for.
    truck = Truck.read("thesis")
    at = {
        (load, t): speed_to_current(
            truck, "free", speeds=[0.3], load_kg=load, oil_temperature_degc=t
        ).current_a[1]
        for load in (0.0, 1500.0)
        for t in (20.0, 60.0)
    }
    assert abs(at[0.0, 20.0] - at[1500.0, 20.0]) < 0.01
    assert at[0.0, 20.0] - at[0.0, 60.0] > 0.03


def test_a_table_is_written_and_read_back_and_is_plain_data(tmp_path):
    table = speed_to_current(Truck.read("thesis"), "main", speeds=[0.2, 0.4])
    read = pl.read_csv(table.write(tmp_path / "table.csv"))
    assert read.equals(table.to_polars())
    assert json.loads(json.dumps(table.to_dict()))["table"]["speed_m_s"] == [0.0, 0.2, 0.4]
    assert "main" in repr(table)
    with pytest.raises(ForkliftError) as error:
        table.write(tmp_path / "table.xlsx")
    assert error.value.code == "format-unknown"


@pytest.mark.parametrize("speeds", [[], [-0.1], [0.2, 0.1], [0.1, float("nan")], [[0.1]], ["fast"]])
def test_speeds_that_make_no_table_are_refused(speeds):
    with pytest.raises(ForkliftError) as error:
        speed_to_current(Truck.read("thesis"), "free", speeds=speeds)
    assert (error.value.code, error.value.name) == ("argument-invalid", "speeds")


def test_other_arguments_out_of_range_are_refused():
    for arguments in ({"lift": "both"}, {"load_kg": -1.0}, {"oil_temperature_degc": 500.0}):
        with pytest.raises(ForkliftError) as error:
            speed_to_current(Truck.read("thesis"), **({"lift": "free"} | arguments))
        assert error.value.code == "argument-invalid"


@pytest.mark.parametrize(("lift", "a", "b"), [("free", -0.0030497, 1.8571), ("main", -0.0023468, 1.6415)])
def test_a_scaled_table_serves_at_other_temperatures_and_scales_as_the_thesis_does(lift, a, b):
    truck = Truck.read("thesis")
    table = speed_to_current(truck, lift, load_kg=800.0)
    scaling = temperature_scaling(table, oil_temperatures_degc=(20.0, 40.0, 60.0))
    for temperature in (20.0, 60.0):
        other = speed_to_current(
            truck, lift, speeds=[0.05, 0.2, 0.4, 0.6], load_kg=800.0, oil_temperature_degc=temperature
        )
        use = other.speed_m_s > 0.0
        unscaled = np.abs(table.current(other.speed_m_s) - other.current_a)[use].max()
        scaled = np.abs(scaling.current(table, other.speed_m_s, temperature) - other.current_a)[use].max()
        assert scaled < 0.3 * unscaled
    # Table 5.3: what warm oil asks for over what cold oil does.
    cold, warm = ((t + 273.0) * scaling.a_per_k + scaling.b for t in (20.0, 60.0))
    assert warm / cold == pytest.approx(((333.0 * a + b) / (293.0 * a + b)), abs=0.03)


def test_a_scaling_needs_two_temperatures_and_a_lift_that_moves():
    table = speed_to_current(Truck.read("thesis"), "free", speeds=[0.1, 0.2, 0.3])
    with pytest.raises(ForkliftError) as error:
        temperature_scaling(table, oil_temperatures_degc=[20.0])
    assert error.value.code == "argument-invalid"

"""A sensor or a condition that is off is told with its direction and size; no mean where there is none."""

from __future__ import annotations

import re

import pytest

from forklift import Truck
from forklift.plant.forklift.hypotheses import hypotheses
from forklift.plant.forklift.vocabulary import ForkliftWords
from forklift.plant.misread import Found
from forklift.plant.protocol import Hypothesis
from forklift.recordings.noise import Sensor
from forklift.report.words import noise_power

CHANNELS = ["pressure_free_pa", "position_main_m"]


def hypothesis(id: str) -> Hypothesis:
    return next(one for one in hypotheses(Truck.read("thesis"), ["free"], CHANNELS, {}) if one.id == id)


def row(name: str, unit: str, value: float, reach: float) -> dict[str, object]:
    return {"name": name, "unit": unit, "value": value, "lower": value - reach, "upper": value + reach}


@pytest.mark.parametrize(
    ("id", "name", "unit", "value", "reach", "said", "way"),
    [
        ("pressure_gain", "pressure_free_pa.gain", "1", 1.0402, 3e-4, "4.02 %", "high"),
        ("pressure_gain", "pressure_free_pa.gain", "1", 0.97, 3e-3, "3 %", "low"),
        ("pressure_offset", "pressure_free_pa.offset", "Pa", -4e4, 4e3, "0.4 bar", "low"),
        ("sensor_lag", "pressure_free_pa.lag", "s", 0.025, 0.001, "25 ms", "late"),
    ],
)
def test_a_sensor_reads_high_or_low(id, name, unit, value, reach, said, way):
    found = ForkliftWords().found(hypothesis(id), [row(name, unit, value, reach)])
    assert found.clause.startswith("the free lift's pressure sensor reads")
    assert said in found.clause
    assert found.clause.endswith(way)
    _, low, high = map(float, re.findall(r"\d+(?:\.\d+)?", found.interval)[:3])
    assert 0.0 < low < float(said.split()[0]) < high


@pytest.mark.parametrize(("off", "way"), [(70.0, "too low"), (-90.0, "too high")])
def test_a_load_was_entered_too_low_or_too_high(off, way):
    rows = [
        row("load_entered.load", "kg", off, 0.2),
        row("load_entered.load in empty.csv", "kg", 0.0, 0.3),
        row("load_entered.load in one.csv", "kg", off + 0.1, 0.3),
        row("load_entered.load in other.csv", "kg", off - 0.1, 0.3),
    ]
    clause, interval = ForkliftWords().found(hypothesis("load_entered"), rows)
    assert f"{abs(off):.0f} kg {way}" in clause
    assert "2 of the 3 recordings fitted" in clause
    assert f"{abs(off) - 0.2:g} to {abs(off) + 0.2:g} kg" in interval


@pytest.mark.parametrize(("off", "way"), [(110.0, "too low"), (-60.0, "too high")])
def test_loads_that_are_off_by_the_same_are_told_by_one_number(off, way):
    """What was forgotten on every pallet; forks without one weigh what they do, to a quarter of a kilo."""
    rows = [
        row("load_entered.load in empty.csv", "kg", 0.24, 0.2),
        row("load_entered.load in one.csv", "kg", off + 0.1, 0.3),
        row("load_entered.load in other.csv", "kg", off - 0.1, 0.3),
    ]
    clause, interval = ForkliftWords().found(hypothesis("load_entered"), rows)
    assert clause.endswith(f"the load was entered {abs(off):.0f} kg {way} in 2 of the 3 recordings fitted")
    assert "0.24" not in interval
    assert "±0.3 kg" in interval


def test_a_condition_that_differs_from_recording_to_recording_is_told_by_its_range():
    rows = [
        row("temperature_offset.oil_temperature in cold.csv", "K", -18.0, 2.0),
        row("temperature_offset.oil_temperature in right.csv", "K", 1.0, 2.0),
        row("temperature_offset.oil_temperature in warm.csv", "K", 21.0, 2.0),
    ]
    clause, interval = ForkliftWords().found(hypothesis("temperature_offset"), rows)
    assert "−18 to +21 K" in clause
    assert "1 K" not in clause.replace("21 K", "")
    assert "2 of the 3" in clause
    assert "too low" in interval  # what a positive number means


def test_nothing_is_said_of_an_effect():
    assert ForkliftWords().found(hypothesis("leakage"), []) == Found()


def test_the_error_of_a_drawn_curve_is_told_in_units_of_the_noise_power():
    analogue, encoder = Sensor("pressure_free_pa", 0.3e5, 0.0), Sensor("position_main_m", 5e-4, 1e-3)
    assert noise_power(1.2e5, analogue) == pytest.approx(16.0)
    assert noise_power(1e-3, encoder) is None
    assert noise_power(1.0, None) is None

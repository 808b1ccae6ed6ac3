"""A condition that one sensor told wrongly in all recordings is off by one number, beside physics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forklift import Campaign, Recording, Truck, commands, diagnose, simulate
from forklift.app.demo import measured, scattered
from forklift.diagnosis.criteria import ALARM_CONDITION, ALARM_PHYSICS, alarm
from forklift.diagnosis.hypothesis import with_hypotheses
from forklift.diagnosis.screening import at_noise
from forklift.fitting.posing import pose
from forklift.plant.forklift.hypotheses import TEMPERATURE_WIDTH_K, hypotheses
from forklift.plant.subjects import subject

NULL = Path(__file__).parent / "campaigns" / "null"
OIL = "oil_temperature_degc"
ENTERED = 40.0
OFF_K = 6.0
"""What the sensor reads too much."""


def with_channel(recording, values):
    return replace(recording, channels=dict(recording.channels) | {OIL: values}, sha256="")


def without_oil(recording):
    channels = {name: values for name, values in recording.channels.items() if name != OIL}
    return replace(recording, channels=channels, sha256="")


@pytest.fixture(scope="module")
def posed():
    """Two recordings, of which one has a sensor for its oil, with the hypothesis that this sensor is off."""
    first, second, *_ = [one for one in Campaign.read(NULL).recordings if one.role == "estimate"]
    kept = (first, without_oil(second))
    machine, kept, _ = subject(Truck.read("thesis"), oil_temperature_degc=20.0).examined(kept)
    sensors = machine.sensors(kept)
    every = machine.hypotheses(kept, sensors)
    (off,) = [one for one in every if one.id == "temperature_offset" and one.amplitude]
    return at_noise(pose(machine, kept, machine.unknowns(), sensors)), off


def at_one(problem, off):
    """The problem with the hypothesis, and θ = 1 of its number."""
    wider = with_hypotheses(problem, [off])
    x = np.zeros(wider.starts[-1])
    x[[one.name for one in wider.unknowns].index(off.amplitude)] = 1.0
    return wider, x


def test_it_warms_the_recordings_of_its_sensor_and_no_others(posed):
    problem, off = posed
    wider, x = at_one(problem, off)
    place = problem.samples[0].names.index("oil_temperature")
    here = [wider.conditions(x, k)[place] for k in range(2)]
    right = [problem.conditions(np.zeros(problem.starts[-1]), k)[place] for k in range(2)]
    assert here[0] - right[0] == pytest.approx(TEMPERATURE_WIDTH_K)
    assert here[1] == right[1]
    assert off.doubts == ("oil_temperature",)


def test_its_slope_is_the_quotient_of_differences(posed):
    problem, off = posed
    wider, x = at_one(problem, off)
    column = [one.name for one in wider.unknowns].index(off.amplitude)
    step = np.zeros_like(x)
    step[column] = 1e-3
    for said, more, less in zip(wider.linearise(x), wider.said(x + step), wider.said(x - step), strict=True):
        for channel, slope in said.slope.items():
            want = (more[channel] - less[channel]) / 2e-3
            assert slope[:, column] == pytest.approx(want, rel=2e-3, abs=2e-3 * (np.abs(want).max() + 1e-9))


def test_held_with_all_else_it_counts_once(posed):
    """Conditions that are held are those that were told: its number is still to come on top."""
    problem, off = posed
    wider, x = at_one(problem, off)
    held, at = wider.with_fixed(x, (), conditions=False)
    for one, other in zip(held.said(at), wider.said(x), strict=True):
        for channel, values in one.items():
            assert values == pytest.approx(other[channel], rel=1e-9, abs=1e-12)


def test_one_number_must_promise_what_physics_does_and_one_a_recording_more(posed):
    _, off = posed
    each = next(one for one in hypotheses(Truck.read("thesis"), ["free"], [], {}) if one.kind == "parameter")
    assert alarm(off) == ALARM_PHYSICS < alarm(each) == ALARM_CONDITION


@pytest.fixture(scope="module")
def one_sensor_off():
    """Recordings in oil of 20 and 60 degC, of which a sensor reads too much, and in 40 degC, as was entered.

    With a sensor in all of them the oil's viscosity makes up for what that is off by.
    """
    truck, found = scattered(Truck.read("thesis"), 4), []
    for place, (load, degc, role) in enumerate(
        (load, degc, role)
        for load in (0.0, 1200.0)
        for degc in (20.0, ENTERED, 60.0)
        for role in ("estimate", "validate")
    ):
        prms = commands.generate("prms", "free", duration_s=8.0, seed=100 + place)
        run = simulate(truck, prms, load_kg=load, oil_temperature_degc=degc)
        table = measured(run, 4, place)
        columns = {name: table[name].to_numpy() for name in table.columns if name != "time_s"}
        one = Recording(f"{load:.0f}kg_{degc:.0f}c_{role}.csv", "free", load, role, run.time_s, columns)
        found.append(without_oil(one) if degc == ENTERED else with_channel(one, one.channels[OIL] + OFF_K))
    return diagnose(Campaign("off", 50.0, tuple(found)), "thesis", oil_temperature_degc=ENTERED)


def test_a_sensor_that_is_off_is_told_by_one_number(one_sensor_off):
    found = one_sensor_off.to_dict()
    assert found["verdict"] == "parameter-error"
    assert "too high" in found["sentence"]
    (cause,) = found["causes"]
    assert (cause["id"], cause["where"], cause["form"]) == ("temperature_offset", OIL, "complete")
    (number,) = cause["parameters"]
    assert number["lower"] <= -OFF_K <= number["upper"] < 0.0


def test_its_recordings_are_corrected_and_no_others(one_sensor_off, tmp_path):
    one_sensor_off.write(tmp_path / "found")
    corrected = Campaign.read(tmp_path / "found" / "corrected")
    off = one_sensor_off.to_dict()["causes"][0]["parameters"][0]["value"]
    for one, was in zip(corrected, one_sensor_off.recordings, strict=True):
        if OIL in was.channels:
            assert np.mean(one[OIL]) - np.mean(was[OIL]) == pytest.approx(off, abs=0.3)
        else:
            assert OIL not in one.channels

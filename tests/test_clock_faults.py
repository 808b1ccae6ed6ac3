"""A clock that started apart or runs fast is estimated wherever a channel has a clock of its own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import clocked
from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, fit
from forklift.ensemble.uncertainty import of_knowledge
from forklift.plant.forklift.clocks import clocks_apart
from forklift.plant.forklift.sensors import sensors
from forklift.plant.sensor_faults import read, sensor_unknown
from forklift.recordings.clocks import Sampled, union
from forklift.recordings.formats.signals import Place
from forklift.recordings.recording import Recording


@pytest.mark.parametrize(("fault", "theta"), [("shift", 0.6), ("shift", -0.4), ("drift", 1.5), ("lag", 0.3)])
def test_what_a_clock_reads_and_its_slope_are_right(fault, theta):
    time = np.arange(0.0, 12.0, 0.01)
    columns = {"pressure_free_pa": 0}
    number = sensor_unknown(["pressure_free_pa"], fault, "s")

    def reading(at):
        true = np.sin(0.7 * time)[:, None]
        return read(time, true, np.zeros((len(time), 1, 0)), [(number, at)], columns, 0)

    values, slopes = reading(theta)
    late = float(number.values(theta)[0]) * (time if fault == "drift" else 1.0)
    inside = (time - late >= 0.1) & (time - late <= time[-1] - 0.1)
    np.testing.assert_allclose(values[inside, 0], np.sin(0.7 * (time - late))[inside], atol=1e-5)
    step = 1e-4
    quotient = (reading(theta + step)[0] - reading(theta - step)[0])[:, 0] / (
        float(number.values(theta + step)[0]) - float(number.values(theta - step)[0])
    )
    np.testing.assert_allclose(slopes[inside, 0, 0], quotient[inside], atol=0.02 * np.abs(quotient).max())


EXPECTED = {
    "one clock": (),
    "100, 50 and 10 Hz": (),
    "gaps": (),
    "3 ms late": (("pressure_free_pa",),),
}


def recorded(recording: Recording, how: str) -> Recording:
    return logged(recording, clocked.CLOCKS[how])


def logged(recording: Recording, clocks: Callable[[Recording], clocked.Columns]) -> Recording:
    columns = {name: Sampled(*found) for name, found in clocks(recording).items()}
    time, channels, rows = union(Place("x", "x"), columns)
    return Recording(
        recording.file, recording.lift, recording.load_kg, recording.role, time, channels, rows=rows
    )


@pytest.mark.parametrize("how", list(clocked.CLOCKS))
def test_clocks_apart_are_seen_and_lost_samples_are_no_clock(how):
    recordings = [recorded(one, how) for one in Campaign.read(CAMPAIGNS / "null").recordings[:2]]
    measured = list(sensors(recordings))
    assert clocks_apart(recordings, measured) == EXPECTED.get(how, (tuple(measured),))


@pytest.fixture(scope="module", params=["7 ms of phase", "3 ms late", "0.3 % fast", "gaps"])
def fitted(request):
    recordings = [recorded(one, request.param) for one in Campaign.read(CAMPAIGNS / "null").recordings]
    some = [one for one in recordings if "800kg" in one.file]
    return request.param, fit(Truck.read("thesis"), Campaign("clocks", 50.0, some), starts=1)


def test_a_fit_estimates_clocks_apart_says_so_and_keeps_the_truck(fitted, tmp_path):
    how, found = fitted
    off = {
        "7 ms of phase": ("shift_s", clocked.PHASE_S, "all sensors are"),
        "3 ms late": ("shift_s", clocked.LATE_S, "the pressure of the free lift are"),
        "0.3 % fast": ("drift", clocked.FAST - 1.0, "all sensors run"),
    }.get(how)
    told = [one for one in found.cautions if one.code == "clocks-apart"]
    rows = [name for name in found.parameters["name"].to_list() if ".clock_" in name]
    assert found.complete
    if off is None:
        assert (told, rows) == ([], [])
        return
    name, size, words = off
    (caution,) = told
    assert len(rows) == 1
    assert caution.facts[name]["lower"] <= size <= caution.facts[name]["upper"]
    assert words in caution.sentence
    assert caution.sentence in found.sentences
    drawn = of_knowledge(found.unknowns, found.knowledge, dict(found.truck.values))
    assert drawn["vary"].keys() == {one for one in found.parameters["name"] if ".clock_" not in one}
    page = (found.write(tmp_path / "fit") / "report.html").read_text(encoding="utf-8")
    assert all(row in page for row in rows)
    written = Truck.read(tmp_path / "fit" / "truck.toml")
    assert dict(written.values) == dict(found.truck.values)


def test_a_clock_that_is_known_to_run_right_is_held():
    some = [one for one in Campaign.read(CAMPAIGNS / "null").recordings if "1500kg_60c" in one.file]
    campaign = Campaign("clocks", 50.0, [recorded(one, "3 ms late") for one in some])
    found = fit(Truck.read("thesis"), campaign, starts=1, hold=["pressure_free_pa.clock_drift"])
    assert not [name for name in found.parameters["name"] if ".clock_" in name]
    (caution,) = [one for one in found.cautions if one.code == "clocks-apart"]
    assert caution.facts["shift_s"]["lower"] <= clocked.LATE_S <= caution.facts["shift_s"]["upper"]


def test_clocks_that_start_apart_by_another_amount_in_each_recording_are_followed():
    every = Campaign.read(CAMPAIGNS / "null").recordings
    some = [one for one in every if "800kg" in one.file or "1500kg_20c" in one.file]
    late = np.linspace(0.002, 0.018, len(some))[np.random.default_rng(1).permutation(len(some))]

    def clocks(by):
        return clocked.moved(lambda time: time + by)

    recordings = [logged(one, clocks(by)) for one, by in zip(some, late.tolist(), strict=True)]
    found = fit(Truck.read("thesis"), Campaign("clocks", 50.0, recordings), starts=1)
    assert found.complete
    (caution,) = [one for one in found.cautions if one.code == "clocks-apart"]
    fitted = [by for one, by in zip(some, late, strict=True) if one.role == "estimate"]
    told = caution.facts["shift_s"]
    assert not told["agree"]
    assert told["lower"] == pytest.approx(min(fitted), abs=1e-3)
    assert told["upper"] == pytest.approx(max(fitted), abs=1e-3)
    assert "by an amount of its own in each recording" in caution.sentence


def test_a_gain_an_offset_and_two_delays_of_one_channel_act_as_one_equation():
    time = np.arange(0.0, 12.0, 0.01)
    faults = [("offset", 0.3), ("gain", 0.5), ("shift", 0.4), ("drift", -0.8)]
    numbers = [(sensor_unknown(["pressure_free_pa"], fault, "Pa"), theta) for fault, theta in faults]
    true = np.sin(0.7 * time)
    along = np.stack([np.cos(0.7 * time), 0.2 * time], axis=1)[:, None, :]

    def reading(moved=None, step=0.0):
        at = [(one, theta + step * (k == moved)) for k, (one, theta) in enumerate(numbers)]
        return read(time, true[:, None], along, at, {"pressure_free_pa": 0}, 1)

    values, slopes = reading()
    offset, gain, shift, drift = (float(one.values(theta)[0]) for one, theta in numbers)
    then = time - shift - drift * time
    inside = (then > 0.1) & (then < 11.9)
    expected = gain * np.sin(0.7 * then) + offset
    np.testing.assert_allclose(values[inside, 0], expected[inside], rtol=0.0, atol=1e-5 * offset)
    np.testing.assert_allclose(slopes[inside, 0, 0], gain * np.cos(0.7 * then)[inside], atol=1e-4)
    np.testing.assert_allclose(slopes[inside, 0, -1], gain * 0.2 * then[inside], atol=1e-6)
    for k, (one, theta) in enumerate(numbers):
        step = 1e-4
        by = float(one.values(theta + step)[0]) - float(one.values(theta - step)[0])
        quotient = (reading(k, step)[0] - reading(k, -step)[0])[:, 0] / by
        size = np.abs(quotient).max()
        np.testing.assert_allclose(slopes[inside, 0, 1 + k], quotient[inside], atol=0.02 * size)

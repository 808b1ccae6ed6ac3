"""A clock that started apart or runs fast is a hypothesis wherever a channel has a clock of its own."""

from __future__ import annotations

import numpy as np
import pytest

import clocked
from campaigns import CAMPAIGNS
from forklift import Campaign, Truck
from forklift.plant.forklift.hypotheses import clocks_apart, hypotheses
from forklift.plant.forklift.sensors import sensors
from forklift.plant.protocol import Hypothesis
from forklift.plant.sensor_faults import sensor_unknown
from forklift.recordings.clocks import Sampled, union
from forklift.recordings.formats.signals import Place
from forklift.recordings.recording import Recording


@pytest.mark.parametrize(("fault", "theta"), [("shift", 0.6), ("shift", -0.4), ("drift", 1.5), ("lag", 0.3)])
def test_what_a_clock_reads_and_its_slope_are_right(fault, theta):
    time = np.arange(0.0, 12.0, 0.01)
    columns = {"pressure_free_pa": 0}
    number = sensor_unknown(["pressure_free_pa"], fault, "s")

    def read(at):
        true = np.sin(0.7 * time)[:, None]
        return number.read(time, true, np.zeros((len(time), 1, 0)), at, columns)

    values, slopes = read(theta)
    late = float(number.values(theta)[0]) * (time if fault == "drift" else 1.0)
    inside = (time - late >= 0.1) & (time - late <= time[-1] - 0.1)
    np.testing.assert_allclose(values[inside, 0], np.sin(0.7 * (time - late))[inside], atol=1e-5)
    step = 1e-4
    quotient = (read(theta + step)[0] - read(theta - step)[0])[:, 0] / (
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
    columns = {name: Sampled(*found) for name, found in clocked.CLOCKS[how](recording).items()}
    time, channels, rows = union(Place("x", "x"), columns)
    return Recording(
        recording.file, recording.lift, recording.load_kg, recording.role, time, channels, rows=rows
    )


@pytest.mark.parametrize("how", list(clocked.CLOCKS))
def test_clocks_apart_are_seen_and_lost_samples_are_no_clock(how):
    recordings = [recorded(one, how) for one in Campaign.read(CAMPAIGNS / "null").recordings[:2]]
    measured = list(sensors(recordings))
    assert clocks_apart(recordings, measured) == EXPECTED.get(how, (tuple(measured),))


def dead_time(how: str) -> Hypothesis:
    """The free valve's dead time, among the hypotheses for a recording logged so."""
    recordings = [recorded(one, how) for one in Campaign.read(CAMPAIGNS / "null").recordings[:2]]
    measured = list(sensors(recordings))
    every = hypotheses(Truck.read("thesis"), ["free"], measured, {}, clocks_apart(recordings, measured))
    return next(one for one in every if one.label == "free.valve_delay")


@pytest.mark.parametrize("how", list(clocked.CLOCKS))
def test_a_dead_time_yields_to_clocks_only_where_every_sensor_has_another_than_the_command(how):
    assert dead_time(how).unlikely == (how in ("7 ms of phase", "0.3 % fast"))

"""A sensor's gain, offset and lag as unknowns."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck
from forklift.fitting.observed import by_channel
from forklift.fitting.posing import pose
from forklift.plant.forklift.model import Forklift
from forklift.plant.forklift.sensors import sensors
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.unknowns import unknowns
from forklift.plant.sensor_faults import read, sensor_unknown

TIME = np.arange(0.0, 2.0, 0.02)
CHANNELS = list(outputs())
PLACES = {name: k for k, name in enumerate(CHANNELS)}


def said() -> np.ndarray:
    """(times, outputs) smooth and all different."""
    return np.stack([np.sin((k + 1) * TIME) + 2.0 for k in range(len(CHANNELS))], axis=1)


@pytest.mark.parametrize("fault", ["gain", "offset", "lag"])
def test_a_right_sensor_reads_the_truth_to_the_bit(fault):
    number = sensor_unknown(["pressure_free_pa"], fault, "Pa")
    values, _ = read(TIME, said(), np.zeros((100, 7, 0)), [(number, 0.0)], PLACES, 0)
    assert np.array_equal(values, said())


@given(theta=st.floats(-3.0, 3.0))
def test_only_its_own_channel_is_read_wrongly(theta):
    number = sensor_unknown(["pressure_free_pa"], "gain", "Pa")
    values, slopes = read(TIME, said(), np.ones((100, 7, 2)), [(number, theta)], PLACES, 2)
    own = CHANNELS.index("pressure_free_pa")
    assert values[:, own] == pytest.approx(said()[:, own] * (1.0 + 0.05 * theta))
    assert np.array_equal(np.delete(values, own, axis=1), np.delete(said(), own, axis=1))
    assert np.array_equal(slopes[:, own, :2], np.full((100, 2), number.values(theta)[0]))
    assert np.array_equal(slopes[:, own, 2], said()[:, own])


@given(ticks=st.integers(0, 20))
def test_a_lag_of_whole_ticks_shifts_the_samples(ticks):
    number = sensor_unknown(["fork_height_m"], "lag", "m")
    values, _ = read(TIME, said(), np.zeros((100, 7, 0)), [(number, 0.02 * ticks / 0.05)], PLACES, 0)
    own = CHANNELS.index("fork_height_m")
    late = said()[: 100 - ticks, own]
    assert values[ticks:, own] == pytest.approx(late, abs=1e-12)
    assert values[:ticks, own] == pytest.approx(said()[0, own])


def test_derivatives_along_readings_are_difference_quotients_beside_those_of_the_truck():
    campaign, thesis = Campaign.read(CAMPAIGNS / "null"), Truck.read("thesis")
    every = sensors(campaign.recordings)
    moved = (
        *unknowns(thesis, ["free"]),
        sensor_unknown(["pressure_free_pa"], "gain", "Pa"),
        sensor_unknown(["pressure_free_pa"], "lag", "Pa"),
        sensor_unknown(["fork_height_m"], "offset", "m"),
    )
    weights = {name: 3.0 * one.noise for name, one in every.items()}
    problem = pose(Forklift(thesis, ("free",)), campaign.recordings[:2], moved, every, weights)
    x = np.zeros(problem.starts[-1])
    x[len(moved) - 3 : len(moved)] = [0.3, 0.71, -0.4]
    runs, observed = problem.linearise(x), problem.samples[0].observed
    for j in (3, len(moved) - 3, len(moved) - 2, len(moved) - 1, len(moved) + 1):
        step = np.eye(len(x))[j] * 1e-4
        ahead, behind = (by_channel(observed, problem.residuals(at)[0]) for at in (x + step, x - step))
        for channel, there in ahead.items():
            quotient = (there - behind[channel]) / 2e-4
            size = max(1.0, np.abs(quotient).max())
            assert runs[0].jacobian[channel][:, j] == pytest.approx(quotient, abs=2e-3 * size), (j, channel)

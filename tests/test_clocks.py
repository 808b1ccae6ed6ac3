"""Every signal keeps its clock: noise, counts and misfit do not depend on how it was logged."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import clocked
from campaigns import CAMPAIGNS
from forklift import Campaign, Recording, Truck, compare
from forklift.plant.forklift.sensors import sensors
from forklift.recordings.clocks import Sampled, union
from forklift.recordings.cut import lowerings
from forklift.recordings.formats.signals import Place
from forklift.recordings.noise import noise_of

NOISE_WITHIN = 0.05


@cache
def null() -> Campaign:
    return Campaign.read(CAMPAIGNS / "null")


@pytest.fixture(scope="module", params=list(clocked.CLOCKS))
def logged(request, tmp_path_factory) -> tuple[str, Campaign]:
    folder = tmp_path_factory.mktemp("clocks") / "campaign"
    return request.param, Campaign.read(clocked.write(null(), folder, clocked.CLOCKS[request.param]))


def test_noise_and_counts_are_those_of_the_samples_whatever_the_clocks(logged):
    _, campaign = logged
    expected, found = sensors(null().recordings), sensors(campaign.recordings)
    assert set(found) == set(expected)
    for channel, sensor in expected.items():
        assert found[channel].count == pytest.approx(sensor.count, rel=1e-6), channel
        assert found[channel].noise == pytest.approx(sensor.noise, rel=NOISE_WITHIN), channel


def test_no_sample_is_moved_or_made_up(logged):
    how, campaign = logged
    for before, after in zip(null(), campaign, strict=True):
        for name, (time, values) in clocked.CLOCKS[how](before).items():
            own = after.own(name)
            last = before.time_s[-1] + (0.01 if how.startswith("100") else 0.0)
            there = time <= last + 1e-6
            np.testing.assert_allclose(own.time, time[there] - before.time_s[0], atol=1.1e-6)
            np.testing.assert_array_equal(own.values, values[there])


@pytest.mark.parametrize("how", ["100, 50 and 10 Hz", "gaps"])
def test_the_misfit_is_that_of_the_table_on_one_clock(how, tmp_path):
    some = Campaign("some", 50.0, null().recordings[:2])
    truck = Truck.read("thesis")
    logged = Campaign.read(clocked.write(some, tmp_path / "campaign", clocked.CLOCKS[how]))
    one, several = (compare(campaign, truck, solver="fixed") for campaign in (some, logged))
    for a, b in zip(one.fits.to_dicts(), several.fits.to_dicts(), strict=True):
        assert a["channel"] == b["channel"]
        if how == "gaps":
            assert b["rmse"] == pytest.approx(a["rmse"], rel=0.1)
        else:
            assert b["rmse"] == pytest.approx(a["rmse"], rel=1e-3)


@pytest.mark.parametrize("jitter", [0.0, 0.1, 0.3])
def test_noise_is_measured_on_an_uneven_clock_too(jitter):
    random = np.random.default_rng(3)
    time = 0.02 * (np.arange(2000) + jitter * random.uniform(-1.0, 1.0, 2000))
    truth = 0.1 * np.sin(2.0 * np.pi * 0.5 * time)
    told = noise_of([Sampled(time, truth + 1e-3 * random.standard_normal(2000))])
    assert told == pytest.approx(1e-3, rel=NOISE_WITHIN)


clock = st.builds(
    lambda first, steps: first + np.cumsum(steps),
    st.floats(0.0, 0.5),
    st.lists(st.floats(2e-3, 0.5), min_size=4, max_size=30),
)
NAMES = ("current_free_a", "current_main_a", "position_free_m", "oil_temperature_degc")


@settings(max_examples=50, deadline=None)
@given(clocks=st.lists(clock, min_size=4, max_size=4), shared=st.booleans())
def test_a_recording_on_several_clocks_written_reads_back_to_the_bit(tmp_path_factory, clocks, shared):
    if shared:
        clocks[1] = clocks[0]
    assume(max(clocks[0][0], clocks[1][0]) < min(clocks[0][-1], clocks[1][-1]))
    series = {
        name: Sampled(time, np.sin(np.arange(len(time)) * 1.7) ** 2)
        for name, time in zip(NAMES, clocks, strict=True)
    }
    time, channels, rows = union(Place("x", "x"), series)
    made = Recording("both.csv", "both", 0.0, "estimate", time, channels, rows=rows)
    assume(not made.on_one_clock)
    campaign = Campaign("clocks", 50.0, (made,))
    copy = Campaign.read(campaign.write(tmp_path_factory.mktemp("clocks") / "campaign"))
    assert copy == campaign
    assert copy[0].time_s.tobytes() == made.time_s.tobytes()


def test_a_lowering_cut_from_several_clocks_reads_back_to_the_bit(tmp_path):
    fast, slow = 0.02 * np.arange(1000), 0.007 + 0.05 * np.arange(400)
    command = np.where((fast > 5.003) & (fast < 8.0), 0.5, 0.0)
    series = {
        "current_free_a": Sampled(fast, command),
        "current_main_a": Sampled(slow, 0.0 * slow),
        "position_free_m": Sampled(slow + 0.003, 1.0 - 0.01 * slow),
    }
    time, channels, rows = union(Place("x", "x"), series)
    whole = Recording("free.csv", "free", 0.0, "estimate", time, channels, rows=rows)
    (part,) = lowerings(whole)
    campaign = Campaign("cut", 50.0, (part,))
    assert Campaign.read(campaign.write(tmp_path / "campaign")) == campaign
    assert part.duration_s == pytest.approx(3.0 + 2.5, abs=0.1)

"""A command that the lift answers at another time is told by a pattern: one edge is like any other edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, commands, simulate
from forklift.plant.forklift.checks.timing import shifted
from forklift.recordings.recording import Recording

COUNT_M = 1.96e-3
STOPS = {"free": -1.0, "main": -1.0}
KNOTS = (0.0, 1.0, 1.8, 4.0, 4.3, 6.2, 7.0, 10.5)


def slow(amplitude_a: float) -> Recording:
    """A driver's ramp, a step down to where the valve barely opens, and a lift that moves a few counts."""
    null = Campaign.read(CAMPAIGNS / "null")
    recording = next(one for one in null if one.lift == "free")
    time = np.arange(0.0, 10.5, 0.02)
    current = np.interp(time, KNOTS, amplitude_a * np.array([0.0, 0.0, 1.0, 1.0, 0.75, 0.75, 0.0, 0.0]))
    speed = np.interp(time - 0.1, KNOTS, [0.0, 0.0, 0.02, 0.02, 0.002, 0.002, 0.0, 0.0])
    position = COUNT_M * np.floor((1.0 - 0.02 * np.cumsum(speed)) / COUNT_M)
    channels = {name: np.full(len(time), values[0]) for name, values in recording.channels.items()}
    channels |= {"current_free_a": current, "position_free_m": position}
    return replace(recording, time_s=time, channels=channels)


@pytest.mark.parametrize("amplitude_a", [0.5, 0.55, 0.6, 0.65, 0.7])
def test_a_single_step_of_a_slow_lift_is_no_shift(amplitude_a):
    assert not list(shifted(slow(amplitude_a), Truck.read("thesis"), STOPS))


CREPT_S = (1.78, 1.94, 2.08, 2.26, 2.44, 2.58, 2.72, 2.88, 3.04, 3.2, 3.4, 3.98, 4.72, 5.48, 6.34, 8.12)
"""When the forks of a truck whose grease is stiff pass a count."""
HELD = (
    "0 0 0 0 0 0 0 0 0 0 0 8 18 27 35 44 54 58 60 60 58 57 57 58 60 60 58 57 57 58 58 56 54 51 49 49 49 "
    "51 51 50 49 47 47 49 50 51 51 49 48 47 48 49 50 51 50 49 47 47 49 50 49 47 45 45 45 45 47 47 45 44 "
    "43 43 45 46 47 46 44 43 43 45 46 47 46 45 43 43 44 46 47 44 34 24 13 3 1 0 0 0 0 14 33 51"
)
"""Hundredths of an ampere, 0.1 s apart: what its driver, or the dither on his command, does meanwhile."""


def test_forks_that_creep_say_nothing_of_a_clock():
    """What they did at a greater current looks like the waves of a later one, by chance."""
    levels = 0.01 * np.array(HELD.split(), float)
    time = np.arange(0.0, 10.1, 0.02)
    lowered = np.searchsorted(CREPT_S, time, side="right")
    channels = {
        "current_free_a": np.zeros(len(time)),
        "current_main_a": np.interp(time, 0.1 * np.arange(len(levels)), levels),
        "position_free_m": np.full(len(time), 1.96),
        "position_main_m": 1.96 - COUNT_M * lowered,
    }
    recording = Recording("creeps.csv", "main", 310.0, "estimate", time, channels)
    assert not list(shifted(recording, Truck.read("thesis"), STOPS))


@pytest.mark.parametrize("samples", [40, 50, 60])
def test_a_pattern_answered_at_another_time_is_one(samples):
    truck = Truck.read("thesis")
    found = []
    for recording in Campaign.read(CAMPAIGNS / "null"):
        moved = {name: np.roll(recording[name], samples) for name in ("current_free_a", "current_main_a")}
        late = replace(recording, channels={**recording.channels, **moved})
        assert not list(shifted(recording, truck, STOPS))
        found += [[one.code for one in shifted(late, truck, STOPS)]]
    assert found.count(["command-shifted"]) >= 0.9 * len(found)


EVERY_S = 0.4
LOWERED = {
    "free": "0 0 0 29 92 93 91 32 0 0 0 29 68 96 95 79 76 87 108 110 112 109 113 109 102 95 96",
    "main": "0 0 0 37 112 112 110 107 95 91 87 88 68 51 43 47 43 46 45 45 69 100 103 103 103 103",
}
"""Hundredths of an ampere, `EVERY_S` apart: a driver who lowers both lifts."""


def test_a_lift_that_the_other_one_slows_down_has_no_other_clock():
    """Both share a return line: the free lift slows where the main one opens, as if to an earlier command."""
    truck = Truck.read("thesis").with_values({"return_back_pressure.coefficient": 2e12})
    time = np.arange(0.0, 9.8, 0.02)
    command_a = {}
    for lift, told in LOWERED.items():
        levels = 0.01 * np.array(told.split(), float)
        command_a[lift] = np.interp(time, EVERY_S * np.arange(len(levels)), levels)
    command = commands.Command.of_samples(50.0, **command_a)
    run = simulate(truck, command, load_kg=0.0, oil_temperature_degc=60.0)
    rows = slice(len(time))
    slower = run["velocity_free_m_s"][415:430].mean() / run["velocity_free_m_s"][380:395].mean()
    assert slower < 0.6  # at a greater command
    channels = {f"current_{lift}_a": values for lift, values in command_a.items()}
    channels |= {f"position_{lift}_m": run[f"position_{lift}_m"][rows] for lift in command_a}
    recording = Recording("both.csv", "both", 0.0, "estimate", time, channels)
    assert not list(shifted(recording, Truck.read("thesis"), STOPS))

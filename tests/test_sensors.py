"""Sensors told from their samples: noise and counts of synthetic signals whose noise is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forklift import Recording, _core
from forklift.plant.forklift.sensors import LEAST_NOISE, sensor_of, sensors
from forklift.recordings.clocks import Sampled
from forklift.recordings.noise import Sensor, encoder_count, white_noise

N, RATE_HZ = 600, 50.0
TIME = np.arange(N) / RATE_HZ


def motion(seed: int, recordings: int = 8) -> list[np.ndarray]:
    """Lowerings [m] with the truck's oscillation of 2.5 Hz after each change of speed."""
    random = np.random.default_rng(seed)
    columns = []
    for _ in range(recordings):
        speed = np.repeat(random.uniform(0.0, 0.3, 10), N // 10)
        ringing = sum(
            np.where(at < TIME, np.exp(-3.0 * (TIME - at)) * np.sin(2.0 * np.pi * 2.5 * (TIME - at)), 0.0)
            for at in TIME[:: N // 10]
        )
        columns.append(2.0 - np.cumsum(speed) / RATE_HZ + 5e-3 * ringing)
    return columns


def recording(**channels: np.ndarray) -> Recording:
    dead = {"current_free_a": np.zeros(N), "current_main_a": np.zeros(N)}
    return Recording("made.csv", "free", 0.0, "estimate", TIME, dead | channels)


def noisy(columns: list[np.ndarray], noise: float, seed: int) -> list[np.ndarray]:
    random = np.random.default_rng([seed, 1])
    return [column + noise * random.standard_normal(N) for column in columns]


@pytest.mark.parametrize("noise", [3e-4, 1e-3, 1e-2])
def test_the_noise_of_a_moving_sensor_is_told_within_a_tenth(noise):
    told = [white_noise(noisy(motion(seed), noise, seed)) for seed in range(40)]
    assert np.abs(np.array(told) / noise - 1.0).max() < 0.10
    assert np.mean(told) == pytest.approx(noise, rel=0.03)


def test_motion_alone_is_hardly_taken_for_noise():
    assert max(white_noise(motion(seed)) for seed in range(10)) < 2e-5


@given(st.integers(0, 10_000), st.floats(1e-3, 1e3), st.floats(-1e3, 1e3), st.floats(-10.0, 10.0))
@settings(max_examples=30, deadline=None)
def test_the_noise_scales_with_the_signal_and_knows_no_offset_or_trend(seed, factor, offset, trend):
    column = noisy(motion(seed, 1), 1e-2, seed)[0]
    other = factor * (column + offset + trend * TIME)
    assert white_noise([other]) == pytest.approx(factor * white_noise([column]), rel=1e-3)


def test_odd_samples_and_steps_hardly_count():
    column = np.concatenate(noisy(motion(1), 1e-3, 1))
    spoilt = column.copy()
    spoilt[::100] += 1.0
    spoilt[N:] += 0.5
    assert white_noise([spoilt]) < 1.2 * white_noise([column])


def test_gaps_are_left_out():
    columns = noisy(motion(3), 1e-3, 3)
    for column in columns:
        column[100:130] = np.nan
    assert white_noise(columns) == pytest.approx(1e-3, rel=0.1)
    assert white_noise([np.full(N, np.nan)]) == 0.0


@pytest.mark.parametrize("count", [2e-3, 5e-3, 1e-2])
@pytest.mark.parametrize("decimals", [None, 6])
def test_an_encoders_count_is_recognised_however_far_its_file_is_rounded(count, decimals):
    for seed in range(10):
        columns = [np.floor(column / count) * count for column in motion(seed)]
        if decimals:
            columns = [np.round(column, decimals) for column in columns]
        assert encoder_count(columns) == pytest.approx(count, rel=1e-3)


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_an_encoder_with_an_offset_of_its_zero_is_one_still(seed):
    random = np.random.default_rng(seed)
    count, zero = 10.0 ** random.uniform(-2.7, -2.0), random.uniform(-1.0, 1.0)
    columns = [np.floor(column / count) * count + zero for column in motion(seed)]
    assert encoder_count(columns) == pytest.approx(count, rel=1e-3)


def test_an_encoder_that_bounces_over_one_edge_is_one_still():
    """A lift at rest on its oil while the other one moves: two readings, and not a sensor without noise."""
    edge = 1000 * _core.ENCODER_COUNT_M
    swing = edge + 1e-3 * np.sin(np.linspace(0.0, 60.0, 600))
    read = np.floor(swing / _core.ENCODER_COUNT_M) * _core.ENCODER_COUNT_M
    found = sensor_of("position_main_m", [Sampled(np.arange(600) / 50.0, read)])
    assert found.count == pytest.approx(_core.ENCODER_COUNT_M)


def test_noise_is_not_taken_for_an_encoder():
    for seed in range(20):
        assert encoder_count(noisy(motion(seed), 1e-3, seed)) == 0.0


def test_the_decimals_of_a_file_are_no_encoder():
    """A reading with noise of many times its last decimal: nearly every sample has a level of its own."""
    columns = [np.round(column, 6) for column in noisy(motion(1), 1e-3, 1)]
    assert encoder_count(columns) == 0.0


def test_a_coarse_analogue_sensor_is_one_with_noise_and_no_encoder():
    """Steps of half the noise: it has levels, but reads values and not intervals."""
    noise = 1e-2
    columns = [np.round(column / (0.5 * noise)) * 0.5 * noise for column in noisy(motion(2), noise, 2)]
    found = sensors([recording(fork_height_m=column) for column in columns])["fork_height_m"]
    assert found.count == 0.0
    assert found.noise == pytest.approx(noise, rel=0.1)


def test_the_sensors_of_the_simulated_truck_are_found_again():
    recordings = [
        recording(
            position_free_m=_core.encoder(column),
            pressure_free_pa=_core.pressure_sensor(5e6 + 1e5 * column, 1, 2 * k),
            fork_height_m=_core.height_sensor(column, 1, 2 * k + 1),
        )
        for k, column in enumerate(motion(5))
    ]
    noise = {
        name: np.std(np.concatenate([one[name] - true for one, true in zip(recordings, truth, strict=True)]))
        for name, truth in (
            ("pressure_free_pa", [5e6 + 1e5 * column for column in motion(5)]),
            ("fork_height_m", motion(5)),
        )
    }
    found = sensors(recordings)
    assert found["position_free_m"].count == pytest.approx(_core.ENCODER_COUNT_M, rel=1e-6)
    assert found["position_free_m"].noise == pytest.approx(_core.ENCODER_COUNT_M / np.sqrt(12.0), rel=1e-6)
    for name, std in noise.items():
        assert found[name].count == 0.0
        assert found[name].noise == pytest.approx(std, rel=0.1)


def test_an_encoder_that_never_moved_has_the_usual_count():
    found = sensors([recording(position_main_m=np.full(N, 1.25))])
    assert found["position_main_m"].count == _core.ENCODER_COUNT_M


def test_a_dead_channel_has_the_least_noise_and_an_empty_one_is_no_sensor():
    found = sensors([recording(pressure_free_pa=np.full(N, 2e6), fork_height_m=np.full(N, np.nan))])
    assert found["pressure_free_pa"].noise == LEAST_NOISE["Pa"]
    assert found["pressure_free_pa"].count == 0.0
    assert "fork_height_m" not in found


@pytest.mark.parametrize(
    ("rho", "rest"), [(0.0, 40), (0.5, 40), (0.5, 60), (0.8, 60), (0.8, 200), (0.9, 200)]
)
def test_the_size_of_coloured_noise_is_told_from_short_rests(rho, rest):
    """A short rest has less than the whole variance; sixth differences leave hardly any of slow noise."""
    random, noise, recordings = np.random.default_rng(5), 3e4, []
    current = np.where(np.arange(N) < rest, 0.0, 0.5)
    for _ in range(14):
        columns = {}
        for lift in ("free", "main"):
            drawn = random.standard_normal(N)
            for k in range(1, N):
                drawn[k] = rho * drawn[k - 1] + np.sqrt(1.0 - rho**2) * drawn[k]
            columns[f"pressure_{lift}_pa"] = 5e6 + noise * drawn
        columns |= {"current_free_a": current, "current_main_a": np.zeros(N)}
        recordings.append(Recording("made.csv", "free", 0.0, "estimate", TIME, columns))
    for sensor in sensors(recordings).values():
        assert sensor.noise == pytest.approx(noise, rel=0.25 if rho >= 0.8 else 0.12)
        assert sensor.correlation == pytest.approx(rho, abs=0.08)
        assert abs((sensor.noise / noise) ** 2 - 1.0) <= 3.0 * sensor.unsure if rho else sensor.unsure == 0.0


def test_slow_noise_has_more_together_and_fewer_independent_samples():
    white, slow = Sensor("pressure_free_pa", 1.0, 0.0), Sensor("pressure_free_pa", 1.0, 0.0, 0.8)
    assert (white.independent, white.together) == (1.0, 1.0)
    random, n = np.random.default_rng(1), 400
    drawn = random.standard_normal((2000, n))
    for k in range(1, n):
        drawn[:, k] = 0.8 * drawn[:, k - 1] + 0.6 * drawn[:, k]
    assert np.var(drawn.mean(axis=1)) * n == pytest.approx(slow.together, rel=0.1)
    assert 2.0 / (np.var(np.mean(drawn**2, axis=1)) * n) == pytest.approx(slow.independent, rel=0.1)

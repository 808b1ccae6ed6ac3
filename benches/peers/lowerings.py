"""The 64 lowerings every peer integrates, the two binary files of lowerings.h, and the measure of error."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

TICK_S = 0.02
DURATION_S = 10.0
START_M = 0.98
TRAVEL_M = 1.35


@dataclass(frozen=True)
class Lowerings:
    """Load [kg] and temperature [°C] of n lowerings, and their commands [A], shape (n, ticks)."""

    load_kg: np.ndarray
    temperature_degc: np.ndarray
    command_a: np.ndarray

    def __len__(self) -> int:
        return len(self.load_kg)

    def __getitem__(self, which: slice) -> "Lowerings":
        return Lowerings(self.load_kg[which], self.temperature_degc[which], self.command_a[which])

    def write(self, path: Path) -> None:
        """Write the lowerings file of lowerings.h."""
        n, ticks = self.command_a.shape
        rows = np.column_stack([self.load_kg, self.temperature_degc, self.command_a])
        head = np.array([n, ticks], "<i8").tobytes() + np.array([TICK_S], "<f8").tobytes()
        path.write_bytes(head + rows.astype("<f8").tobytes())


def read_trajectories(path: Path) -> tuple[np.ndarray, float]:
    """x [m], v [m/s], p_A [Pa], p_B [Pa] of shape (n, ticks + 1, 4), and the seconds they took together."""
    data = path.read_bytes()
    n, points = np.frombuffer(data, "<i8", 2)
    seconds = np.frombuffer(data, "<f8", 1, 16)[0]
    return np.frombuffer(data, "<f8", offset=24).reshape(n, points, 4), float(seconds)


def make(n: int = 64, seed: int = 2017) -> Lowerings:
    """Random multilevel commands in the working range, each of which keeps the cylinder off its bottom.

    Eight levels from 58 to 174 of 255 steps of 1.75 A, a new one with probability 0.05 a sample, through a
    first-order 3 Hz low-pass from rest. Where the steady speed would take the cylinder further than
    TRAVEL_M, all levels of that lowering are drawn towards 58 by one factor: it moves for the whole ten
    seconds, more slowly, and never meets an end stop.
    """
    random = np.random.default_rng(seed)
    ticks = round(DURATION_S / TICK_S)
    load, temperature = random.uniform(0, 1500, n), random.uniform(20, 60, n)
    command = np.empty((n, ticks))
    for k in range(n):
        switch = random.random(ticks) < 0.05
        drawn = random.integers(0, 8, ticks) / 7
        level = drawn[np.maximum.accumulate(np.where(switch, np.arange(ticks), 0))]
        command[k] = _filtered(level, _scale(level))
    return Lowerings(load, temperature, command)


def _filtered(level: np.ndarray, scale: float) -> np.ndarray:
    pole = np.exp(-2 * np.pi * 3.0 * TICK_S)
    command = np.zeros(len(level))
    for k, share in enumerate(level):
        raw = (58 + scale * 116 * share) * 1.75 / 255
        command[k] = (command[k - 1] if k else 0.0) * pole + raw * (1 - pole)
    return command


def _scale(level: np.ndarray) -> float:
    low, high = 0.0, 1.0
    if _steady_travel(_filtered(level, 1.0)) <= TRAVEL_M:
        return 1.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if _steady_travel(_filtered(level, middle)) <= TRAVEL_M else (low, middle)
    return low


def _steady_travel(command: np.ndarray) -> float:
    """Travel [m] at the preset pressure drop of 5.4 bar across the proportional valve."""
    area = np.interp(
        command, [0.36, 0.45, 0.6, 0.8, 1.0, 1.2, 1.4], np.array([0, 0.13, 0.66, 1.55, 2.6, 3.7, 4.4]) * 1e-5
    )
    speed = 0.67 * area * np.sqrt(2 * 5.4e5 / 860) / (np.pi * 0.0275**2)
    return float(speed.sum() * TICK_S)


@dataclass(frozen=True)
class Error:
    """Largest error along each trajectory, median and worst over the lowerings: v [m/s], p_A relative."""

    v_median: float
    v_worst: float
    p_median: float
    p_worst: float


def error(trajectories: np.ndarray, reference: np.ndarray) -> Error:
    """Compare x, v, p_A, p_B with the reference's; fewer lowerings than the reference are its first ones."""
    reference = reference[: len(trajectories)]
    v = np.abs(trajectories[..., 1] - reference[..., 1]).max(axis=1)
    p = np.abs(trajectories[..., 2] / reference[..., 2] - 1).max(axis=1)
    return Error(float(np.median(v)), float(v.max()), float(np.median(p)), float(p.max()))

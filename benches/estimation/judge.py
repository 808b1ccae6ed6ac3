"""One judge for all: the truck a method found, by forklift's adaptive integrator, against recordings.

What a recording has of its own (oil temperature, start) is first set to what explains it best, for every
method and every recording alike: three Gauss–Newton steps at the truck found.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.fitting.linearised import Linearised
from forklift.fitting.problem import LeastSquares as Problem
from forklift.fitting.sample import Sample
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.model import OWN
from forklift.plant.forklift.simulate import mean_temperature, simulate
from forklift.plant.forklift.truck import Truck
from forklift.plant.forklift.unknowns import move
from forklift.recordings.channels import LIFTS
from forklift.recordings.noise import Sensor

TOLERANCE = 1e-7
STEPS = 3
INSIDE = 1e-9  # prior standard deviations: a value at its bound may be rounded past it


@dataclass(frozen=True)
class Judged:
    """Mean square of one channel in one recording, in units of its sensor's noise."""

    file: str
    role: str
    channel: str
    mean_square: float


def judge(problem: Problem, theta: np.ndarray, sensors: Mapping[str, Sensor]) -> list[Judged]:
    """Every channel of every recording of `problem` at the shared unknowns θ.

    Raises
    ------
    ForkliftError
        If there is no such truck.
    """
    lower, upper = (ends[: len(theta)] for ends in problem.bounds())
    theta = np.clip(theta, lower + INSIDE, upper - INSIDE)
    x = np.concatenate([theta, np.zeros(problem.starts[-1] - len(theta))])
    truck = move(problem.machine.truck, problem.unknowns, theta, "fit")
    for _ in range(STEPS):
        steps = [
            _own_step(sample, at, problem.nuisance(x, k), sensors)
            for k, (sample, at) in enumerate(zip(problem.samples, problem.linearise(x), strict=True))
        ]
        x = x + np.concatenate([np.zeros(len(theta)), *steps])
    return [
        judged
        for k, sample in enumerate(problem.samples)
        for judged in _of_sample(truck, sample, problem.nuisance(x, k), sensors)
    ]


def _own_step(sample: Sample, at: Linearised, own: np.ndarray, sensors: Mapping[str, Sensor]) -> np.ndarray:
    rows, off = [np.eye(len(own))], [own]
    for seen in sample.observed:
        name, sensor = seen.sensor.channel, sensors[seen.sensor.channel]
        rows.append(at.slope[name][:, -len(own) :] / sensor.noise)
        off.append((at.model[name] - seen.values - 0.5 * sensor.count) / sensor.noise)
    return -np.linalg.lstsq(np.vstack(rows), np.concatenate(off))[0]


def _of_sample(
    truck: Truck, sample: Sample, phi: np.ndarray, sensors: Mapping[str, Sensor]
) -> Sequence[Judged]:
    recording = sample.recording
    own = dict(zip(OWN, (sample.centre + _at(sample, phi)).tolist(), strict=True))
    conditions = {
        "load_kg": own["load"],
        "oil_temperature_degc": mean_temperature(recording) + own["oil_temperature"],
    }
    command = Command(recording.time_s, *recording.command.T)
    at_rest = simulate(truck, command, time=recording.time_s[:1], **conditions)
    start = at_rest.states[0].copy()
    for lift in LIFTS:
        start[at_rest.state_names.index(f"{lift}.position")] = own[f"{lift}.start"]
    run = simulate(truck, command, start=start, tolerance=TOLERANCE, **conditions)
    judged = []
    for seen in sample.observed:
        name, sensor = seen.sensor.channel, sensors[seen.sensor.channel]
        left = (run[name][seen.rows] - seen.values - 0.5 * sensor.count) / sensor.noise
        judged.append(Judged(recording.file, recording.role, name, float(np.mean(left**2))))
    return judged


def _at(sample: Sample, phi: np.ndarray) -> np.ndarray:
    """How far a recording's own conditions are from their most likely values."""
    off = np.zeros(len(sample.centre))
    off[sample.free] = sample.width[sample.free] * phi
    return off

"""The fit as one would write it without forklift: residuals of a campaign, every simulation by CVODE.

Unknowns, priors and data are those of forklift's `Problem`; what differs is what a user would do: an encoder
is a Gaussian of count/√12 around the middle of its count, noise is not tempered, derivatives are differences.
Unknowns are carried in standard deviations of their priors, `OFFSET` added so that a solver's difference
quotients, whose steps are relative to an unknown, step by alike and by enough.
"""

from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from os import cpu_count
from threading import Lock
from time import perf_counter, process_time

import numpy as np
from cvode import Cvode, parameters_of

from forklift.fitting import likelihood
from forklift.fitting.observed import Observed
from forklift.fitting.problem import LeastSquares as Problem
from forklift.fitting.sample import Sample
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.model import OWN
from forklift.plant.forklift.simulate import mean_temperature, simulate
from forklift.plant.parameter import DEGREES
from forklift.recordings.noise import Sensor

FACTORS = {"free": 2.0, "main": 1.0}  # of a cylinder's position in what its encoder reads
OFFSET = 10.0
BAD = 1e4  # every residual of a truck that cannot be simulated
REMEMBERED = 4  # simulations of a recording that are kept


class OutOfTime(Exception):
    """A fit has used up its seconds."""


@dataclass
class Best:
    """What a fit has come to so far, and how."""

    x: np.ndarray
    cost: float = np.inf
    simulations: int = 0
    evaluations: int = 0
    trail: list[tuple[float, np.ndarray]] = field(default_factory=list)
    """Seconds and x of each point that was better than all before."""


class Usual:
    """Residuals along x, the unknown vector of `problem` with `OFFSET` added."""

    def __init__(
        self, problem: Problem, lifts: tuple[str, ...], sensors: Mapping[str, Sensor], cvode: Cvode
    ) -> None:
        self.problem, self.lifts, self.sensors, self.cvode = problem, lifts, sensors, cvode
        self.truck = problem.machine.truck
        core = self.truck.core
        self._values = dict(zip(core.names, core.values.tolist(), strict=True))
        self._still = [self._resting(sample) for sample in problem.samples]
        self._known: list[OrderedDict[bytes, np.ndarray | None]] = [OrderedDict() for _ in problem.samples]
        self._temperature = [mean_temperature(sample.recording) for sample in problem.samples]
        self._tick = [_tick(sample) for sample in problem.samples]
        self._lock = Lock()
        self._pool = ThreadPoolExecutor(cpu_count())
        self.limit = np.inf
        self.say: Callable[[str], None] = lambda line: None
        self.restart()

    @property
    def start(self) -> np.ndarray:
        """x at the problem's truck and the recordings' centres."""
        return np.full(self.problem.starts[-1], OFFSET)

    def restart(self) -> None:
        """Forget what was found, and set the clock to zero."""
        self.best = Best(self.start)
        self.began, self.began_processor, self._said = perf_counter(), process_time(), 0.0
        for known in self._known:
            known.clear()

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Those of the problem, along x."""
        lower, upper = self.problem.bounds()
        return lower + OFFSET, upper + OFFSET

    def residual(self, x: np.ndarray) -> np.ndarray:
        """All residuals: of the samples, of the priors, of the recordings' own unknowns."""
        if perf_counter() - self.began > self.limit:
            raise OutOfTime
        found = self._residual(np.asarray(x) - OFFSET)
        self.best.evaluations += 1
        cost = 0.5 * float(found @ found)
        seconds = perf_counter() - self.began
        if cost < self.best.cost:
            self.best.x, self.best.cost = np.array(x), cost
            self.best.trail.append((seconds, self.best.x))
        if seconds > self._said + 15.0:
            self._said = seconds
            self.say(f"{seconds:6.0f} s, {self.best.simulations} simulations, cost {self.best.cost:.6g}")
        return found

    def cost(self, vector: np.ndarray) -> float:
        """Half the sum of squares at a vector of the problem."""
        found = self._residual(vector)
        return 0.5 * float(found @ found)

    def _residual(self, vector: np.ndarray) -> np.ndarray:
        shared = len(self.problem.unknowns)
        theta = vector[:shared]
        values = dict(self._values)
        for unknown, at in zip(self.problem.unknowns, theta, strict=True):
            values |= zip(unknown.names, unknown.values(float(at)).tolist(), strict=True)
        parts = [likelihood.student(theta, DEGREES)[0], vector[shared:]]
        parameters = {lift: parameters_of(values, lift) for lift in self.lifts}
        parts += self._pool.map(lambda k: self._of_sample(k, vector, parameters), range(len(self._known)))
        return np.concatenate(parts)

    def _of_sample(self, k: int, vector: np.ndarray, parameters: Mapping[str, np.ndarray]) -> np.ndarray:
        sample = self.problem.samples[k]
        own = dict(zip(OWN, self.problem.conditions(vector, k).tolist(), strict=True))
        said = self.simulate(k, own, parameters)
        return np.concatenate([_misfit(seen, said, self.sensors) for seen in sample.observed])

    def simulate(
        self, k: int, own: Mapping[str, float], parameters: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray] | None:
        """Sensors' readings of recording k; a simulation that was made before is not made again."""
        sample = self.problem.samples[k]
        said: dict[str, np.ndarray] = {"fork_height_m": np.zeros(len(sample.recording))}
        for lift, factor in FACTORS.items():
            start = own[f"{lift}.start"]
            if lift in self.lifts:
                column = 0 if lift == "free" else 1
                conditions = (own["load"], self._temperature[k] + own["oil_temperature"], start)
                states = self._remembered(k, lift, column, parameters[lift], conditions)
                if states is None:
                    return None
                position, pressure = factor * states[:, 0], states[:, 2]
            else:  # it stands still whatever the unknowns are: only where is unknown
                position, pressure = self._still[k][lift]
                position = position + factor * (start - sample.centre[OWN.index(f"{lift}.start")])
            said[f"position_{lift}_m"], said[f"pressure_{lift}_pa"] = position, pressure
            said["fork_height_m"] = said["fork_height_m"] + 2.0 / factor * position
        return said

    def _remembered(
        self, k: int, lift: str, column: int, parameters: np.ndarray, conditions: tuple[float, float, float]
    ) -> np.ndarray | None:
        key = lift.encode() + parameters.tobytes() + np.array(conditions).tobytes()
        known = self._known[k]
        if key not in known:
            recording = self.problem.samples[k].recording
            known[key] = self.cvode(parameters, *conditions, self._tick[k], recording.command[:, column])
            with self._lock:
                self.best.simulations += 1
            if len(known) > REMEMBERED * len(self.lifts):
                known.popitem(last=False)
        known.move_to_end(key)
        return known[key]

    def _resting(self, sample: Sample) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Position and pressure of the lifts that are not estimated, at the recording's centre."""
        recording = sample.recording
        own = dict(zip(OWN, sample.centre.tolist(), strict=True))
        conditions = {"load_kg": own["load"], "oil_temperature_degc": mean_temperature(recording)}
        command = Command(recording.time_s, *recording.command.T)
        at_rest = simulate(self.truck, command, time=recording.time_s[:1], **conditions)
        start = at_rest.states[0].copy()
        for lift in FACTORS:
            start[at_rest.state_names.index(f"{lift}.position")] = own[f"{lift}.start"]
        run = simulate(self.truck, command, start=start, **conditions)
        return {
            lift: (run[f"position_{lift}_m"], run[f"pressure_{lift}_pa"])
            for lift in FACTORS
            if lift not in self.lifts
        }


def _misfit(
    seen: Observed, said: Mapping[str, np.ndarray] | None, sensors: Mapping[str, Sensor]
) -> np.ndarray:
    if said is None:
        return np.full(len(seen.rows), BAD)
    sensor = sensors[seen.sensor.channel]
    middle = seen.values + 0.5 * sensor.count
    return (said[seen.sensor.channel][seen.rows] - middle) / sensor.noise


def _tick(sample: Sample) -> float:
    steps = np.diff(sample.recording.time_s)
    if np.ptp(steps) > 1e-6:
        raise SystemExit(
            f"{sample.recording.file}: its samples are not evenly spaced, which CVODE here needs"
        )
    return float(np.mean(steps))

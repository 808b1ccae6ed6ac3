"""Which equation is wrong: an unknown input at each port in turn, smoothed, and compared by its evidence.

At the baseline's optimum the residuals are taken as linear in the truck's unknowns δ and in an unknown input
w(t) at one port, hats over time with an Ornstein–Uhlenbeck prior of unknown size a:

    r + J δ + R w = e,    δ ~ N(0, 1),  w ~ N(0, a² K),  e ~ N(0, s²)

R are the model's exact responses. The evidence, over all recordings together, with a and s at their best,
says at which port an input explains most (Kristensen, Madsen & Jørgensen 2004 with a diffusion term at one
state in turn; here solved as a smoother). A sensor is its own rival: hats on its signal.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from os import cpu_count

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.diagnosis.criteria import MEMORY, STANDS
from forklift.diagnosis.rounding import rounded
from forklift.fitting.interface import Problem, Sample
from forklift.fitting.linearised import Linearised
from forklift.plant.protocol import Responses

SIZES = tuple(float(size) for size in 10.0 ** np.arange(-4.0, 3.1, 0.5))
"""a, in units in which the port's whole response has unit mean square."""
MOST_TURNS, SAME_NOISE = 4, 1e-3
"""How often the noise that an input leaves is worked out anew at most, and which share by the last time."""


@dataclass(frozen=True, eq=False)
class UnknownInput:
    """What an unknown input at one port explains, and what it looks like."""

    port: str
    evidence: float
    """ln of the evidence, less that without an input."""
    size: float
    noise: float
    """s: what is left of the residuals, in units of the sensors' noise."""
    centres: tuple[Floats, ...]
    """Per recording, times of the hats [s]."""
    values: tuple[Floats, ...]
    """Per recording, the smoothed input at those times, in the port's unit."""
    bands: tuple[Floats, ...]
    """Their posterior standard deviations."""


@dataclass(frozen=True)
class _Known:
    """One recording without an input."""

    place: NDArray[np.intp]
    jacobian: Floats
    residual: Floats
    normal: Floats
    """JᵀJ."""
    gradient: Floats
    """Jᵀr."""
    centres: Floats


@dataclass(frozen=True)
class _Part:
    """One recording with an input, its prior diagonal: w = root u, u ~ N(0, a²)."""

    known: _Known
    root: Floats
    values: Floats
    """Of rootᵀRᵀR root = diag(values)."""
    cross: Floats
    """rootᵀRᵀJ."""
    pull: Floats
    """rootᵀRᵀr."""


def unknown_inputs(problem: Problem, x: Floats, ports: Sequence[str], width_s: float) -> list[UnknownInput]:
    """An unknown input at each port in turn; ports named after a channel are its sensor. Best first.

    Its hats are `width_s` apart, and its prior's correlation time is twice that.
    """
    noise = {name: _noise(problem, name) for name in problem.sigma}
    known = [
        _known(problem, k, sample, run, noise, width_s)
        for k, (sample, run) in enumerate(zip(problem.samples, problem.linearise(x), strict=True))
    ]

    inner = [port for port in ports if port not in noise]

    def asked(k: int) -> Responses:
        return problem.respond(x, k, inner, known[k].centres, width_s)

    def part(k: int, port: str) -> _Part:
        sample, centres = problem.samples[k], known[k].centres
        if port in noise:
            rows = _of_sensor(sample, port, centres, noise, width_s)
        else:
            rows = _of_port(sample, answers[k].at(port), noise)
        return _with_input(known[k], rows, width_s)

    found = []
    with one_thread(), ThreadPoolExecutor(cpu_count()) as pool:
        answers = list(pool.map(asked, range(len(known))))
        for port in ports:
            parts = list(pool.map(partial(part, port=port), range(len(known))))
            answer = _best(port, parts, problem.starts[-1])
            if answer:
                found.append(answer)
    return sorted(found, key=lambda one: -one.evidence)


def sensors_behind(inputs: Sequence[UnknownInput], sensors: Collection[str]) -> list[UnknownInput]:
    """The most credible first; and before a sensor a place of the machine that stands for it. Every fault of
    a sensor has a name, by which it was asked for, and what acts on one signal follows it the most freely."""
    least = STANDS * inputs[0].evidence
    first = next((one for one in inputs if one.port not in sensors and one.evidence >= least), inputs[0])
    return [first, *(one for one in inputs if one is not first)]


def hats(sample: Sample, width_s: float) -> Floats:
    """The times of a recording's hats [s]."""
    time = sample.recording.time_s
    return np.arange(time[0], time[-1] + 0.5 * width_s, width_s)


def _noise(problem: Problem, channel: str) -> float:
    for sample in problem.samples:
        for seen in sample.observed:
            if seen.sensor.channel == channel:
                return float(seen.sensor.noise)
    return 1.0


def _known(
    problem: Problem, k: int, sample: Sample, run: Linearised, noise: Mapping[str, float], width_s: float
) -> _Known:
    jacobian, residual = [], []
    for seen in sample.observed:
        name = seen.sensor.channel
        off = -seen.left(run.model[name])
        jacobian.append(rounded(seen.sensor, run.slope[name] / noise[name]))
        residual.append(rounded(seen.sensor, off / noise[name]))
    centres = hats(sample, width_s)
    place = problem.columns(k)
    rows, rest = np.vstack(jacobian), np.concatenate(residual)
    return _Known(place, rows, rest, rows.T @ rows, rows.T @ rest, centres)


def _of_sensor(
    sample: Sample, channel: str, centres: Floats, noise: Mapping[str, float], width_s: float
) -> Floats:
    """(samples of all channels, hats) scaled by the sensors' noise: hats on a channel's own signal."""
    time = sample.recording.time_s
    hats = np.maximum(0.0, 1.0 - np.abs(time[:, None] - centres) / width_s)
    return np.vstack(
        [
            rounded(seen.sensor, hats[seen.rows] / noise[channel])
            if seen.sensor.channel == channel
            else np.zeros((len(seen.rows), len(centres)))
            for seen in sample.observed
        ]
    )


def _of_port(sample: Sample, answers: Floats, noise: Mapping[str, float]) -> Floats:
    """The same of answers to hats at a port."""
    return np.vstack(
        [rounded(seen.sensor, seen.of(answers) / noise[seen.sensor.channel]) for seen in sample.observed]
    )


def _with_input(known: _Known, answers: Floats, width_s: float) -> _Part:
    root = np.linalg.cholesky(_prior(known.centres, MEMORY * width_s))
    driven = answers @ root
    values, turned = np.linalg.eigh(driven.T @ driven)
    driven = driven @ turned
    return _Part(
        known,
        root @ turned,
        np.maximum(values, 0.0),
        driven.T @ known.jacobian,
        driven.T @ known.residual,
    )


def _prior(centres: Floats, memory_s: float) -> Floats:
    covariance: Floats = np.exp(-np.abs(centres[:, None] - centres) / memory_s)
    return covariance + 1e-9 * np.eye(len(centres))


def _best(port: str, parts: Sequence[_Part], length: int) -> UnknownInput | None:
    square = sum(float(np.sum(part.values)) for part in parts)
    if square == 0.0:
        return None
    together = _Together.of(parts, length)
    unit = float(np.sqrt(together.count / square))
    s = _noise_left(together, length, 0.0, 1.0)
    without = _evidence(together, length, 0.0, s).value
    tried = []
    for size in (one * unit for one in SIZES):
        s = _noise_left(together, length, size, s)
        tried.append((_evidence(together, length, size, s), size, s))
    best, size, s = max(tried, key=lambda one: one[0].value)
    means, bands = [], []
    for part in parts:
        share = (size / s) ** 2 / (1.0 + (size / s) ** 2 * part.values)
        means.append(-part.root @ (share * (part.pull + part.cross @ best.delta[part.known.place])))
        bands.append(s * np.sqrt(part.root**2 @ share))
    centres = tuple(part.known.centres for part in parts)
    return UnknownInput(port, best.value - without, size, s, centres, tuple(means), tuple(bands))


def _noise_left(parts: _Together, length: int, size: float, s: float) -> float:
    """The noise at which the evidence is greatest, from that of another size: s² is what is left per
    sample. The evidence hardly moves with it there."""
    for _ in range(MOST_TURNS):
        before, square = s, _evidence(parts, length, size, s).square * s**2
        s = float(np.sqrt(max(square / parts.count, 1e-3)))
        if abs(s - before) < SAME_NOISE * s:
            break
    return s


@dataclass(frozen=True)
class _Evidence:
    value: float
    """ln of the evidence, up to a constant."""
    square: float
    """What is left over, in units of s."""
    delta: Floats
    """δ at its best."""


@dataclass(frozen=True)
class _Together:
    """Recordings with an input at one port, as one: hats that a recording lacks answer nothing."""

    places: NDArray[np.intp]
    """Where the recordings' own normal equations stand among all, flat, one recording after the other."""
    normal: Floats
    gradient: Floats
    """JᵀJ and Jᵀr of the recordings, flat, in the same order."""
    rows: NDArray[np.intp]
    """Of the gradient the same."""
    square: float
    count: int
    values: Floats
    """(recordings, hats)."""
    cross: Floats
    """(recordings, hats, unknowns of one), likewise."""
    pull: Floats
    columns: NDArray[np.bool_]
    """(recordings, unknowns of one): what a recording has."""

    @classmethod
    def of(cls, parts: Sequence[_Part], length: int) -> _Together:
        """All of `parts`, among so many unknowns."""
        hats = max(len(part.values) for part in parts)
        wide = max(len(part.known.place) for part in parts)
        values, pull = np.zeros((2, len(parts), hats))
        cross = np.zeros((len(parts), hats, wide))
        columns = np.zeros((len(parts), wide), dtype=bool)
        for k, part in enumerate(parts):
            of, own = len(part.values), len(part.known.place)
            values[k, :of], pull[k, :of] = part.values, part.pull
            cross[k, :of, :own] = part.cross
            columns[k, :own] = True
        known = [part.known for part in parts]
        return cls(
            np.concatenate([(length * one.place[:, None] + one.place).ravel() for one in known]),
            np.concatenate([one.normal.ravel() for one in known]),
            np.concatenate([one.gradient for one in known]),
            np.concatenate([one.place for one in known]),
            sum(float(one.residual @ one.residual) for one in known),
            sum(len(one.residual) for one in known),
            values,
            cross,
            pull,
            columns,
        )


def _evidence(parts: _Together, length: int, size: float, s: float) -> _Evidence:
    ratio = (size / s) ** 2
    share = ratio / (1.0 + ratio * parts.values)
    taken = share[:, :, None] * parts.cross
    both = parts.columns[:, :, None] & parts.columns[:, None, :]
    normal = parts.normal - (parts.cross.transpose(0, 2, 1) @ taken)[both]
    gradient = parts.gradient - (parts.pull[:, None, :] @ taken)[:, 0, :][parts.columns]
    matrix = np.bincount(parts.places, normal, length**2).reshape(length, length) / s**2
    matrix[np.diag_indices(length)] += 1.0
    pulled = np.bincount(parts.rows, gradient, length) / s**2
    square = (parts.square - float(np.sum(share * parts.pull**2))) / s**2
    log_det = float(np.sum(np.log1p(ratio * parts.values)))
    factor = cho_factor(matrix)
    delta = -cho_solve(factor, pulled)
    square += float(pulled @ delta)
    log_det += 2.0 * float(np.sum(np.log(np.diag(factor[0]))))
    return _Evidence(-0.5 * (square + log_det) - parts.count * float(np.log(s)), square, delta)

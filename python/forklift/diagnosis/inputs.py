"""Which equation is wrong: an unknown input at each port in turn, smoothed, and compared by its evidence.

At the baseline's optimum the residuals are taken as linear in the truck's unknowns δ and in an unknown input
w(t) at one port, hats over time with an Ornstein–Uhlenbeck prior of unknown size a:

    r + J δ + R w = e,    δ ~ N(0, 1),  w ~ N(0, a² K),  e ~ N(0, s²)

R are the model's exact responses. The evidence, over all recordings together, with a and s at their best,
says at which port an input explains most (Kristensen, Madsen & Jørgensen 2004 with a diffusion term at one
state in turn; here solved as a smoother). A sensor is its own rival: hats on its signal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from forklift.estimation.problem import Linearised, Problem, Sample

Floats = NDArray[np.float64]

WIDTH_S = 0.2
"""Distance of the hats."""
MEMORY_S = 0.4
"""Correlation time of the prior."""
SIZES = tuple(float(size) for size in 10.0 ** np.arange(-4.0, 3.1, 0.5))
"""a, in units in which the port's whole response has unit mean square."""

Respond = Callable[[Problem, Floats, int, str, Floats], Floats]
"""(times, outputs, hats) of one recording at the unknown vector x, for the port of this name."""


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


@dataclass
class _Part:
    """One recording's share: Gram matrices of (δ of its own and shared, w) with the residual."""

    place: NDArray[np.intp]
    jj: Floats
    jr: Floats
    rr: float
    count: int
    centres: Floats
    jw: Floats
    ww: Floats
    wr: Floats


def unknown_inputs(problem: Problem, x: Floats, ports: Sequence[str], respond: Respond) -> list[UnknownInput]:
    """An unknown input at each port in turn; ports named after a channel are its sensor. Best first."""
    noise = {name: _noise(problem, name) for name in problem.sigma}
    runs = problem.linearise(x)
    base = [
        _base(problem, k, sample, run, noise)
        for k, (sample, run) in enumerate(zip(problem.samples, runs, strict=True))
    ]
    found = []
    for port in ports:
        parts = [
            _with_port(part, rows, _rows(problem, x, k, port, part.centres, respond, noise))
            for k, (part, rows) in enumerate(base)
        ]
        answer = _best(port, parts, problem.starts[-1])
        if answer:
            found.append(answer)
    return sorted(found, key=lambda one: -one.evidence)


def _noise(problem: Problem, channel: str) -> float:
    for sample in problem.samples:
        for seen in sample.observed:
            if seen.sensor.channel == channel:
                return seen.sensor.noise
    return 1.0


def _base(
    problem: Problem, k: int, sample: Sample, run: Linearised, noise: dict[str, float]
) -> tuple[_Part, tuple[Floats, Floats]]:
    names = [seen.sensor.channel for seen in sample.observed]
    jacobian = np.vstack([run.slope[name] / noise[name] for name in names])
    residual = np.concatenate(
        [
            (run.model[seen.sensor.channel] - seen.values - 0.5 * seen.sensor.count)
            / noise[seen.sensor.channel]
            for seen in sample.observed
        ]
    )
    time = sample.recording.time_s
    centres = np.arange(time[0], time[-1] + 0.5 * WIDTH_S, WIDTH_S)
    empty = np.zeros(0)
    part = _Part(
        problem.place(k), jacobian.T @ jacobian, jacobian.T @ residual, float(residual @ residual),
        len(residual), centres, empty, empty, empty,
    )  # fmt: skip
    return part, (jacobian, residual)


def _rows(
    problem: Problem, x: Floats, k: int, port: str, centres: Floats, respond: Respond, noise: dict[str, float]
) -> Floats:
    """(samples of all channels, hats) scaled by the sensors' noise."""
    sample = problem.samples[k]
    if port in noise:
        time = sample.recording.time_s
        hats = np.maximum(0.0, 1.0 - np.abs(time[:, None] - centres) / WIDTH_S)
        return np.vstack(
            [
                hats[seen.rows] / noise[port]
                if seen.sensor.channel == port
                else np.zeros((len(seen.rows), len(centres)))
                for seen in sample.observed
            ]
        )
    answers = respond(problem, x, k, port, centres)
    return np.vstack(
        [answers[seen.rows, seen.column] / noise[seen.sensor.channel] for seen in sample.observed]
    )


def _with_port(part: _Part, rows: tuple[Floats, Floats], answers: Floats) -> _Part:
    jacobian, residual = rows
    return replace(part, jw=jacobian.T @ answers, ww=answers.T @ answers, wr=answers.T @ residual)


def _best(port: str, parts: Sequence[_Part], length: int) -> UnknownInput | None:
    square = sum(float(np.trace(part.ww)) for part in parts)
    count = sum(part.count for part in parts)
    if square == 0.0:
        return None
    unit = float(np.sqrt(count / square))
    without = max(_evidence(parts, length, 0.0, s)[0] for s in _scales(parts, length, 0.0))
    best: tuple[float, float, float] | None = None
    for size in SIZES:
        for s in _scales(parts, length, size * unit):
            value = _evidence(parts, length, size * unit, s)[0]
            if best is None or value > best[0]:
                best = value, size * unit, s
    assert best is not None
    value, size, s = best
    _, means, bands = _evidence(parts, length, size, s, smooth=True)
    return UnknownInput(
        port, value - without, size, s, tuple(part.centres for part in parts), tuple(means), tuple(bands)
    )


def _scales(parts: Sequence[_Part], length: int, size: float) -> list[float]:
    """The noise at which the evidence is greatest, by a few steps of s² = what is left per sample."""
    s = 1.0
    count = sum(part.count for part in parts)
    for _ in range(4):
        left = _evidence(parts, length, size, s, only_left=True)[0]
        s = float(np.sqrt(max(left / count, 1e-3)))
    return [s]


def _prior(centres: Floats) -> Floats:
    return np.exp(-np.abs(centres[:, None] - centres) / MEMORY_S) + 1e-9 * np.eye(len(centres))


def _evidence(
    parts: Sequence[_Part],
    length: int,
    size: float,
    s: float,
    *,
    smooth: bool = False,
    only_left: bool = False,
) -> tuple[float, list[Floats], list[Floats]]:
    """ln evidence (or, with `only_left`, the sum of squares left over), smoothed inputs and their bands."""
    matrix, gradient = np.eye(length), np.zeros(length)
    square, log_det, count = 0.0, 0.0, 0
    eliminated = []
    for part in parts:
        normal, right = part.jj / s**2, part.jr / s**2
        square += part.rr / s**2
        count += part.count
        if size > 0.0:
            root = np.linalg.cholesky(_prior(part.centres)) * size
            inner = np.eye(len(root)) + root.T @ part.ww @ root / s**2
            lower = np.linalg.cholesky(inner)
            cross = solve_triangular(lower, root.T @ part.jw.T, lower=True) / s**2
            own = solve_triangular(lower, root.T @ part.wr, lower=True) / s**2
            normal = normal - cross.T @ cross
            right = right - cross.T @ own
            square -= float(own @ own)
            log_det += 2.0 * float(np.sum(np.log(np.diag(lower))))
            eliminated.append((root, lower, cross, own))
        matrix[np.ix_(part.place, part.place)] += normal
        gradient[part.place] += right
    factor = cho_factor(matrix)
    delta = -cho_solve(factor, gradient)
    square += float(gradient @ delta)
    log_det += 2.0 * float(np.sum(np.log(np.diag(factor[0]))))
    if only_left:
        return square * s**2, [], []
    value = -0.5 * (square + log_det) - count * float(np.log(s))
    means, bands = [], []
    if smooth and size > 0.0:
        for part, (root, lower, cross, own) in zip(parts, eliminated, strict=True):
            back = solve_triangular(lower, root.T, lower=True).T
            means.append(-back @ (own + cross @ delta[part.place]))
            bands.append(np.sqrt(np.sum(back**2, axis=1)))
    return value, means, bands

"""Do the intervals of sweeps hold a known failure probability as often as they say?

    python proofs/sweep_intervals.py [--repeats 200] [--first 0] [--out sweep_intervals.md]

Six problems whose probabilities are known: RP8, RP22, RP25, RP31 and RP107 of TNO's reliability problems
(Rózsás & Slobbe 2019) and the four-branch system (Waarts 2000). Each kind of interval is made anew from other
seeds, and it is counted how often it holds the known value. Printed beside: the band that 95 % leaves to so
many repeats.
"""

import argparse
import itertools
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from math import sqrt
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.integrate import quad
from scipy.special import ndtr, ndtri
from scipy.stats import binom, qmc

from forklift.ensemble.intervals import ConfidenceSequence, clopper_pearson, over_scrambles
from forklift.ensemble.subset import subset_simulation

BAND = (0.90, 0.98)
"""In which the share of 95 % intervals that hold must lie."""
SCRAMBLES = 16
LOOKS = 20
"""At a confidence sequence, evenly spaced; all of them have to hold."""


@dataclass(frozen=True)
class Problem:
    """A margin g of standard normal u (n, d), negative where it fails, and how often it does."""

    name: str
    dimensions: int
    margin: object
    probability: float
    members: int
    """Independent ones of a Clopper-Pearson interval: some twenty failures or more; none: too rare to
    count."""
    points: int
    """Of each scramble; none: too rare."""


def lognormal(mean, deviation, u):
    """Lognormal numbers of that mean and standard deviation."""
    s = sqrt(np.log1p((deviation / mean) ** 2))
    return np.exp(np.log(mean) - s * s / 2.0 + s * u)


def rp8(u):
    weights = (1.0, 2.0, 2.0, 1.0, -5.0, -5.0)
    moments = ((120.0, 12.0),) * 4 + ((50.0, 10.0), (40.0, 8.0))
    terms = zip(weights, moments, u.T, strict=True)
    return sum(weight * lognormal(*moment, x) for weight, moment, x in terms)


def rp22(u):
    x, y = u.T
    return 2.5 - (x + y) / sqrt(2.0) + 0.1 * (x - y) ** 2


def rp25(u):
    x, y = u.T
    return np.maximum(x**2 - 8.0 * y + 16.0, -16.0 * x + y + 32.0)


def rp31(u):
    x, y = u.T
    return 2.0 - y + 256.0 * x**4


def four_branch(u):
    x, y = u.T
    first = 3.0 + 0.1 * (x - y) ** 2
    sides = (first - (x + y) / sqrt(2.0), first + (x + y) / sqrt(2.0))
    return np.minimum.reduce([*sides, x - y + 7.0 / sqrt(2.0), y - x + 7.0 / sqrt(2.0)])


def rp107(u):
    return 5.0 * sqrt(10.0) - u.sum(axis=1)


def _density(x):
    return np.exp(-0.5 * x * x) / sqrt(2.0 * np.pi)


def _over(tail, low=-12.0, high=12.0, **options):
    """The mean of a conditional probability over one standard normal number."""
    return quad(lambda x: _density(x) * tail(x), low, high, epsabs=0.0, epsrel=1e-10, limit=400, **options)[0]


def _four():
    # In turned axes s = (x + y)/sqrt 2, d = (x - y)/sqrt 2 the branches are |s| > 3 + 0.2 d^2, |d| > 3.5.
    near = _over(lambda d: 2.0 * ndtr(-(3.0 + 0.2 * d * d)), -3.5, 3.5)
    return near + 2.0 * ndtr(-3.5)


PROBLEMS = (
    # Six lognormal numbers have no closed form: the published value.
    Problem("RP8", 6, rp8, 7.84e-4, 100_000, 8192),
    Problem("RP22", 2, rp22, _over(lambda d: ndtr(-(2.5 + 0.2 * d * d))), 20_000, 4096),
    Problem(
        "RP25",
        2,
        rp25,
        # Fails where y lies above (x^2 + 16)/8 and below 16 x - 32.
        _over(
            lambda x: max(ndtr(16.0 * x - 32.0) - ndtr((x * x + 16.0) / 8.0), 0.0),
            1.5,
            12.0,
            points=(2.0, 2.5),
        ),
        1_000_000,
        32768,
    ),
    Problem("RP31", 2, rp31, _over(lambda x: ndtr(-(2.0 + 256.0 * x**4)), points=(0.0,)), 20_000, 4096),
    Problem("four-branch", 2, four_branch, _four(), 20_000, 4096),
    Problem("RP107", 10, rp107, float(ndtr(-5.0)), 0, 0),
)


def fixed(problem, repeat):
    u = np.random.default_rng((1, repeat)).standard_normal((problem.members, problem.dimensions))
    failures = int((problem.margin(u) < 0.0).sum())
    return problem.probability in clopper_pearson(failures, problem.members)


def watched(problem, repeat):
    u = np.random.default_rng((2, repeat)).standard_normal((problem.members, problem.dimensions))
    sequence = ConfidenceSequence(problem.members)
    pieces = np.array_split(problem.margin(u) < 0.0, LOOKS)
    return all(problem.probability in sequence.add(int(piece.sum()), len(piece)) for piece in pieces)


def sobol(problem, repeat):
    shares = []
    for scramble in range(SCRAMBLES):
        points = qmc.Sobol(problem.dimensions, seed=np.random.default_rng((3, repeat, scramble)))
        u = ndtri(np.clip(points.random(problem.points), 1e-16, 1.0 - 1e-16))
        shares.append(float((problem.margin(u) < 0.0).mean()))
    return problem.probability in over_scrambles(shares)


def rare(problem, repeat):
    found = subset_simulation(lambda u, _: problem.margin(u), problem.dimensions, seed=10_000 + repeat)
    return problem.probability in found.interval


KINDS = {
    "Clopper-Pearson": fixed,
    "confidence sequence": watched,
    "t over scrambles": sobol,
    "subset simulation": rare,
}


def possible(kind, problem):
    if kind == "t over scrambles":
        return problem.points > 0
    return kind == "subset simulation" or problem.members > 0


def held(task):
    """In how many repeats from `first` up to `last` an interval of a kind held."""
    kind, name, first, last = task
    problem = next(problem for problem in PROBLEMS if problem.name == name)
    return sum(bool(KINDS[kind](problem, repeat)) for repeat in range(first, last))


def judge(share, repeats):
    """Whether a share of intervals that held is one that 95 % intervals may have."""
    low, high = BAND
    slack = 0 if repeats >= 200 else 2.0 * sqrt(0.05 * 0.95 / repeats)
    return low - slack <= share <= high + slack


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first repeat, which is its seed")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    lines = ["| problem | probability | kind | held | seconds |", "|---|---:|---|---:|---:|"]
    good = True
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        for problem in PROBLEMS:
            for kind in KINDS:
                if not possible(kind, problem):
                    continue
                clock = time.perf_counter()
                cuts = options.first + np.linspace(0, options.repeats, 2 * options.jobs + 1).astype(int)
                tasks = [(kind, problem.name, int(a), int(b)) for a, b in itertools.pairwise(cuts)]
                share = sum(pool.map(held, tasks)) / options.repeats
                fine = judge(share, options.repeats)
                good &= fine
                lines.append(
                    f"| {problem.name} | {problem.probability:.4e} | {kind} | {100 * share:.1f} %"
                    f"{'' if fine else ' (outside)'} | {time.perf_counter() - clock:.0f} |"
                )
                print(lines[-1], flush=True)
    low, high = binom.ppf((0.025, 0.975), options.repeats, 0.95) / options.repeats
    lines += [
        "",
        f"{options.repeats} repeats of exact 95 % intervals hold in {100 * low:.1f} to {100 * high:.1f} %.",
    ]
    print(lines[-1])
    if options.out:
        options.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

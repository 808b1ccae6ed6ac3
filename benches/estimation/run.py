"""Fit one campaign with forklift and with what one would use instead: times, and what came out.

    python benches/estimation/run.py [CAMPAIGN] --out table.md [--sundials FOLDER] [--limit SECONDS]

README.md beside this file says what is compared and how the peers were set.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "peers"))

import native
from cvode import Cvode
from judge import Judged, judge
from scipy.optimize import least_squares
from usual import OutOfTime, Usual

from forklift.base.errors import ForkliftError
from forklift.fitting.posing import pose
from forklift.fitting.problem import LeastSquares as Problem
from forklift.fitting.search import Stage, search
from forklift.plant.forklift.model import Forklift
from forklift.plant.forklift.sensors import MEASURED, sensors
from forklift.plant.forklift.truck import Truck
from forklift.plant.forklift.unknowns import unknowns
from forklift.recordings.campaign import Campaign
from forklift.recordings.channels import LIFTS
from forklift.recordings.noise import Sensor

NULL = Path(__file__).parents[2] / "tests" / "campaigns" / "null"
SUBSTEPS = 4
CVODE = {
    "rtol": 1e-6, "order": 3, "restart": 0, "stop": 1, "nls": 2, "setup": 15, "jacage": 10, "dgamma": 0.6,
    "si": 0.2, "sdi": 50, "szv": 1.2, "sx": 0.6, "sv": 0.007, "sz": 10, "spa": 1e7, "spb": 5e5, "sac": 3.5e-5,
}  # fmt: skip
STEP = 0.003  # of difference quotients, relative to `usual.OFFSET`: 0.03 prior standard deviations
FTOL = 1e-6  # as in the last stage of forklift's search
NEAR = (
    1.02  # of the least mean square on held-out recordings that any method ended at: what counts as arrived
)


@dataclass
class Fit:
    """What one method came to."""

    method: str
    vector: np.ndarray
    """The unknown vector of the problem."""
    wall_s: float
    processor_s: float
    simulations: int
    ended: str
    trail: list[tuple[float, np.ndarray]]
    """Seconds and unknown vector by the way."""
    cost: float = np.nan
    judged: list[Judged] = field(default_factory=list)
    way: list[float] = field(default_factory=list)
    """Mean square on held-out recordings along the trail."""


def forklift(problem: Problem, known: dict[str, Sensor]) -> Fit:
    """forklift's own search; every evaluation simulates and differentiates each recording once."""
    seen: list[tuple[float, np.ndarray]] = []

    def progress(stage: Stage, count: int, cost: float, x: np.ndarray) -> None:
        seen.append((perf_counter() - began, x.copy()))

    began, began_processor = perf_counter(), process_time()
    found = search(problem, np.zeros(problem.starts[-1]), known, progress=progress)
    wall, processor = perf_counter() - began, process_time() - began_processor
    runs = found.evaluations * len(problem.samples)
    return Fit("forklift", found.x, wall, processor, runs, "at the end of its last stage", seen)


def trf(usual: Usual) -> str:
    """scipy.optimize.least_squares with two-point differences; how it ended."""
    done = least_squares(
        usual.residual, usual.start, jac="2-point", method="trf", bounds=usual.bounds(),
        diff_step=STEP, ftol=FTOL, gtol=None, max_nfev=10**6,
    )  # fmt: skip
    return str(done.message)


def lmfit(usual: Usual) -> str:
    """lmfit.minimize, leastsq; how it ended."""
    from lmfit import Parameters, minimize

    given = Parameters()
    for k, (value, lower, upper) in enumerate(zip(usual.start, *usual.bounds(), strict=True)):
        given.add(f"x{k}", value=value, min=lower, max=upper)
    done = minimize(
        lambda p: usual.residual(np.array([p[name].value for name in p])),
        given, method="leastsq", epsfcn=STEP**2, ftol=FTOL, max_nfev=10**7, calc_covar=False,
    )  # fmt: skip
    return str(done.message)


def peer(name: str, method: Callable[[Usual], str], usual: Usual, limit: float) -> Fit:
    """One of the two above, for `limit` seconds at most."""
    usual.restart()
    usual.limit, usual.say = limit, lambda line: print(f"{name}: {line}", flush=True)
    try:
        ended = method(usual)
    except OutOfTime:
        ended = f"stopped after {limit:g} s, best so far"
    wall, processor = perf_counter() - usual.began, process_time() - usual.began_processor
    best = usual.best
    trail = [(seconds, x - usual.start) for seconds, x in best.trail]
    return Fit(name, best.x - usual.start, wall, processor, best.simulations, ended, trail)


def deviations(problem: Problem, vector: np.ndarray) -> np.ndarray:
    """Posterior standard deviations of the shared unknowns, by the curvature at `vector`."""
    jacobian = problem.compressed(vector)[1]
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    return np.sqrt(np.diag(covariance))[: len(problem.unknowns)]


def report(fits: list[Fit], deviation: np.ndarray, channels: list[str], notes: list[str]) -> str:
    """Both tables and the notes."""
    ours, count = fits[0], len(deviation)
    near = NEAR * min(fit.way[-1] for fit in fits)
    lines = [
        "| method | wall [s] | processor [s] | times forklift's wall | times its processor | simulations "
        "| cost | arrived after [s] | from forklift's optimum, rms | worst | ended |",
        "|---|" + "---:|" * 9 + "---|",
    ]
    for fit in fits:
        arrived = next(
            (
                f"{seconds:.1f}"
                for (seconds, _), square in zip(fit.trail, fit.way, strict=True)
                if square <= near
            ),
            "–",
        )
        off = (fit.vector[:count] - ours.vector[:count]) / deviation
        lines.append(
            f"| {fit.method} | {fit.wall_s:.1f} | {fit.processor_s:.1f} | {fit.wall_s / ours.wall_s:.1f} "
            f"| {fit.processor_s / ours.processor_s:.1f} | {fit.simulations} | {fit.cost:.1f} | {arrived} "
            f"| {np.sqrt(np.mean(off**2)):.2f} | {np.abs(off).max():.2f} | {fit.ended} |"
        )
    lines += [
        "",
        "Mean square in units of the sensor's noise, by one judge: mean over the recordings, and worst.",
        "",
        "| method | recordings | " + " | ".join(f"{name}, mean | worst" for name in channels) + " |",
        "|---|---|" + "---:|" * (2 * len(channels)),
    ]
    for fit in fits:
        for role in ("estimate", "validate"):
            cells = []
            for name in channels:
                squares = [one.mean_square for one in fit.judged if (one.channel, one.role) == (name, role)]
                cells += [f"{np.mean(squares):.2f}", f"{max(squares):.2f}"] if squares else ["–", "–"]
            lines.append(f"| {fit.method} | {role} | " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", *notes]) + "\n"


def bench(campaign: Campaign, args: argparse.Namespace, folder: Path) -> None:
    """All methods on one campaign; the report is written anew after each."""
    truck = Truck.read("thesis")
    known = sensors(campaign.recordings)
    lifts = tuple(lift for lift in LIFTS if any(r.lift in (lift, "both") for r in campaign.recordings))
    noise = {name: sensor.noise for name, sensor in known.items()}
    machine = Forklift(truck, lifts, warming_width_k=0.0)
    whole = pose(machine, campaign.recordings, unknowns(truck, lifts), known, noise, substeps=SUBSTEPS)
    fitted = tuple(one for one in whole.samples if one.recording.role == "estimate")
    problem = replace(whole, samples=fitted)
    usual = Usual(problem, lifts, known, Cvode(native.build_lift_cvode(folder, args.sundials), CVODE))
    still = {f"{kind}_{lift}_{unit}" for lift in LIFTS if lift not in lifts for kind, unit in
             (("position", "m"), ("pressure", "pa"))}  # fmt: skip
    channels = [name for name in MEASURED if name in known and name not in still]
    print(
        f"{len(problem.unknowns)} shared unknowns and {problem.starts[-1] - len(problem.unknowns)} of "
        f"{len(fitted)} recordings; {len(whole.samples) - len(fitted)} held out",
        flush=True,
    )

    ours = [forklift(problem, known) for _ in range(args.repeats)]
    first = sorted(ours, key=lambda fit: fit.wall_s)[len(ours) // 2]
    deviation = deviations(problem, first.vector)
    notes = [
        f"- {campaign.name!r}: {len(problem.unknowns)} shared unknowns of {' and '.join(lifts)} lift, "
        f"{len(fitted)} recordings to fit, {len(whole.samples) - len(fitted)} held out; "
        f"{os.cpu_count()} cores.",
        f"- CVODE from {'source, optimised' if args.sundials else 'the system'}, rtol {CVODE['rtol']:g}; "
        f"difference quotients over {STEP * usual.start[0]:g} prior standard deviations.",
        "- Cost: what the peers minimise, half the sum of squares with Gaussian weights and priors, by "
        "CVODE; forklift minimises another, in which an encoder's count is an interval.",
        f"- Arrived: the first point whose mean square on the held-out recordings is at most {NEAR:g} times "
        "the least that a method ended at.",
        f"- forklift: the middle of {len(ours)} runs. Distances are in its posterior standard deviations.",
    ]
    shared = len(problem.unknowns)
    held_out = replace(whole, samples=tuple(one for one in whole.samples if one.recording.role == "validate"))
    fits: list[Fit] = []

    def add(fit: Fit) -> None:
        fit.cost = usual.cost(fit.vector)
        try:
            fit.judged = judge(whole, fit.vector[:shared], known)
        except ForkliftError as error:
            fit.ended += f"; cannot be judged: {error.message}"
        for _, vector in [*fit.trail[:-1], (0.0, fit.vector)]:
            with suppress(ForkliftError):
                fit.way.append(_mean(judge(held_out, vector[:shared], known), channels))
                continue
            fit.way.append(np.inf)
        fits.append(fit)
        text = report(fits, deviation, channels, notes)
        args.out.write_text(text, encoding="utf-8")
        print(f"\n{text}", flush=True)

    add(first)
    methods = {"trf": ("SciPy least_squares, CVODE", trf), "lmfit": ("lmfit leastsq, CVODE", lmfit)}
    for key in args.peers:
        name, method = methods[key]
        add(peer(name, method, usual, args.limit))


def _mean(judged: list[Judged], channels: list[str]) -> float:
    squares = [one.mean_square for one in judged if one.channel in channels]
    return float(np.mean(squares)) if squares else np.inf


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "campaign", type=Path, nargs="?", default=NULL, help="a campaign's folder; else tests/campaigns/null"
    )
    parser.add_argument("--out", type=Path, required=True, help="where the tables go")
    parser.add_argument(
        "--sundials", type=Path, help="source of SUNDIALS 6 or 7; without it the system's library"
    )
    parser.add_argument("--limit", type=float, default=3600.0, help="seconds a peer may take")
    parser.add_argument("--repeats", type=int, default=3, help="of forklift's fit")
    parser.add_argument("--peers", nargs="+", choices=("trf", "lmfit"), default=("trf", "lmfit"))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        bench(Campaign.read(args.campaign), args, Path(name))


if __name__ == "__main__":
    main()

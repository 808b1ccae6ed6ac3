"""Do the 95 % intervals of a fit hold the truth in 95 of 100 cases? Told by simulated trucks.

    python proofs/coverage.py [--trucks 50] [--out coverage] [--jobs 2]

README.md beside this file says what is simulated, and how it is judged. Each truck is one file in the
folder, written whole: a run that is broken off loses nothing, and a second one goes on where it stood.
"""

import argparse
import json
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
CAMPAIGN = ROOT / "tests" / "campaigns" / "null"
"""Whose commands, loads and temperatures the simulated campaigns have."""

LIFT = "free"
SCATTER = 0.12  # standard deviation of the logarithm of what the thesis estimated
AREA_SCATTER = 0.05  # the same of each opening of the area table
CURRENT_SCATTER_A = 0.01  # of the currents of its inner knots
TEMPERATURE_STEP_K = 0.5  # of the oil temperature's sensor
TOLERANCE = 1e-7
END_M = 0.03  # a recording ends where the cylinder comes this near to the end of its stroke

LEVEL = 0.95
BAND = (0.92, 0.97)  # in which the pooled coverage must lie
FAILED = 0.01  # Holm-corrected p below which a parameter fails


def truth(thesis, seed):
    """Another truck of the thesis's make."""
    from forklift.plant.forklift.tables import parameters

    random = np.random.default_rng(seed)
    values = {}
    for name, value in thesis.values.items():
        spec = parameters()[name]
        if not name.startswith(f"{LIFT}."):
            continue
        if name.endswith("table_area"):
            values[name] = rising(
                lambda value=value: value * np.exp(AREA_SCATTER * random.standard_normal(len(value)))
            )
        elif name.endswith("table_current"):
            inner = np.r_[0.0, np.ones(len(value) - 2), 0.0]
            values[name] = rising(
                lambda value=value, inner=inner: (
                    value + CURRENT_SCATTER_A * inner * random.standard_normal(len(value))
                )
            )
        elif spec["origin"] in ("steady", "prms"):
            factor = np.exp(SCATTER * random.standard_normal())
            values[name] = float(np.clip(value * factor, spec["lower"], spec["upper"]))
    return thesis.with_values(values, source=f"thesis, scattered, seed {seed}")


def rising(draw):
    """A table that does not fall."""
    while True:
        knots = draw()
        if (np.diff(knots) >= 0.0).all():
            return tuple(float(knot) for knot in knots)


def record(truck, plan, seed):
    """The recordings of a campaign like `plan`, and the oil temperature that each truly had."""
    from forklift.app.demo import measured
    from forklift.plant.forklift.commands import Command
    from forklift.plant.forklift.simulate import first_temperature, simulate
    from forklift.recordings.recording import Recording

    random = np.random.default_rng([seed, 1])
    recordings, temperatures, starts = [], [], []
    for stream, like in enumerate(plan):
        off = TEMPERATURE_STEP_K * (random.random() - 0.5)
        temperature = round(first_temperature(like)) + off
        simulation = simulate(
            truck,
            Command(like.time_s, *like.command.T),
            load_kg=like.load_kg,
            oil_temperature_degc=temperature,
            solver="adaptive",
            tolerance=TOLERANCE,
        )
        kept = before_the_end(simulation, truck)
        columns = measured(simulation, seed, stream)[:kept].to_dict(as_series=False)
        at = np.array(columns.pop("time_s"))
        recordings.append(Recording(like.file, like.lift, like.load_kg, "estimate", at, columns))
        temperatures.append(temperature)
        starts.append([float(simulation[f"{lift}.position"][0]) for lift in ("free", "main")])
    return recordings, temperatures, starts


def before_the_end(simulation, truck):
    """How many samples there are until shortly before the lift meets the end of its stroke, if it does."""
    left = simulation[f"{LIFT}.position"] - truck.values[f"{LIFT}.cylinder.stroke_lower"]
    met = np.flatnonzero(left < END_M)
    return met[0] if len(met) else len(left)


def one(number):
    """Truck number `number`: made, recorded, fitted from the thesis's; what came out, for JSON."""
    from forklift.fitting.intervals import knowledge
    from forklift.fitting.levenberg_marquardt import cost
    from forklift.fitting.posing import pose
    from forklift.fitting.residuals import judge
    from forklift.fitting.search import search
    from forklift.plant.forklift.model import Forklift
    from forklift.plant.forklift.sensors import sensors
    from forklift.plant.forklift.simulate import first_temperature
    from forklift.plant.forklift.truck import Truck
    from forklift.plant.forklift.unknowns import unknowns
    from forklift.plant.parameter import SCALES
    from forklift.recordings.campaign import Campaign

    began = time.monotonic()
    thesis = Truck.read("thesis")
    plan = [found for found in Campaign.read(CAMPAIGN).recordings if found.role == "estimate"]
    true = truth(thesis, number)
    recordings, temperatures, starts = record(true, plan, number)
    simulated = time.monotonic() - began

    every = sensors(recordings)
    moved = unknowns(thesis, [LIFT])
    problem = pose(Forklift(thesis, (LIFT,)), recordings, moved, every)
    found = search(problem, np.zeros(problem.starts[-1]), every)
    known = knowledge(found.problem, found.x)
    judged = judge(found.problem, found.x[: len(moved)], known.covariance, every)

    values = dict(zip(true.core.names, true.core.values, strict=True))
    x = [
        (SCALES[unknown.scale].forth(values[unknown.name]) - SCALES[unknown.scale].forth(unknown.start[0]))
        / unknown.width
        for unknown in moved
    ]
    for seen, temperature, start in zip(problem.samples, temperatures, starts, strict=True):
        own = np.array([seen.recording.load_kg, temperature - first_temperature(seen.recording), 0.0, *start])
        x += list((own - seen.centre)[seen.free] / seen.width[seen.free])
    x = np.array(x)
    together = {name for group in known.groups for name in group.names}
    return {
        "truck": number,
        "parameters": [
            {
                "name": estimate.name,
                "unit": estimate.unknown.unit,
                "truth": values[estimate.name],
                "estimate": estimate.value,
                "lower": estimate.lower,
                "upper": estimate.upper,
                "told": estimate.identifiable,
                "together": estimate.name in together,
                "covers": bool(estimate.lower <= values[estimate.name] <= estimate.upper),
                "deviation": estimate.deviation,
                "z": float((found.x[k] - x[k]) / estimate.deviation),
            }
            for k, estimate in enumerate(known.estimates)
        ],
        "covariance": known.covariance.tolist(),
        "theta": found.x[: len(moved)].tolist(),
        "true_theta": x[: len(moved)].tolist(),
        "own": found.x[len(moved) :].tolist(),
        "true_own": x[len(moved) :].tolist(),
        "cost": found.cost,
        "cost_at_truth": cost(found.problem, x),
        "evaluations": found.evaluations,
        "noise": dict(found.problem.sigma),
        "sensors": {name: sensor.noise for name, sensor in every.items()},
        "widening": dict(known.widening),
        "worst_mean_square": max(seen.mean_square for seen in judged),
        "simulated_s": simulated,
        "seconds": time.monotonic() - began,
    }


def summary(trucks):
    """Markdown, and whether the criterion is met."""
    from forklift.diagnosis.deficiency import holm

    counts = {}
    for truck in trucks:
        for found in truck["parameters"]:
            if found["told"] and not found["together"]:
                counts.setdefault(found["name"], []).append(found)
    rows = []
    for name, told in counts.items():
        covers, z = [found["covers"] for found in told], np.array([found["z"] for found in told])
        rows.append((name, sum(covers), len(covers), binomtest(sum(covers), len(covers), LEVEL).pvalue, z))
    corrected = holm([row[3] for row in rows])
    covered, total = sum(row[1] for row in rows), sum(row[2] for row in rows)
    pooled = covered / total if total else 0.0
    band = binomtest(covered, total).proportion_ci(LEVEL, "wilson") if total else (0.0, 1.0)
    failing = [row[0] for row, p in zip(rows, corrected, strict=True) if p < FAILED]
    met = BAND[0] <= pooled <= BAND[1] and not failing
    lines = [
        f"{len(trucks)} trucks; {covered} of {total} intervals of told parameters hold the truth: "
        f"{100 * pooled:.1f} % (95 % band of that share {100 * band[0]:.1f} to {100 * band[1]:.1f} %; "
        f"wanted {100 * BAND[0]:g} to {100 * BAND[1]:g} %).",
        "",
        f"Parameters whose share differs from 95 % (binomial, Holm-corrected p < {FAILED:g}): "
        f"{', '.join(failing) or 'none'}.",
        "",
        "z is (estimate − truth) over the standard deviation told; of right intervals its mean is 0 and its",
        "root mean square 1.",
        "",
        "| parameter | told | hold the truth | share | p | p, Holm | mean z | rms z |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for (name, hits, count, p, z), corrected_p in zip(rows, corrected, strict=True):
        lines.append(
            f"| `{name}` | {count} | {hits} | {100 * hits / count:.0f} % | {p:.2g} | {corrected_p:.2g} "
            f"| {z.mean():+.2f} | {np.sqrt(np.mean(z**2)):.2f} |"
        )
    lines += ["", f"The criterion is {'met' if met else 'not met'}.", ""]
    return "\n".join(lines), met


def write(path, text):
    """The whole file or none."""
    temporary = path.with_suffix(f".{os.getpid()}.part")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


def run(number, out):
    write(out / f"truck_{number:03d}.json", json.dumps(one(number), indent=1) + "\n")
    return number


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trucks", type=int, default=50)
    parser.add_argument("--out", type=Path, default=ROOT / "coverage")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    wanted = {number: given.out / f"truck_{number:03d}.json" for number in range(1, given.trucks + 1)}
    left = [number for number, path in wanted.items() if not path.exists()]
    print(f"{len(wanted) - len(left)} of {len(wanted)} trucks are there.", flush=True)
    threads = str(max(1, (os.cpu_count() or 1) // given.jobs))
    os.environ |= {"RAYON_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": "1"}
    began = time.monotonic()
    with ProcessPoolExecutor(given.jobs, get_context("spawn")) as pool:
        running = [pool.submit(run, number, given.out) for number in left]
        try:
            for count, done in enumerate(as_completed(running), 1):
                seconds = (time.monotonic() - began) / count * (len(left) - count)
                print(
                    f"truck {done.result()}; {len(left) - count} left, about {seconds / 60:.0f} min",
                    flush=True,
                )
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            print("Interrupted; the same command goes on from here.", file=sys.stderr)
            return 130
    text, met = summary([json.loads(path.read_text(encoding="utf-8")) for path in wanted.values()])
    write(given.out / "coverage.md", text)
    print(text)
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())

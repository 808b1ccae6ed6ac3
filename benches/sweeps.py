"""How many closed-loop lowerings of 10 s a core runs in a second, and at which error.

    python benches/sweeps.py [--members 4096] [--repeats 5] [--peers] [--sundials FOLDER] [--radau FOLDER]
        [--relief 256 [--program PROGRAM]] [--out benches/sweeps.md]

The free lift under a controller, steps of the speed asked for, loads 0 to 1500 kg, oil 10 to 60 degC. Each
row is timed in turn, `--repeats` times over, and the fastest counts: processor time with one thread, wall
time with two. The error is the median over 32 members of the largest difference in speed from the same loop
with forty substeps, up to the first tick at which the controllers order different currents. From there on
an encoder count that falls a tick later makes another lowering; that is no error of the integrator.

With --peers those of `benches/peers` (README.md there says what each needs, and how their settings were
found) integrate its lowerings in turn with these rows. That is an open loop, whose commands are known
ahead. Each stands in the table with its least time at a median error of 1.5e-4 m/s, interpolated between
its tolerances, in processor time, the fastest of the repeats here too. A lowering is one of 10 s of the same
nine states. "Times CVODE" is per core: a row of two threads counts both.

With --relief so many systems of a second problem, the relief valve with impacts of relief_valve.py, in the
same columns: "v median" is how far its heights are off where the motion repeats itself, "ticks compared" how
many of the systems that SciPy solved do, and a lowering is a system's 2112 extrema.
"""

import argparse
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

from forklift._core import LANES, SINGLE_LANES
from forklift.control.controller import Controller
from forklift.ensemble import specification
from forklift.ensemble.members import Members
from forklift.ensemble.sweep import replay
from forklift.plant.forklift.truck import Truck

REFERENCE_SUBSTEPS = 40
COMPARED = 32
STATES = 9
TICKS = 500


CLOSED_LOOP = tomllib.loads((Path(__file__).parent / "closed_loop.toml").read_text(encoding="utf-8"))
OPEN_LOOP_A = (0.0, 0.55, 0.45, 0.62, 0.5)
"""Currents in place of the speeds asked for [A]."""


def document(substeps, controller, precision="double"):
    profile = CLOSED_LOOP["profile"]
    if not controller:
        profile = [step | {"level": level} for step, level in zip(profile, OPEN_LOOP_A, strict=True)]
    own = {"substeps": substeps, "precision": precision, "controller": controller, "profile": profile}
    return CLOSED_LOOP | own


def seconds(members, count, lanes):
    values, streams = members.draw(0, count)
    members.core.run(values[:64], streams[:64], lanes=lanes)
    # Processor time where one thread works, as the peers count it: another job on the machine does not count.
    read = time.process_time if members.threads == 1 else time.perf_counter
    clock = read()
    members.core.run(values, streams, lanes=lanes)
    return read() - clock


def error(truck, controller, substeps, name, precision):
    """Median over members of the largest error of the speed [m/s], and the share of ticks compared."""
    fine = specification.check(document(REFERENCE_SUBSTEPS, name))
    coarse = specification.check(document(substeps, name, precision))
    largest, compared = [], []
    for index in range(COMPARED):
        a, b = (replay(spec, truck, controller, index).table for spec in (fine, coarse))
        same = (a["current_free_a"] == b["current_free_a"]).to_numpy()
        until = len(same) if same.all() else int(np.argmin(same)) + 1
        difference = (a["velocity_free_m_s"] - b["velocity_free_m_s"]).to_numpy()[:until]
        largest.append(np.abs(difference).max())
        compared.append(until / len(same))
    return float(np.median(largest)), float(np.mean(compared))


class Peers:
    """What `benches/peers` compares, on its lowerings: an open loop, whose commands are known ahead."""

    LEFT_OUT = ("restart at each tick", "no restart, stop,")
    """Settings of CVODE that are slower than its best ones."""

    def __init__(self, folder, options):
        sys.path.insert(0, str(Path(__file__).parent / "peers"))
        import run
        import table
        from lowerings import error, make

        self.table, self.error, self.target = table, error, run.TARGET
        lowerings = make(options.n, 2017)
        reference = argparse.Namespace(sundials=options.sundials, radau=None, witness=0, n=options.n)
        self.reference, _ = run.reference(lowerings, reference, folder)
        given = argparse.Namespace(
            sundials=options.sundials,
            radau=options.radau,
            ours=None,
            n=options.n,
            slow=2,
            repeats=options.repeats,
        )
        found = run.peers(given, lowerings, folder)
        self.peers = [one for one in found if not one[1].startswith(self.LEFT_OUT)]
        self.rows = {}

    def time(self, repeat):
        """Every setting once; slow ones not in every repeat."""
        for k, (method, setting, n, repeats, run) in enumerate(self.peers):
            if repeat < repeats:
                found, spent = run()
                if k not in self.rows:
                    self.rows[k] = self.table.Row(method, setting, n, self.error(found, self.reference[:n]))
                # The fastest, as of our rows.
                self.rows[k].ms = [min([*self.rows[k].ms, 1e3 * spent / n])]

    def at_target(self):
        """By method the least seconds of a lowering at the target error or below, between its tolerances.

        None of what never is as accurate.
        """
        rows, found = list(self.rows.values()), {}
        for method in dict.fromkeys(row.method for row in rows):
            exact = [
                row.time_ms for row in rows if row.method == method and row.error.v_median <= self.target
            ]
            ms = self.table.time_at(rows, method, self.target)
            found[method] = None if ms is None else 1e-3 * min([ms, *exact])
        return found


def second_problem(members, program):
    """Rows of the relief valve with impacts; in place of a speed its heights, without unit, are off."""
    import relief_valve

    run = relief_valve.Found(members, checked=16, repeats=2, program=program or relief_valve.PROGRAM)
    share = f"{100 * len(run.regular) / len(run.reference):.0f} %"
    lines = []
    for place, row in enumerate(run.rows):
        ours = place < len(relief_valve.LANES)
        each, step, gain = run.each(row)
        lines.append(
            f"| relief valve | {'forklift, own steps, double' if ours else row.name} | {row.lanes} | 1 "
            f"| {run.off(row):.1e} | {share} | {1e6 * each:.0f} | {1.0 / each:.0f} | {step} "
            f"| {f'{gain:.1f}' if ours else '–'} | – |"
        )
    rates = f"{1e6 * run.scipy_s:.0f} | {1.0 / run.scipy_s:.2f}"
    lines.append(f"| relief valve | SciPy DOP853, 1e-12 | 1 | 1 | – | {share} | {rates} | – | – | – |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--members", type=int, default=4096)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2, help="1 leaves out what counts wall time")
    parser.add_argument("--controller", default="thesis")
    parser.add_argument("--peers", action="store_true", help="those of benches/peers in turn with these")
    parser.add_argument("--n", type=int, default=16, help="lowerings of the compiled peers")
    parser.add_argument("--radau", type=Path, help="folder with radau.f, decsol.f, dc_decsol.f")
    parser.add_argument(
        "--sundials", type=Path, help="source of SUNDIALS 6 or 7; without it the system's library"
    )
    parser.add_argument(
        "--relief", type=int, default=0, help="so many systems of the relief valve (relief_valve.py), too"
    )
    parser.add_argument("--program", help="its bench, compiled; without it cargo builds and runs it")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    truck = Truck.read("thesis")
    rows = [
        (loop, substeps, precision, lanes, threads)
        for loop in ("closed", "open")
        for substeps in (2, 3)
        for precision, lanes, threads in (
            ("single", SINGLE_LANES, 1),
            ("single", SINGLE_LANES, 2),
            ("double", LANES, 1),
            ("double", LANES, 2),
            ("double", 1, 1),
        )
        if threads <= options.threads
    ]
    best = {}
    home = tempfile.TemporaryDirectory()
    peers = Peers(Path(home.name), options) if options.peers else None
    for repeat in range(options.repeats):
        if peers:
            peers.time(repeat)
        for row in rows:
            loop, substeps, precision, lanes, threads = row
            name = options.controller if loop == "closed" else None
            controller = Controller.read(name) if name else None
            spec = specification.check(document(substeps, name, precision))
            members = Members(spec, truck, controller, threads)
            count = options.members // (8 if lanes == 1 else 1)
            spent = seconds(members, count, lanes) / count
            best[row] = min(spent, best.get(row, spent))
    told = peers.at_target() if peers else {}
    cvode = told.get(peers.table.CVODE) if peers else None
    lines = [
        "| loop | what | lanes | threads | v median [m/s] | ticks compared | µs a lowering "
        "| lowerings a second | ns a state and substep | times one lane | times CVODE in C |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    errors = {}
    for row in rows:
        loop, substeps, precision, lanes, threads = row
        name = options.controller if loop == "closed" else None
        if row[:3] not in errors:
            controller = Controller.read(name) if name else None
            errors[row[:3]] = error(truck, controller, substeps, name, precision)
        off, share = errors[row[:3]]
        spent = best[row]
        gain = f"{best[loop, substeps, 'double', 1, 1] / spent:.1f}" if threads == 1 else "–"
        faster = f"{cvode / (spent * threads):.0f}" if cvode else "–"
        lines.append(
            f"| {loop} | forklift, {substeps} substeps, {precision} | {lanes} | {threads} "
            f"| {off:.1e} | {100 * share:.0f} % "
            f"| {1e6 * spent:.1f} | {1.0 / spent:.0f} "
            f"| {1e9 * spent * threads / (TICKS * substeps * STATES):.2f} | {gain} | {faster} |"
        )
    for method, spent in sorted(told.items(), key=lambda one: one[1] or np.inf):
        rates = (
            f"{1e6 * spent:.0f} | {1.0 / spent:.1f} | – | – | {cvode / spent:.2g}"
            if spent
            else "– | – | – | – | –"
        )
        off = f"{'at most' if spent else 'above'} {peers.target:.1e}"
        lines.append(f"| open | {method} | 1 | 1 | {off} | 100 % | {rates} |")
    home.cleanup()
    if options.relief:
        lines += second_problem(options.relief, options.program)
    text = "\n".join(lines)
    print(text)
    if options.out:
        options.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

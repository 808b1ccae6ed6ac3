"""How many closed-loop lowerings of 10 s a core runs in a second, and at which error.

    python benches/sweeps.py [--members 4096] [--repeats 5] [--peers] [--sundials FOLDER] [--out
    benches/sweeps.md]

The free lift under a controller, steps of the speed asked for, loads 0 to 1500 kg, oil 10 to 60
degC. Each row is timed in turn, `--repeats` times over, and the fastest counts: processor time with one
thread,
wall time with two. The error is the
median over 32 members of the largest difference in speed from the same loop with forty substeps, up
to the first tick at which the controllers order different currents. From there on an encoder count
that falls a tick later makes another lowering; that is no error of the integrator.

With --peers CVODE in C integrates the lowerings of `benches/peers` in turn with these rows, at its best
settings
(`benches/peers/README.md` says how they were found). That is an open loop, whose commands are known ahead:
what a
closed loop costs beside it is in the ratio. A lowering is one of 10 s of the same nine states.
"""

import argparse
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

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


def document(substeps, controller):
    profile = CLOSED_LOOP["profile"]
    if not controller:
        profile = [step | {"level": level} for step, level in zip(profile, OPEN_LOOP_A, strict=True)]
    return CLOSED_LOOP | {"substeps": substeps, "controller": controller, "profile": profile}


def seconds(members, count, lanes):
    values, streams = members.draw(0, count)
    members.core.run(values[:64], streams[:64], lanes=lanes)
    # Processor time where one thread works, as the peers count it: another job on the machine does not count.
    read = time.process_time if members.threads == 1 else time.perf_counter
    clock = read()
    members.core.run(values, streams, lanes=lanes)
    return read() - clock


def error(truck, controller, substeps, name):
    """Median over members of the largest error of the speed [m/s], and the share of ticks compared."""
    fine, coarse = (specification.check(document(n, name)) for n in (REFERENCE_SUBSTEPS, substeps))
    largest, compared = [], []
    for index in range(COMPARED):
        a, b = (replay(spec, truck, controller, index).table for spec in (fine, coarse))
        same = (a["current_free_a"] == b["current_free_a"]).to_numpy()
        until = len(same) if same.all() else int(np.argmin(same)) + 1
        difference = (a["velocity_free_m_s"] - b["velocity_free_m_s"]).to_numpy()[:until]
        largest.append(np.abs(difference).max())
        compared.append(until / len(same))
    return float(np.median(largest)), float(np.mean(compared))


class Cvode:
    """CVODE in C at its best, on lowerings of `benches/peers`."""

    LADDER = (2e-5, 1e-5, 3e-6)

    def __init__(self, folder, sundials, count):
        sys.path.insert(0, str(Path(__file__).parent / "peers"))
        import native
        from lowerings import error, make
        from run import CVODE_BEST, REFERENCE, TARGET

        self.native, self.error, self.target = native, error, TARGET
        self.best, self.count = CVODE_BEST, count
        self.lowerings = folder / "lowerings"
        make(count, 2017).write(self.lowerings)
        self.command = [str(native.build_cvode(folder, sundials))]
        self.reference, _ = native.integrate(self.command, self.lowerings, REFERENCE)
        self.rows = {}

    def time(self):
        """Every tolerance once: the fastest of its times counts."""
        for rtol in self.LADDER:
            found, spent = self.native.integrate(self.command, self.lowerings, self.best | {"rtol": rtol})
            before = self.rows.get(rtol, (0.0, float("inf")))[1]
            self.rows[rtol] = (self.error(found, self.reference).v_median, min(before, spent / self.count))

    def seconds(self):
        """A lowering at the target error, between the tolerances."""
        errors, times = (np.log([self.rows[rtol][k] for rtol in reversed(self.LADDER)]) for k in (0, 1))
        return float(np.exp(np.interp(np.log(self.target), errors, times)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--members", type=int, default=4096)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--controller", default="thesis")
    parser.add_argument("--peers", action="store_true", help="CVODE in C in turn with these")
    parser.add_argument(
        "--sundials", type=Path, help="source of SUNDIALS 6 or 7; without it the system's library"
    )
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    truck = Truck.read("thesis")
    rows = [
        (loop, substeps, lanes, threads)
        for loop in ("closed", "open")
        for substeps in (2, 3)
        for lanes, threads in ((16, 1), (16, 2), (1, 1))
    ]
    best = {}
    home = tempfile.TemporaryDirectory()
    cvode = Cvode(Path(home.name), options.sundials, 16) if options.peers else None
    for _ in range(options.repeats):
        if cvode:
            cvode.time()
        for row in rows:
            loop, substeps, lanes, threads = row
            name = options.controller if loop == "closed" else None
            controller = Controller.read(name) if name else None
            members = Members(specification.check(document(substeps, name)), truck, controller, threads)
            count = options.members // (8 if lanes == 1 else 1)
            spent = seconds(members, count, lanes) / count
            best[row] = min(spent, best.get(row, spent))
    lines = [
        "| loop | substeps a tick | lanes | threads | v median [m/s] | ticks compared "
        "| µs a lowering | lowerings a second | ns a state and substep |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    errors = {}
    for row in rows:
        loop, substeps, lanes, threads = row
        name = options.controller if loop == "closed" else None
        if (loop, substeps) not in errors:
            errors[loop, substeps] = error(truck, Controller.read(name) if name else None, substeps, name)
        off, share = errors[loop, substeps]
        spent = best[row]
        lines.append(
            f"| {loop} | {substeps} | {lanes} | {threads} | {off:.1e} | {100 * share:.0f} % "
            f"| {1e6 * spent:.1f} | {1.0 / spent:.0f} "
            f"| {1e9 * spent * threads / (TICKS * substeps * STATES):.2f} |"
        )
    if cvode:
        peer = cvode.seconds()
        lines += [
            "",
            f"CVODE in C at its best, open loop, {cvode.target:.1e} m/s: {1e3 * peer:.2f} ms a lowering.",
        ]
        lines += [
            f"- {rtol:.0e}: {off:.1e} m/s, {1e3 * spent:.2f} ms." for rtol, (off, spent) in cvode.rows.items()
        ]
        for loop in ("closed", "open"):
            near = min(
                (row for row in rows if row[0] == loop and row[2:] == (16, 1)),
                key=lambda row: abs(np.log(errors[row[0], row[1]][0] / cvode.target)),
            )
            lines.append(
                f"- {loop.capitalize()} loop, {near[1]} substeps, 16 lanes, one core: "
                f"{peer / best[near]:.0f} times as many "
                f"lowerings a second, at {errors[near[0], near[1]][0]:.1e} m/s."
            )
    home.cleanup()
    text = "\n".join(lines)
    print(text)
    if options.out:
        options.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""The relief valve with impacts as an ensemble: systems a second, and how far from SciPy.

    python benches/relief_valve.py [--members 1024] [--repeats 3] [--program PROGRAM] [--out TABLE.md]

`benches/relief_valve.rs` says what is solved, and how. PROGRAM is that bench, compiled; without it cargo
builds and runs it. In the same run, one core each and the repeats in turn: this package's lanes and its
plain numbers; Boost's odeint in C++ with the same method and tolerances, where a compiler and Boost are;
SciPy's DOP853 with its own events to 1e-12 on some of the systems, from which all distances are counted.
The fastest of the repeats counts, in processor time.

Where the steady motion repeats itself (at most 32 different heights within 1e-6 among SciPy's 64), "off" is
the largest distance of a height from the nearest of the other's, both ways. A chaotic motion has no such
points: nearby ones part. Of these the highest height of the 64 is compared. Lanes must give the bits of plain
numbers.
"""

import argparse
import shlex
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

HERE = Path(__file__).parent
KAPPA, DELTA, BETA, RESTITUTION = 1.25, 10.0, 20.0, 0.8
PASSED_OVER, KEPT = 2048, 64
STICKS, AT_REST, TOLERANCE = 1e-5, 1e-9, 1e-12
ALIKE, MOST_HEIGHTS = 1e-6, 32
STATES = 3
SPAN = 200.0
LANES = (16, 8, 1)
"""Side by side, the last one by itself."""
PROGRAM = "cargo bench --bench relief_valve --"

# The authors' own runs of 2048 extrema passed over and 64 kept, from the scripts of their figures:
# github.com/nnagyd/ode_solver_tests, Valve_RK45/Performance and Valve_DP5/Performance.
PUBLISHED = {
    "MPGOS on an Nvidia Titan Black (published)": (4147200, 1000.7),
    "odeint with VCL, one core of an i7-4820K (published)": (30720, 865.461),
    "odeint, one core of an i7-4820K (published)": (30720, 1201.0),
    "DifferentialEquations.jl, i7-4820K (published)": (16384, 3601.0),
}


def rates(_, y, q):
    """Of displacement, velocity and pressure."""
    force = y[2] - (y[0] + DELTA)
    return [y[1], force - KAPPA * y[1], BETA * (q - y[0] * np.sqrt(max(y[2], 0.0)))]


def seat(_, y, q):
    """Falls through zero at an impact."""
    return y[0]


def extremum(_, y, q):
    """Zero where the valve turns."""
    return y[1]


seat.terminal, seat.direction = True, -1.0


def by_scipy(q):
    """The 64 heights after 2048: SciPy's events, from impact to impact."""
    y, t, before, events, kept = np.array([0.2, 0.0, 0.0]), 0.0, np.inf, 0, []
    while True:
        done = solve_ivp(
            rates,
            (t, t + SPAN),
            y,
            "DOP853",
            args=(q,),
            events=(seat, extremum),
            rtol=TOLERANCE,
            atol=TOLERANCE,
        )
        turned = [
            (at, found[0]) for at, found in zip(done.t_events[1], done.y_events[1], strict=True) if at > t
        ]
        heights = [height for _, height in turned]
        if done.status == 1:
            heights.append(0.0)
        for height in heights:
            if events >= PASSED_OVER:
                kept.append(height)
            events += 1
            if height > AT_REST and abs(height - before) < AT_REST:
                kept += [height] * (KEPT - len(kept))
            before = height
            if len(kept) == KEPT:
                return np.array(kept)
        t, y = done.t[-1], done.y[:, -1]
        if done.status == 1:
            speed = -RESTITUTION * y[1]
            stays = speed < STICKS and y[2] < DELTA
            y = np.array([0.0, 0.0, DELTA] if stays else [0.0, speed, y[2]])


def read(path):
    """By line of a diagram its heights."""
    return [np.array(line.split()[1:], dtype=float) for line in path.read_text().splitlines()]


def off(found, reference):
    """Largest distance of a height of either from the nearest of the other."""
    apart = np.abs(found[:, None] - reference[None, :])
    return max(apart.min(axis=0).max(), apart.min(axis=1).max())


def repeats_itself(heights):
    """Whether there are few different ones."""
    return int((np.diff(np.sort(heights)) > ALIKE).sum()) < MOST_HEIGHTS


class Row:
    """One way to solve all systems: what it found, the fastest of its times [s], attempted steps."""

    def __init__(self, name, command, lanes):
        self.name, self.command, self.lanes = name, command, lanes
        self.seconds, self.steps, self.heights = np.inf, None, []

    def time(self, out):
        """Once more."""
        told = subprocess.run(
            [one.format(out=out) for one in self.command], check=True, capture_output=True, text=True
        ).stdout.split()
        self.seconds = min(self.seconds, float(told[0]))
        self.steps = float(told[1]) if len(told) > 1 else None
        self.heights = read(out)


def odeint(folder):
    """The program in C++, or None where it cannot be built."""
    if not shutil.which("g++"):
        return None
    program = folder / "odeint"
    command = [
        "g++",
        "-std=c++17",
        "-O3",
        "-march=native",
        str(HERE / "peers" / "relief_valve.cpp"),
        "-o",
        str(program),
    ]
    return str(program) if subprocess.run(command, capture_output=True, check=False).returncode == 0 else None


class Found:
    """All ways in one run: `rows`, of which `plain` are our plain numbers, and SciPy's seconds a system.

    `regular` and `chaotic` are the places of the systems that SciPy solved, `reference` their heights.
    """

    def __init__(self, members, checked, repeats, program):
        self.members, ours = members, shlex.split(program)
        with tempfile.TemporaryDirectory() as home:
            folder = Path(home)
            self.rows = [
                Row(f"forklift, {lanes} lanes" if lanes > 1 else "forklift, plain numbers",
                    [*ours, "{out}", f"lanes={lanes}", f"members={members}"], lanes)
                for lanes in LANES
            ]  # fmt: skip
            if peer := odeint(folder):
                self.rows.append(Row("odeint, Dormand–Prince 5(4)", [peer, "{out}", str(members)], 1))
            for _ in range(repeats):
                for row in self.rows:
                    row.time(folder / "diagram")
        self.plain = self.rows[len(LANES) - 1]
        for row in self.rows[: len(LANES) - 1]:
            if not all(map(np.array_equal, row.heights, self.plain.heights)):
                raise SystemExit(f"{row.name}: not the bits of plain numbers")
        places = [int((k + 0.5) * members / checked) for k in range(checked)]
        clock = time.process_time()
        self.reference = {k: by_scipy(0.2 + 9.8 * k / (members - 1)) for k in places}
        self.scipy_s = (time.process_time() - clock) / checked
        self.regular = [k for k in places if repeats_itself(self.reference[k])]
        self.chaotic = [k for k in places if k not in self.regular]

    def each(self, row):
        """Seconds a system, nanoseconds a state and attempted step or a dash, times our plain numbers."""
        step = f"{1e9 * row.seconds / (row.steps * STATES):.2f}" if row.steps else "–"
        return row.seconds / self.members, step, self.plain.seconds / row.seconds

    def off(self, row):
        """How far its heights are off where the motion repeats itself."""
        return max((off(row.heights[k], self.reference[k]) for k in self.regular), default=np.nan)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--members", type=int, default=1024)
    parser.add_argument("--checked", type=int, default=16, help="systems that SciPy solves")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--program", default=PROGRAM, help="the bench, compiled")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    members = given.members
    run = Found(members, given.checked, given.repeats, given.program)
    lines = [
        "| method | systems | ms a system and core | systems a second and core | ns a state and step "
        "| times our plain numbers | off, regular | highest, off, chaotic |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in run.rows:
        each, step, gain = run.each(row)
        high = max((abs(row.heights[k].max() - run.reference[k].max()) for k in run.chaotic), default=np.nan)
        lines.append(
            f"| {row.name} | {members} | {1e3 * each:.2f} | {1.0 / each:.0f} | {step} "
            f"| {gain:.2f} | {run.off(row):.1e} | {high:.1e} |"
        )
    lines.append(
        f"| SciPy DOP853, 1e-12 | {given.checked} | {1e3 * run.scipy_s:.0f} | {1.0 / run.scipy_s:.2f} | – "
        f"| {run.plain.seconds / members / run.scipy_s:.4f} | – | – |"
    )
    for name, (systems, seconds) in PUBLISHED.items():
        told = f"{1e3 * seconds / systems:.2f} | {systems / seconds:.1f}"
        lines.append(f"| {name} | {systems} | {told} | – | – | – | – |")
    lines += ["", f"Of the {given.checked} systems that SciPy solved {len(run.regular)} repeat themselves."]
    if run.rows[0].steps:
        lines.append(f"Attempted steps a system, on average: {run.rows[0].steps / members:.0f}.")
    text = "\n".join(lines)
    print(text)
    if given.out:
        given.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

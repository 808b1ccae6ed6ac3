"""Compare ways of integrating 64 ten-second lowerings of the free lift: error against time, one table.

    python benches/peers/run.py --out table.md [--sundials FOLDER] [--radau FOLDER] [--ours PROGRAM]

README.md beside this file says what each peer needs and how its settings were found.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import native
import numpy as np
from lowerings import START_M, TICK_S, Lowerings, error, make
from ours import SETTINGS, ours
from python_peers import Lift
from table import CVODE, Row, markdown, ratios_at, time_at

OURS = "forklift"
TARGET = 1.5e-4  # m/s, median over the lowerings of the largest error of v along each
REFERENCE = {"rtol": 1e-11, "restart": 1}
CVODE_PLAIN = {"restart": 1}
CVODE_BEST = {
    "order": 3, "stop": 0, "nls": 2, "setup": 15, "jacage": 10, "dgamma": 0.6,
    "si": 0.2, "sdi": 50, "szv": 1.2, "sx": 0.6, "sv": 0.007, "sz": 10, "spa": 1e7, "spb": 5e5, "sac": 3.5e-5,
}  # fmt: skip
RADAU_BEST = {"stages": 3, "theta": 0.05, "sdi": 50, "spb": 1e6, "sac": 2e-6}

Solved = tuple[np.ndarray, float]
Peer = tuple[str, str, int, int, Callable[[], Solved]]  # method, setting, lowerings, repeats, run


def peers(args: argparse.Namespace, lowerings: Lowerings, folder: Path) -> list[Peer]:
    """Every row of the table to be, with what computes it."""
    everything = folder / "lowerings"
    cvode = [str(native.build_cvode(folder, args.sundials))]
    lift = Lift(native.build_lift(folder))
    found: list[Peer] = []

    def add_native(command: list[str], method: str, family: str, options: dict, rtols: tuple) -> None:
        for rtol in rtols:

            def run(options: dict = options | {"rtol": rtol}) -> Solved:
                return native.integrate(command, everything, options)

            found.append((method, f"{family}, rtol {rtol:.0e}", args.n, args.repeats, run))

    def add_python(name: str, method: str, family: str, rtols: tuple, n: int, repeats: int) -> None:
        for rtol in rtols:

            def run(rtol: float = rtol) -> Solved:
                return lift.integrate(getattr(lift, name), lowerings[:n], rtol)

            found.append((method, f"{family}, rtol {rtol:.0e}", min(n, args.n), repeats, run))

    add_native(cvode, CVODE, "restart at each tick", CVODE_PLAIN, (1e-4, 1e-5, 1e-6, 1e-7, 1e-8))
    add_native(
        cvode,
        CVODE,
        "no restart, no stop, tuned",
        CVODE_BEST,
        (2e-4, 5e-5, 2e-5, 1e-5, 3e-6, 1e-6, 1e-7, 1e-8),
    )
    add_native(
        cvode,
        CVODE,
        "no restart, stop, tuned",
        CVODE_BEST | {"stop": 1},
        (5e-5, 1e-5, 3e-6, 1e-6, 1e-7, 1e-8),
    )
    if args.radau:
        radau = [str(native.build_radau(folder, args.radau))]
        rtols = (1e-2, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 1e-7)
        add_native(radau, "RADAU5, Fortran", "stop at each tick, tuned", RADAU_BEST, rtols)
    if find_spec("numbalsoda"):
        add_python(
            "numbalsoda", "LSODA, C++ (numbalsoda)", "own Jacobian", (1e-4, 1e-5, 1e-6), args.n, args.repeats
        )
    else:
        print("numbalsoda is not installed: its row is left out", file=sys.stderr)
    add_python("lsoda", "LSODA, SciPy odeint", "compiled functions", (1e-4, 1e-5, 1e-6), 16, 3)
    add_python("sundae", "CVODE, scikit-sundae", "compiled functions, order 3", (1e-4, 1e-5, 1e-6), 16, 3)
    add_python("bdf", "BDF, SciPy", "compiled functions", (1e-4, 1e-5, 1e-6), args.slow, 1)
    add_python("radau", "Radau, SciPy", "compiled functions", (1e-3, 1e-4, 1e-5), args.slow, 1)
    if find_spec("diffrax"):
        for rtol in (1e-4, 1e-5, 1e-6, 1e-7):

            def run(rtol: float = rtol) -> Solved:
                from by_diffrax import solver
                from python_peers import SCALE

                some = lowerings[: args.slow]
                return solver(*lift.at_rest(some), SCALE, some, rtol)()

            n = min(args.slow, args.n)
            found.append(("Kvaerno5, diffrax", f"vmap, own Jacobian, rtol {rtol:.0e}", n, 1, run))
    else:
        print("diffrax is not installed: its rows are left out", file=sys.stderr)
    for label, setting in SETTINGS.items() if args.ours else ():
        found.append((OURS, label, args.n, args.repeats, lambda s=setting: ours(lowerings, s, args.ours)))
    return found


def reference(lowerings: Lowerings, args: argparse.Namespace, folder: Path) -> tuple[np.ndarray, list[str]]:
    """The reference trajectories, and how far from them two independent ways land."""
    lowerings.write(folder / "lowerings")
    states, _ = native.integrate(
        [str(native.build_cvode(folder, args.sundials))], folder / "lowerings", REFERENCE
    )
    if states[..., 0].min() <= 0:
        raise SystemExit("a lowering meets the cylinder's bottom")
    notes = []
    if args.radau:
        radau = [str(native.build_radau(folder, args.radau))]
        other, _ = native.integrate(radau, folder / "lowerings", RADAU_BEST | {"rtol": 1e-11, "theta": 0.001})
        notes.append(_deviation(f"RADAU5 at rtol 1e-11, {args.n} lowerings", other, states))
    if args.witness:
        notes.append(
            _deviation(
                f"the NumPy witness, {args.witness} lowerings", _witness(lowerings[: args.witness]), states
            )
        )
    return states, notes


def _deviation(name: str, other: np.ndarray, states: np.ndarray) -> str:
    e = error(other, states)
    return f"- Reference against {name}: v {e.v_worst:.1e} m/s, p_A {e.p_worst:.1e} of itself at worst."


def _witness(lowerings: Lowerings) -> np.ndarray:
    sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
    from reference import witness

    assert witness.FREE["x_0"] == START_M
    time = np.arange(lowerings.command_a.shape[1] + 1) * TICK_S
    states = [
        witness.simulate(witness.FREE, time, command, load, temperature, rtol=1e-9)[:, [3, 4, 6, 7]]
        for load, temperature, command in zip(
            lowerings.load_kg, lowerings.temperature_degc, lowerings.command_a, strict=True
        )
    ]
    return np.array(states)


def measure(found: list[Peer], states: np.ndarray) -> list[Row]:
    """Run every peer, the repeats interleaved so that a busy moment does not fall upon one of them."""
    rows: list[Row] = []
    for repeat in range(max(repeats for *_, repeats, _ in found)):
        for k, (method, setting, n, repeats, run) in enumerate(found):
            if repeat >= repeats:
                continue
            trajectories, seconds = run()
            if repeat == 0:
                rows.append(Row(method, setting, n, error(trajectories, states)))
            rows[k].ms.append(seconds / n * 1e3)
        print(f"repeat {repeat + 1} done", file=sys.stderr)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="where the table goes")
    parser.add_argument(
        "--sundials", type=Path, help="source of SUNDIALS 6 or 7; without it the system's library"
    )
    parser.add_argument("--radau", type=Path, help="folder with radau.f, decsol.f, dc_decsol.f")
    parser.add_argument("--ours", help="program that integrates a lowerings file with this package's core")
    parser.add_argument("--n", type=int, default=64, help="lowerings")
    parser.add_argument("--seed", type=int, default=2017)
    parser.add_argument("--repeats", type=int, default=7, help="of each compiled peer")
    parser.add_argument("--slow", type=int, default=4, help="lowerings for the slow peers")
    parser.add_argument("--witness", type=int, default=2, help="lowerings the witness checks")
    args = parser.parse_args()
    lowerings = make(args.n, args.seed)
    with tempfile.TemporaryDirectory() as name:
        states, notes = reference(lowerings, args, Path(name))
        rows = measure(peers(args, lowerings, Path(name)), states)
    notes.append(
        f"- CVODE at its best takes {time_at(rows, CVODE, TARGET):.2f} ms at a median error of {TARGET} m/s."
    )
    if ratios := ratios_at(rows, OURS, TARGET):
        told = ", ".join(f"{name} {ratio:.1f}" for name, ratio in ratios.items())
        notes.append(f"- Times as fast as that at the same error, between the rows: {told}.")
    fast = [(row.time_ms, row) for row in rows if row.error.v_median <= TARGET]
    best = min(fast, key=lambda pair: pair[0])[1]
    notes.append(f"- Fastest at or below that error: {best.method}, {best.setting}: {best.time_ms:.2f} ms.")
    args.out.write_text(markdown(rows, TARGET) + "\n\n" + "\n".join(notes) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""Whether what a sensor or an entered condition is off by is told with its number, and mends every recording.

    python proofs/conditions.py [--out FOLDER] [--only WORDS] [--lifts free,main]

A truck scattered by 12 % lowers a lift at 0, 800, 1500 kg and 20, 60 °C; its recordings are spoilt in one
way, and diagnosed from the thesis's truck. A row is a case: what was found first, its number with the 95 %
interval, whether that holds the truth, and on how many recordings velocity or pressure fit worse after than
before (by more than the tenth of a point that a fit of another start moves them). Rows go to
FOLDER/conditions.json as they come, and a case that is there already is not done again.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from forklift import Campaign, Recording, Truck, commands, diagnose, simulate
from forklift.app.demo import measured, scattered
from forklift.fitting.agreement import change

LOADS_KG, DEGC = (0.0, 800.0, 1500.0), (20.0, 60.0)
DURATION_S = 8.0
SEED = 4
SAME = 0.1
"""Points of NRMSE within which a fit is the same."""


def recordings(lift: str) -> tuple[Recording, ...]:
    """Two of every operating point: one to fit on, one held out."""
    truck = scattered(Truck.read("thesis"), SEED)
    found = []
    for place, (load, degc, role) in enumerate(
        (load, degc, role) for load in LOADS_KG for degc in DEGC for role in ("estimate", "validate")
    ):
        prms = commands.generate("prms", lift, duration_s=DURATION_S, seed=100 + place)
        run = simulate(truck, prms, load_kg=load, oil_temperature_degc=degc)
        table = measured(run, SEED, place)
        columns = {name: table[name].to_numpy() for name in table.columns if name != "time_s"}
        file = f"{lift}_{load:.0f}kg_{degc:.0f}c_{role}.csv"
        found.append(Recording(file, lift, load, role, run.time_s, columns))
    return tuple(found)


def column(name, change):
    """Spoils one channel."""

    def spoil(one: Recording) -> Recording:
        own = name.format(lift=one.lift)
        channels = dict(one.channels) | {own: change(one.channels[own], one.time_s)}
        return replace(one, channels=channels, sha256="")

    return spoil


def late(values, time, lag):
    return np.interp(time - lag, time, values)


CASES = {
    **{
        f"load entered {-off:+.0f} kg": ("load_entered", off, lambda one, off=off: replace(
            one, load_kg=one.load_kg - off if one.load_kg else 0.0, sha256=""))
        for off in (-90.0, 130.0)
    },
    **{
        f"pressure gain {100 * off:+.0f} %": ("pressure_gain", 1.0 + off, column(
            "pressure_{lift}_pa", lambda v, _, off=off: (1.0 + off) * v))
        for off in (-0.08, 0.08)
    },
    **{
        f"pressure offset {1e-5 * off:+.0f} bar": ("pressure_offset", off, column(
            "pressure_{lift}_pa", lambda v, _, off=off: v + off))
        for off in (-4e5, 4e5)
    },
    **{
        f"pressure {1e3 * lag:.0f} ms late": ("sensor_lag", lag, column(
            "pressure_{lift}_pa", lambda v, t, lag=lag: late(v, t, lag)))
        for lag in (0.02, 0.06)
    },
    **{
        f"encoder {100 * off:+.0f} %": ("position_scale", 1.0 + off, column(
            "position_{lift}_m", lambda v, _, off=off: (1.0 + off) * v))
        for off in (-0.05, 0.05)
    },
    **{
        f"oil temperature {off:+.0f} K": ("temperature_offset", -off, column(
            "oil_temperature_degc", lambda v, _, off=off: v + off))
        for off in (-5.0, 5.0)
    },
}  # fmt: skip
"""By case: the hypothesis that is right, its number, and how recordings are spoilt."""


def row(lift: str, case: str) -> dict:
    right, truth, spoil = CASES[case]
    campaign = Campaign(f"{lift}, {case}", 50.0, tuple(map(spoil, recordings(lift))))
    found = diagnose(campaign, "thesis")
    told = found.to_dict()
    cause = next(iter(told["causes"]), None)
    number = cause["parameters"][0] if cause and cause["parameters"] else None
    fits = change(found.before, found.after)
    kept = fits.filter(
        fits["channel"].str.starts_with("velocity") | fits["channel"].str.starts_with("pressure")
    ).drop_nulls(["nrmse_percent_before", "nrmse_percent_after"])
    moved = kept["nrmse_percent_after"] - kept["nrmse_percent_before"]
    return {
        "lift": lift, "case": case, "right": right, "truth": truth,
        "found": [one["id"] for one in told["causes"]],
        "value": number and number["value"], "lower": number and number["lower"],
        "upper": number and number["upper"],
        "holds": bool(number and number["lower"] <= truth <= number["upper"]),
        "gap_closed": found.gap_closed, "fits": len(moved),
        "worse": int((moved < -SAME).sum()), "least": float(moved.min()), "mean": float(moved.mean()),
    }  # fmt: skip


def text(rows: list[dict]) -> str:
    head = f"{'lift':5} {'case':24} {'found':28} {'number (95 %)':34} {'truth':>9} holds  worse  mean gain"
    lines = [head]
    for one in rows:
        said = "—"
        if one["value"] is not None:
            said = f"{one['value']:.4g} ({one['lower']:.4g} to {one['upper']:.4g})"
        lines.append(
            f"{one['lift']:5} {one['case']:24} {', '.join(one['found']) or 'nothing':28} {said:34} "
            f"{one['truth']:9.4g} {'yes' if one['holds'] else 'no':5} {one['worse']:2} of {one['fits']} "
            f"{one['mean']:+9.2f}"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("conditions"))
    parser.add_argument("--only", default="")
    parser.add_argument("--lifts", default="free,main")
    given = parser.parse_args()
    given.out.mkdir(exist_ok=True)
    file = given.out / "conditions.json"
    rows = json.loads(file.read_text(encoding="utf-8")) if file.exists() else []
    done = {(one["lift"], one["case"]) for one in rows}
    for case in CASES:
        for lift in given.lifts.split(","):
            if (lift, case) in done or given.only not in case:
                continue
            rows.append(row(lift, case))
            file.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
            print(text(rows[-1:]).splitlines()[1], flush=True)
    print(text(rows))


if __name__ == "__main__":
    main()

"""What the four campaigns of tests/campaigns conceal, as `diagnose` finds it, against what must be reached.

    python proofs/campaigns.py [CAMPAIGN ...]

Ends with status 0 if every bound holds.
"""

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from forklift import Campaign, Truck, diagnose

ROOT = Path(__file__).resolve().parents[1]
CAMPAIGNS = ROOT / "tests" / "campaigns"

CREDIBLE, NEAR, AT_NOISE, CLOSED = 0.9, 0.05, 1.2, 0.95


@dataclass(frozen=True)
class Concealed:
    """What a campaign's truck has that the model does not."""

    lift: str
    equation: str
    cause: str
    parameter: str
    value: float
    limit_s: float = 30.0


CONCEALED = {
    "null": None,
    "thermfric": Concealed(
        "free", "friction", "friction_temperature", "free.friction_temperature.rate", 0.018
    ),
    "leak": Concealed("main", "cylinder-pressure", "leakage", "main.leakage.coefficient", 1.5e-12),
    "coupling": Concealed("both", "mast-coupling", "mast_coupling", "mast_coupling.factor", 1.0, 120.0),
}


def row(name):
    """A line of the table, and which bounds are missed."""
    truth, began = CONCEALED[name], time.monotonic()
    found = diagnose(Campaign.read(CAMPAIGNS / name), Truck.read("thesis"))
    seconds, left = time.monotonic() - began, found.final.worst.mean_square
    bounds = {"left over": left <= AT_NOISE, "time": seconds <= (truth.limit_s if truth else 30.0)}
    told = [name, found.verdict]
    if truth is None:
        bounds["verdict"] = found.verdict == "no-mismatch"
        told += ["–", "–", "–"]
    else:
        place = f"{found.location.part}, {found.location.equation}" if found.location else "–"
        first = (
            found.to_dict()["causes"][0] if found.causes else {"id": "", "credibility": 0.0, "parameters": []}
        )
        rows = [one for one in first["parameters"] if one["name"] == truth.parameter]
        inside = bool(rows) and rows[0]["lower"] <= truth.value <= rows[0]["upper"]
        bounds |= {
            "verdict": found.verdict == "missing-physics",
            "place": place == f"{truth.lift}, {truth.equation}",
            "cause": first["id"] == truth.cause,
            "credibility": first["credibility"] > CREDIBLE,
            "amplitude": inside and abs(rows[0]["value"] / truth.value - 1.0) <= NEAR,
            "gap": found.gap_closed >= CLOSED,
        }
        amplitude = (
            f"{rows[0]['value']:.5g} ({rows[0]['lower']:.5g} to {rows[0]['upper']:.5g}); {truth.value:g}"
            if rows
            else "–"
        )
        told += [f"{place}: {first['id']}", f"{first['credibility']:.3f}", amplitude]
    gap = f"{100.0 * found.gap_closed:.1f} %" if truth else "–"
    told += [f"{found.baseline.worst.mean_square:.3g}", f"{left:.3g}", gap, f"{seconds:.0f}"]
    return told, [bound for bound, holds in bounds.items() if not holds]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("campaigns", nargs="*", metavar="CAMPAIGN", help="of null, thermfric, leak, coupling")
    asked = parser.parse_args().campaigns or list(CONCEALED)
    unknown = [name for name in asked if name not in CONCEALED]
    if unknown:
        parser.error(f"there is no campaign {', '.join(unknown)}; there are {', '.join(CONCEALED)}")
    print("| campaign | verdict | place and cause | credibility | amplitude (95 %); truth ", end="")
    print("| worst before | after | gap closed | s | bounds |")
    print("|---|---|---|---:|---|---:|---:|---:|---:|---|")
    missed = 0
    for name in asked:
        told, wrong = row(name)
        missed += len(wrong)
        print(
            f"| {' | '.join(told)} | {'missed: ' + ', '.join(wrong) if wrong else 'all hold'} |", flush=True
        )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())

"""What hypotheses promise by chance: of complete trucks, with everything that a recording suffers from.

    python proofs/chance.py [--seed 12] [--campaigns 60] [--out TABLE.md]

The campaigns of `forklift prove --seed SEED --campaigns CAMPAIGNS` in which nothing is concealed are
diagnosed. Of each hypothesis the screening says how far −ln posterior would fall over all recordings; one
that is next to nothing (`LEAST_FAULT`, `LEAST_EFFECT`) is not asked for, or not accepted. The table has the
greatest of every kind in each campaign, of sensors also of those (`rounded`: what encoders must show of a
curve is more), and below it over all campaigns, beside the bound from which on it would have been asked
for. Ends with status 1 if a bound was passed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from forklift import Diagnosis, ForkliftError, diagnose
from forklift.diagnosis.criteria import (
    ALARM_CONDITION,
    ALARM_PHYSICS,
    ALARM_ROUNDED,
    ALARM_SENSOR,
    LEAST_EFFECT,
    LEAST_FAULT,
)
from forklift.ensemble.proof.conceal import conceal
from forklift.ensemble.proof.draw import Draw, draw, kind_of

BOUNDS = {
    "physics": ALARM_PHYSICS,
    "one offset": ALARM_PHYSICS,
    "condition": ALARM_CONDITION,
    "sensor": ALARM_SENSOR,
    "rounded": ALARM_ROUNDED,
}


def promised(found: Diagnosis) -> dict[str, tuple[float, str]]:
    """The greatest promise of each kind, and whose it is."""
    most = dict.fromkeys(BOUNDS, (0.0, "–"))
    for one in found.screening.singles:
        hypothesis = one.hypotheses[0]
        if hypothesis.kind == "sensor":
            most["rounded"] = max(most["rounded"], (one.gain, hypothesis.label))
        if abs(one.amplitudes[0]) < (LEAST_EFFECT if hypothesis.kind == "physics" else LEAST_FAULT):
            continue
        kind = {"parameter": "one offset" if hypothesis.amplitude else "condition"}.get(
            hypothesis.kind, hypothesis.kind
        )
        most[kind] = max(most[kind], (one.gain, hypothesis.label))
    return most


def asked(given: Draw) -> Diagnosis:
    """The diagnosis of a campaign that is drawn."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "campaign"
        conceal(given, folder)
        conditions = {} if given.entered_degc is None else {"oil_temperature_degc": given.entered_degc}
        return diagnose(folder, "thesis", **conditions)


def cell(one: tuple[float, str]) -> str:
    return f"{one[0]:.1f} `{one[1]}`" if one[0] else "–"


def main() -> int:
    """A row for each complete truck, and the greatest of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=12)
    parser.add_argument("--campaigns", type=int, default=60)
    parser.add_argument("--out", type=Path, help="where the table goes")
    given = parser.parse_args()
    lines = [f"| campaign | verdict | {' | '.join(BOUNDS)} |", "|---:|---|" + "---|" * len(BOUNDS)]
    print("\n".join(lines), flush=True)
    greatest = dict.fromkeys(BOUNDS, (0.0, "–"))
    for number in range(given.campaigns):
        if kind_of(given.seed, number) != "complete":
            continue
        try:
            found = asked(draw(given.seed, number))
        except ForkliftError as error:
            lines.append(f"| {number} | refused: {error.code} |" + " |" * len(BOUNDS))
            print(lines[-1], flush=True)
            continue
        most = promised(found)
        greatest = {kind: max(greatest[kind], most[kind]) for kind in BOUNDS}
        lines.append(f"| {number} | {found.verdict} | " + " | ".join(map(cell, most.values())) + " |")
        print(lines[-1], flush=True)
    lines.append("| all | greatest | " + " | ".join(map(cell, greatest.values())) + " |")
    lines.append("| | bound | " + " | ".join(f"{bound:g}" for bound in BOUNDS.values()) + " |")
    print("\n".join(lines[-2:]))
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return int(any(greatest[kind][0] >= BOUNDS[kind] for kind in BOUNDS))


if __name__ == "__main__":
    sys.exit(main())

"""Whether a diagnosis stands when the same recordings come from loggers with several clocks.

    python proofs/clocks.py [--out TABLE.md] [CLOCKS ..]

The campaign ``tests/campaigns/null`` conceals nothing. It is diagnosed as the CSV files it is, and then as
MDF4 in each of the ways of ``tests/clocked.py``. A row each: the clocks, the skew that was put in, the
verdict, what was told of clocks with its interval, and the processor time with the reading of the files: in
seconds, and as a multiple of the CSV's.

A row holds if the verdict is no mismatch; if a clock is told to be off just where one was put off, and the
interval holds by how much; and if it takes at most a fifth more than the CSV. Ends with status 0 if all do.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from time import process_time
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

import clocked  # noqa: E402
from forklift import Campaign, Truck, diagnose  # noqa: E402

CSV = "the CSV files themselves"
SKEWS = {
    "7 ms of phase": ("shift_s", clocked.PHASE_S),
    "3 ms late": ("shift_s", clocked.LATE_S),
    "0.3 % fast": ("drift", clocked.FAST - 1.0),
}
"""What a way of logging puts in: its name among the facts of a caution, its number [s], of a drift [1]."""
HEAD = (
    "| clocks | put in | verdict | told of clocks, 95 % interval | time | of the CSV's | holds |",
    "|---|---|---|---|---:|---:|---|",
)
SLOWER = 1.2
"""How many times the CSV's time a diagnosis may take."""


def timed(campaign: Path) -> tuple[dict[str, Any], float]:
    """A diagnosis and its processor time with the reading of the files [s]."""
    start = process_time()
    found = diagnose(Campaign.read(campaign), Truck.read("thesis")).to_dict()
    return found, process_time() - start


def row(how: str, campaign: Path, csv_s: float | None) -> tuple[str, bool, float]:
    """The row of one way of logging, whether it holds, and its time [s]."""
    found, seconds = timed(campaign)
    told = {
        name: one
        for caution in found["cautions"]
        if caution["code"] == "clocks-apart"
        for name, one in caution["facts"].items()
        if name != "clock"
    }
    skew = SKEWS.get(how)
    holds = found["verdict"] == "no-mismatch" and set(told) == ({skew[0]} if skew else set())
    holds = holds and (skew is None or told[skew[0]]["lower"] <= skew[1] <= told[skew[0]]["upper"])
    holds = holds and (csv_s is None or seconds <= SLOWER * csv_s)
    said = [
        f"`{name}` {one['value']:.4g} [{one['lower']:.4g}, {one['upper']:.4g}]" for name, one in told.items()
    ]
    cells = [
        how,
        f"`{skew[0]}` {skew[1]:.4g}" if skew else "–",
        found["verdict"],
        "; ".join(said) or "–",
        f"{seconds:.0f} s",
        "–" if csv_s is None else f"{seconds / csv_s:.2f}",
        "yes" if holds else "**no**",
    ]
    return "| " + " | ".join(cells) + " |", holds, seconds


def main() -> int:
    """Diagnose the campaign in every way asked for, or in all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clocks", nargs="*", help="names of tests/clocked.py; all without")
    parser.add_argument("--out", type=Path, help="where the table goes")
    given = parser.parse_args()
    there = HERE.parent / "tests" / "campaigns" / "null"
    null = Campaign.read(there)
    first, every, csv_s = row(CSV, there, None)
    lines = [*HEAD, first]
    print("\n".join(lines), flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        for place, how in enumerate(given.clocks or clocked.CLOCKS):
            logged = clocked.write(null, Path(scratch) / str(place), clocked.CLOCKS[how])
            line, holds, _ = row(how, logged, csv_s)
            lines.append(line)
            every = every and holds
            print(line, flush=True)
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0 if every else 1


if __name__ == "__main__":
    raise SystemExit(main())

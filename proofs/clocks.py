"""Whether a diagnosis stands when the same recordings come from loggers with several clocks.

    python proofs/clocks.py [--out TABLE.md] [CLOCKS ..]

The campaign ``tests/campaigns/null`` conceals nothing. It is diagnosed as the CSV files it is, and then as
MDF4 in each of the ways of ``tests/clocked.py``. A row each: the clocks, the skew that was put in, the
verdict, the causes with the intervals of their parameters and what they are not separable from, and the
processor time as a multiple of the CSV's. A row holds if the verdict is no mismatch, or the one cause is
the skew that was put in and its interval holds that. Ends with status 0 if all rows hold; the times are
told and judge nothing.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from time import process_time

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

import clocked  # noqa: E402
from forklift import Campaign, Truck, diagnose  # noqa: E402

CSV = "the CSV files themselves"
SKEWS = {
    "7 ms of phase": (("clock_shift",), clocked.PHASE_S),
    "3 ms late": (("pressure_free_pa.clock_shift", "pressure_free_pa.sensor_lag"), clocked.LATE_S),
    "0.3 % fast": (("clock_drift",), clocked.FAST - 1.0),
}
"""What a way of logging puts in: the hypotheses that are right, and their number [s], of a drift [1]. Of one
channel a lag of the sensor and a clock that started apart are the same equation."""
HEAD = (
    "| clocks | put in | verdict | cause, 95 % interval | not separable from | processor time | holds |",
    "|---|---|---|---|---|---:|---|",
)


def row(how: str, campaign: Campaign, csv_s: float | None) -> tuple[str, float, bool]:
    """The row of one way of logging, its processor time [s], and whether it holds."""
    start = process_time()
    found = diagnose(campaign, Truck.read("thesis")).to_dict()
    seconds = process_time() - start
    skew, causes = SKEWS.get(how), found["causes"]
    holds = found["verdict"] == "no-mismatch"
    if skew and len(causes) == 1 and causes[0]["label"] in skew[0]:
        holds = all(one["lower"] <= skew[1] <= one["upper"] for one in causes[0]["parameters"])
    told = "; ".join(
        f"`{cause['label']}` "
        + ", ".join(f"{p['value']:.4g} [{p['lower']:.4g}, {p['upper']:.4g}]" for p in cause["parameters"])
        for cause in causes
    )
    beside = ", ".join(f"`{one}`" for cause in causes for one in cause["not_separable_from"])
    cells = [
        how,
        f"`{skew[0][0]}` {skew[1]:.4g}" if skew else "–",
        found["verdict"],
        told or "–",
        beside or "–",
        f"{seconds:.0f} s" if csv_s is None else f"{seconds / csv_s:.2f} × CSV",
        "yes" if holds else "**no**",
    ]
    return "| " + " | ".join(cells) + " |", seconds, holds


def main() -> int:
    """Diagnose the campaign in every way asked for, or in all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clocks", nargs="*", help="names of tests/clocked.py; all without")
    parser.add_argument("--out", type=Path, help="where the table goes")
    given = parser.parse_args()
    null = Campaign.read(HERE.parent / "tests" / "campaigns" / "null")
    first, csv_s, every = row(CSV, null, None)
    lines = [*HEAD, first]
    print("\n".join(lines), flush=True)
    for how in given.clocks or list(clocked.CLOCKS):
        with tempfile.TemporaryDirectory() as folder:
            campaign = Campaign.read(clocked.write(null, Path(folder) / "campaign", clocked.CLOCKS[how]))
            line, _, holds = row(how, campaign, csv_s)
        lines.append(line)
        every = every and holds
        print(line, flush=True)
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0 if every else 1


if __name__ == "__main__":
    raise SystemExit(main())

"""Whether a diagnosis stands when the same recordings come from loggers with several clocks.

    python proofs/clocks.py [--out TABLE.md] [CLOCKS ..]

The campaign ``tests/campaigns/null`` conceals nothing. It is diagnosed as the CSV files it is, and then as
MDF4 in each of the ways of ``tests/clocked.py``. A row each: the clocks, the skew that was put in, the
verdict, the causes with the intervals of their parameters and what they are not separable from, and the
processor time: in seconds, and as a multiple of what the same recordings take as CSV files.

To name a skew costs what it costs to name any fault, whatever the files. So each campaign is written as CSV
too, with a column of times for each clock of its own, and diagnosed once more. The last row holds the skew of
the row above it without such columns: what every sensor read one sample late, as CSV files on one clock.

A row holds if the verdict is no mismatch, or the one cause is the skew that was put in and its interval
holds that; and if it takes at most a fifth more than the CSV. Ends with status 0 if all rows hold.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

import clocked  # noqa: E402
from forklift import Campaign, Truck, diagnose  # noqa: E402

CSV = "the CSV files themselves"
SAMPLE_S = 0.02
"""Period of the campaign's samples."""
ONE_LATE, ONE_LATE_CSV = "one sample late", "one sample late, as CSV files"
SKEWS = {
    ONE_LATE: (("free.valve_delay", "clock_shift", "sensor_lag"), SAMPLE_S),
    ONE_LATE_CSV: (("free.valve_delay", "clock_shift", "sensor_lag"), SAMPLE_S),
    "7 ms of phase": (("clock_shift",), clocked.PHASE_S),
    "3 ms late": (("pressure_free_pa.clock_shift", "pressure_free_pa.sensor_lag"), clocked.LATE_S),
    "0.3 % fast": (("clock_drift",), clocked.FAST - 1.0),
}
"""What a way of logging puts in: the hypotheses that are right, and their number [s], of a drift [1]. Of one
channel a lag of the sensor and a clock that started apart are the same equation."""
HEAD = (
    "| clocks | put in | verdict | cause, 95 % interval | not separable from | time | of the CSV's | holds |",
    "|---|---|---|---|---|---:|---:|---|",
)
SLOWER = 1.2
"""How many times the CSV's time a diagnosis may take."""


def timed(campaign: Path) -> tuple[dict[str, Any], float]:
    """A diagnosis and its processor time with the reading of the files [s]."""
    start = process_time()
    found = diagnose(Campaign.read(campaign), Truck.read("thesis")).to_dict()
    return found, process_time() - start


def row(how: str, campaign: Path, csv_s: float | None) -> tuple[str, bool]:
    """The row of one way of logging, and whether it holds."""
    found, seconds = timed(campaign)
    skew, causes = SKEWS.get(how), found["causes"]
    holds = found["verdict"] == "no-mismatch"
    if skew and len(causes) == 1 and causes[0]["label"] in skew[0]:
        holds = all(one["lower"] <= skew[1] <= one["upper"] for one in causes[0]["parameters"])
    holds = holds and (csv_s is None or seconds <= SLOWER * csv_s)
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
        f"{seconds:.0f} s",
        "–" if csv_s is None else f"{seconds / csv_s:.2f}",
        "yes" if holds else "**no**",
    ]
    return "| " + " | ".join(cells) + " |", holds


def one_sample_late(campaign: Campaign) -> Campaign:
    """The campaign with what every sensor read one row later, on the clock of the commands."""
    late = []
    for recording in campaign:
        channels = {
            name: values if name.startswith("current") else np.concatenate([values[:1], values[:-1]])
            for name, values in recording.channels.items()
        }
        late.append(replace(recording, channels=channels))
    return Campaign("late", campaign.sample_rate_hz, late)


def main() -> int:
    """Diagnose the campaign in every way asked for, or in all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clocks", nargs="*", help="names of tests/clocked.py; all without")
    parser.add_argument("--out", type=Path, help="where the table goes")
    given = parser.parse_args()
    there = HERE.parent / "tests" / "campaigns" / "null"
    null = Campaign.read(there)
    first, every = row(CSV, there, None)
    lines = [*HEAD, first]
    print("\n".join(lines), flush=True)
    ways = {**clocked.CLOCKS, ONE_LATE: clocked.moved(lambda time: time + SAMPLE_S)}
    with tempfile.TemporaryDirectory() as scratch:
        for place, how in enumerate(given.clocks or [*ways, ONE_LATE_CSV]):
            folder = Path(scratch) / str(place)
            folder.mkdir()
            if how == ONE_LATE_CSV:
                line, holds = row(how, one_sample_late(null).write(folder / "csv"), None)
            else:
                logged = clocked.write(null, folder / "mdf4", ways[how])
                _, csv_s = timed(Campaign.read(logged).write(folder / "csv"))
                line, holds = row(how, logged, csv_s)
            lines.append(line)
            every = every and holds
            print(line, flush=True)
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0 if every else 1


if __name__ == "__main__":
    raise SystemExit(main())

"""Whether a diagnosis stands when the same recordings come from loggers with several clocks.

    python proofs/clocks.py [CLOCKS ..]

The campaign ``tests/campaigns/null`` conceals nothing. It is written as MDF4 in each of the ways of
``tests/clocked.py`` and diagnosed. A line each: the clocks, the verdict, the causes with the intervals of
their parameters, and the seconds it took. Of a skew that was put in, the verdict is no mismatch, or the cause
is that skew and its interval holds it.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from time import perf_counter

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

import clocked  # noqa: E402
from forklift import Campaign, Truck, diagnose  # noqa: E402


def main(asked: list[str]) -> None:
    """Diagnose the campaign in every way asked for, or in all."""
    null = Campaign.read(HERE.parent / "tests" / "campaigns" / "null")
    for how in asked or list(clocked.CLOCKS):
        with tempfile.TemporaryDirectory() as folder:
            campaign = Campaign.read(clocked.write(null, Path(folder) / "campaign", clocked.CLOCKS[how]))
            start = perf_counter()
            found = diagnose(campaign, Truck.read("thesis")).to_dict()
            seconds = perf_counter() - start
        causes = [
            f"{cause['id']} "
            + ", ".join(
                f"{p['name']} {p['value']:.4g} [{p['lower']:.4g}, {p['upper']:.4g}]"
                for p in cause["parameters"]
            )
            for cause in found["causes"]
        ]
        print(f"{how}: {found['verdict']}; {'; '.join(causes) or 'no cause'}; {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

"""What the engine says of two rigs that others recorded: `python proofs/rigs.py FOLDER [tanks] [seals]`.

FOLDER holds ``cascaded_tanks/`` and ``pneumatic_seal/`` as `forklift.rigs` describes them. Some minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import forklift
from forklift.rigs import cascaded_tanks, pneumatic_seal


def tanks(folder: Path) -> None:
    """Fitted on the estimation record alone; free run over the validation record."""
    recordings = cascaded_tanks.read(folder / "cascaded_tanks")
    print(forklift.diagnose_plant(cascaded_tanks.plant(), recordings))


def seals(folder: Path) -> None:
    """Judged on the last 40 % of each file, and with each pressure left out in turn."""
    for seal in pneumatic_seal.SEALS:
        recordings = pneumatic_seal.read(folder / "pneumatic_seal", seal)
        sigma = float(np.median(list(pneumatic_seal.repeatability(recordings).values())))
        plant = pneumatic_seal.plant(sigma)
        found = forklift.diagnose_plant(plant, recordings, candidates=pneumatic_seal.candidates())
        gone, left_out = (
            pneumatic_seal.gone(found, recordings),
            pneumatic_seal.gone_left_out(found, recordings, sigma),
        )
        print(f"{seal}: {found}")
        print(
            f"{seal}: of the variance above the repeatability {100 * gone:.0f} % is gone on the last 40 %, "
            f"{100 * left_out:.0f} % at pressures left out\n"
        )


if __name__ == "__main__":
    where, which = Path(sys.argv[1]), sys.argv[2:] or ["tanks", "seals"]
    for name in which:
        {"tanks": tanks, "seals": seals}[name](where)

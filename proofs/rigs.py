"""What does the engine say of two rigs that others recorded?

    python proofs/rigs.py FOLDER [tanks|seals]

FOLDER holds ``cascaded_tanks/`` and ``pneumatic_seal/``, see `forklift.plant.rigs`. Some minutes.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path

import numpy as np

import forklift
from forklift.diagnosis.numbers import Number, numbers
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.result import Diagnosis
from forklift.fitting.posing import pose
from forklift.plant.rigs import cascaded_tanks, pneumatic_seal


def tanks(folder: Path) -> None:
    """Fitted on the estimation record alone; free run over the validation record. Then the same model fitted
    to the other record alone: its parameters ought to lie within the intervals told before."""
    recordings = cascaded_tanks.read(folder / "cascaded_tanks")
    found = forklift.diagnose(cascaded_tanks.plant(), recordings)
    print(found)
    first = {one.name: one for one in found.numbers}
    again = refitted(found)
    inside = sum(first[one.name].lower <= one.value <= first[one.name].upper for one in again)
    print(
        f"Fitted to the validation record alone, {inside} of {len(again)} parameters lie within the 95 % "
        "intervals of the estimation record."
    )


def refitted(found: Diagnosis) -> list[Number]:
    """The parameters of the model that was found, fitted to the recordings held out alone."""
    everyone = pose(found.machine, found.recordings, found.machine.unknowns(), found.sensors)
    held = everyone.over([one for one in everyone.samples if one.recording.role == "validate"])
    refitter = Refitter(held, everyone, found.sensors, strict=True)
    refit = refitter.finish(refitter.rough(found.final.hypotheses))
    return [one for one in numbers(refit) if not one.name.endswith(".start")]


def seals(folder: Path) -> None:
    """Judged on the last 40 % of each file, and with each pressure left out in turn."""
    for seal in pneumatic_seal.SEALS:
        recordings = pneumatic_seal.read(folder / "pneumatic_seal", seal)
        sigma = float(np.median(list(pneumatic_seal.repeatability(recordings).values())))
        plant = pneumatic_seal.plant(sigma)
        found = forklift.diagnose(plant, recordings, candidates=pneumatic_seal.candidates())
        gone, left_out = (
            pneumatic_seal.gone(found, recordings),
            pneumatic_seal.gone_left_out(found, recordings, sigma),
        )
        print(f"{seal}: {found}")
        print(
            f"{seal}: of the variance above the repeatability {100 * gone:.0f} % is gone on the last 40 %, "
            f"{100 * left_out:.0f} % at pressures left out\n"
        )


def main() -> int:
    parser = ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="holds cascaded_tanks/ and pneumatic_seal/")
    parser.add_argument("rig", nargs="?", choices=RIGS, help="default: both")
    given = parser.parse_args()
    try:
        for name in [given.rig] if given.rig else RIGS:
            RIGS[name](given.folder)
    except forklift.ForkliftError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


RIGS = {"tanks": tanks, "seals": seals}

if __name__ == "__main__":
    sys.exit(main())

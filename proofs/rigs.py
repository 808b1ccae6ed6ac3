"""What does the engine say of two rigs that others recorded?

    python proofs/rigs.py FOLDER [tanks|seals]

FOLDER holds ``cascaded_tanks/`` and ``pneumatic_seal/`` as `forklift.rigs` describes them. Some minutes.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import forklift
from forklift.diagnosis.suspect import Suspect
from forklift.diagnosis.trial import Bench
from forklift.plant import Plant, Recording
from forklift.plant.diagnose import Number, numbers
from forklift.plant.problem import completed, pose, sensors
from forklift.rigs import cascaded_tanks, pneumatic_seal


def tanks(folder: Path) -> None:
    """Fitted on the estimation record alone; free run over the validation record. Then the same model fitted
    to the other record alone: its parameters ought to lie within the intervals told before."""
    recordings = cascaded_tanks.read(folder / "cascaded_tanks")
    found = forklift.diagnose_plant(cascaded_tanks.plant(), recordings)
    print(found)
    kept = found.final.suspects
    first, again = (refitted(found.plant, recordings, role, kept) for role in ("estimate", "validate"))
    inside = sum(one.lower <= other.value <= one.upper for one, other in zip(first, again, strict=True))
    print(
        f"Fitted to the validation record alone, {inside} of {len(first)} parameters lie within the 95 % "
        "intervals of the estimation record."
    )


def refitted(
    plant: Plant, recordings: Sequence[Recording], role: str, kept: tuple[Suspect, ...]
) -> list[Number]:
    """The parameters of a plant with these suspects, fitted to the recordings of one role alone."""
    known = sensors(plant, recordings)
    everyone = pose(plant, [completed(plant, one) for one in recordings], known)
    own = everyone.over([one for one in everyone.samples if one.recording.role == role])
    bench = Bench(own, everyone, known, strict=True)
    trial = bench.finish(bench.rough(kept))
    return [one for one in numbers(trial) if not one.name.endswith(".start")]


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

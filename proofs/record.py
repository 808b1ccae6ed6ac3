"""Results of `forklift prove` in one file, to be kept, scored anywhere, and gone on with.

    python proofs/record.py keep proof proofs/records/SEED.json.xz
    python proofs/record.py score proofs/records/SEED.json.xz
    python proofs/record.py unpack proofs/records/SEED.json.xz proof

What `keep` writes holds every result of a folder. `unpack` makes a folder of it that `forklift prove` goes on
with. Only the sealed boxes are not in it: each result has what was committed to.
"""

from __future__ import annotations

import argparse
import json
import lzma
import tempfile
from pathlib import Path

from forklift.ensemble.proof.prove import MARK, scored
from forklift.report.of_proof import proof_text


def keep(folder: Path, file: Path) -> int:
    """Write the results in a folder of `forklift prove` to a file; how many there are."""
    paths = sorted((folder / "results").glob("*.json"))
    whole = {
        "seed": json.loads((folder / MARK).read_text(encoding="utf-8"))["seed"],
        "results": [json.loads(path.read_text(encoding="utf-8")) for path in paths],
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(lzma.compress(json.dumps(whole, ensure_ascii=False).encode(), preset=9))
    return len(paths)


def unpack(file: Path, folder: Path) -> int:
    """Make a folder of a file; its seed. Results that are there already stay."""
    whole = json.loads(lzma.decompress(file.read_bytes()))
    (folder / "results").mkdir(parents=True, exist_ok=True)
    (folder / MARK).write_text(json.dumps({"seed": whole["seed"]}) + "\n", encoding="utf-8")
    for one in whole["results"]:
        path = folder / "results" / f"{one['number']:05d}.json"
        if not path.exists():
            path.write_text(json.dumps(one, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return int(whole["seed"])


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=("keep", "score", "unpack"))
    parser.add_argument("places", nargs="+", type=Path, metavar="PLACE")
    given = parser.parse_args()
    if given.what == "keep":
        folder, file = given.places
        print(f"{keep(folder, file)} results in {file}")
    elif given.what == "unpack":
        file, folder = given.places
        unpack(file, folder)
    else:
        for file in given.places:
            with tempfile.TemporaryDirectory() as scratch:
                print(proof_text(scored(Path(scratch), unpack(file, Path(scratch)))))


if __name__ == "__main__":
    main()

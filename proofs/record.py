"""Results of `forklift prove` in one file, to be kept, scored anywhere, and gone on with.

    python proofs/record.py keep proof proofs/records/SEED.json.xz
    python proofs/record.py score proofs/records/SEED.json.xz
    python proofs/record.py unpack proofs/records/SEED.json.xz proof
    python proofs/record.py together proofs/records/*.json.xz [--out together.json]

What `keep` writes holds every result of a folder. `unpack` makes a folder of it that `forklift prove` goes on
with. Only the sealed boxes are not in it: each result has what was committed to. `together` prints the
table of README and docs/proof.md, seeds side by side and as one; ``--out`` keeps the score of all as one, for
`proofs/picture.py`.
"""

from __future__ import annotations

import argparse
import json
import lzma
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from forklift.ensemble.proof.kinds import KINDS
from forklift.ensemble.proof.prove import MARK, Proof, judged_now, scored
from forklift.ensemble.proof.score import GOALS, score
from forklift.report.of_proof import proof_text

CERTAIN = 0.9
"""Credibility from which on 85 % of names are asked to be right."""
NEAR = 0.25
"""Share of an interval's width by which it misses little."""


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
    seed, results = read(file)
    (folder / "results").mkdir(parents=True, exist_ok=True)
    (folder / MARK).write_text(json.dumps({"seed": seed}) + "\n", encoding="utf-8")
    for one in results:
        path = folder / "results" / f"{one['number']:05d}.json"
        if not path.exists():
            path.write_text(json.dumps(one, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return seed


def together(runs: Mapping[int, Sequence[Mapping[str, Any]]]) -> tuple[dict[str, Any], str]:
    """The score of several seeds' results as one, and a table of each seed and of all."""
    every = [one for results in runs.values() for one in results]
    whole = score(every)
    head = {
        "seed": None,
        "label": f"reporting, seeds {', '.join(map(str, runs))}",
        "seeds": list(runs),
        "campaigns": len(every),
        "packages": sorted({one["package"] for one in every}),
    }
    scores = [*(score(results) for results in runs.values()), whole]
    rows = [
        ["", *(str(seed) for seed in runs), "together", "exact 95 % interval", "goal"],
        ["---", *(["---:"] * (len(runs) + 3))],
        ["campaigns", *(str(len(results)) for results in runs.values()), str(head["campaigns"]), "", ""],
    ]
    for name, (least, most) in GOALS.items():
        either = f"≥ {least:g} %" if least else f"≤ {most:g} %"
        goal = f"{least:g}–{most:g} %" if least and most < 100.0 else either
        rates = [one["rates"][name] for one in scores]
        rows.append([name, *(f"{rate['right']} of {rate['of']}" for rate in rates), _ends(rates[-1]), goal])
    certain = [next(row for row in one["reliability"] if row["from"] == CERTAIN) for one in scores]
    own = [f"{row['right']} of {row['of']}" for row in certain]
    rows.append(
        [
            f"names told with a credibility of {CERTAIN} or more that are right",
            *own,
            _ends(certain[-1]),
            "≥ 85 %",
        ]
    )
    place = [f"{row['right'] + row['by_another_law']} of {row['of']}" for row in certain]
    rows.append(["the same, or a stranger's place by another law", *place, "", ""])
    for form in ("complete", "uncertain"):
        told = [next(row for row in one["forms"] if row["form"] == form) for one in scores]
        own = [f"{row['right']} of {row['of']}" for row in told]
        rows.append([f"names told with their form {form} that are right", *own, _ends(told[-1]), ""])
    counted = [counts(results) for results in (*runs.values(), every)]
    rows += [[name, *(one[name] for one in counted), "", ""] for name in counted[-1]]
    return head | whole, "\n".join(f"| {' | '.join(row)} |" for row in rows)


def counts(results: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """How many of what in a run: right in everything by kind, hidden, and how far intervals miss."""
    found = {}
    for kind in KINDS:
        right = [one["judged"]["all"] for one in results if one["answer"]["kind"] == kind]
        found[f"right in everything, {kind}"] = f"{sum(right)} of {len(right)}"
    named = [bool(one["judged"]["spurious"]) for one in results if one["judged"]["hidden"]]
    found["of what is hidden, told a wrong name"] = f"{sum(named)} of {len(named)}"
    beyond = [
        max(lower - true, true - upper) / (upper - lower)
        for one in results
        for _, true, lower, upper in one["intervals"]
    ]
    missed = [share for share in beyond if share > 0.0]
    near = sum(share < NEAR for share in missed)
    found["intervals that miss, by less than a quarter of their width"] = f"{near} of {len(missed)}"
    return found


def _ends(rate: Mapping[str, Any]) -> str:
    return f"{100 * rate['lower']:.1f}–{100 * rate['upper']:.1f} %"


def read(file: Path) -> tuple[int, list[dict[str, Any]]]:
    """The seed of a file of `keep`, and its results."""
    whole = json.loads(lzma.decompress(file.read_bytes()))
    return int(whole["seed"]), list(whole["results"])


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=("keep", "score", "unpack", "together"))
    parser.add_argument("places", nargs="+", type=Path, metavar="PLACE")
    parser.add_argument("--out", type=Path, help="where the score of all goes")
    given = parser.parse_args()
    if given.what == "keep":
        folder, file = given.places
        print(f"{keep(folder, file)} results in {file}")
    elif given.what == "unpack":
        file, folder = given.places
        unpack(file, folder)
    elif given.what == "together":
        runs = {seed: list(map(judged_now, results)) for seed, results in map(read, given.places)}
        found, table = together(runs)
        every = [one for results in runs.values() for one in results]
        print(table, proof_text(Proof(found, every)), sep="\n\n")
        if given.out:
            given.out.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    else:
        for file in given.places:
            with tempfile.TemporaryDirectory() as scratch:
                print(proof_text(scored(Path(scratch), unpack(file, Path(scratch)))))


if __name__ == "__main__":
    main()

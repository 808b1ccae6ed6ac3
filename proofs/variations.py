"""Does a diagnosis name what is missing? Told by trucks of a second plant, each with something concealed.

    python proofs/variations.py [SET ...] [--only PATTERN] [--without STEP] [--out variations] [--jobs 1]

SETs: effects, others, traps, null (these four by default); pairs, complete, warming. README.md beside this
file says what is simulated, and how it is judged. Each case is one file in the folder, written whole: a run
that is broken off loses nothing, and a second one goes on where it stood.
"""

import argparse
import fnmatch
import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from cases import amplitude_for, law_of, variations
from judging import table
from reference.plant import campaign

ROOT = Path(__file__).resolve().parents[1]
SEPARABLE = Path(__file__).with_name("separable.json")
WITHOUT = Path(__file__).with_name("without.py")
LIMIT_S = 3600.0
DEFAULT = ("effects", "others", "traps", "null")


def one(variation, step=None):
    """The case: made, recorded, diagnosed (without a step of it, if asked), judged; for JSON."""
    began = time.monotonic()
    case, laws, concealed = variation.case, [], []
    for name, points in variation.concealed:
        amplitude, costs = amplitude_for(points, name, case)
        law = law_of(name, case.lift, case.seed, amplitude)
        laws.append(law)
        values = {key: np.max(np.atleast_1d(value)).item() for key, value in law.values.items()}
        concealed.append({"law": name, "points": float(costs), "asked": points, "values": values})
    with tempfile.TemporaryDirectory() as scratch:
        folder, out = Path(scratch) / "campaign", Path(scratch) / "out"
        campaign.record(replace(case, laws=tuple(laws)), folder)
        made_s = time.monotonic() - began
        diagnose = [str(WITHOUT), step] if step else ["-m", "forklift", "diagnose"]
        command = [sys.executable, *diagnose, str(folder), "--out", str(out)]
        began = time.monotonic()
        try:
            ran = subprocess.run(
                command, capture_output=True, text=True, timeout=LIMIT_S, cwd=scratch, check=False
            )
            status, said = ran.returncode, (ran.stdout + ran.stderr)[-3000:]
        except subprocess.TimeoutExpired:
            status, said = None, f"not finished within {LIMIT_S:g} s"
        seconds = time.monotonic() - began
        path = out / "diagnosis.json"
        found = json.loads(path.read_text(encoding="utf-8")) if path.exists() else None
    answer = answered(found, status, said)
    return {
        "case": variation.name,
        "lift": case.lift,
        "seed": case.seed,
        "truth": asdict(variation.truth),
        "concealed": concealed,
        "answer": answer,
        "made_s": made_s,
        "seconds": seconds,
    }


def answered(found, status, said):
    """The answer in short."""
    if found is None:
        return {"verdict": "refused" if status else "none", "said": said, "causes": []}
    return {
        "verdict": found["verdict"],
        "sentence": found["sentence"],
        "location": found["location"],
        "causes": [
            {
                key: cause[key]
                for key in (
                    "id",
                    "kind",
                    "where",
                    "equation",
                    "credibility",
                    "form",
                    "parameters",
                    "not_separable_from",
                    "rivals",
                )
            }
            for cause in found["causes"]
        ],
        "left_over": found["left_over"],
        "gain": found["fit_summary"].get("validate", {}),
        "unknown_inputs": found["unknown_inputs"][:6],
        "untestable": found["untestable"],
    }


def write(path, text):
    """The whole file or none."""
    temporary = path.with_suffix(f".{os.getpid()}.part")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sets", nargs="*", default=DEFAULT, metavar="SET")
    parser.add_argument("--only", metavar="PATTERN", help="cases whose name matches, as of files")
    parser.add_argument("--without", metavar="STEP", help="leave out location, rivals or held-out")
    parser.add_argument("--out", type=Path, default=ROOT / "variations")
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    wanted = [v for v in variations(given.sets) if not given.only or fnmatch.fnmatch(v.name, given.only)]
    paths = {variation.name: given.out / f"{variation.name}.json" for variation in wanted}
    left = [variation for variation in wanted if not paths[variation.name].exists()]
    print(f"{len(wanted) - len(left)} of {len(wanted)} cases are there.", flush=True)
    threads = str(max(1, (os.cpu_count() or 1) // given.jobs))
    os.environ |= {"RAYON_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": "1"}

    def run_one(variation):
        result = one(variation, given.without)
        write(paths[variation.name], json.dumps(result, indent=1, ensure_ascii=False) + "\n")
        return result

    separable = json.loads(SEPARABLE.read_text(encoding="utf-8")) if SEPARABLE.exists() else {}
    with ThreadPoolExecutor(given.jobs) as pool:
        running = [pool.submit(run_one, variation) for variation in left]
        try:
            for done in as_completed(running):
                print(table([done.result()], separable).splitlines()[2], flush=True)
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            print("Interrupted; the same command goes on from here.", file=sys.stderr)
            return 130
    text = table([json.loads(path.read_text(encoding="utf-8")) for path in paths.values()], separable)
    write(given.out / "variations.md", text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())

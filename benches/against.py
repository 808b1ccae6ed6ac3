"""How fast `fit` and `diagnose` are beside those of another commit, in pairs.

    python benches/against.py c620b28 [--repeats 2] [--verbs fit,diagnose]

The other commit is checked out into a folder of its own and its core built there (some minutes). Then both do
the same with each of the four campaigns of the tests, in turn, each first every other time. A ratio is of the
fastest of each; nothing else should run meanwhile.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CAMPAIGNS = ("null", "leak", "coupling", "thermfric")


def built(commit: str, folder: Path) -> Path:
    """Where the other commit's package is, with its core beside it."""
    tree = folder / "tree"
    subprocess.run(["git", "-C", ROOT, "worktree", "add", "--detach", tree, commit], check=True)
    subprocess.run(
        ["cargo", "build", "--release", "--package", "hydro_py", "--target-dir", folder / "target"],
        cwd=tree,
        check=True,
    )
    (library,) = (folder / "target" / "release").glob("lib*core.so")
    shutil.copy(library, tree / "python" / "forklift" / "_core.abi3.so")
    return tree / "python"


def seconds(package: Path | None, verb: str, campaign: str, folder: Path) -> float:
    """Of one command; `package`: where it comes from, if it is not the one installed."""
    out = folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    given = ROOT / "tests" / "campaigns" / campaign
    command = [sys.executable, "-m", "forklift", verb, str(given), "--truck", "thesis", "--out", str(out)]
    paths = {"PYTHONPATH": str(package)} if package else {}
    begun = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, cwd=folder, env=os.environ | paths)
    return time.perf_counter() - begun


def main() -> int:
    """A row for each verb and campaign."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commit")
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--verbs", default="fit,diagnose")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        try:
            other = built(given.commit, folder)
            print(f"| verb | campaign | {given.commit} | here | here / {given.commit} |")
            print("|---|---|---:|---:|---:|", flush=True)
            for verb in given.verbs.split(","):
                for campaign in CAMPAIGNS:
                    told: dict[Path | None, list[float]] = {other: [], None: []}
                    for k in range(given.repeats):
                        for package in [other, None][:: 1 if k % 2 == 0 else -1]:
                            told[package].append(seconds(package, verb, campaign, folder))
                    then, now = min(told[other]), min(told[None])
                    row = f"| `{verb}` | {campaign} | {then:.1f} s | {now:.1f} s | {now / then:.2f} |"
                    print(row, flush=True)
        finally:
            subprocess.run(["git", "-C", ROOT, "worktree", "remove", "--force", folder / "tree"], check=False)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

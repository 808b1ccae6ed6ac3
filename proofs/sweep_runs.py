"""What a sweep bears: kill -9, a dead worker, a million members.

python3 proofs/sweep_runs.py killed    killed at ten random moments: the same bytes
python3 proofs/sweep_runs.py cluster   two Dask workers, one killed: the same bytes
python3 proofs/sweep_runs.py scale     time and memory from 10^3 members on, and one thread against two
"""

import argparse
import hashlib
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

CLOSED_LOOP = Path(__file__).parents[1] / "benches" / "closed_loop.toml"
SETTINGS = tomllib.loads(CLOSED_LOOP.read_text(encoding="utf-8")) | {"seed": 3, "worst": 5}
"""What `benches/sweeps.py` times."""


def settings(members: int, chunk: int) -> dict:
    return SETTINGS | {"members": members, "chunk": chunk}


def digest(folder: Path) -> str:
    """Of every member's file, names included."""
    found = hashlib.sha256()
    for file in sorted((folder / "members").glob("*.parquet")):
        found.update(file.name.encode() + file.read_bytes())
    return found.hexdigest()


def started(document: dict, out: Path, *more: str) -> subprocess.Popen:
    """A sweep in a process of its own."""
    script = (
        "import json, sys; from forklift.ensemble.sweep import sweep; "
        "given = json.loads(sys.argv[1]); sweep(given, out=sys.argv[2], **json.loads(sys.argv[3]))"
    )
    given = more[0] if more else "{}"
    return subprocess.Popen(
        [sys.executable, "-c", script, json.dumps(document), str(out), given], env=os.environ
    )


def killed(times: int = 10, members: int = 12_000, chunk: int = 100, seed: int = 5) -> bool:
    """Kill -9 at random moments, again and again, until it ends by itself."""
    document, draws = settings(members, chunk), random.Random(seed)
    with tempfile.TemporaryDirectory() as home:
        whole, folder = Path(home) / "whole", Path(home) / "killed"
        started(document, whole).wait()
        total, kills, done = -(-members // chunk), 0, 0
        for _ in range(times):
            process = started(document, folder)
            # After a few chunks more, and then at any moment of the next.
            least = done + draws.randint(0, total // times)
            while process.poll() is None and done < least:
                done = len(list((folder / "members").glob("*.parquet")))
                time.sleep(0.002)
            time.sleep(draws.uniform(0.0, 0.05) if done else draws.uniform(0.5, 2.0))
            if process.poll() is None:
                process.send_signal(signal.SIGKILL)
                kills += 1
            process.wait()
            done = len(list((folder / "members").glob("*.parquet"))) if folder.exists() else 0
            print(f"killed {kills} times, {done} of {total} chunks", flush=True)
        started(document, folder).wait()
        same = digest(folder) == digest(whole)
    print(f"{'holds' if same else 'FAILS'}  killed at {kills} random moments and resumed: the same bytes")
    return same and kills == times


def cluster(members: int = 12_000, chunk: int = 200) -> bool:
    """Two local Dask workers, each a process, one of which is killed on the way."""
    from distributed import LocalCluster

    document = settings(members, chunk)
    with tempfile.TemporaryDirectory() as home:
        here, there = Path(home) / "here", Path(home) / "there"
        started(document, here).wait()
        with LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as workers:
            process = started(document, there, json.dumps({"scheduler": workers.scheduler_address}))
            while process.poll() is None:
                done = len(list((there / "members").glob("*.parquet"))) if there.exists() else 0
                if done >= 3:
                    victim = next(iter(workers.workers.values()))
                    os.kill(victim.process.process.pid, signal.SIGKILL)
                    print(f"killed a worker after {done} of {-(-members // chunk)} chunks", flush=True)
                    break
                time.sleep(0.02)
            process.wait()
        same = process.returncode == 0 and digest(here) == digest(there)
    print(f"{'holds' if same else 'FAILS'}  two Dask workers, one killed: the bytes of the local run")
    return same


MEASURED = """
import json, resource, sys, time
from forklift.ensemble.sweep import sweep
given, threads = json.loads(sys.argv[1]), int(sys.argv[3])
sweep(given | {"members": 512, "chunk": 512}, threads=threads)
clock = time.perf_counter()
found = sweep(given, out=sys.argv[2], threads=threads)
spent = time.perf_counter() - clock
print(json.dumps({"s": spent, "mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}))
"""


def line(points: list[tuple[int, float]]) -> tuple[float, float, float]:
    """Start [s] and time a member [s] that fit all sizes alike (least squares of relative errors), and the
    largest relative error."""
    members, seconds = np.array(points, float).T
    shares = np.stack([1.0 / seconds, members / seconds], axis=1)
    (start, slope), *_ = np.linalg.lstsq(shares, np.ones(len(points)), rcond=None)
    return start, slope, float(np.max(np.abs(shares @ [start, slope] - 1.0)))


def measured(members: int, chunk: int, threads: int) -> tuple[float, float, str]:
    """Time [s], memory [MiB] and digest of a sweep in a process of its own."""
    with tempfile.TemporaryDirectory() as home:
        out = Path(home) / "out"
        given = [json.dumps(settings(members, chunk)), str(out), str(threads)]
        run = subprocess.run(
            [sys.executable, "-c", MEASURED, *given], capture_output=True, text=True, check=True
        )
        told = json.loads(run.stdout)
        print(
            f"{members:>9d} members, {threads} threads: {told['s']:>8.1f} s, "
            f"{1e6 * told['s'] / members:>7.1f} us a member, {members / told['s']:>8.0f} a second, "
            f"{told['mib']:>6.0f} MiB",
            flush=True,
        )
        return told["s"], told["mib"], digest(out)


def scale(largest: int = 100_000, chunk: int = 4096, pairs: int = 5, rounds: int = 3) -> bool:
    """Time and memory over the number of members, all sizes in turn, the fastest of each: a machine whose
    clock changes between two sizes tells nothing of either; one thread against two, in pairs; the same
    bytes."""
    sizes = [n for n in (1_000, 10_000, 100_000, 1_000_000) if n <= largest]
    found = [{n: measured(n, chunk, 2) for n in sizes} for _ in range(rounds)]
    answers = []
    if len(sizes) > 2:
        start, slope, furthest = line([(n, min(run[n][0] for run in found)) for n in sizes])
        answers.append(furthest <= 0.1)
        print(
            f"{'holds' if answers[-1] else 'FAILS'}  linear: {1e3 * start:.1f} ms and "
            f"{1e6 * slope:.2f} us a member, the fastest of {rounds} of every size within "
            f"{100 * furthest:.1f} % of that line"
        )
    gains, digests = [], {run[sizes[-1]][2] for run in found}
    for _ in range(pairs):
        one, two = (measured(sizes[-1], chunk, threads) for threads in (1, 2))
        gains.append(one[0] / two[0])
        digests |= {one[2], two[2]}
    gain = statistics.median(gains)
    answers.append(gain >= 1.9)
    print(
        f"{'holds' if answers[-1] else 'FAILS'}  two threads: {gain:.3f} times one at {sizes[-1]} members, "
        f"the median of {pairs} pairs ({min(gains):.3f} to {max(gains):.3f})"
    )
    answers.append(len(digests) == 1)
    print(f"{'holds' if answers[-1] else 'FAILS'}  one thread and two, again and again: the same bytes")
    return all(answers)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["killed", "cluster", "scale"])
    parser.add_argument("--members", type=int, help="how many members, of scale the largest number")
    arguments = parser.parse_args()
    given = [] if arguments.members is None else [arguments.members]
    if arguments.what == "killed":
        return 0 if killed(10, *given) else 1
    return 0 if {"cluster": cluster, "scale": scale}[arguments.what](*given) else 1


if __name__ == "__main__":
    raise SystemExit(main())

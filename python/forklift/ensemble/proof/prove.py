"""The proof: campaigns drawn, concealed, sealed, diagnosed by the command line, opened and scored."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base import output
from forklift.base.alone import alone_in
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.ensemble.proof import baselines, kinds
from forklift.ensemble.proof.apart import conceal_apart
from forklift.ensemble.proof.bounds import VARIABLE
from forklift.ensemble.proof.draw import Draw, draw, kind_of
from forklift.ensemble.proof.judge import intervals, judged, removed
from forklift.ensemble.proof.processes import Processes
from forklift.ensemble.proof.random import DEVELOPMENT
from forklift.ensemble.proof.score import score
from forklift.ensemble.proof.seal import Seal, Sealed
from forklift.ensemble.proof.tools import check_tools

STOPPED = (130, 143, -signal.SIGINT, -signal.SIGTERM)
"""Status of a diagnosis that Ctrl-C reached too, or that someone ended."""
MARK = "proof.json"
SCORE = "score.json"
LIMIT_S = 3600.0
"""After which a diagnosis counts as none."""
KEPT = (
    "verdict",
    "sentence",
    "location",
    "left_over",
    "fit_summary",
    "untestable",
    "not_separable",
    "confounded",
)
OF_CAUSE = (
    "id", "kind", "name", "where", "equation", "credibility", "form", "parameters",
    "not_separable_from", "rivals",
)  # fmt: skip


@dataclass(frozen=True)
class Proof:
    """What `prove` gives.

    Attributes
    ----------
    score
        As ``score.json`` has it.
    results
        One for each campaign, in order.
    """

    score: dict[str, Any]
    results: list[dict[str, Any]]


def prove(
    seed: int,
    campaigns: int,
    out: str | Path,
    *,
    only: str | None = None,
    jobs: int = 1,
    keep: bool = False,
    limit_s: float = LIMIT_S,
    judge_hidden: bool = True,
    environment: Mapping[str, str] | None = None,
    progress: Callable[[str], None] = lambda line: None,
) -> Proof:
    """Prove the diagnosis on `campaigns` sealed campaigns of `seed`.

    Each campaign is a function of (seed, number) alone. Its answer is sealed before the diagnosis starts, in
    a process of its own that is given the folder and nothing else; the key stays in this one. ``OUT/results``
    gets one file a campaign, whole or not at all, so that the same call goes on after a stop.

    Parameters
    ----------
    seed
        Below 1,000,000 for development; a figure that is told comes from one above, used once.
    campaigns
        How many; a greater number later adds to those that are there.
    only
        Kinds (`forklift.ensemble.proof.kinds.KINDS`) or ids of what is concealed, by commas: others are
        skipped.
    jobs
        Campaigns side by side.
    keep
        Keep each campaign's folder, its diagnosis and its truth in ``OUT/kept``.
    limit_s
        Longest time for a diagnosis [s].
    environment
        Further variables of the diagnosing process: bounds under another value, see `sensitivity`.
    progress
        Told a line for each campaign.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``; ``"extra-missing"``, ``"compiler-missing"``; ``"output-exists"`` if `out`
        holds the proof of another seed; ``"folder-in-use"``; ``"not-writable"``; ``"seal-broken"``.
    """
    _check(seed, campaigns, jobs)
    check_tools()
    out = Path(out)
    numbers = list(chosen(seed, campaigns, only))
    with begun(out, {"seed": seed}, "results", "sealed"):
        paths = {number: out / "results" / f"{number:05d}.json" for number in numbers}
        left = [number for number in numbers if not paths[number].exists()]
        if len(left) < len(numbers):
            progress(f"{len(numbers) - len(left)} of {len(numbers)} campaigns are there.")
        seal, processes = Seal(), Processes()

        def run_one(number: int) -> dict[str, Any]:
            given = draw(seed, number)
            result = one(given, seal, out, jobs, keep, limit_s, judge_hidden, environment or {}, processes)
            output.write_text(paths[number], json.dumps(result, indent=1, ensure_ascii=False) + "\n")
            return result

        _side_by_side(run_one, left, jobs, processes, progress)
        return scored(out, seed, numbers, only)


def _side_by_side(
    run_one: Callable[[int], dict[str, Any]],
    left: Sequence[int],
    jobs: int,
    processes: Processes,
    progress: Callable[[str], None],
) -> None:
    """Run each campaign that is left, `jobs` at a time; where one fails or Ctrl-C comes, all are ended."""
    began, done = time.monotonic(), 0
    pool = ThreadPoolExecutor(jobs)
    try:
        queue = iter(left)
        running: set[Future[dict[str, Any]]] = set()
        while True:
            while len(running) < jobs and (number := next(queue, None)) is not None:
                running.add(pool.submit(run_one, number))
            if not running:
                break
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                result, done = future.result(), done + 1
                rate = (time.monotonic() - began) / done
                rest = rate * (len(left) - done) / 60.0
                progress(
                    f"{line(result)}  [{done}/{len(left)}, {60.0 / rate:.1f} a minute, {rest:.0f} min left]"
                )
    except BaseException:
        processes.end()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def chosen(seed: int, campaigns: int, only: str | None) -> Iterator[int]:
    """The numbers of the campaigns that are asked for."""
    wanted = {word.strip() for word in only.split(",")} if only else set()
    known = {*kinds.KINDS, *(name for kind in kinds.KINDS for name in kinds.of_kind(kind))}
    unknown = wanted - known
    if unknown:
        raise ForkliftError(
            "argument-invalid",
            f"--only names {sorted(unknown)[0]!r}, which is no kind and nothing that is concealed; kinds are "
            + ", ".join(kinds.KINDS),
            name="only",
            value=only,
            known=sorted(known),
        )
    for number in range(campaigns):
        kind = kind_of(seed, number)
        if not wanted or kind in wanted or wanted & set(draw(seed, number).concealed):
            yield number


def one(
    given: Draw,
    seal: Seal,
    out: Path,
    jobs: int,
    keep: bool,
    limit_s: float,
    judge_hidden: bool,
    environment: Mapping[str, str],
    processes: Processes,
) -> dict[str, Any]:
    """One campaign from its draw to its result."""
    with tempfile.TemporaryDirectory(prefix="campaign-") as scratch:
        folder, found = Path(scratch) / "campaign", Path(scratch) / "diagnosis"
        began = time.monotonic()
        made = conceal_apart(given, folder, judge_hidden=judge_hidden)
        made_s = time.monotonic() - began
        sealed = seal.close(made.answer, made.truth)
        commitment = out / "sealed" / f"{given.number:05d}"
        output.write_file(commitment.with_suffix(".box"), lambda path: _bytes(path, sealed.box))
        output.write_text(commitment.with_suffix(".sha256"), sealed.commitment + "\n")
        del made  # from here on the answer is in the box alone
        told = diagnosed(folder, found, given.entered_degc, jobs, limit_s, environment, processes)
        answer, truth = seal.open(
            Sealed(
                commitment.with_suffix(".box").read_bytes(),
                commitment.with_suffix(".sha256").read_text(encoding="utf-8").strip(),
            )
        )
        before, after = (predictions(found / "predictions" / side) for side in ("baseline", "final"))
        result = {
            "number": given.number,
            "answer": {key: value for key, value in answer.items() if key != "trucks"},
            "told": told,
            "judged": judged(answer, told),
            "intervals": intervals(answer, told),
            "removed": removed(answer, truth, before, after),
            "baselines": baselines.answers(folder, found, answer, told),
            "made_s": made_s,
            "seconds": told["seconds"],
            "commitment": sealed.commitment,
            "package": package_hash(),
        }
        if keep:
            _keep(out / "kept" / f"{given.number:05d}", folder, found, answer, truth)
    return result


def diagnosed(
    folder: Path,
    found: Path,
    entered_degc: float | None,
    jobs: int,
    limit_s: float,
    environment: Mapping[str, str] | None = None,
    processes: Processes | None = None,
) -> dict[str, Any]:
    """What ``forklift diagnose`` says of a folder, in a process that is given nothing else."""
    program = "forklift.ensemble.proof.under_bounds" if VARIABLE in (environment or {}) else "forklift"
    command = [
        sys.executable,
        "-m",
        program,
        "diagnose",
        str(folder),
        "--truck",
        "thesis",
        "--out",
        str(found),
    ]
    if entered_degc is not None:
        command += ["--temperature", f"{entered_degc:g}"]
    threads = str(max(1, (os.cpu_count() or 1) // jobs))
    given = os.environ | {"RAYON_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": "1"} | dict(environment or {})
    began = time.monotonic()
    try:
        status, wrote = (processes or Processes()).run(
            command, cwd=folder.parent, environment=given, limit_s=limit_s
        )
        said = wrote.strip()[-3000:]
    except subprocess.TimeoutExpired:
        status, said = None, f"not finished within {limit_s:g} s"
    seconds = time.monotonic() - began
    if status in STOPPED:  # no answer, and none to be counted
        raise KeyboardInterrupt
    if status != 0:  # what stands in `found` is an earlier answer's
        return {
            "verdict": "timeout" if status is None else "refused",
            "said": said,
            "causes": [],
            "seconds": seconds,
        }
    whole = json.loads((found / "diagnosis.json").read_text(encoding="utf-8"))
    told = {key: whole.get(key) for key in KEPT}
    told["causes"] = [{key: cause.get(key) for key in OF_CAUSE} for cause in whole["causes"]]
    told["suspects"] = [
        {key: one.get(key) for key in ("id", "kind", "where", "promised")} for one in whole["hypotheses"]
    ]
    return told | {"seconds": seconds}


def predictions(folder: Path) -> dict[str, dict[str, Floats]]:
    """By file, the columns of a folder of predictions."""
    return {path.name: baselines.columns(path) for path in sorted(folder.glob("*.csv"))}


def scored(out: Path, seed: int | None, numbers: list[int] | None = None, only: str | None = None) -> Proof:
    """The score of all results in `out`, judged by the rules as they are now; writes ``score.json``."""
    paths = sorted((out / "results").glob("*.json"))
    if numbers is not None:
        wanted = {f"{number:05d}.json" for number in numbers}
        paths = [path for path in paths if path.name in wanted]
    results = [judged_now(json.loads(path.read_text(encoding="utf-8"))) for path in paths]
    found = score(results)
    head = {
        "seed": seed,
        "label": "open" if seed is None else "development" if seed < DEVELOPMENT else "reporting",
        "only": only,
        "campaigns": len(results),
        "packages": sorted({one["package"] for one in results}),
    }
    found = head | found
    output.write_text(out / SCORE, json.dumps(found, indent=1, ensure_ascii=False) + "\n")
    return Proof(found, results)


def judged_now(result: dict[str, Any]) -> dict[str, Any]:
    """A result, judged by the rules as they are now."""
    return result | {"judged": judged(result["answer"], result["told"])}


def line(result: Mapping[str, Any]) -> str:
    """A result in one line."""
    right, answer = result["judged"], result["answer"]
    concealed = "+".join(cause["id"] + ("(hidden)" if cause["hidden"] else "") for cause in answer["causes"])
    told = ", ".join(
        f"{one['id']}[{one['form'][:1]} {one['credibility']:.2f}]" for one in result["told"]["causes"]
    )
    share = result["removed"]
    return (
        f"{result['number']:05d} {'right' if right['all'] else 'WRONG'} {answer['kind']}: "
        f"{concealed or 'nothing'} "
        f"-> {result['told']['verdict']} {told} "
        f"{'' if share is None else f'{100 * share:.0f} % removed '}{result['seconds']:.0f} s"
    )


def package_hash() -> str:
    """SHA-256 of the package's Python and of its core, first twelve digits: which code answered."""
    root, digest = Path(__file__).resolve().parents[2], hashlib.sha256()
    for path in sorted([*root.rglob("*.py"), *root.glob("_core*")]):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _check(seed: int, campaigns: int, jobs: int) -> None:
    for name, value, lower, upper in (
        ("seed", seed, 0, 2**63),
        ("campaigns", campaigns, 1, 100_000),
        ("jobs", jobs, 1, 256),
    ):
        if not lower <= value <= upper:
            raise ForkliftError(
                "argument-invalid",
                f"{name} is {value}, where {lower} to {upper} is possible; choose another",
                name=name,
                value=value,
                lower=lower,
                upper=upper,
            )


@contextmanager
def begun(out: Path, of: Mapping[str, object], *folders: str) -> Iterator[None]:
    """`out`, this call's alone, with these folders in it: what an earlier call of the same made, or empty."""
    mark = out / MARK
    if mark.exists():
        other = json.loads(mark.read_text(encoding="utf-8"))
        if other != of:
            raise ForkliftError(
                "output-exists",
                f"{out} holds a proof of {_named(other)}, not of {_named(of)}; name another folder",
                file=str(out),
            )
    elif out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ForkliftError(
            "output-exists",
            f"{out} holds something else; name a folder that does not exist yet",
            file=str(out),
        )
    try:
        for name in folders:
            (out / name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ForkliftError(
            "not-writable", f"{out} cannot be written ({error.strerror}); name another folder", file=str(out)
        ) from None
    with alone_in(out):
        if not mark.exists():
            output.write_text(mark, json.dumps(of) + "\n")
        yield


def _named(of: Mapping[str, object]) -> str:
    return " and ".join(f"{key} {value}" for key, value in of.items())


def _bytes(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def _keep(
    place: Path,
    folder: Path,
    found: Path,
    answer: Mapping[str, Any],
    truth: Mapping[str, Mapping[str, Floats]],
) -> None:
    """Everything of a campaign, for a look at what went wrong."""
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(folder, place / "campaign")
    if found.exists():
        shutil.copytree(found, place / "diagnosis")
    (place / "truth").mkdir(parents=True)
    for file, columns in truth.items():
        rows = np.stack(list(columns.values()), axis=1)
        np.savetxt(place / "truth" / file, rows, "%.7g", ",", header=",".join(columns), comments="")
    (place / "answer.json").write_text(
        json.dumps(dict(answer), indent=1, ensure_ascii=False) + "\n", encoding="utf-8"
    )

"""Open campaigns scored by the same rules: a folder of campaigns with an answer file beside them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from forklift.base import output, toml
from forklift.base.errors import ForkliftError
from forklift.ensemble.proof import baselines, kinds
from forklift.ensemble.proof.judge import intervals, judged, removed
from forklift.ensemble.proof.prove import (
    LIMIT_S,
    Proof,
    begun,
    diagnosed,
    line,
    package_hash,
    predictions,
    scored,
)

ANSWERS = "answers.json"


def score_open(
    folder: str | Path,
    out: str | Path,
    *,
    answers: str | Path | None = None,
    only: str | None = None,
    limit_s: float = LIMIT_S,
    progress: Callable[[str], None] = lambda line: None,
) -> Proof:
    """Diagnose the campaigns of `folder` and score what is said; goes on after a stop, as `prove` does.

    Parameters
    ----------
    folder
        Holds the campaigns' folders, and each one's noise-free truth where the answer says so.
    answers
        The answer file, ``answers.json`` in `folder` if none is given; `docs/proof.md` has its schema.
    only
        Names of campaigns' folders, by commas; others are skipped.

    Raises
    ------
    ForkliftError
        ``"answers-unreadable"``, also of a campaign that is named and cannot be read; ``"not-writable"``;
        ``"output-exists"`` if `out` holds another proof, or anything else; ``"folder-in-use"``.
    """
    folder, out = Path(folder), Path(out)
    path = Path(answers) if answers else folder / ANSWERS
    told = read(path)
    with begun(out, {"answers": hashlib.sha256(path.read_bytes()).hexdigest()}, "results", "diagnoses"):
        wanted = {one.strip() for one in only.split(",")} if only else None
        unknown = sorted((wanted or set()) - {given["folder"] for given in told})
        if unknown:
            raise ForkliftError(
                "argument-invalid",
                f"{path} has no campaign {', '.join(unknown)}; it has "
                f"{', '.join(one['folder'] for one in told)}",
                name="only",
                value=only,
            )
        numbers = []
        for number, given in enumerate(told):
            if wanted is not None and given["folder"] not in wanted:
                continue
            numbers.append(number)
            place = out / "results" / f"{number:05d}.json"
            if not place.exists():
                result = _one(number, given, folder, out / "diagnoses" / given["folder"], limit_s)
                output.write_text(place, json.dumps(result, indent=1, ensure_ascii=False) + "\n")
                progress(line(result))
        return scored(out, None, numbers, only)


def _one(number: int, given: Mapping[str, Any], folder: Path, found: Path, limit_s: float) -> dict[str, Any]:
    """One campaign of `folder` from its answer to its result; its diagnosis is kept in `found`."""
    answer, campaign = whole(number, given, folder), folder / given["folder"]
    found.parent.mkdir(parents=True, exist_ok=True)
    said = diagnosed(campaign.resolve(), found.resolve(), answer["entered_degc"], 1, limit_s)
    truth = predictions(folder / given["truth"]) if given.get("truth") else {}
    before, after = (
        {file: one for file, one in predictions(found / "predictions" / side).items() if file in truth}
        for side in ("baseline", "final")
    )
    return {
        "number": number,
        "answer": answer,
        "told": said,
        "judged": judged(answer, said),
        "intervals": intervals(answer, said),
        "removed": removed(answer, truth, before, after),
        "baselines": baselines.answers(campaign, found, answer, said),
        "seconds": said["seconds"],
        "package": package_hash(),
    }


def read(path: Path) -> list[dict[str, Any]]:
    """The answer file's campaigns."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        campaigns = told["campaigns"]
        for one in campaigns:
            for cause in one["causes"]:
                _completed(cause)
            one["folder"], one["lift"]
    except OSError as error:
        raise _unreadable(path, f"it cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError) as error:
        raise _unreadable(path, f"it is not as docs/proof.md says ({error!r})") from None
    return list(campaigns)


def _unreadable(path: Path, why: str) -> ForkliftError:
    return ForkliftError(
        "answers-unreadable", f"{path}: {why}; write a JSON file with the key campaigns", file=str(path)
    )


def whole(number: int, given: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """An answer with everything that the score asks for."""
    path = folder / given["folder"] / "campaign.toml"
    try:
        listed = toml.loads(path.read_text(encoding="utf-8-sig"))
        recordings = [
            {"file": one["file"], "role": one["role"], "lift": one["lift"], "entered_kg": one["load_kg"]}
            for one in listed["recording"]
        ]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ForkliftError(
            "answers-unreadable",
            f"{path}, which the answers name, is no campaign ({error!r}); correct the answer file",
            file=str(path),
        ) from None
    causes = [_completed(cause) for cause in given["causes"]]
    found = {one["kind"] for one in causes}
    return {
        "number": number,
        "kind": given.get("kind")
        or ("complete" if not causes else "two" if len(causes) > 1 else found.pop()),
        "lift": given["lift"],
        "causes": causes,
        "tolerated": list(given.get("tolerated", ())),
        "entered_degc": given.get("entered_degc"),
        "recordings": recordings,
    }


def _completed(cause: Mapping[str, Any]) -> dict[str, Any]:
    known: dict[str, Any] = {
        "size": None,
        "hidden": False,
        "values": {},
        "of": "",
        "names": (),
        "refused": (),
    }
    try:
        right = kinds.right(cause["id"])
        known |= {"kind": right.kind, "names": right.names, "of": right.of, "refused": right.refused}
        known |= {"equations": right.equations, "verdicts": right.verdicts}
    except KeyError:  # a law that this proof does not know must bring its own
        known |= {"kind": cause["kind"]}
    done = known | dict(cause)
    for key in ("names", "equations", "verdicts", "refused"):
        done[key] = list(done[key])
    return done

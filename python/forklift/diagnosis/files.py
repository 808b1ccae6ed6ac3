"""What a diagnosis leaves behind: its folder, whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from forklift.base import output, present
from forklift.base.result_files import PAGE, earlier_files
from forklift.diagnosis import to_json
from forklift.diagnosis.outcome import COMMAND
from forklift.diagnosis.unfinished import work_files
from forklift.fitting.agreement import prediction_files
from forklift.recordings.campaign import FILE as CAMPAIGN
from forklift.recordings.campaign import csv_name

if TYPE_CHECKING:
    from forklift.diagnosis.outcome import Outcome
    from forklift.plant.subject import Written

MARK = "diagnosis.json"
TIMES = "times.json"
"""How long each stage took: the one file that differs from one call to the next."""
CORRECTED = "corrected"
"""The folder of the campaign with the conditions that were found."""
MODELS = ("truck.toml", "parameters.json")
"""What the machine that was found may be called."""


def write(found: Outcome, out: str | Path) -> Path:
    """See `Diagnosis.write`."""
    told = to_json.to_dict(found)
    with output.folder(out, earlier(out), MARK, work_files(out)) as temporary:
        found.machine.write(temporary, found.values, found.source, found.title)
        found.before.write(temporary, "baseline")
        found.after.write(temporary, "final")
        if (corrected := _corrected(found)) is not None:
            corrected.write(temporary / CORRECTED)
        if found.next_recording:
            found.next_recording.write(temporary / COMMAND)
        text = json.dumps(told, indent=1, ensure_ascii=False, allow_nan=False)
        (temporary / MARK).write_text(text + "\n", encoding="utf-8", newline="\n")
        spent = {"seconds": dict(found.seconds), "runtime_s": sum(found.seconds.values())}
        (temporary / TIMES).write_text(json.dumps(spent, indent=1) + "\n", encoding="utf-8", newline="\n")
        (temporary / PAGE).write_text(present.page(found, told), encoding="utf-8", newline="\n")
    return Path(out)


def _corrected(found: Outcome) -> Written | None:
    """The recordings with the conditions that were found, where entered ones are a cause."""
    if not any(cause.hypothesis.doubts for cause in found.causes):
        return None
    conditions = [one.conditions for one in found.after.predictions]
    return found.machine.corrected(found.origin.name, found.recordings, conditions)


def check(out: str | Path) -> Path:
    """`out`, absolute, if a diagnosis may be written there.

    Raises
    ------
    ForkliftError
        As `forklift.base.output.check_folder`.
    """
    return output.check_folder(out, earlier(out), MARK, work_files(out))


def earlier(out: str | Path) -> frozenset[str]:
    """The files of the earlier diagnosis that stands in `out`; none if there is none."""
    return earlier_files(out, MARK, files, "campaign_facts")


def files(recordings: Sequence[str]) -> frozenset[str]:
    """What a diagnosis of these recordings may hold."""
    before, after = prediction_files(recordings), prediction_files(recordings, "final")
    corrected = [f"{CORRECTED}/{name}" for name in (CAMPAIGN, *map(csv_name, recordings))]
    return frozenset({MARK, TIMES, PAGE, *MODELS, COMMAND, *before, *after, *corrected})

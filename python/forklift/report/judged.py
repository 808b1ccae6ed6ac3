"""What a diagnosis was judged on, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from forklift.diagnosis.result import Diagnosis


def judged(found: Diagnosis) -> str:
    """What was judged on: how many recordings, and in how many stretches that err independently."""
    count = len({one.file for one in found.recordings if one.role == found.judged_on})
    parts = len(found.final.by_recording())
    each = f", as {parts} stretches" if parts != count else ""
    kind = "held out" if found.judged_on == "validate" else "fitted on"
    return f"{count} recording{'s' if count > 1 else ''} {kind}{each}"

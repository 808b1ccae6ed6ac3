"""Conditions that were entered wrongly, recording by recording: what was entered, and what was found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from forklift.base.typeset import number
from forklift.plant.misread import HARDLY

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.result import Diagnosis
    from forklift.plant.protocol import Hypothesis


def entered(found: Diagnosis, one: Hypothesis) -> Iterator[tuple[str, str, str, float, float]]:
    """Every recording's conditions that a hypothesis doubts: file, role, condition, entered and found."""
    for told in found.after.predictions:
        given = found.machine.conditions(told.recording, {})
        for name, value in told.conditions.items():
            if any(name.startswith(of) for of in one.doubts) and name in given:
                yield told.recording.file, told.recording.role, name, given[name], value


def in_how_many(found: Diagnosis, cause: Cause) -> Iterator[str]:
    """In how many recordings a condition was entered wrongly, and where its values stand."""
    rows = list(entered(found, cause.hypothesis))
    if not rows:
        return
    furthest = max(abs(value - given) for *_, given, value in rows)
    wrong = [abs(value - given) > HARDLY * furthest for *_, given, value in rows]
    of = found.machine.words.condition(rows[0][2])
    empty = [of.is_amount and given == 0.0 for *_, given, _ in rows]
    kinds = [role == "validate" for _, role, *_ in rows]
    held = sum(one and of for one, of in zip(wrong, kinds, strict=True))
    some = f" ({sum(wrong) - held} fitted, {held} held out)" if 0 < held < sum(wrong) else ""
    if any(empty) and wrong == [not one for one in empty]:
        yield (
            f"So in all {sum(wrong)} recordings{some} with a {of.name}; right in the {sum(empty)} without. "
            "Every recording's value, entered and found: see Evidence."
        )
        return
    yield (
        f"So in {sum(wrong)} of {len(rows)} recordings{some}. "
        "Every recording's value, entered and found: see Evidence."
    )


def each_alone(found: Diagnosis, cause: Cause) -> Iterator[str]:
    """Of a condition that every recording tells by itself: in how many it is wrong, and by how much."""
    rows = list(entered(found, cause.hypothesis))
    off = [value - given for *_, given, value in rows]
    wrong = [one for one in off if abs(one) > HARDLY * max(map(abs, off))]
    if len(wrong) < 2:
        return
    what, unit, _ = found.machine.words.condition(rows[0][2])
    least, most = number(min(wrong)), number(max(wrong))
    by = f"{least} {unit} in each" if least == most else f"from {least} to {most} {unit}"
    yield (
        f"Each recording tells its own {what}: in the {len(wrong)} where it is wrong, {by} above that entered"
        f"{' (negative: below)' if min(wrong) < 0.0 else ''}."
    )

"""Effects that are absent: at its quiet value an effect changes no bit of a run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache

from forklift import _core


def without_absent(values: Mapping[str, float], own: Collection[str]) -> dict[str, float]:
    """The values but for those of absent effects: the run is the same, to the bit.

    `own`: parameters that the truck has without these values; an effect among them is never left out.
    """
    heads = dict.fromkeys(name.rpartition(".")[0] for name in values)
    absent = {head for head in heads if _is_absent(head, values, own)}
    return {name: value for name, value in values.items() if name.rpartition(".")[0] not in absent}


def _is_absent(head: str, values: Mapping[str, float], own: Collection[str]) -> bool:
    known = _amplitudes().get(head.rpartition(".")[2])
    if known is None:
        return False
    quiet, names = known
    return all(values.get(f"{head}.{name}") == quiet and f"{head}.{name}" not in own for name in names)


@cache
def _amplitudes() -> dict[str, tuple[float, tuple[str, ...]]]:
    """By effect its quiet value and the parameters that have it where the effect is absent."""
    return {
        spec["id"]: (
            spec["quiet"],
            tuple(one["name"] for one in spec["parameters"][: spec["amplitudes"]]),
        )
        for spec in _core.effect_table()
    }

"""Bounds and priors that the caller of a fit gives: parameters may be known better than the tables say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

import numpy as np

from forklift.base.errors import ForkliftError
from forklift.plant.parameter import SCALES, Unknown

Pair = tuple[float, float]


def constrained(
    unknowns: Sequence[Unknown], bounds: Mapping[str, Pair], priors: Mapping[str, Pair]
) -> list[Unknown]:
    """The unknowns with these bounds and priors.

    Parameters
    ----------
    bounds
        By name least and greatest value, in the parameter's unit; the start lies between them.
    priors
        By name mean and standard deviation, in the parameter's unit. The search starts from the mean.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``, ``"prior-invalid"``, ``"bounds-invalid"``.
    """
    found = {one.name: one for one in unknowns}
    for what, given in (("priors", priors), ("bounds", bounds)):
        if not isinstance(given, Mapping):
            raise ForkliftError(
                "argument-invalid", f"{what} is no mapping of names to pairs of numbers; give one", name=what
            )
        for name, pair in given.items():
            one = _known(what, name, found)
            first, second = _pair(what, name, pair)
            found[one.name] = (
                _with_prior(one, first, second) if what == "priors" else _bounded(one, first, second)
            )
    return [found[one.name] for one in unknowns]


def _known(what: str, name: str, found: Mapping[str, Unknown]) -> Unknown:
    """The unknown of this name alone."""
    one = found.get(name)
    if one is None:
        near = get_close_matches(str(name), list(found), n=1)
        raise ForkliftError(
            "argument-invalid",
            f"{what}: {name} is not estimated by itself"
            + (f"; did you mean {near[0]}?" if near else "; let it move with also, or leave it out"),
            name=name,
        )
    if len(one.names) > 1:
        raise ForkliftError(
            "argument-invalid",
            f"{what}: {name} moves together with {', '.join(one.names[1:])}, and has none of its own; "
            "take it out of together, or leave it out here",
            name=name,
        )
    if what == "priors" and name.rpartition(".")[2].isdigit():
        raise ForkliftError(
            "argument-invalid",
            f"priors: {name} is a knot of a table, whose prior keeps it between its neighbours; bound it "
            "instead",
            name=name,
        )
    return one


def _pair(what: str, name: str, pair: Any) -> Pair:
    try:
        first, second = (float(one) for one in pair)
    except (TypeError, ValueError):
        wanted = "(mean, standard deviation)" if what == "priors" else "(least, greatest)"
        raise ForkliftError(
            "argument-invalid", f"{what}: {name} is {pair!r}; give two numbers, {wanted}", name=name
        ) from None
    return first, second


def _bounded(one: Unknown, lower: float, upper: float) -> Unknown:
    least, start, most = (float(one.values(at)[0]) for at in (one.lower, 0.0, one.upper))
    least, most = min(least, most), max(least, most)
    if not least <= lower < upper <= most:
        raise _wrong(
            "bounds-invalid",
            f"bounds: {one.name} may lie between {lower:g} and {upper:g} {one.unit}, where two numbers that "
            f"rise within {least:g} to {most:g} {one.unit} are possible; narrow them",
            one, (lower, upper), least, most,
        )  # fmt: skip
    if not lower <= start <= upper:
        raise _wrong(
            "bounds-invalid",
            f"bounds: {one.name} may lie between {lower:g} and {upper:g} {one.unit}, but starts at "
            f"{start:g}; widen them, give it a prior with its mean between them, or start from another value",
            one, (lower, upper), least, most,
        )  # fmt: skip
    ends = sorted(_theta(one, end) for end in (lower, upper))
    return replace(one, lower=max(ends[0], one.lower), upper=min(ends[1], one.upper))


def _with_prior(one: Unknown, mean: float, deviation: float) -> Unknown:
    least, most = sorted(float(one.values(at)[0]) for at in (one.lower, one.upper))
    if not (least < mean < most and 0.0 < deviation < np.inf):
        raise _wrong(
            "prior-invalid",
            f"priors: {one.name} is {mean:g} ± {deviation:g} {one.unit}, where a mean between {least:g} and "
            f"{most:g} {one.unit} and a deviation above 0 are possible; correct it",
            one, (mean, deviation), least, most,
        )  # fmt: skip
    slope = abs(float(SCALES[one.scale].slope(np.array([mean]))[0]))
    moved = replace(one, start=(mean,), width=deviation / slope)
    origin, new = (SCALES[one.scale].forth(value) for value in (one.start[0], mean))
    ends = [(origin + one.width * end - new) / moved.width for end in (one.lower, one.upper)]
    return replace(moved, lower=ends[0], upper=ends[1])


def _theta(one: Unknown, value: float) -> float:
    forth = SCALES[one.scale].forth
    return (forth(value) - forth(one.start[0])) / one.width


def _wrong(code: str, sentence: str, one: Unknown, value: Pair, least: float, most: float) -> ForkliftError:
    return ForkliftError(
        code, sentence, name=one.name, value=list(value), lower=least, upper=most, unit=one.unit
    )

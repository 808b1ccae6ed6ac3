"""In the operator's own variables: of what the unknown input is a function, and where it acts.

The smoothed input is regressed on each variable in turn, by a curve of seven knots that is loath to bend
(Eilers & Marx 1996), each sample of the input weighted by what the recordings tell of it. What counts is the
share of its square that is explained in a recording the curve was not drawn from.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.criteria import TELLING
from forklift.diagnosis.locate import UnknownInput

KNOTS = 7
STIFF = 1e-2
"""Weight of the second differences, in units of a knot's mean weight."""
ACTS = 0.5
"""The region is where the curve lies above this share of its largest absolute value."""


@dataclass(frozen=True, eq=False)
class Dependence:
    """The unknown input as a function of one variable."""

    variable: str
    explained: float
    """Share of the input's square, in recordings left out; negative if worse than nothing."""
    at: Floats
    """(knots,) values of the variable."""
    curve: Floats
    """(knots,) the input there."""

    @property
    def region(self) -> tuple[float, float]:
        """Between which values of the variable the input acts most."""
        strong = np.flatnonzero(np.abs(self.curve) >= ACTS * np.abs(self.curve).max())
        return float(self.at[strong[0]]), float(self.at[strong[-1]])


def dependences(
    found: UnknownInput, variables: Sequence[Mapping[str, Floats]], past: Collection[str] = ()
) -> list[Dependence]:
    """The input against every variable, the best first.

    `variables` holds each recording's, at the times of its hats; what not all of them have is none. What is
    of the `past` must explain `TELLING` more than one of the moment, to come first.
    """
    names = [name for name in variables[0] if all(name in given for given in variables)]
    fitted = [_shape(found, name, [given[name] for given in variables]) for name in names]
    return sorted(
        (shape for shape in fitted if shape),
        key=lambda shape: TELLING * (shape.variable in past) - shape.explained,
    )


def _shape(found: UnknownInput, name: str, columns: Sequence[Floats]) -> Dependence | None:
    everything = np.concatenate(columns)
    finite = everything[np.isfinite(everything)]
    if not len(finite) or np.ptp(finite) <= 1e-6 * np.abs(finite).max():
        return None
    at = np.linspace(finite.min(), finite.max(), KNOTS)
    normals, rights, squares = [], [], []
    for column, value, band in zip(columns, found.values, found.bands, strict=True):
        known = np.isfinite(column)
        weight = 1.0 / np.maximum(band[known], 1e-12) ** 2
        basis = _tents(column[known], at)
        normals.append(basis.T @ (weight[:, None] * basis))
        rights.append(basis.T @ (weight * value[known]))
        squares.append(float(weight @ value[known] ** 2))
    normal, right = sum(normals), sum(rights)
    bend = np.diff(np.eye(KNOTS), 2, axis=0)
    ridge = np.trace(normal) / KNOTS * (STIFF * bend.T @ bend + 1e-6 * np.eye(KNOTS))
    gained = 0.0
    for own, mine in zip(normals, rights, strict=True):
        line = np.linalg.solve(normal - own + ridge, right - mine)
        gained += float(2.0 * mine @ line - line @ own @ line)
    return Dependence(name, gained / sum(squares), at, np.linalg.solve(normal + ridge, right))


def _tents(values: Floats, at: Floats) -> Floats:
    return np.stack([np.interp(values, at, row) for row in np.eye(len(at))], axis=1)

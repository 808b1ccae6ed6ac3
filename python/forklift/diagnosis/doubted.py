"""What recordings tell where conditions are doubted, and not what the doubt's prior makes of it.

Each of K recordings has its own offset o_k of a doubted condition, with the prior N(0, w_k²): as if each had
been entered wrongly by itself. By that alone their mean would be known to w/√K. But what reads or enters
wrongly does so in all recordings alike, so that nothing is known of their level beforehand. The prior's share
along it is taken out of the normal matrix,

    N = JᵀJ − Σ u uᵀ,    u_k ∝ 1/w_k,  |u| = 1,    over the doubted conditions,

and the level is as well known as what else would make up for it: an oil that is warmer in all recordings is
one of a lower viscosity ν₀ in all of them, to the last digit,

    ν = ν₀ e^(−λ(T − T₀))    (Fri & Fahlén 2017, (3.1)).

A parameter h that was held, as no recording tells it, is as well known as its prior has it. It moves the
optimum along G = −N⁻¹ N_h, N_h its column, so that (law of propagation of uncertainty, JCGM 100:2008, 5.2.2)

    C = N⁻¹ + G diag(var h) Gᵀ,

all in standard deviations of the priors: where λ was held, differences of temperature go as 1/λ.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.fitting.intervals import inverse
from forklift.fitting.problem import Last
from forklift.fitting.search import Found
from forklift.fitting.work import Work
from forklift.plant.parameter import Unknown
from forklift.plant.protocol import Addition

LEFT = 1e-6
"""Share of the prior that stays along the level, so that N has an inverse where nothing tells it: a deviation
a thousand times the prior's."""


@dataclass(frozen=True, eq=False)
class Known:
    """How well the unknown vector is known at a search's end.

    Attributes
    ----------
    noise
        (unknowns, unknowns) N⁻¹: what the recordings' noise leaves open.
    held
        (unknowns, unknowns) G diag(var h) Gᵀ: what parameters that were held leave open.
    looser
        (unknowns,) factor on each deviation that the doubt's prior had made narrower.
    """

    noise: Floats
    held: Floats
    looser: Floats


def what_is_known(found: Found, doubted: Collection[str], held: Sequence[Unknown]) -> Known:
    """With these conditions doubted, and these parameters held though no recording tells them."""
    with one_thread():
        normal = found.jacobian.T @ found.jacobian
        told = inverse(normal)
        free = normal.copy()
        for name in doubted:
            at = places(found.problem, name)
            level = 1.0 / widths(found.problem, name)
            level /= np.linalg.norm(level)
            free[np.ix_(at, at)] -= (1.0 - LEFT) * np.outer(level, level)
        noise = inverse(free)
        moves = -noise @ _columns(found, held)
        looser = np.sqrt(np.maximum(np.diag(noise) / np.diag(told), 1.0))
        return Known(noise, moves @ moves.T, looser)


def places(problem: Any, name: str) -> list[int]:
    """Where each recording's offset of a condition stands in the unknown vector."""
    return [
        problem.starts[k] + int(np.searchsorted(sample.free, sample.names.index(name)))
        for k, sample in enumerate(problem.samples)
    ]


def widths(problem: Any, name: str) -> Floats:
    """(recordings,) its priors' standard deviations, in its unit."""
    return np.array([float(sample.width[sample.names.index(name)]) for sample in problem.samples])


def _columns(found: Found, held: Sequence[Unknown]) -> Floats:
    """(unknowns, held) the normal matrix's columns along what was held, times its prior's deviation."""
    problem: Any = found.problem
    there = {unknown.name for unknown in problem.unknowns}
    more = tuple(one for one in held if one.name not in there)
    if not more:
        return np.zeros((len(found.x), 0))
    wider = copy(problem.with_addition(Addition(free=more)))
    wider.work, wider.last = Work(), Last()  # it is no part of the search
    names = [unknown.name for unknown in wider.unknowns]
    new = [names.index(one.name) for one in more]
    old = np.delete(np.arange(wider.starts[-1]), new)
    x = np.zeros(wider.starts[-1])
    x[old] = found.x
    _, jacobian = wider.compressed(x)
    _, slope = wider.prior(x)
    return np.asarray(jacobian[:, old].T @ jacobian[:, new] / slope[new])

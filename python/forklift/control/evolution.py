"""A minimum of a function that jumps: evolution with an adapted covariance.

Source: Hansen & Ostermeier (2001), Evolutionary Computation 9(2), with the defaults of Hansen (2016),
arXiv:1604.00772, Table 1, without negative weights.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from forklift.base.arrays import Floats


def minimised(
    cost: Callable[[Floats], Floats],
    start: Floats,
    width: Floats,
    lower: Floats,
    upper: Floats,
    *,
    generations: int,
    candidates: int,
    random: np.random.Generator,
) -> Floats:
    """The best of all candidates within the bounds; the start is the first of them.

    Parameters
    ----------
    cost
        Of (candidates, n) values at once; what is out of bounds is moved to them, and costs half the
        square of the way in widths more.
    width
        (n,) How far the first generation goes about the start: its standard deviation.
    """
    n, kept = len(start), candidates // 2
    weights = np.log(kept + 0.5) - np.log(np.arange(1, kept + 1))
    weights /= weights.sum()
    mass = 1.0 / float((weights**2).sum())
    path_rate, step_rate = (4.0 + mass / n) / (n + 4.0 + 2.0 * mass / n), (mass + 2.0) / (n + mass + 5.0)
    rank_one = 2.0 / ((n + 1.3) ** 2 + mass)
    rank_mu = min(1.0 - rank_one, 2.0 * (mass - 2.0 + 1.0 / mass) / ((n + 2.0) ** 2 + mass))
    damping = 1.0 + 2.0 * max(0.0, np.sqrt((mass - 1.0) / (n + 1.0)) - 1.0) + step_rate
    expected = np.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))
    mean, step, covariance = np.zeros(n), 1.0, np.eye(n)
    path, step_path = np.zeros(n), np.zeros(n)
    best, least = start, np.inf
    for k in range(generations):
        squares, axes = np.linalg.eigh(covariance)
        lengths = np.sqrt(np.maximum(squares, 1e-12))
        moves = (random.standard_normal((candidates, n)) * lengths) @ axes.T
        wanted = start + width * (mean + step * moves)
        if k == 0:
            wanted[0] = start
        tried = np.clip(wanted, lower, upper)
        costs = cost(tried) + 0.5 * (((wanted - tried) / width) ** 2).sum(axis=1)
        order = np.argsort(costs)
        if costs[order[0]] < least:
            best, least = tried[order[0]], float(costs[order[0]])
        good = moves[order[:kept]]
        way = weights @ good
        mean = mean + step * way
        step_path = (1.0 - step_rate) * step_path + np.sqrt(step_rate * (2.0 - step_rate) * mass) * (
            axes @ ((way @ axes) / lengths)
        )
        length = float(np.linalg.norm(step_path)) / expected
        short = length / np.sqrt(1.0 - (1.0 - step_rate) ** (2 * (k + 1))) < 1.4 + 2.0 / (n + 1.0)
        path = (1.0 - path_rate) * path + short * np.sqrt(path_rate * (2.0 - path_rate) * mass) * way
        covariance = (
            (1.0 - rank_one - rank_mu) * covariance
            + rank_one * np.outer(path, path)
            + rank_mu * (good.T * weights) @ good
        )
        step *= float(np.exp(step_rate / damping * (length - 1.0)))
    return best

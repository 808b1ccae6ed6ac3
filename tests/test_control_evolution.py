"""The evolution that tunes controllers: it finds a minimum along a bent valley, within its bounds, again."""

import numpy as np

from forklift.control.evolution import minimised


def bent(values: np.ndarray) -> np.ndarray:
    """Rosenbrock's (1960) function of each row, in steps of 1e-4: a valley whose direction must be learnt."""
    x, y = values[:, 0], values[:, 1]
    return np.floor(1e4 * (100.0 * (y - x * x) ** 2 + (1.0 - x) ** 2)) / 1e4


def found(seed: int, upper: float = 3.0) -> np.ndarray:
    return minimised(
        bent,
        np.array([-1.2, 1.0]),
        np.array([0.3, 0.3]),
        np.array([-3.0, -3.0]),
        np.array([upper, 3.0]),
        generations=120,
        candidates=12,
        random=np.random.default_rng(seed),
    )


def test_it_follows_a_bent_valley_to_its_end() -> None:
    for seed in range(4):
        assert np.allclose(found(seed), [1.0, 1.0], atol=0.05)


def test_it_stays_within_its_bounds_and_finds_the_best_there() -> None:
    best = found(1, upper=0.5)
    assert best[0] <= 0.5
    assert np.allclose(best, [0.5, 0.25], atol=0.03)


def test_a_seed_gives_the_same_again_and_the_start_is_never_lost() -> None:
    assert np.array_equal(found(3), found(3))
    at = np.array([1.0, 1.0])
    kept = minimised(
        bent,
        at,
        np.ones(2),
        -3 * np.ones(2),
        3 * np.ones(2),
        generations=3,
        candidates=6,
        random=np.random.default_rng(0),
    )
    assert np.array_equal(kept, at)

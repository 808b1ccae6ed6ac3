"""How well recordings foretell each other with a hypothesis and without, against dense normal
distributions."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from forklift.diagnosis.hypothesis import Hypothesis
from forklift.diagnosis.screening import _Base, _Column
from forklift.fitting.interface import Problem

SHARED, OWN = 3, 2
NOBODY = cast(Hypothesis, None)


def linear(seed: int, recordings: int, amplitude: float, *, own: bool):
    """Recordings y = J u + B a + noise, all unknowns of unit prior, as `_Base` sees them."""
    random = np.random.default_rng(seed)
    places = [np.r_[:SHARED, SHARED + OWN * k + np.arange(OWN)] for k in range(recordings)]
    total = SHARED + OWN * recordings
    truth, mean = random.normal(size=total), random.normal(size=total)
    jacobian, blocks, measured = [], [], []
    for place in places:
        count = random.integers(4, 12)
        jacobian.append(random.normal(size=(count, len(place))))
        blocks.append(random.normal(size=(count, 1)))
        measured.append(
            jacobian[-1] @ truth[place] + amplitude * blocks[-1][:, 0] + random.normal(size=count)
        )
    x = random.normal(size=total)  # the point it is linear about
    problem = SimpleNamespace(columns=places.__getitem__, prior=lambda x: (x - mean, np.ones(total)))
    residual = [one @ x[place] - y for one, place, y in zip(jacobian, places, measured, strict=True)]
    base = _Base(cast(Problem, problem), x, residual, jacobian)
    return base, _Column(NOBODY, blocks, own), mean, measured


def log_density(base, columns, mean, measured, which):
    """ln p of the recordings `which`, all unknowns integrated out."""
    starts = np.cumsum([0, *map(len, measured)])
    J = np.zeros((starts[-1], len(mean)))
    extra = []
    for k, (place, own) in enumerate(zip(base.places, base.jacobian, strict=True)):
        J[starts[k] : starts[k + 1], place] = own
    for column in columns:
        stacked = np.concatenate(column.blocks)
        if column.own:
            several = np.zeros((len(stacked), len(measured)))
            for k in range(len(measured)):
                several[starts[k] : starts[k + 1], k] = stacked[starts[k] : starts[k + 1], 0]
            stacked = several
        extra.append(stacked)
    everything = np.concatenate([J, *extra], axis=1)
    rows = np.concatenate([np.arange(starts[k], starts[k + 1]) for k in which])
    A = everything[rows]
    y = np.concatenate([measured[k] for k in which])
    return multivariate_normal.logpdf(y, (J @ mean)[rows], np.eye(len(rows)) + A @ A.T)


@given(st.integers(0, 2**32 - 1), st.integers(2, 5), st.floats(-3.0, 3.0), st.booleans())
def test_it_is_what_normal_distributions_say_of_each_recording_given_the_others(seed, count, amplitude, own):
    base, column, mean, measured = linear(seed, count, amplitude, own=own)

    def given_others(columns):
        everyone = range(count)
        whole = log_density(base, columns, mean, measured, list(everyone))
        return sum(
            whole - log_density(base, columns, mean, measured, [k for k in everyone if k != left])
            for left in everyone
        )

    want = given_others([column]) - given_others([])
    assert abs(base.loo_log_score([column]) - want) < 1e-6 * max(1.0, abs(want))


def test_what_acts_alike_in_all_recordings_is_foretold_and_what_is_not_there_is_not():
    found = {
        amplitude: np.mean(
            [
                base.loo_log_score([column])
                for base, column, *_ in (linear(seed, 8, amplitude, own=False) for seed in range(40))
            ]
        )
        for amplitude in (0.0, 2.0)
    }
    assert found[0.0] < 0.0
    assert found[2.0] > 10.0


def test_what_each_recording_has_of_its_own_no_other_foretells():
    # A column of each recording's own costs evidence where nothing is there.
    base, column, *_ = linear(3, 6, 0.0, own=True)
    assert base.loo_log_score([column]) < 0.0


@given(st.integers(0, 2**32 - 1), st.integers(2, 5), st.floats(-3.0, 3.0), st.booleans(), st.booleans())
def test_the_evidence_of_one_or_a_pair_is_the_ratio_of_the_densities_with_and_without(
    seed, count, amplitude, own, pair
):
    base, column, mean, measured = linear(seed, count, amplitude, own=own)
    columns = [column]
    if pair:
        blocks = [np.random.default_rng(seed + 1).normal(size=(len(one), 2)) for one in measured]
        columns.append(_Column(cast(Hypothesis, "another"), blocks, False))
    found = base.gain(list(base.project(columns).values()))
    everyone = list(range(count))
    want = log_density(base, columns, mean, measured, everyone) - log_density(
        base, [], mean, measured, everyone
    )
    assert abs(found.evidence - want) < 1e-6 * max(1.0, abs(want))

"""How well recordings predict each other with a hypothesis and without, against dense normal
distributions."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

from analytic import CHANNEL, apart, unknown
from forklift.diagnosis.hypothesis import carry, with_hypotheses
from forklift.diagnosis.screening import loo_log_scores, screen
from forklift.plant.protocol import Addition, Hypothesis
from forklift.recordings.noise import Sensor

SHARED, OWN = ("a", "b", "c"), ("p", "q")
"""Unknown numbers of the machine, and of each recording."""
EFFECT = "e"
COMMON = Hypothesis(
    EFFECT, "physics", "", "", "", EFFECT, Addition(values=((EFFECT, 0.0),), free=(unknown(EFFECT),))
)
"""The same amplitude in every recording."""
OF_EACH = Hypothesis(EFFECT, "unknown", "", "", "", None, Addition(widened=((EFFECT, 1.0),)))
"""An amplitude of each recording's own."""


def loo_log_score(*of):
    return loo_log_scores(*of).sum()


def drawn(seed: int, recordings: int, amplitude: float, hypothesis: Hypothesis):
    """A problem whose recordings are linear in all unknowns, and a point at which it is looked at."""
    random = np.random.default_rng(seed)
    own = (*OWN, EFFECT) if hypothesis is OF_EACH else OWN
    shared = random.normal(size=len(SHARED))
    matrices, measured = [], []
    for _ in range(recordings):
        count = random.integers(4, 12)
        columns = {name: random.normal(size=count) for name in (*SHARED, *OWN, EFFECT)}
        truth = dict(zip((*SHARED, *OWN), [*shared, *random.normal(size=len(OWN))], strict=True))
        truth[EFFECT] = amplitude
        matrices.append(columns)
        measured.append(sum(truth[name] * columns[name] for name in truth) + random.normal(size=count))
    problem = apart(matrices, measured, SHARED, own, known=(EFFECT,))
    return problem, 0.5 * random.normal(size=problem.starts[-1])


def log_density(problem, x, which):
    """ln p of the recordings `which` of the problem linear about x, all unknowns integrated out."""
    rho, slope = problem.prior(x)
    slope[len(SHARED) : len(problem.unknowns)] = 1.0  # an amplitude's prior is normal
    residual, rows = [], []
    for k, run in enumerate(problem.linearise(x)):
        if k in which:
            (channel,) = run.residual
            wide = np.zeros((len(run.residual[channel]), len(x)))
            wide[:, problem.columns(k)] = run.jacobian[channel]
            residual.append(run.residual[channel])
            rows.append(wide)
    A = np.concatenate(rows)
    # The unknowns are normal about x - rho/slope, and each sample is off by 1.
    off = np.concatenate(residual) - A @ (rho / slope)
    return multivariate_normal.logpdf(off, None, np.eye(len(A)) + (A / slope**2) @ A.T)


def given_the_others(problem, x):
    """The sum over recordings of ln p(recording | the others)."""
    everyone = set(range(len(problem.samples)))
    whole = log_density(problem, x, everyone)
    return sum(whole - log_density(problem, x, everyone - {left}) for left in everyone)


def with_effect(problem, x, hypothesis):
    """The problem with the hypothesis, and the same point in it: the effect is absent."""
    wider = with_hypotheses(problem, [hypothesis])
    at = np.zeros(wider.starts[-1])
    at[: len(SHARED)] = x[: len(SHARED)]
    for k in range(len(problem.samples)):
        first = wider.starts[k]
        at[first : first + len(OWN)] = problem.nuisance(x, k)
    return wider, at


@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 5),
    st.floats(-3.0, 3.0),
    st.sampled_from([COMMON, OF_EACH]),
)
def test_it_is_what_normal_distributions_say_of_each_recording_given_the_others(
    seed, count, amplitude, hypothesis
):
    problem, x = drawn(seed, count, amplitude, hypothesis)
    want = given_the_others(*with_effect(problem, x, hypothesis)) - given_the_others(problem, x)
    assert loo_log_score(problem, x, [hypothesis]) == pytest.approx(want, rel=1e-6, abs=1e-6)


def test_what_acts_alike_in_all_recordings_is_predicted_and_what_is_absent_is_not():
    found = {
        amplitude: np.mean(
            [loo_log_score(*drawn(seed, 8, amplitude, COMMON), [COMMON]) for seed in range(40)]
        )
        for amplitude in (0.0, 2.0)
    }
    assert found[0.0] < 0.0
    assert found[2.0] > 10.0


def test_what_each_recording_has_of_its_own_no_other_predicts():
    # A number of each recording's own costs evidence where nothing is there.
    problem, x = drawn(3, 6, 0.0, OF_EACH)
    assert loo_log_score(problem, x, [OF_EACH]) < 0.0


def test_a_hypothesis_that_moves_nothing_has_no_score():
    problem, x = drawn(1, 3, 0.0, COMMON)
    absent = Hypothesis("z", "physics", "", "", "", "z", Addition(values=(("z", 0.0),), free=(unknown("z"),)))
    assert np.isnan(loo_log_score(problem, x, [absent]))


@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 5),
    st.floats(-3.0, 3.0),
    st.sampled_from([COMMON, OF_EACH]),
)
def test_the_evidence_is_the_ratio_of_the_densities_with_and_without(seed, count, amplitude, hypothesis):
    problem, x = drawn(seed, count, amplitude, hypothesis)
    everyone = set(range(count))
    want = log_density(*with_effect(problem, x, hypothesis), everyone) - log_density(problem, x, everyone)
    assert screen(problem, x, [hypothesis]).ranked[0].evidence == pytest.approx(want, rel=1e-6, abs=1e-6)


@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 3.0))
def test_the_gain_of_a_pair_is_what_one_linear_step_of_everything_takes_off(seed, amplitude):
    random = np.random.default_rng(seed)
    names = ("a", "b", "e", "f")
    matrices = [{name: random.normal(size=15) for name in names} for _ in range(3)]
    measured = [columns["a"] + amplitude * columns["e"] + random.normal(size=15) for columns in matrices]
    problem = apart(matrices, measured, ("a", "b"), (), known=("e", "f"))
    added = {name: Addition(values=((name, 0.0),), free=(unknown(name),)) for name in ("e", "f")}
    both = [Hypothesis(name, "physics", name, "", "", name, given) for name, given in added.items()]
    x = 0.5 * random.normal(size=problem.starts[-1])
    wider = with_hypotheses(problem, both)
    at = carry(x, problem, wider)
    order = [unknown.name for unknown in wider.unknowns]
    rows = np.vstack([slopes for one in wider.linearise(at) for slopes in one.jacobian.values()])
    residual = np.concatenate([left for one in wider.linearise(at) for left in one.residual.values()])
    rho, slope = wider.prior(at)
    slope[[order.index("e"), order.index("f")]] = 1.0  # an amplitude's prior is normal

    def taken_off(columns):
        normal = rows[:, columns].T @ rows[:, columns] + np.diag(slope[columns] ** 2)
        gradient = rows[:, columns].T @ residual + (slope * rho)[columns]
        return 0.5 * gradient @ np.linalg.solve(normal, gradient)

    without = [order.index("a"), order.index("b")]
    (pair,) = screen(problem, x, both).pairs
    assert pair.gain == pytest.approx(taken_off([0, 1, 2, 3]) - taken_off(without), rel=1e-6, abs=1e-6)


def slowly(problem, rho, gap):
    """The problem with noise of correlation ρ from one sample to the next, and one instant passed over."""
    samples = []
    for sample in problem.samples:
        (seen,) = sample.observed
        sensor = Sensor(CHANNEL, 1.0, 0.0, correlation=rho, step_s=0.02)
        rows = np.arange(len(seen.values)) + (np.arange(len(seen.values)) >= gap)
        recording = SimpleNamespace(time_s=0.02 * np.arange(rows[-1] + 1))
        answers = {name: np.insert(row, gap, 0.0) for name, row in sample.prepared.items()}
        observed = (replace(seen, sensor=sensor, rows=rows),)
        samples.append(replace(sample, recording=recording, prepared=answers, observed=observed))
    return problem.over(samples)


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 0.9), st.integers(1, 3))
def test_slow_noise_is_not_taken_for_many_samples(seed, rho, gap):
    problem, x = drawn(seed, 3, 1.0, COMMON)
    slow = slowly(problem, rho, gap)

    def density(problem, x, which):
        rho_, slope = problem.prior(x)
        slope[len(SHARED) : len(problem.unknowns)] = 1.0
        residual, rows, noise = [], [], []
        for k, run in enumerate(problem.linearise(x)):
            if k in which:
                wide = np.zeros((len(run.residual[CHANNEL]), len(x)))
                wide[:, problem.columns(k)] = run.jacobian[CHANNEL]
                at = problem.samples[k].observed[0].rows
                noise.append(rho ** np.abs(at[:, None] - at))
                residual.append(run.residual[CHANNEL])
                rows.append(wide)
        A = np.concatenate(rows)
        off = np.concatenate(residual) - A @ (rho_ / slope)
        return multivariate_normal.logpdf(off, None, block_diag(*noise) + (A / slope**2) @ A.T)

    def given_others(problem, x):
        everyone = set(range(3))
        whole = density(problem, x, everyone)
        return sum(whole - density(problem, x, everyone - {left}) for left in everyone)

    want = given_others(*with_effect(slow, x, COMMON)) - given_others(slow, x)
    assert loo_log_score(slow, x, [COMMON]) == pytest.approx(want, rel=1e-6, abs=1e-6)

"""A recording held out is judged where its own unknowns explain it best, however its residuals bend."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forklift.estimation.judgement import settled
from forklift.estimation.least_squares import Linearised


@dataclass(frozen=True)
class Alone:
    """A recording with one unknown of its own."""

    free: np.ndarray


@dataclass(frozen=True)
class Bent:
    """Recordings whose residuals bend: a straight step from afar ends beyond the place that it seeks, and one
    from there back on this side."""

    truth: np.ndarray
    """(recordings,) the unknown of each that explains it."""
    steep: float

    unknowns = ()

    @property
    def samples(self):
        return [Alone(np.zeros(1, int)) for _ in self.truth]

    @property
    def starts(self):
        return list(range(len(self.truth) + 1))

    def own(self, x, k):
        return x[k : k + 1]

    def bounds(self):
        return np.full(len(self.truth), -np.inf), np.full(len(self.truth), np.inf)

    def residuals(self, x):
        return [{"signal": 100.0 * np.arctan(self.steep * off)[None]} for off in x - self.truth]

    def linearise(self, x):
        def slope(off):
            return np.array([[100.0 * self.steep / (1.0 + (self.steep * off) ** 2)]])

        runs = zip(self.residuals(x), x - self.truth, strict=True)
        return [Linearised(said, {"signal": slope(off)}, {}, {}) for said, off in runs]


def test_steps_that_would_go_to_and_fro_end_where_the_recording_is_explained():
    problem = Bent(np.array([0.0, 1.35, -1.35]), 1.0)
    found = settled(problem, np.zeros(0), far=0.3, moves=4)
    assert found == pytest.approx(problem.truth, abs=0.02)


@given(st.lists(st.floats(-4.0, 4.0), min_size=1, max_size=4), st.floats(0.1, 1.5))
def test_no_recording_ends_further_off_than_it_began(truth, steep):
    problem = Bent(np.array(truth), steep)
    found = settled(problem, np.zeros(0), far=0.3, moves=4)
    assert np.all(np.abs(found - problem.truth) <= np.maximum(np.abs(problem.truth), 0.3) + 1e-9)

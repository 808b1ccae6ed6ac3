"""A recording held out is judged where its own unknowns explain it best, however its residuals bend."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forklift import ForkliftError
from forklift.fitting.problem import Linearised
from forklift.fitting.residuals import ChannelResidual, settled
from forklift.recordings.noise import Sensor


@dataclass(frozen=True)
class Alone:
    """A recording with one unknown of its own."""

    truth: float
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
        return [Alone(truth, np.zeros(1, int)) for truth in self.truth]

    def over(self, samples):
        return replace(self, truth=np.array([one.truth for one in samples]))

    @property
    def starts(self):
        return list(range(len(self.truth) + 1))

    def at(self, theta):
        return np.zeros(len(self.truth))

    def nuisance(self, x, k):
        return x[k : k + 1]

    def with_fixed(self, x, amplitudes, *, conditions):
        assert conditions, "what recordings have of their own is sought"
        return self, x  # there is nothing that they share

    def bounds(self):
        return np.full(len(self.truth), -np.inf), np.full(len(self.truth), np.inf)

    def residuals(self, x):
        return [100.0 * np.arctan(self.steep * off)[None] for off in x - self.truth]

    def linearise(self, x):
        def slope(off):
            return np.array([[100.0 * self.steep / (1.0 + (self.steep * off) ** 2)]])

        runs = zip(self.residuals(x), x - self.truth, strict=True)
        return [Linearised({"signal": left}, {"signal": slope(off)}, {}, {}) for left, off in runs]


def test_steps_that_would_go_to_and_fro_end_where_the_recording_is_explained():
    problem = Bent(np.array([0.0, 1.35, -1.35]), 1.0)
    found = settled(problem, np.zeros(0), far=0.3, moves=4)
    assert found == pytest.approx(problem.truth, abs=0.02)


class Swinging(Bent):
    """Recordings of a machine that swings up by itself: its slopes lead to where nothing can be simulated."""

    def residuals(self, x):
        if np.any(np.abs(x) > 20.0):
            raise ForkliftError("argument-invalid", "no such load can be simulated")
        return super().residuals(x)

    def linearise(self, x):
        return [
            Linearised({"signal": np.array([1e60])}, {"signal": np.array([[self.steep]])}, {}, {}) for _ in x
        ]


@pytest.mark.parametrize("slope", [1.0, 1e7, 1e9, 1e160, 1e200])
def test_a_recording_stays_where_no_step_leads_anywhere(slope):
    problem = Swinging(np.array([0.5, -0.5]), slope)
    found = settled(problem, np.zeros(0), far=0.3, moves=4)
    assert slope < 1e8 or (found == 0.0).all()


@given(st.lists(st.floats(-4.0, 4.0), min_size=1, max_size=4), st.floats(0.1, 1.5))
def test_no_recording_ends_further_off_than_it_began(truth, steep):
    problem = Bent(np.array(truth), steep)
    found = settled(problem, np.zeros(0), far=0.3, moves=4)
    assert np.all(np.abs(found - problem.truth) <= np.maximum(np.abs(problem.truth), 0.3) + 1e-9)


def drawn(correlation, size):
    """4000 channels of noise, its deviation `size` times the sensor's, which of slow noise is known to a
    tenth of its square, judged."""
    random = np.random.default_rng(7)
    noise = random.standard_normal((4000, 600))
    for k in range(1, 600):
        noise[:, k] = correlation * noise[:, k - 1] + np.sqrt(1.0 - correlation**2) * noise[:, k]
    sensor = Sensor("pressure", 1.0, 0.0, correlation, 0.1 if correlation else 0.0)
    off = size * np.sqrt(1.0 + sensor.unsure * random.standard_normal(4000))
    return [
        ChannelResidual(
            "", "validate", "", "pressure", 600, float(np.mean(left**2)), None, np.arange(600), left,
            sensor.independent, sensor.unsure,
        )
        for left in off[:, None] * noise
    ]  # fmt: skip


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.8187, 0.9])
def test_noise_alone_however_slow_is_explained(correlation):
    assert np.mean([not one.explained for one in drawn(correlation, 1.0)]) < 2e-3


@pytest.mark.parametrize(("correlation", "size"), [(0.0, 1.25), (0.5, 1.5), (0.8187, 1.75)])
def test_more_than_the_noise_is_not(correlation, size):
    assert np.mean([one.explained for one in drawn(correlation, size)]) < 0.01

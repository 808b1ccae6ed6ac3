"""No interval is narrower than what the clock of the recordings leaves open, and none leaves its bounds."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from forklift.fitting.criteria import CLOCK
from forklift.fitting.intervals import QUANTILE, ends
from forklift.plant.parameter import Unknown

SOME = st.floats(-3.0, 3.0)
SURE = st.floats(0.0, 2.0)


def unknown(scale: str, reach: float = np.inf) -> Unknown:
    """2 s, within `reach` deviations of it."""
    least, most = (2.0 - 0.5 * reach, 2.0 + 0.5 * reach) if np.isfinite(reach) else (-np.inf, np.inf)
    return Unknown(("p",), "s", scale, (2.0,), 0.5, -reach, reach, least=(least,), most=(most,))


@given(SOME, SURE, st.sampled_from(["linear", "log"]))
def test_an_interval_holds_both_the_noise_and_the_clock(theta: float, deviation: float, scale: str) -> None:
    one = unknown(scale)
    value = one.values(theta)[0]
    lower, upper = ends(one, theta, deviation)
    by_noise = sorted(one.values(theta + sign * QUANTILE * deviation)[0] for sign in (-1.0, 1.0))
    slack = 1e-12 * abs(value)
    assert lower <= by_noise[0] + slack
    assert upper >= by_noise[1] - slack
    assert min(value - lower, upper - value) >= CLOCK * abs(value) - slack
    assert upper - lower <= by_noise[1] - by_noise[0] + 2.0 * CLOCK * abs(value) + slack


@given(SOME, SURE)
def test_no_interval_leaves_its_bounds(theta: float, deviation: float) -> None:
    one = unknown("linear", 1.0)
    lower, upper = ends(one, float(np.clip(theta, -1.0, 1.0)), deviation)
    assert one.values(-1.0)[0] <= lower <= upper <= one.values(1.0)[0]

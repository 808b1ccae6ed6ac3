"""Of which variable an unknown input is a function."""

from __future__ import annotations

import numpy as np

from forklift.diagnosis.dependence import dependences
from forklift.diagnosis.locate import UnknownInput


def test_a_variable_that_not_all_recordings_have_is_none():
    times = np.linspace(0.0, 1.0, 50)
    values = (np.sin(times), np.cos(times))
    found = UnknownInput("a", 1.0, 1.0, 1.0, (times, times), values, (np.ones(50), np.ones(50)))
    tells = [{"x": values[0], "warm": times}, {"x": values[1]}]
    assert [one.variable for one in dependences(found, tells)] == ["x"]

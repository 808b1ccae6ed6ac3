"""A truth so stiff that it chatters is drawn smaller, and no other truth is."""

from __future__ import annotations

import numpy as np
import pytest

from forklift.ensemble.proof import amplitude
from forklift.ensemble.proof.amplitude import GRID, found_for, most
from forklift.ensemble.proof.draw import draw
from forklift.ensemble.proof.truth import run
from forklift.ensemble.proof.truth.truck import scattered

NAME, HUGE = "quadratic_drag", 1e9
GIVEN = draw(12, 0)
TRUCKS = scattered(np.random.default_rng(1))


def conditions() -> list[run.Condition]:
    command = np.zeros((2, 60))
    command[:, 10:] = 0.7
    return [run.Condition(command, 500.0, 30.0) for _ in GIVEN.plans]


def found(wanted: float = HUGE) -> tuple[float, float]:
    """Amplitude and size of a law whose size is wanted."""
    _, top, size = found_for(
        GIVEN, NAME, GIVEN.lift, wanted, TRUCKS, conditions(), np.random.default_rng(2), run.TICK_S
    )
    return top, size


def test_a_run_of_too_many_steps_is_given_up(monkeypatch):
    monkeypatch.setattr(run, "MOST_STEPS", 0.5)
    with pytest.raises(FloatingPointError, match="more than 29 steps"):
        run.simulate(TRUCKS, (), conditions()[:1])


def test_the_amplitude_ends_below_what_chatters(monkeypatch):
    whole, size = found()
    assert whole == pytest.approx(most(NAME))
    simulate, asked = run.simulate, []

    def chatters(trucks, laws, given, *rest):
        """With more than half of the largest amplitude."""
        asked.append(len(given))
        largest = max((float(np.max(value)) for one in given for value in one.values.values()), default=0.0)
        if largest > 0.5 * most(NAME):
            raise FloatingPointError("chatters")
        return simulate(trucks, laws, given, *rest)

    monkeypatch.setattr(amplitude.run, "simulate", chatters)
    less, smaller = found()
    assert less == pytest.approx(GRID[-2] * most(NAME))
    assert smaller < size
    assert len(asked) == 3  # twice for the size, once with all recordings


def test_what_chatters_with_any_amplitude_is_no_truth(monkeypatch):
    def chatters(*_):
        raise FloatingPointError("chatters")

    monkeypatch.setattr(amplitude.run, "simulate", chatters)
    with pytest.raises(FloatingPointError):
        found()


def test_the_amplitude_ends_below_what_chatters_in_a_whole_recording(monkeypatch):
    """The size is found on the beginnings; what is recorded goes on from there."""
    simulate, whole = run.simulate, []

    def chatters(trucks, laws, given, *rest):
        if len(given) == len(GIVEN.plans):
            whole.append(float(np.max(next(iter(laws[-1].values.values())))))
            if whole[-1] > 0.5 * most(NAME):
                raise FloatingPointError("chatters")
        return simulate(trucks, laws, given, *rest)

    monkeypatch.setattr(amplitude.run, "simulate", chatters)
    less, _ = found()
    assert less == pytest.approx(GRID[-2] * most(NAME))
    assert whole == pytest.approx([most(NAME), less])


def test_a_truck_that_runs_away_is_none(monkeypatch):
    monkeypatch.setattr(run, "FASTEST_M_S", 0.05)
    with pytest.raises(FloatingPointError, match=r"moves at 0\.05 m/s"):
        run.simulate(TRUCKS, (), conditions()[:1])

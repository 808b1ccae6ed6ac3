"""How far a diagnosis is: counts that hold together, and a time that is left."""

import pytest

from forklift.diagnosis.progress import FITTING, TRYING, Clock, Progress, remaining


def test_trials_are_counted_within_what_is_planned():
    told: list[Progress] = []
    gone = [0.0]
    clock = Clock(told.append, spared=lambda: gone[0])
    with clock.stage(FITTING):
        gone[0] += 10.0
    with clock.stage("locating the mismatch"):
        gone[0] += 5.0
    with clock.stage(TRYING):
        clock.plan(3)
        for name in "abc":
            clock.trial(f"trying {name}")
            gone[0] += 20.0
        clock.say("checking whether a is needed")
        clock.plan(2)
        clock.trial("trying d")
    with clock.stage("testing what is left over"):
        pass
    assert [(one.trial, one.trials) for one in told if one.what.startswith("trying ") and one.trial] == [
        (1, 3), (2, 3), (3, 3), (4, 5),
    ]  # fmt: skip
    left = {one.what: one.left_s for one in told}
    assert left[FITTING] is None
    # Each took 20 s; all other stages are taken for twice the fit, of which 5 s are gone.
    assert left["trying c"] == pytest.approx(20.0 + 15.0, abs=0.5)
    assert left["trying d"] == pytest.approx(2 * 20.0 + 15.0, abs=0.5)
    assert left["testing what is left over"] == pytest.approx(15.0, abs=0.5)
    assert told[-1].trial == 0
    assert clock.seconds[TRYING] == pytest.approx(60.0, abs=0.5)


def test_it_is_said_in_one_line():
    assert str(Progress(TRYING, "trying free.leakage", 2, 7, 44.0)) == (
        "Trying free.leakage (trial 2 of 7, about 40 s left)"
    )
    assert str(Progress(FITTING, FITTING)) == "Fitting the model"
    assert [remaining(seconds) for seconds in (None, 4.0, 14.0, 400.0)] == [
        "", "some seconds left", "about 10 s left", "about 7 min left",
    ]  # fmt: skip

"""Groups are left out to ask whether a law holds there; a condition off in each recording is none."""

from types import SimpleNamespace

import pytest

from forklift.diagnosis.group_validation import group_folds
from forklift.plant.protocol import Addition, Hypothesis


@pytest.mark.parametrize("names", [(), ("load_entered",), ("load_entered", "temperature_offset")])
def test_conditions_entered_wrongly_are_not_asked_of_another_group(names):
    doubted = Addition(widened=(("load_kg", 100.0),))
    final = SimpleNamespace(hypotheses=[Hypothesis(n, "parameter", n, "", "", None, doubted) for n in names])
    samples = [SimpleNamespace(recording=SimpleNamespace(group=group)) for group in ("free", "main")]
    refitter = SimpleNamespace(everyone=SimpleNamespace(samples=samples))
    assert group_folds(refitter, None, final) == ()

"""Physics that no catalogue holds, and that no channel shows: a curve is asked for over all recordings."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck
from forklift.diagnosis import criteria
from forklift.diagnosis.criteria import CONFIRMED
from forklift.diagnosis.engine import investigate, verdict
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.refitter import Refitter
from forklift.fitting.origin import given
from forklift.fitting.posing import pose

sys.path.insert(0, str(Path(__file__).parents[1] / "proofs"))
import cases
from reference.plant import campaign


def investigated(recordings):
    """What is found of them where the catalogue is empty."""
    start, each, _ = given(Truck.read("thesis"), recordings, candidates=())
    model, kept, findings = start.examined(each)
    sensors = model.sensors(kept)
    everyone = pose(model, kept, model.unknowns(findings.held), sensors)
    fitted = [one for one in everyone.samples if one.recording.role == "estimate"]
    refitter = Refitter(everyone.over(fitted), everyone, sensors)
    found = investigate(refitter, (), model, Clock())
    return found, verdict(found.selection, found.causes)


def test_a_faint_law_without_a_name_is_told_with_its_place_and_its_variable(tmp_path):
    made = next(one for one in cases.variations(["effects"]) if one.name == "effects-viscosity_law-2")
    law = cases.law_of("viscosity_law", made.case.lift, made.case.seed, 0.5 * cases.most("viscosity_law"))
    campaign.record(replace(made.case, laws=(law,)), tmp_path / "campaign")
    found, said = investigated(Campaign.read(tmp_path / "campaign"))
    assert found.selection.baseline.complete
    assert said == "unknown-effect"
    (cause,) = found.causes
    assert cause.hypothesis.where == made.case.lift
    assert cause.hypothesis.equation == "viscosity"
    assert cause.hypothesis.over == "the oil temperature in the tank"
    assert found.selection.final.squares < found.selection.baseline.squares
    assert found.selection.final.loo_log_score > CONFIRMED


def test_a_complete_truck_offers_no_curve_that_counts():
    found, said = investigated(Campaign.read(CAMPAIGNS / "null"))
    assert said == "no-mismatch"
    assert found.causes == ()
    assert found.selection.unnamed == ()
    assert found.inputs  # it was asked


@pytest.mark.parametrize(
    ("kind", "amplitude", "bound"),
    [
        ("physics", "size", "ALARM_PHYSICS"),
        ("parameter", "size", "ALARM_PHYSICS"),
        ("parameter", None, "ALARM_CONDITION"),
        ("sensor", "size", "ALARM_SENSOR"),
        ("unknown", None, "ALARM_CURVE"),
    ],
)
def test_every_kind_has_an_alarm_and_a_bound_that_is_moved_moves_it(monkeypatch, kind, amplitude, bound):
    one = SimpleNamespace(kind=kind, amplitude=amplitude)
    assert 0.0 < criteria.alarm(one) < float("inf")
    monkeypatch.setattr(criteria, bound, 7.0)
    assert criteria.alarm(one) == 7.0

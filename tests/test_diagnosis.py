"""What the simulated campaigns conceal is found, named, and closes the gap; where nothing is, nothing."""

import html
import json
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from campaigns import CAMPAIGNS
from diagnosed import diagnosed
from forklift import Campaign, Truck
from forklift.diagnosis.criteria import ALARM_PHYSICS
from forklift.diagnosis.selection import alarming
from forklift.fitting.metrics import nrmse
from forklift.fitting.residuals import AT_NOISE

PROOFS = Path(__file__).parents[1] / "proofs"
CONCEALED = {
    "thermfric": ("free", "friction", "friction_temperature", "free.friction_temperature.rate", 0.018),
    "leak": ("main", "cylinder-pressure", "leakage", "main.leakage.coefficient", 1.5e-12),
}


def test_a_complete_truck_raises_no_alarm():
    found = diagnosed("null")
    assert (found.verdict, found.causes, found.location) == ("no-mismatch", (), None)
    assert found.final.worst.mean_square <= AT_NOISE
    assert found.sentence.startswith("No mismatch")
    promised = [one.gain for one in found.screening.singles if one.hypotheses[0].kind == "physics"]
    assert max(promised) < 0.5 * ALARM_PHYSICS


@pytest.mark.parametrize("name", ["null", *CONCEALED])
def test_the_proof_of_the_simulated_campaigns_says_so_too(name, monkeypatch):
    proof = runpy.run_path(str(PROOFS / "campaigns.py"))
    row = proof["row"]
    monkeypatch.setitem(row.__globals__, "diagnose", lambda *_: diagnosed(name))
    told, missed = row(name)
    assert told[0] == name
    assert set(missed) <= {"time"}  # how long it takes is no test of anything on a busy machine


@pytest.mark.parametrize("name", CONCEALED)
def test_what_is_concealed_is_named_located_and_measured(name):
    lift, equation, cause, parameter, truth = CONCEALED[name]
    found = diagnosed(name)
    told = found.to_dict()
    assert told["verdict"] == "missing-physics"
    assert (told["location"]["lift"], told["location"]["equation"]) == (lift, equation)
    assert [one["id"] for one in told["causes"]] == [cause]
    first = told["causes"][0]
    assert first["credibility"] > 0.9
    assert first["form"] == "complete"
    row = first["parameters"][0]
    assert row["name"] == parameter
    assert row["lower"] <= truth <= row["upper"]
    assert row["value"] == pytest.approx(truth, rel=0.05)


@pytest.mark.parametrize("name", CONCEALED)
def test_the_unknown_input_alone_points_to_the_equation(name):
    """Without any hypothesis: the place comes first among all ports and sensors."""
    lift, equation, *_ = CONCEALED[name]
    places = {"friction": ("friction", "viscous_friction"), "cylinder-pressure": ("cylinder_flow",)}[equation]
    assert diagnosed(name).inputs[0].port in [f"{lift}.{place}" for place in places]


def test_friction_that_falls_with_temperature_is_seen_to_be_a_function_of_temperature():
    first = diagnosed("thermfric").dependences[0]
    assert first.variable == "oil_temperature"
    assert first.explained > 0.8
    assert first.curve[0] > 0.0 > first.curve[-1]


@pytest.mark.parametrize("name", CONCEALED)
def test_the_gap_closes_on_recordings_held_out(name):
    found = diagnosed(name)
    assert found.baseline.worst.mean_square > 2.0 * AT_NOISE
    assert found.final.worst.mean_square <= AT_NOISE
    assert found.gap_closed >= 0.95
    summary = found.to_dict()["fit_summary"]["validate"]
    assert 0.0 < summary["gain_lower"] <= summary["gain"] <= summary["gain_upper"]


def test_the_folder_holds_the_schema_and_a_truck_that_every_command_takes(tmp_path):
    found = diagnosed("thermfric")
    out = found.write(tmp_path / "found")
    told = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert told == json.loads(json.dumps(found.to_dict()))
    assert {
        "schema", "campaign", "verdict", "location", "causes", "untestable", "not_separable",
        "next_recording", "fit", "fit_summary", "runtime_s",
    } <= set(told)  # fmt: skip
    assert told["sentence"] in html.unescape((out / "report.html").read_text(encoding="utf-8"))
    truck = Truck.read(out / "truck.toml")
    assert truck.effects == ("free.friction_temperature",)
    campaign = Campaign.read(CAMPAIGNS / "thermfric")
    for row in told["fit"]:  # the number on the page is that of the curve in predictions/final
        if row["channel"] in ("position_free_m", "pressure_free_pa"):
            curve = pl.read_csv(out / "predictions" / "final" / row["file"])[row["channel"]].to_numpy()
            measured = campaign[row["file"]][row["channel"]]
            assert row["nrmse_after"] == pytest.approx(nrmse(measured, curve), abs=1e-3)
    for model in ("baseline", "final"):
        files = sorted(path.name for path in (out / "predictions" / model).iterdir())
        assert files == sorted(recording.file for recording in campaign.recordings)
    found.write(out)  # over itself


def test_resampled_recordings_decide_and_not_samples():
    from forklift.diagnosis.rules import credibility

    class Tried:
        """A refit as far as credibility goes."""

        foretold = None

        def __init__(self, squares):
            self.squares = squares

        def by_recording(self):
            return {f"r{k}": square for k, square in enumerate(self.squares)}

    even = credibility([Tried([1.0, 0.0, 1.0, 0.0]), Tried([0.0, 1.0, 0.0, 1.0])])
    assert 0.2 < even[0] < 0.8
    assert credibility([Tried([1.0, 1.0, 1.0, 1.0]), Tried([1.1, 1.1, 1.1, 1.1])]) == [1.0, 0.0]
    assert np.isclose(sum(even), 1.0)


def test_where_every_channel_is_explained_only_what_promises_much_by_itself_is_asked_for():
    """A sensor's chance promise is not tried because an effect's is loud."""
    screening = diagnosed("null").screening
    effect = next(one for one in screening.singles if one.hypotheses[0].kind == "physics")
    sensor = next(one for one in screening.singles if one.hypotheses[0].kind == "sensor")
    assert alarming(screening).singles == ()
    loud = replace(screening, singles=(replace(sensor, gain=24.0), replace(effect, gain=20.0)))
    assert [one.hypotheses[0] for one in alarming(loud).singles] == [effect.hypotheses[0]]

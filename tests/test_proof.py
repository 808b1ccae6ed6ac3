"""The proof draws, seals, resumes and scores as it says."""

from __future__ import annotations

import json
import os
import pickle
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forklift import ForkliftError, diagnose
from forklift.ensemble.proof import bounds, kinds, prove, seal, sensitivity
from forklift.ensemble.proof import open as opened
from forklift.ensemble.proof.apart import conceal_apart
from forklift.ensemble.proof.conceal import Made, conceal
from forklift.ensemble.proof.draw import RECORDINGS, draw, kind_of
from forklift.ensemble.proof.imitation import HIDDEN, left_of_fault
from forklift.ensemble.proof.judge import intervals, judged, removed
from forklift.ensemble.proof.processes import Processes
from forklift.ensemble.proof.random import DEVELOPMENT
from forklift.ensemble.proof.score import reliability, score, share
from forklift.ensemble.proof.truth import run, sensors
from forklift.ensemble.proof.truth.truck import scattered
from forklift.report.of_proof import proof_page, proof_text

# What is drawn


def test_a_campaign_is_a_function_of_seed_and_number_alone():
    assert draw(7, 11) == draw(7, 11)
    assert draw(7, 11) != draw(8, 11)
    assert draw(7, 11).plans != draw(7, 12).plans


def test_twenty_in_a_row_have_the_shares_that_are_told():
    counts = Counter(kind_of(3, number) for number in range(40))
    assert counts == Counter(kinds.DECK * 2)
    assert counts["complete"] == 10
    assert counts["stranger"] == 8
    assert counts["two"] == 4


def test_campaigns_are_as_uneven_as_told_and_can_be_judged():
    drawn = [draw(5, number) for number in range(120)]
    for one in drawn:
        assert RECORDINGS[0] <= len(one.plans) <= RECORDINGS[1]
        assert {plan.role for plan in one.plans} == {"estimate", "validate"}
        assert len({plan.file for plan in one.plans}) == len(one.plans)
        assert all(abs(plan.load_kg / plan.entered_kg - 1.0) <= 0.01 for plan in one.plans if plan.entered_kg)
        assert all(plan.has_temperature or one.entered_degc is not None for plan in one.plans)
        assert abs(one.nuisances.tick - 1.0) <= 1e-3
    assert any(not one.nuisances.height for one in drawn)
    assert any(one.entered_degc is not None for one in drawn)
    assert {one.nuisances.spoilt for one in drawn} == {"", "gap", "short", "stuck"}
    assert {plan.kind for one in drawn for plan in one.plans} == {"prms", "stairs", "driver"}
    assert {name for one in drawn for name in one.concealed} >= set(kinds.CONDITIONS)


def test_every_concealed_thing_has_right_answers():
    for kind in kinds.KINDS:
        for name in kinds.of_kind(kind):
            right = kinds.right(name)
            assert right.equations
            assert right.verdicts
            assert bool(right.names) != (right.kind == "stranger")


def test_only_a_kind_or_a_cause_is_chosen_and_an_unknown_word_is_refused():
    numbers = list(prove.chosen(3, 40, "complete"))
    assert len(numbers) == 10
    assert set(prove.chosen(3, 40, "leakage")) <= set(range(40))
    with pytest.raises(ForkliftError, match="no kind"):
        list(prove.chosen(3, 40, "leekage"))


# What is recorded


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A campaign of two short recordings with a pressure that reads too much, and its answer."""
    folder = tmp_path_factory.mktemp("small") / "campaign"
    return folder, *recorded(folder)


def recorded(folder):
    given = draw(5, 0)
    plans = tuple(replace(plan, ticks=160, lift="free") for plan in given.plans[:2])
    spoilt = replace(given.nuisances, spoilt="gap", spoilt_in=1, spoilt_s=1.0, height=False)
    given = replace(
        given,
        kind="sensor",
        concealed=("pressure_gain",),
        sizes=(1.0,),
        lift="free",
        plans=plans,
        nuisances=spoilt,
    )
    return given, conceal(given, folder)


def test_another_process_makes_the_same_campaign_to_the_byte(small, tmp_path):
    """Its answer, its truth and its folder."""
    folder, given, made = small
    apart = conceal_apart(given, tmp_path / "campaign", judge_hidden=True)
    assert apart.answer == made.answer
    assert {file: columns.keys() for file, columns in apart.truth.items()} == {
        file: columns.keys() for file, columns in made.truth.items()
    }
    for file, columns in made.truth.items():
        for name, values in columns.items():
            assert np.array_equal(apart.truth[file][name], values)
    assert {path.name: path.read_bytes() for path in (tmp_path / "campaign").iterdir()} == {
        path.name: path.read_bytes() for path in folder.iterdir()
    }


def test_why_another_process_made_no_campaign_is_told(small, tmp_path):
    _, given, _ = small
    (tmp_path / "campaign").write_text("a file in the folder's place")
    with pytest.raises(RuntimeError, match=r"campaign 0 of 5 was not made: [\s\S]*FileExistsError"):
        conceal_apart(given, tmp_path / "campaign", judge_hidden=False)


@pytest.mark.parametrize("off_by", ["oil_temperature_degc", "pressure_free_pa"])
def test_a_fault_that_another_truck_imitates_is_hidden(small, off_by):
    """Viscosity is exponential in temperature: oil that is warmer throughout is thinner oil."""
    _, given, _ = small
    trucks, command = scattered(1), np.zeros((2, 160))
    command[0, 20:] = 0.6
    true = [run.Condition(command, load, degc) for load, degc in ((0.0, 20.0), (500.0, 45.0))]
    offset = {"oil_temperature_degc": 5.0, "pressure_free_pa": 3e5}[off_by]
    entered = [
        replace(one, temperature_degc=one.temperature_degc + offset) if "oil" in off_by else one
        for one in true
    ]
    seen = sensors.Sensors(offsets=((off_by, offset),))
    left = left_of_fault(given, (), entered, true, seen, trucks, run.TICK_S)
    assert (left < HIDDEN) is (off_by == "oil_temperature_degc")


def test_the_folder_holds_recordings_and_not_a_word_of_the_answer(small):
    folder, given, made = small
    assert {path.name for path in folder.iterdir()} == {"campaign.toml", *(plan.file for plan in given.plans)}
    text = "".join(path.read_text() for path in folder.iterdir())
    for word in ("pressure_gain", "stranger", "sensor-fault", "seed"):
        assert word not in text
    assert "fork_height_m" not in text
    columns = np.genfromtxt(folder / given.plans[1].file, delimiter=",", names=True)
    assert np.isnan(columns["pressure_free_pa"]).sum() == 30
    (cause,) = made.answer["causes"]
    there = np.isfinite(columns["pressure_free_pa"])
    true = made.truth[given.plans[1].file]["pressure_free_pa"]
    ratio = np.mean(columns["pressure_free_pa"][there]) / np.mean(true[there])
    assert ratio == pytest.approx(cause["values"]["gain"], abs=0.01)
    assert columns["time_s"][1] == 0.02  # what the clock says, whatever it does


def test_the_same_campaign_comes_out_to_the_byte(small, tmp_path):
    folder, _, made = small
    _, again = recorded(tmp_path / "again")
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes()
    assert seal.packed(made.answer, {}) == seal.packed(again.answer, {})


# Sealing


ANSWER = {"kind": "effect", "causes": [{"id": "leakage"}]}
TRUTH = {"a.csv": {"velocity_free_m_s": np.arange(5.0)}}


def test_a_seal_opens_what_it_closed_and_no_other_seal_does():
    mine = seal.Seal()
    sealed = mine.close(ANSWER, TRUTH)
    answer, truth = mine.open(sealed)
    assert answer == ANSWER
    np.testing.assert_array_equal(truth["a.csv"]["velocity_free_m_s"], np.arange(5.0))
    assert b"leakage" not in sealed.box
    with pytest.raises(ForkliftError, match="sealed answer"):
        seal.Seal().open(sealed)
    with pytest.raises(TypeError):
        pickle.dumps(mine)
    assert mine.close(ANSWER, TRUTH).box != sealed.box  # salted: a guess cannot be checked against the hash


@pytest.mark.parametrize("place", [0, 40, 70, -1])
def test_a_tampered_answer_is_noticed(place):
    mine = seal.Seal()
    sealed = mine.close(ANSWER, TRUTH)
    box = bytearray(sealed.box)
    box[place] ^= 1
    with pytest.raises(ForkliftError) as raised:
        mine.open(seal.Sealed(bytes(box), sealed.commitment))
    assert raised.value.code == "seal-broken"
    other = mine.close({"kind": "complete", "causes": []}, TRUTH)  # a whole other answer, well sealed
    with pytest.raises(ForkliftError):
        mine.open(seal.Sealed(other.box, sealed.commitment))


def test_the_diagnosing_process_is_given_the_folder_and_cannot_read_the_answer(tmp_path, monkeypatch):
    """While it runs no file holds the answer or a key, nor does its environment; its name says nothing."""
    seen, keys = {}, []
    token_bytes = seal.secrets.token_bytes

    def noted(count):
        keys.append(token_bytes(count))
        return keys[-1]

    with monkeypatch.context() as patched:
        patched.setattr(seal.secrets, "token_bytes", noted)
        mine = seal.Seal()
    assert keys

    def spy(_, command, **given):
        seen["command"], seen["env"], seen["files"] = command, given["environment"], {}
        for root in (given["cwd"], tmp_path):
            for path in root.rglob("*"):
                if path.is_file():
                    seen["files"][path.name] = path.read_bytes()
        return 2, "refused"

    def made(given, folder, **_):
        folder.mkdir(parents=True)
        (folder / "campaign.toml").write_text("x")
        return Made(whole("leakage"), TRUTH)

    monkeypatch.setattr(prove, "conceal_apart", made)
    monkeypatch.setattr(Processes, "run", spy)
    monkeypatch.setattr(prove.baselines, "answers", lambda *_: {})
    (tmp_path / "sealed").mkdir()
    prove.one(draw(5, 3), mine, tmp_path, 1, False, 1.0, True, {}, Processes())
    assert "campaign.toml" in seen["files"]
    for content in seen["files"].values():
        assert b"leakage" not in content
        assert b"causes" not in content
        assert not any(key in content or key.hex().encode() in content for key in keys)
    for value in seen["env"].values():
        assert "leakage" not in value
        assert not any(key.hex() in value for key in keys)
    assert not any("leakage" in word or "00003" in word for word in seen["command"])


# Resuming


def stubbed(monkeypatch, stop_at=None):
    """Campaigns without simulation, answered by a stub that is right of every other."""
    calls = []

    def made(given, folder, **_):
        folder.mkdir(parents=True)
        return Made(whole("leakage") | {"number": given.number, "seed": given.seed}, TRUTH)

    def told(folder, found, *_):
        calls.append(folder)
        if stop_at is not None and len(calls) == stop_at:
            raise KeyboardInterrupt
        return said("leakage") | {"seconds": 1.0}

    monkeypatch.setattr(prove, "conceal_apart", made)
    monkeypatch.setattr(prove, "diagnosed", told)
    monkeypatch.setattr(prove.baselines, "answers", lambda *_: {
        name: dict(verdict_right=True, location_right=True, cause_right=True, mismatch=True)
        for name in prove.baselines.METHODS
    })  # fmt: skip
    return calls


def test_a_proof_that_was_broken_off_goes_on_and_scores_the_same(tmp_path, monkeypatch):
    stubbed(monkeypatch)
    whole_run = prove.prove(5, 6, tmp_path / "whole", jobs=2)
    stubbed(monkeypatch, stop_at=4)
    with pytest.raises(KeyboardInterrupt):
        prove.prove(5, 6, tmp_path / "broken")
    (tmp_path / "broken" / "results" / ".00004.json.99.tmp").write_text("{")  # what a kill leaves behind
    calls = stubbed(monkeypatch)
    resumed = prove.prove(5, 6, tmp_path / "broken")
    assert len(calls) == 3
    for one in (resumed, whole_run):
        del one.score["seconds"]["making a campaign"]  # by the clock, which is nothing that is scored
    assert resumed.score == whole_run.score
    assert resumed.score["label"] == "development"
    more = prove.prove(5, 8, tmp_path / "broken")
    assert [one["number"] for one in more.results] == list(range(8))
    page, text = proof_page(more), proof_text(more)
    assert "leakage" in page
    assert "development seed" in page
    assert "8 of 8" in text


def test_another_seed_or_a_folder_of_others_is_refused(tmp_path, monkeypatch):
    stubbed(monkeypatch)
    prove.prove(5, 1, tmp_path / "proof")
    with pytest.raises(ForkliftError, match="seed 5"):
        prove.prove(6, 1, tmp_path / "proof")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("x")
    with pytest.raises(ForkliftError, match="something else"):
        prove.prove(5, 1, tmp_path / "other")
    with pytest.raises(ForkliftError, match="campaigns is 0"):
        prove.prove(5, 0, tmp_path / "none")


def test_a_folder_is_one_calls_until_it_ends(tmp_path, monkeypatch):
    """A second call in the same folder would seal the campaigns that the first diagnoses anew."""
    stubbed(monkeypatch)
    out, diagnosed, refused = tmp_path / "proof", prove.diagnosed, []

    def meanwhile(*given):
        with pytest.raises(ForkliftError) as raised:
            prove.prove(5, 2, out)
        refused.append(raised.value)
        return diagnosed(*given)

    monkeypatch.setattr(prove, "diagnosed", meanwhile)
    prove.prove(5, 1, out)
    assert [one.code for one in refused] == ["folder-in-use"]
    assert str(out) in str(refused[0])
    stubbed(monkeypatch)
    assert len(prove.prove(5, 2, out).results) == 2


def test_bounds_are_never_moved_on_a_reporting_seed(tmp_path):
    with pytest.raises(ForkliftError, match="only ever moved"):
        sensitivity.sensitivity(DEVELOPMENT, 1, tmp_path)


def test_bounds_are_the_upper_case_numbers_and_reach_the_diagnosing_process(tmp_path, monkeypatch):
    (tmp_path / "made_up.py").write_text("ALARM = 1.5\nWORDS = 'x'\n_OWN = 2.0\nother = 3.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(bounds, "CRITERIA", "made_up")
    assert bounds.bounds() == {"ALARM": 1.5}
    code = (
        "import os, sys; import forklift.ensemble.proof.bounds as b; b.CRITERIA = 'made_up'; import runpy;"
        "sys.argv = ['x', '--version'];\n"
        "try: runpy.run_module('forklift.ensemble.proof.under_bounds', run_name='__main__')\n"
        "except SystemExit: pass\n"
        "import made_up; print(made_up.ALARM)"
    )
    given = os.environ | {bounds.VARIABLE: json.dumps({"ALARM": 0.75})}
    given["PYTHONPATH"] = os.pathsep.join([str(tmp_path), *sys.path])
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=given, check=True)
    assert ran.stdout.split()[-1] == "0.75"


# Open campaigns


def test_open_campaigns_are_scored_by_the_same_rules(tmp_path, monkeypatch):
    folder = tmp_path / "theirs"
    (folder / "00").mkdir(parents=True)
    (folder / "00" / "campaign.toml").write_text(
        'name = "x"\nsample_rate_hz = 50.0\n[[recording]]\nfile = "a.csv"\nlift = "free"\nload_kg = 0.0\n'
        'role = "validate"\n'
    )
    cause = {"id": "their_law", "kind": "shape", "where": "free", "names": ["leakage"]}
    cause |= {"equations": ["cylinder-pressure"], "verdicts": ["missing-physics"]}
    answers = {"campaigns": [{"folder": "00", "lift": "free", "causes": [cause]}]}
    (folder / "answers.json").write_text(json.dumps(answers))
    monkeypatch.setattr(opened, "diagnosed", lambda *_: said("leakage", form="uncertain") | {"seconds": 2.0})
    found = opened.score_open(folder, tmp_path / "scored")
    assert found.score["label"] == "open"
    assert found.results[0]["judged"]["all"]
    assert opened.score_open(folder, tmp_path / "scored").score == found.score
    assert opened.score_open(folder, tmp_path / "scored", only=" 00 ").score["campaigns"] == 1
    with pytest.raises(ForkliftError, match="no campaign 02"):
        opened.score_open(folder, tmp_path / "scored", only="00,02")
    (folder / "answers.json").write_text(json.dumps({"campaigns": []}))
    with pytest.raises(ForkliftError) as other:  # results of those answers say nothing of these
        opened.score_open(folder, tmp_path / "scored")
    assert other.value.code == "output-exists"
    answers["campaigns"][0]["folder"] = "01"
    (folder / "answers.json").write_text(json.dumps(answers))
    with pytest.raises(ForkliftError) as missing:
        opened.score_open(folder, tmp_path / "missing")
    assert missing.value.code == "answers-unreadable"
    (folder / "answers.json").write_text('{"campaigns": [{"folder": "00"}]}')
    with pytest.raises(ForkliftError, match="is not as"):
        opened.score_open(folder, tmp_path / "again")


def test_the_answers_of_the_eight_open_campaigns_are_whole():
    told = opened.read(Path(__file__).parents[1] / "proofs" / "second.json")
    assert [one["folder"] for one in told] == [f"{n:02d}" for n in range(8)]
    assert [len(one["causes"]) for one in told] == [2, 1, 1, 1, 0, 2, 1, 1]


# Scoring


def whole(*names, hidden=(), tolerated=(), lift="free"):
    causes = []
    for name in names:
        right = kinds.right(name)
        causes.append(
            {
                "id": name, "where": lift, "kind": right.kind, "names": list(right.names), "of": right.of,
                "equations": list(right.equations), "verdicts": list(right.verdicts),
                "refused": list(right.refused), "hidden": name in hidden, "size": 2.0,
                "values": {"coefficient": 1e-12},
            }
        )  # fmt: skip
    plan = {"file": "a.csv", "role": "validate", "lift": "free", "entered_kg": 0.0}
    kind = "complete" if not causes else causes[0]["kind"] if len(causes) == 1 else "two"
    return {
        "number": 0, "kind": kind, "lift": lift, "causes": causes, "tolerated": list(tolerated),
        "recordings": [plan], "entered_degc": None,
    }  # fmt: skip


def one_cause(name, form="complete", where="free", credibility=0.95, equation=None, tie=(), kind="physics"):
    equation = equation or kinds.EQUATIONS.get(name, ("friction",))[0]
    return {
        "id": name, "kind": kind, "name": name, "where": where, "equation": equation, "form": form,
        "credibility": credibility, "not_separable_from": list(tie), "rivals": [],
        "parameters": [{"name": f"{where}.{name}.coefficient", "lower": 9e-13, "upper": 1.1e-12}],
    }  # fmt: skip


def said(*names, verdict="missing-physics", **given):
    causes = [one if isinstance(one, dict) else one_cause(one, **given) for one in names]
    location = {"equation": causes[0]["equation"], "lift": causes[0]["where"]} if causes else None
    return {"verdict": verdict, "causes": causes, "location": location, "said": ""}


def test_the_right_answer_is_right_and_a_second_name_beside_it_is_not():
    assert judged(whole("leakage"), said("leakage"))["all"]
    more = judged(whole("leakage"), said("leakage", "valve_lag"))
    assert more["cause"]
    assert more["spurious"] == more["wrong_complete"] == ["valve_lag"]
    assert not more["all"]
    other = judged(whole("leakage"), said("friction_pressure"))
    assert not other["cause"]
    assert not other["location"]
    tie = said(one_cause("friction_pressure", tie=["free.leakage"]))
    assert judged(whole("leakage"), tie)["cause"]
    assert not judged(whole("leakage"), said("leakage", where="main"))["location"]


def test_of_two_both_must_be_told_but_a_hidden_one_need_not():
    both = whole("leakage", "valve_lag")
    assert not judged(both, said("leakage"))["cause"]
    assert judged(both, said("leakage", "valve_lag"))["all"]
    assert judged(whole("leakage", "valve_lag", hidden=["valve_lag"]), said("leakage"))["all"]
    alone = whole("leakage", hidden=["leakage"])
    nothing = said(verdict="no-mismatch")
    assert judged(alone, nothing)["all"]
    assert judged(alone, nothing)["false_alarm"] is None  # its name would be right as well
    assert judged(alone, said("leakage"))["all"]
    assert not judged(alone, said("valve_lag"))["all"]


def test_a_complete_truck_wants_no_alarm_and_a_stuck_pressure_may_be_told():
    assert judged(whole(), said(verdict="no-mismatch"))["all"]
    assert judged(whole(), said("leakage"))["false_alarm"]
    stuck = said("sensor_stuck", verdict="sensor-fault", equation="sensor", kind="sensor")
    assert judged(whole(tolerated=["sensor_stuck"]), stuck)["all"]
    assert judged(whole(), stuck)["false_alarm"]
    missing = {**stuck, "verdict": "unknown-effect"}  # beside it, something that has no cause
    assert judged(whole(tolerated=["sensor_stuck"]), missing)["false_alarm"]
    assert judged(whole(), {"verdict": "refused", "said": "x", "causes": []})["false_alarm"]
    both = whole("sensor_stuck", tolerated=["sensor_stuck"])  # concealed in one recording, spoilt in another
    twice = {**stuck, "causes": stuck["causes"] * 2}
    assert judged(both, twice)["all"]
    assert judged(both, stuck)["verdict"] is judged(both, stuck)["cause"] is False


def test_a_refusal_answers_nothing_that_was_asked():
    refusal = {"verdict": "refused", "said": "x", "causes": []}
    of_stranger = judged(whole("rail_waviness"), refusal)
    assert (of_stranger["unknown"], of_stranger["cause"], of_stranger["location"]) == (False, None, False)
    of_effect = judged(whole("leakage"), refusal)
    assert (of_effect["unknown"], of_effect["cause"], of_effect["false_alarm"]) == (None, False, None)


def test_a_stranger_wants_unknown_or_another_law_at_its_place_and_no_complete_name():
    stranger = whole("rail_waviness")
    unknown = said(one_cause("unknown", kind="unknown", equation="friction"), verdict="unknown-effect")
    assert judged(stranger, unknown)["all"]
    assert judged(stranger, said("friction_position", form="uncertain"))["unknown"]
    named = judged(stranger, said("friction_position"))
    assert not named["unknown"]
    assert named["wrong_complete"] == ["friction_position"]
    elsewhere = said(
        one_cause("unknown", kind="unknown", equation="valve-dynamics"), verdict="unknown-effect"
    )
    assert not judged(stranger, elsewhere)["unknown"]


def test_a_hidden_stranger_may_be_told_at_its_place_by_another_law():
    for hidden in ((), ["rail_waviness"]):
        stranger = whole("rail_waviness", hidden=hidden)
        assert judged(stranger, said("friction_position", form="uncertain"))["all"]
        assert not judged(stranger, said("friction_position"))["all"]
        assert not judged(stranger, said("leakage", form="uncertain"))["all"]
    assert judged(stranger, said(verdict="no-mismatch"))["all"]


def test_a_tie_of_places_is_no_location_but_holds_it():
    """As of causes: what a curve cannot be parted from stands beside it."""
    told = said(one_cause("unknown", kind="unknown", equation="compensator"), verdict="unknown-effect")
    stranger = whole("pressure_viscosity")
    for other, equation, where, right in (
        ("free.unknown", "viscosity", "free", True),
        ("free.unknown", "viscosity", "main", False),
        ("free.unknown", "friction", "free", False),
        ("free.leakage", "viscosity", "free", False),  # a name that could stand for it is none of its places
    ):
        row = {"cause": "free.unknown", "other": other, "equation": equation, "where": where, "share": 0.99}
        found = judged(stranger, {**told, "confounded": [row]})
        assert not found["location"]
        assert [found["place"], found["unknown"], found["all"]] == [right] * 3


def test_a_fault_may_be_refused_by_its_own_code_only():
    refused = {"verdict": "refused", "causes": [], "said": "... [height-contradicts-position]"}
    assert judged(whole("position_scale"), refused)["all"]
    assert not judged(whole("leakage"), refused)["all"]


def test_what_a_campaign_is_refused_with_is_told_by_its_code(tmp_path):
    campaign = Path(__file__).parent / "campaigns" / "null"
    folder = tmp_path / "campaign"
    shutil.copytree(campaign, folder)
    (folder / "campaign.toml").write_text("recording = 3\n")
    told = prove.diagnosed(folder, tmp_path / "result", None, 1, 600.0)
    with pytest.raises(ForkliftError) as refused:
        diagnose(folder, "thesis")
    assert told["verdict"] == "refused"
    assert told["said"].endswith(f"[{refused.value.code}]")


def test_intervals_are_of_effects_with_the_catalogues_law():
    ((name, value, lower, upper),) = intervals(whole("leakage"), said("leakage"))
    assert (name, value) == ("free.leakage.coefficient", 1e-12)
    assert lower < value < upper
    assert not intervals(whole("leakage"), said("leakage", form="uncertain"))


def test_the_share_removed_is_against_the_noise_free_truth():
    true = {"a.csv": {"velocity_free_m_s": np.zeros(100)}}
    before, after = ({"a.csv": {"velocity_free_m_s": np.full(100, off)}} for off in (0.1, 0.05))
    assert removed(whole("leakage"), true, before, after) == pytest.approx(0.75)
    assert removed(whole("leakage"), true, before, before) == pytest.approx(0.0)
    assert removed(whole("leakage"), true, true, after) is None  # there was nothing to remove


def test_rates_have_exact_intervals():
    assert share(0, 10)["upper"] == pytest.approx(0.3085, abs=1e-4)  # Clopper and Pearson (1934)
    assert share(10, 10)["lower"] == pytest.approx(0.6915, abs=1e-4)
    assert share(0, 0)["share"] is None


def test_the_score_counts_what_is_asked():
    def result(answer, told, number):
        return {
            "number": number, "answer": answer, "told": told, "judged": judged(answer, told),
            "intervals": intervals(answer, told), "removed": 0.9, "seconds": 10.0 * (number + 1),
            "baselines": {},
        }  # fmt: skip

    results = [
        result(whole("leakage"), said("leakage"), 0),
        result(whole("leakage"), said("valve_lag", credibility=0.6), 1),
        result(whole(), said(verdict="no-mismatch"), 2),
        result(whole(), said("leakage", credibility=0.4), 3),
        result(whole("silting"), said("valve_lag", form="uncertain"), 4),
    ]
    found = score(results)
    rates = found["rates"]
    assert (
        rates["cause, or a tie that holds it"]["right"],
        rates["cause, or a tie that holds it"]["of"],
    ) == (1, 2)
    assert (rates["false alarms"]["right"], rates["false alarms"]["of"]) == (1, 2)
    assert rates["false alarms that tell but a load within 1 %"]["right"] == 0
    assert (rates["unknown called unknown"]["right"], rates["unknown called unknown"]["of"]) == (1, 1)
    assert rates["intervals hold the truth"]["of"] == 1
    assert found["seconds"]["one lift"]["median"] == 30.0
    bins = {(one["from"], one["to"]): (one["right"], one["of"]) for one in reliability(results)}
    assert bins[0.9, 1.0] == (1, 2)
    assert bins[0.5, 0.7] == (0, 1)
    assert [one["by_another_law"] for one in reliability(results)][-1] == 1  # the stranger's place, uncertain
    assert {"concealed": "leakage", "told": "valve_lag", "count": 1} in found["confusion"]
    assert [(one["form"], one["right"], one["of"], one["by_another_law"]) for one in found["forms"]] == [
        ("complete", 1, 3, 0),
        ("uncertain", 0, 1, 1),
    ]

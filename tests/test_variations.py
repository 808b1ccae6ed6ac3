"""The proof by variations judges as it says: right answers, wrong ones, and those fixed as inseparable."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forklift import Campaign, Truck, _core, diagnose
from forklift.diagnosis.criteria import ALARM_PHYSICS, CLEARLY, CONFIRMED, SLIGHT
from forklift.diagnosis.screening import screen
from forklift.plant.forklift.effects import EFFECTS

PROOFS = Path(__file__).parents[1] / "proofs"
sys.path.insert(0, str(PROOFS))

import cases  # noqa: E402
import judging  # noqa: E402
import separability  # noqa: E402
import variations  # noqa: E402
from reference.plant import campaign  # noqa: E402


def cause(name, where="free", form="complete"):
    return {"id": name, "where": where, "form": form, "parameters": []}


def result(case="effects-leakage-2", *, answer, **truth):
    given = {
        "verdicts": ["missing-physics"],
        "causes": ["leakage"],
        "lift": "free",
        "equations": ["cylinder-pressure"],
        "form": "complete",
        "refused": [],
    }
    concealed = [{"law": "leakage", "asked": 2.0, "points": 2.0, "values": {"coefficient": 1e-12}}]
    return {
        "case": case,
        "lift": "free",
        "truth": given | truth,
        "concealed": concealed,
        "answer": {"verdict": "missing-physics", "causes": [], "said": "", **answer},
        "seconds": 1.0,
    }


def at(equation="cylinder-pressure", lift="free"):
    return {"equation": equation, "lift": lift}


RIGHT = {"location": at(), "causes": [cause("leakage")]}


@pytest.mark.parametrize(("before", "right"), [(1.2, True), (7.0, False)])
def test_of_a_law_that_hardly_shows_uncertain_is_right_too(before, right):
    told = {**RIGHT, "causes": [cause("leakage", form="uncertain")], "left_over": {"worst_before": before}}
    assert judging.judge(result(answer=told), {})["form"] is right


def test_equations_are_the_catalogues():
    for effect in EFFECTS:
        if not effect.general:
            assert cases.EQUATIONS[effect.id] == effect.equation


def test_every_effect_comes_at_three_amplitudes_and_names_do_not_repeat():
    made = cases.variations(["effects", "others", "traps", "null", "pairs", "complete", "warming"])
    names = [one.name for one in made]
    assert len(set(names)) == len(names)
    known = [effect.id for effect in EFFECTS if not effect.general]
    for name in known:
        assert sum(one.concealed[:1] == ((name, points),) for one in made for points in cases.POINTS) >= 3
    assert len([one for one in made if one.name.startswith("complete")]) == 50
    assert {one.case.lift for one in made} == {"free", "main", "both"}
    assert len({one.case.seed for one in made if one.name.startswith(("complete", "warming", "null"))}) == 76


def test_the_right_answer_is_right_and_a_rival_or_another_besides_is_not():
    assert judging.judge(result(answer=RIGHT), {})["right"]
    wrong = judging.judge(result(answer=RIGHT | {"causes": [cause("position_scale")]}), {})
    assert not wrong["cause"]
    assert not wrong["right"]
    more = judging.judge(result(answer=RIGHT | {"causes": [cause("leakage"), cause("valve_lag")]}), {})
    assert more["cause"]
    assert not more["alone"]
    assert not more["right"]
    uncertain = judging.judge(result(answer=RIGHT | {"causes": [cause("leakage", form="uncertain")]}), {})
    assert not uncertain["form"]
    other_lift = judging.judge(
        result(answer={"location": at(lift="main"), "causes": [cause("leakage", "main")]}), {}
    )
    assert not other_lift["lift"]
    assert not judging.judge(result(answer={"verdict": "no-mismatch", "location": None}), {})["right"]


def test_what_was_fixed_as_inseparable_or_hidden_counts():
    alike = {"laws": {"free/leakage/2": {"hidden": False, "alike": ["position_scale"]}}}
    answer = {
        "verdict": "sensor-fault",
        "location": at("sensor"),
        "causes": [cause("position_scale", "position_free_m")],
    }
    assert judging.judge(result(answer=answer), alike)["right"]
    assert not judging.judge(result(answer=answer), {})["right"]
    hidden = {"laws": {"free/leakage/2": {"hidden": True, "alike": []}}}
    nothing = result(answer={"verdict": "no-mismatch", "location": None})
    assert judging.judge(nothing, hidden)["right"]
    assert not judging.judge(result(answer=RIGHT), hidden)["right"]


def test_of_two_that_one_is_hidden_frees_from_finding_it_and_excuses_no_other_name():
    shown, not_shown = {"hidden": False, "alike": []}, {"hidden": True, "alike": list(cases.EQUATIONS)}
    known = {"laws": {"free/leakage/2": shown, "free/chain_elasticity/2": not_shown}}

    def judged(*named):
        answer = {"location": at(), "causes": [cause(name) for name in named]}
        given = result("pairs-x", answer=answer, causes=["leakage", "chain_elasticity"])
        given["concealed"] = [{**given["concealed"][0], "law": law} for law in given["truth"]["causes"]]
        return judging.judge(given, known)

    assert judged("leakage")["hidden"] == 1
    assert judged("leakage")["right"]
    assert judged("leakage", "chain_elasticity")["right"]
    assert not judged("chain_elasticity")["right"]
    assert not judged("leakage", "valve_lag")["right"]


def test_what_lies_between_the_lifts_has_none():
    alike = {"laws": {"free/hose_resistance/2": {"hidden": False, "alike": ["return_back_pressure"]}}}
    answer = {"location": at("tank", "both"), "causes": [cause("return_back_pressure", "")]}
    given = result(answer=answer, causes=["hose_resistance"], equations=["valve-flow"])
    given["concealed"][0]["law"] = "hose_resistance"
    assert judging.judge(given, alike)["right"]
    assert not judging.judge(given, {})["right"]


def test_another_shape_is_uncertain_or_unknown_at_the_right_place():
    other = dict(form="uncertain", verdicts=["missing-physics", "unknown-effect"])
    named = {"location": at(), "causes": [cause("leakage", form="uncertain")]}
    assert judging.judge(result(answer=named, **other), {})["right"]
    assert not judging.judge(result(answer=RIGHT, **other), {})["right"]
    unknown = {"verdict": "unknown-effect", "location": at()}
    assert judging.judge(result(answer=unknown, **other), {})["right"]
    elsewhere = {"verdict": "unknown-effect", "location": at("friction")}
    assert not judging.judge(result(answer=elsewhere, **other), {})["right"]


def test_complete_trucks_and_refusals():
    truth = dict(verdicts=["no-mismatch"], causes=[], lift="", equations=[], form="")
    assert judging.judge(result(answer={"verdict": "no-mismatch", "location": None}, **truth), {})["right"]
    assert not judging.judge(result(answer=RIGHT, **truth), {})["right"]
    refused = {"verdict": "refused", "said": "command-shifted: ..."}
    assert not judging.judge(result(answer=refused), {})["right"]
    assert judging.judge(result(answer=refused, refused=["command-shifted"]), {})["right"]


def test_the_table_has_a_line_for_each_case_and_totals():
    text = judging.table([result(answer=RIGHT), result(answer=RIGHT | {"causes": []})], {})
    assert text.count("effects-leakage-2") == 2
    assert "| effects | 2 | 2 | 2 | 2 | 1 | 1 | 0 | 0 | 0 |" in text


def test_the_table_counts_the_intervals_that_hold_the_truth():
    def told(lower, upper):
        ends = {"name": "free.leakage.coefficient", "lower": lower, "upper": upper}
        return result(answer=RIGHT | {"causes": [cause("leakage") | {"parameters": [ends]}]})

    text = judging.table([told(9e-13, 1.1e-12), told(1.1e-12, 1.2e-12), result(answer=RIGHT)], {})
    assert "1e-12 in 9e-13 … 1.1e-12" in text
    assert text.splitlines()[-1].endswith("| 3 | 0 | 2 | 1 |")


def test_an_amplitude_costs_what_is_asked():
    law, amplitude = "valve_lag", None
    case = cases.campaign.Case("", "free", 5)
    amplitude, points = cases.amplitude_for(2.0, law, case)
    assert points == 2.0
    planned = [p for p in cases.campaign.plans("free") if p.file.startswith("free_prms1_0kg_20c")]
    given = cases.campaign.conditions(case, planned)
    trucks = cases.scattered(case.seed)
    one = cases.run.simulate(trucks, (cases.law_of(law, "free", 5, amplitude),), given, cases.ROUGH)
    other = cases.run.simulate(trucks, (), given, cases.ROUGH)
    assert 0.7 < cases.lost(planned[0], other[0], one[0], case.end_m) < 5.0
    assert cases.at_cost(9.0, np.array([1.0, 2.0]), np.array([1.0, 4.0])) == (2.0, 4.0)
    assert cases.at_cost(2.0, np.array([1.0, 4.0]), np.array([1.0, 4.0]))[0] == pytest.approx(2.0)


def test_an_imitation_leaves_what_is_orthogonal_and_pays_for_priors():
    class Refitter:
        own = warming = np.zeros((1, 5, 4))
        shared = np.array([np.eye(20)[0].reshape(1, 5, 4) * 10.0])

    Refitter.planned = [None]
    fit = separability.Imitation(Refitter, np.ones((1, 4), bool))
    along = np.zeros((1, 5, 4))
    along[0, 0, 0] = 10.0
    assert fit.left(fit.rows(along)) == pytest.approx(1.0, rel=0.02)  # one standard deviation
    across = np.zeros((1, 5, 4))
    across[0, 1, 3] = 3.0
    target = fit.rows(across)
    assert 5.0 < fit.left(target) <= 9.0  # a start position takes a share
    assert fit.left(target, [fit.rows(2.0 * across)], free=True) == pytest.approx(0.0, abs=1e-6)


def test_amplitudes_end_where_the_catalogue_says():
    for spec in _core.effect_table():
        if spec["id"] in cases.EQUATIONS:
            assert cases.most(spec["id"]) == spec["parameters"][0]["plausible_upper"]


@pytest.fixture(scope="module")
def slight(tmp_path_factory):
    """The free lift's spool with a flow force that no channel shows, and what is said of it."""
    concealed = 3.6e-4
    return concealed, *diagnosed("effects-valve_flow_force-2", concealed, tmp_path_factory.mktemp("slight"))


def diagnosed(name, amplitude, folder):
    """A case of the proof whose law has this amplitude: what is said of it."""
    made = next(one for one in cases.variations(["effects", "others"]) if one.name == name)
    law = cases.law_of(made.concealed[0][0], made.case.lift, made.case.seed, amplitude)
    campaign.record(replace(made.case, laws=(law,)), folder)
    return made.case.lift, diagnose(Campaign.read(folder), Truck.read("thesis"))


def found_alone(found, lift, effect, amplitude, concealed, form="uncertain"):
    """Hardly a channel shows anything, and what is missing is still found; where none does, its law is not
    tested."""
    assert found.baseline.worst.mean_square <= SLIGHT
    assert found.verdict == "missing-physics"
    assert [(one.hypothesis.label, one.form) for one in found.causes] == [(f"{lift}.{effect}", form)]
    told = next(one for one in found.to_dict()["causes"][0]["parameters"] if one["name"].endswith(amplitude))
    assert told["lower"] <= concealed <= told["upper"]


def test_a_law_that_hardly_a_channel_shows_is_told_from_the_oils_temperature(tmp_path):
    concealed = cases.most("viscosity_law")
    lift, found = diagnosed("effects-viscosity_law-2", concealed, tmp_path / "campaign")
    found_alone(found, lift, "viscosity_law", "share", concealed, form="complete")


def test_a_case_is_told_as_its_diagnosis_says(slight):
    _, _, found = slight
    told = variations.answered(found.to_dict(), 0, "")
    assert told["verdict"] == found.verdict
    assert [one["id"] for one in told["causes"]] == [one.hypothesis.id for one in found.causes]
    assert variations.answered(None, 2, "no")["verdict"] == "refused"


def test_what_is_too_slight_for_the_tempered_stages_is_found_from_where_the_fit_ended(slight):
    concealed, lift, found = slight
    found_alone(found, lift, "valve_flow_force", "coefficient", concealed)


def test_all_recordings_together_show_what_those_that_were_fitted_do_not(slight):
    _, _, found = slight
    assert found.baseline.complete
    (cause,) = found.causes
    (everywhere,) = (one for one in found.screening.singles if one.hypotheses == (cause.hypothesis,))
    fitted = found.baseline.found
    (there,) = screen(fitted.problem, fitted.x, [cause.hypothesis]).singles
    assert there.gain < ALARM_PHYSICS < 0.5 * everywhere.gain


def test_what_recordings_held_out_are_too_few_to_tell_is_decided_by_all_that_foretell_each_other(tmp_path):
    concealed = 0.0131
    lift, found = diagnosed("effects-valve_current_limit-2", concealed, tmp_path / "campaign")
    found_alone(found, lift, "valve_current_limit", "share", concealed)
    assert found.baseline.squares - found.final.squares < CONFIRMED
    assert found.final.loo_log_score > CONFIRMED
    assert "leave-one-out" in found.sentence


def test_a_name_with_another_law_is_uncertain_and_a_curve_over_the_right_variable_mends_it(tmp_path):
    """Grease that softens above 35 degC only: linear in the temperature, no channel exceeds its bound."""
    lift, found = diagnosed("others-friction_temperature__kink-2", 0.0123, tmp_path / "campaign")
    assert found.verdict == "missing-physics"
    (first,) = found.causes
    assert (first.hypothesis.label, first.form) == (f"{lift}.friction_temperature", "uncertain")
    assert first.curve
    assert "oil temperature" in first.curve.name
    assert "by another law than the catalogue's" in found.sentence
    named = next(one for one in found.selection.steps[0].refits if one.hypotheses == (first.hypothesis,))
    assert named.complete  # so that nothing but the curve showed it
    assert found.final.squares < named.squares - CLEARLY

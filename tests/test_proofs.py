"""The proofs' own judgement: right intervals pass, wrong ones fail, and one truck goes all the way."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from forklift import Truck, simulate
from forklift.ensemble.proof.score import score
from forklift.fitting.starts import End
from forklift.plant.forklift.commands import Command

PROOFS = Path(__file__).parents[1] / "proofs"


def loaded(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"proofs_{name}", PROOFS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


coverage, record, starts = loaded("coverage"), loaded("record"), loaded("starts")


def trucks(count: int, *, told: float = 1.0, biased: str = "", seed: int = 1) -> list[dict]:
    """Results whose intervals are `told` times as wide as they ought to be; one parameter may be off."""
    random = np.random.default_rng(seed)
    made = []
    for number in range(1, count + 1):
        parameters = []
        for k in range(20):
            name = f"p{k}"
            error = random.standard_normal() + 2.0 * (name == biased)
            parameters.append(
                {
                    "name": name,
                    "told": True,
                    "together": False,
                    "covers": bool(abs(error) < 1.96 * told),
                    "z": error / told,
                }
            )
        made.append({"truck": number, "parameters": parameters})
    return made


def test_right_intervals_meet_the_criterion():
    for seed in range(5):
        text, met = coverage.summary(trucks(50, seed=seed))
        assert met, text
        assert "The criterion is met." in text


@pytest.mark.parametrize("told", [0.8, 1.3])
def test_intervals_too_narrow_or_too_wide_fail(told):
    text, met = coverage.summary(trucks(50, told=told))
    assert not met
    assert "The criterion is not met." in text


def test_one_biased_parameter_fails_and_is_named_though_the_pool_looks_right():
    text, met = coverage.summary(trucks(50, biased="p7"))
    assert not met
    assert "Holm-corrected p < 0.01): p7." in text
    covered = int(re.search(r"(\d+) of 1000 intervals", text)[1])
    assert coverage.BAND[0] < covered / 1000 < coverage.BAND[1]


def test_what_is_not_told_or_known_only_together_is_not_counted():
    made = trucks(50)
    for truck in made:
        truck["parameters"][0] |= {"told": False, "covers": False}
        truck["parameters"][1] |= {"together": True, "covers": False}
    text, met = coverage.summary(made)
    assert met
    assert " of 900 intervals" in text
    assert "`p0`" not in text
    assert "`p1`" not in text


def test_a_drawn_truck_is_another_one_with_the_free_lift_scattered_as_told():
    thesis = Truck.read("thesis")
    drawn = [coverage.truth(thesis, seed) for seed in range(40)]
    assert coverage.truth(thesis, 3) == drawn[3]
    logs = np.log([one.values["free.cylinder.V_0"] / thesis.values["free.cylinder.V_0"] for one in drawn])
    assert np.std(logs) == pytest.approx(coverage.SCATTER, rel=0.35)
    for one in drawn:
        assert all(
            one.values[name] == value for name, value in thesis.values.items() if name.startswith("main.")
        )
        assert one.values["free.cylinder.area"] == thesis.values["free.cylinder.area"]


def test_a_recording_ends_before_the_lift_meets_its_stop():
    thesis = Truck.read("thesis")
    command = Command.of_samples(50.0, free=np.full(750, 1.2))
    run = simulate(thesis, command, load_kg=1500.0, oil_temperature_degc=60.0)
    kept = coverage.before_the_end(run, thesis)
    position, end = run["free.position"], thesis.values["free.cylinder.stroke_lower"]
    assert position[-1] < end + 1e-3
    assert position[kept - 1] > end + 0.02
    assert position[kept] < end + 0.04
    assert coverage.before_the_end(run, thesis.with_values({"free.cylinder.stroke_lower": -0.1})) == 750


def test_one_truck_goes_all_the_way(tmp_path):
    coverage.run(1, tmp_path)
    (path,) = tmp_path.iterdir()
    truck = json.loads(path.read_text())
    assert truck["truck"] == 1
    assert (
        truck["cost"] < truck["cost_at_truth"]
    )  # the optimum is below the truth by about half of all unknowns
    assert truck["cost_at_truth"] - truck["cost"] < 2.0 * len(truck["parameters"])
    assert truck["evaluations"] <= 60
    assert truck["worst_mean_square"] < 1.3
    counted = [one for one in truck["parameters"] if one["told"] and not one["together"]]
    assert len(counted) >= 15
    assert sum(one["covers"] for one in counted) >= 0.8 * len(counted)
    assert all(one["lower"] <= one["estimate"] <= one["upper"] for one in truck["parameters"])
    text, _ = coverage.summary([truck])
    assert text.startswith("1 trucks;")


def test_starts_that_agree_or_are_named_hold_the_proof():
    inf = float("inf")
    ends = [End(k, 0.01 * k, 0.02, True) for k in range(9)] + [End(9, inf, inf, False)]
    said = ["9 of 10 starts ended in the same place.", "Start 10 failed on the way; it is left out."]
    assert starts.judged(ends, said)[1]
    assert starts.judged(ends[:9], ["9 of 9 starts ended in the same place."])[1]
    assert "| 10 | inf | inf | no |" in starts.table(ends)


def test_starts_that_disagree_too_often_or_unsaid_do_not():
    ends = [End(k, 0.01 * k, 0.02, True) for k in range(8)] + [End(k, 40.0, 9.0, False) for k in (8, 9)]
    said = [
        "8 of 10 starts ended in the same place.",
        "Start 9 ended elsewhere: ...",
        "Start 10 ended elsewhere",
    ]
    assert not starts.judged(ends, said)[1]
    one = [*ends[:9], End(9, 0.0, 0.0, True)]
    text, holds = starts.judged(one, ["9 of 10 starts ended in the same place."])
    assert not holds
    assert "does not name start 9" in text
    assert not starts.judged(one, ["Start 9 ended elsewhere"])[1]


def test_the_picture_of_a_proof_has_the_numbers_of_its_score(tmp_path):
    drawn = loaded("picture")

    def rate(right: int, of: int) -> dict:
        return {"right": right, "of": of, "share": right / of, "lower": 0.9 * right / of, "upper": 1.0}

    rates = {name: rate(7 + k, 17 + k) for k, name in enumerate(drawn.RATES)}
    score = {
        "seed": 1234567,
        "campaigns": 43,
        "rates": rates | {"cause told first": rate(3, 4)},
        "by_kind": {"complete": {"false alarms": rate(0, 5)}},
        "baselines": {"criterion": {"cause told first": rate(2, 4), "false alarms": rate(4, 5)}},
    }
    drawn.picture(score, path := tmp_path / "proof.svg")
    said = path.read_text(encoding="utf-8")
    drawn.picture(score, again := tmp_path / "again.svg")
    assert again.read_text(encoding="utf-8") == said
    for words in (
        "--seed 1234567 --campaigns 43",
        *(f"{one['right']} of {one['of']}" for one in rates.values()),
    ):
        assert words in said
    assert "BIC" in said
    assert "sparse" not in said  # this score has none


def test_a_run_that_is_kept_can_be_gone_on_with(tmp_path):
    """The same results by number, in a folder of the same seed; what is there already stays."""
    run, again, file = tmp_path / "run", tmp_path / "again", tmp_path / "records" / "5.json.xz"
    (run / "results").mkdir(parents=True)
    (run / "proof.json").write_text('{"seed": 5}')
    for number in (0, 3):
        (run / "results" / f"{number:05d}.json").write_text(json.dumps({"number": number, "told": "ä"}))
    assert record.keep(run, file) == 2
    (again / "results").mkdir(parents=True)
    (again / "results" / "00003.json").write_text("{}")
    assert record.unpack(file, again) == 5
    assert json.loads((again / "proof.json").read_text())["seed"] == 5
    assert json.loads((again / "results" / "00000.json").read_text()) == {"number": 0, "told": "ä"}
    assert (again / "results" / "00003.json").read_text() == "{}"


def test_several_runs_as_one_count_what_each_counts():
    """Numbers of the table's rows add up, and the score of all is that of a run with all results."""
    kept = PROOFS / "records" / "30000001.json.xz"
    seed, results = record.read(kept)
    found, table = record.together({seed: results[:60], seed + 1: results[60:100]})
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    told = [row for row in rows[3:] if " of " in row[1]]
    assert {row[0] for row in told} > set(record.GOALS)
    for row in told:
        parts = [[int(part) for part in cell.split(" of ")] for cell in row[1:4]]
        assert [sum(pair) for pair in zip(*parts[:2], strict=True)] == parts[2]
    assert found["rates"] == score(results[:100])["rates"]
    assert found["campaigns"] == 100

"""A condition entered wrongly has its number, in kg or K, with an interval that holds the truth: where the
recordings do not tell it, one as wide as that."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forklift import Campaign, Truck
from forklift.diagnosis.conditions import follow_what_was_entered, offsets
from forklift.diagnosis.files import files as diagnosis_files
from forklift.diagnosis.hypothesis import with_hypotheses
from forklift.diagnosis.numbers import numbers, of_hypothesis
from forklift.diagnosis.refitter import Refitter
from forklift.fitting.posing import pose
from forklift.fitting.predict import predict_all, settled_within
from forklift.plant.forklift.hypotheses import hypotheses
from forklift.plant.forklift.model import Forklift
from forklift.plant.forklift.sensors import sensors
from forklift.plant.forklift.unknowns import unknowns
from forklift.plant.forklift.vocabulary import ForkliftWords
from forklift.plant.subjects import subject

NULL = Path(__file__).parent / "campaigns" / "null"
STANDS_AT = 5.0
"""What the temperature sensor reads that stands still [°C]."""


@pytest.fixture(scope="module", params=[-90.0, 130.0], ids=["90 kg too much", "130 kg too little"])
def found(request):
    """Four recordings whose loads are entered wrongly where there is one, fitted with that hypothesis."""
    campaign, truck = Campaign.read(NULL), Truck.read("thesis")
    files = ("free_prms1_0kg_20c.csv", "free_prms1_800kg_20c.csv", "free_prms1_1500kg_20c.csv")
    right = [one for one in campaign.recordings if one.file in files]
    wrong = [replace(one, load_kg=one.load_kg - request.param if one.load_kg else 0.0) for one in right]
    every = sensors(wrong)
    machine = Forklift(truck, ("free",))
    everyone = pose(machine, wrong, unknowns(truck, ["free"]), every)
    (load,) = [one for one in hypotheses(truck, ["free"], list(every), {}) if one.id == "load_entered"]
    refitter = Refitter(everyone.over(everyone.samples), everyone, every)
    return request.param, refitter, load, refitter.finish(refitter.rough((load,)))


def test_the_interval_holds_the_truth(found):
    wrong_by, _, load, refit = found
    common, *each = offsets(refit, load)
    assert common.unit == "kg"
    assert common.lower <= wrong_by <= common.upper
    assert common.upper - common.lower < 20.0
    assert {
        one.file: one.lower <= (wrong_by if "_0kg" not in one.file else 0.0) <= one.upper for one in each
    } == {one.file: True for one in each}


def test_there_is_no_mean_of_conditions_that_differ_from_recording_to_recording(found):
    """One load entered too low and the other too high: their mean says nothing of either."""
    _, _, load, refit = found
    problem, x = refit.found.problem, refit.found.x.copy()
    at = next(k for k, sample in enumerate(problem.samples) if "_1500kg" in sample.recording.file)
    sample = problem.samples[at]
    x[problem.starts[at] + int(np.searchsorted(sample.free, sample.names.index("load")))] *= -1.0
    told = list(offsets(replace(refit, found=replace(refit.found, x=x)), load))
    assert [one.file for one in told] == [one.recording.file for one in problem.samples]
    off = [one.value for one in told if not one.lower <= 0.0 <= one.upper]
    assert min(off) < 0.0 < max(off)


@pytest.fixture(scope="module")
def stuck():
    """Four recordings of two oils, as a temperature sensor has them that stands still in the cold."""
    campaign, truck = Campaign.read(NULL), Truck.read("thesis")
    files = [f"free_prms1_{load}kg_{degc}c.csv" for load in (0, 1500) for degc in (20, 60)]
    right = [next(one for one in campaign.recordings if one.file == file) for file in files]
    truth = [float(np.nanmean(one["oil_temperature_degc"])) - STANDS_AT for one in right]
    wrong = [
        replace(
            one,
            channels={**one.channels, "oil_temperature_degc": np.full(len(one.time_s), STANDS_AT)},
        )
        for one in right
    ]
    every = sensors(wrong)
    rate = "free.viscosity.lambda"
    everyone = pose(Forklift(truck, ("free",)), wrong, unknowns(truck, ["free"], hold=[rate]), every)
    (warm,) = [one for one in hypotheses(truck, ["free"], list(every), {}) if one.id == "temperature_offset"]
    held = tuple(one for one in unknowns(truck, ["free"]) if one.name == rate)
    refitter = Refitter(everyone, everyone, every, held=held)
    return dict(zip(files, truth, strict=True)), warm, refitter.finish(refitter.rough((warm,)))


def test_a_temperature_that_viscosity_makes_up_for_is_told_as_unknown(stuck):
    """Warmer oil in all recordings is oil of a lower viscosity in all of them."""
    truth, warm, refit = stuck
    level, *others = offsets(refit, warm)
    each = {one.file: one for one in others if not one.apart}
    assert not any(one.told for one in (level, *each.values()))
    assert level.lower <= np.mean([*truth.values()]) <= level.upper
    assert [one.lower <= truth[file] <= one.upper for file, one in each.items()] == [True] * len(truth)
    assert level.lower + STANDS_AT == pytest.approx(-40.0)  # no oil is colder, or warmer, than can be read
    assert level.upper + STANDS_AT == pytest.approx(130.0)


def test_by_how_much_the_temperatures_differ_is_told(stuck):
    truth, warm, refit = stuck
    mean = np.mean([*truth.values()])
    apart = {one.file: one for one in offsets(refit, warm) if one.apart}
    assert [one.lower <= truth[file] - mean <= one.upper for file, one in apart.items()] == [True] * len(
        truth
    )
    assert [one.told and one.lower * one.upper > 0.0 for one in apart.values()] == [True] * len(truth)


def test_what_no_recording_tells_of_the_viscosity_widens_its_interval_too(stuck):
    _, _, refit = stuck
    (nu_0,) = [one for one in numbers(refit) if one.name == "free.viscosity.nu_0"]
    alone = next(one for one in refit.knowledge.estimates if one.name == nu_0.name)
    assert nu_0.upper / nu_0.lower > 1.2 * alone.upper / alone.lower
    assert not nu_0.identifiable


def test_a_level_that_is_not_told_is_said_to_be_so(stuck):
    _, warm, refit = stuck
    rows = [one.to_dict() for one in of_hypothesis(refit, warm)]
    clause, interval = ForkliftWords().found(warm, rows)
    assert "differs from recording to recording" in clause
    assert "a mean that they do not tell" in clause
    assert "is not known" in interval


def test_what_is_predicted_has_the_load_that_was_found(found):
    wrong_by, refitter, load, refit = found
    problem = with_hypotheses(refitter.everyone, [load]).weighted(
        refit.found.problem.sigma, refit.found.problem.substeps
    )
    for one in predict_all(problem, settled_within(problem, refit.found.x[: len(problem.unknowns)])):
        entered = one.recording.load_kg
        assert one.conditions["load"] == pytest.approx(entered + (wrong_by if entered else 0.0), abs=10.0)
        off = one.outputs["pressure_free_pa"] - one.recording["pressure_free_pa"]
        assert float(np.sqrt(np.mean(off**2))) < 0.5e5


def test_a_corrected_campaign_has_the_loads_and_temperatures_that_were_found(tmp_path):
    campaign = Campaign.read(NULL)
    machine = subject(Truck.read("thesis"))
    entered = [machine.conditions(one, {}) for one in campaign.recordings]
    found = [
        {"load_kg": one["load_kg"] + 70.0, "oil_temperature_degc": one["oil_temperature_degc"] - 3.0}
        for one in entered
    ]
    machine.corrected("null", campaign.recordings, found).write(tmp_path / "corrected")
    read = Campaign.read(tmp_path / "corrected")
    for one, was in zip(read.recordings, entered, strict=True):
        now = machine.conditions(one, {})
        assert now["load_kg"] == pytest.approx(was["load_kg"] + 70.0)
        assert now["oil_temperature_degc"] == pytest.approx(was["oil_temperature_degc"] - 3.0, abs=1e-6)
    files = diagnosis_files([one.file for one in campaign.recordings])
    assert {f"corrected/{one.file}" for one in read.recordings} <= files


def one_oil_to_learn_from(warmer_k):
    """Three recordings in cold oil that are fitted, and one held out in oil so much warmer."""
    campaign, truck = Campaign.read(NULL), Truck.read("thesis")
    files = [f"free_prms1_{load}kg_20c.csv" for load in (0, 800, 1500)]
    fitted = [replace(one, role="estimate") for one in campaign.recordings if one.file in files]
    degc = 20 + warmer_k
    (other,) = [one for one in campaign.recordings if one.file == f"free_prms1_1500kg_{degc}c.csv"]
    recordings = [*fitted, replace(other, role="validate", file="held_out.csv")]
    return subject(truck).examined(recordings)


@pytest.mark.parametrize(("warmer_k", "held"), [(40, ()), (0, ("free.viscosity.lambda",))])
def test_what_the_fitted_do_not_tell_is_free_where_those_held_out_do(warmer_k, held):
    machine, _, findings = one_oil_to_learn_from(warmer_k)
    assert findings.held == held
    names = [one.name for one in machine.unknowns(findings.held)]
    assert ("free.viscosity.lambda" in names) is (not held)
    assert ("oil_temperature_degc", "free") in findings.same


def without_oil(recording):
    channels = {name: values for name, values in recording.channels.items() if "oil" not in name}
    return replace(recording, channels=channels)


@pytest.mark.parametrize(("entered", "alike"), [(60.0, False), (20.5, True)])
def test_an_oil_temperature_that_was_entered_counts_among_those_that_differ(entered, alike):
    """Recordings in cold oil with a sensor, and in warm oil without: a law of temperature can be told."""
    files = {f"free_prms1_{load}kg_{degc}c.csv": degc for load in (0, 800) for degc in (20, 60)}
    recordings = [
        replace(without_oil(one) if files[one.file] == 60 else one, role="estimate")
        for one in Campaign.read(NULL).recordings
        if one.file in files
    ]
    *_, findings = subject(Truck.read("thesis"), oil_temperature_degc=entered).examined(recordings)
    assert (("oil_temperature_degc", "free") in findings.same) is alike


@pytest.mark.parametrize(
    ("off", "follow"),
    [
        (lambda degc, k: 0.25 * (degc - 40.0), True),  # as a viscosity that falls less with temperature
        (lambda degc, k: [5.0, -4.0, -3.0, -5.0, 6.0, 4.0][k], False),
        (lambda degc, k: degc - STANDS_AT, False),  # a sensor that stands still
    ],
    ids=["over the temperature", "by chance", "read alike"],
)
def test_differences_over_what_was_entered_are_a_law(off, follow):
    """An oil that is warmer than what was read where it is warm, and colder where it is cold, is no error of
    each recording's."""
    truck, recordings = Truck.read("thesis"), Campaign.read(NULL).recordings
    files = [f"free_prms1_{load}kg_{degc}c.csv" for load in (0, 800, 1500) for degc in (20, 60)]
    wrong = []
    for k, file in enumerate(files):
        right = next(one for one in recordings if one.file == file)
        degc = right["oil_temperature_degc"]
        wrong.append(replace(right, channels={**right.channels, "oil_temperature_degc": degc - off(degc, k)}))
    every = sensors(wrong)
    everyone = pose(subject(truck), wrong, unknowns(truck, ["free"]), every)
    (warm,) = [one for one in hypotheses(truck, ["free"], list(every), {}) if one.id == "temperature_offset"]
    refitter = Refitter(everyone, everyone, every)
    assert follow_what_was_entered(refitter.rough((warm,)), warm) == follow

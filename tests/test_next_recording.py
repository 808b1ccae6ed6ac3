"""The recording to make next: what parts rivals, what tells a parameter, and a command that can be run."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from forklift import Command, Truck, simulate
from forklift.app.main import app
from forklift.diagnosis import next_recording as engine
from forklift.diagnosis import proposals
from forklift.diagnosis.hypothesis import carry
from forklift.diagnosis.next_recording import PARTS, part, tell
from forklift.diagnosis.refit import Refit
from forklift.fitting.intervals import knowledge
from forklift.plant.forklift.candidates import (
    MARGIN_M,
    Limits,
    before_the_end,
    commands,
    elsewhere,
    limits,
    wanted,
)
from forklift.plant.forklift.hypotheses import hypotheses
from forklift.plant.subjects import subject
from forklift.recordings.channels import commanded


@pytest.fixture(scope="module")
def complete(null_fit):
    """The campaign without a mismatch, as a refit."""
    return Refit((), null_fit.found, null_fit.knowledge, null_fit.judged, (0.0, 0.0), True, null_fit.found)


@pytest.fixture(scope="module")
def asked(null_fit):
    truck = null_fit.machine.truck
    return {one.label: one for one in hypotheses(truck, ["free"], list(null_fit.sensors), {})}


def could_be(recordings, fit):
    return proposals.possible(subject(fit.truck), recordings, [{}], fit.sensors)


def next_recording(proposal):
    """A proposal as a recording to be made; None if nothing is worth recording."""
    chosen = proposal.candidate
    return chosen and wanted(chosen.sample.recording, proposal.why)


@pytest.fixture(scope="module")
def possible(complete, null_fit):
    return could_be(null_fit.recordings, null_fit)


def rival(refit, hypothesis, amplitude):
    """The refit with a hypothesis of some amplitude, in deviations of its prior, and all else as it was."""
    problem = refit.found.problem.with_addition(hypothesis.addition)
    x = carry(refit.found.x, refit.found.problem, problem)
    x[[unknown.name for unknown in problem.unknowns].index(hypothesis.amplitude)] = amplitude
    return Refit(
        (hypothesis,),
        replace(refit.found, x=x, problem=problem),
        knowledge(problem, x),
        refit.judged,
        (0.0, 0.0),
        True,
        refit.found,
    )


def test_the_score_is_what_the_whole_covariance_gives():
    random = np.random.default_rng(1)
    apart, one, other = random.normal(size=40), random.normal(size=(40, 3)), random.normal(size=(40, 5))
    covariance = np.eye(40) + one @ one.T + other @ other.T
    assert engine.expected_parting(apart, one, other) == pytest.approx(
        0.5 * apart @ np.linalg.solve(covariance, apart)
    )
    undone = engine.expected_parting(one @ np.ones(3) * 1e3, 1e6 * one, other)
    assert undone < 1e-3  # what θ can undo counts not


def test_identical_rivals_cannot_be_parted_and_that_is_said(complete, possible):
    found = part([complete, complete], possible)
    assert found.candidate is None
    assert [one.expected for one in found.partings] == [pytest.approx(0.0, abs=1e-6)]
    assert "none of" in found.why
    assert next_recording(found) is None


def test_the_score_grows_with_the_amplitude_and_no_recording_made_so_far_does_better(
    complete, asked, possible
):
    scores = []
    for amplitude in (0.002, 0.01, 0.05):
        found = part([complete, rival(complete, asked["free.leakage"], amplitude)], possible)
        scores.append(found.partings[0].expected)
        if found.candidate:
            assert found.partings[0].expected >= PARTS
            assert found.partings[0].recorded < found.partings[0].expected
    assert scores == sorted(scores)
    assert scores[-1] > 5.0 * scores[0]
    assert "rest" in found.candidate.name  # a leak is seen best while the lift ought to stand still
    assert "parts nothing missing from free.leakage" in found.why


def test_of_three_rivals_those_that_can_be_parted_are_and_the_others_are_named(complete, asked, possible):
    alike = [
        rival(complete, asked["free.leakage"], 0.05),
        rival(complete, asked["free.leakage"], 0.05),
        complete,
    ]
    found = part(alike, possible)
    expected = {one.rivals: one.expected for one in found.partings}
    assert expected[("free.leakage", "free.leakage")] < 1e-6
    assert found.candidate is not None
    assert "it does not part free.leakage from free.leakage" in found.why


def test_a_parameter_is_told_by_the_recording_that_narrows_it_most(complete, asked, possible):
    with_leak = rival(complete, asked["free.leakage"], 0.0)
    found = tell(with_leak, "free.leakage.coefficient", possible)
    assert found.candidate is not None
    assert "narrows the standard deviation of free.leakage.coefficient" in found.why
    with pytest.raises(ValueError, match="no unknown"):
        tell(complete, "free.nothing", possible)


def test_recordings_of_cold_oil_only_ask_for_warm_oil(complete, null_fit, asked):
    """Friction that falls with temperature: at one temperature it is friction."""
    problem = complete.found.problem
    cold = [
        k
        for k, seen in enumerate(problem.samples)
        if np.nanmean(seen.recording["oil_temperature_degc"]) < 25.0
    ]
    x = np.concatenate(
        [complete.found.x[: len(problem.unknowns)], *(problem.nuisance(complete.found.x, k) for k in cold)]
    )
    problem = replace(problem, samples=tuple(problem.samples[k] for k in cold))
    refit = replace(
        complete,
        found=replace(complete.found, x=x, problem=problem),
        knowledge=knowledge(problem, x),
    )
    recordings = [seen.recording for seen in problem.samples]
    possible = could_be(recordings, null_fit)
    with_law = rival(refit, asked["free.friction_temperature"], 0.0)
    found = next_recording(tell(with_law, "free.friction_temperature.rate", possible))
    assert found is not None
    assert found.oil_temperature_degc == 65.0
    again = elsewhere(recordings, "oil_temperature_degc", "free")
    assert again is not None
    assert again.oil_temperature_degc == 65.0
    assert again.load_kg in [recording.load_kg for recording in recordings]
    assert elsewhere(recordings, "oil_temperature_degc", "main") is None


@pytest.mark.parametrize("lift", ["free", "main", "both"])
def test_no_command_reaches_the_end_of_a_stroke(lift):
    truck = Truck.read("thesis")
    loads, temperatures = np.array([0.0, 1500.0]), np.array([10.0, 65.0])
    names = [name for name, _ in commands(lift)]
    assert len(set(names)) == len(names) >= 7
    for _, command in commands(lift):
        safe = before_the_end(command, lift, [truck], loads, temperatures)
        assert len(safe.time_s) <= len(command.time_s)
        assert safe.current_free_a[0] == safe.current_main_a[0] == 0.0
        for load in loads:
            run = simulate(truck, safe, load_kg=load, oil_temperature_degc=65.0, solver="fixed")
            for which in commanded(lift):
                assert run[f"{which}.position"].min() > 0.3 * MARGIN_M


def test_limits_are_as_wide_as_what_was_recorded(null_fit):
    found = limits(null_fit.recordings)
    assert found == Limits((0.0, 1500.0), (10.0, 65.0))
    heavy = replace(null_fit.recordings[0], load_kg=2000.0, sha256="")
    assert limits([heavy]).load_kg == (0.0, 2000.0)


def test_the_command_runs_unchanged(complete, asked, possible, tmp_path):
    found = next_recording(part([complete, rival(complete, asked["free.leakage"], 0.05)], possible))
    assert found is not None
    file = found.write(tmp_path / "next_recording.csv")
    assert Command.read(file) == found.command
    told = found.to_dict(file.name)
    assert set(told) == {"why", "lift", "load_kg", "oil_temperature_degc", "command"}
    json.dumps(told)
    run = CliRunner().invoke(
        app,
        [
            *("simulate", "--command", str(file), "--load", str(told["load_kg"])),
            *("--temperature", str(told["oil_temperature_degc"]), "--lift", told["lift"], "--json"),
        ],
    )
    assert run.exit_code == 0, run.output
    assert json.loads(run.stdout)["samples"] == len(found.command.time_s)

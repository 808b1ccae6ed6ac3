"""One diagnosis for every machine: the same sections, keys, tests and words, whatever was diagnosed."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from typer.testing import CliRunner

import forklift.diagnosis
from diagnosed import diagnosed
from forklift.app.main import app
from forklift.diagnosis.diagnose import diagnose
from forklift.diagnosis.result import Diagnosis
from forklift.plant.recording import Recording
from forklift.report.of_diagnosis import diagnosis_page
from motor_bench import motor_bench
from pages import Text
from test_machines import folder, tutorial
from test_plant_report import line, recorded

SCHEMA = json.loads((Path(forklift.diagnosis.__file__).parent / "diagnosis.schema.json").read_text())
SECTIONS = ["Evidence", "Doubts", "Next steps", "Provenance"]
QUESTIONS = [
    "Could it be taken for something else?",
    "Is the law right?",
    "Does it hold everywhere?",
    "What these recordings cannot tell",
    "Is anything left over?",
    "About these recordings",
]


@cache
def motor() -> Diagnosis:
    names: dict[str, object] = {}
    for block in tutorial()[1][:3]:
        exec(compile(block.partition("print(")[0], "machines.md", "exec"), names)
    return names["found"]


def first(recording: Recording, samples: int) -> Recording:
    """Its first samples alone."""
    given = {"u": recording.u, "y": recording.y}
    cut = {kind: {name: of[:samples] for name, of in columns.items()} for kind, columns in given.items()}
    return replace(recording, time_s=recording.time_s[:samples], **cut)


def tanks() -> Diagnosis:
    """Part of the catalogue and the first 20 min, for the time it takes; `proofs/rigs.py` asks all."""
    from forklift.plant.rigs import cascaded_tanks

    whole = cascaded_tanks.plant()
    asked = {"sensor_curve", "upper_overflow", "pump_saturation", "lower_section"}
    small = replace(whole, effects=tuple(effect for effect in whole.effects if effect.id in asked))
    return diagnose(small, [first(one, 300) for one in cascaded_tanks.read(folder("cascaded_tanks"))])


def seal() -> Diagnosis:
    from forklift.plant.rigs import pneumatic_seal

    recordings = pneumatic_seal.read(folder("pneumatic_seal"), "O-ring")
    sigma = float(np.median(list(pneumatic_seal.repeatability(recordings).values())))
    return diagnose(pneumatic_seal.plant(sigma), recordings, candidates=pneumatic_seal.candidates())


MACHINES = {
    "forklift": lambda: diagnosed("leak"),
    "forklift without a mismatch": lambda: diagnosed("null"),
    "motor": motor,
    "line": cache(lambda: diagnose(line(), recorded(line()))),
    "tanks": cache(tanks),
    "seal": cache(seal),
}


@pytest.fixture(params=MACHINES, scope="module")
def found(request) -> Diagnosis:
    return MACHINES[request.param]()


def test_it_is_one_class_one_schema_and_one_page(found):
    assert type(found) is Diagnosis
    told = found.to_dict()
    jsonschema.validate(json.loads(json.dumps(told, allow_nan=False)), SCHEMA)
    page = Text(diagnosis_page(found, told))
    assert page.of("h1") == [found.sentence]
    assert page.of("h2") == SECTIONS
    for question in QUESTIONS:
        assert question in page.everything, question
    assert not re.search(r"\b(nan|inf|NaN|None(?! of))\b", page.everything)


def test_every_test_of_the_answer_is_made(found):
    told = found.to_dict()
    kinds = {test["test"] for test in told["deficient"]["before"]["tests"]}
    assert {"goodness of fit", "correlation"} <= kinds
    assert {one["by"] for one in told["misfit"]} == {"recording", "signal", "phase", "band"}
    assert len(told["hypotheses"]) > 3
    amplitudes = [
        one for one in found.final.hypotheses if one.amplitude and one.kind != "unknown"
    ]  # of each its regimes
    assert {one["parameter"] for one in told["regimes"]} == {one.amplitude for one in amplitudes}
    groups = {one["group"] for one in told["recordings"]}
    assert bool(told["groups"]) == (len(groups) > 1 and bool(amplitudes))
    assert found.verdict == "no-mismatch" or told["location"]
    if found.verdict == "no-mismatch":
        return
    assert told["unknown_inputs"]
    assert found.causes or told["functions_of"]


def test_every_cause_has_its_number_with_a_95_per_cent_interval(found):
    for cause, row in zip(found.causes, found.to_dict()["causes"], strict=True):
        if cause.hypothesis.kind == "unknown":
            continue
        assert row["parameters"], cause
        for one in row["parameters"]:
            assert one["lower"] <= one["value"] <= one["upper"]
            assert one["level"] == 0.95


def test_the_command_diagnoses_a_machine_of_ones_own(tmp_path):
    motor_bench(tmp_path)
    out = tmp_path / "found"
    given = ["diagnose", str(tmp_path), "--machine", str(tmp_path / "motor.py"), "--out", str(out)]
    result = CliRunner().invoke(app, given)
    assert result.exit_code == 0, result.output
    told = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    jsonschema.validate(told, SCHEMA)
    assert [one["id"] for one in told["causes"]] == ["drag"]
    assert told["campaign"] == "bench"
    assert "--machine" in told["command"]
    assert json.loads((out / "parameters.json").read_text(encoding="utf-8"))["present"] == ["drag"]
    assert {path.name for path in (out / "predictions" / "final").iterdir()} == {
        path.name for path in tmp_path.glob("*.csv")
    }


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (None, "machine-missing"),
        ("machine = 3\n", "machine-invalid"),
        ("x = 1\n", "machine-invalid"),
        ("machine = 1 / 0\n", "machine-invalid"),
        ("machine = (\n", "machine-invalid"),
    ],
)
def test_a_file_without_a_machine_is_told_in_one_sentence(tmp_path, text, code):
    from forklift.base.errors import ForkliftError
    from forklift.plant.campaign import machine

    if text is not None:
        (tmp_path / "m.py").write_text(text, encoding="utf-8")
    with pytest.raises(ForkliftError) as error:
        machine(tmp_path / "m.py")
    assert error.value.code == code

"""The page of a plant's diagnosis: every section, of machines of every kind, and nothing of a forklift."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from plotly.offline import get_plotlyjs

from forklift.base.errors import ForkliftError
from forklift.diagnosis.diagnose import diagnose
from forklift.diagnosis.result import Diagnosis
from forklift.diagnosis.sentences import Gain
from forklift.plant import Effect, Input, Output, Param, Plant, Port, Recording, State
from forklift.plant.machine import NumpyMachine
from forklift.plant.simulate import simulate_plant
from forklift.plant.subjects import subject
from forklift.report import words
from forklift.report.of_diagnosis import diagnosis_page
from forklift.report.traces import instants, recording_of
from pages import FETCHING, ROOMY_BYTES, Text, drawn, in_a_notebook

OF_A_FORKLIFT = re.compile(r"truck|\blift|mast|valve|velocity|forks", re.IGNORECASE)
SECTIONS = ["Evidence", "Doubts", "Next steps", "Provenance"]


def line(**changed):
    """y = k u, and z = −k u, which the sensor of z reads up to 3."""
    bend = Effect(
        "bend", "it bends", (Param("c", "1/V", 0.0, -1.0, 1.0),), ("law",),
        lambda x, u, p, bus: {"law": p["c"] * u["u"] ** 2}, source="a book",
    )  # fmt: skip
    given = {
        "name": "line",
        "params": (Param("k", "1", 1.0, 0.1, 10.0),),
        "inputs": (Input("u", "V"), Input("d", "V/s", derived=lambda t, u: np.gradient(u["u"], t))),
        "outputs": (Output("y", "V", sigma=0.05), Output("z", "mV", sigma=0.05, upper=3.0)),
        "out": lambda t, x, u, w, p, bus: {"y": p["k"] * u["u"] + w["law"], "z": -p["k"] * u["u"]},
        "ports": (Port("law", "V", kind="law"),),
        "effects": (bend,),
        "score": "algebraic",
    }
    return Plant(**{**given, **changed})


def recorded(plant, present=("bend",), roles=("estimate", "validate"), sizes=(0.3,), count=3):
    found = []
    for k in range(count):
        random = np.random.default_rng(k)
        u = random.uniform(-2.0, 2.0, 120)
        bends = {"k": 2.0} | dict(zip(["bend.c"] if present else [], sizes, strict=False))
        true = simulate_plant(plant, np.arange(120.0), {"u": u}, bends, present)
        y = true["y"] + random.normal(0.0, 0.05, 120)
        z = np.minimum(true["z"] + random.normal(0.0, 0.05, 120), 3.0)
        y[10:20], z[::2] = np.nan, np.nan  # alone between gaps
        role = roles[0] if k else roles[-1]
        found.append(Recording(f"<r{k}>", np.arange(120.0), {"u": u}, {"y": y, "z": z}, role, f"g{k}"))
    return found


@pytest.fixture(scope="module")
def bent() -> Diagnosis:
    plant = line()
    return diagnose(plant, recorded(plant), candidates=[
        Recording("a ramp", np.arange(50.0), {"u": np.linspace(-2.0, 2.0, 50)}, {})
    ])  # fmt: skip


@pytest.fixture(scope="module")
def folder(bent, tmp_path_factory):
    return bent.write(tmp_path_factory.mktemp("plant") / "found")


def test_the_folder_holds_the_page_and_the_json_and_is_replaced_whole(bent, folder, told, tmp_path):
    assert sorted(one.name for one in folder.iterdir()) == [
        "diagnosis.json",
        *(["next_recording.csv"] if bent.next_recording else []),
        "parameters.json",
        "predictions",
        "report.html",
        "times.json",
    ]
    assert told == json.loads(json.dumps(bent.to_dict()))
    assert bent.write(folder) == folder
    other = tmp_path / "mine"
    other.mkdir()
    (other / "notes.txt").write_text("mine")
    with pytest.raises(ForkliftError) as error:
        bent.write(other)
    assert error.value.code == "output-exists"
    with pytest.raises(ForkliftError) as error:
        bent.write(tmp_path / "missing" / "found")
    assert error.value.code == "not-writable"


def test_the_verdict_comes_first_and_then_the_short_answers(bent, told, said):
    assert said.of("h1") == [bent.sentence]
    assert said.of("h2") == SECTIONS
    first = said.everything[: said.everything.index("Before is the model")]
    (row,) = (row for row in told["parameters"] if row["name"] == "bend.c")
    after = row["after"]
    value, lower, upper = words.size(after["value"], after["lower"], after["upper"])
    for what in (
        "What is wrong, and how much? It bends",
        f"bend.c = {value} 1/V (95 % interval {lower} to {upper})",
        "Where? At law, a law",
        "How sure is “it bends”?",
        f"{len(told['hypotheses'])} hypotheses considered",
        "How much better does the model get? Left over",
        "What could it be instead?",
        "What to record next?",
    ):
        assert what in first, what
    assert "NaN" not in said.everything
    assert after["lower"] <= 0.3 <= after["upper"]


def test_the_sentence_of_outputs_in_several_units_counts_in_noise(bent):
    assert "times the noise power" in bent.sentence
    plant = line(outputs=(Output("y", "V", sigma=0.05),), out=lambda t, x, u, w, p, bus: {
        "y": p["k"] * u["u"] + w["law"]
    })  # fmt: skip
    recordings = [replace(one, y={"y": one.y["y"]}) for one in recorded(line())]
    alone = diagnose(plant, recordings)
    assert re.search(r"root mean square error on recordings held out falls from \S+ to \S+ V", alone.sentence)


def test_every_number_of_the_tables_is_the_jsons(told, said):
    rows = {tuple(row) for row in said.rows}
    for one in told["fit"]:
        errors = tuple(words.number(one[f"rmse_{when}"]) for when in ("before", "after"))
        assert any(
            row[0] == one["file"] and row[2] == one["channel"] and errors == row[-3:-1] for row in rows
        )
    for one in told["groups"]:
        squares = (one["mean_square_before"], one["mean_square_after"], one["mean_square_alone"])
        assert any(row[:4] == (one["group"], *map(words.number, squares)) for row in rows)
    for one in told["parameters"]:
        assert any(row[0] == one["name"] and f"{one['after']['value']:.5g}" in row for row in rows)
        assert one["before"] is None or any(f"{one['before']['value']:.5g}" in row for row in rows)
    for one in told["recordings"]:
        assert (one["file"], one["role"], one["sha256"]) in rows
    assert len(told["recordings"]) == 3
    assert len({one["sha256"] for one in told["recordings"]}) == 3


def test_every_output_is_drawn_with_its_gaps_and_every_input_below(bent, page):
    explorer = next(block for block in drawn(page) if "recordings" in block)
    assert explorer["sides"] == ["before", "after"]
    assert [one["title"] for one in explorer["recordings"]] == ["<r0>", "<r1>", "<r2>"]
    first = explorer["recordings"][0]
    assert [(one["title"], one["unit"]) for one in first["signals"]] == [("y", "V"), ("z", "mV")]
    assert [(one["title"], one["unit"]) for one in first["drives"]] == [("u", "V"), ("d", "V/s")]
    y = first["signals"][0]["curves"]
    assert y["measured"][10:20] == [None] * 10
    assert None not in y["after"]
    recording = bent.before.predictions[0].recording
    assert y["measured"][0] == pytest.approx(recording.y["y"][0], rel=1e-4)
    assert max(first["signals"][1]["curves"]["after"]) == 3.0  # as the sensor would read it


def test_what_is_asked_for_the_law_and_the_rivals_are_drawn(bent, page, said):
    titles = [block["title"] for block in drawn(page)]
    assert "What the recordings ask for: law, a law" in titles
    assert "The law that was found" in titles
    law = next(block for block in drawn(page) if block["title"] == "The law that was found")
    dots = next(one for one in law["panels"][0]["data"] if one["mode"] == "markers")
    np.testing.assert_allclose(dots["y"], bent.numbers[-1].value * np.square(dots["x"]), rtol=1e-3, atol=1e-3)
    assert words.number(bent.baseline.reduced_chi2) in said.of("b")
    assert any("Source: a book." in item for item in said.of("li"))


def test_no_machine_is_told_as_a_forklift(page, said):
    everything = said.everything.replace("forklift.simulate_plant", "").replace("forklift 0", "")
    assert not OF_A_FORKLIFT.search(everything.replace("forklift", "")), OF_A_FORKLIFT.search(everything)
    text = page.replace(get_plotlyjs(), "")
    assert not FETCHING.search(text)
    assert len(page.encode()) < 0.75 * ROOMY_BYTES
    assert "<r0>" not in text.partition('id="data"')[0]  # a recording's name is escaped


def test_the_call_that_simulates_what_was_found_does(bent, said):
    (code,) = said.of("code")
    import forklift

    time = np.arange(120.0)
    y = eval(
        code,
        {"forklift": forklift, "plant": line(), "time_s": time, "u": bent.before.predictions[0].recording.u},
    )
    np.testing.assert_allclose(y["y"], bent.after.predictions[0].outputs["y"], atol=1e-4)


@pytest.mark.parametrize(
    ("before", "after", "unit", "better", "shows"),
    [
        (96.68, 97.02, "%", "rises", True),
        (96.68, 96.48, "%", "rises", False),
        (96.68, 96.72, "%", "rises", False),  # as printed the same
        (0.02, 0.01, "V", "falls", True),
        (0.01, 0.02, "V", "falls", False),
    ],
)
def test_a_gain_that_is_none_is_not_told_as_one(before, after, unit, better, shows):
    assert Gain("the fit", before, after, unit, better).shows is shows


def test_a_notebook_gets_the_sentence_and_a_table(bent):
    shown = in_a_notebook(bent)
    assert len(shown) < 3_000
    assert Text(shown).of("p") == [bent.sentence]
    assert "bend.c = " in shown


def whole(found):
    """The page's text, with every section there and nothing undefined."""
    text = Text(diagnosis_page(found))
    assert text.of("h2") == SECTIONS
    assert not re.search(r"\b(nan|inf|None|NaN)\b", text.everything)
    json.dumps(found.to_dict(), allow_nan=False)
    assert Text(in_a_notebook(found)).of("p") == [found.sentence]
    return text


def test_no_mismatch_is_said_as_plainly():
    plant = line()
    text = whole(diagnose(plant, recorded(plant, ())))
    assert "Nothing that these recordings show." in text.of("strong")
    assert "Of a recording held out nothing is adjusted." in text.everything
    assert "The farthest from where they began is k: " in text.everything
    (heads,) = [row for row in text.rows if "Tried from" in row]
    fates = [row[-1] for row in text.rows if len(row) == len(heads) and row[-1].startswith("not tried")]
    assert "not tried: less than the 12 asked of its kind" in fates
    assert "→" not in " ".join(cell for row in text.rows for cell in row)


def test_what_has_no_name_is_said_and_drawn():
    plant = line()
    blind = line(effects=())
    for found in (
        diagnose(blind, recorded(plant)),
        replace(diagnose(blind, recorded(plant)), causes=(), verdict="unknown-effect"),
    ):
        assert found.verdict == "unknown-effect"
        whole(found)


def test_a_group_that_fits_no_law_is_named_on_the_first_screen(bent):
    first, *others = bent.groups
    odd = replace(first, alone=50.0, before=1.0, after=2.0)
    text = whole(replace(bent, groups=(odd, *others)))
    screen = text.everything[: text.everything.index("Before is the model")]
    assert f"{first.group} fits no law that fits the others: see Doubts." in screen
    assert f"It does not hold in {first.group}, predicted from the others" in screen
    assert any(row[-1] == "fits no law" for row in text.rows if row)


def test_without_a_recording_held_out_that_is_said_aloud():
    plant = line()
    found = diagnose(plant, recorded(plant, roles=("estimate",)))
    text = whole(found)
    assert "it was fitted on" in found.sentence
    assert any("No recording was held out" in item for item in text.of("li"))
    assert "It cannot be said: no recording was held out" in text.of("strong")
    assert "credibility" not in str(found).partition("rival")[0]


def test_restarts_are_joined_to_whole_recordings():
    plant = Plant(
        "decay",
        (Param("a", "1/s", 0.5, 0.05, 5.0), Param("gain", "1", 1.0, 0.5, 2.0, per="recording")),
        (Input("u"),),
        (Output("y", sigma=0.01), Output("rare", sigma=0.01)),
        lambda t, x, u, w, p, bus: {"y": x["x"], "rare": p["gain"] * x["x"]},
        states=(State("x", start="y"),),
        rhs=lambda t, x, u, w, p, bus: {"x": u["u"] - p["a"] * x["x"]},
        score="restart",
        horizon_s=2.0,
    )
    time = np.linspace(0.0, 10.0, 101)
    recordings = []
    for seed, role in ((1, "estimate"), (2, "validate")):
        random = np.random.default_rng(seed)
        u = np.repeat(random.uniform(0.0, 2.0, 11), 10)[:101]
        y = simulate_plant(replace(plant, params=(plant.params[0], Param("gain", "1", 1.0))), time, {"u": u})
        noisy = {name: values + random.normal(0.0, 0.01, 101) for name, values in y.items()}
        if role == "validate":
            del noisy["rare"]
        recordings.append(Recording(f"r{seed}", time, {"u": u}, noisy, role))
    found = diagnose(plant, recordings)
    assert found.after.fits.select("file", "channel", "samples").rows() == [
        ("r1", "y", 101), ("r1", "rare", 101), ("r2", "y", 101),  # one sample alone ends the piece before
    ]  # fmt: skip
    text = whole(found)
    assert any("Not recorded: rare in r2." in item for item in text.of("li"))
    assert "start anew every 2 s" in text.everything


def test_where_something_acts_is_said_once():
    at = subject(line()).words.at
    assert at("the input's zero is off", "u") == "the input's zero is off (u)"
    assert at("k is known within a range only", "k") == "k is known within a range only"
    assert at("it bends", "") == "it bends"


def test_a_sensor_that_stands_still_is_told_and_its_samples_are_left_out():
    plant = line(outputs=(Output("y", "V", sigma=0.05), Output("z", "mV", sigma=0.05)))
    recordings = recorded(plant, ())
    stuck = recordings[1].y["y"].copy()
    stuck[60:90] = stuck[60]
    recordings[1] = replace(recordings[1], y={**recordings[1].y, "y": stuck})
    found = diagnose(plant, recordings)
    (one,) = found.findings.invalid
    assert (one.file, one.channel, one.from_s, one.to_s, one.how) == ("<r1>", "y", 60.0, 89.0, "stuck")
    assert found.verdict == "sensor-fault"
    whole(found)


def test_a_stretch_leads_to_its_recording_whatever_that_is_called():
    plant = Plant(
        "p", (Param("a", "1", 1.0),), (Input("u"),), (Output("y"),), lambda *_: {},
        (State("x", start="y"),), rhs=lambda *_: {}, score="restart", horizon_s=0.5,
    )  # fmt: skip
    time = np.linspace(0.0, 2.0, 21)
    whole = Recording("a", time, {"u": time}, {"y": time})
    for one in (whole, *whole.split(0.6)):
        assert {recording_of(piece.file) for piece in NumpyMachine(plant).pieces(one)} == {one.file}
        assert recording_of(one.file) == one.file


def test_times_far_from_zero_are_drawn_apart():
    times = 43200.0 + 0.02 * np.arange(100)
    assert instants(times) == pytest.approx(times.tolist(), abs=1e-6)
    assert len(set(instants(times))) == len(times)

"""The page of a diagnosis says what its JSON says, needs no other file, and escapes what files hold."""

import re
from dataclasses import replace
from string import Formatter
from typing import get_args

import numpy as np
import pytest
from plotly.offline import get_plotlyjs

from campaigns import CAMPAIGNS
from diagnosed import diagnosed
from forklift import Campaign, Truck, commands, compare
from forklift.base.typeset import as_precise
from forklift.plant.forklift.candidates import NextRecording
from forklift.plant.forklift.effects import EFFECTS, Equation
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.vocabulary import EQUATIONS, SHOWN, ForkliftWords
from forklift.recordings.channels import channels
from forklift.report import law, words
from forklift.report.blocks import Explorer, Page, Section
from forklift.report.of_diagnosis import diagnosis_page
from forklift.report.page import html
from forklift.report.tables import mean_square, percent
from forklift.report.traces import decimate, replays
from pages import FETCHING, ROOMY_BYTES, Text, drawn, in_a_notebook

WORDS = ForkliftWords()


@pytest.fixture(scope="module")
def leak():
    return diagnosed("leak")


@pytest.fixture(scope="module")
def folder(leak, tmp_path_factory):
    return leak.write(tmp_path_factory.mktemp("diagnosis") / "found")


@pytest.fixture(scope="module")
def blocks(page):
    return drawn(page)


def test_the_verdict_comes_first(told, said):
    assert said.of("h1") == [told["sentence"]]
    before = said.everything.partition(told["sentence"])[0]
    assert not re.search(r"\d", before)


def test_the_first_screen_says_cause_place_size_credibility_gain_and_rivals(leak, told, said):
    first = said.everything[: said.everything.index("Before is the truck")]
    (cause,) = told["causes"]
    contest = "No rival came near"
    row = cause["parameters"][0]
    value, lower, upper = words.size(row["value"], row["lower"], row["upper"])
    gain = told["fit_summary"]["validate"]
    for what in (
        "Oil leaks from the cylinder, or past its valve (main lift)",
        "The main lift: the oil balance of the cylinder",
        f"{value} m³/(s Pa) (95 % interval {lower} to {upper})",
        f"Credibility {cause['credibility']:.2f} of 1" if cause["rivals"] else contest,
        f"Velocity fit {gain['nrmse_before']:.1f} → {gain['nrmse_after']:.1f} %",
        f"{gain['gain']:.2f} points (95 % interval {gain['gain_lower']:.2f} to {gain['gain_upper']:.2f})",
        *(
            f"{name} {' → '.join(as_precise(scale * one['before'], scale * one['after']))} {unit}"
            for one in told["errors"]
            for name, unit, scale in [WORDS.fine(one["channel"], one["unit"])]
        ),
        f"{len(told['hypotheses'])} hypotheses considered",
        words.number(told["left_over"]["worst_before"]),
        words.number(told["left_over"]["worst_after"]),
        "What could it be instead?",
        "What to record next?",
        "The machine does so; a sound one hardly does.",
        "hold a load and look at the valve's return line",
    ):
        assert " ".join(what.split()) in first, what
    assert "NaN" not in first
    assert "posterior" not in first


def test_every_number_of_the_tables_is_the_jsons(told, said):
    rows = {tuple(row) for row in said.rows}
    for fit in told["fit"]:
        numbers = (fit["nmse_before"], fit["nmse_after"], fit["nrmse_before"], fit["nrmse_after"])
        cells = (fit["file"], fit["role"], fit["channel"], *map(percent, numbers))
        assert any(row[:7] == cells for row in rows)
    for one in told["unknown_inputs"]:
        place = WORDS.place(one["port"])[0]
        assert (place, f"{one['ln_evidence']:.0f}", mean_square(one["left_over"])) in rows
    for one in told["hypotheses"]:
        promised = "—" if one["promised"] is None else words.number(one["promised"])
        name = words.capital(WORDS.at(one["name"], one["where"]))
        fates = [row[3] for row in rows if len(row) == 4 and (row[0], row[2]) == (name, promised)]
        (fate,) = fates
        assert ("named" in fate) == one["named"]
        assert ("given up" in fate) == one["given_up"]
        assert not one["fitted"] or words.number(one["left_over"]) in fate
    for share in told["misfit"]:
        assert any(row[1:3] == (share["name"], mean_square(share["mean_square"])) for row in rows)
    for one in told["parameters"]:
        sides = [
            text
            for when in ("before", "after")
            for text in (
                (f"{one[when]['value']:.5g}", f"{one[when]['lower']:.4g} to {one[when]['upper']:.4g}")
                if one[when]
                else ("—", "—")
            )
        ]
        assert (one["name"], f"{one['start']:.5g}", *sides, words.printed(one["unit"]), "") in rows
    for file in told["campaign_facts"]["recordings"]:
        assert any(row[0] == file["file"] and row[2:] == (file["sha256"],) for row in rows)
    for test in told["deficient"]["after"]["tests"]:
        assert any(row[:2] == ("after", test["test"]) and row[5] == f"{test['p']:.1g}" for row in rows)


def test_rivals_stand_with_what_they_leave_over_and_their_credibility(told, said):
    numbers = said.of("b")
    assert numbers[0] == words.number(told["left_over"]["before"])
    assert numbers[1] == words.number(told["left_over"]["after"])
    for rival in told["causes"][0]["rivals"]:
        assert words.number(rival["left_over"]) in numbers
        assert f"credibility {rival['credibility']:.2f}" in said.everything


def test_every_operating_point_is_told_before_and_after(leak, said):
    assert "Velocity of the main lift, before → after" in said.everything
    before, after = (
        {
            row["file"]: row["nrmse_percent"]
            for row in side.held_out.iter_rows(named=True)
            if row["channel"] == "velocity_main_m_s"
        }
        for side in (leak.before, leak.after)
    )
    assert len(after) == 6
    for file in after:
        change = f"{percent(before[file])} → {percent(after[file])}"
        assert any(row[-1] == file and change in row for row in said.rows), file


def test_doubts_next_recording_and_provenance_are_told(told, said):
    assert said.of("h2") == ["Evidence", "Doubts", "Next steps", "Provenance"]
    assert told["next_recording_why"][1:] in said.everything
    assert told["deficient"]["after"]["sentence"] in said.of("li")
    for sha256 in (told["campaign_facts"]["sha256"], told["start"]["sha256"], told["truck"]["sha256"]):
        assert sha256 in said.everything
    simulate, again = said.of("code")
    assert simulate.startswith("forklift simulate --truck truck.toml --lift main ")
    assert again == told["command"]
    assert told["command"].startswith("forklift diagnose ")
    assert told["forklift"] in said.everything


def test_every_recording_is_drawn_and_keeps_its_peaks(leak, blocks):
    explorer = next(block for block in blocks if "recordings" in block)
    assert explorer["sides"] == ["before", "after"]
    assert explorer["recordings"][0]["title"].startswith("main_prms2")  # held out first
    by_file = {one["title"]: one for one in explorer["recordings"]}
    assert set(by_file) == {one.file for one in leak.recordings}
    for prediction in leak.after.predictions:
        signals = {one["title"]: one for one in by_file[prediction.recording.file]["signals"]}
        assert len(signals) == len(prediction.signals)
        for signal in prediction.signals:
            curves = signals[words.capital(WORDS.signal(signal.channel))]["curves"]
            scale = SHOWN[(outputs() | channels())[signal.channel]["unit"]][2]
            for name, values in (("measured", signal.measured), ("after", signal.simulated)):
                shown = np.array(curves[name], float)
                for end in (np.nanmin, np.nanmax):
                    assert end(shown) == pytest.approx(scale * end(values), rel=1e-4, abs=1e-9)
    first = explorer["recordings"][explorer["first"][0]]
    assert first["title"] == leak.baseline.worst.file


def test_the_error_of_a_drawn_curve_and_what_is_left_over_are_told_apart(leak, told, blocks):
    """The one is RMSE²/σ²; the other was judged with parameters moved within their uncertainty."""
    explorer = next(block for block in blocks if "recordings" in block)
    channel, sensor = "pressure_main_pa", leak.sensors["pressure_main_pa"]
    rows = {row["file"]: row for row in told["fit"] if row["channel"] == channel}
    for one in explorer["recordings"]:
        note = next(s["note"] for s in one["signals"] if s["title"] == "Pressure of the main lift")
        squared, left = (
            re.search(r"squared (\S+) → (\S+) times", note),
            re.search(r"left over (\S+) → (\S+) ", note),
        )
        row = rows[one["title"]]
        for when, said, judged, side in zip(
            ("before", "after"), squared.groups(), left.groups(), (leak.baseline, leak.final), strict=True
        ):
            assert float(said) == pytest.approx((row[f"rmse_{when}"] / sensor.noise) ** 2, rel=5e-3)
            (own,) = (c for c in side.judged if (c.file, c.channel) == (one["title"], channel))
            assert float(judged) == pytest.approx(float(np.mean(own.left**2)), rel=5e-3, abs=5e-3)


def test_the_mismatch_is_seen_in_the_colours_where_it_is(leak, blocks):
    heat = next(block for block in blocks if block.get("title", "").startswith("Where the difference lies"))
    before, after = heat["panels"][0]["data"][:2]
    assert (before["name"], after["name"]) == ("before", "after")
    assert set(before["y"]) == {one.file.removesuffix(".csv") for one in leak.recordings}
    strong = [value for row in before["z"] for value in row if value is not None]
    weak = [value for row in after["z"] for value in row if value is not None]
    assert max(strong) == 1.0
    assert max(weak) < 0.4


def test_errors_are_those_of_recordings_held_out(leak, told):
    """In SI: each signal's, over all samples together."""
    (one,) = (row for row in told["errors"] if row["channel"] == "velocity_main_m_s")
    for when, side in (("before", leak.before), ("after", leak.after)):
        found = [
            prediction.signal("velocity_main_m_s")
            for prediction in side.predictions
            if prediction.recording.role == "validate"
        ]
        off = np.concatenate([signal.simulated - signal.measured for signal in found])
        assert one[when] == pytest.approx(float(np.sqrt(np.nanmean(off**2))), rel=1e-6)
    assert one["recordings"] == len(found)
    assert one["after"] < one["before"]


def test_what_the_sensors_noise_would_leave_is_drawn_behind_the_difference(leak, blocks):
    explorer = next(block for block in blocks if "recordings" in block)
    signals = {one["title"]: one for one in explorer["recordings"][0]["signals"]}
    low, high = signals["Pressure of the main lift"]["band"]
    assert low == pytest.approx(-high)
    low, high = signals["Position of the main lift"]["band"]  # an encoder reads the count below
    assert 0.0 < low < high
    assert signals["Velocity of the main lift"]["band"] is None


def test_values_are_told_with_their_gaps():
    assert words.spans([18.0, 21.0, 29.0, 32.0, 58.0, 60.0, 61.0]) == [(18.0, 32.0), (58.0, 61.0)]
    assert words.stretches([0.0, 800.0, 1000.0, 1500.0, 0.0]) == "0 and 800 to 1000 and 1500"
    assert words.spans([20.0, 20.0]) == [(20.0, 20.0)]
    assert words.spans([]) == []


def test_a_campaign_without_a_name_of_its_own_has_its_folders(leak, tmp_path):
    campaign = Campaign.read(CAMPAIGNS / "leak")
    assert campaign.title == "campaign “leak”"
    nameless = replace(campaign, name="campaign", folder=tmp_path / "thermfric")
    assert nameless.title == "campaign “thermfric”"
    assert replace(nameless, folder=None).title == "a campaign"


def test_the_final_model_has_the_law_that_the_recordings_ask_for(leak):
    """Found without knowing any cause, and fitted: both curves lie on each other."""
    place = law.place_of(leak)
    assert place.port == "main.cylinder_flow"
    for found in law.against(leak, place):
        assert found.law is not None
        assert (np.abs(found.law - found.curve) <= found.band).mean() >= 0.8
        assert (found.band > 0.0).all()


def test_the_page_is_self_contained_and_small_enough_to_send(page):
    assert len(page.encode()) < ROOMY_BYTES
    script = get_plotlyjs()
    assert page.count(script) == 1
    rest = page.replace(script, "")
    assert not FETCHING.search(rest)
    assert "http" not in rest


def test_thirty_recordings_fit_a_mail():
    null = Campaign.read(CAMPAIGNS / "null")
    many = tuple(
        replace(one, file=f"{copy}_{one.file}")
        for copy in range(3)
        for one in null.recordings
    )[:30]  # fmt: skip
    both = compare(Campaign("many", null.sample_rate_hz, many), Truck.read("thesis"))
    sides = {"before": both.agreement, "after": both.agreement}
    recordings = replays(both.machine, sides, lambda file, channel: "", {})
    explorer = Explorer("", "", ["before", "after"], recordings)
    page = html(Page("", "", "", (), (), [Section("evidence", "Evidence", "", [explorer])], {}))
    assert len(page.encode()) < 0.95 * ROOMY_BYTES  # tables and the other figures come on top


def test_nothing_from_a_file_reaches_the_page_unescaped(leak):
    evil = "</script><script>alert(1)</script><b>'\"&"
    files = {leak.recordings[0].file: evil}
    recordings = tuple(replace(one, file=files.get(one.file, one.file)) for one in leak.recordings)
    sides = {
        when: replace(
            side,
            predictions=tuple(
                replace(one, recording=recording)
                for one, recording in zip(side.predictions, recordings, strict=True)
            ),
        )
        for when, side in (("before", leak.before), ("after", leak.after))
    }
    refits = {
        when: replace(
            refit,
            told=tuple(replace(one, file=files.get(one.file, one.file)) for one in refit.judged),
            rest=tuple,
        )
        for when, refit in (("baseline", leak.baseline), ("final", leak.final))
    }
    origin = replace(leak.origin, name=evil, title=evil)
    other = replace(
        leak, origin=origin, recordings=recordings, **sides, selection=replace(leak.selection, **refits)
    )
    page = diagnosis_page(other)
    assert "alert(1)" in page
    assert "<script>alert" not in page
    assert "<b>'" not in page
    assert page.count("</script>") == diagnosis_page(leak).count("</script>")
    assert "<script>alert" not in in_a_notebook(other)


def test_no_mismatch_is_said_as_plainly():
    found = diagnosed("null")
    said = Text(diagnosis_page(found))
    assert said.of("h1") == [found.sentence]
    assert "Nothing that these recordings show." in said.of("strong")
    assert "There is nothing to gain." in said.of("strong")
    assert "→" not in " ".join(cell for row in said.rows for cell in row)  # there is no before


def test_notebooks_get_a_short_table(leak, null_fit):
    for result, first in (
        (leak, leak.sentence),
        (null_fit, null_fit.sentences[0]),
        (null_fit.after, null_fit.after.sentences[0]),
    ):
        shown = in_a_notebook(result)
        assert len(shown) < 5_000
        assert "<script" not in shown
        text = Text(shown)
        assert text.of("p")[0] == first
        assert text.rows


def test_every_equation_and_every_effect_has_words():
    assert set(EQUATIONS) == set(get_args(Equation))
    for effect in EFFECTS:
        named = {name for _, name, _, _ in Formatter().parse(effect.sentence) if name} - {"lift"}
        hypothesis = replace(
            diagnosed("leak").causes[0].hypothesis, id=effect.id, name=effect.name, where="main"
        )
        rows = [{"name": f"main.{effect.id}.{name}", "value": 0.0123, "unit": "1/K"} for name in named]
        text = WORDS.sentence(hypothesis, rows)
        assert "{" not in text
        assert "degC" not in text
        if named:
            assert "0.0123 1/K" in text
        assert text == WORDS.sentence(hypothesis, rows)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "—"), (0.0, "0"), (1.5e-12, "1.5\u00a0×\u00a010⁻¹²"), (19447.0, "19400"), (-0.25, "−0.25"),
        (999.96, "1000"), (0.78612, "0.786"), (2.5e9, "2.5\u00a0×\u00a010⁹"),
    ],
)  # fmt: skip
def test_numbers_are_said_as_print_has_them(value, text):
    assert words.number(value) == text


def test_the_ends_of_an_interval_differ_even_if_it_is_narrow():
    value, lower, upper = words.size(1.4991e-12, 1.494e-12, 1.504e-12)
    assert [text.split()[0] for text in (lower, value, upper)] == ["1.494", "1.499", "1.504"]


def test_units_are_printed():
    assert [words.printed(unit) for unit in ("m3/(s Pa)", "degC", "1", "1/A2", "Pa s2/m6")] == [
        "m³/(s Pa)", "°C", "", "1/A²", "Pa s²/m⁶",
    ]  # fmt: skip


def test_thinning_keeps_the_peaks_of_every_curve():
    random = np.random.default_rng(1)
    time = np.linspace(0.0, 100.0, 20_000)
    curves = random.standard_normal((3, len(time)))
    curves[1, 777], curves[2, 4_000:4_400] = 50.0, np.nan
    thin, *kept = decimate(500, time, *curves)
    assert len(thin) <= 502
    assert (np.diff(thin) > 0.0).all()
    for curve, thinned in zip(curves, kept, strict=True):
        assert (np.nanmin(thinned), np.nanmax(thinned)) == (np.nanmin(curve), np.nanmax(curve))


def test_what_cannot_be_told_apart_is_said_first_with_the_recording_that_would(leak):
    (cause,) = leak.causes
    rival = replace(cause.hypothesis, id="friction_pressure", name="friction grows with the pressure")
    command = commands.generate("prms", "main", duration_s=4.0, seed=3)
    other = replace(
        leak,
        causes=(replace(cause, not_separable_from=(rival,)),),
        next_recording=NextRecording("main", 800.0, 40.0, command, "because"),
        next_why="pseudo-random steps: the recording parts them",
    )
    page = diagnosis_page(other)
    said, name = Text(page), WORDS.at(rival.name, rival.where)
    assert f"Not sure: it cannot be told from “{name}”" in said.of("strong")
    assert f"{words.capital(name)}: these recordings cannot tell." in said.of("strong")
    assert "The main lift, 800 kg, oil at 40 °C" in said.of("strong")
    assert f"It would tell the cause from this: “{name}”." in said.of("p")
    assert "Pseudo-random steps: the recording parts them." in said.of("p")
    sensor = replace(other.causes[0], not_separable_from=(replace(rival, kind="sensor"),))
    blamed = "The machine does so; a sound one hardly does."
    assert blamed in said.of("p")
    assert blamed not in Text(diagnosis_page(replace(other, causes=(sensor,)))).of("p")
    assert ["File of what drives it, beside this page", "next_recording.csv"] in said.rows
    assert any(text.startswith("forklift simulate --command next_recording.csv") for text in said.of("code"))
    (figure,) = (block for block in drawn(page) if block["title"].startswith("To record: "))
    (shown,) = (panel["data"] for panel in figure["panels"])
    assert max(shown[0]["y"]) == pytest.approx(command.current_main_a.max(), rel=1e-4)


def test_recordings_in_which_nothing_moves_are_no_good_news(leak):
    still = replace(
        leak, findings=replace(leak.findings, unexcited="no valve opens"), causes=(), next_recording=None
    )
    said = Text(diagnosis_page(still))
    assert said.of("strong")[:3] == [
        "It cannot be told.",
        f"Any of {len(still.to_dict()['untestable'])} hypotheses, or nothing",
        "Recordings in which something moves.",
    ]
    assert "No valve opens." in said.of("p")


def test_a_sensors_fault_is_not_told_as_a_gain_in_the_velocity(leak):
    (cause,) = leak.causes
    sensor = replace(
        cause.hypothesis, kind="sensor", id="pressure_gain", where="pressure_main_pa", name="its gain is off"
    )
    other = replace(leak, causes=(replace(cause, hypothesis=sensor),))
    left = other.to_dict()["left_over"]
    said = Text(diagnosis_page(other))
    change = f"Left over {words.number(left['worst_before'])} → {words.number(left['worst_after'])}"
    assert change in said.of("strong")
    assert "velocity" not in said.of("h1")[0]

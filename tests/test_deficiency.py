"""White noise passes every test at its level, what is planted is found, and shares of the misfit add up."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from campaigns import CAMPAIGNS
from forklift import Campaign
from forklift.diagnosis.deficiency import autoregression, deficiency, holm, quadratic
from forklift.diagnosis.misfit import band_names, shares
from forklift.fitting.residuals import ChannelResidual, ljung_box
from forklift.plant.forklift.covariates import covariates
from forklift.plant.forklift.phases import PHASES, of_recording, phases
from forklift.plant.forklift.sensors import sensors
from test_diagnosis import diagnosed

N, RATE = 400, 50.0
FILES = tuple(f"r{k}" for k in range(5))


def judged(left, channel="pressure", file="r0"):
    rows = np.arange(len(left))
    white = ljung_box(left)
    return ChannelResidual(
        file, "validate", "free", channel, len(left), float(np.mean(left**2)), white, rows, left
    )


def command(random):
    """Steps of a random height, held for a while."""
    return np.repeat(random.normal(size=N // 20), 20)[:, None]


def known(random):
    """What may matter: two commands, and a load that is constant in each recording."""
    loads = np.linspace(-1.0, 1.0, len(FILES))
    return {
        file: {
            "command": np.hstack([command(random), command(random)]),
            "load": np.full((N, 1), load),
        }
        for file, load in zip(FILES, loads, strict=True)
    }


def test_white_noise_fails_any_test_no_more_often_than_the_level():
    failed = 0
    for seed in range(200):
        random = np.random.default_rng(seed)
        found = [judged(random.normal(size=N), channel, file) for channel in ("a", "b") for file in FILES]
        failed += deficiency(found, known(random)).deficient
    assert failed <= 6  # of 200 at 1 %: more come with a probability of 0.4 %


def test_the_score_of_white_noise_is_chi_square_even_through_its_own_whitening():
    random = np.random.default_rng(1)
    p = []
    for _ in range(300):
        noise = random.normal(size=N)
        coloured = np.convolve(noise, [1.0, 0.6, 0.2])[:N]
        filtered = autoregression([coloured])
        white = np.convolve(coloured, filtered)[:N]
        columns = np.column_stack([np.convolve(command(random)[:, 0], filtered)[:N] for _ in range(3)])
        q, degrees = quadratic(columns.T @ white, np.mean(white**2) * columns.T @ columns)
        p.append(chi2.sf(q, degrees))
    assert kstest(p, "uniform").pvalue > 0.01


def test_the_filter_whitens_what_it_was_drawn_from_and_leaves_white_noise_alone():
    random = np.random.default_rng(2)
    series = [np.convolve(random.normal(size=2000), 0.8 ** np.arange(50))[:2000] for _ in range(3)]
    filtered = autoregression(series)
    assert filtered[1] == pytest.approx(-0.8, abs=0.1)
    assert ljung_box(np.convolve(series[0], filtered)[:2000]) > 1e-3
    assert len(autoregression([random.normal(size=2000)])) <= 4
    assert autoregression([np.zeros(100)]).tolist() == [1.0]


def test_what_is_planted_is_found_and_named():
    random = np.random.default_rng(3)
    columns = known(random)
    for variable in ("command", "load"):
        found = [
            judged(random.normal(size=N) + 0.4 * columns[file][variable][:, 0], "a", file) for file in FILES
        ]
        result = deficiency(found, columns)
        named = {test.against for test in result.failures if test.test == "correlation"}
        assert named == {variable}
        assert variable in result.sentence
    loud = deficiency([judged(1.4 * random.normal(size=N), "a", file) for file in FILES], columns)
    assert {test.test for test in loud.failures} == {"goodness of fit"}
    slow = np.convolve(random.normal(size=N + 9), np.ones(10) / np.sqrt(10.0), "valid")
    others = [judged(random.normal(size=N), "a", file) for file in FILES[1:]]
    coloured = deficiency([judged(slow, "a"), *others], columns)
    assert "whiteness" in {test.test for test in coloured.failures}
    json.dumps(coloured.to_dict())


def test_an_encoder_is_judged_by_its_size_only():
    random = np.random.default_rng(4)
    columns = known(random)
    found = [judged(columns[file]["command"][:, 0], "a", file) for file in FILES]
    assert {test.test for test in deficiency(found, columns, {"a"}).tests} <= {
        "goodness of fit",
        "whiteness",
    }


def test_holm_is_monotone_never_below_the_raw_values_and_right_in_a_worked_example():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    random = np.random.default_rng(5)
    for _ in range(50):
        raw = random.random(12) ** 3
        corrected = np.array(holm(raw))
        assert np.all(corrected >= raw)
        assert np.all(np.diff(corrected[np.argsort(raw)]) >= 0.0)
        assert np.all(corrected <= 1.0)
    assert holm([]) == []


def checked(found, refit):
    sensors = {seen.sensor.channel: seen.sensor for seen in refit.found.problem.samples[0].observed}
    columns = covariates(found.recordings, refit.judged, sensors)
    return deficiency(refit.judged, columns, {name for name, one in sensors.items() if one.count})


def test_a_recording_without_an_encoder_has_the_same_columns():
    recordings = list(Campaign.read(CAMPAIGNS / "null").recordings[:3])
    lacking = {name: one for name, one in recordings[0].channels.items() if "position_main" not in name}
    recordings[0] = replace(recordings[0], channels=lacking)
    left = [
        judged(np.zeros(len(one)), name, one.file)
        for one in recordings
        for name in ("position_free_m", "position_main_m")
        if name in one.channels
    ]
    found = covariates(recordings, left, sensors(recordings))
    assert {columns["load"].shape[1] for columns in found.values()} == {3}
    assert not found[recordings[0].file]["load"][:, 2].any()
    deficiency(left, found, sensors(recordings))


def test_a_complete_truck_passes_and_a_truck_with_something_missing_fails():
    found = diagnosed("thermfric")
    assert not checked(found, found.final).deficient
    before = checked(found, found.baseline)
    assert before.deficient
    assert {test.test for test in before.failures} == {"goodness of fit", "whiteness", "correlation"}
    assert not checked(diagnosed("null"), diagnosed("null").baseline).deficient


def test_shares_of_the_misfit_add_up_and_lie_where_they_were_put():
    random = np.random.default_rng(6)
    time = np.arange(1000) / RATE
    quiet, loud = random.normal(size=1000), random.normal(size=1000)
    steady = np.arange(1000) >= 500
    loud[steady] += 3.0 * np.sin(2.0 * np.pi * 3.0 * time[steady])
    phase = np.where(steady, PHASES.index("steady"), PHASES.index("hold"))
    cells = shares(
        [judged(quiet, "a"), judged(loud, "b")],
        {("r0", "a"): RATE, ("r0", "b"): RATE},
        {"r0": {"a": phase, "b": phase}},
        PHASES,
    )
    by = {kind: [one for one in cells if one.by == kind] for kind in ("recording", "signal", "phase", "band")}
    for kind, rows in by.items():
        assert sum(row.share for row in rows) == pytest.approx(1.0), kind
        assert sum(row.samples for row in rows) == pytest.approx(2000.0)
        assert sum(row.samples * row.mean_square for row in rows) == pytest.approx(
            quiet @ quiet + loud @ loud
        )
    assert (by["signal"][0].name, by["phase"][0].name) == ("b", "steady")
    assert by["band"][0].name == "2 to 5 Hz"
    assert min(by[kind][0].share for kind in ("signal", "phase", "band")) > 0.9
    assert set(band_names()) == {row.name for row in by["band"]}
    none = shares([judged(quiet, "a")], {("r0", "a"): RATE}, {"r0": {"a": phase}}, PHASES)
    assert {row.share for row in none} == {0.0}


def test_every_channel_of_a_recording_has_the_phase_of_what_moves():
    found = diagnosed("null")
    recording = found.recordings[0]
    told = of_recording(recording, found.machine.truck)
    assert set(told) == set(recording.channels)
    assert np.array_equal(told["pressure_main_pa"], told["pressure_free_pa"])  # the main lift is at rest
    assert len(np.unique(told["fork_height_m"])) > 3
    assert phases(recording.time_s, recording["current_free_a"], 10.0).max() == PHASES.index("hold")


def test_an_encoder_at_rest_is_rounded_once():
    from forklift.fitting.residuals import still_stretches

    moving, half = np.arange(100.0), np.r_[np.arange(50.0), np.full(50, 50.0)]
    assert still_stretches(moving) == 100.0
    assert still_stretches(np.zeros(100)) == 1.0
    assert still_stretches(half) == pytest.approx(100.0**2 / (50.0 + 50.0**2))
    # Rounding by a place that is anywhere: the mean square over such stretches scatters as of so many.
    random = np.random.default_rng(3)
    place = random.uniform(-0.5, 0.5, (20000, 51))
    square = 12.0 * (place[:, :50] ** 2).sum(axis=1) + 12.0 * 50.0 * place[:, 50] ** 2
    assert np.var(square / 100.0) == pytest.approx(0.8 / still_stretches(half), rel=0.05)

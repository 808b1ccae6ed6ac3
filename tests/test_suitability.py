"""A campaign that can support a fit is not refused; what the fit survives is a caution."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from campaigns import CAMPAIGNS
from forklift import Campaign, Recording, simulate
from forklift.app.demo import measured, scattered
from forklift.plant.forklift.checks.suitability import Suitability, suitability
from forklift.plant.forklift.commands import Command, generate
from forklift.recordings.channels import LIFTS, commanded
from invalid_campaign import (
    DURATION_S,
    F0,
    F1,
    F8,
    M0,
    M1,
    M8,
    PF,
    PM,
    THESIS,
    XF,
    XM,
    B,
    H,
    chain,
    column,
    commanded_with,
    commands,
    each,
    good,
    level,
    record,
    times,
    without,
)


def test_a_good_campaign_supports_a_fit_of_both_lifts():
    assert suitability(good(), THESIS) == Suitability(("free", "main"), ())


def codes(found: Suitability) -> list[str]:
    json.dumps(found.to_dict())
    for caution in found.cautions:
        assert caution.sentence.isprintable()
        assert ";" in caution.sentence
    return [caution.code for caution in found.cautions]


CAUTIONS = [
    (
        "one load",
        lambda found: [r for r in found if r.load_kg == 0.0 or r.role == "validate"],
        {"one-load": "free.friction.f_cfr", "one-temperature": "main.viscosity.lambda"},
        ("free", "main"),
    ),
    (
        "one load, 1500 kg of the free lift",
        lambda found: [r for r in found if r.lift == "free" and r.load_kg > 0.0],
        {"one-load": "1500 kg", "one-temperature": "60"},
        ("free",),
    ),
    (
        "loads entered alike",
        lambda found: [dataclasses.replace(r, load_kg=0.0, sha256="") for r in found if r.lift == "free"],
        {"one-load": "0 kg", "load-doubtful": "agree on 15"},
        ("free",),
    ),
    (
        "one temperature",
        each(column("oil_temperature_degc", lambda v: 0 * v + 30.5)),
        {"one-temperature": "30.5 degC"},
        ("free", "main"),
    ),
    (
        "one temperature within the sensor's error",
        lambda found: [
            column("oil_temperature_degc", lambda v, k=k: 0 * v + 30.0 + 0.5 * k)(r)
            for k, r in enumerate(found)
        ],
        {"one-temperature": "30 degC"},
        ("free", "main"),
    ),
    (
        "no validate recordings",
        lambda found: [r for r in found if r.role == "estimate"],
        {"validate-missing": 'role = "validate"'},
        ("free", "main"),
    ),
    (
        "one lift at one level",
        lambda found: each(commanded_with(level(0.7)), M0, M1, M8)([r for r in found if r.lift != "both"]),
        {"lift-left-out": "one level only, 0.7 A"},
        ("free",),
    ),
    (
        "one lift never opened",
        lambda found: each(commanded_with(level(0.2)), F0, F1, F8)([r for r in found if r.lift != "both"]),
        {"lift-left-out": "current_free_a is at most 200 mA"},
        ("main",),
    ),
    (
        "one lift only to validate",
        lambda found: [
            r if r.lift == "free" else dataclasses.replace(r, role="validate", sha256="")
            for r in found
            if r.lift != "both"
        ],
        {"lift-left-out": "no estimate recording commands the main lift"},
        ("free",),
    ),
    (
        "a wrong load",
        each(lambda r: dataclasses.replace(r, load_kg=900.0, sha256=""), M1),
        {"load-doubtful": "entered as 900"},
        ("free", "main"),
    ),
    (
        "a pressure's gain",
        each(column(PF, times(1.5)), F1),
        {"pressure-doubtful": "reads 22.1 MPa"},
        ("free", "main"),
    ),
    (
        "a height's zero",
        each(column(H, lambda v: v + 0.08), B),
        {"height-contradicts-position": "starts 8"},
        ("free", "main"),
    ),
    (
        "an encoder's scale",
        each(column(XF, times(1.06)), F0),
        {"height-contradicts-position": "fork_height_m moves by"},
        ("free", "main"),
    ),
    (
        "a glitch",
        each(column(H, lambda v: np.r_[v[:100], v[100] + 0.4, v[101:]]), F0),
        {"sample-glitch": "fork_height_m jumps by 40"},
        ("free", "main"),
    ),
]


@pytest.mark.parametrize(("name", "mutation", "says", "lifts"), CAUTIONS, ids=[row[0] for row in CAUTIONS])
def test_what_a_fit_survives_is_a_caution(name, mutation, says, lifts):
    found = suitability(tuple(mutation(good())), THESIS)
    assert found.lifts == lifts
    assert set(codes(found)) == set(says)
    for code, words in says.items():
        assert any(caution.code == code and words in caution.sentence for caution in found.cautions), found


@pytest.mark.parametrize(
    ("names", "codes_told"),
    [((H,), []), ((XF, XM), []), ((PF, PM), []), ((XF, XM, H), []), ((PM, XM), [])],
    ids=["height", "encoders", "pressures", "all but pressures", "main"],
)
def test_a_channel_that_is_not_there_is_no_fault(names, codes_told):
    assert codes(suitability(tuple(each(without(*names))(good())), THESIS)) == codes_told


def test_missing_samples_are_no_fault():
    """Empty cells, in a row or here and there, of every channel that may have them."""
    random = np.random.default_rng(1)

    def gaps(values: np.ndarray) -> np.ndarray:
        values[random.integers(0, len(values), 20)] = np.nan
        values[200:230] = np.nan
        return values

    changed = each(chain(*(column(name, gaps) for name in (PF, PM, XF, XM, H, "oil_temperature_degc"))))
    assert suitability(tuple(changed(good())), THESIS) == Suitability(("free", "main"), ())


def test_coarse_sensors_without_noise_are_no_fault():
    """Steps of 1 bar and 5 mm, nothing below."""
    truck, made = scattered(THESIS, 3), []
    for seed, load in enumerate((0.0, 1500.0)):
        for lift in LIFTS:
            kind = ("prms", "staircase")[seed]
            command = generate(kind, lift, duration_s=DURATION_S, seed=seed)
            run = simulate(truck, command, load_kg=load, oil_temperature_degc=30.0, solver="fixed")
            columns = measured(run, 1, 0).to_dict(as_series=False)
            for name, step in ((PF, 1e5), (PM, 1e5), (H, 5e-3)):
                columns[name] = np.round(run[name] / step) * step
            time = columns.pop("time_s")
            made.append(Recording(f"{lift}_{load:g}.csv", lift, load, "estimate", time, columns))
    assert suitability(made, THESIS).lifts == ("free", "main")


@pytest.mark.parametrize("rate_hz", [20.0, 200.0])
def test_other_sample_rates_are_no_fault(rate_hz):
    truck, made = scattered(THESIS, 2), []
    for seed, load in enumerate((0.0, 1500.0)):
        slow = generate("prms", "main", duration_s=DURATION_S, seed=seed)
        time = np.arange(int(DURATION_S * rate_hz)) / rate_hz
        command = Command(time, 0.0 * time, np.interp(time, slow.time_s, slow.current_main_a))
        made.append(record(truck, f"main_{load:g}.csv", command, load, 20.0 + load / 50.0, "estimate", seed))
    assert suitability(made, THESIS).lifts == ("main",)


EFFECTS = (
    {},
    {"mast_coupling.factor": 1.0},
    {"free.leakage.coefficient": 1.5e-12, "main.leakage.coefficient": 1.5e-12},
    {"free.friction_temperature.rate": 0.018},
)


@settings(max_examples=150, deadline=None)
@example(seed=2193, lift="free", effect={}, kind="prms", loads=(0.0, 0.0), temperature=0.0, duration_s=4.0)
@given(
    seed=st.integers(0, 10_000),
    lift=st.sampled_from([*LIFTS, "both"]),
    effect=st.sampled_from(EFFECTS),
    kind=st.sampled_from(["prms", "staircase"]),
    loads=st.tuples(st.floats(0.0, 2000.0), st.floats(0.0, 2000.0)),
    temperature=st.floats(0.0, 70.0),
    duration_s=st.floats(6.0, 30.0),  # shorter ones may open the valve to one level only
)
def test_recordings_of_any_truck_of_the_make_are_fit(
    seed, lift, effect, kind, loads, temperature, duration_s
):
    """Also where a lift reaches its stop and stands there, and with physics that the thesis left out."""
    assume(kind == "prms" or duration_s >= 10.0)  # a shorter staircase has one step, which tells too little
    truck = scattered(THESIS, seed).with_values(effect)
    made = []
    for k, load in enumerate(loads):
        command = commands(kind, lift, duration_s, seed + k)
        made.append(record(truck, f"{lift}_{k}.csv", command, load, temperature, "estimate", k))
    assume(min(np.min(recording[name]) for recording in made for name in (PF, PM)) > -1e6)  # else never read
    found = suitability(made, THESIS)
    assert found.lifts == commanded(lift)
    assert set(codes(found)) <= {"one-load", "one-temperature", "validate-missing"}


CONCEALED = {"null": ("free",), "coupling": ("free", "main"), "thermfric": ("free",), "leak": ("main",)}


@pytest.mark.parametrize(("name", "lifts"), CONCEALED.items())
def test_the_simulated_campaigns_are_fit(name, lifts):
    """What they conceal is for a diagnosis, not a reason not to fit."""
    assert suitability(Campaign.read(CAMPAIGNS / name).recordings, THESIS) == Suitability(lifts, ())


def test_one_load_of_a_shared_campaign_is_a_caution():
    found = Campaign.read(CAMPAIGNS / "null").recordings
    assert codes(suitability([r for r in found if r.load_kg == 800.0], THESIS)) == ["one-load"]

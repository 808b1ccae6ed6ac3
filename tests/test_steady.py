"""Estimation at steady state: plateaus found, known tables recovered, and what is told said."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from campaigns import CAMPAIGNS
from forklift import Campaign, ForkliftError, Recording, Truck, commands, simulate, steady_state
from forklift.app import demo
from forklift.plant.forklift.plateaus import plateaus

UP = [60, 0, 80, 0, 100, 0, 125, 0, 150, 0]
OTHER_UP = [70, 0, 90, 0, 112, 0, 138, 0, 165]
DOWN = [174, 90, 70, 60, 0]
PLAN = [
    (0, 20, UP, 2.0),
    (0, 45, OTHER_UP, 1.6),
    (800, 30, UP, 2.0),
    (0, 25, DOWN, 1.6),
    (0, 60, OTHER_UP, 1.6),
]
"""Load [kg], oil temperature [degC], steps of the ECU, and how long each is held [s]."""


def recorded(truck: Truck, lift: str, plan=PLAN, seed: int = 3) -> Campaign:
    """A campaign of staircases, through the sensors."""
    found = []
    for k, (load, temperature, levels, hold) in enumerate(plan):
        steps = np.concatenate([np.zeros(50, int), commands.staircase(levels, round(hold * 50))])
        current = commands.quantise_current(commands.low_pass(commands.steps_to_current(steps), 50.0, 3.0))
        command = commands.Command.of_samples(50.0, **{lift: current})
        run = simulate(truck, command, load_kg=load, oil_temperature_degc=temperature)
        table = demo.measured(run, seed, k)
        channels = {name: table[name].to_numpy() for name in table.columns if name != "time_s"}
        found.append(Recording(f"{k}.csv", lift, load, "estimate", table["time_s"].to_numpy(), channels))
    return Campaign("staircases", 50.0, tuple(found))


def scattered(seed: int) -> Truck:
    """Another truck of the make, its knots moved as well."""
    truth = demo.scattered(Truck.read("thesis"), seed)
    random = np.random.default_rng(seed)
    names = [f"{lift}.valve.table_current" for lift in ("free", "main")]
    return truth.with_values(
        {
            name: [knot + (k > 0) * random.normal(0, 0.01) for k, knot in enumerate(truth.values[name])]
            for name in names
        }
    )


def started(truth: Truck) -> Truck:
    """The thesis's truck with the true oil: its viscosity is not estimated at steady state."""
    oil = {name: value for name, value in truth.values.items() if "viscosity" in name}
    return Truck.read("thesis").with_values(oil)


def opening(truck: Truck, lift: str, current: np.ndarray) -> np.ndarray:
    return np.interp(current, *(truck.values[f"{lift}.valve.table_{what}"] for what in ("current", "area")))


def fork_speed(truck: Truck, lift: str, current: np.ndarray, bend: float) -> np.ndarray:
    full = [np.full(len(current), value) for value in (bend, 500.0, 40.0)]
    return 2.0 * truck.core.steady_state(lift, current, *full)[0][:, 0]


@pytest.fixture(scope="module", params=[(1, "free"), (3, "main")], ids=["free", "main"])
def estimated(request):
    seed, lift = request.param
    truth = scattered(seed)
    return truth, lift, steady_state(recorded(truth, lift), started(truth))


def test_the_velocity_of_each_plateau_is_the_steady_one(estimated):
    truth, lift, found = estimated
    assert len(found.plateaus) > 20
    for plateau in (fitted.plateau for fitted in found.plateaus):
        one = (
            np.array([value])
            for value in (
                plateau.current_a,
                plateau.hysteresis_direction,
                plateau.pressure_pa,
                plateau.oil_temperature_degc,
            )
        )
        velocity, _ = truth.core.steady_velocity(
            lift, *one, pressure_rate=np.array([plateau.pressure_rate_pa_s])
        )
        assert abs(2 * velocity[0] - plateau.velocity_m_s) < 5 * plateau.standard_error_m_s + 1e-3


def test_a_known_table_is_recovered(estimated):
    truth, lift, found = estimated
    current = np.linspace(0.5, 1.15, 27)
    off = opening(found.truck, lift, current) / opening(truth, lift, current) - 1
    assert np.sqrt(np.mean(off**2)) < 0.05
    for bend in (1.0, -1.0):
        off = fork_speed(found.truck, lift, current, bend) - fork_speed(truth, lift, current, bend)
        before = fork_speed(started(truth), lift, current, bend) - fork_speed(truth, lift, current, bend)
        assert np.abs(off).max() < 4e-3 < 0.3 * np.abs(before).max()
    assert found.rms_m_s < 2e-3
    width = f"{lift}.valve.f_hs"
    assert abs(found.truck.values[width] / truth.values[width] - 1) < 0.03
    assert found.estimates[width].told == "alone"


def test_values_lie_within_their_standard_errors_of_the_truth(estimated):
    truth, _, found = estimated
    scalars = [(row, truth.values[name]) for name, row in found.estimates.items() if name in truth.values]
    assert len(scalars) == 5
    assert all(abs(row.value - true) < 4 * row.standard_error for row, true in scalars)


def test_the_truck_says_where_its_values_come_from_and_keeps_the_others(estimated):
    _, lift, found = estimated
    told = f"estimated at steady state from staircases ({len(found.plateaus)} plateaus)"
    changed = {name for name in found.truck.values if found.truck.values[name] != found.before.values[name]}
    assert changed == {name for name, source in found.truck.sources.items() if source == told}
    assert all(name.startswith(lift) for name in changed)
    table = found.truck.values[f"{lift}.valve.table_area"]
    assert list(table) == sorted(table)


def test_the_result_is_plain_data_and_prints_itself(estimated):
    _, lift, found = estimated
    data = json.loads(json.dumps(found.to_dict()))
    assert len(data["plateaus"]) == len(found.plateaus) == found.to_polars().height
    assert data["truck_sha256"] == found.truck.sha256
    assert f"{lift}.compensator.theta" in str(found)
    assert "plateaus" in repr(found)


def test_an_odd_plateau_does_not_spoil_the_others():
    truth = scattered(1)
    campaign = recorded(truth, "free")
    wrong = campaign[0]
    position = np.array(wrong["position_free_m"])
    held = (wrong.time_s > 9.0) & (wrong.time_s < 11.0)
    slipped = position - np.where(held, 0.15 * (wrong.time_s - 9.0), 0.0) - 0.3 * (wrong.time_s >= 11.0)
    channels = {name: values for name, values in wrong.channels.items() if name != "fork_height_m"}
    spoilt = replace(wrong, channels=channels | {"position_free_m": slipped}, sha256="")
    found = steady_state(replace(campaign, recordings=(spoilt, *campaign.recordings[1:])), started(truth))
    odd = [fitted.plateau for fitted in found.plateaus if fitted.odd]
    assert len(odd) == 1
    assert 9.0 < odd[0].start_s < 11.0
    current = np.linspace(0.5, 1.15, 14)
    off = fork_speed(found.truck, "free", current, 1.0) - fork_speed(truth, "free", current, 1.0)
    assert np.abs(off).max() < 6e-3


def test_what_the_plateaus_cannot_tell_is_said():
    truth = scattered(1)
    found = steady_state(recorded(truth, "free", PLAN[:1]), started(truth), lift="free")
    text = " ".join(found.cannot_tell)
    assert "oil of another temperature" in text
    assert "always rose" in text
    assert "product" in text
    assert found.estimates["free.compensator.theta"].told != "alone"
    assert found.estimates["free.valve.table_area.7"].told == "no"


def test_a_campaign_without_plateaus_is_refused_with_what_to_record():
    campaign = recorded(scattered(1), "free", [(0, 20, [0, 0], 1.0)])
    with pytest.raises(ForkliftError) as error:
        steady_state(campaign, Truck.read("thesis"), lift="main")
    assert error.value.code == "plateaus-missing"
    assert error.value.lift == "main"
    with pytest.raises(ForkliftError, match="take free or main"):
        steady_state(campaign, Truck.read("thesis"), lift="both")


def test_recordings_to_be_validated_on_are_left_alone():
    campaign = recorded(scattered(1), "free", PLAN[:2])
    judged = replace(campaign.recordings[1], role="validate")
    found = steady_state(replace(campaign, recordings=(campaign.recordings[0], judged)), Truck.read("thesis"))
    assert {fitted.plateau.file for fitted in found.plateaus} == {"0.csv"}


def test_no_plateau_is_seen_where_the_lift_rests_on_its_stop_or_swings():
    truck = Truck.read("thesis")
    # Wide open it is down within four seconds, and stays there under current.
    down = recorded(truck, "free", [(0, 40, [170, 170, 170, 170], 2.0)])[0]
    found = plateaus(down, truck, "free")
    assert all(plateau.velocity_m_s < -0.3 for plateau in found)
    swinging = recorded(truck, "free", [(1500, 60, [170, 100] * 8, 0.3)])[0]
    assert plateaus(swinging, truck, "free") == ()


def test_a_slow_plateau_is_told_by_the_instants_at_which_the_count_changes():
    truck = Truck.read("thesis")
    recording = recorded(truck, "free", [(0, 40, [78], 3.0)])[0]
    by_encoder = replace(
        recording,
        channels={name: values for name, values in recording.channels.items() if name != "fork_height_m"},
        sha256="",
    )
    (plateau,) = plateaus(by_encoder, truck, "free")
    current = np.array([plateau.current_a])
    full = [np.array([value]) for value in (1.0, 0.0, 40.0)]
    steady = 2.0 * truck.core.steady_state("free", current, *full)[0][0, 0]
    assert plateau.standard_error_m_s < 5e-4
    assert abs(plateau.velocity_m_s - steady) < 5 * plateau.standard_error_m_s


def test_on_a_shared_campaign_of_another_truck_the_plateaus_are_fitted_within_a_millimetre_a_second():
    found = steady_state(Campaign.read(CAMPAIGNS / "null"), Truck.read("thesis"))
    assert len(found.plateaus) >= 30
    assert found.rms_m_s < 1e-3
    assert found.scatter["free"] < 1.2
    assert not any(fitted.odd for fitted in found.plateaus)
    # The campaigns' trucks are scattered by some 12 %, their tables by 5 % and 10 mA.
    assert abs(found.truck.values["free.valve.f_hs"] / 0.018723 - 1) < 0.36


def test_the_core_refuses_points_that_do_not_fit_with_facts():
    core = Truck.read("thesis").core
    one = [np.array([value]) for value in (0.8, 1.0, 5e6, 40.0)]
    velocity, slopes = core.steady_velocity(
        "free", *one, directions=["current", "pressure", "free.valve.f_hs"]
    )
    assert velocity.shape == (1,)
    assert slopes.shape == (1, 3)
    # The hysteresis takes its half width off the current.
    assert slopes[0, 2] == pytest.approx(-slopes[0, 0], rel=1e-9)
    for arguments, code, name in (
        (("free", one[0], np.zeros(2), *one[2:]), "argument-shape", "bend"),
        (("both", *one), "argument-invalid", "lift"),
        (("free", np.array([9.0]), *one[1:]), "argument-invalid", "current"),
    ):
        with pytest.raises(ForkliftError) as error:
            core.steady_velocity(*arguments)
        assert (error.value.code, error.value.name) == (code, name)
    with pytest.raises(ForkliftError, match="load or oil_temperature"):
        core.steady_state("free", *one[:2], np.zeros(1), one[3], directions=["pressure"])

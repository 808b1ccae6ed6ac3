"""What a verb is given of another kind is told in one sentence that names the argument."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

import forklift
from campaigns import CAMPAIGNS
from forklift import Campaign, Command, ForkliftError, Truck, commands
from forklift.control import presets
from forklift.control.closed_loop import Lowering, requests
from forklift.control.compare import compare_controllers, control_comparison
from forklift.control.controller import Controller
from forklift.control.feedback import tune_swing
from forklift.control.own_truck import for_truck
from forklift.control.tune import tune


@cache
def campaign() -> Campaign:
    return Campaign.read(CAMPAIGNS / "null")


@cache
def truck() -> Truck:
    return Truck.read("thesis")


@cache
def controller() -> Controller:
    return Controller.read("thesis")


@cache
def command() -> Command:
    return commands.generate("prms", "free", duration_s=3.0)


def simulated(**changed: Any) -> Any:
    given = {"load_kg": 0.0, "oil_temperature_degc": 20.0, **changed}
    return forklift.simulate(given.pop("truck", truck()), given.pop("command", command()), **given)


CALLS: dict[str, tuple[str, Callable[[], Any]]] = {
    "a number to compare": ("machine", lambda: forklift.compare(campaign(), 3)),
    "a list as a machine to fit": ("machine", lambda: forklift.fit(["thesis"], campaign())),
    "a number to diagnose": ("machine", lambda: forklift.diagnose(campaign(), 3)),
    "a number to steady_state": ("truck", lambda: forklift.steady_state(campaign(), 3)),
    "a number to for_truck": ("truck", lambda: for_truck(controller(), 3)),
    "a number to thesis": ("truck", lambda: presets.thesis(3)),
    "a number to today": ("truck", lambda: presets.today(3)),
    "a number to compare_controllers": ("truck", lambda: compare_controllers([controller()], 3)),
    "a number to control_comparison": ("truck", lambda: control_comparison([controller()], 3)),
    "a number to tune": ("truck", lambda: tune(controller(), 3)),
    "a number to tune_swing": ("truck", lambda: tune_swing(controller(), 3, "free")),
    "a name to Lowering": ("truck", lambda: Lowering("thesis", controller(), 0.0, 20.0, requests("free", 1))),
    "a number to simulate": ("truck", lambda: simulated(truck=3)),
    "a number to predict": ("truck", lambda: forklift.predict(3, campaign().recordings[0])),
    "a number to speed_to_current": ("truck", lambda: forklift.speed_to_current(3, "free")),
    "two trucks to compare": ("recordings", lambda: forklift.compare("thesis", truck())),
    "two trucks to fit": ("recordings", lambda: forklift.fit(truck(), "thesis")),
    "a number instead of recordings": ("recordings", lambda: forklift.diagnose(truck(), 3)),
    "a campaign to predict": ("recording", lambda: forklift.predict(truck(), campaign())),
    "a generator's name to simulate": ("command", lambda: simulated(command="prms")),
    "loads to simulate": ("load_kg", lambda: simulated(load_kg=[0.0, 100.0])),
    "no times to simulate": ("time", lambda: simulated(time=[])),
    "text for a temperature": (
        "oil_temperature_degc",
        lambda: forklift.compare(campaign(), truck(), oil_temperature_degc="20"),
    ),
    "a load to predict": (
        "load_kg",
        lambda: forklift.predict(truck(), campaign().recordings[0], load_kg=9.0),
    ),
    "lifts to compare": ("lifts", lambda: forklift.compare(campaign(), truck(), lifts="free")),
    "one name to hold": ("hold", lambda: forklift.fit(campaign(), truck(), hold="free.bulk.a_1")),
    "one name as a group": (
        "together",
        lambda: forklift.fit(campaign(), truck(), together=["free.bulk.a_1"]),
    ),
    "half a start": ("starts", lambda: forklift.fit(campaign(), truck(), starts=2.5)),
    "a negative seed": ("seed", lambda: forklift.fit(campaign(), truck(), seed=-1)),
    "text for a width": ("load_width_kg", lambda: forklift.fit(campaign(), truck(), load_width_kg="5")),
    "another lift to generate": ("lift", lambda: commands.generate("prms", "left", duration_s=3.0)),
    "text for a duration": ("duration_s", lambda: commands.generate("prms", "free", duration_s="3")),
    "text for a seed": ("seed", lambda: commands.generate("prms", "free", duration_s=3.0, seed="1")),
    "text for a load": ("load_kg", lambda: forklift.speed_to_current(truck(), "free", load_kg="5")),
    "nothing to read a truck from": ("name_or_path", lambda: Truck.read(None)),
    "a truck to read a truck from": ("name_or_path", lambda: Truck.read(truck())),
    "nothing to read a campaign from": ("path", lambda: Campaign.read(None)),
    "nothing to read a command from": ("path", lambda: Command.read(None)),
}


@pytest.mark.parametrize("case", CALLS)
def test_an_argument_of_another_kind_is_named(case):
    name, call = CALLS[case]
    with pytest.raises(ForkliftError) as found:
        call()
    assert found.value.code == "argument-invalid"
    assert found.value.name == name
    assert name.removesuffix("_kg").removesuffix("_s").split("_")[0] in found.value.message
    assert "\n" not in found.value.message


def test_a_name_stands_for_a_truck_in_the_control_room_too():
    assert for_truck(controller(), "thesis") == for_truck(controller(), truck())
    assert presets.today("thesis") == presets.today(truck())

"""Many variants of a truck at once: each is the single run, to the bit."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import forklift
from forklift import Truck, commands, simulate, simulate_many
from forklift.plant.forklift.tables import outputs
from small_campaign import raised

COMMAND = commands.generate("prms", "both", duration_s=3.0, seed=4)
TRUCK = Truck.read("thesis")
COUNT = 37
"""More than two groups of sixteen, and one that is not full."""


def columns(seed: int = 1) -> dict[str, np.ndarray]:
    random = np.random.default_rng(seed)
    spread = {
        name: TRUCK.values[name] * random.uniform(0.9, 1.1, COUNT)
        for name in ("free.friction.sigma_2", "main.bulk.a_1", "viscosity.nu_0", "free.valve.omega")
        if name in TRUCK.values
    }
    knot = TRUCK.values["main.valve.table_area"][3] * random.uniform(0.99, 1.01, COUNT)
    return {
        **spread,
        "main.valve.table_area.3": knot,
        "load_kg": random.uniform(0.0, 1500.0, COUNT),
        "oil_temperature_degc": random.uniform(15.0, 65.0, COUNT),
    }


def alone(truck: Truck, cases: dict[str, np.ndarray], k: int, **settings: object) -> np.ndarray:
    own = {name: float(values[k]) for name, values in cases.items()}
    load, degc = own.pop("load_kg"), own.pop("oil_temperature_degc")
    knot = own.pop("main.valve.table_area.3")
    table = list(truck.values["main.valve.table_area"])
    table[3] = knot
    one = truck.with_values({**own, "main.valve.table_area": table})
    return simulate(one, COMMAND, load_kg=load, oil_temperature_degc=degc, solver="fixed", **settings).outputs


@pytest.mark.parametrize("lifts", ["both", "free", "main"])
def test_every_case_is_the_single_run_to_the_bit(lifts):
    cases = columns()
    found = simulate_many(TRUCK, cases, COMMAND, lifts=lifts, substeps=4)
    assert found.outputs.shape == (COUNT, len(COMMAND.time_s), len(outputs()))
    assert found.finite.all()
    for k in range(COUNT):
        np.testing.assert_array_equal(
            found.outputs[k].view(np.int64),
            alone(TRUCK, cases, k, lifts=lifts, substeps=4).view(np.int64),
            err_msg=str(k),
        )


def test_so_is_that_of_a_truck_with_effects_at_times_of_its_own():
    truck = TRUCK.with_values({"mast_coupling.factor": 0.7, "free.friction_temperature.rate": 0.01})
    cases = columns(2) | {"mast_coupling.factor": np.linspace(0.0, 1.0, COUNT)}
    time = np.linspace(0.1, 2.7, 31)
    found = simulate_many(truck, cases, COMMAND, time=time)
    for k in range(0, COUNT, 5):
        np.testing.assert_array_equal(
            found.outputs[k].view(np.int64), alone(truck, cases, k, time=time).view(np.int64)
        )


def test_a_case_depends_neither_on_its_neighbours_nor_on_how_it_is_given():
    cases = columns()
    whole = simulate_many(TRUCK, cases, COMMAND)
    some = [{name: float(values[k]) for name, values in cases.items()} for k in (20, 3)]
    few = simulate_many("thesis", some, COMMAND)
    np.testing.assert_array_equal(few.outputs, whole.outputs[[20, 3]])
    name = "velocity_main_m_s"
    np.testing.assert_array_equal(few[name], whole[name][[20, 3]])
    assert few.dataset[name].dims == ("case", "time_s")
    assert few.dataset[name].attrs["units"] == "m/s"
    assert len(few) == 2
    assert "2 cases" in repr(few)


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"cases": {}}, "argument-invalid"),
        ({"cases": []}, "argument-invalid"),
        ({"cases": "free.bulk.a_1"}, "argument-invalid"),
        ({"cases": {"load_kg": [1.0, 2.0], "free.bulk.a_1": [1.0]}}, "argument-invalid"),
        ({"cases": {"load_kg": 800.0}}, "argument-invalid"),
        ({"cases": {"load_kg": ["heavy"]}}, "argument-invalid"),
        ({"cases": [{"load_kg": 1.0}, {"free.bulk.a_1": 1.0}]}, "argument-invalid"),
        ({"cases": {"load_kg": [800.0]}, "load_kg": 3.0}, "argument-invalid"),
        ({"cases": {"free.gravity.g": [9.82]}}, "argument-invalid"),  # no load
        ({"cases": {"load_kg": [-1.0]}}, "argument-invalid"),
        ({"cases": {"load_kg": [800.0], "free.gravity.h": [9.82]}}, "parameter-unknown"),
        ({"cases": {"load_kg": [800.0], "free.valve.table_area": [1e-5]}}, None),
        ({"cases": {"load_kg": [800.0, 1.0], "free.gravity.g": [9.82, 98.2]}}, "parameter-out-of-bounds"),
        ({"truck": 3}, "argument-invalid"),
        ({"truck": "theses"}, "truck-unknown"),
        ({"command": None}, "argument-invalid"),
        ({"substeps": 0}, "argument-invalid"),
        ({"lifts": "side"}, "argument-invalid"),
        ({"time": []}, "argument-invalid"),
    ],
)
def test_what_is_wrong_is_told(changed, code):
    given = {"truck": TRUCK, "cases": {"load_kg": [800.0]}, "command": COMMAND} | changed
    error = raised(
        simulate_many, given.pop("truck"), given.pop("cases"), given.pop("command"),
        oil_temperature_degc=40.0, **given,
    )  # fmt: skip
    assert code is None or error.code == code


def test_the_case_that_is_wrong_is_named():
    cases = {"free.gravity.g": [9.82, 9.8, 98.2]}
    error = raised(simulate_many, TRUCK, cases, COMMAND, load_kg=0.0, oil_temperature_degc=40.0)
    assert (error.code, error.case, error.name) == ("parameter-out-of-bounds", 2, "free.gravity.g")


@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT to a process")
def test_ctrl_c_ends_a_long_run_on_all_cores_at_once():
    script = """
from forklift import commands, simulate_many
command = commands.generate("prms", "both", duration_s=60.0, seed=1)
print("begun", flush=True)
cases = {"load_kg": [800.0] * 512}
simulate_many("thesis", cases, command, oil_temperature_degc=40.0, substeps=1000)
"""
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    told = process.communicate(timeout=20)[1]  # by itself it would take minutes
    assert "KeyboardInterrupt" in told
    assert process.returncode != 0


def test_it_is_a_public_name():
    assert forklift.simulate_many is simulate_many

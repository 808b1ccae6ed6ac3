"""The lift in C that the benches' peers integrate is forklift's."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from forklift.app.demo import scattered
from forklift.plant.forklift.commands import generate
from forklift.plant.forklift.simulate import simulate
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import LIFTS

BENCHES = Path(__file__).parents[1] / "benches"
SECONDS = 2.5
RTOL = 1e-8
SCALE = np.array([1, 10, 0.05, 1, 0.5, 1, 1e7, 1e7, 1e-5])  # A, A/s, A, m, m/s, m, Pa, Pa, m²


@pytest.mark.parametrize("lift", ["free", "main"])
def test_a_scattered_truck_moves_in_c_as_in_forklift(lift, tmp_path, monkeypatch):
    if not shutil.which("gcc"):
        pytest.skip("there is no gcc")
    monkeypatch.syspath_prepend(BENCHES / "estimation")
    from cvode import parameters_of

    library = tmp_path / "lift.so"
    source = BENCHES / "peers" / "free_lift.c"
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", source, "-o", library, "-lm"], check=True)
    c = ctypes.CDLL(str(library))

    truck = scattered(Truck.read("thesis"), seed=5)
    command = generate("prms", lift, duration_s=SECONDS, seed=3)
    ours = simulate(truck, command, load_kg=700.0, oil_temperature_degc=35.0, tolerance=1e-9)

    values = dict(zip(truck.core.names, truck.core.values.tolist(), strict=True))
    parameters, k = parameters_of(values, lift), np.empty(c.lift_numbers())
    assert c.lift_parameter_numbers() == len(parameters)
    y = np.empty(9)
    c.lift_from(_at(k), _at(parameters), ctypes.c_double(700.0), ctypes.c_double(35.0))
    c.lift_at_rest(_at(k), ctypes.c_double(ours[f"{lift}.position"][0]), _at(y))

    def rates(_, y, u):
        y, dy = np.ascontiguousarray(y), np.empty(9)
        c.lift_rates(_at(k), ctypes.c_double(u), _at(y), _at(dy))
        return dy

    def slopes(_, y, u):
        y, columns = np.ascontiguousarray(y), np.empty((9, 9))
        c.lift_jacobian(_at(k), _at(y), _at(columns))
        return columns.T

    velocity = [0.0]
    currents = command.currents[:, LIFTS.index(lift)]
    for begin, end, u in zip(command.time_s, command.time_s[1:], currents, strict=False):
        done = solve_ivp(rates, (begin, end), y, "Radau", jac=slopes, args=(u,), rtol=RTOL, atol=RTOL * SCALE)
        y = done.y[:, -1]
        velocity.append(y[4])
    there = ours[f"{lift}.velocity"]
    assert np.abs(there).max() > 0.05
    assert np.abs(np.array(velocity) - there).max() < 1e-5


def _at(array):
    return array.ctypes.data_as(ctypes.c_void_p)

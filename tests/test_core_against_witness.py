"""The Rust core agrees with the NumPy witness on trucks that neither was written for."""

import numpy as np
import pytest

from forklift import Truck, commands, simulate
from reference import witness
from reference.names import NAMES

FIXED = {"g", "T_0"}  # their bounds are narrow
LIFTS = {"free": witness.FREE, "main": witness.MAIN}


def scattered(lift, random):
    """The witness's lift with every value moved by about 12 %, as one truck differs from another."""
    return {
        key: value if key in FIXED | {"x_0"} else value * np.exp(0.12 * random.standard_normal())
        for key, value in LIFTS[lift].items()
    }


def values(name, lift):
    return {f"{name}.{NAMES[key]}": value for key, value in lift.items() if key != "x_0"}


def test_the_thesis_truck_that_ships_is_the_witness():
    shipped = Truck.read("thesis").values
    for name, lift in LIFTS.items():
        for parameter, value in values(name, lift).items():
            np.testing.assert_allclose(shipped[parameter], value, rtol=1e-12, err_msg=parameter)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", LIFTS)
def test_a_scattered_truck_moves_alike_in_rust_and_in_numpy(name, seed):
    random = np.random.default_rng([seed, list(LIFTS).index(name)])
    lift = scattered(name, random)
    load, temperature = random.uniform(0, 1500), random.uniform(15, 65)
    steps = np.r_[np.zeros(10, int), commands.prms(115, seed=seed, switching_probability=0.1)]
    current = commands.low_pass(commands.steps_to_current(steps), 50.0, 3.0)
    command = commands.Command.of_samples(50.0, **{name: current})
    truck = Truck.read("thesis").with_values(values(name, lift), source="scattered")
    rust = simulate(truck, command, load_kg=load, oil_temperature_degc=temperature, tolerance=1e-9)
    numpy = witness.simulate(lift, command.time_s, current, load, temperature, rtol=1e-7)
    i, _, _, x, v, _, p_a, p_b, _ = numpy.T
    assert np.abs(v).max() > 0.05  # the forks do move
    for state, reference, atol in [
        ("valve_current", i, 1e-6),
        ("position", x, 1e-7),
        ("velocity", v, 1e-6),
        ("cylinder_pressure", p_a / 1e7, 1e-5),
        ("volume_pressure", p_b / 1e7, 1e-4),
    ]:
        found = rust[f"{name}.{state}"] / (1e7 if state.endswith("pressure") else 1.0)
        np.testing.assert_allclose(found, reference, rtol=0, atol=atol, err_msg=state)

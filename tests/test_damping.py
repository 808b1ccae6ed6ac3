"""The linear loop of a controller: its feedback is that of the integers, its map shows where the thesis's
case lies."""

from dataclasses import replace

import numpy as np
import pytest

from forklift import _core
from forklift.control.controller import Controller, Curve
from forklift.control.presets import OPEN_LOOP
from forklift.ensemble.damping import Damping, damping_map, damping_table, feedback, opened
from forklift.ensemble.stability import (
    OperatingPoint,
    closed,
    least_damped,
    operating_point,
    plant,
    sampled,
)
from forklift.plant.forklift.tables import states
from forklift.plant.forklift.truck import Truck

TRUCK = Truck.read("thesis")
TICK_S = 0.02


@pytest.fixture(scope="module")
def point() -> OperatingPoint:
    return operating_point(TRUCK, "main", command_a=0.7, load_kg=1500.0, oil_temperature_degc=20.0)


def plain(name: str, **numbers: float) -> Controller:
    """One lift's controller with a table that says the speed in mA."""
    made = Controller.read(name).only("main").with_word(32)
    given = OPEN_LOOP | {"delay": 0.0, "u_min": 0.0, "u_max": 2000.0, "i_max": 1750.0} | numbers
    made = made.with_numbers("main", "test", **given)
    same = Curve(first=0, spacing=6, values=[64.0 * k for k in range(32)], source="test")
    return replace(made, main=made.main.model_copy(update={"table": same}))


def answered(controller: Controller, positions: np.ndarray, pressures: np.ndarray) -> np.ndarray:
    """Currents [mA] at a constant request, in floating point."""
    readings = np.zeros((len(positions), 5), np.int32)
    readings[:, 1], readings[:, 3], readings[:, 4] = positions, pressures, 40
    currents, _ = controller.core.ticks([400] * len(positions), readings, floating=True)
    return np.array(currents)[:, 1].astype(float)


def sine(values: np.ndarray, omega: float) -> complex:
    """The amplitude and phase of a sine, of the last whole periods."""
    time = TICK_S * np.arange(len(values))
    use = slice(len(values) // 2, None)
    base = np.stack([np.cos(omega * time), np.sin(omega * time), np.ones_like(time)], axis=1)[use]
    cosine, quadrature, _ = np.linalg.lstsq(base, values[use], rcond=None)[0]
    return complex(cosine, -quadrature)


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.4])
def test_the_feedback_of_the_pressure_is_that_of_the_controllers_own_arithmetic(
    point: OperatingPoint, factor: float
) -> None:
    controller = plain("damped", swing_limit=500.0)
    swing = controller.main.swing
    assert swing is not None
    pressure = float(point.state[list(states()).index("cylinder_pressure")])
    omega = 2.0 * np.pi * 1.6 * factor
    time = TICK_S * np.arange(1500)
    steps = np.round((pressure + 20e5 * np.cos(omega * time)) / _core.PRESSURE_STEP_PA)
    found = sine(answered(controller, np.zeros(len(time)), steps), omega)
    told = feedback(controller, point)
    z = np.exp(1j * omega * TICK_S)
    gain = told.c @ np.linalg.solve(z * np.eye(len(told.a)) - told.a, told.b[:, 1:]) + told.d[:, 1:]
    expected = -1e3 * complex(gain[0, 0]) * 20e5
    assert abs(expected) > 3.0
    assert abs(found - expected) < 0.05 * abs(expected) + 0.3


@pytest.mark.parametrize("prediction", [0.0, 0.8])
def test_the_feedback_of_the_speed_is_that_of_the_controllers_own_arithmetic(
    point: OperatingPoint, prediction: float
) -> None:
    # 2 κ (P + 2 D/T_s) < 1: the predictor's own loop has no lag but a tick, and its difference doubles.
    gains = {"proportional": 0.3, "integral": 0.5, "derivative": 0.002}
    controller = plain("thesis", **gains, prediction=prediction, delay=8.0)
    without = feedback(plain("thesis", **gains), point)
    omega = 2.0 * np.pi * 0.8
    time = TICK_S * np.arange(1500)
    # Encoder counts, upward: about the speed asked for, which the integral part would wait for otherwise.
    travelled = 40.0 * np.cos(omega * time) - 400.0 / (2.0 * 1.963495) * time
    found = sine(answered(controller, np.round(travelled), np.full(len(time), 1000.0)), omega)
    # The reading says the mean speed since the last tick: downward, forks move twice as far.
    count_m = 1.963495e-3
    back = (1.0 - np.exp(-1j * omega * TICK_S)) / TICK_S
    speed = -2.0 * count_m * 40.0 * back
    told = feedback(controller, point)
    z = np.exp(1j * omega * TICK_S)
    gain = told.c @ np.linalg.solve(z * np.eye(len(told.a)) - told.a, told.b[:, :1]) + told.d[:, :1]
    expected = -1e3 * complex(gain[0, 0]) * speed
    assert abs(expected) > 50.0
    assert abs(found - expected) < 0.03 * abs(expected)
    # The predictor's states are there, and they matter.
    assert (len(told.a) > len(without.a)) == (prediction > 0.0)
    plainly = without.c @ np.linalg.solve(z * np.eye(len(without.a)) - without.a, without.b[:, :1])
    plainly = -1e3 * complex((plainly + without.d[:, :1])[0, 0]) * speed
    assert (abs(plainly - expected) > 0.1 * abs(expected)) == (prediction > 0.0)


def test_the_mode_of_the_map_is_the_loads_swing_and_not_the_predictors_own() -> None:
    """`damped` has a predictor on the free lift; its modes near half the ticks' frequency are less damped."""
    damped = Controller.read("damped")
    (row,) = damping_map(TRUCK, damped, "free", loads_kg=(800.0,), oil_temperatures_degc=(40.0,))
    at = operating_point(TRUCK, "free", command_a=0.6, load_kg=800.0, oil_temperature_degc=40.0)
    loop = closed(opened(sampled(plant(at), delay_s=0.04), feedback(damped, at)))
    anywhere = least_damped(loop)
    assert anywhere is not None
    assert anywhere.frequency_hz > 20.0
    assert row.open is not None
    assert row.closed is not None
    assert abs(row.closed.frequency_hz - row.open.frequency_hz) < 0.5
    assert row.closed.damping > 1.5 * row.open.damping


@pytest.fixture(scope="module")
def thesis_map() -> list[Damping]:
    return damping_map(
        TRUCK,
        Controller.read("thesis"),
        "main",
        loads_kg=(0.0, 800.0, 1500.0),
        oil_temperatures_degc=(20.0, 60.0),
    )


def test_the_thesiss_bad_case_is_among_the_least_damped_of_its_lift(thesis_map: list[Damping]) -> None:
    """Main lift, 1500 kg, 20 degC: the row of Table 5.7 that the thesis lost."""
    found = {(row.load_kg, row.oil_temperature_degc): row for row in thesis_map}
    worst = min(row.closed.damping for row in thesis_map if row.closed)
    bad = found[1500.0, 20.0].closed
    assert bad is not None
    assert bad.damping < 1.05 * worst
    assert all(row.closed.damping > bad.damping for row in thesis_map if row.closed and row.load_kg < 1500.0)


def test_every_point_of_the_map_is_stable_and_has_margins(thesis_map: list[Damping]) -> None:
    for row in thesis_map:
        assert row.closed is not None
        assert row.closed.per_tick < 1.0
        assert row.margins.gain > 2.0
        assert 0.5 < row.margins.disk < 1.0
    assert len(damping_table(thesis_map).splitlines()) == 1 + len(thesis_map)

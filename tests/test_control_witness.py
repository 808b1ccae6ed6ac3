"""The controller beside fixed-point PIDs that others wrote: CMSIS-DSP's (Arm), by its own Python package.

Where theirs is sound ours gives the same numbers; where it wraps or drifts ours does not.
"""

from dataclasses import replace

import numpy as np
import pytest

from forklift.control.controller import Controller, Curve
from forklift.control.presets import OPEN_LOOP

cmsisdsp = pytest.importorskip("cmsisdsp", reason="cmsisdsp is not installed: Arm's PIDs are no witness here")

FULL = 4096.0
"""What one of theirs stands for [mm/s]."""
TICK_S = 0.02
CORNER_HZ = 25.0
ABOVE = 400.0
"""The request about which the reference moves [mm/s], so that nothing falls below zero."""


def q(value: float, bits: int) -> int:
    return round(value * 2**bits)


def controller(proportional: float, integral: float, derivative: float, word: int = 32) -> Controller:
    """Ours with a table that says the speed it is asked for, and nothing between the request and the
    error."""
    names = {"proportional": proportional, "integral": integral / TICK_S, "derivative": derivative * TICK_S}
    given = (
        OPEN_LOOP
        | names
        | {"filter_rate": 100.0, "delay": 0.0, "u_min": 0.0, "u_max": 2000.0, "i_max": 1750.0}
    )
    made = Controller.read("thesis").with_word(word)
    made = made.with_numbers("free", "test", **given)
    same = Curve(first=0, spacing=6, values=[64.0 * k for k in range(32)], source="test")
    all_of_it = Curve(first=0, spacing=6, values=[1.0, 1.0], source="test")
    shared = {name: number.model_copy() for name, number in made.shared.items()}
    for name, value in {
        "request_most": 1600.0,
        "ramp_up": 1e5,
        "ramp_down": 1e5,
        "ramp_corner": CORNER_HZ,
    }.items():
        shared[name].value = value
    return replace(made, shared=shared, free=made.free.model_copy(update={"table": same, "ratio": all_of_it}))


def references(requests: np.ndarray) -> np.ndarray:
    """What the ramp's low-pass makes of requests; the ramp itself follows within a tick."""
    pole, smooth, found = float(np.exp(-2.0 * np.pi * CORNER_HZ * TICK_S)), 0.0, []
    for request in requests:
        smooth = pole * smooth + (1.0 - pole) * request
        found.append(smooth)
    return np.array(found)


def orders(one: Controller, requests: np.ndarray) -> np.ndarray:
    """Currents [mA], which the table makes of speeds [mm/s]; the encoder stands still."""
    readings = np.tile(np.array([500, 0, 1000, 1000, 40], np.int32), (len(requests), 1))
    currents, _ = one.core.ticks([int(r) for r in requests], readings)
    return np.array(currents)[:, 0].astype(float)


def theirs(bits: int, gains: tuple[float, float, float], errors: np.ndarray) -> np.ndarray:
    """arm_pid_q15 or arm_pid_q31 on errors [mm/s]: y + (Kp + Ki + Kd) x − (Kp + 2 Kd) x₁ + Kd x₂."""
    kind = f"q{bits}"
    kp, ki, kd = (q(gain, bits) for gain in gains)
    one = getattr(cmsisdsp, f"arm_pid_instance_{kind}")(Kp=kp, Ki=ki, Kd=kd)
    getattr(cmsisdsp, f"arm_pid_init_{kind}")(one, 1)
    step = getattr(cmsisdsp, f"arm_pid_{kind}")
    return np.array([step(one, q(error / FULL, bits)) for error in errors]) / 2.0**bits * FULL


def moving(count: int, seed: int = 5) -> np.ndarray:
    """Requests about `ABOVE`."""
    random = np.random.default_rng(seed)
    return np.repeat(random.integers(-300, 301, count // 10) + int(ABOVE), 10)


def test_the_31_bits_of_arm_and_ours_agree_to_half_a_milliampere_where_theirs_are_sound() -> None:
    # Ours adds the integral part a tick later: (Kp − Ki) and Ki of theirs are P and I of ours.
    p, i, d = 0.3, 0.004, 0.1
    requests = moving(300)
    wanted = references(requests)
    arm = theirs(31, (p - i, i, d), wanted)
    assert np.abs(arm).max() < 0.9 * FULL
    found = orders(controller(p, i, d), requests)
    # Half a milliampere of the order's rounding; a least bit of a speed, 2^−12 mm/s, adds up in the integral.
    apart = np.abs(found - (wanted + arm)).max()
    assert apart <= 0.5 + len(requests) * i * 2.0**-12 + 2.0**-6, apart


def test_the_15_bits_of_arm_lose_up_to_a_bit_a_tick_and_agree_within_that() -> None:
    p, i = 0.3, 0.004
    requests = moving(50)
    wanted = references(requests)
    arm = theirs(15, (p - i, i, 0.0), wanted)
    found = orders(controller(p, i, 0.0, word=16), requests)
    # theirs: a state truncated each tick, and three gains of 2^−16 relative to one.
    ticks = np.arange(1, len(requests) + 1)
    bound = FULL / 2**15 * ticks + 3.0 * 2.0**-16 * np.cumsum(wanted) + 1.0
    assert (np.abs(found - (wanted + arm)) <= bound).all()


def test_where_the_31_bits_of_arm_wrap_ours_saturate() -> None:
    arm = theirs(31, (0.4, 0.2, 0.0), np.full(8, 0.9 * FULL)) / FULL
    # A step of 0.9 with Kp = 0.4, Ki = 0.2 wraps in CMSIS-DSP.
    assert arm[2] > 0.89
    assert arm[3] < -0.9
    found = orders(controller(0.4, 0.2, 0.0), np.full(400, 1600))
    assert (np.diff(found) >= 0.0).all()
    assert found[-1] == 1750.0


def test_where_the_15_bits_of_arm_drift_ours_stay() -> None:
    random = np.random.default_rng(1)
    errors = random.integers(-8000, 8000, 10_000) / 2.0**15 * FULL
    arm = theirs(15, (0.3, 0.0, 0.0), np.append(errors, 0.0))
    assert arm[-1] < -0.1 * FULL, "proportional only, and off by a tenth of full scale at an error of zero"
    requests = np.append(random.integers(0, 800, 10_000), np.full(60, int(ABOVE)))
    for word in (16, 32):
        found = orders(controller(0.3, 0.0, 0.0, word), requests)
        assert np.abs(found[-1] - 1.3 * ABOVE) <= 1.0


def test_a_constant_error_of_a_few_bits_is_neither_lost_nor_magnified() -> None:
    arm = theirs(15, (0.3, 0.01, 0.0), np.full(10_000, -3.0 / 2**15 * FULL)) / FULL * 2**15
    assert arm[-1] < -9_000.0, "Ki of 0.01 on −3 bits for 10,000 ticks is −300 bits; CMSIS-DSP says −10,000"
    # Ours: a request of 8 mm/s for 2,000 ticks with Ki of 0.002 is 8 (1 + 2000 · 0.002).
    for word in (16, 32):
        found = orders(controller(0.0, 0.002, 0.0, word), np.full(2_000, 8))
        assert found[-1] == pytest.approx(8.0 * (1.0 + 2_000 * 0.002), abs=1.0)

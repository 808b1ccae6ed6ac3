"""The map of the least-damped mode: a controller's linear loop over load and oil temperature, with its
margins.

Source: Fri & Fahlén (2017), (4.6) to (4.12), sections 4.9 and 5.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.control.closed_loop import DELAY_TICKS
from forklift.control.controller import Controller, LiftSettings
from forklift.ensemble.stability import (
    Margins,
    Mode,
    OperatingPoint,
    StateSpace,
    closed,
    least_damped,
    margins,
    operating_point,
    plant,
    sampled,
)
from forklift.ensemble.tables import tick_s
from forklift.plant.forklift.speed_table import KELVIN, REFERENCE_DEGC, speed_to_current
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import Lift

SWING_BELOW_HZ = 10.0
"""Above, a mode is a controller's own: a predictor's, between the multiples of its delay's frequency. An
unladen free lift swings at 5.5 Hz."""


@dataclass(frozen=True)
class Damping:
    """The linear loop at one operating point.

    Attributes
    ----------
    lift, load_kg, oil_temperature_degc, speed_m_s
        Where: the steady speed of the forks, downward positive.
    open
        The least-damped mode of the plant under a constant current.
    closed
        That of the loop below `SWING_BELOW_HZ`; None if nothing oscillates.
    margins
        Of the loop opened at the valve's current.
    """

    lift: Lift
    load_kg: float
    oil_temperature_degc: float
    speed_m_s: float
    open: Mode | None
    closed: Mode | None
    margins: Margins


def damping_map(
    truck: Truck,
    controller: Controller,
    lift: Lift,
    *,
    loads_kg: Sequence[float] = (0.0, 400.0, 800.0, 1200.0, 1500.0),
    oil_temperatures_degc: Sequence[float] = (10.0, 20.0, 40.0, 60.0),
    speed_m_s: float = 0.3,
    delay_ticks: int | None = None,
) -> list[Damping]:
    """The loop linearised at a steady lowering of the same speed at every load and oil temperature.

    Parameters
    ----------
    speed_m_s
        Of the forks.
    delay_ticks
        From sensors to valve; `DELAY_TICKS` if None.

    Raises
    ------
    ForkliftError
        ``"no-steady-state"``.
    """
    late = (DELAY_TICKS[lift] if delay_ticks is None else delay_ticks) * tick_s()
    rows = []
    for t in oil_temperatures_degc:
        for load in loads_kg:
            wanted = speed_to_current(truck, lift, speeds=[speed_m_s], load_kg=load, oil_temperature_degc=t)
            command = float(wanted.current_a[-1])
            point = operating_point(truck, lift, command_a=command, load_kg=load, oil_temperature_degc=t)
            held = sampled(plant(point), delay_s=late)
            loop = opened(held, feedback(controller, point))
            rows.append(
                Damping(
                    lift,
                    load,
                    t,
                    point.speed_m_s,
                    least_damped(held),
                    least_damped(closed(loop), below_hz=SWING_BELOW_HZ),
                    margins(loop),
                )
            )
    return rows


def opened(held: StateSpace, answer: StateSpace) -> StateSpace:
    """The loop opened at the valve's current, closed by −1: `answer` takes both of the plant's outputs."""
    n, m = len(held.a), len(answer.a)
    a = np.zeros((n + m, n + m))
    a[:n, :n], a[n:, n:] = held.a, answer.a
    a[n:, :n] = answer.b @ held.c
    b = np.vstack([held.b, np.zeros((m, 1))])
    c = np.hstack([answer.d @ held.c, answer.c])
    return StateSpace(a, b, c, np.zeros((1, 1)), held.dt, held.names + answer.names)


def feedback(controller: Controller, point: OperatingPoint) -> StateSpace:
    """From speed of the forks [m/s] and cylinder pressure [Pa] to less of the current [A], at a constant
    reference.

    (A.17) before (4.12), whose error is less the corrections that have not shown yet as far as `prediction`
    says; the swing of the pressure through its resonator at the point's mean pressure; both times the slope
    of table and temperature scale, without quantisation, saturation, `overspeed` and the learning of the
    feed-forward.
    """
    lift: LiftSettings = getattr(controller, point.lift)
    dt = tick_s()
    speed = _pid(lift, dt)
    swing = _resonator(lift, point)
    slope = _slope(lift, point)
    k, n = len(speed.a), len(swing.a)
    a = np.zeros((k + n, k + n))
    a[:k, :k], a[k:, k:] = speed.a, swing.a
    b = np.zeros((k + n, 2))
    b[:k, :1], b[k:, 1:] = speed.b, swing.b
    # More speed asks for less current; a pressure's swing is added as it is.
    c = slope * np.hstack([speed.c, -swing.c])
    return StateSpace(a, b, c, slope * np.hstack([speed.d, -swing.d]), dt, speed.names + swing.names)


def _pid(lift: LiftSettings, dt: float) -> StateSpace:
    """From the speed [m/s] to what the PID takes off the speed ordered [m/s].

    ε = v̂ − κ (q₋₁ − q₋₁₋ₙ), q = P ε + I Σ₋ ε dt + D (ε − ε₋₁)/dt: v̂ is the speed through (A.17), n the
    reference's delay, κ `prediction` (Smith 1957).
    """
    names = ("proportional", "integral", "derivative", "filter_rate", "delay", "prediction")
    p, i, d, rate, delay, prediction = (lift.numbers[name].value for name in names)
    pole = float(np.exp(-rate * dt))
    hidden = 1 + round(delay) if prediction > 0.0 else 0

    def step(x: Floats, v: float) -> tuple[Floats, float]:
        taken = x[3:]
        smooth = pole * x[0] + (1.0 - pole) * v
        error = smooth - (prediction * (taken[0] - taken[-1]) if hidden else 0.0)
        less = p * error + x[1] + d * (error - x[2]) / dt
        kept = [smooth, x[1] + i * dt * error, error]
        return np.concatenate([kept, [less, *taken[:-1]] if hidden else []]), float(less)

    n = 3 + hidden
    columns = [step(column, 0.0) for column in np.eye(n)]
    driven, through = step(np.zeros(n), 1.0)
    return StateSpace(
        np.array([column for column, _ in columns]).T,
        driven[:, None],
        np.array([[less for _, less in columns]]),
        np.array([[through]]),
        dt,
        ("speed", "integral", "error before", *(f"correction {k + 1} before" for k in range(hidden))),
    )


def _slope(lift: LiftSettings, point: OperatingPoint) -> float:
    """Current [A] per speed ordered [m/s] at the point: (4.8) and the table, by what the table says of the
    current."""
    numbers = {name: lift.numbers[name].value for name in ("a", "b", "c", "d")}
    scale = numbers["a"] * (point.oil_temperature_degc + KELVIN) + numbers["b"]
    shift = numbers["c"] * (point.oil_temperature_degc - REFERENCE_DEGC) + numbers["d"]
    speeds = lift.table.first + float(1 << lift.table.spacing) * np.arange(len(lift.table.values))
    at = float(np.interp(1e3 * point.command_a - shift, lift.table.values, speeds))
    knot = int(np.clip(np.searchsorted(speeds, at, side="right") - 1, 0, len(speeds) - 2))
    rise = lift.table.values[knot + 1] - lift.table.values[knot]
    return float(scale * rise / (speeds[knot + 1] - speeds[knot]))


def _resonator(lift: LiftSettings, point: OperatingPoint) -> StateSpace:
    """From the pressure [Pa] to the speed added [m/s]: z ← ρ e^{jϑ} z + p − p₋₁, w = Re(γ z)."""
    dt = tick_s()
    if lift.swing is None:
        none = np.zeros((0, 0))
        return StateSpace(none, np.zeros((0, 1)), np.zeros((1, 0)), np.zeros((1, 1)), dt)
    frequency, damping, gain, lead = _at_pressure(lift, _pressure(point))
    omega = 2.0 * np.pi * frequency * dt
    pole = np.exp(-damping * omega + 1j * omega * np.sqrt(1.0 - damping * damping))
    tick = np.exp(-1j * omega)
    # A real swing e^{jωk}: γ times `with`, and its mirror image, are to make gain e^{j lead}.
    along = 0.5 * (1.0 - tick) / (1.0 - pole * tick)
    against = 0.5 * (1.0 - tick) / (1.0 - np.conj(pole) * tick)
    wanted = gain * np.exp(1j * np.radians(lead))
    x, y = along + against, 1j * (along - against)
    re, im = np.linalg.solve(np.array([[x.real, y.real], [x.imag, y.imag]]), [wanted.real, wanted.imag])
    turn = np.array([[pole.real, -pole.imag], [pole.imag, pole.real]])
    a = np.zeros((3, 3))
    a[:2, :2] = turn
    a[0, 2] = -1.0
    b = np.array([[1.0], [0.0], [1.0]])
    read: Floats = 1e-8 * np.array([[re, -im, 0.0]])  # mm/s per bar to m/s per Pa
    return StateSpace(a, b, read @ a, read @ b, dt, ("swing", "swing's quadrature", "pressure before"))


def _pressure(point: OperatingPoint) -> float:
    """Of the cylinder [Pa]."""
    from forklift.plant.forklift.tables import states

    return float(point.state[list(states()).index("cylinder_pressure")])


def _at_pressure(lift: LiftSettings, pressure_pa: float) -> tuple[float, float, float, float]:
    from forklift import _core

    swing = lift.swing
    assert swing is not None
    knots = float(1 << swing.spacing) * _core.PRESSURE_STEP_PA * np.arange(len(swing.frequency_hz))
    columns = (swing.frequency_hz, swing.damping, swing.gain_mm_s_per_bar, swing.lead_deg)
    frequency, damping, gain, lead = (float(np.interp(pressure_pa, knots, column)) for column in columns)
    return frequency, damping, gain, lead


def damping_table(rows: Sequence[Damping]) -> str:
    """A line an operating point."""
    lines = [
        f"{'lift':<5}{'degC':>5}{'kg':>6}{'open loop':>22}{'closed loop':>22}"
        f"{'gain':>8}{'delay [ms]':>12}{'disk':>7}"
    ]

    def said(mode: Mode | None) -> str:
        return f"{mode.frequency_hz:.2f} Hz, {mode.damping:.3f}" if mode else "no oscillation"

    for row in rows:
        m = row.margins
        lines.append(
            f"{row.lift:<5}{row.oil_temperature_degc:>5.0f}{row.load_kg:>6.0f}{said(row.open):>22}"
            f"{said(row.closed):>22}{m.gain:>8.2f}{1e3 * m.delay_s:>12.0f}{m.disk:>7.2f}"
        )
    return "\n".join(lines)

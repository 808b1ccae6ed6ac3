"""The linear view of a lift under its controller: the sampled loop, its eigenvalues and its margins.

The plant is linearised at a steady lowering by dual numbers in the core. Over a tick its input is held, so
that the sampled plant is exact: the matrix exponential of the augmented [A B; 0 0]; a delay of whole ticks
is as many shift states (Åström & Wittenmark 1997, sections 2.3 and 2.4). Matrices are those that
``control.StateSpace(A, B, C, D, dt)`` takes. The valve's hysteresis has no linearisation at rest:
`describing_function` says what a
sine sees of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forklift import _core
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.ensemble.tables import tick_s
from forklift.plant.forklift.geometry import FORKS_PER_CYLINDER
from forklift.plant.forklift.tables import states
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import Lift

Complex = NDArray[np.complex128]

SETTLING_S = 8.0
"""How long the lift is lowered to be steady: twenty periods of its oscillation."""
PIECE_S = 0.25
"""Of that, without an end of the stroke on the way: a cylinder at 1 m/s travels a quarter of a metre."""
UNSTABLE = 1e-6
"""An eigenvalue this far outside the unit circle grows by less than a hundredth in a minute: the position's
lies on it but for rounding."""
POINTS = 4000
"""Frequencies at which margins are looked for, even in the logarithm up to half the sampling rate."""


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u, y = C x + D u in ticks of `dt` seconds; continuous where `dt` is None.

    Attributes
    ----------
    a, b, c, d
        (n, n), (n, inputs), (outputs, n), (outputs, inputs).
    dt
        Of a tick [s].
    names
        Of the states, where they have one.
    """

    a: Floats
    b: Floats
    c: Floats
    d: Floats
    dt: float | None
    names: tuple[str, ...] = ()

    @property
    def eigenvalues(self) -> Complex:
        """Of A; sampled ones are stable within the unit circle. The largest magnitude first."""
        found = np.linalg.eigvals(self.a).astype(np.complex128)
        ordered: Complex = found[np.argsort(-np.abs(found), kind="stable")]
        return ordered

    def response(self, omega: Floats) -> Complex:
        """The gain of the first output over the first input at angular frequencies [rad/s]."""
        s = np.exp(1j * omega * self.dt) if self.dt else 1j * omega
        eye = np.eye(len(self.a))
        gains = [
            self.c[0] @ np.linalg.solve(z * eye - self.a, self.b[:, 0]) + self.d[0, 0]
            for z in np.atleast_1d(s)
        ]
        return np.array(gains)


@dataclass(frozen=True)
class Mode:
    """An oscillation of the closed loop.

    Attributes
    ----------
    frequency_hz, damping
        Of the continuous pole that a sampled eigenvalue λ stands for: ln λ / dt.
    per_tick
        abs(λ), by which it shrinks in a tick.
    """

    frequency_hz: float
    damping: float
    per_tick: float


@dataclass(frozen=True)
class Margins:
    """How far an open loop L, closed by −1, is from instability.

    Attributes
    ----------
    gain
        Factor on L at which the loop becomes unstable; infinite if none does.
    delay_s
        Further delay at which it does [s].
    disk
        Least distance of L from −1 (1/largest sensitivity), which bounds gain and phase at once.
    """

    gain: float
    delay_s: float
    disk: float


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """A steady lowering: where the plant is linearised.

    Attributes
    ----------
    command_a, load_kg, oil_temperature_degc
        What it is held at.
    state
        (states,) The lift's, in the order of `forklift.plant.forklift.tables.states`.
    speed_m_s
        Of the forks, downward positive.
    """

    truck: Truck
    lift: Lift
    command_a: float
    load_kg: float
    oil_temperature_degc: float
    state: Floats
    speed_m_s: float


def operating_point(
    truck: Truck, lift: Lift, *, command_a: float, load_kg: float, oil_temperature_degc: float
) -> OperatingPoint:
    """The steady lowering under a constant current, reached from rest by the adaptive solver.

    The position goes on moving: the linear view freezes it in the middle of the stroke.

    Raises
    ------
    ForkliftError
        ``"no-steady-state"`` if the lift hardly moves.
    """
    low, high = (float(truck.values[f"{lift}.cylinder.stroke_{end}"]) for end in ("lower", "upper"))  # type: ignore[arg-type]
    middle = (low + high) / 2.0
    command = np.zeros((1, 2))
    command[0, ("free", "main").index(lift)] = command_a
    velocity, position = (list(states()).index(name) for name in ("velocity", "position"))
    found: Floats | None = None
    # Lowered for a piece at a time from the middle of the stroke, with the motion that it ended with.
    for _ in range(round(SETTLING_S / PIECE_S)):
        run = truck.core.simulate(
            np.array([0.0, PIECE_S]),
            np.zeros(1),
            command,
            np.array([oil_temperature_degc], float),
            load_kg,
            lifts=lift,
            solver="adaptive",
            tolerance=1e-9,
            start=found,
        )
        found = run["states"][1].copy()
        found[position] = middle
    assert found is not None
    speed = -FORKS_PER_CYLINDER * float(found[velocity])
    if speed < 1e-3:
        raise ForkliftError(
            "no-steady-state",
            f"the {lift} lift lowers at {speed:.3g} m/s under {command_a:g} A; give a current that moves it",
            name="command_a",
            value=command_a,
        )
    return OperatingPoint(truck, lift, command_a, load_kg, oil_temperature_degc, found, speed)


def plant(point: OperatingPoint) -> StateSpace:
    """From the current [A] at the valve to the lowering speed of the forks [m/s] and the pressure [Pa],
    continuous."""
    _, a, b = _core.linearise(
        point.truck.core, point.lift, point.state, point.command_a, point.load_kg, point.oil_temperature_degc
    )
    names = tuple(states())
    c = np.zeros((2, len(a)))
    c[0, names.index("velocity")] = -FORKS_PER_CYLINDER
    c[1, names.index("cylinder_pressure")] = 1.0
    return StateSpace(a, b[:, None], c, np.zeros((2, 1)), None, names)


def sampled(system: StateSpace, dt: float | None = None, delay_s: float = 0.0) -> StateSpace:
    """The system under an input that is held over ticks of `dt` and comes late by `delay_s`, exactly.

    Over a tick the late input is first the older value, for the part of a tick by which the delay exceeds
    whole ticks, then the newer one: two exponentials. Older values are shift states.
    """
    from scipy.linalg import expm

    dt = dt or tick_s()
    n, m = system.a.shape[0], system.b.shape[1]

    def held(seconds: float) -> tuple[Floats, Floats]:
        augmented = np.zeros((n + m, n + m))
        augmented[:n, :n], augmented[:n, n:] = system.a, system.b
        moved = expm(augmented * seconds)
        return moved[:n, :n], moved[:n, n:]

    whole = int(np.floor(delay_s / dt + 1e-9))
    part = max(delay_s - whole * dt, 0.0)
    full, all_of = held(dt)
    late, new = np.zeros((n, m)), all_of
    if part > 1e-9 * dt:
        rest, new = held(dt - part)
        late = rest @ held(part)[1]
        whole += 1
    if whole == 0:
        return StateSpace(full, new, system.c, system.d, dt, system.names)
    # States: the plant's, then the inputs of one tick ago, two, … `whole`.
    size = n + m * whole
    a, b = np.zeros((size, size)), np.zeros((size, m))
    a[:n, :n] = full
    oldest = n + m * (whole - 1)
    a[:n, oldest : oldest + m] = late if part > 1e-9 * dt else new
    if part > 1e-9 * dt:
        if whole == 1:
            b[:n] = new
        else:
            a[:n, oldest - m : oldest] = new
    b[n : n + m] = np.eye(m)
    for k in range(1, whole):
        a[n + m * k : n + m * (k + 1), n + m * (k - 1) : n + m * k] = np.eye(m)
    c = np.hstack([system.c, np.zeros((len(system.c), m * whole))])
    shifts = tuple(f"input {k + 1} ticks ago" for k in range(whole))
    return StateSpace(a, b, c, system.d, dt, system.names + shifts)


def closed(loop: StateSpace) -> StateSpace:
    """The first output fed back, with a minus, to the first input."""
    factor = 1.0 / (1.0 + loop.d[0, 0])
    a = loop.a - factor * loop.b[:, :1] @ loop.c[:1]
    return StateSpace(
        a, factor * loop.b[:, :1], factor * loop.c[:1], factor * loop.d[:1, :1], loop.dt, loop.names
    )


def least_damped(loop: StateSpace, *, below_hz: float = np.inf) -> Mode | None:
    """The least damped of a closed loop's modes below a frequency; None if nothing oscillates there."""
    assert loop.dt
    found = [z for z in loop.eigenvalues if z.imag > 1e-9 and abs(z) > 1e-6]
    poles = [s for s in (np.log(z) / loop.dt for z in found) if s.imag < 2.0 * np.pi * below_hz]
    if not poles:
        return None
    worst = min(poles, key=lambda s: -s.real / abs(s))
    return Mode(
        float(worst.imag / (2.0 * np.pi)),
        float(-worst.real / abs(worst)),
        float(np.exp(worst.real * loop.dt)),
    )


def margins(loop: StateSpace) -> Margins:
    """Of an open loop that is closed by −1; all zero where that is unstable."""
    assert loop.dt
    if np.abs(closed(loop).eigenvalues).max() > 1.0 + UNSTABLE:
        return Margins(0.0, 0.0, 0.0)
    omega = np.geomspace(1e-2, np.pi / loop.dt * (1.0 - 1e-9), POINTS)
    gain = loop.response(omega)
    disk = float(np.min(np.abs(1.0 + gain)))
    crossing = (gain.imag[:-1] * gain.imag[1:] < 0.0) & (gain.real[:-1] < 0.0)
    share = -gain.imag[:-1][crossing] / (gain.imag[1:][crossing] - gain.imag[:-1][crossing])
    at = gain.real[:-1][crossing] + share * (gain.real[1:][crossing] - gain.real[:-1][crossing])
    # At its ends, a constant and half the sampling rate, the response is real.
    ends = np.real([_at(loop, 1.0), _at(loop, -1.0)])
    at = np.concatenate([at, ends[np.isfinite(ends)]])
    factors = -1.0 / at[(at < 0.0) & (at > -1.0)]
    size = np.abs(gain)
    unity = np.flatnonzero((size[:-1] - 1.0) * (size[1:] - 1.0) < 0.0)
    phase = np.mod(np.angle(gain[unity]) + np.pi, 2.0 * np.pi)
    delays = phase / omega[unity]
    return Margins(
        float(factors.min()) if len(factors) else float("inf"),
        float(delays.min()) if len(delays) else float("inf"),
        disk,
    )


def _at(loop: StateSpace, z: float) -> complex:
    """The gain of the first output over the first input at z = e^jωdt; infinite at a pole."""
    try:
        held = np.linalg.solve(z * np.eye(len(loop.a)) - loop.a, loop.b[:, 0])
    except np.linalg.LinAlgError:
        return complex(np.inf)
    return complex(loop.c[0] @ held + loop.d[0, 0])


def describing_function(amplitude_a: Floats, half_width_a: float) -> Complex:
    """What a sine of a current sees of a valve's hysteresis of half width f_hs: backlash (Gelb & Vander
    Velde 1968).

    Below f_hs nothing comes through; far above, all of it without a lag. With x = 1 − 2 f_hs/a:
    N = (1/π) (π/2 + arcsin x + x √(1 − x²)) − (j/π) (1 − x²), of amplitude a > f_hs.

    Parameters
    ----------
    amplitude_a
        Amplitudes of the sine [A].
    half_width_a
        f_hs [A].
    """
    amplitude = np.asarray(amplitude_a, np.float64)
    through = amplitude > half_width_a
    x = np.where(through, 1.0 - 2.0 * half_width_a / np.where(through, amplitude, 1.0), -1.0)
    real = (np.pi / 2.0 + np.arcsin(x) + x * np.sqrt(1.0 - x * x)) / np.pi
    found: Complex = real - 1j * (1.0 - x * x) / np.pi
    return found

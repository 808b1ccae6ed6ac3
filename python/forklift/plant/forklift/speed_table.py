"""Controller tables: from the speed that is asked for to the valve's current, the steady state inverted.

Source: Fri & Fahlén (2017), section 4.3 and Figure 5.6; with temperature, section 4.5.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forklift.base import arguments, output
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.forklift.commands import steps_to_current
from forklift.plant.forklift.geometry import FORKS_PER_CYLINDER
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.channels import LIFTS, Lift

if TYPE_CHECKING:
    import polars as pl

Steps = NDArray[np.int64]
Truths = NDArray[np.bool_]

MOST_STEP = 255
"""The ECU's highest step, 1.75 A."""
CLOSE_A = 1e-9
"""How closely a current is found [A]: far below the ECU's 6.9 mA."""
GRID_M_S = 0.025
"""Distance of a table's speeds where none are given: chosen."""
STILL_M_S = 1e-4
"""A fork speed that counts as standing still: the shut valve's leakage lets a load creep. Chosen."""
TEMPERATURES_DEGC = (20.0, 30.0, 40.0, 50.0, 60.0)
"""The range of oil temperatures of the thesis's recordings, section 3.5."""
KELVIN = 273.0
"""The thesis's 0 degC."""
REFERENCE_DEGC = 20.0
"""Where the shift of (4.9) counts from, Figure A.19."""


@dataclass(frozen=True, eq=False, repr=False)
class SpeedTable:
    """What `speed_to_current` gives: arrays (n,) over rising speeds, all currents not falling.

    Attributes
    ----------
    speed_m_s
        Of the forks [m/s], downward positive as in Figure 5.6, the first zero. A fork velocity elsewhere
        in this package is upward positive: it is minus this.
    rising_a, falling_a
        Steady current [A] for that speed where the current rose last and where it fell; they lie two half
        widths of the hysteresis apart. Zero speed has the largest current that does not move the lift.
    current_a
        Their mean: the valve's own curve, without hysteresis.
    rising_step, falling_step, step
        The same in steps of the ECU, 0 to 255, to the nearest; of zero speed the largest step at which the
        lift stands still.
    reached
        False where the speed is beyond what the lift reaches at the ECU's highest current or the valve's
        widest opening on either branch; the current is then that at which it is fastest.
    fastest_m_s
        The greatest speed that both branches reach [m/s].
    """

    truck: Truck
    lift: Lift
    load_kg: float
    oil_temperature_degc: float
    speed_m_s: Floats
    rising_a: Floats
    falling_a: Floats
    rising_step: Steps
    falling_step: Steps
    step: Steps
    reached: Truths
    fastest_m_s: float

    @property
    def current_a(self) -> Floats:
        return (self.rising_a + self.falling_a) / 2.0

    def current(self, speed_m_s: ArrayLike) -> Floats:
        """The mean current [A] at any speeds, straight between the table's and held outside them."""
        return np.interp(np.asarray(speed_m_s, np.float64), self.speed_m_s, self.current_a)

    def to_polars(self) -> pl.DataFrame:
        """A row per speed."""
        import polars as pl

        names = ("speed_m_s", "current_a", "rising_a", "falling_a", "step", "rising_step", "falling_step")
        return pl.DataFrame({name: getattr(self, name) for name in (*names, "reached")})

    def write(self, path: str | Path) -> Path:
        """Write `to_polars` as ``.csv``; whole or not at all.

        Raises
        ------
        ForkliftError
            ``"format-unknown"`` for another suffix, ``"not-writable"``.
        """
        output.check_suffix(path, (".csv",))
        return output.write_file(path, lambda temporary: self.to_polars().write_csv(temporary))

    def facts(self) -> dict[str, Any]:
        """Lift, load, oil temperature and greatest speed, for JSON."""
        names = ("lift", "load_kg", "oil_temperature_degc", "fastest_m_s")
        return {name: getattr(self, name) for name in names}

    def to_dict(self) -> dict[str, Any]:
        """The table and its conditions as plain data, for JSON."""
        return {
            "truck": self.truck.name,
            "truck_sha256": self.truck.sha256,
            **self.facts(),
            "table": self.to_polars().to_dict(as_series=False),
        }

    def __repr__(self) -> str:
        return (
            f"SpeedTable({self.truck.name!r}, {self.lift} lift, {self.load_kg:g} kg, "
            f"{self.oil_temperature_degc:g} degC, {len(self.speed_m_s)} speeds up to "
            f"{self.speed_m_s[-1]:.3g} m/s, {self.fastest_m_s:.3g} m/s reached)"
        )

    def __str__(self) -> str:
        head = f"{'speed [m/s]':>12} {'current [A]':>12} {'rising [A]':>11} {'falling [A]':>12} {'step':>5}"
        rows = [
            f"{speed:>12.3f} {mean:>12.4f} {up:>11.4f} {down:>12.4f} {step:>5d}"
            + ("" if reached else "  not reached")
            for speed, mean, up, down, step, reached in zip(
                self.speed_m_s,
                self.current_a,
                self.rising_a,
                self.falling_a,
                self.step,
                self.reached,
                strict=True,
            )
        ]
        return "\n".join([head, *rows])


def speed_to_current(
    truck: Truck | str | Path,
    lift: Lift,
    *,
    speeds: Sequence[float] | Floats | None = None,
    load_kg: float = 0.0,
    oil_temperature_degc: float = 40.0,
) -> SpeedTable:
    """The table from fork speed to current of a lift: its steady state, inverted (section 4.3).

    The steady speed does not fall with the current, so that the current is bisected, to a nanoampere.

    Parameters
    ----------
    speeds
        Fork speeds [m/s], downward positive, rising; zero is put in front if it is missing. By default
        every 25 mm/s up to the fastest that is reached.
    load_kg, oil_temperature_degc
        Where the table holds. The load hardly matters, as the compensator holds the pressure over the
        valve; for the temperature see `temperature_scaling`. By default no load, and 40 °C: the middle of
        the thesis's range.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for another lift, load or temperature out of range, or speeds that do not
        rise, are negative or not finite; ``"no-steady-state"``.
    """
    truck = truck_of(truck)
    if lift not in LIFTS:
        raise ForkliftError("argument-invalid", f"there is no lift {lift!r}; take free or main", name="lift")
    load_kg = arguments.number("load_kg", load_kg)
    oil_temperature_degc = arguments.number("oil_temperature_degc", oil_temperature_degc)
    steps = np.arange(MOST_STEP + 1)
    currents = steps_to_current(steps)
    state = _Steady(truck, lift, load_kg, oil_temperature_degc)
    branches = {bend: np.maximum.accumulate(state.speed(currents, bend)) for bend in (1.0, -1.0)}
    fastest = float(min(speed[-1] for speed in branches.values()))
    wanted = _speeds(speeds, fastest)
    table: dict[float, Floats] = {}
    stepped: dict[float, Steps] = {}
    for bend, speed in branches.items():
        table[bend] = state.current(wanted, bend, currents, speed)
        nearest = np.abs(currents[None, :] - table[bend][:, None]).argmin(axis=1)
        # Rounding up may set the lift in motion.
        nearest[0] = np.flatnonzero(currents <= table[bend][0])[-1]
        stepped[bend] = np.maximum.accumulate(nearest)
    mean = (table[1.0] + table[-1.0]) / 2.0
    step = np.abs(currents[None, :] - mean[:, None]).argmin(axis=1)
    step[0] = np.flatnonzero(currents <= mean[0])[-1]
    return SpeedTable(
        truck,
        lift,
        float(load_kg),
        float(oil_temperature_degc),
        wanted,
        table[1.0],
        table[-1.0],
        stepped[1.0],
        stepped[-1.0],
        np.maximum.accumulate(step),
        wanted <= fastest,
        fastest,
    )


@dataclass(frozen=True)
class TemperatureScaling:
    """How a table made at one oil temperature serves at others (Fri & Fahlén 2017, section 4.5.1).

    u′ = (T a + b) u scales the speed that enters the table, T in kelvin (°C + 273), (4.8);
    i′ = (T c + d) + i shifts the current that leaves it, T in °C less 20, (4.9). Table 5.3 has both lifts'
    values for mm/s and mA; here they are in SI.
    """

    a_per_k: float
    b: float
    c_a_per_k: float
    d_a: float

    def current(self, table: SpeedTable, speed_m_s: ArrayLike, oil_temperature_degc: ArrayLike) -> Floats:
        """The current [A] for fork speeds, downward positive [m/s], at oil temperatures [°C]."""
        t = np.asarray(oil_temperature_degc, np.float64)
        scaled = ((t + KELVIN) * self.a_per_k + self.b) * np.asarray(speed_m_s, np.float64)
        shifted: Floats = table.current(scaled) + (t - REFERENCE_DEGC) * self.c_a_per_k + self.d_a
        return shifted

    def left_over(
        self, table: SpeedTable, speed_m_s: Floats, oil_temperatures_degc: Floats, loads_kg: Floats
    ) -> Floats:
        """(loads, temperatures, speeds) By how much the lift settles faster than it is asked to [m/s].

        The steady state of the table's truck under the scaled and shifted current, the mean of both branches
        of the valve's hysteresis, less the speed asked for; speeds downward positive.
        """
        found = []
        for load in loads_kg:
            for t in oil_temperatures_degc:
                current = self.current(table, speed_m_s, t)
                steady = _Steady(table.truck, table.lift, float(load), float(t))
                found.append((steady.speed(current, 1.0) + steady.speed(current, -1.0)) / 2.0 - speed_m_s)
        return np.array(found).reshape(len(loads_kg), len(oil_temperatures_degc), len(speed_m_s))


def temperature_scaling(
    table: SpeedTable, *, oil_temperatures_degc: Sequence[float] = TEMPERATURES_DEGC
) -> TemperatureScaling:
    """The scaling (4.8) and shift (4.9) with which a table comes nearest those of other oil temperatures.

    The thesis tunes a, b, c and d with the controller in closed loop, where its integral part hides what
    they leave over; these are the ones that the steady state asks for, by least squares of the current
    over the speeds that are reached at every temperature. Cold oil scales speeds up, so that the table should
    go on beyond the speeds that will be asked for.

    Parameters
    ----------
    oil_temperatures_degc
        Where it shall serve [°C]; two or more.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for fewer temperatures, or a table whose lift hardly moves.
    """
    from scipy.optimize import least_squares

    temperatures = sorted({float(t) for t in oil_temperatures_degc})
    conditions: dict[str, Any] = {"load_kg": table.load_kg}
    others = [
        speed_to_current(
            table.truck, table.lift, speeds=table.speed_m_s, oil_temperature_degc=t, **conditions
        )
        for t in temperatures
    ]
    slowest = min((other.fastest_m_s for other in others), default=0.0)
    use = (table.speed_m_s > 0.0) & (table.speed_m_s <= min(slowest, table.fastest_m_s))
    if len(temperatures) < 2 or use.sum() < 3:
        raise ForkliftError(
            "argument-invalid",
            "a scaling with temperature needs two temperatures and three speeds that are reached at all of "
            f"them; there are {len(temperatures)} and {int(use.sum())}",
            name="oil_temperatures_degc",
            value=list(temperatures),
        )
    speed = np.tile(table.speed_m_s[use], len(temperatures))
    t = np.repeat(temperatures, int(use.sum()))
    wanted = np.concatenate([other.current_a[use] for other in others])

    def scaling(x: Floats) -> TemperatureScaling:
        # At the middle temperature the factor is 1 + x[1], the shift x[3]: nearly independent unknowns.
        middle = float(np.mean(temperatures))
        a, c = x[0] / 100.0, x[2] / 100.0
        return TemperatureScaling(
            float(a),
            float(1.0 + x[1] - a * (middle + KELVIN)),
            float(c),
            float(x[3] - c * (middle - REFERENCE_DEGC)),
        )

    found = least_squares(lambda x: scaling(x).current(table, speed, t) - wanted, np.zeros(4), x_scale=0.1)
    return scaling(found.x)


class _Steady:
    """Fork speed [m/s], downward positive, of one lift at one load and temperature, against current."""

    def __init__(self, truck: Truck, lift: Lift, load_kg: float, oil_temperature_degc: float) -> None:
        self.truck, self.lift = truck, lift
        self.conditions = load_kg, oil_temperature_degc

    def speed(self, current: Floats, bend: float) -> Floats:
        """(n,) at currents (n,) of one branch of the hysteresis."""
        full = (np.full(len(current), value) for value in (bend, *self.conditions))
        states, _ = self.truck.core.steady_state(self.lift, current, *full)
        speed: Floats = -FORKS_PER_CYLINDER * states[:, 0]
        return speed

    def current(self, wanted: Floats, bend: float, currents: Floats, speeds: Floats) -> Floats:
        """(n,) the least current for each speed, but of zero speed the largest that does not move the lift.

        `speeds` are those at `currents`, between which it lies; beyond, it is the least of the fastest.
        """
        targets = np.minimum(np.maximum(wanted, speeds[0] + STILL_M_S), speeds[-1])
        above = np.clip(np.searchsorted(speeds, targets), 1, len(speeds) - 1)
        lower, upper = currents[above - 1].copy(), currents[above].copy()
        while np.max(upper - lower) > CLOSE_A:
            middle = (lower + upper) / 2.0
            slower = self.speed(middle, bend) < targets
            lower, upper = np.where(slower, middle, lower), np.where(slower, upper, middle)
        found: Floats = np.maximum.accumulate(np.where(wanted > 0.0, upper, lower))
        return found


def _speeds(speeds: Sequence[float] | Floats | None, fastest: float) -> Floats:
    """(n,) rising from zero."""
    if speeds is None:
        return np.unique([0.0, *np.arange(0.0, fastest - 0.2 * GRID_M_S, GRID_M_S), max(fastest, 0.0)])
    try:
        wanted = np.array(speeds, np.float64)
        good = wanted.ndim == 1 and len(wanted) > 0 and bool(np.isfinite(wanted).all())
        good = good and wanted[0] >= 0.0 and bool((np.diff(wanted) > 0.0).all())
    except (TypeError, ValueError):
        good = False
    if not good:
        raise ForkliftError(
            "argument-invalid",
            "speeds are fork speeds in m/s, downward positive: give finite numbers that rise and are not "
            "negative",
            name="speeds",
        )
    return wanted if wanted[0] == 0.0 else np.append(0.0, wanted)

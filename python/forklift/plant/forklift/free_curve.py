"""A truck's free shapes: curves over one variable of operation that act at one port of a lift.

The physics stands in ``crates/hydro_core/src/effects/free_shape.rs``; ports and variables in the core's
tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.numbers import amount
from forklift.plant.forklift.curve_tables import COEFFICIENTS as COEFFICIENTS
from forklift.plant.forklift.curve_tables import FINE as FINE
from forklift.plant.forklift.curve_tables import IDS as IDS
from forklift.plant.forklift.curve_tables import ports as ports
from forklift.plant.forklift.curve_tables import variables as variables
from forklift.plant.forklift.tables import parameters
from forklift.recordings.channels import Lift

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck

RESOLVED = 1001
"""Values of its variable at which a curve's tops are looked for."""
PROMINENT = 0.25
"""Of all that a curve rises: by that a top stands out from what lies beside it. Chosen, as the two below."""
FEWEST_TOPS = 3
REGULAR = 0.5
"""Of the mean distance of tops: how much distances may differ, where they are called equal."""


@dataclass(frozen=True)
class FreeCurve:
    """One lift's free shape: ``truck.with_values(shape.parameters())`` has it.

    With f the sum of the coefficients times cubic B-splines over the range from `lower` to `upper`, constant
    beyond: f times the port's typical size joins a sum, or the logarithm of a factor. Where all coefficients
    are 0 it changes nothing.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for a port or a variable that is not in the table, for a range that is none,
        and for anything but 7 or 40 coefficients.
    """

    lift: Lift
    port: str
    """A key of `ports`."""
    variable: str
    """A key of `variables`."""
    lower: float
    upper: float
    lag_s: float = 0.0
    """Time constant with which the variable acts late, or is forgotten [s]; 0 is at once."""
    coefficients: tuple[float, ...] = (0.0,) * COEFFICIENTS
    fades: bool = False
    """Whether it is a function of the variable less what that was after the lag: of a change that is
    forgotten."""

    def __post_init__(self) -> None:
        for name, value, known in (
            ("port", self.port, ports()),
            ("variable", self.variable, variables()),
        ):
            if value not in known:
                raise _invalid(name, f"there is no {name} {value}; there are {', '.join(known)}")
        if not self.lower < self.upper:
            raise _invalid("upper", f"the range from {self.lower:g} to {self.upper:g} is none")
        if len(self.coefficients) not in IDS:
            counts = " or ".join(map(str, IDS))
            raise _invalid("coefficients", f"a shape has {counts}, not {len(self.coefficients)}")

    @classmethod
    def of(cls, truck: Truck, lift: Lift) -> FreeCurve | None:
        """The free shape that a lift of the truck has, if any."""
        known = [count for count, id in IDS.items() if f"{lift}.{id}.port" in truck.values]
        if not known:
            return None

        def value(name: str) -> float:
            return float(truck.values[f"{lift}.{IDS[known[0]]}.{name}"])  # type: ignore[arg-type]

        return cls(
            lift,
            list(ports())[int(value("port") + 0.5)],
            list(variables())[int(value("variable") + 0.5)],
            value("lower"),
            value("upper"),
            value("lag"),
            tuple(value(f"shape_{k}") for k in range(known[0])),
            value("fades") > 0.5,
        )

    @property
    def head(self) -> str:
        """What the full names of its parameters begin with."""
        return f"{self.lift}.{IDS[len(self.coefficients)]}."

    def parameters(self) -> dict[str, float]:
        """The parameters of a truck that has this shape, by full name."""
        numbers = {
            "port": list(ports()).index(self.port),
            "variable": list(variables()).index(self.variable),
            "lower": self.lower,
            "upper": self.upper,
            "lag": self.lag_s,
            "fades": float(self.fades),
        }
        shape = {f"shape_{k}": value for k, value in enumerate(self.coefficients)}
        return {self.head + name: float(value) for name, value in (shape | numbers).items()}

    def through(self, at: ArrayLike, values: ArrayLike) -> FreeCurve:
        """The same port and variable with the coefficients that come nearest to a curve.

        Parameters
        ----------
        at
            (n,) Values of the variable.
        values
            (n,) What the port shall have there: a sum in its unit, a factor.
        """
        splines = self._splines(np.asarray(at, dtype=float))
        wanted = np.asarray(values, dtype=float)
        wanted = (np.log(wanted) if self._factor else wanted) / ports()[self.port]["typical"]
        # Where the curve says nothing of a coefficient, it goes on evenly.
        even = 1e-3 * np.diff(np.eye(len(self.coefficients)), axis=0)
        rows, right = np.vstack([splines, even]), np.concatenate([wanted, np.zeros(len(even))])
        found = np.linalg.lstsq(rows, right, rcond=None)[0]
        spec = parameters()[f"{self.head}shape_0"]
        return replace(self, coefficients=tuple(map(float, np.clip(found, spec["lower"], spec["upper"]))))

    def at(self, variable: ArrayLike) -> Floats:
        """(n,) what the port has where the variable has these values and rests: a sum's unit, or a factor."""
        shape = ports()[self.port]["typical"] * np.array(self.coefficients)
        values: Floats = self._splines(np.asarray(variable, dtype=float)) @ shape
        return np.exp(values) if self._factor else values

    @property
    def over(self) -> tuple[str, float, bool]:
        """Its variable, how late that is [s], and whether it is what the variable changed by since."""
        return self.variable, self.lag_s, self.fades

    def curve(self, count: int = 101) -> tuple[Floats, Floats]:
        """The shape over its range: values of the variable, and what the port has there."""
        at = np.linspace(self.lower, self.upper, count)
        return at, self.at(at)

    @property
    def unit(self) -> str:
        """Of what the port has: ``"1"`` for a factor."""
        return "1" if self._factor else ports()[self.port]["unit"]

    @property
    def formula(self) -> str:
        """The law in one line."""
        symbol = f"{self.port}({self.variable})"
        law = "exp(f)" if self._factor else f"f [{self.unit}]"
        typical = ports()[self.port]["typical"]
        terms = " + ".join(f"{typical * value:.3g} B{k}" for k, value in enumerate(self.coefficients))
        late = f", {amount(self.lag_s, 's')} late" if self.lag_s > 0.0 else ""
        if self.fades:
            symbol = f"{self.port}(Δ{self.variable})"
            late = f" of the change that is forgotten with a time constant of {amount(self.lag_s, 's')}"
        unit = variables()[self.variable]["unit"]
        return (
            f"{symbol} = {law}, f = {terms.replace('+ -', '- ')}, cubic B-splines over "
            f"{self.lower:.4g} to {self.upper:.4g} {unit}{late}"
        )

    @property
    def sentence(self) -> str:
        """The shape in plain terms. Of a sum its rise alone: a constant belongs to the truck's parameters."""
        at, values = self.curve()
        low, high = int(np.argmin(values)), int(np.argmax(values))
        variable, unit = variables()[self.variable], variables()[self.variable]["unit"]
        name, meaning = self.port.replace("_", " "), variable["meaning"].partition(",")[0]
        late = f", with a lag of {amount(self.lag_s, 's')}" if self.lag_s > 0.0 else ""
        if self.fades:
            meaning, late = f"change of the {meaning} in the last {amount(self.lag_s, 's')}", ""
        where = [f"{_amount(at[k], unit)}" for k in (low, high)]
        if self._factor:
            told = (
                f"multiplies the {name} by {values[low]:.3g} where the {meaning} is {where[0]}, and by "
                f"{values[high]:.3g} where it is {where[1]}"
            )
        else:
            rise = f"{_amount(values[high] - values[low], self.unit)} more to the {name}"
            told = f"adds {rise} where the {meaning} is {where[1]} than where it is {where[0]}"
        return f"On the {self.lift} lift something {told}{late}.{self._repeats(meaning, unit)}"

    def _repeats(self, meaning: str, unit: str) -> str:
        """That it comes and goes at equal intervals, as what rolls or is linked does, where it is so."""
        at, values = self.curve(RESOLVED)
        rises = np.diff(values) > 0.0
        if np.count_nonzero(rises[:-1] & ~rises[1:]) < FEWEST_TOPS:
            return ""
        from scipy.signal import find_peaks  # loads much

        tops, _ = find_peaks(values, prominence=PROMINENT * np.ptp(values))
        apart = np.diff(at[tops])
        if len(tops) < FEWEST_TOPS or np.ptp(apart) > REGULAR * apart.mean():
            return ""
        return f" It has {len(tops)} maxima, one every {_amount(apart.mean(), unit)} or so of the {meaning}."

    @property
    def _factor(self) -> bool:
        return ports()[self.port]["join"] == "factor"

    def _splines(self, variable: Floats) -> Floats:
        """(n, coefficients) the B-splines over the range."""
        width = max(self.upper - self.lower, variables()[self.variable]["finest"])
        return splines((variable - self.lower) / width, len(self.coefficients))


def _amount(value: float, unit: str) -> str:
    """With a minus that is one."""
    return amount(value, unit).replace("-", "−")


def splines(y: Floats, count: int = COEFFICIENTS) -> Floats:
    """(n, coefficients) cubic B-splines on equal intervals of 0 to 1, constant beyond."""
    at = np.clip(y, 0.0, 1.0) * (count - 3)
    t = np.abs(at[:, None] - np.arange(count) + 1.0)
    far, near = np.maximum(2.0 - t, 0.0), np.maximum(1.0 - t, 0.0)
    values: Floats = (far**3 - 4.0 * near**3) / 6.0
    return values


def _invalid(name: str, message: str) -> ForkliftError:
    return ForkliftError("argument-invalid", message, name=name)


__all__: Sequence[str] = ["COEFFICIENTS", "FreeCurve", "ports", "variables"]

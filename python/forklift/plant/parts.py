"""What a machine is made of: states, parameters, inputs, outputs, ports, and what it may leave out.

All functions are elementwise: every quantity is an array over lanes (simulations that run side by side, with
other parameters each), or over times and lanes, and numpy broadcasts. No `if` on values: `np.where`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf, log
from numbers import Real
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from forklift.base.errors import ForkliftError
from forklift.plant.parameter import SCALES, Unknown

Values = Mapping[str, Any]
"""By name: arrays that broadcast over (times, lanes)."""

Derived = Callable[[NDArray[np.float64], Mapping[str, NDArray[np.float64]]], NDArray[np.float64]]
"""An input computed from others, sample by sample."""

STEADY = "steady"
"""Start of a state where its rate is zero."""

DEVIATIONS = 4.0
"""A range is taken as this many standard deviations of the prior."""
LARGEST = sys.float_info.max
"""Of a size that must be finite."""
WIDE = 10.0
"""A positive quantity whose range spans this factor is carried on a logarithmic scale."""


@dataclass(frozen=True)
class State:
    """A quantity that a balance integrates.

    Attributes
    ----------
    name, unit
        E.g. ``"level"``, ``"m"``.
    start
        A number if it is known; ``"free"`` if it is estimated; an output's name if that output's first
        sample tells it, as exactly as its noise allows; an input's name if it starts where that does;
        ``"steady"`` if its rate is zero there, with the first sample of the inputs and the parameters as they
        are, at every restart, too: it follows them in a fit. Several such states are steady together, with
        all others where they start; one that is pressed against an end of its range rests there.
    lower, upper
        Where it ends: it is held there (a stop, an empty tank). A free start lies between them.
    guess
        Of a free start; by default amid its range. Of a steady one where it is sought first: the rates may
        be zero at several places.
    spread
        Standard deviation of a free start's prior; by default a quarter of its range.
    shared
        Whether a free start is the same in all recordings.
    """

    name: str
    unit: str = "1"
    start: float | str = 0.0
    lower: float = -inf
    upper: float = inf
    guess: float | None = None
    spread: float | None = None
    shared: bool = False


@dataclass(frozen=True)
class Param:
    """A number of the machine, or of an effect.

    Attributes
    ----------
    name, unit, value
        Where the fit starts.
    lower, upper
        What is plausible; never left. The prior has a quarter of it as its standard deviation.
    known
        Whether it is left alone, as known: then only a hypothesis, if it is known within a range.
    per
        ``"plant"``: the same in all recordings; ``"recording"``: each has its own, about `value`.
    starts
        Of an effect's: from which values the search may start; by default from `value` alone.
    spread
        Standard deviation of the prior, if it is not a quarter of the range.
    source
        Where the number comes from.
    """

    name: str
    unit: str
    value: float
    lower: float = -inf
    upper: float = inf
    known: bool = False
    per: Literal["plant", "recording"] = "plant"
    starts: tuple[float, ...] = ()
    spread: float | None = None
    source: str = ""

    @property
    def scale(self) -> str:
        """``"log"`` if it is positive and its range spans a factor of ten, else ``"linear"``."""
        if self.spread is not None:
            return "linear"
        return "log" if self.lower > 0.0 and self.upper >= WIDE * self.lower else "linear"

    @property
    def width(self) -> float:
        """Standard deviation of its prior, on its scale."""
        if self.spread is not None:
            return self.spread
        if not np.isfinite([self.lower, self.upper]).all():
            return max(abs(self.value), 1e-6)
        ends = (log(self.lower), log(self.upper)) if self.scale == "log" else (self.lower, self.upper)
        return (ends[1] - ends[0]) / DEVIATIONS

    def unknown(self, name: str = "") -> Unknown:
        """As a coordinate of the search, by default under its own name."""
        forth = SCALES[self.scale].forth
        ends = [
            (forth(end) - forth(self.value)) / self.width if np.isfinite(end) else end
            for end in (self.lower, self.upper)
        ]
        return Unknown(
            (name or self.name,), self.unit, self.scale, (self.value,), self.width, ends[0], ends[1]
        )


@dataclass(frozen=True)
class Input:
    """What drives the machine, as it was recorded.

    Attributes
    ----------
    hold
        Between samples: ``"zero"`` keeps a sample until the next, ``"linear"`` goes straight to it.
    gain_range, offset_range
        Standard deviation of its gain about 1 and of its offset about 0, should they be off: hypotheses.
        Offset None: a tenth of its range in the recordings. 0: no such hypothesis.
    derived
        ``derived(time_s, u)``: computed from inputs that were recorded (a rate, a time at rest); such an
        input is not looked for in recordings, and is no hypothesis of its own.
    """

    name: str
    unit: str = "1"
    hold: Literal["zero", "linear"] = "zero"
    gain_range: float = 0.1
    offset_range: float | None = None
    derived: Derived | None = None


@dataclass(frozen=True)
class Output:
    """What was measured.

    Attributes
    ----------
    sigma
        Standard deviation of its noise; None: told from the samples, which must then be even and follow the
        truth smoothly over seven of them.
    count
        Step of a reading that is rounded down; 0: none.
    lower, upper
        Ends of what the sensor reads. A sample at one of them tells that the truth lies there or beyond.
    gain_range, offset_range, lag_range
        As an input's; the lag [s]: None a sample interval, 0 no such hypothesis.
    """

    name: str
    unit: str = "1"
    sigma: float | None = None
    count: float = 0.0
    lower: float = -inf
    upper: float = inf
    gain_range: float = 0.1
    offset_range: float | None = None
    lag_range: float | None = None


@dataclass(frozen=True)
class Port:
    """A place where an effect or an unknown input enters: `rhs` or `out` adds ``w[name]`` there.

    Attributes
    ----------
    kind
        ``"balance"``, ``"law"``, ``"input"`` or ``"sensor"``: what it means to be wrong there.
    size
        A usual size, in its unit.
    """

    name: str
    unit: str = "1"
    kind: Literal["balance", "law", "input", "sensor"] = "balance"
    size: float = 1.0


Term = Callable[[Values, Values, Values, Values], Mapping[str, Any]]


@dataclass(frozen=True, eq=False)
class Effect:
    """Physics that the machine's model may leave out.

    Attributes
    ----------
    id, name
        One word, and a sentence's beginning.
    params
        The first is the amplitude: at its `value` the effect is absent.
    ports
        What it acts on.
    term
        ``term(x, u, p, bus)``: what it adds, by port; and the rates of its own states, by state. `p` has the
        machine's parameters and the effect's own.
    states
        Its own.
    confused_with
        Ids of what looks like it.
    source
        Where the law stands.
    """

    id: str
    name: str
    params: tuple[Param, ...]
    ports: tuple[str, ...]
    term: Term
    states: tuple[State, ...] = ()
    confused_with: tuple[str, ...] = ()
    source: str = ""

    def full(self, param: Param) -> str:
        """A parameter's name among all."""
        return f"{self.id}.{param.name}"

    @property
    def amplitude(self) -> str:
        """Full name of the parameter that is zero where the effect is absent."""
        return self.full(self.params[0])


def _nothing(t: Any, x: Values, u: Values, p: Values) -> Mapping[str, Any]:
    return {}


@dataclass(frozen=True, eq=False)
class Plant:
    """A machine: its equations, and what a diagnosis may do with them.

    Attributes
    ----------
    rhs
        ``rhs(t, x, u, w, p, bus)``: rate of every state, by name. A plant without states needs none.
    out
        ``out(t, x, u, w, p, bus)``: every output, by name.
    bus
        ``bus(t, x, u, p)``: named quantities on the way (a flow, a speed): effects may use them, and regions
        are told in them. They do not depend on effects.
    score
        ``"free"``: one run over each recording; ``"restart"``: every `horizon_s` seconds the states start
        anew; ``"algebraic"``: no states.
    max_dt
        Longest step of the integrator [s]. By default from sample to sample, and across a gap of the clock
        as long as a usual sample.
    order
        Of the integrator.
    """

    name: str
    params: tuple[Param, ...]
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    out: Callable[..., Mapping[str, Any]]
    states: tuple[State, ...] = ()
    ports: tuple[Port, ...] = ()
    effects: tuple[Effect, ...] = ()
    rhs: Callable[..., Mapping[str, Any]] | None = None
    bus: Callable[..., Mapping[str, Any]] = _nothing
    score: Literal["free", "restart", "algebraic"] = "free"
    horizon_s: float = inf
    max_dt: float = inf
    order: Literal[2, 4] = 4
    source: str = ""

    def __post_init__(self) -> None:
        parts: tuple[State | Param | Input | Output, ...] = (
            *self.states, *self.params, *self.inputs, *self.outputs,
        )  # fmt: skip
        names = [one.name for one in parts]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise self._error(f"the name {twice[0]} is given twice", twice[0])
        self._check_values()
        if bool(self.states) != (self.rhs is not None):
            raise self._error("a plant with states needs a right-hand side, and one without has none", "rhs")
        if (self.score == "algebraic") != (not self.states):
            raise self._error("what has no states is scored as algebraic, and nothing else is", "score")
        if self.score == "restart" and not np.isfinite(self.horizon_s):
            raise self._error("a restart needs a horizon in seconds", "horizon_s")
        driven, seen = {one.name for one in self.inputs}, {one.name for one in self.outputs}
        for state, told in (
            *((state, driven | seen) for state in self.states),
            *((state, driven) for effect in self.effects for state in effect.states),
        ):
            if isinstance(state.start, str) and state.start not in {"free", STEADY, *told}:
                raise self._error(
                    f"state {state.name} cannot start at {state.start!r}; give a number, 'free', {STEADY!r}"
                    f"{''.join(f', {name!r}' for name in sorted(told))}",
                    state.name,
                )
            if state.start == "free" and not np.isfinite([state.lower, state.upper]).all():
                raise self._error(f"state {state.name} starts freely, so that it needs bounds", state.name)
        for one in (*self.params, *(one for effect in self.effects for one in effect.params)):
            if not all(one.lower <= value <= one.upper for value in (one.value, *one.starts)):
                raise self._error(
                    f"parameter {one.name} starts outside {one.lower:g} to {one.upper:g}", one.name
                )
            if not one.known and one.spread is None and not one.lower < one.upper:
                raise self._error(f"parameter {one.name} is not known and has no range", one.name)
        places = {*(port.name for port in self.ports), *(one.name for one in self.inputs)}
        for effect in self.effects:
            if not effect.params:
                raise self._error(f"effect {effect.id} needs an amplitude", effect.id)
            if missing := [port for port in effect.ports if port not in places]:
                raise self._error(f"effect {effect.id} acts on {missing[0]}, which is no port", effect.id)

    def _check_values(self) -> None:
        """Words are those that are known, and sizes positive."""
        params = (*self.params, *(one for effect in self.effects for one in effect.params))
        states = (*self.states, *(one for effect in self.effects for one in effect.states))
        words: list[tuple[str, str, object, tuple[object, ...]]] = [
            ("", "score", self.score, ("free", "restart", "algebraic")),
            ("", "order", self.order, (2, 4)),
            *((one.name, "hold", one.hold, ("zero", "linear")) for one in self.inputs),
            *((one.name, "kind", one.kind, ("balance", "law", "input", "sensor")) for one in self.ports),
            *((one.name, "per", one.per, ("plant", "recording")) for one in params),
        ]
        for owner, key, value, known in words:
            if value not in known:
                told = " or ".join(map(repr, known))
                raise self._error(f"{_of(owner)}{key} is {value!r}; write {told}", owner or key)
        sizes: list[tuple[str, str, object, float]] = [
            ("", "max_dt", self.max_dt, inf),
            ("", "horizon_s", self.horizon_s, inf),
            *((one.name, "sigma", one.sigma, LARGEST) for one in self.outputs if one.sigma is not None),
            *((one.name, "size", one.size, LARGEST) for one in self.ports),
            *((one.name, "spread", one.spread, LARGEST) for one in params if one.spread is not None),
            *((one.name, "spread", one.spread, LARGEST) for one in states if one.spread is not None),
        ]
        for owner, key, size, most in sizes:
            if not (isinstance(size, Real) and 0.0 < float(size) <= most):
                raise self._error(f"{_of(owner)}{key} is {size!r}; write a positive number", owner or key)

    def _error(self, what: str, name: str) -> ForkliftError:
        return ForkliftError("plant-invalid", f"plant {self.name}: {what}", name=name)


def _of(owner: str) -> str:
    return f"of {owner} " if owner else ""

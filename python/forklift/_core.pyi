"""The Rust core, as Python sees it. Tables are the single home of names, units, bounds and meanings."""

from collections.abc import Mapping, Sequence
from typing import Literal, Protocol, TypedDict, final, type_check_only

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Steps = NDArray[np.int64]

__all__ = [
    "CONTROL_TICK_S",
    "ENCODER_COUNT_M",
    "HUBER",
    "LANES",
    "PRESSURE_STEP_PA",
    "SINGLE_LANES",
    "Case",
    "Controller",
    "Ensemble",
    "Responses",
    "Truck",
    "__version__",
    "channel_table",
    "closed_loop",
    "dither",
    "effect_table",
    "encoder",
    "ensemble_tables",
    "height_sensor",
    "interval_cost",
    "lift_setting_table",
    "linearise",
    "linearised",
    "low_pass",
    "misfit",
    "output_table",
    "parameter_table",
    "port_table",
    "pressure_sensor",
    "prms",
    "quantise_current",
    "residuals",
    "shape_variables",
    "shared_setting_table",
    "simulate_variants",
    "staircase",
    "state_table",
    "steps_to_current",
    "temperature_sensor",
]
__version__: str
CONTROL_TICK_S: float  # from one call of the controller to the next
ENCODER_COUNT_M: float  # travel per count of a position encoder
HUBER: float  # standard deviations beyond which a residual counts by its distance
LANES: int  # members that fill this processor's registers: 16 with AVX-512, 8 with AVX2, else 1
SINGLE_LANES: int  # the same in single precision: 32 with AVX-512, else 1
PRESSURE_STEP_PA: float  # resolution of a pressure sensor

@type_check_only
class ParameterSpec(TypedDict):
    name: str  # within a lift: "viscosity.nu_0"; in a truck "free.viscosity.nu_0"
    symbol: str  # as the thesis prints it
    unit: str
    lower: float
    upper: float
    scale: Literal["log", "linear", "loglog", "logcos"]
    origin: Literal["given", "chosen", "steady", "prms"]  # the column "Source" of Tables 5.1 and 5.2
    equation: str
    meaning: str
    bounds_reason: str
    length: Literal["scalar", "knots"]

@type_check_only
class EffectParameterSpec(ParameterSpec):
    plausible_lower: float  # where it may lie on a truck that has the effect: a search starts between
    plausible_upper: float

@type_check_only
class QuantitySpec(TypedDict):
    name: str
    unit: str
    meaning: str

@type_check_only
class StateSpec(QuantitySpec):
    scale: float  # a typical size, which the adaptive solver's absolute tolerance is measured by

@type_check_only
class ChannelSpec(QuantitySpec):
    lower: float
    upper: float
    typical_lower: float | None  # the range in which a recording's largest value lies, where there is one
    typical_upper: float | None

@type_check_only
class EffectSpec(TypedDict):
    id: str
    scope: Literal["lift", "mast"]  # lift: "main.leakage.coefficient"; mast: "mast_coupling.factor"
    equation: str
    source: str
    parameters: list[EffectParameterSpec]
    quiet: float  # value of the first parameter (the amplitude) at which the model is the one without it
    amplitudes: int  # how many of the first parameters are amplitudes: 1, but for a shape
    states: list[StateSpec]
    shows: list[tuple[str, str, float]]  # which of its states is added to which output, times which factor

@type_check_only
class PortSpec(QuantitySpec):
    join: Literal["sum", "factor"]
    typical: float  # what counts as one there: of a sum in its unit, of a factor of its logarithm

@type_check_only
class ShapeVariable(QuantitySpec):
    finest: float  # the narrowest range
    # By the effect's lift: the output that shows it, a speed's but for the sign, and how much of the variable
    # one unit of that output is.
    outputs: dict[str, tuple[str, float]]

@type_check_only
class Result(TypedDict):
    outputs: _Floats  # (n, outputs), columns as in output_table()
    states: _Floats  # (n, states)
    state_names: list[str]
    statistics: dict[str, int]

def parameter_table() -> list[ParameterSpec]: ...
def state_table() -> list[StateSpec]: ...
def output_table() -> list[QuantitySpec]: ...
def channel_table() -> list[ChannelSpec]: ...
def effect_table() -> list[EffectSpec]: ...
def port_table() -> list[PortSpec]: ...
def shape_variables() -> list[ShapeVariable]: ...

@final
class Case:
    """The inputs of one recording and the times at which its outputs are wanted; along `command`, by how
    much each command grows."""

    def __new__(
        cls,
        time: _Floats,
        command_time: _Floats,
        command: _Floats,
        oil_temperature: _Floats,
        command_slope: _Floats | None = None,
    ) -> Case: ...

@final
class Responses:
    """How a recording answers hats over time at ports."""

    @property
    def directions(self) -> int:
        """Along how many the runs were differentiated."""
    def at(self, port: str) -> _Floats:
        """Derivatives (n, outputs, hats) along the hats at one of the ports."""

@final
class Truck:
    """A truck's parameters, checked against the tables; its effects are those whose parameters are given."""

    def __new__(cls, values: Mapping[str, float | Sequence[float]]) -> Truck: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def values(self) -> _Floats: ...
    @property
    def effects(self) -> list[str]: ...
    def simulate(
        self,
        time: _Floats,  # (n,) s, strictly increasing: where the result is wanted
        command_time: _Floats,  # (m,) s, strictly increasing, command_time[0] <= time[0]
        command: _Floats,  # (m, 2) A, free and main, held from command_time[k] until the next
        oil_temperature: _Floats,  # (m,) degC, held likewise
        load: float,  # kg
        *,
        lifts: str = "both",  # or "free", "main"
        solver: str = "adaptive",  # or "fixed"
        tolerance: float = ...,
        substeps: int = ...,
        start: _Floats | None = None,  # initial state, else at rest at the sensors' usual start
    ) -> Result: ...
    def differentiate(
        self,
        cases: Sequence[Case],
        unknowns: _Floats,  # (cases, 5): load [kg], oil's offset and warming [K], start of free and main [m]
        directions: Sequence[str],  # parameters, "load", "oil_temperature", "oil_warming", "free.start", …
        *,
        substeps: int = ...,
    ) -> list[tuple[_Floats, _Floats]]:
        """Per case outputs (n, outputs) and derivatives (n, outputs, directions)."""

    def added(
        self,
        case: Case,
        unknowns: _Floats,  # as of responses
        others: Sequence[Truck],  # of the same parameters' names
        *,
        substeps: int = ...,
    ) -> list[tuple[str, str, _Floats]]:
        """What each effect adds at a port it moves, "main.leakage" at "main.cylinder_flow": (1 + others, n),
        of this truck and of the others in its states; in a sum's unit, of a factor the relative change."""

    def hat_responses(
        self,
        case: Case,
        unknowns: _Floats,  # as of responses
        ports: Sequence[str],
        centres: _Floats,  # (hats,) s, a width apart
        width: float,
        *,
        substeps: int = ...,
    ) -> Responses:
        """The same for hats side by side, from one run for all of them, fixed steps."""

    def responses(
        self,
        case: Case,
        unknowns: _Floats,  # (5,): load [kg], oil's offset and warming [K], start of free and main [m]
        ports: Sequence[str],  # "free.force"
        centres: _Floats,  # (hats,) s
        width: float,  # s, from a hat's highest point to its end
        *,
        substeps: int = ...,
    ) -> _Floats:
        """Derivatives (n, outputs, ports, hats) along hats over time at ports, fixed steps."""

    def steady_velocity(
        self,
        lift: str,  # "free" or "main"
        current: _Floats,  # (n,) A, commanded
        bend: _Floats,  # (n,) share of the valve's hysteresis: 1 where the current rose, -1 where it fell
        pressure: _Floats,  # (n,) Pa, cylinder pressure p_A
        oil_temperature: _Floats,  # (n,) degC
        *,
        pressure_rate: _Floats | None = None,  # (n,) Pa/s, else 0
        directions: Sequence[str] | None = None,  # parameters, "current", "pressure", "oil_temperature"
    ) -> tuple[_Floats, _Floats]:
        """Cylinder velocities (n,) [m/s], upward positive, and their derivatives (n, directions)."""

    def steady_state(
        self,
        lift: str,
        current: _Floats,
        bend: _Floats,
        load: _Floats,  # (n,) kg
        oil_temperature: _Floats,
        *,
        directions: Sequence[str] | None = None,  # parameters, "current", "load", "oil_temperature"
    ) -> tuple[_Floats, _Floats]:
        """Cylinder velocities [m/s] and pressures [Pa] (n, 2), and their derivatives (n, 2, directions)."""

def simulate_variants(
    truck: Truck,
    values: _Floats,  # (variants, values), in the order of Truck.names
    loads: _Floats,  # (variants,) kg
    oil_temperatures: _Floats,  # (variants,) degC
    time: _Floats,  # (n,) s: where the outputs are wanted
    command_time: _Floats,  # (m,) s
    command: _Floats,  # (m, 2) A, free and main, held
    *,
    lifts: str = "both",
    substeps: int = ...,
) -> _Floats:
    """Outputs (variants, n, outputs) under one command, with fixed substeps, in lanes and on all cores."""

def prms(
    n_samples: int,
    seed: int,
    low: int = 58,
    high: int = 174,
    levels: int = 8,
    switching_probability: float = 0.05,
) -> _Steps: ...
def staircase(levels: Sequence[int] | _Steps, samples_per_level: int) -> _Steps: ...
def steps_to_current(steps: Sequence[int] | _Steps) -> _Floats: ...
def quantise_current(current: _Floats) -> _Floats: ...
def low_pass(current: _Floats, sample_rate_hz: float, cutoff_hz: float) -> _Floats: ...
def dither(
    time: _Floats, current: _Floats, amplitude: float, frequency_hz: float
) -> tuple[_Floats, _Floats]: ...
def encoder(position: _Floats) -> _Floats: ...
def pressure_sensor(
    signal: _Floats, seed: int, stream: int, noise: float = ..., step: float = ...
) -> _Floats: ...
def temperature_sensor(
    signal: _Floats, seed: int, stream: int, noise: float = ..., step: float = ...
) -> _Floats: ...
def height_sensor(
    signal: _Floats, seed: int, stream: int, noise: float = ..., step: float = ...
) -> _Floats: ...

@type_check_only
class ConditionSpec(QuantitySpec):
    lower: float
    upper: float
    default: float

@type_check_only
class EnsembleTables(TypedDict):
    conditions: list[ConditionSpec]  # what a member's run can be given besides truck and controller
    signals: list[QuantitySpec]  # what a requirement may speak of
    measures: list[QuantitySpec]  # what is measured of every member and lift
    verdicts: list[QuantitySpec]  # what may become of a member; its number is its place
    tick_s: float

@type_check_only
class Trace(TypedDict):
    verdict: int
    numbers: _Floats  # as a row of Ensemble.run
    outputs: _Floats  # (ticks, outputs), columns as in output_table()
    reference: _Floats  # (ticks, 2) [m/s], free and main
    current: _Floats  # (ticks, 2) [A], ordered, before the delay
    request: _Floats  # (ticks,) [m/s]
    tick_s: float

def ensemble_tables() -> EnsembleTables: ...
def linearise(
    truck: Truck,
    lift: Literal["free", "main"],
    state: _Floats,
    command: float,
    load: float,
    oil_temperature: float,
) -> tuple[_Floats, _Floats, _Floats]:
    """Rates (n,) of one lift about a state, their derivatives (n, n) along the states and (n,) along the
    command."""

@final
class Ensemble:
    """Lowerings of one truck, varied: members are drawn, run in lanes on all cores, and judged while they
    run."""

    def __new__(
        cls,
        truck: Truck,
        lifts: Literal["both", "free", "main"],
        *,
        conditions: Mapping[str, float],
        profile: Sequence[tuple[float, float]],
        vary: Sequence[tuple[str, str, Sequence[float]]],
        require: Sequence[Mapping[str, float | str]],
        settle_s: float,
        band_m_s: float,
        duration_s: float,
        substeps: int,
        seed: int,
        controller: tuple[list[float], _Lift, _Lift, int] | None = None,
        threads: int = 0,
        precision: Literal["double", "single"] = "double",
    ) -> Ensemble: ...
    @property
    def columns(self) -> list[str]: ...
    @property
    def threads(self) -> int: ...
    def uniform(self, first: int, count: int) -> _Floats:
        """Uniform numbers (count, varied) of the members from `first` on, each a function of seed and
        index."""

    def values(self, uniform: _Floats) -> _Floats:
        """What the uniform numbers (n, varied) come to."""

    def run(
        self, values: _Floats, streams: NDArray[np.uint64], *, lanes: int | None = None
    ) -> tuple[NDArray[np.uint8], _Floats]:
        """Verdicts (n,) and numbers (n, margins and measures) of members by values and sequences of noise."""

    def trace(self, values: _Floats, stream: int) -> Trace:
        """One member by itself, with its trajectory; its numbers have the bits of `run`."""

@type_check_only
class SettingSpec(TypedDict):
    name: str
    unit: str
    lower: float
    upper: float
    meaning: str

@type_check_only
class RangeSpec(TypedDict):
    lift: Literal["", "free", "main"]  # "": what both share
    variable: str
    reach: tuple[int, int]  # before saturation
    kept: tuple[int, int]
    scale: int  # the value is the integer / 2^scale in `unit`
    unit: str
    saturates: bool

_Curve = tuple[int, int, list[float]]  # first place, base-2 logarithm of the knots' distance, values
_Swing = tuple[
    int, list[float], list[float], list[float], list[float]
]  # distance; Hz, damping, mm/s per bar, degrees
_Shaper = tuple[int, list[float], list[float]]  # distance; delays in s, shares
_Lift = tuple[
    list[float], _Curve, _Curve, _Swing | None, _Shaper | None
]  # numbers, speed table, ratio, pressure's swing, shaper

def lift_setting_table() -> list[SettingSpec]: ...
def shared_setting_table() -> list[SettingSpec]: ...

@final
class Controller:
    def __new__(cls, shared: list[float], free: _Lift, main: _Lift, word: int) -> Controller: ...
    @property
    def hash(self) -> str: ...
    @property
    def widest(self) -> int: ...
    def c_sources(self, name: str) -> tuple[str, str, str, str, str]: ...
    def helper_digest(self, helper: str, number: int, first: int, last: int) -> int: ...
    def digest(self, seed: int, ticks: int) -> int: ...
    def ranges(self) -> list[RangeSpec]: ...
    def ticks(
        self, requests: list[int], readings: NDArray[np.int32], floating: bool = False
    ) -> tuple[list[list[int]], list[list[int]]]: ...

@type_check_only
class Loop(TypedDict):
    outputs: _Floats  # (members, ticks, outputs)
    reference: NDArray[np.int32]  # (members, ticks, 2) [mm/s]
    current: NDArray[np.int32]  # (members, ticks, 2) [mA]
    readings: NDArray[
        np.int32
    ]  # (members, ticks or none, 5) positions, pressures, temperature, as `Controller.ticks`

def closed_loop(
    trucks: list[Truck],
    controllers: list[Controller],
    loads: list[float],
    oil_temperatures: list[float],
    starts: list[list[float]],
    requests: NDArray[np.int32],
    delays: list[int],
    noises: list[list[float]],
    zeros: list[list[float]],
    streams: list[int],
    *,
    seed: int,
    lifts: str = "both",
    substeps: int = ...,
    floating: bool = False,
    noted: bool = False,
) -> Loop: ...

# Residuals and derivatives, of any model.

@type_check_only
class _Seen(Protocol):
    """One channel of a recording: its column among the outputs, at which rows it was read, what was read, the
    count of an encoder or 0, between which ends the sensor reads, and its weight or softness."""

    @property
    def column(self) -> int: ...
    @property
    def rows(self) -> NDArray[np.intp] | None: ...
    @property
    def read(self) -> _Floats: ...
    @property
    def count(self) -> float: ...
    @property
    def ends(self) -> tuple[float, float]: ...
    @property
    def sigma(self) -> float: ...

def misfit(
    read: _Floats,
    model: _Floats,
    sigma: float,
    *,
    count: float = 0.0,
    ends: tuple[float, float] = ...,
) -> tuple[_Floats, _Floats]: ...
def interval_cost(read: _Floats, model: _Floats, count: float, softness: float) -> float: ...
def residuals(recordings: Sequence[tuple[_Floats, Sequence[_Seen]]]) -> list[_Floats]: ...
def linearised(
    recordings: Sequence[tuple[_Floats, _Floats, Sequence[_Seen], Sequence[int], Sequence[float]]],
    unknown_of: Sequence[int],
    factors: Sequence[float],
    unknowns: int,
    *,
    slopes_too: bool = False,
) -> list[tuple[_Floats, _Floats, _Floats, _Floats]]: ...

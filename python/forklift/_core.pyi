"""The Rust core, as Python sees it. Tables are the single home of names, units, bounds and meanings."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

class ParameterSpec(TypedDict):
    name: str  # within a lift: "viscosity.nu_0"; in a truck "free.viscosity.nu_0"
    symbol: str  # as the thesis prints it
    unit: str
    lower: float
    upper: float
    scale: Literal["log", "linear"]
    origin: Literal["given", "chosen", "steady", "prms"]  # the column "Source" of Tables 5.1 and 5.2
    equation: str
    meaning: str
    bounds_reason: str
    length: Literal["scalar", "knots"]

class QuantitySpec(TypedDict):
    name: str
    unit: str
    meaning: str
    scale: float

class EffectSpec(TypedDict):
    id: str
    scope: Literal["lift", "mast"]  # lift: "main.leakage.coefficient"; mast: "mast_coupling.factor"
    equation: str
    source: str
    parameters: list[ParameterSpec]
    quiet: float  # value of the first parameter (the amplitude) at which the model is the one without it
    states: list[QuantitySpec]

def parameter_table() -> list[ParameterSpec]: ...
def state_table() -> list[QuantitySpec]: ...
def output_table() -> list[QuantitySpec]: ...
def channel_table() -> list[QuantitySpec]: ...
def effect_table() -> list[EffectSpec]: ...

class Truck:
    """A truck's parameters, checked against the tables; effects are those whose parameters are given."""

    def __init__(self, values: Mapping[str, float | Sequence[float]]) -> None: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def values(self) -> Floats: ...
    @property
    def effects(self) -> list[str]: ...
    def simulate(
        self,
        time: Floats,  # (n,) s, strictly increasing: where the result is wanted
        command_time: Floats,  # (m,) s, strictly increasing, command_time[0] <= time[0]
        command: Floats,  # (m, 2) A, free and main, held from command_time[k] until the next
        oil_temperature: Floats,  # (m,) degC, held likewise
        load: float,  # kg
        *,
        lifts: Literal["both", "free", "main"] = "both",
        solver: Literal["adaptive", "fixed"] = "adaptive",
        tolerance: float = ...,
        substeps: int = ...,
        start: Floats | None = None,  # initial state, else at rest at the sensors' usual start
    ) -> dict[str, Any]:
        """``{"outputs": (n, outputs), "states": (n, states), "state_names": [...], "statistics": {...}}``."""

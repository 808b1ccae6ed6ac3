"""Simulate a truck under a command, or under the command of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from forklift import _core
from forklift.base import arguments, output
from forklift.base.arrays import Floats
from forklift.base.cell import Cell, Celled
from forklift.base.errors import ForkliftError
from forklift.base.numbers import amount, defined
from forklift.base.plotted import Line, Plotted
from forklift.base.sheet import Curve, Curves, Listing, Sheet, Sheeted
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.tables import outputs, states
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.channels import COMMANDS, LIFTS, Lifts, channels, table
from forklift.recordings.recording import Recording

if TYPE_CHECKING:
    import polars as pl
    import xarray as xr

Solver = Literal["adaptive", "fixed"]

FORMATS = (".csv", ".parquet")
SETTINGS = ("solver", "tolerance", "substeps")

START_WITHIN_S = 1.0
"""How long after a recording's first sample [s] its position still tells where it started: as long as a
generated command leaves the truck at rest."""


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Sheeted, Celled, Plotted):
    """What `simulate` gives: outputs and states over time, in SI units, positive upward.

    ``simulation["velocity_free_m_s"]`` is one output, ``simulation["free.position"]`` one state, each
    (n,); `dataset` is all of it with units and meanings.
    """

    truck: Truck
    command: Command
    load_kg: float
    oil_temperature_degc: Floats
    """(m,) [°C], held like the command."""
    time_s: Floats
    """(n,) [s]."""
    outputs: Floats
    """(n, number of outputs), in the order of `forklift.plant.forklift.tables.outputs`."""
    states: Floats
    """(n, number of states), in the order of `state_names`."""
    state_names: tuple[str, ...]
    statistics: Mapping[str, Any]
    """How much work the solver did."""

    def __post_init__(self) -> None:
        for name in ("oil_temperature_degc", "time_s", "outputs", "states"):
            own = np.array(getattr(self, name))
            own.flags.writeable = False
            object.__setattr__(self, name, own)

    def __getitem__(self, name: str) -> Floats:
        if name in outputs():
            return self.outputs[:, list(outputs()).index(name)]
        if name in self.state_names:
            return self.states[:, self.state_names.index(name)]
        raise ForkliftError(
            "name-unknown",
            f"a simulation has no {name}; its outputs are {', '.join(outputs())}, "
            f"its states {', '.join(self.state_names)}",
            name=name,
        )

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Outputs, states and what drove them, over ``time_s``, with ``units`` and ``long_name``."""
        import xarray as xr

        variables: dict[str, tuple[str, Floats, dict[str, str]]] = {}
        for name, values in self._driving().items():
            variables[name] = ("time_s", values, _attributes(channels()[name]))
        for name, spec in outputs().items():
            variables[name] = ("time_s", self[name], _attributes(spec))
        for name in self.state_names:
            known = states().get(name.partition(".")[2])
            variables[name] = ("time_s", self[name], _attributes(known) if known else {})
        return xr.Dataset(
            variables,
            coords={"time_s": ("time_s", self.time_s, {"units": "s", "long_name": "time"})},
            attrs={
                "truck": self.truck.name,
                "truck_sha256": self.truck.sha256,
                "load_kg": self.load_kg,
                **{f"statistics_{name}": value for name, value in self.statistics.items()},
            },
        )

    def to_polars(self, *, with_states: bool = False) -> pl.DataFrame:
        """Time, what drove the truck and all outputs, a column each; with `with_states` the states too.

        What belongs to a lift that was not simulated is null.
        """
        import polars as pl

        columns = {"time_s": self.time_s, **self._driving()} | {name: self[name] for name in outputs()}
        if with_states:
            columns |= {name: self[name] for name in self.state_names}
        return pl.DataFrame(columns).fill_nan(None)

    def write(self, path: str | Path, *, with_states: bool = False) -> Path:
        """Write `to_polars` as ``.csv`` or ``.parquet``; whole or not at all.

        Raises
        ------
        ForkliftError
            ``"format-unknown"`` for another suffix, ``"not-writable"``.
        """
        output.check_suffix(path, FORMATS)
        return output.write_table(path, self.to_polars(with_states=with_states))

    def to_dict(self) -> dict[str, Any]:
        """Conditions, statistics and for each output its last, least and greatest value, for JSON."""
        return {
            "truck": {
                "name": self.truck.name,
                "sha256": self.truck.sha256,
                "effects": list(self.truck.effects),
            },
            "load_kg": self.load_kg,
            "oil_temperature_degc": float(np.mean(self.oil_temperature_degc)),
            "samples": len(self.time_s),
            "time_s": [float(self.time_s[0]), float(self.time_s[-1])],
            "statistics": dict(self.statistics),
            "outputs": {
                name: {
                    "unit": spec["unit"],
                    "last": defined(float(self[name][-1])),
                    "least": defined(float(self[name].min())),
                    "greatest": defined(float(self[name].max())),
                }
                for name, spec in outputs().items()
            },
        }

    def listing(self) -> Listing:
        """Each output's first, last, least and greatest value."""
        return Listing(
            f"{self.truck.name}: {self.load_kg:g} kg, {self.oil_temperature_degc.mean():.1f} °C",
            ["output", "unit", ">first", ">last", ">least", ">greatest"],
            [
                (
                    name,
                    spec["unit"],
                    *(f"{value:.5g}" for value in (found[0], found[-1], found.min(), found.max())),
                )
                for name, spec in outputs().items()
                for found in [self[name]]
                if np.isfinite(found).any()
            ],
        )

    def sheet(self) -> Sheet:
        """Command, velocity, pressure and position of each lift that was simulated."""
        lifts = [lift for lift in LIFTS if np.isfinite(self[f"position_{lift}_m"]).any()]
        degc, seconds = self.oil_temperature_degc.mean(), self.time_s[-1] - self.time_s[0]
        return Sheet(
            f"{self.truck.name} lowering {self.load_kg:g} kg",
            f"Simulation of truck {self.truck.name}: {self.load_kg:g} kg on the forks, oil at {degc:.0f} °C, "
            f"{seconds:.1f} s",
            [self._lowering(lift) for lift in lifts],
            [
                Curves(
                    f"{lift.capitalize()} lift",
                    self.time_s,
                    [
                        Curve("Velocity", "m/s", self[f"velocity_{lift}_m_s"]),
                        Curve("Pressure", "bar", 1e-5 * self[f"pressure_{lift}_pa"]),
                        Curve("Position", "m", self[f"position_{lift}_m"]),
                        Curve("Current", "A", self._driving()[f"current_{lift}_a"]),
                    ],
                )
                for lift in lifts
            ],
            [(f"Truck {self.truck.name}", self.truck.sha256)],
            [(name.replace("_", " "), str(value)) for name, value in self.statistics.items()],
        )

    def _lowering(self, lift: str) -> str:
        """What one lift does, in a sentence."""
        position, velocity = self[f"position_{lift}_m"], self[f"velocity_{lift}_m_s"]
        pressure = self[f"pressure_{lift}_pa"]
        return (
            f"{lift.capitalize()} lift: from {position[0]:.2f} to {position[-1]:.2f} m, lowering at up to "
            f"{max(-velocity.min(), 0.0):.2f} m/s, with {amount(float(pressure.min()), 'Pa')} to "
            f"{amount(float(pressure.max()), 'Pa')} in its cylinder."
        )

    def heading(self) -> str:
        """Truck, load and oil temperature."""
        degc = float(np.mean(self.oil_temperature_degc))
        return f"Truck “{self.truck.name}” lowering {self.load_kg:g} kg, oil at {degc:.1f} °C"

    def lines(self) -> list[Line]:
        """Of each lift that was simulated its velocity, pressure, position and current."""
        found = []
        for lift in LIFTS:
            if not np.isfinite(self[f"position_{lift}_m"]).any():
                continue
            for name in (f"velocity_{lift}_m_s", f"pressure_{lift}_pa", f"position_{lift}_m"):
                found.append(Line(name, outputs()[name]["unit"], self.time_s, self[name], "simulated"))
            current = f"current_{lift}_a"
            found.append(Line(current, "A", self.time_s, self._driving()[current], "command"))
        return found

    def cell(self) -> Cell:
        """What was simulated, and each output as `listing` has it."""
        table, span = self.listing(), f"{self.time_s[0]:g} to {self.time_s[-1]:g} s"
        return Cell(
            [f"{self.heading()}, {len(self.time_s)} samples from {span}."],
            [head.removeprefix(">").capitalize() for head in table.heads],
            table.rows,
        )

    def __repr__(self) -> str:
        return (
            f"Simulation({self.truck.name!r}, {self.load_kg:g} kg, "
            f"{np.mean(self.oil_temperature_degc):.1f} degC, {len(self.time_s)} samples from "
            f"{self.time_s[0]:g} to {self.time_s[-1]:g} s, {len(self.state_names)} states)"
        )

    def _driving(self) -> dict[str, Floats]:
        """Currents and oil temperature at the simulation's times."""
        held = np.searchsorted(self.command.time_s, self.time_s, side="right") - 1
        return {
            **{name: getattr(self.command, name)[held] for name in COMMANDS},
            "oil_temperature_degc": self.oil_temperature_degc[held],
        }


def simulate(
    truck: Truck | str | Path,
    command: Command,
    *,
    load_kg: float,
    oil_temperature_degc: float | ArrayLike,
    lifts: Lifts = "both",
    time: ArrayLike | None = None,
    solver: Solver | None = None,
    tolerance: float | None = None,
    substeps: int | None = None,
    start: ArrayLike | None = None,
) -> Simulation:
    """Solve the truck's equations under a command, from rest.

    Parameters
    ----------
    truck, command
        Whose equations (a `Truck`, its name or its file), and the currents of both valves, held between
        their samples.
    load_kg
        Mass on the forks [kg], on top of the truck's own moving mass.
    oil_temperature_degc
        Tank oil temperature [°C]: a number, or one per sample of the command, held likewise.
    lifts
        ``"both"``, or ``"free"`` or ``"main"`` for one lift alone, the other standing still.
    time
        (n,) [s], strictly increasing, where the result is wanted; by default at the command's samples.
    solver, tolerance, substeps
        ``"adaptive"`` (implicit, to `tolerance`) or ``"fixed"`` (`substeps` a sample); the core's defaults.
        A setting of the other solver is refused.
    start
        The initial state in the order of `Simulation.state_names`; by default at rest, p_A in equilibrium
        with the load, where the thesis's recordings start.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``, ``"argument-shape"``, ``"effect-needs-both-lifts"``, or, if the run itself
        fails, ``"step-too-small"``, ``"too-many-steps"`` or ``"not-finite"`` with time and worst state.
    """
    given: dict[str, Any] = {
        "solver": solver,
        "tolerance": tolerance,
        "substeps": substeps,
        "start": None if start is None else _column("start", start),
    }
    truck = truck_of(truck)
    arguments.of_kind(Command, command=command)
    _check_solver(solver, tolerance, substeps)
    at = sampled_at(time, command)
    temperature = np.asarray(_column("oil_temperature_degc", oil_temperature_degc))
    if temperature.ndim == 0:
        temperature = np.full(len(command.time_s), float(temperature))
    load = arguments.number("load_kg", load_kg)
    settings = {name: value for name, value in given.items() if value is not None}
    try:
        found = truck.core.simulate(
            at, command.time_s, command.currents, temperature, load, lifts=lifts, **settings
        )
    except (TypeError, OverflowError) as error:
        raise ForkliftError(
            "argument-invalid", f"an argument of simulate is of the wrong kind, shape or size: {error}"
        ) from None
    return Simulation(
        truck,
        command,
        load,
        temperature,
        at,
        found["outputs"],
        found["states"],
        tuple(found["state_names"]),
        found["statistics"],
    )


def sampled_at(time: ArrayLike | None, command: Command) -> Floats:
    """Times that were asked for, or the command's own.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` if there are none.
    """
    at = command.time_s if time is None else _column("time", time)
    if not np.size(at):
        raise ForkliftError("argument-invalid", "time is empty; give one time or more", name="time")
    return at


def predict(
    truck: Truck | str | Path,
    recording: Recording,
    *,
    oil_temperature_degc: float | None = None,
    **settings: Any,
) -> Simulation:
    """Replay a recording's commands free-running, at its own times: no state is corrected by measurements.

    Both lifts are simulated, whichever was commanded: the one at rest bounces on its oil. The oil
    temperature is the mean of the recording's; missing samples are left out.

    Parameters
    ----------
    oil_temperature_degc
        For a recording without that channel [°C].
    settings
        `simulate`'s ``solver``, ``tolerance`` and ``substeps``.

    Raises
    ------
    ForkliftError
        ``"temperature-missing"`` if there is neither channel nor argument, ``"value-out-of-bounds"`` if the
        recording starts beyond the truck's stroke, and those of `simulate`.
    """
    truck = truck_of(truck)
    arguments.of_kind(Recording, recording=recording)
    _check_settings(settings)
    clock, currents = recording.commanded
    command = Command(clock, *currents.T)
    temperature = mean_temperature(recording, oil_temperature_degc)
    conditions = {"load_kg": recording.load_kg, "oil_temperature_degc": temperature, **settings}
    try:
        at_rest = simulate(truck, command, time=command.time_s[:1], **conditions)
        start = _recorded_start(recording, at_rest)
        return simulate(truck, command, time=recording.time_s, start=start, **conditions)
    except ForkliftError as error:
        sentence = f"{recording.file}: {error.message[:1].lower()}{error.message[1:]}"
        raise ForkliftError(error.code, sentence, **error.facts | {"file": recording.file}) from None


def check_temperature(oil_temperature_degc: float | None) -> None:
    """A temperature that is given is one that a recording might have, be it needed or not.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``.
    """
    possible = table()["oil_temperature_degc"]
    lower, upper = possible.lower, possible.upper
    if oil_temperature_degc is None:
        return
    if not lower <= arguments.number("oil_temperature_degc", oil_temperature_degc) <= upper:
        raise ForkliftError(
            "argument-invalid",
            f"the oil temperature is {oil_temperature_degc:g} °C, where {lower:g} to {upper:g} °C is "
            "possible; give it in °C",
            name="oil_temperature_degc",
            value=oil_temperature_degc,
            lower=lower,
            upper=upper,
            unit="degC",
        )


def has_temperature(recording: Recording) -> bool:
    """Whether the oil's temperature was recorded."""
    measured = recording.channels.get("oil_temperature_degc")
    return measured is not None and bool(np.isfinite(measured).any())


def mean_temperature(recording: Recording, otherwise: float | None = None) -> float:
    """The recording's mean oil temperature [°C], or `otherwise` if it has none."""
    if has_temperature(recording):
        return float(np.nanmean(recording.channels["oil_temperature_degc"]))
    if otherwise is not None:
        return otherwise
    raise ForkliftError(
        "temperature-missing",
        f"{recording.file} has no oil temperature; record oil_temperature_degc or give the temperature",
        file=recording.file,
        channel="oil_temperature_degc",
    )


def first_temperature(recording: Recording, otherwise: float | None = None) -> float:
    """The oil temperature [°C] as read in the first second; where nothing was read then, `mean_temperature`.

    After a standstill a sensor reads what the oil has, however slow it is; from then on it lags.
    """
    if has_temperature(recording):
        early = recording.time_s <= recording.time_s[0] + START_WITHIN_S
        read = recording.channels["oil_temperature_degc"][early]
        if np.isfinite(read).any():
            return float(np.nanmean(read))
    return mean_temperature(recording, otherwise)


def _recorded_start(recording: Recording, at_rest: Simulation) -> Floats | None:
    """The core's initial state, moved to the recorded positions if these lie more than two counts off it.

    The encoder rounds down, so that half a count is added to what it reads. Where the first sample is
    missing, the first of the first second counts; later ones do not tell where the recording started.
    """
    count = _core.ENCODER_COUNT_M
    start = at_rest.states[0].copy()
    moved = False
    for lift in LIFTS:
        recorded = recording.channels.get(f"position_{lift}_m")
        usual = at_rest[f"position_{lift}_m"][0]
        if recorded is None:
            continue
        early = recorded[recording.time_s <= recording.time_s[0] + START_WITHIN_S]
        known = early[np.isfinite(early)]
        if len(known) and abs(known[0] - usual) > 2 * count:
            state = at_rest.state_names.index(f"{lift}.position")
            ratio = usual / start[state]  # what the sensor reads is a multiple of the state
            start[state] = _within_stroke(at_rest.truck, lift, float(known[0]), ratio)
            moved = True
    return start if moved else None


def _within_stroke(truck: Truck, lift: str, recorded: float, ratio: float) -> float:
    """The cylinder's position [m] that the encoder tells, up to one count beyond the stroke's end."""
    count = _core.ENCODER_COUNT_M
    ends = [float(truck.values[f"{lift}.cylinder.stroke_{end}"]) for end in ("lower", "upper")]  # type: ignore[arg-type]
    lower, upper = (end * ratio for end in ends)
    if not lower - count <= recorded <= upper + count:
        raise ForkliftError(
            "value-out-of-bounds",
            f"position_{lift}_m starts at {recorded:.4g} m, where the stroke of truck {truck.name!r} allows "
            f"{lower:.4g} to {upper:.4g} m; correct the channel's zero or scale, or the truck's "
            f"{lift}.cylinder.stroke_lower and stroke_upper",
            channel=f"position_{lift}_m",
            value=recorded,
            lower=lower,
            upper=upper,
            unit="m",
        )
    return min(max((recorded + count / 2) / ratio, ends[0]), ends[1])


def _check_settings(settings: Mapping[str, Any]) -> None:
    """What a recording tells is not told anew."""
    for name in settings:
        if name not in SETTINGS:
            raise ForkliftError(
                "argument-invalid",
                f"a recording is replayed without {name}; its settings are {', '.join(SETTINGS)}",
                name=name,
            )


def _check_solver(solver: str | None, tolerance: float | None, substeps: int | None) -> None:
    """No setting is given that belongs to the other solver."""
    fixed = solver == "fixed"
    for name, value, other in (("tolerance", tolerance, fixed), ("substeps", substeps, not fixed)):
        if other and value is not None:
            needed, used = ("adaptive", "fixed") if fixed else ("fixed", "adaptive")
            raise ForkliftError(
                "argument-invalid",
                f"{name} belongs to the {needed} solver, but the {used} one is used; leave it out or take "
                f"the {needed} solver",
                name=name,
                value=value,
            )


def _attributes(spec: Mapping[str, Any]) -> dict[str, str]:
    return {"units": spec["unit"], "long_name": spec["meaning"]}


def _column(name: str, values: Any) -> Floats:
    try:
        return np.ascontiguousarray(values, np.float64) if np.ndim(values) else np.float64(values)  # type: ignore[return-value]
    except (TypeError, ValueError):
        raise ForkliftError(
            "argument-invalid",
            f"argument {name} is {values!r}; it must be a number or an array of numbers",
            name=name,
        ) from None

"""The forklift behind the machine protocol: the core's runs with their exact derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift import _core
from forklift.base.arrays import Floats
from forklift.plant.forklift import free_curve
from forklift.plant.forklift.absent import without_absent
from forklift.plant.forklift.clocks import Clocks, late, shifts
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.dither import DITHER, USUAL_TICK_S, along_dither, dithered, without_dither
from forklift.plant.forklift.ports import equation, lift_of, ports
from forklift.plant.forklift.sensors import MEASURED
from forklift.plant.forklift.simulate import (
    START_WITHIN_S,
    first_temperature,
    has_temperature,
    mean_temperature,
    simulate,
)
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.truck import Truck
from forklift.plant.forklift.unknowns import grouped, rising
from forklift.plant.forklift.unnamed import answer, curves, ringing
from forklift.plant.forklift.variables import PAST, variables
from forklift.plant.parameter import Unknown
from forklift.plant.protocol import Case, Hypothesis, Place, Run, Steps
from forklift.plant.sensor_faults import SPREAD
from forklift.recordings.channels import LIFTS, Lift, table
from forklift.recordings.clocks import driving

if TYPE_CHECKING:
    from forklift.plant.forklift.simulate import Simulation
    from forklift.recordings.noise import Sensor
    from forklift.recordings.recording import Recording

OWN = ("load", "oil_temperature", "oil_warming", "free.start", "main.start")
"""The conditions of a recording, in the core's order and by its names: load [kg], offset of the oil
temperature at the start and how much it rises from there to the end [K], cylinder positions at the start
[m]."""

TEMPERATURE_WIDTH_K = 0.15
"""Standard deviation of the oil temperature at a recording's start: a sensor that reads in steps of 0.5 K.
Known to 0.5 K only, oil of another law in the cold would be taken for oil that is four kelvin warmer."""

ENTERED_TEMPERATURE_WIDTH_K = 1.0
"""The same where it was not recorded but entered: one number for recordings between which the oil warms up,
by as much as in each of them (`WARMING_WIDTH_K`)."""

LOAD_ACCURACY = 0.01
"""Standard deviation of a load that was weighed and entered, as a share of it: scales of trucks and of
workshops are good to about one per cent. A load moves the pressure at rest by as much as its own share, many
times what the mean over a recording is uncertain by, so that it must not be taken as exact."""

WARMING_WIDTH_K = 1.0
"""Standard deviation of how much the oil warms up during a recording: lowering heats it, and a sensor in the
tank lags by more than a recording lasts."""

START_WIDTH_M = 3e-4
"""Standard deviation of a cylinder's position at the start where no encoder tells it better."""

SLOPES_AT = 4
"""Substeps of a tick with which slopes are good to half a per cent as a rule, and to five nearly always
(`tests/test_slopes.py`): a step of a search, or the width of an interval, asks for no more. Values do."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """A recording as the core runs it.

    Attributes
    ----------
    time_s
        Of the outputs.
    clock, command, temperature
        What drives the lifts on a clock of its own [s], (ticks, lifts) [A], (ticks,) [°C].
    tick_s
        Step of that clock [s].
    """

    time_s: Floats
    clock: Floats
    command: Floats
    temperature: Floats
    tick_s: float

    def case(self, dither_a: float, *, along: bool = False) -> _core.Case:
        """With a dither of this amplitude, see `forklift.plant.forklift.dither`; `along`: and its slope."""
        command = dithered(self.command, dither_a, self.tick_s)
        slope = along_dither(self.command, dither_a, self.tick_s) if along else None
        return _core.Case(self.time_s, self.clock, command, self.temperature, slope)

    def substeps(self, usual: int) -> int:
        """Substeps of a tick, where the usual tick has so many: as long ones, whatever the command's rate."""
        return max(1, round(usual * self.tick_s / USUAL_TICK_S))


def _differentiated(
    core: _core.Truck,
    cases: Sequence[Case],
    conditions: Sequence[Floats],
    substeps: int,
    *,
    dither_a: float,
    along: Sequence[str],
) -> list[Run]:
    """Every recording at once, on all cores, with exact slopes."""
    runs: list[Run] = [Run(np.empty(0), np.empty(0))] * len(cases)
    each = [case.prepared.substeps(substeps) for case in cases]
    for count in sorted(set(each)):
        some = [k for k, one in enumerate(each) if one == count]
        found = core.differentiate(
            [cases[k].prepared.case(dither_a, along=DITHER in along) for k in some],
            np.array([conditions[k] for k in some]),
            ["command" if name == DITHER else name for name in along],
            substeps=count,
        )
        for k, run in zip(some, found, strict=True):
            runs[k] = Run(*run)
    return runs


Asked = tuple[dict[str, float], tuple[Prepared, ...], Floats, int]


class Latest:
    """The last truck, and its run without slopes: where a search takes a step, it asks for the same again,
    with slopes, and so does whoever asks for the slopes along effects that are absent."""

    def __init__(self) -> None:
        self._last: tuple[Asked, list[Run]] | None = None
        self._core: tuple[dict[str, float], _core.Truck] | None = None

    def __reduce__(self) -> tuple[type[Latest], tuple[()]]:
        return Latest, ()  # another process begins anew

    def core(self, values: Mapping[str, float], make: Callable[[], Truck]) -> _core.Truck:
        """Of what `make` gives, or gave if the last values were the same."""
        last = self._core
        if last is None or last[0] != values:
            last = self._core = dict(values), make().core
        return last[1]

    def run(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        substeps: int,
        run: Callable[[], list[Run]],
    ) -> list[Run]:
        """What `run` gives, or gave if the last was the same. `values` are those of what is present."""
        asked = (dict(values), tuple(case.prepared for case in cases), np.array(conditions), substeps)
        last = self._last
        if last is not None and _same(last[0], asked):
            return list(last[1])
        runs = run()
        for one in runs:
            one.outputs.setflags(write=False)  # they are given out again
        self._last = asked, runs
        return list(runs)


def _same(one: Asked, other: Asked) -> bool:
    return (
        one[3] == other[3]
        and len(one[1]) == len(other[1])
        and all(a is b for a, b in zip(one[1], other[1], strict=True))
        and np.array_equal(one[2], other[2])
        and one[0] == other[0]
    )


@dataclass(frozen=True)
class Forklift:
    """A truck as a machine; its parameters are those of the truck, knots of tables numbered.

    Attributes
    ----------
    truck
        The values that it starts with.
    lifts
        Those that are fitted.
    oil_temperature_degc
        Of recordings without one [°C].
    load_width_kg
        Standard deviation of each recording's entered load [kg]; 0: the loads are right.
    load_accuracy
        The same as a share of the load; the wider counts.
    warming_width_k
        Standard deviation of how much the oil warms up during a recording [K].
    clocks
        By name the channels of each clock that is not the command's: in each recording it starts apart by an
        amount of its own, its last conditions.
    """

    truck: Truck
    lifts: tuple[Lift, ...] = LIFTS
    oil_temperature_degc: float | None = None
    load_width_kg: float = 0.0
    load_accuracy: float = 0.0
    warming_width_k: float = WARMING_WIDTH_K
    clocks: Clocks = ()
    latest: Latest = field(default_factory=Latest, init=False, repr=False, compare=False)

    @property
    def name(self) -> str:
        """The truck's."""
        return self.truck.name

    @property
    def outputs(self) -> Sequence[str]:
        """What a simulation gives, in the core's order."""
        return list(outputs())

    @property
    def ends(self) -> Mapping[str, tuple[float, float]]:
        """None is known."""
        return {}

    @property
    def condition_units(self) -> Mapping[str, str]:
        """Of `OWN`, and of clocks."""
        units = ("kg", "K", "K", "m", "m", *["s"] * len(self.clocks))
        return dict(zip((*OWN, *shifts(self.clocks)), units, strict=True))

    @property
    def lag_share(self) -> float:
        """None beyond the usual: a truck's noise is as slow as its sensors'."""
        return 0.0

    def pieces(self, recording: Recording) -> Sequence[Recording]:
        """Each recording is one run."""
        return (recording,)

    def measured(self, recording: Recording) -> Mapping[str, Floats]:
        """By channel."""
        return recording.channels

    def instants(self, recording: Recording) -> Mapping[str, NDArray[np.intp]]:
        """Of channels on clocks of their own."""
        return recording.rows

    def case(self, recording: Recording, sensors: Mapping[str, Sensor]) -> Case:
        """A recording with what is unknown about its conditions.

        The oil temperature is what was read in the recording's first second, the start what its first sample
        tells.
        """
        truck = self.truck
        clock, command = driving(*recording.commanded) if recording.rows else recording.commanded
        tick_s = float(np.median(np.diff(clock))) if len(clock) > 1 else USUAL_TICK_S
        temperature = np.full(len(clock), first_temperature(recording, self.oil_temperature_degc))
        at_rest = simulate(
            truck,
            Command(clock, *command.T),
            time=recording.time_s[:1],
            load_kg=recording.load_kg,
            oil_temperature_degc=float(temperature[0]),
        )
        starts = [_start(recording, lift, at_rest, sensors) for lift in LIFTS]
        load_width_kg = max(self.load_width_kg, self.load_accuracy * recording.load_kg)
        known_k = TEMPERATURE_WIDTH_K if has_temperature(recording) else ENTERED_TEMPERATURE_WIDTH_K
        widths = [load_width_kg, known_k, self.warming_width_k, *(start[1] for start in starts)]
        apart = [0.0 if recording.on_one_clock else SPREAD["shift"] for _ in self.clocks]
        return Case(
            recording,
            (*OWN, *shifts(self.clocks)),
            np.array([recording.load_kg, 0.0, 0.0, *(start[0] for start in starts), *[0.0] * len(apart)]),
            np.array([*widths, *apart]),
            *_ends(float(temperature[0]), len(apart)),
            Prepared(recording.time_s, clock, command, temperature, tick_s),
        )

    def at(self, values: Mapping[str, float], source: str = "fit") -> Truck:
        """The truck with these values; those that moved carry `source`. A dither is none of its own.

        Raises
        ------
        ForkliftError
            As `Truck`, if it is impossible.
        """
        return self.truck.with_values(grouped(self.truck, without_dither(values)), source=source)

    def check(self, values: Mapping[str, float]) -> None:
        """Whether the core takes such a truck; see `forklift.plant.protocol.Machine`."""
        self.at(values)

    def run(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        *,
        substeps: int,
        along: Sequence[str] = (),
        own: Sequence[int] = (),
        steps: Callable[[], Steps] | None = None,
    ) -> list[Run]:
        """Every recording at once, on all cores; see `forklift.plant.protocol.Machine`.

        Slopes are exact, of substeps twice as long where there are more than `SLOPES_AT`; `steps` are not
        asked for.
        """
        first = len(OWN)
        runs = self._run(
            values,
            cases,
            [one[:first] for one in conditions],
            substeps,
            along,
            [place for place in own if place < first],
        )
        if not self.clocks:
            return runs
        apart = [place - first for place in own if place >= first]
        return [
            Run(*late(case.recording.time_s, *run, self.clocks, here[first:], apart, self.outputs))
            for case, run, here in zip(cases, runs, conditions, strict=True)
        ]

    def _run(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        substeps: int,
        along: Sequence[str],
        own: Sequence[int],
    ) -> list[Run]:
        """The truck itself, on the commands' clock."""
        core, dither_a = self.latest.core(values, lambda: self.at(values)), values.get(DITHER, 0.0)
        wanted = [*along, *(OWN[place] for place in own)]
        run = partial(_differentiated, core, cases, conditions, dither_a=dither_a)
        coarser = min(substeps, max(SLOPES_AT, substeps // 2))
        if wanted and coarser == substeps:
            return run(substeps, along=wanted)
        present = without_absent(values, self.truck.values)
        fine = self.latest.run(present, cases, conditions, substeps, lambda: run(substeps, along=()))
        if not wanted:
            return fine
        slopes = run(coarser, along=wanted)
        return [Run(one.outputs, other.slopes) for one, other in zip(fine, slopes, strict=True)]

    def respond(
        self,
        values: Mapping[str, float],
        case: Case,
        conditions: Floats,
        ports: Sequence[str],
        centres: Floats,
        width_s: float,
        *,
        substeps: int,
    ) -> _core.Responses:
        """Exact, all ports in one run; see `forklift.plant.protocol.Machine`."""
        own: Prepared = case.prepared
        return self.latest.core(values, lambda: self.at(values)).hat_responses(
            own.case(values.get(DITHER, 0.0)),
            conditions[: len(OWN)],
            ports,
            centres,
            width_s,
            substeps=own.substeps(substeps),
        )

    @property
    def places(self) -> tuple[Place, ...]:
        """Every port of the lifts that are fitted; of one at rest forces and flows, as its valve is shut."""
        return tuple(
            Place(port, lift_of(port) or "", equation(port), *_sized(port)) for port in ports(self.lifts)
        )

    def part_of(self, name: str) -> str:
        """Its lift; of what belongs to no lift the main one's."""
        return lift_of(name) or "main"

    def hat_width_s(self, cases: Sequence[Case]) -> float:
        """A quarter of the period in which a lift rings, about 0.4 s (Fri & Fahlén 2017, section 4.5.2): what
        the oil does follows that, and hats half a period apart do not."""
        return 0.1

    def moments(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        part: str,
        *,
        substeps: int,
    ) -> list[dict[str, Floats]]:
        """The `variables` of every recording for what happens on one lift, `part`."""
        place = {name: k for k, name in enumerate(self.outputs)}
        runs = self.run(values, cases, conditions, substeps=substeps)
        return [
            variables(
                case.recording,
                {name: run.outputs[:, place[name]] for name in MEASURED if _has(case.recording, name)},
                _lift(part),
                mean_temperature(case.recording, self.oil_temperature_degc),
            )
            for case, run in zip(cases, runs, strict=True)
        ]

    @property
    def past(self) -> frozenset[str]:
        """What variables of operation were a while ago, and how far they have changed since."""
        return frozenset(PAST)

    def curves(self, place: Place, variable: str, lower: float, upper: float) -> tuple[Hypothesis, ...]:
        """Cubic B-splines over a variable of operation, at a port of a lift; over the stroke fine too."""
        port = place.name.partition(".")[2]
        return curves(self.truck, _lift(place.part), port, place.equation, variable, lower, upper)

    def acted_on(self, hypothesis: Hypothesis) -> tuple[str, ...]:
        """The ports of the equations that it changes, on its lift; of the whole truck, on every lift."""
        alike = [one for one in self.places if one.equation in hypothesis.equations]
        return tuple(one.name for one in alike if hypothesis.where in (one.part, ""))

    def unnamed(self, place: Place, cases: Sequence[Case]) -> tuple[Hypothesis, ...]:
        """Something that rings; where the valve's dynamics are in doubt, its answer as a curve."""
        lift = _lift(place.part)
        late = (answer(self.truck, lift, cases),) if place.equation == "valve-dynamics" else ()
        return (*ringing(self.truck, lift), *late)

    def ordered(self, values: Mapping[str, float], unknowns: Sequence[Unknown]) -> tuple[Floats, Floats]:
        """The knots of tables stay in order."""
        return rising(self.at(values) if values else self.truck, unknowns)


def _ends(degc: float, clocks: int) -> tuple[Floats, Floats]:
    """Between which a recording's own must lie, with oil of `degc` [°C] as it was read or entered: no load is
    below zero, and no oil colder or warmer than its channel can read. `clocks`: how many are its own."""
    least, most = np.full(len(OWN) + clocks, -np.inf), np.full(len(OWN) + clocks, np.inf)
    least[OWN.index("load")] = 0.0
    oil, place = table()["oil_temperature_degc"], OWN.index("oil_temperature")
    least[place], most[place] = oil.lower - degc, oil.upper - degc
    return least, most


def _start(
    recording: Recording, lift: Lift, at_rest: Simulation, sensors: Mapping[str, Sensor]
) -> tuple[float, float]:
    """Cylinder position at the start [m], and its standard deviation."""
    usual = float(at_rest[f"{lift}.position"][0])
    channel = f"position_{lift}_m"
    ratio = float(at_rest[channel][0]) / usual
    sensor = sensors.get(channel)
    values = recording.channels.get(channel)
    if sensor is None or values is None:
        return usual, START_WIDTH_M
    early = values[recording.time_s <= recording.time_s[0] + START_WITHIN_S]
    known = early[np.isfinite(early)]
    if not len(known):
        return usual, START_WIDTH_M
    ends = [
        float(at_rest.truck.values[f"{lift}.cylinder.stroke_{end}"])  # type: ignore[arg-type]
        for end in ("lower", "upper")
    ]
    told = (float(known[0]) + 0.5 * sensor.count) / ratio
    return min(max(told, ends[0]), ends[1]), sensor.noise / ratio


def _lift(part: str) -> Lift:
    """The lift of a part; of the whole truck the main one."""
    return "free" if part == "free" else "main"


def _has(recording: Recording, channel: str) -> bool:
    """Whether a channel was measured at all."""
    values = recording.channels.get(channel)
    return values is not None and bool(np.isfinite(values).any())


def _sized(port: str) -> tuple[str, float]:
    """Unit and usual size of an input at a port."""
    spec = free_curve.ports().get(port.partition(".")[2])
    return (spec["unit"], spec["typical"]) if spec else ("1", 1.0)

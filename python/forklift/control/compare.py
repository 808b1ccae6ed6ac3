"""Controllers side by side on the thesis's grid: Tables 5.6 and 5.7, oscillation, steady error, breaches,
transition.

Source: Fri & Fahlén (2017), section 5.6; Tables 5.6 and 5.7; Figures 5.10 to 5.18, Appendices B to D.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift.base import output, present
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.numbers import all_defined
from forklift.base.result_files import PAGE
from forklift.control import transition
from forklift.control.closed_loop import (
    DELAY_TICKS,
    LOADS_KG,
    SIGNALS,
    STEADY,
    TEMPERATURES_DEGC,
    TICK_S,
    TOP,
    Lowered,
    Lowering,
    lower,
    requests,
)
from forklift.control.controller import Controller, shipped
from forklift.control.metrics import (
    LIMIT_M_S,
    Breach,
    Plateau,
    breaches,
    delayed,
    nrmse_percent,
    plateaus,
)
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.channels import LIFTS, Lift

FILES = (PAGE, "compare.json", "compare.txt")

MEASURED = {
    ("free", 20, 0): ((71.29, 77.84), (70.15, 72.80)),
    ("free", 20, 800): ((72.91, 73.12), (67.83, 70.10)),
    ("free", 20, 1500): ((69.31, 72.42), (68.27, 68.87)),
    ("free", 60, 0): ((78.50, 78.69), (61.95, 73.10)),
    ("free", 60, 800): ((72.50, 75.35), (69.58, 70.46)),
    ("free", 60, 1500): ((67.04, 68.42), (58.27, 62.98)),
    ("main", 20, 0): ((64.69, 70.37), (34.17, 48.59)),
    ("main", 20, 800): ((57.37, 61.22), (39.10, 52.54)),
    ("main", 20, 1500): ((42.56, 54.03), (45.68, 55.15)),
    ("main", 60, 0): ((65.86, 69.57), (28.84, 34.03)),
    ("main", 60, 800): ((56.94, 58.98), (15.20, 31.81)),
    ("main", 60, 1500): ((47.25, 53.65), (32.37, 40.93)),
}
"""Tables 5.6 and 5.7: by lift, oil temperature [degC] and load [kg] the NRMSE [%] of the thesis's controller
and of the one in use, each over two reference signals, measured on the thesis's own truck."""


@dataclass(frozen=True)
class Row:
    """One controller at one operating point, over the reference signals: a row of Tables 5.6 and 5.7.

    Attributes
    ----------
    controller, lift, oil_temperature_degc, load_kg
        Which, and where.
    nrmse_percent
        (3.40) of each signal.
    perfect_percent
        What the reference itself has 160 ms late: the nominal delay, and no bound.
    oscillation_m_s
        The worst of all plateaus.
    error_percent
        Of the steady speed, where the integral part has had six seconds and more.
    fastest_m_s
        The greatest mean speed of a plateau, that at the highest speed included.
    breaches
        Plateaus above the limit of section 1.1.
    """

    controller: str
    lift: Lift
    oil_temperature_degc: float
    load_kg: float
    nrmse_percent: tuple[float, ...]
    perfect_percent: tuple[float, ...]
    oscillation_m_s: float
    error_percent: float
    fastest_m_s: float
    breaches: tuple[Breach, ...]


def compare_controllers(
    controllers: Sequence[Controller],
    truck: Truck | str | Path,
    *,
    lifts: Sequence[Lift] = LIFTS,
    loads_kg: Sequence[float] = LOADS_KG,
    oil_temperatures_degc: Sequence[float] = TEMPERATURES_DEGC,
    later_ticks: int = 0,
    seed: int = 0,
    floating: bool = False,
) -> list[Row]:
    """Each controller on every lift, temperature and load, over both reference signals.

    The lifts are lowered one at a time, each with the whole reference, as the thesis measured them.

    Parameters
    ----------
    truck
        Which they lower; a name or a path will do.
    lifts, loads_kg, oil_temperatures_degc
        Where: every combination is a row for each controller.
    later_ticks
        By how much the delay is longer than `DELAY_TICKS`.
    seed
        Of the sensors' noise.
    floating
        The controllers in floating point instead of their integers.

    Raises
    ------
    ForkliftError
        As `lower`.
    """
    rows, _ = _compared(
        controllers, truck_of(truck), lifts, loads_kg, oil_temperatures_degc, later_ticks, seed, floating
    )
    return rows


@dataclass(frozen=True, eq=False)
class Curves:
    """One lift under one reference signal, all controllers at one operating point.

    Attributes
    ----------
    speed_m_s, reference_m_s, pressure_pa, current_ma
        By controller, (ticks,).
    """

    lift: Lift
    signal: int
    oil_temperature_degc: float
    load_kg: float
    time_s: Floats
    speed_m_s: dict[str, Floats]
    reference_m_s: dict[str, Floats]
    pressure_pa: dict[str, Floats]
    current_ma: dict[str, NDArray[np.int32]]


@dataclass(frozen=True, eq=False)
class Passage:
    """One controller's transition between the lifts, tick by tick; speeds and references by lift."""

    controller: str
    level_m_s: float
    oil_temperature_degc: float
    load_kg: float
    time_s: Floats
    speed_m_s: dict[str, Floats]
    reference_m_s: dict[str, Floats]


@dataclass(frozen=True, eq=False)
class ControlComparison:
    """Controllers side by side, with what a page of them draws.

    Attributes
    ----------
    later_ticks
        By how much the delay is longer than `DELAY_TICKS`.
    seed
        Of the sensors' noise.
    rows
        Tables 5.6 and 5.7.
    curves
        Of each lift under each reference signal at one operating point.
    transitions, passages
        Dip and spike where one lift gives over to the other, and the lowerings that they are of.
    """

    truck: Truck
    controllers: tuple[Controller, ...]
    later_ticks: int
    seed: int
    rows: tuple[Row, ...]
    curves: tuple[Curves, ...]
    transitions: tuple[transition.Transition, ...]
    passages: tuple[Passage, ...]

    def __str__(self) -> str:
        return f"{table(self.rows, self.truck)}\n\n{transition.transition_table(self.transitions)}"

    @property
    def command(self) -> str | None:
        """What compares them once more; None of another seed, or of a truck or a controller whose file is not
        known."""
        names = [one.name for one in self.controllers]
        known = set(names) <= set(shipped()) and [*map(Controller.read, names)] == [*self.controllers]
        if self.seed or self.truck.origin == "Python" or not known:
            return None
        truck = self.truck.name if self.truck.origin == "shipped" else self.truck.origin
        later = ["--later", str(self.later_ticks)] if self.later_ticks else []
        words = ["forklift", "control", "compare", *names, "--truck", truck, *later, "--out", "compared"]
        return shlex.join(words)

    def to_dict(self) -> dict[str, Any]:
        """Every number of the tables, and what they were made from."""
        return {
            "truck": {"name": self.truck.name, "sha256": self.truck.sha256},
            "controllers": {one.name: one.hash for one in self.controllers},
            "later_ticks": self.later_ticks,
            "seed": self.seed,
            "rows": [all_defined(asdict(row)) for row in self.rows],
            "transitions": [all_defined(asdict(row)) for row in self.transitions],
        }

    def write(self, folder: str | Path) -> Path:
        """Write the page, the numbers as JSON and the tables as text into a folder; whole or not at all.

        Raises
        ------
        ForkliftError
            ``"not-writable"``, or ``"output-exists"`` for a folder that holds anything else.
        """
        texts = (
            present.page(self),
            json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n",
            f"{self}\n",
        )
        with output.folder(folder, FILES, FILES[0]) as new:
            for name, text in zip(FILES, texts, strict=True):
                (new / name).write_text(text, encoding="utf-8")
        return Path(folder)


def control_comparison(
    controllers: Sequence[Controller], truck: Truck | str | Path, *, later_ticks: int = 0, seed: int = 0
) -> ControlComparison:
    """The whole comparison: Tables 5.6 and 5.7, the transition, and their curves.

    Parameters
    ----------
    truck
        Which they lower; a name or a path will do.
    later_ticks
        By how much the delay is longer than `DELAY_TICKS`.
    seed
        Of the sensors' noise.

    Raises
    ------
    ForkliftError
        As `lower`.
    """
    truck = truck_of(truck)
    rows, curves = _compared(
        controllers, truck, LIFTS, LOADS_KG, TEMPERATURES_DEGC, later_ticks, seed, floating=False
    )
    found, passages = [], []
    for one, run, place, level in transition.crossings(
        controllers, truck, later_ticks=later_ticks, seed=seed
    ):
        found.append(transition.measured(one, run, place, level))
        first, last = transition.span(run, place, level)
        # Of one that never ends all is seen.
        start, end = max(0, first - round(1.0 / TICK_S)), last + round(2.0 / TICK_S)
        seen = slice(start, end) if last >= 0 else slice(None)
        passages.append(
            Passage(
                one.controller.name,
                1e-3 * level,
                one.oil_temperature_degc,
                one.load_kg,
                run.time_s[seen],
                {lift: run.speed_m_s[lift][place, seen] for lift in LIFTS},
                {lift: run.reference_m_s[lift][place, seen] for lift in LIFTS},
            )
        )
    return ControlComparison(
        truck,
        tuple(controllers),
        later_ticks,
        seed,
        tuple(rows),
        tuple(curves),
        tuple(found),
        tuple(passages),
    )


def _compared(
    controllers: Sequence[Controller],
    truck: Truck,
    lifts: Sequence[Lift],
    loads_kg: Sequence[float],
    oil_temperatures_degc: Sequence[float],
    later_ticks: int,
    seed: int,
    floating: bool,
) -> tuple[list[Row], list[Curves]]:
    points = [(t, load) for t in oil_temperatures_degc for load in loads_kg]
    names = [controller.name for controller in controllers]
    if repeated := next((name for name in names if names.count(name) > 1), None):
        raise ForkliftError(
            "argument-invalid",
            f"two controllers are called {repeated}, so that no table could tell them apart; give one of "
            "them another name, in the first line of its file",
            name="controllers",
            value=repeated,
        )
    if strange := [lift for lift in lifts if lift not in LIFTS]:
        raise ForkliftError(
            "argument-invalid",
            f"there is no lift {strange[0]!r}; give some of {', '.join(LIFTS)}",
            name="lifts",
            value=str(strange[0]),
            known=list(LIFTS),
        )
    if later_ticks < -min(DELAY_TICKS.values()):
        raise ForkliftError(
            "argument-invalid",
            f"the delay is to be {-later_ticks} ticks shorter, and one lift has {min(DELAY_TICKS.values())}; "
            f"give {-min(DELAY_TICKS.values())} or more",
            name="later_ticks",
            value=later_ticks,
        )
    rows, curves = [], []
    for lift in lifts:
        alone = [controller.only(lift) for controller in controllers]
        runs: dict[int, tuple[NDArray[np.int32], Lowered]] = {}
        for signal in (*SIGNALS, STEADY, TOP):
            request = requests(lift, signal)
            base = [
                Lowering(
                    truck, controller, load, t, request, delay_ticks=DELAY_TICKS[lift] + later_ticks, stream=k
                )
                for controller in alone
                for k, (t, load) in enumerate(points)
            ]
            runs[signal] = (request, lower(base, lifts=lift, seed=seed + signal, floating=floating))
        for k, name in enumerate(names):
            for j, (t, load) in enumerate(points):
                at = k * len(points) + j
                *measured, settled, top = [
                    _row(request, run.reference_m_s[lift][at], run.speed_m_s[lift][at])
                    for request, run in runs.values()
                ]
                every = [p for m in measured for p in m[2]]
                rows.append(
                    Row(
                        name,
                        lift,
                        t,
                        load,
                        tuple(m[0] for m in measured),
                        tuple(m[1] for m in measured),
                        max(p.oscillation_m_s for p in every),
                        settled[2][0].error_percent,
                        max(p.mean_m_s for p in [*every, *top[2]]),
                        tuple(b for m in [*measured, top] for b in breaches(m[2], TICK_S)),
                    )
                )
        for signal in SIGNALS:
            run = runs[signal][1]
            for j, (t, load) in enumerate(points):
                places = {name: k * len(points) + j for k, name in enumerate(names)}
                curves.append(
                    Curves(
                        lift,
                        signal,
                        t,
                        load,
                        run.time_s,
                        {name: run.speed_m_s[lift][at] for name, at in places.items()},
                        {name: run.reference_m_s[lift][at] for name, at in places.items()},
                        {name: run.pressure_pa[lift][at] for name, at in places.items()},
                        {name: run.current_ma[lift][at] for name, at in places.items()},
                    )
                )
    return rows, curves


def _row(request: NDArray[np.int32], reference: Floats, speed: Floats) -> tuple[float, float, list[Plateau]]:
    """Its NRMSE, that of a perfect answer, its plateaus."""
    return (
        nrmse_percent(reference, speed),
        nrmse_percent(reference, delayed(reference, TICK_S)),
        plateaus(request, speed, TICK_S),
    )


def measured_on(truck: Truck) -> Callable[[Row], tuple[float, float] | None]:
    """In each row's place the NRMSE [%] over two reference signals that the thesis measured; None where it
    did not, and of every other truck than its own."""
    own = truck.sha256 == Truck.read("thesis").sha256

    def measured(row: Row) -> tuple[float, float] | None:
        known = MEASURED.get((row.lift, round(row.oil_temperature_degc), round(row.load_kg))) if own else None
        place = {"thesis": 0, "today": 1}.get(row.controller)
        return known[place] if known and place is not None else None

    return measured


def table(rows: Sequence[Row], truck: Truck) -> str:
    """The rows as Tables 5.6 and 5.7 lay them out; of the thesis's truck its own figures beside them."""
    wide, measured = max(12, 2 + max((len(row.controller) for row in rows), default=0)), measured_on(truck)
    head = (
        f"{'lift':<5}{'degC':>5}{'kg':>6}  {'controller':<{wide}}{'NRMSE [%]':>13}{'160ms late':>13}"
        f"{'swing [m/s]':>12}{'error [%]':>10}  thesis measured [%]"
    )
    lines = [head]
    for row in sorted(rows, key=lambda r: (r.lift, r.oil_temperature_degc, r.load_kg)):
        known = measured(row)
        printed = "{:.0f} - {:.0f}".format(*known) if known else ""
        lines.append(
            f"{row.lift:<5}{row.oil_temperature_degc:>5.0f}{row.load_kg:>6.0f}  {row.controller:<{wide}}"
            f"{min(row.nrmse_percent):>6.1f} -{max(row.nrmse_percent):>5.1f}"
            f"{min(row.perfect_percent):>6.1f} -{max(row.perfect_percent):>5.1f}"
            f"{row.oscillation_m_s:>12.4f}{row.error_percent:>10.2f}  {printed}"
            + ("  above 0.6 m/s" if row.breaches else "")
        )
    return "\n".join(lines)


def summary(request: NDArray[np.int32], run: Lowered, lift: Lift) -> str:
    """One lowering in sentences: NRMSE, plateaus, breaches of the limit."""
    reference, speed = run.reference_m_s[lift][0], run.speed_m_s[lift][0]
    nrmse, late, found = _row(request, reference, speed)
    lines = [f"NRMSE {nrmse:.1f} %; the reference itself 160 ms late has {late:.1f} %"]
    lines += [
        f"plateau of {p.wanted_m_s:.2f} m/s: mean {p.mean_m_s:.4f} m/s ({p.error_percent:+.2f} %), "
        f"swing {p.oscillation_m_s:.4f} m/s"
        for p in found
    ]
    lines += [
        f"above {LIMIT_M_S} m/s from {b.time_s:.2f} s on: {b.speed_m_s:.4f} m/s"
        for b in breaches(found, TICK_S)
    ]
    return "\n".join(lines)

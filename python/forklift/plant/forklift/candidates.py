"""Recordings that could be made of a forklift: commands, loads and oil temperatures within its limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from forklift import _core
from forklift.base.arrays import Floats
from forklift.plant.forklift.commands import (
    CUTOFF_HZ,
    REST_S,
    SAMPLE_RATE_HZ,
    WORKING_RANGE,
    Command,
    Steps,
    generate,
    low_pass,
    prms,
    quantise_current,
    steps_to_current,
)
from forklift.plant.forklift.simulate import mean_temperature, simulate
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.truck import Truck
from forklift.plant.protocol import Case
from forklift.plant.subject import Drive, Possible
from forklift.recordings.channels import LIFTS, Lift, Lifts, commanded
from forklift.recordings.recording import Recording

LOADS_KG = (0.0, 1500.0)
"""Least and greatest load: up to the heaviest of the thesis's truck. What was recorded counts too."""
TEMPERATURES_DEGC = (10.0, 65.0)
"""Least and greatest oil temperature that a truck is brought to without harm: chosen."""
LEVELS = 3
"""Loads and temperatures tried, evenly spaced between the limits."""
DURATION_S = 12.0
SEED = 101
"""Of the pseudo-random commands: none that a campaign is likely to hold."""
MARGIN_M = 0.06
"""A command shuts the valve where the cylinder comes this near to the end of its stroke."""
SUBSTEPS = 4
"""Of the simulations that tell where that is."""
SETTLING_S = 2.0
"""How long a command goes on after that."""


@dataclass(frozen=True)
class Limits:
    """Between which loads and oil temperatures recordings can be made."""

    load_kg: tuple[float, float]
    oil_temperature_degc: tuple[float, float]


@dataclass(frozen=True, eq=False)
class NextRecording:
    """What to record next."""

    lift: Lifts
    load_kg: float
    oil_temperature_degc: float
    command: Command
    why: str

    def write(self, path: str | Path) -> Path:
        """Write the command as the CSV file that ``forklift simulate --command`` takes."""
        return self.command.write(path)

    @property
    def title(self) -> str:
        """Lift, load and oil temperature."""
        return f"{_lifts(self.lift)}, {self.load_kg:g} kg, oil at {self.oil_temperature_degc:.0f} °C"

    @property
    def settings(self) -> Sequence[tuple[str, str]]:
        """The same as a table has it."""
        return (
            ("Lift to command", _lifts(self.lift)),
            ("Load on the forks", f"{self.load_kg:g} kg"),
            ("Oil temperature", f"{self.oil_temperature_degc:.1f} °C"),
        )

    @property
    def drives(self) -> tuple[Floats, Sequence[Drive]]:
        """The commands of the lifts that move [A]."""
        currents = zip(LIFTS, self.command.currents.T, strict=True)
        return self.command.time_s, [
            Drive(f"{lift} lift", "A", values, held=True) for lift, values in currents if np.any(values)
        ]

    def to_dict(self, command: str) -> dict[str, Any]:
        """As ``diagnosis.json`` has it; `command` is the name of the command's file."""
        return {
            "why": self.why,
            "lift": self.lift,
            "load_kg": self.load_kg,
            "oil_temperature_degc": self.oil_temperature_degc,
            "command": command,
        }


def limits(recordings: Sequence[Recording]) -> Limits:
    """The usual limits, or as far as recordings have gone beyond them: what was done can be done."""
    loads = [*LOADS_KG, *(found.load_kg for found in recordings)]
    temperatures = [*TEMPERATURES_DEGC]
    for found in recordings:
        measured = found.channels.get("oil_temperature_degc")
        if measured is not None and np.isfinite(measured).any():
            temperatures.append(float(np.round(np.nanmean(measured))))
    return Limits((min(loads), max(loads)), (min(temperatures), max(temperatures)))


def candidates(
    recordings: Sequence[Recording],
    trucks: Sequence[Truck],
    case: Callable[[Recording], Case],
) -> tuple[Possible, ...]:
    """Every command with every load and temperature, of the lifts that these recordings command, and of both.

    Parameters
    ----------
    recordings
        Of the campaign so far: a new recording has the lifts that can be commanded.
    case
        How the machine runs a recording of which nothing was measured.
    trucks
        As each of the explanations has it: where a command would take one to the end of a stroke, with any
        load and temperature, the valve is shut before.
    """
    within = limits(recordings)
    loads = np.linspace(*within.load_kg, LEVELS)
    temperatures = np.linspace(*within.oil_temperature_degc, LEVELS)
    single = {which for found in recordings for which in commanded(found.lift)}
    lifts: list[Lifts] = [lift for lift in LIFTS if lift in single]
    found = []
    for lift in [*lifts, "both"] if len(lifts) > 1 else lifts:
        for name, command in commands(lift):
            command = before_the_end(command, lift, trucks, loads, temperatures)
            for load in loads:
                for temperature in temperatures:
                    found.append(_possible(name, lift, command, float(load), float(temperature), case))
    return tuple(found)


def commands(lift: Lifts) -> Iterator[tuple[str, Command]]:
    """Test signals of different kinds, each with its name: what one shows, another may not."""
    low, high = WORKING_RANGE
    yield "staircase", generate("staircase", lift, duration_s=DURATION_S)
    n = round((DURATION_S - REST_S) * SAMPLE_RATE_HZ)
    for name, settings in (
        ("pseudo-random steps", {}),
        ("pseudo-random small openings", {"high": low + (high - low) // 3}),
        ("fast pseudo-random steps", {"switching_probability": 0.2}),
    ):
        steps = {which: prms(n, SEED + LIFTS.index(which), **settings) for which in LIFTS}
        yield name, _command(lift, steps)
    pulses = np.concatenate([_held(level, 0.4, 3.0) for level in np.linspace(low, high, 6).astype(int)])
    yield "short pulses with rests of 3 s", _command(lift, dict.fromkeys(LIFTS, pulses))
    hold = np.concatenate([_held(high, 0.4, 20.0), _held(low, 0.4, 2.0)])
    yield "one short pulse and a rest of 20 s", _command(lift, dict.fromkeys(LIFTS, hold))
    stops = np.concatenate([_held(255, 0.5, 1.5)] * 4)
    yield "full openings and hard stops", _command(lift, dict.fromkeys(LIFTS, stops))
    if lift == "both":
        first, then = _held(high, 2.0, 4.0), np.r_[_held(0, 2.0, 0.0), _held(high, 2.0, 2.0)]
        yield "one lift after the other", _command(lift, {"free": first, "main": then})


def before_the_end(
    command: Command, lift: Lifts, trucks: Sequence[Truck], loads_kg: Floats, temperatures_degc: Floats
) -> Command:
    """The command, with the valves shut from where any truck's lift comes near the end of its stroke."""
    near = np.zeros(len(command.time_s), bool)
    cases = [
        _core.Case(command.time_s, command.time_s, command.currents, np.full(len(near), temperature))
        for temperature in temperatures_degc
        for _ in loads_kg
    ]
    for truck in trucks:
        rest = simulate(truck, command, time=command.time_s[:1], load_kg=0.0, oil_temperature_degc=20.0)
        starts = [float(rest[f"{which}.position"][0]) for which in LIFTS]
        own = np.array([[load, 0.0, 0.0, *starts] for _ in temperatures_degc for load in loads_kg])
        runs = truck.core.differentiate(cases, own, [], substeps=SUBSTEPS)
        for which in commanded(lift):
            column = list(outputs()).index(f"position_{which}_m")
            per_cylinder = float(rest[f"position_{which}_m"][0]) / starts[LIFTS.index(which)]
            lowest = float(truck.values[f"{which}.cylinder.stroke_lower"]) + MARGIN_M  # type: ignore[arg-type]
            for values, _ in runs:
                near |= values[:, column] / per_cylinder < lowest
    if not near.any():
        return command
    end = int(np.argmax(near))
    rate = (len(near) - 1) / (command.time_s[-1] - command.time_s[0])
    kept = min(len(near), end + round(SETTLING_S * rate))
    shut = np.arange(kept) >= end
    currents = [
        np.where(shut, 0.0, current[:kept]) for current in (command.current_free_a, command.current_main_a)
    ]
    return Command(command.time_s[:kept], *currents)


def elsewhere(recordings: Sequence[Recording], what: str, lift: Lift) -> NextRecording | None:
    """The richest recording of a lift once more, with another load or another oil temperature.

    For what all recordings that are fitted have in common, so that no effect of it can be told: `what` is
    ``"load_kg"`` or ``"oil_temperature_degc"``. None if none of these commands the lift.
    """
    told = [found for found in recordings if lift in commanded(found.lift) and found.role == "estimate"]
    if not told:
        return None
    within = limits(recordings)
    rich = max(told, key=lambda found: float(np.abs(np.diff(found[f"current_{lift}_a"])).sum()))
    temperature = mean_temperature(rich, float(np.mean(TEMPERATURES_DEGC)))
    now = rich.load_kg if what == "load_kg" else temperature
    least, greatest = within.load_kg if what == "load_kg" else within.oil_temperature_degc
    new = least if now - least > greatest - now else greatest
    load, temperature = (new, temperature) if what == "load_kg" else (rich.load_kg, new)
    words, unit = ("load", "kg") if what == "load_kg" else ("oil temperature", "degC")
    why = (
        f"all {len(told)} fitted recordings of the {lift} lift have about the same {words}, {now:.3g} {unit}"
        f", so that no effect of it can be told: record {rich.file} once more at {new:.3g} {unit}"
    )
    return NextRecording(rich.lift, load, temperature, Command(rich.time_s, *rich.command.T), why)


def wanted(recording: Recording, why: str) -> NextRecording:
    """A recording that could be made, as one to be made."""
    return NextRecording(
        recording.lift,
        recording.load_kg,
        mean_temperature(recording),
        Command(recording.time_s, *recording.command.T),
        why,
    )


def _possible(
    name: str,
    lift: Lifts,
    command: Command,
    load_kg: float,
    oil_temperature_degc: float,
    case: Callable[[Recording], Case],
) -> Possible:
    which = "both lifts" if lift == "both" else f"{lift} lift"
    words = f"{name}, {which}, {load_kg:g} kg, {oil_temperature_degc:g} degC"
    recording = Recording(
        words,
        lift,
        load_kg,
        "validate",
        command.time_s,
        {
            "current_free_a": command.current_free_a,
            "current_main_a": command.current_main_a,
            "oil_temperature_degc": np.full(len(command.time_s), oil_temperature_degc),
        },
        sha256="none yet",
    )
    return Possible(words, case(recording))


def _lifts(lift: Lifts) -> str:
    return "Both lifts" if lift == "both" else f"The {lift} lift"


def _held(level: int, opened_s: float, shut_s: float) -> Steps:
    """One opening to a level in the ECU's steps, then shut."""
    return np.repeat(np.array([level, 0]), [round(opened_s * SAMPLE_RATE_HZ), round(shut_s * SAMPLE_RATE_HZ)])


def _command(lift: Lifts, steps: Mapping[Lift, Steps]) -> Command:
    """Steps of the ECU as the valves get them: after a rest, low-passed and quantised."""
    rest = np.zeros(round(REST_S * SAMPLE_RATE_HZ), np.int64)
    currents = {
        which: quantise_current(
            low_pass(steps_to_current(np.concatenate([rest, steps[which]])), SAMPLE_RATE_HZ, CUTOFF_HZ)
        )
        for which in commanded(lift)
    }
    return Command.of_samples(SAMPLE_RATE_HZ, free=currents.get("free"), main=currents.get("main"))

"""A good campaign, and the ways in which one is spoilt."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from functools import cache

import numpy as np

from forklift import Recording, Truck, simulate
from forklift.app.demo import measured, scattered
from forklift.plant.forklift.commands import Command, generate
from forklift.recordings.channels import LIFTS, commanded

Recordings = tuple[Recording, ...]
THESIS = Truck.read("thesis")
DURATION_S = 8.0


def record(
    truck: Truck, file: str, command: Command, load_kg: float, temperature: float, role: str, stream: int = 0
) -> Recording:
    """A recording of `truck`; the file's name begins with the lift that is commanded."""
    run = simulate(truck, command, load_kg=load_kg, oil_temperature_degc=temperature, solver="fixed")
    columns = measured(run, 1, stream).to_dict(as_series=False)
    time = columns.pop("time_s")
    return Recording(file, file.partition("_")[0], load_kg, role, time, columns)


def commands(kind: str, lift: str, duration_s: float, seed: int) -> Command:
    """A test signal on one lift, or one of its own on each."""
    free, main = (generate(kind, one, duration_s=duration_s, seed=seed + k) for k, one in enumerate(LIFTS))
    if lift != "both":
        return free if lift == "free" else main
    return Command(free.time_s, free.current_free_a, main.current_main_a)


@cache
def good() -> Recordings:
    """Of a truck like the thesis's: each lift with two loads at two temperatures, and both together."""
    truck, made = scattered(THESIS, 1), []
    for lift in LIFTS:
        for seed, load, temperature, role in (
            (1, 0.0, 20.0, "estimate"),
            (2, 1500.0, 60.0, "estimate"),
            (3, 800.0, 40.0, "validate"),
        ):
            command = generate("prms", lift, duration_s=DURATION_S, seed=seed)
            file = f"{lift}_{load:g}kg.csv"
            made.append(record(truck, file, command, load, temperature, role, len(made)))
    both = commands("prms", "both", DURATION_S, 4)
    made.append(record(truck, "both_500kg.csv", both, 500.0, 30.0, "estimate", len(made)))
    return tuple(made)


def with_channels(recording: Recording, **channels: np.ndarray | None) -> Recording:
    """Channels replaced, or removed where None."""
    kept = {
        name: values for name, values in (dict(recording.channels) | channels).items() if values is not None
    }
    return dataclasses.replace(recording, channels=kept, sha256="")


Mutation = Callable[[Recordings], Iterable[Recording]]


def each(change: Callable[[Recording], Recording], *files: str) -> Mutation:
    """`change` applied to these files, else to all."""
    return lambda found: [change(r) if not files or r.file in files else r for r in found]


def column(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recording], Recording]:
    return lambda r: with_channels(r, **{name: change(np.array(r[name]))})


def times(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: values * factor


def held(first: int, last: int) -> Callable[[np.ndarray], np.ndarray]:
    """The sample `first` repeated up to `last`."""
    return lambda values: np.r_[values[:first], np.full(last - first, values[first]), values[last:]]


def dead(values: np.ndarray) -> np.ndarray:
    return np.full_like(values, values[0])


def without(*names: str) -> Callable[[Recording], Recording]:
    return lambda r: with_channels(r, **dict.fromkeys(names))


def exchanged(what: str, unit: str) -> Callable[[Recording], Recording]:
    names = [f"{what}_{lift}_{unit}" for lift in LIFTS]
    return lambda r: with_channels(r, **{names[0]: r[names[1]], names[1]: r[names[0]]})


def chain(*changes: Callable[[Recording], Recording]) -> Callable[[Recording], Recording]:
    def change(recording: Recording) -> Recording:
        for one in changes:
            recording = one(recording)
        return recording

    return change


def other_lift(recording: Recording) -> Recording:
    """Entered and commanded as the other lift."""
    changed = exchanged("current", "a")(recording)
    return dataclasses.replace(changed, lift=LIFTS[1 - LIFTS.index(recording.lift)], sha256="")


def every(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recording], Recording]:
    return lambda r: with_channels(
        r, **{name: change(np.array(values)) for name, values in r.channels.items()}
    )


def lost(first: int, count: int) -> Callable[[Recording], Recording]:
    """Samples cut out, and the time even all the same."""

    def change(r: Recording) -> Recording:
        channels = {
            name: np.delete(values, np.s_[first : first + count]) for name, values in r.channels.items()
        }
        return dataclasses.replace(r, time_s=r.time_s[:-count], channels=channels, sha256="")

    return change


def clock(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Recording], Recording]:
    return lambda r: dataclasses.replace(r, time_s=change(np.array(r.time_s)), sha256="")


def later(name: str, first: int, by: int) -> Callable[[Recording], Recording]:
    """A channel from `first` on moved `by` samples later."""
    return column(name, lambda v: np.r_[v[:first], np.full(by, v[first]), v[first:-by]])


def response_of(command: Callable[[Recording], Command]) -> Callable[[Recording], Recording]:
    """What the sensors would have said under another command; the recorded command stays."""

    def change(r: Recording) -> Recording:
        again = commanded_with(command)(r)
        return with_channels(again, current_free_a=r["current_free_a"], current_main_a=r["current_main_a"])

    return change


def commanded_with(command: Callable[[Recording], Command]) -> Callable[[Recording], Recording]:
    """The same run under another command."""

    def change(r: Recording) -> Recording:
        temperature = float(np.mean(r["oil_temperature_degc"]))
        again = record(scattered(THESIS, 1), r.file, command(r), r.load_kg, temperature, r.role)
        return dataclasses.replace(again, lift=r.lift, sha256="")

    return change


def level(ampere: float) -> Callable[[Recording], Command]:
    """After a second, one current on every commanded valve."""

    def command(r: Recording) -> Command:
        on = np.where(np.arange(len(r)) < 50, 0.0, ampere)
        current = {lift: on if lift in commanded(r.lift) else 0.0 * on for lift in LIFTS}
        return Command(r.time_s, current["free"], current["main"])

    return command


def only(*lifts: str) -> Mutation:
    return lambda found: [r for r in found if r.lift in lifts]


def then(*mutations: Mutation) -> Mutation:
    def change(found: Recordings) -> Iterable[Recording]:
        for mutation in mutations:
            found = tuple(mutation(found))
        return found

    return change


F0, F1, F8, M0, M1, M8, B = (
    "free_0kg.csv",
    "free_1500kg.csv",
    "free_800kg.csv",
    "main_0kg.csv",
    "main_1500kg.csv",
    "main_800kg.csv",
    "both_500kg.csv",
)
PF, PM, XF, XM, H = (
    "pressure_free_pa",
    "pressure_main_pa",
    "position_free_m",
    "position_main_m",
    "fork_height_m",
)

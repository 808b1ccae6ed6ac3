"""A folder of recordings of one truck, as a person with a truck and sensors would bring home."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from forklift.ensemble.proof.truth import run, sensors
from forklift.ensemble.proof.truth.model import Law
from forklift.ensemble.proof.truth.truck import LIFTS, scattered

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"
LIKE = {"free": "null", "main": "leak", "both": "coupling"}
"""Whose recordings have the commands, loads and temperatures, by the lifts that are commanded."""
TEMPERATURE_SCATTER_K = 1.0
END_M = 0.03  # a recording ends where a cylinder comes this near to the end of its stroke
SHORTEST_S = 3.0


@dataclass(frozen=True)
class Plan:
    """One recording to be made: what is commanded, and under which conditions."""

    file: str
    lift: str
    load_kg: float  # as entered
    role: str
    temperature_degc: float
    command: np.ndarray = field(repr=False)  # (2, n) [A], free lift first


def plans(lift: str) -> list[Plan]:
    """The recordings of the campaign that commands `lift`: free, main or both."""
    folder = CAMPAIGNS / LIKE[lift]
    listed = tomllib.loads((folder / "campaign.toml").read_text(encoding="utf-8"))["recording"]
    made = []
    for entry in listed:
        columns = np.genfromtxt(folder / entry["file"], delimiter=",", names=True)
        command = np.stack([columns[f"current_{name}_a"] for name in LIFTS])
        degc = float(re.search(r"_(\d+)c\.csv", entry["file"])[1])
        made.append(Plan(entry["file"], entry["lift"], entry["load_kg"], entry["role"], degc, command))
    return made


@dataclass(frozen=True)
class Case:
    """A truck, what is concealed in it, and how it is recorded."""

    name: str
    lift: str = "free"  # which lifts the campaign commands
    seed: int = 0
    laws: tuple[Law, ...] = ()
    sensors: sensors.Sensors = field(default_factory=sensors.Sensors)
    load_off_kg: float = 0.0  # true minus entered, where a load is on the forks
    stuck_s: float = 0.0  # how long a pressure stands still in one recording
    warming_k: float = 0.0
    temperature_degc: float | None = None  # of all recordings
    command_gain: float = 1.0
    end_m: float = END_M


def conditions(case: Case, planned: Sequence[Plan]) -> list[run.Condition]:
    random = np.random.default_rng([case.seed, 1])
    made = []
    for plan in planned:
        degc = plan.temperature_degc if case.temperature_degc is None else case.temperature_degc
        load = plan.load_kg + (case.load_off_kg if plan.load_kg else 0.0)
        degc += TEMPERATURE_SCATTER_K * random.standard_normal()
        made.append(run.Condition(case.command_gain * plan.command, load, degc, case.warming_k))
    return made


def record(
    case: Case,
    folder: Path,
    planned: Sequence[Plan] | None = None,
    trucks: tuple[dict, dict] | None = None,
) -> list[run.Trajectory]:
    """Write ``campaign.toml`` and its recordings into `folder`; gives what truly happened.

    Of the case's own scattered truck, if no other is given.
    """
    planned = plans(case.lift) if planned is None else planned
    trucks = scattered(case.seed) if trucks is None else trucks
    true = run.simulate(trucks, case.laws, conditions(case, planned))
    random = np.random.default_rng([case.seed, 2])
    folder.mkdir(parents=True, exist_ok=True)
    entries = ['name = "campaign"\nsample_rate_hz = 50.0\n']
    stuck_in = next((n for n, plan in enumerate(planned) if "prms1" in plan.file), None)
    kept = []
    for number, (plan, trajectory) in enumerate(zip(planned, true, strict=True)):
        trajectory = cut(trajectory, plan.lift, case.end_m)
        n = len(trajectory.time_s)
        columns = {"time_s": trajectory.time_s}
        for lift, current in zip(LIFTS, case.command_gain * plan.command, strict=True):
            columns[f"current_{lift}_a"] = current[:n]
        columns |= sensors.measured(trajectory, case.sensors, random)
        if case.stuck_s and number == stuck_in:
            lift = LIFTS[0] if case.lift == "both" else case.lift
            channel = f"pressure_{lift}_pa"
            columns[channel] = sensors.stuck(columns[channel], 4.0, case.stuck_s)
        write(folder / plan.file, columns)
        entries.append(
            f'[[recording]]\nfile = "{plan.file}"\nlift = "{plan.lift}"\n'
            f'load_kg = {plan.load_kg}\nrole = "{plan.role}"\n'
        )
        kept.append(trajectory)
    (folder / "campaign.toml").write_text("\n".join(entries), encoding="utf-8", newline="\n")
    return kept


def cut(trajectory: run.Trajectory, lift: str, end_m: float) -> run.Trajectory:
    """The trajectory until shortly before a commanded lift meets the end of its stroke."""
    moved = [n for n, name in enumerate(LIFTS) if lift in (name, "both")]
    met = np.flatnonzero((trajectory.x[moved] < end_m).any(axis=0))
    n = max(met[0], round(SHORTEST_S / run.TICK_S)) if len(met) else len(trajectory.time_s)
    return replace(
        trajectory,
        time_s=trajectory.time_s[:n],
        x=trajectory.x[:, :n],
        v=trajectory.v[:, :n],
        p_A=trajectory.p_A[:, :n],
        fork_height=trajectory.fork_height[:n],
        temperature_degc=trajectory.temperature_degc[:n],
        encoder=None if trajectory.encoder is None else trajectory.encoder[:, :n],
    )


DIGITS = {"time_s": 10, "position_free_m": 6, "position_main_m": 6, "fork_height_m": 6}


def write(path: Path, columns: dict[str, np.ndarray]) -> None:
    formats = [f"%.{DIGITS.get(name, 5)}g" for name in columns]
    rows = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, rows, formats, ",", header=",".join(columns), comments="", encoding="utf-8")

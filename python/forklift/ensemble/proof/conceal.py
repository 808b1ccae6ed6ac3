"""A campaign made: its folder for the one who diagnoses, its answer and its truth for the one who scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.ensemble.proof import kinds
from forklift.ensemble.proof.amplitude import found_for
from forklift.ensemble.proof.draw import Draw, Plan
from forklift.ensemble.proof.ends import SHORTEST_S, end_m, recorded_ticks
from forklift.ensemble.proof.imitation import HIDDEN as HIDDEN
from forklift.ensemble.proof.imitation import left, left_of_fault
from forklift.ensemble.proof.random import Purpose, stream
from forklift.ensemble.proof.truth import drive, run, sensors
from forklift.ensemble.proof.truth.model import Law
from forklift.ensemble.proof.truth.truck import LIFTS, scattered

TOLERANCE = 3e-6
"""Of the recorded runs; between it and 1e-6 they part by less than a hundredth of the sensors' noise."""
SCHEMA = 1


@dataclass(frozen=True)
class Made:
    """What a campaign truly is.

    Attributes
    ----------
    answer
        What is concealed and which answers are right, as data: see `docs/proof.md`.
    truth
        By file of the campaign, the noise-free signals: ``velocity_free_m_s``, ``velocity_main_m_s`` [m/s],
        of what the lift's encoder sees (forks over second stage, first stage over base),
        ``pressure_free_pa``, ``pressure_main_pa`` [Pa], each (n,).
    """

    answer: dict[str, Any]
    truth: dict[str, dict[str, Floats]]


def conceal(given: Draw, folder: Path, *, judge_hidden: bool = True) -> Made:
    """Write the campaign of `given` into `folder`, and tell its answer.

    The folder holds ``campaign.toml`` and recordings, and nothing that says what is concealed.
    """
    tick_s = run.TICK_S * given.nuisances.tick
    trucks = scattered(stream(given.seed, given.number, Purpose.TRUCK), scatter=_scatter(given))
    random = stream(given.seed, given.number, Purpose.SIZE)
    recorded, conditions = _conditions(given)
    laws: list[Law] = []
    causes: list[dict[str, Any]] = []
    seen = sensors.Sensors(
        noise=given.nuisances.noise,
        colour_s=given.nuisances.colour_s,
        temperature_lag_s=given.nuisances.temperature_lag_s,
    )
    damages: list[dict[str, Any]] = []
    for name, wanted in zip(given.concealed, given.sizes, strict=True):
        right = kinds.right(name)
        where = _where(given, name, random)
        cause: dict[str, Any] = {"id": name, "where": where, "of": right.of, "hidden": False}
        if right.kind in ("sensor", "condition"):
            entered = conditions
            seen, conditions, values, damage = _faulty(given, name, where, seen, conditions, random)
            damages += damage
            if judge_hidden and not damage:  # a signal that stands still or slips is seen in itself
                believed = _as_read(given, seen, entered)
                left_over = left_of_fault(given, laws, believed, conditions, seen, trucks, tick_s)
                cause |= {"imitation_leaves": left_over, "hidden": left_over < HIDDEN}
            cause |= {"values": values, "size": None}
        else:
            law, _, has = found_for(given, name, where, wanted, trucks, conditions, random, tick_s, laws)
            laws.append(law)
            cause |= {
                "values": {key: _number(value) for key, value in law.values.items()},
                "size": has,
                "wanted": wanted,
            }
        cause |= {
            "kind": right.kind,
            "names": list(right.names),
            "equations": list(right.equations),
            "verdicts": list(right.verdicts),
            "refused": list(right.refused),
        }
        causes.append(cause)
    if judge_hidden:
        for place, law in enumerate(laws):
            cause = next(one for one in causes if one["id"] == law.name)
            cause["imitation_leaves"] = left(given, laws, place, trucks, conditions, tick_s)
            cause["hidden"] = cause["imitation_leaves"] < HIDDEN
    true = run.simulate(trucks, laws, conditions, TOLERANCE, tick_s)
    end = end_m(given)
    true = [
        one.until(recorded_ticks(one, plan.lift, end)) for one, plan in zip(true, given.plans, strict=True)
    ]
    _write(given, folder, recorded, true, seen, damages)
    answer = {
        "schema": SCHEMA,
        "seed": given.seed,
        "number": given.number,
        "kind": given.kind,
        "lift": given.lift,
        "causes": causes,
        "tolerated": ["sensor_stuck"] if given.nuisances.spoilt == "stuck" else [],
        "nuisances": asdict(given.nuisances),
        "recordings": [asdict(plan) for plan in given.plans],
        "entered_degc": given.entered_degc,
        "trucks": [{key: np.asarray(value).tolist() for key, value in lift.items()} for lift in trucks],
    }
    truth = {
        plan.file: {
            "velocity_free_m_s": 2.0 * one.v[0],
            "velocity_main_m_s": one.v[1],
            "pressure_free_pa": one.p_A[0],
            "pressure_main_pa": one.p_A[1],
        }
        for plan, one in zip(given.plans, true, strict=True)
    }
    return Made(answer, truth)


def _scatter(given: Draw) -> float:
    """Trucks differ by 12 % and more."""
    return float(stream(given.seed, given.number, Purpose.SENSORS).uniform(0.12, 0.18))


def _number(value: Any) -> float:
    return float(np.max(np.abs(np.atleast_1d(value))) * np.sign(np.sum(np.atleast_1d(value)) or 1.0))


def _where(given: Draw, name: str, random: np.random.Generator) -> str:
    chosen = str(random.choice(LIFTS))  # drawn in any case, so that the stream does not depend on the name
    if kinds.both_lifts(name):
        return "both"
    return given.lift if given.lift in LIFTS else chosen


def _conditions(given: Draw) -> tuple[list[Floats], list[run.Condition]]:
    """Commands as recorded, (2, n) [A], and conditions with the dither on top."""
    random = stream(given.seed, given.number, Purpose.COMMANDS)
    recorded, conditions = [], []
    for plan in given.plans:
        current = np.zeros((2, plan.ticks))
        for n, lift in enumerate(LIFTS):
            if plan.lift in (lift, "both"):
                current[n] = drive.command(plan.kind, random, plan.ticks, run.TICK_S)
        dither = given.nuisances.dither_a * np.where(np.arange(plan.ticks) % 2 == 0, 1.0, -1.0)
        shaken = np.maximum(current + dither * (current > 0.0), 0.0)
        recorded.append(current)
        conditions.append(run.Condition(shaken, plan.load_kg, plan.temperature_degc, plan.warming_k))
    return recorded, conditions


def _faulty(
    given: Draw,
    name: str,
    where: str,
    seen: sensors.Sensors,
    conditions: Sequence[run.Condition],
    random: np.random.Generator,
) -> tuple[sensors.Sensors, list[run.Condition], dict[str, float], list[dict[str, Any]]]:
    """A sensor, clock or condition that is not what it seems; sizes are such that a workshop would care."""
    sign, share = (1.0 if random.random() < 0.5 else -1.0), random.random()
    pressure, position = f"pressure_{where}_pa", f"position_{where}_m"
    kept = list(conditions)
    if name == "pressure_gain":
        value = 1.0 + sign * (0.03 + 0.07 * share)
        return replace(seen, gains=((pressure, value),)), kept, {"gain": value}, []
    if name == "pressure_offset":
        value = sign * (1.5e5 + 4.5e5 * share)
        return replace(seen, offsets=((pressure, value),)), kept, {"offset": value}, []
    if name == "position_scale":
        value = 1.0 + sign * (0.02 + 0.05 * share)
        return replace(seen, gains=((position, value),)), kept, {"scale": value}, []
    if name == "sensor_lag":
        value = 0.04 + 0.08 * share
        return replace(seen, lates_s=((pressure, value),)), kept, {"late": value}, []
    if name == "clock_late":
        value = 0.04 + 0.08 * share
        channels = (
            "position_free_m",
            "position_main_m",
            "pressure_free_pa",
            "pressure_main_pa",
            "fork_height_m",
        )
        return replace(seen, lates_s=tuple((one, value) for one in channels)), kept, {"late": value}, []
    if name in ("sensor_stuck", "sensor_slip"):
        places = random.permutation(
            [n for n, plan in enumerate(given.plans) if plan.lift in (where, "both")]
        )[: int(random.integers(1, 3))]
        at, how = float(random.uniform(2.0, 4.0)), 2.0 + 2.0 * share
        damage = [
            {"in": int(n), "how": name, "channel": pressure if name == "sensor_stuck" else position,
             "at_s": at, "for_s": how, "by_m": sign * (0.04 + 0.11 * share)}
            for n in places
        ]  # fmt: skip
        return seen, kept, {"recordings": float(len(damage))}, damage
    if name == "load_entered":
        value = sign * (60.0 + 120.0 * share)
        kept = [
            replace(one, load_kg=max(one.load_kg + value, 0.0)) if one.load_kg > 0.0 else one for one in kept
        ]
        return seen, kept, {"load": value}, []
    if name == "temperature_offset":
        value = sign * (4.0 + 6.0 * share)
        return replace(seen, offsets=(("oil_temperature_degc", value),)), kept, {"offset": value}, []
    return replace(seen, temperature_stuck_degc=30.0), kept, {"stands_at": 30.0}, []


def _as_read(given: Draw, seen: sensors.Sensors, conditions: Sequence[run.Condition]) -> list[run.Condition]:
    """Conditions with the oil's temperature as its sensor reads, where one does."""
    off = dict(seen.offsets).get("oil_temperature_degc", 0.0)
    stands = seen.temperature_stuck_degc
    return [
        one
        if not plan.has_temperature
        else replace(one, temperature_degc=one.temperature_degc + off)
        if stands is None
        else replace(one, temperature_degc=stands, warming_k=0.0)
        for plan, one in zip(given.plans, conditions, strict=True)
    ]


def _write(
    given: Draw,
    folder: Path,
    recorded: Sequence[Floats],
    true: list[run.Trajectory],
    seen: sensors.Sensors,
    damages: Sequence[dict[str, Any]],
) -> None:
    random = stream(given.seed, given.number, Purpose.NOISE)
    folder.mkdir(parents=True, exist_ok=True)
    entries = ['name = "campaign"\nsample_rate_hz = 50.0\n']
    spoilt = given.nuisances
    for number, (plan, one, current) in enumerate(zip(given.plans, true, recorded, strict=True)):
        if spoilt.spoilt == "short" and number == spoilt.spoilt_in:
            n = round((SHORTEST_S + 0.2 * spoilt.spoilt_s) / run.TICK_S)
            one = true[number] = one.until(n)
        n = len(one.time_s)
        columns: dict[str, Any] = {"time_s": np.arange(n) * run.TICK_S}
        columns |= {f"current_{lift}_a": current[k, :n] for k, lift in enumerate(LIFTS)}
        columns |= sensors.measured(one, seen, random)
        if not given.nuisances.height:
            del columns["fork_height_m"]
        if not plan.has_temperature:
            del columns["oil_temperature_degc"]
        for damage in damages:
            if damage["in"] == number:
                channel = columns[damage["channel"]]
                if damage["how"] == "sensor_stuck":
                    channel = sensors.stuck(channel, damage["at_s"], damage["for_s"])
                else:
                    channel = sensors.slipped(channel, damage["at_s"], damage["by_m"])
                columns[damage["channel"]] = channel
        if number == spoilt.spoilt_in and spoilt.spoilt in ("gap", "stuck"):
            columns = _spoil(columns, plan, spoilt.spoilt, spoilt.spoilt_s)
        _csv(folder / plan.file, columns)
        entries.append(
            f'[[recording]]\nfile = "{plan.file}"\nlift = "{plan.lift}"\n'
            f'load_kg = {plan.entered_kg}\nrole = "{plan.role}"\n'
        )
    (folder / "campaign.toml").write_text("\n".join(entries), encoding="utf-8", newline="\n")


def _spoil(columns: dict[str, Floats], plan: Plan, how: str, at_s: float) -> dict[str, Floats]:
    """A plug that lost contact: samples that are missing, or a pressure that stands still."""
    lift = plan.lift if plan.lift in LIFTS else "free"
    spoilt = dict(columns)
    name = f"pressure_{lift}_pa"
    if how == "stuck":
        spoilt[name] = sensors.stuck(spoilt[name], at_s, 2.0)
        return spoilt
    for channel in (name, f"position_{lift}_m"):
        values = spoilt[channel].copy()
        values[round(at_s / run.TICK_S) : round((at_s + 0.6) / run.TICK_S)] = np.nan
        spoilt[channel] = values
    return spoilt


DIGITS = {"time_s": 10, "position_free_m": 6, "position_main_m": 6, "fork_height_m": 6}


def _csv(path: Path, columns: dict[str, Floats]) -> None:
    formats = [f"%.{DIGITS.get(name, 5)}g" for name in columns]
    lines = [",".join(columns)]
    for row in zip(*columns.values(), strict=True):
        lines.append(
            ",".join("" if np.isnan(one) else form % one for form, one in zip(formats, row, strict=True))
        )
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")

"""A pneumatic piston with a seal: the force on its rod, from pressure and motion.

The textbook's model has no state, and a friction of constant level (Coulomb):

    F = A p + F_c sign(v)

A sensor may be mounted either way round: the sign of F_c is told by the recordings. No free run is possible,
as the motion is imposed and the force answers at once.

Recordings: E. Zillen, MSc thesis, Delft University of Technology (with H. Vallery and G. Smit); files
``friction/{seal}_{pressure}bar.csv.gz`` of the repository EvaZillen/3D-printed-pneumatic-actuator, CC0 1.0.
Without a header, 100 Hz with gaps: time [ms], three voltages, position [mm], pressure [bar], force [N].
"""

from __future__ import annotations

import gzip
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.parts import Effect, Input, Output, Param, Plant, Port, Values
from forklift.plant.recording import Recording

SEALS = ("O-ring", "O-ring257", "X-ring257")
PRESSURES_BAR = (1, 3, 5, 7)
INTERVAL_S = 0.05
"""Samples are averaged over this: a stroke lasts 4 s."""
NEAR_S = 0.1
"""Speeds are told from positions this long before and after."""
SLOW = 1.0
"""Speed [mm/s] over which the sign of the motion turns."""
FITTED = 0.6
"""Share of each file that is fitted; the rest is held out."""
FORCE, FRICTION = "force", "friction level"


def read(folder: str | Path, seal: str) -> list[Recording]:
    """One seal's files, the first 60 % of each to be fitted on, the rest held out; by pressure as groups.

    Raises
    ------
    ForkliftError
        ``"recording-missing"``.
    """
    found: list[Recording] = []
    for pressure in PRESSURES_BAR:
        path = Path(folder) / "friction" / f"{seal}_{pressure}bar.csv.gz"
        if not path.is_file():
            raise ForkliftError("recording-missing", f"{path} is missing", file=str(path))
        with gzip.open(path, "rt", encoding="utf-8") as lines:
            table = np.loadtxt(lines)
        time, position, bar, force = _averaged(table[:, 0] / 1e3, table[:, 4], table[:, 5], table[:, 6])
        whole = Recording(
            f"{seal} {pressure} bar",
            time,
            {"p": bar, "x": position},
            {"F": force},
            group=f"{pressure} bar",
            conditions={"pressure_bar": float(pressure)},
        )
        found += whole_with_motion(whole).split(FITTED)
    return found


def whole_with_motion(recording: Recording) -> Recording:
    """The recording with what its motion tells, before it is cut: a cut would forget the last reversal."""
    u = dict(recording.u)
    for one in INPUTS:
        if one.derived and one.name not in u:
            u[one.name] = one.derived(recording.time_s, u)
    return Recording(
        recording.file,
        recording.time_s,
        u,
        recording.y,
        recording.role,
        recording.group,
        recording.conditions,
    )


def repeatability(recordings: Sequence[Recording]) -> dict[str, float]:
    """By group, how far the force scatters among strokes at the same place, direction and speed [N].

    Standard deviation within cells of 2 mm and 3 mm/s, the area's share of the pressure's scatter taken off:
    no law of these variables explains less than that.
    """
    floors = {}
    for group in dict.fromkeys(one.group for one in recordings):
        own = [one for one in recordings if one.group == group]
        p, x, v = (np.concatenate([one.u[name] for one in own]) for name in ("p", "x", "v"))
        force = np.concatenate([one.y["F"] for one in own])
        columns = np.column_stack([p, np.ones_like(p), np.sign(v), x, x * np.sign(v), v])
        area = np.linalg.lstsq(columns, force, rcond=None)[0][0]
        rest = force - area * p
        cells = np.digitize(v, np.arange(-15.0, 15.1, 3.0)) * 1000 + np.digitize(
            x, np.arange(-6.0, 45.0, 2.0)
        )
        total, count = 0.0, 0
        for cell in np.unique(cells):
            inside = rest[cells == cell]
            total += float(np.sum((inside - inside.mean()) ** 2))
            count += len(inside) - 1
        floors[group] = float(np.sqrt(total / max(count, 1)))
    return floors


def gone(found: Any, recordings: Sequence[Recording]) -> float:
    """Share of the variance above the repeatability that is gone on the held-out end of each file."""
    floors = repeatability(recordings)
    group = {one.file: one.group for one in recordings}
    before, after = (
        sum(row["rmse"] ** 2 - floors[group[row["file"]]] ** 2 for row in side.held_out.iter_rows(named=True))
        for side in (found.before, found.after)
    )
    return float(1.0 - after / before)


def gone_left_out(found: Any, recordings: Sequence[Recording], sigma: float) -> float:
    """The same of each pressure, predicted from the others; `sigma` as the plant has it [N]."""
    floors = repeatability(recordings)
    before = sum(one.before * sigma**2 - floors[one.group] ** 2 for one in found.groups)
    after = sum(one.after * sigma**2 - floors[one.group] ** 2 for one in found.groups)
    return float(1.0 - after / before)


def plant(sigma: float | None = None) -> Plant:
    """The textbook's model, and what a piston with a seal may have beside it.

    `sigma` is what does not repeat [N]; None: told from the samples alone.
    """
    return Plant(
        name="pneumatic seal",
        params=(
            Param("area", "N/bar", 50.0, 10.0, 100.0),
            Param("coulomb", "N", 0.0, -40.0, 40.0),
        ),
        inputs=INPUTS,
        outputs=(Output("F", "N", sigma=sigma, offset_range=2.0),),
        ports=(Port(FORCE, "N", "balance", 1.0), Port(FRICTION, "N", "law", 1.0)),
        effects=EFFECTS,
        bus=lambda t, x, u, p: {"direction": direction(u["v"]), "speed": np.abs(u["v"])},
        out=out,
        score="algebraic",
        source="Coulomb",
    )


def out(t: Any, x: Values, u: Values, w: Values, p: Values, bus: Values) -> dict[str, Any]:
    """F = A p + (F_c + w) sign(v) + w [N]."""
    return {"F": p["area"] * u["p"] + (p["coulomb"] + w[FRICTION]) * bus["direction"] + w[FORCE]}


def direction(v: Any) -> Any:
    """sign(v), rounded over `SLOW`."""
    return v / np.sqrt(v**2 + SLOW**2)


def candidates() -> list[Recording]:
    """Recordings that could be made at every pressure: strokes, slow and fast; many short ones; rest."""
    found = []
    for bar in PRESSURES_BAR:
        for speed in (2.0, 8.0, 30.0):
            found.append(_strokes(f"6 strokes at {speed:g} mm/s and {bar} bar", bar, speed, 35.0, 6))
        for speed in (3.0, 12.0):
            found.append(_strokes(f"60 strokes of 4 mm at {speed:g} mm/s and {bar} bar", bar, speed, 4.0, 60))
        time = np.arange(0.0, 30.0, INTERVAL_S)
        found.append(_driven(f"30 s at rest and {bar} bar", bar, time, np.full(len(time), 17.0)))
    return found


def _strokes(name: str, bar: float, speed: float, length: float, count: int) -> Recording:
    """Out and in with a constant speed [mm/s], over a length [mm]."""
    time = np.arange(0.0, count * length / speed, INTERVAL_S)
    phase = (time * speed / length) % 2.0
    return _driven(name, bar, time, 17.0 + length * (np.where(phase < 1.0, phase, 2.0 - phase) - 0.5))


def _driven(name: str, bar: float, time: Floats, position: Floats) -> Recording:
    return Recording(name, time, {"p": np.full(len(time), float(bar)), "x": position}, {}, group=f"{bar} bar")


def _averaged(time: Floats, *columns: Floats) -> list[Floats]:
    """Means over `INTERVAL_S`, where there are samples."""
    _, place = np.unique(np.floor(time / INTERVAL_S), return_inverse=True)
    count = np.bincount(place)
    return [np.asarray(np.bincount(place, column) / count) for column in (time, *columns)]


def _speed(time: Floats, u: Mapping[str, Floats]) -> Floats:
    after, before = (np.interp(time + shift, time, u["x"]) for shift in (NEAR_S, -NEAR_S))
    ends = [np.interp(time + shift, time, time) for shift in (NEAR_S, -NEAR_S)]
    return np.asarray((after - before) / (ends[0] - ends[1]))


def _acceleration(time: Floats, u: Mapping[str, Floats]) -> Floats:
    return np.asarray(np.gradient(u["v"], time))


def _rate(time: Floats, u: Mapping[str, Floats]) -> Floats:
    return _speed(time, {"x": u["p"]})


def _travelled(time: Floats, u: Mapping[str, Floats]) -> Floats:
    """Way since the motion last turned [mm]; before the first turn, from the start."""
    way, last, turned = np.zeros(len(time)), 0.0, float(u["x"][0])
    for k, (v, x) in enumerate(zip(u["v"], u["x"], strict=True)):
        if v * last < 0.0 and abs(v) > 0.0:
            turned = float(x)
        last = float(v) or last
        way[k] = abs(float(x) - turned)
    return way


def _rested(time: Floats, u: Mapping[str, Floats]) -> Floats:
    """How long it had rested before it last set off [s]: slower than `SLOW`."""
    rest, found, since = 0.0, np.zeros(len(time)), float(time[0])
    for k, v in enumerate(u["v"]):
        if abs(v) < SLOW:
            rest = float(time[k]) - since
        else:
            since = float(time[k])
        found[k] = rest
    return found


INPUTS = (
    Input("p", "bar", offset_range=0.02, gain_range=0.05),
    Input("x", "mm", offset_range=0.0, gain_range=0.0),
    Input("v", "mm/s", derived=_speed),
    Input("a", "mm/s2", derived=_acceleration),
    Input("dp", "bar/s", derived=_rate),
    Input("way", "mm", derived=_travelled),
    Input("rested", "s", derived=_rested),
)


def _of(port: str, law: Any) -> Any:
    return lambda x, u, p, bus: {port: law(x, u, p, bus)}


EFFECTS = (
    Effect(
        "pressure_friction", "the seal's friction grows with the pressure that presses it on",
        (Param("slope", "N/bar", 0.0, -5.0, 5.0),), (FRICTION,),
        _of(FRICTION, lambda x, u, p, bus: p["slope"] * u["p"]),
        confused_with=("viscous", "stribeck"), source="Müller & Nau 1998",
    ),
    Effect(
        "viscous", "friction grows with speed",
        (Param("slope", "N s/mm", 0.0, -1.0, 1.0),), (FRICTION,),
        _of(FRICTION, lambda x, u, p, bus: p["slope"] * bus["speed"]),
        confused_with=("pressure_friction", "stribeck"),
    ),
    Effect(
        "stribeck", "friction is higher at low speed",
        (Param("level", "N", 0.0, -20.0, 20.0), Param("speed", "mm/s", 3.0, 0.5, 20.0, starts=(2.0, 8.0))),
        (FRICTION,),
        _of(FRICTION, lambda x, u, p, bus: p["level"] * np.exp(-((u["v"] / p["speed"]) ** 2))),
        confused_with=("viscous", "presliding"), source="Armstrong-Hélouvry 1991",
    ),
    Effect(
        "position_friction", "friction depends on the place in the bore",
        (Param("slope", "N/mm", 0.0, -0.5, 0.5),), (FRICTION,),
        _of(FRICTION, lambda x, u, p, bus: p["slope"] * (u["x"] - 17.0)),
    ),
    Effect(
        "break_away", "friction is higher for a while after a rest",
        (Param("level", "N", 0.0, -20.0, 20.0), Param("way", "mm", 1.0, 0.1, 10.0)), (FRICTION,),
        _of(FRICTION, lambda x, u, p, bus: p["level"] * np.log1p(u["rested"]) * np.exp(-u["way"] / p["way"])),
        confused_with=("stribeck", "presliding"), source="Rabinowicz 1951",
    ),
    Effect(
        "presliding", "friction turns with the motion only over a way: the seal gives before it slides",
        (Param("share", "1", 0.0, 0.0, 1.0), Param("way", "mm", 0.5, 0.05, 10.0, starts=(0.3, 2.0))),
        (FRICTION,),
        _of(FRICTION, lambda x, u, p, bus: -2.0 * p["share"] * p["coulomb"] * np.exp(-u["way"] / p["way"])),
        confused_with=("stribeck", "break_away"), source="Dahl 1968",
    ),
    Effect(
        "asymmetry", "friction is not the same out and in",
        (Param("level", "N", 0.0, -20.0, 20.0),), (FORCE,),
        _of(FORCE, lambda x, u, p, bus: p["level"] * bus["direction"] ** 2),
        confused_with=("weight", "sensor_offset"),
    ),
    Effect(
        "weight", "a constant force acts beside the pressure's: the rod's weight",
        (Param("force", "N", 0.0, -20.0, 20.0),), (FORCE,),
        _of(FORCE, lambda x, u, p, bus: p["force"] + 0.0 * u["p"]),
        confused_with=("asymmetry", "sensor_offset"),
    ),
    Effect(
        "spring", "a force grows with the stroke: a hose or cable that is bent",
        (Param("stiffness", "N/mm", 0.0, -0.5, 0.5),), (FORCE,),
        _of(FORCE, lambda x, u, p, bus: p["stiffness"] * (u["x"] - 17.0)),
    ),
    Effect(
        "inertia", "a mass is accelerated",
        (Param("mass", "kg", 0.0, 0.0, 20.0),), (FORCE,),
        _of(FORCE, lambda x, u, p, bus: 1e-3 * p["mass"] * u["a"]),
    ),
    Effect(
        "pressure_lag", "the pressure at the piston follows the gauge's late",
        (Param("time", "s", 0.0, -1.0, 1.0),), (FORCE,),
        _of(FORCE, lambda x, u, p, bus: -p["area"] * p["time"] * u["dp"]),
        confused_with=("viscous",),
    ),
)  # fmt: skip
"""What a piston with a seal may have beside a constant friction."""

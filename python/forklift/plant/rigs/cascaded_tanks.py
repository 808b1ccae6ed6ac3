"""Two tanks in series: a pump fills the upper one, which drains into the lower one, whose level is measured.

The textbook's model, with Bernoulli's outflow (Schoukens, Mattsson, Wigren & Noël 2016), levels in volts of
the sensor and both tanks of the same section:

    dh₁/dt = k_p u − k₁ √h₁
    dh₂/dt = k₁ √h₁ − k₂ √h₂
    y = h₂, at most 10 V

The upper level is not measured; both levels at the start are unknown, and the same in both recordings.

Recordings: M. Schoukens, P. Mattsson, T. Wigren, J.P. Noël, "Cascaded tanks benchmark combining soft and hard
nonlinearities", Workshop on Nonlinear System Identification Benchmarks, 2016, from nonlinearbenchmark.org; a
file ``dataBenchmark.csv`` with columns uEst, uVal, yEst, yVal and Ts.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.parts import Effect, Input, Output, Param, Plant, Port, State, Values
from forklift.plant.recording import Recording

CEILING_V = 10.0
SMOOTH_V = 0.05
"""Over which a level passes a rim, or a voltage a threshold."""
WEIR_S = 0.05
"""Flow over a rim of hardness one half, per level above it [1/s]."""
FILE = "dataBenchmark.csv"
UPPER, LOWER, PUMP, LEVEL = "upper balance", "lower balance", "pump flow", "level reading"
UPPER_OUT, LOWER_OUT = "upper outflow", "lower outflow"


def read(folder: str | Path) -> tuple[Recording, Recording]:
    """The estimation and the validation recording.

    Raises
    ------
    ForkliftError
        ``"recording-missing"`` if the folder does not hold ``dataBenchmark.csv``.
    """
    path = Path(folder) / FILE
    if not path.is_file():
        raise ForkliftError("recording-missing", f"{path} is missing", file=str(path))
    with path.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    step = float(rows[0]["Ts"])
    time = np.asarray(step * np.arange(len(rows)), dtype=np.float64)
    known: dict[str, Floats] = {
        name: np.array([row[name] for row in rows], dtype=np.float64)
        for name in ("uEst", "uVal", "yEst", "yVal")
    }
    return (
        Recording("estimation", time, {"u": known["uEst"]}, {"y": known["yEst"]}, "estimate"),
        Recording("validation", time, {"u": known["uVal"]}, {"y": known["yVal"]}, "validate"),
    )


def plant() -> Plant:
    """The textbook's model, and what such rigs may leave out."""
    return Plant(
        name="cascaded tanks",
        states=(
            State("h1", "V", "free", 0.0, 60.0, guess=5.0, spread=3.0, shared=True),
            State("h2", "V", "free", 0.0, 15.0, guess=5.0, spread=3.0, shared=True),
        ),
        params=(
            Param("k_p", "1/s", 0.05, 0.01, 0.25),
            Param("k_1", "V^0.5/s", 0.05, 0.01, 0.25),
            Param("k_2", "V^0.5/s", 0.05, 0.01, 0.25),
        ),
        inputs=(Input("u", "V", hold="zero"),),
        outputs=(Output("y", "V", upper=CEILING_V),),
        ports=(
            Port(UPPER, "V/s", "balance", 0.1),
            Port(LOWER, "V/s", "balance", 0.1),
            Port(PUMP, "V/s", "law", 0.1),
            Port(UPPER_OUT, "V/s", "law", 0.1),
            Port(LOWER_OUT, "V/s", "law", 0.1),
            Port(LEVEL, "V", "sensor", 1.0),
        ),
        effects=EFFECTS,
        order=2,
        bus=bus,
        rhs=rhs,
        out=lambda t, x, u, w, p, bus: {"y": x["h2"] + w[LEVEL]},
        source="Schoukens, Mattsson, Wigren & Noël 2016",
    )


def bus(t: Any, x: Values, u: Values, p: Values) -> dict[str, Any]:
    """The flows of the textbook's model, as rates of the level [V/s]."""
    pumped = p["k_p"] * u["u"]
    upper, lower = p["k_1"] * root(x["h1"]), p["k_2"] * root(x["h2"])
    return {
        "pumped": pumped,
        "q1": upper,
        "q2": lower,
        "upper filling": pumped - upper,
        "lower filling": upper - lower,
    }


def rhs(t: Any, x: Values, u: Values, w: Values, p: Values, bus: Values) -> dict[str, Any]:
    """Both balances of mass, with what effects add: water that leaves the upper outlet reaches the lower."""
    upper, lower = bus["q1"] + w[UPPER_OUT], bus["q2"] + w[LOWER_OUT]
    return {
        "h1": bus["pumped"] + w[PUMP] - upper + w[UPPER],
        "h2": upper - lower + w[LOWER],
    }


def root(level: Any) -> Any:
    """√h, with a finite slope at an empty tank."""
    return np.sqrt(np.maximum(level, 0.0) + 1e-6)


def above(value: Any, threshold: Any) -> Any:
    """max(value − threshold, 0), rounded over `SMOOTH_V`."""
    over = value - threshold
    return 0.5 * (over + np.sqrt(over**2 + SMOOTH_V**2))


def _over_upper(x: Values, u: Values, p: Values, bus: Values) -> dict[str, Any]:
    over = _weir(p) * above(x["h1"], p["rim"])
    return {UPPER: -over, LOWER: p["share"] * over}


def _section(level: str, port: str, filling: str) -> Any:
    def term(x: Values, u: Values, p: Values, bus: Values) -> dict[str, Any]:
        area = np.maximum(1.0 + p["slope"] * (x[level] - 5.0) / 5.0, 0.1)
        return {port: bus[filling] * (1.0 / area - 1.0)}

    return term


def _of(port: str, law: Any) -> Any:
    return lambda x, u, p, bus: {port: law(x, u, p, bus)}


_RIM = Param("hardness", "1", 0.0, 0.0, 0.9)


def _weir(p: Values) -> Any:
    """Flow per level above a rim [1/s]: none at hardness 0, as much as one likes towards 1.

    How hard a rim is, recordings tell; how much flows over a hard one per level, they do not.
    """
    return WEIR_S * p["hardness"] / (1.0 - p["hardness"])


EFFECTS = (
    Effect(
        "upper_overflow", "the upper tank flows over its rim, partly into the lower one",
        (_RIM, Param("rim", "V", 12.0, 3.0, 40.0, starts=(7.0, 12.0, 20.0)),
         Param("share", "1", 0.5, 0.0, 1.0)),
        (UPPER, LOWER), _over_upper, confused_with=("pump_saturation", "lower_overflow"),
        source="linear weir",
    ),
    Effect(
        "lower_overflow", "the lower tank flows over its rim",
        (_RIM, Param("rim", "V", 9.5, 5.0, 12.0, starts=(8.0, 10.0))),
        (LOWER,), _of(LOWER, lambda x, u, p, bus: -_weir(p) * above(x["h2"], p["rim"])),
        confused_with=("sensor_curve",), source="linear weir",
    ),
    Effect(
        "upper_outlet_head", "the upper outlet lies below its tank's zero of level",
        (Param("head", "V", 0.0, -1.0, 5.0),), (UPPER_OUT,),
        _of(UPPER_OUT, lambda x, u, p, bus: p["k_1"] * (root(x["h1"] + p["head"]) - root(x["h1"]))),
        confused_with=("upper_exponent",), source="Bernoulli",
    ),
    Effect(
        "lower_outlet_head", "the lower outlet lies below its tank's zero of level",
        (Param("head", "V", 0.0, -1.0, 5.0),), (LOWER_OUT,),
        _of(LOWER_OUT, lambda x, u, p, bus: p["k_2"] * (root(x["h2"] + p["head"]) - root(x["h2"]))),
        confused_with=("lower_exponent", "sensor_offset"), source="Bernoulli",
    ),
    Effect(
        "upper_exponent", "the upper outlet's flow goes with another power of the level than one half",
        (Param("excess", "1", 0.0, -0.15, 0.5),), (UPPER_OUT,),
        _of(UPPER_OUT, lambda x, u, p, bus: bus["q1"] * ((x["h1"] + 1e-6) ** p["excess"] - 1.0)),
        confused_with=("upper_outlet_head", "upper_laminar"), source="Idelchik 2007, ch. 1",
    ),
    Effect(
        "lower_exponent", "the lower outlet's flow goes with another power of the level than one half",
        (Param("excess", "1", 0.0, -0.15, 0.5),), (LOWER_OUT,),
        _of(LOWER_OUT, lambda x, u, p, bus: bus["q2"] * ((x["h2"] + 1e-6) ** p["excess"] - 1.0)),
        confused_with=("lower_outlet_head", "lower_laminar"), source="Idelchik 2007, ch. 1",
    ),
    Effect(
        "upper_laminar", "a part of the upper outlet's flow is laminar",
        (Param("slope", "1/s", 0.0, 0.0, 0.05),), (UPPER_OUT,),
        _of(UPPER_OUT, lambda x, u, p, bus: p["slope"] * x["h1"]),
        confused_with=("upper_exponent",), source="Hagen–Poiseuille",
    ),
    Effect(
        "lower_laminar", "a part of the lower outlet's flow is laminar",
        (Param("slope", "1/s", 0.0, 0.0, 0.05),), (LOWER_OUT,),
        _of(LOWER_OUT, lambda x, u, p, bus: p["slope"] * x["h2"]),
        confused_with=("lower_exponent",), source="Hagen–Poiseuille",
    ),
    Effect(
        "pump_dead_zone", "the pump gives nothing below a voltage",
        (Param("threshold", "V", 0.0, 0.0, 2.0),), (PUMP,),
        _of(PUMP, lambda x, u, p, bus: p["k_p"] * (above(u["u"], p["threshold"]) - above(u["u"], 0.0))),
        confused_with=("input_offset", "pump_curve"),
    ),
    Effect(
        "pump_curve", "the pump's flow is not proportional to its voltage",
        (Param("bend", "1/V", 0.0, -0.1, 0.2),), (PUMP,),
        _of(PUMP, lambda x, u, p, bus: p["bend"] * bus["pumped"] * u["u"]),
        confused_with=("pump_dead_zone", "pump_saturation"),
    ),
    Effect(
        "pump_saturation", "the pump gives less than its share above a voltage",
        (Param("loss", "1", 0.0, 0.0, 1.0), Param("from", "V", 5.0, 2.0, 6.5, starts=(4.0, 5.5))),
        (PUMP,), _of(PUMP, lambda x, u, p, bus: -p["loss"] * p["k_p"] * above(u["u"], p["from"])),
        confused_with=("upper_overflow",),
    ),
    Effect(
        "pump_head", "the pump gives less against a higher level",
        (Param("droop", "1/V", 0.0, 0.0, 0.1),), (PUMP,),
        _of(PUMP, lambda x, u, p, bus: -p["droop"] * bus["pumped"] * x["h1"]),
        confused_with=("upper_laminar",),
    ),
    Effect(
        "pump_lag", "the pump answers its voltage late",
        (Param("share", "1", 0.0, 0.0, 1.0), Param("time", "s", 10.0, 3.0, 200.0, starts=(6.0, 30.0))),
        (PUMP,),
        lambda x, u, p, bus: {
            PUMP: p["share"] * p["k_p"] * (x["u_late"] - u["u"]),
            "u_late": (u["u"] - x["u_late"]) / p["time"],
        },
        states=(State("u_late", "V", "u"),), confused_with=("sensor_lag",),
    ),
    Effect(
        "sensor_curve", "the level sensor is not straight between its ends",
        (Param("bow", "1", 0.0, -1.0, 1.0),), (LEVEL,),
        _of(LEVEL, lambda x, u, p, bus: p["bow"] * x["h2"] * (1.0 - x["h2"] / CEILING_V)),
        confused_with=("lower_section", "lower_exponent"),
    ),
    Effect(
        "upper_section", "the upper tank's section varies with height",
        (Param("slope", "1", 0.0, -0.5, 0.5),), (UPPER,), _section("h1", UPPER, "upper filling"),
    ),
    Effect(
        "lower_section", "the lower tank's section varies with height",
        (Param("slope", "1", 0.0, -0.5, 0.5),), (LOWER,), _section("h2", LOWER, "lower filling"),
        confused_with=("sensor_curve",),
    ),
    Effect(
        "upper_leakage", "the upper tank leaks past the lower one",
        (Param("flow", "V^0.5/s", 0.0, 0.0, 0.05),), (UPPER,),
        _of(UPPER, lambda x, u, p, bus: -p["flow"] * root(x["h1"])), source="Bernoulli",
    ),
    Effect(
        "evaporation", "water evaporates from the lower tank",
        (Param("rate", "V/s", 0.0, 0.0, 0.02),), (LOWER,),
        _of(LOWER, lambda x, u, p, bus: -p["rate"] + 0.0 * x["h2"]),
    ),
)  # fmt: skip
"""What two tanks and a pump may have beside the textbook's model."""

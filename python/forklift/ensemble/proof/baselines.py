"""What simpler ways say of the same campaigns, from the same fitted truck.

All start where the diagnosis starts, at the truck fitted without any addition, and see what it leaves over:

==================== ===================================================================================
``largest residual``  the channel that is furthest above its noise, and the equation that it stands for
``criterion``         the hypothesis whose linear step gains most, less BIC's penalty, on fitted recordings
``sparse``            SINDy's sequentially thresholded least squares on the residuals (Brunton et al. 2016)
``regimes``           after LISDD (arXiv 2606.23215): a clean regime, residual energy, a library of one and
                      two terms with recordings held out, and an F-test; in a plain form of its own
==================== ===================================================================================
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import f as f_distribution

from forklift.base.arrays import Floats
from forklift.ensemble.proof.kinds import EQUATIONS
from forklift.ensemble.proof.truth.sensors import COUNT_M, PRESSURE_NOISE_PA
from forklift.ensemble.proof.truth.truck import LIFTS

METHODS = ("largest residual", "criterion", "sparse", "regimes")

ABOVE = 1.8
"""Mean square, in units of `NOISE`, up to which nothing is amiss."""
THRESHOLD = 0.1
"""Of a term's standardised coefficient, below which it is dropped (sparse regression)."""
ROUNDS = 10
SMALLEST_SHARE = 0.05
"""Of the residual's variance that a regression must explain to be an answer."""
CERTAIN = 0.001
"""Level of the F-test."""
CLEAN = 2.0
"""Mean square of a recording, relative to the cleanest, up to which it belongs to the clean regime."""

TERMS = {
    "constant": ("pressure_offset", "sensor"),
    "pressure": ("pressure_gain", "sensor"),
    "velocity": ("friction_temperature", "friction"),
    "velocity x temperature": ("friction_temperature", "friction"),
    "velocity |velocity|": ("hose_resistance", "valve-flow"),
    "sign": ("friction_pressure", "friction"),
    "sign x pressure": ("friction_pressure", "friction"),
    "position": ("friction_position", "friction"),
    "sign x position": ("friction_position", "friction"),
    "load": ("load_entered", "operating-point"),
    "acceleration": ("chassis_compliance", "chassis"),
    "command rate": ("valve_lag", "valve-dynamics"),
    "command": ("valve_current_limit", "valve-dynamics"),
    "command x temperature": ("viscosity_law", "viscosity"),
    "pressure rate": ("entrained_air", "bulk-modulus"),
    "pressure rate x temperature": ("bulk_modulus_temperature", "bulk-modulus"),
    "other acceleration": ("mast_coupling", "mast-coupling"),
    "pressure, shut": ("leakage", "cylinder-pressure"),
}
"""A term of the library, and the cause and equation that it speaks for."""


def answers(
    folder: Path, found: Path, answer: Mapping[str, Any], told: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """By method, what it says and what of that is right."""
    rows = list(_recordings(folder, found, answer))
    said = {
        "largest residual": _largest(rows),
        "criterion": _criterion(rows, told),
        "sparse": _sparse(rows),
        "regimes": _regimes(rows),
    }
    return {name: one | _judged(answer, one) for name, one in said.items()}


def _judged(answer: Mapping[str, Any], said: Mapping[str, Any]) -> dict[str, Any]:
    causes = [one for one in answer["causes"] if not one["hidden"]]
    if not causes:
        return {"verdict_right": not said["mismatch"], "location_right": None, "cause_right": None}
    equations = set().union(*(one["equations"] for one in causes))
    names = set().union(*(one["names"] for one in causes))
    verdicts = set().union(*(one["verdicts"] for one in causes))
    return {
        "verdict_right": said["mismatch"] and said["verdict"] in verdicts,
        "location_right": said["mismatch"] and said["equation"] in equations,
        "cause_right": said["cause"] in names if names else None,
    }


def _verdict(equation: str) -> str:
    return {"sensor": "sensor-fault", "operating-point": "parameter-error"}.get(equation, "missing-physics")


def _said(cause: str | None, equation: str | None, mismatch: bool = True) -> dict[str, Any]:
    verdict = _verdict(equation) if mismatch and equation else "no-mismatch"
    return {"mismatch": mismatch, "verdict": verdict, "cause": cause, "equation": equation}


NOTHING = _said(None, None, mismatch=False)


def _recordings(folder: Path, found: Path, answer: Mapping[str, Any]) -> Any:
    """Of each recording: its plan, what was measured, and what the fitted truck says."""
    for plan in answer["recordings"]:
        side = found / "predictions" / "baseline" / plan["file"]
        if side.exists():
            measured, told = columns(folder / plan["file"]), columns(side)
            n = min(len(measured["time_s"]), len(told["time_s"]))
            yield plan, {k: v[:n] for k, v in measured.items()}, {k: v[:n] for k, v in told.items()}


def columns(path: Path) -> dict[str, Floats]:
    """The columns of a table of numbers, NaN where a cell is empty."""
    with path.open(encoding="utf-8", newline="") as lines:
        rows = csv.reader(lines)
        names = next(rows)
        values = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows], float)
    return {name: values[:, n] for n, name in enumerate(names)}


NOISE = {"pressure": PRESSURE_NOISE_PA, "position": COUNT_M}
"""Of an encoder a whole count, by which two roundings may differ."""
STANDS_FOR = {"pressure": "force-balance", "position": "valve-flow"}


def _largest(rows: list[Any]) -> dict[str, Any]:
    """The channel with the largest mean square over its noise, the lift at rest as well."""
    worst, where = 0.0, ""
    for quantity, noise in NOISE.items():
        for lift in LIFTS:
            name = f"{quantity}_{lift}_{'pa' if quantity == 'pressure' else 'm'}"
            squares = [
                np.nanmean(((m[name] - t[name]) / noise) ** 2) for _, m, t in rows if name in m and name in t
            ]
            if squares and np.mean(squares) > worst:
                worst, where = float(np.mean(squares)), quantity
    return NOTHING if worst <= ABOVE else _said(None, STANDS_FOR[where])


def _criterion(rows: list[Any], told: Mapping[str, Any]) -> dict[str, Any]:
    """The hypothesis with the largest promised gain in ln posterior, if more than half of ln n (Schwarz
    1978)."""
    from_screening = [
        one for one in told.get("suspects", ()) if one.get("promised") and one["kind"] != "unknown"
    ]
    count = sum(len(m["time_s"]) for plan, m, _ in rows if plan["role"] == "estimate")
    if not from_screening or not count:
        return NOTHING
    best = max(from_screening, key=lambda one: one["promised"])
    if best["promised"] <= 0.5 * np.log(count):
        return NOTHING
    equation = EQUATIONS.get(best["id"], ("sensor" if best["kind"] == "sensor" else "unknown",))[0]
    return _said(best["id"], equation)


def _library(plan: Mapping[str, Any], m: Mapping[str, Floats], t: Mapping[str, Floats], lift: str) -> Floats:
    """The terms, (samples, terms), from the fitted truck's own signals."""
    other = LIFTS[1 - LIFTS.index(lift)]
    v, x, p = t[f"velocity_{lift}_m_s"], t[f"position_{lift}_m"], t[f"pressure_{lift}_pa"] / 1e7
    u = m[f"current_{lift}_a"]
    degc = np.nan_to_num(m.get("oil_temperature_degc", np.full(len(v), 30.0)), nan=30.0) / 30.0 - 1.0
    a, dp, du = (np.gradient(one) * 50.0 for one in (v, p, u))
    moving = np.tanh(v / 0.02)
    return np.column_stack([
        np.ones_like(v), p, v, v * degc, v * np.abs(v), moving, moving * p, x, moving * x,
        np.full_like(v, plan["entered_kg"] / 1e3), a, du, u, u * degc, dp, dp * degc,
        np.gradient(t[f"velocity_{other}_m_s"]) * 50.0, p * (u < 0.3),
    ])  # fmt: skip


def _regression(rows: list[Any], role: str | None) -> tuple[Floats, Floats, Floats] | None:
    """Residuals of pressure and speed of the commanded lifts, in noise; their library; their recording."""
    targets, terms, places = [], [], []
    for place, (plan, m, t) in enumerate(rows):
        if role and plan["role"] != role:
            continue
        for lift in LIFTS:
            if plan["lift"] not in (lift, "both"):
                continue
            library = _library(plan, m, t, lift)
            residual = (m[f"pressure_{lift}_pa"] - t[f"pressure_{lift}_pa"]) / PRESSURE_NOISE_PA
            drift = _slope(m[f"position_{lift}_m"] - t[f"position_{lift}_m"]) / 0.01
            block = np.zeros((len(residual), library.shape[1]))
            targets += [residual, drift]
            terms += [np.hstack([library, block]), np.hstack([block, library])]
            places += [np.full(len(residual), place)] * 2
    if not targets:
        return None
    y, X, where = np.concatenate(targets), np.concatenate(terms), np.concatenate(places)
    good = np.isfinite(y) & np.isfinite(X).all(axis=1)
    return y[good], X[good], where[good]


def _slope(signal: Floats) -> Floats:
    smooth = np.convolve(np.nan_to_num(signal), np.ones(11) / 11.0, mode="same")
    return np.asarray(np.gradient(smooth) * 50.0)


def _sparse(rows: list[Any]) -> dict[str, Any]:
    """Sequentially thresholded least squares over the whole library; the term with the largest share
    speaks."""
    found = _regression(rows, "estimate")
    if found is None:
        return NOTHING
    y, X, _ = found
    scale = X.std(axis=0) + 1e-12
    Z = X / scale
    keep = np.ones(Z.shape[1], bool)
    weights = np.zeros(Z.shape[1])
    for _ in range(ROUNDS):
        weights[:] = 0.0
        weights[keep] = np.linalg.lstsq(Z[:, keep], y, rcond=None)[0]
        now = np.abs(weights) > THRESHOLD * y.std()
        if (now == keep).all() or not now.any():
            keep = now
            break
        keep = now
    left = y - Z[:, keep] @ weights[keep] if keep.any() else y
    if not keep.any() or 1.0 - left.var() / max(y.var(), 1e-12) < SMALLEST_SHARE:
        return NOTHING
    name = list(TERMS)[int(np.argmax(np.abs(weights * keep))) % len(TERMS)]
    return _said(*TERMS[name])


def _regimes(rows: list[Any]) -> dict[str, Any]:
    """Clean recordings give the noise; where the energy exceeds it, one or two terms that hold out and
    certify."""
    fitted, held = _regression(rows, "estimate"), _regression(rows, "validate")
    if fitted is None or held is None:
        return NOTHING
    y, X, where = fitted
    energy = {int(one): float(np.mean(y[where == one] ** 2)) for one in np.unique(where)}
    floor = min(energy.values())
    flagged = [one for one, value in energy.items() if value > CLEAN * floor]
    if not flagged:
        flagged = list(energy)
    inside = np.isin(where, flagged)
    y, X = y[inside], X[inside]
    y_held, X_held, _ = held
    best = np.inf
    chosen: tuple[int, ...] = ()
    half = len(TERMS)
    for size in (1, 2):
        for terms in combinations(range(half), size):
            columns = [n for term in terms for n in (term, half + term)]
            weights = np.linalg.lstsq(X[:, columns], y, rcond=None)[0]
            left = float(np.mean((y_held - X_held[:, columns] @ weights) ** 2))
            if left < 0.98 * best:
                best, chosen = left, terms
    columns = [n for term in chosen for n in (term, half + term)]
    plain = float(np.mean(y_held**2))
    weights = np.linalg.lstsq(X_held[:, columns], y_held, rcond=None)[0]
    left = float(np.mean((y_held - X_held[:, columns] @ weights) ** 2))
    freedom = max(len(y_held) // 10 - len(columns), 1)  # samples 0.2 s apart count as independent
    ratio = (plain - left) / len(columns) / (left / freedom)
    if f_distribution.sf(ratio, len(columns), freedom) > CERTAIN or 1.0 - best / plain < SMALLEST_SHARE:
        return NOTHING
    return _said(*TERMS[list(TERMS)[chosen[0]]])

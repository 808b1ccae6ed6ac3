"""A linearly implicit method, compiled for the laws that act.

Rodas3 (Sandu et al. 1997, Atmospheric Environment 31: Benchmarking stiff ODE solvers II): four stages, order
three, stiffly accurate and L-stable, with an embedded method of order two that tells the error of a step.
CasADi differentiates the equations and writes the step as C, of which the machine's compiler makes a library;
`advance.c` stands below it. Each recording takes steps of its own length, whatever others stand beside it.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from forklift.ensemble.proof.tools import compiler
from forklift.ensemble.proof.truth import expressions, model

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

GAMMA = 0.5
ORDER = 3
SHRINK, GROW, SAFETY = 0.2, 4.0, 0.85
FLAGS = ("-O2", "-ffp-contract=off", "-fno-math-errno", "-shared", "-fPIC")


class Solver:
    """The step of a plant with certain laws, for any values of its parameters.

    Parameters
    ----------
    laws
        The laws that act.
    k
        Its parameters by name, each over (..., lift, 1, recording) or what broadcasts to it.
    """

    def __init__(self, laws: Sequence[model.Law], k: Mapping[str, Floats]) -> None:
        kinds = tuple((type(law), law.name) for law in laws)
        self._advance = _compiled(kinds, tuple((name, value.shape[:-1]) for name, value in k.items()))
        recordings = max(value.shape[-1] for value in k.values())
        rows = [np.broadcast_to(value, (*value.shape[:-1], recordings)) for value in k.values()]
        self._values = np.ascontiguousarray(np.concatenate([one.reshape(-1, recordings) for one in rows]).T)

    def advance(
        self,
        column: Ints,
        y: Floats,
        u: Floats,
        T: Floats,
        span: Floats,
        h: Floats,
        spent: Ints,
        *,
        tolerance: float,
        shortest: float,
        most: int,
    ) -> None:
        """Take `y` so far as `span` [s] says, in place.

        Parameters
        ----------
        column
            (n,) whose parameters each row has.
        y
            (n, states).
        u, T
            (n, 2) [A] and (n,) [K], constant meanwhile.
        span
            (n,) [s].
        h
            (n,) [s] the step to try first; the next one's afterwards.
        spent
            (n,) steps so far; mended.
        tolerance
            Greatest error of a step, of all states, in their typical sizes.
        shortest
            [s], of a step.
        most
            Steps that may be spent.

        Raises
        ------
        FloatingPointError
            Where a step gets too short, or too many are spent.
        """
        status = self._advance(
            len(column), column, y, u, T, self._values, span, h, spent, tolerance, shortest, most
        )
        if status == 1:
            raise FloatingPointError(f"a step of less than {shortest} s is needed")
        if status == 2:
            raise FloatingPointError(f"more than {most} steps are needed")


@lru_cache(maxsize=64)
def _compiled(
    kinds: tuple[tuple[type[model.Law], str], ...], shapes: tuple[tuple[str, tuple[int, ...]], ...]
) -> Any:
    """The C function of these laws."""
    step = _step([kind(name) for kind, name in kinds], dict(shapes))
    source = casadi.CodeGenerator("step.c", {"casadi_int": "long long int", "with_export": False})
    source.add(step)
    sizes = {
        "SZ_ARG": step.sz_arg(), "SZ_RES": step.sz_res(), "SZ_IW": step.sz_iw() + 1, "SZ_W": step.sz_w() + 1,
        "STATES": step.numel_in(0), "VALUES": step.numel_in(4),
        "SHRINK": SHRINK, "GROW": GROW, "SAFETY": SAFETY, "ORDER": float(ORDER),
    }  # fmt: skip
    defined = "\n".join(f"#define {name} {value!r}" for name, value in sizes.items())
    below = files("forklift.ensemble.proof.truth").joinpath("advance.c").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory(prefix="truth-") as scratch:
        text, made = Path(scratch) / "step.c", Path(scratch) / "step.so"
        text.write_text("\n".join(["#include <math.h>", source.dump(), defined, below]), encoding="utf-8")
        subprocess.run(
            [compiler(), *FLAGS, "-o", made, text, "-lm"], capture_output=True, text=True, check=True
        )
        advance = ctypes.CDLL(str(made)).truth_advance
    floats, ints = (np.ctypeslib.ndpointer(kind, flags="C_CONTIGUOUS") for kind in (np.float64, np.int64))
    whole, number = ctypes.c_longlong, ctypes.c_double
    advance.argtypes = [
        whole, ints, floats, floats, floats, floats, floats, floats, ints, number, number, whole,
    ]  # fmt: skip
    return advance


def _step(laws: Sequence[model.Law], shapes: Mapping[str, tuple[int, ...]]) -> Any:
    """The function (y, h, u, T, k) to (y after the step, its error in typical sizes)."""
    scale = model.scales(laws)
    k = {name: expressions.symbols(f"k{n}", (*shape, 1)) for n, (name, shape) in enumerate(shapes.items())}
    values = casadi.vertcat(*(expressions.column(one) for one in k.values()))
    y, u = expressions.symbols("y", (len(scale), 1, 1)), expressions.symbols("u", (2, 1, 1))
    T, h = expressions.symbols("T", (1, 1)), casadi.SX.sym("h")
    at, sizes = expressions.column(y), casadi.DM(scale)
    equations: Any = model.rates  # of numbers or of expressions
    f = expressions.column(equations(y, u, T, k, laws)) / sizes
    rates = casadi.Function("rates", [at, expressions.column(u), expressions.column(T), values], [f])
    jacobian = casadi.jacobian(f, at) @ casadi.diag(sizes)
    solve = _factored(casadi.SX.eye(len(scale)) / (h * GAMMA) - jacobian)

    def slope(moved: Any) -> Any:
        return rates.call([at + moved * sizes, expressions.column(u), expressions.column(T), values], True)[0]

    k1 = solve(f)
    k2 = solve(f + 4.0 / h * k1)
    k3 = solve(slope(2.0 * k1) + (k1 - k2) / h)
    k4 = solve(slope(2.0 * k1 + k3) + (k1 - k2 - 8.0 / 3.0 * k3) / h)
    after = at + (2.0 * k1 + k3 + k4) * sizes
    given = [at, h, expressions.column(u), expressions.column(T), values]
    return casadi.Function("truth_step", given, casadi.cse([after, k4]))


def _factored(matrix: Any) -> Any:
    """Solves with a sparse matrix: Gauss's elimination in the order of the states, without pivots.

    What dissipates needs none: its matrix has a positive definite symmetric part in coordinates of energy.
    """
    count = matrix.shape[0]
    rows = [{j: matrix[i, j] for j in range(count) if matrix.sparsity().has_nz(i, j)} for i in range(count)]
    lower: list[dict[int, Any]] = [{} for _ in range(count)]
    for pivot in range(count):
        for i in range(pivot + 1, count):
            if pivot in rows[i]:
                factor = lower[i][pivot] = rows[i].pop(pivot) / rows[pivot][pivot]
                for j, value in rows[pivot].items():
                    if j > pivot:
                        rows[i][j] = rows[i].get(j, 0.0) - factor * value

    def solve(right: Any) -> Any:
        x = [right[i] for i in range(count)]
        for i in range(count):
            for j, factor in lower[i].items():
                x[i] = x[i] - factor * x[j]
        for i in reversed(range(count)):
            for j, value in rows[i].items():
                if j > i:
                    x[i] = x[i] - value * x[j]
            x[i] = x[i] / rows[i][i]
        return casadi.vertcat(*x)

    return solve

"""Arrays of CasADi's expressions that answer to NumPy's functions as arrays of numbers do.

The laws and the equations of motion are written with NumPy. Called with these arrays they give one expression
for each result, which CasADi (Andersson et al. 2019, Math. Prog. Comp. 11) differentiates and writes as C.
Only what the plant uses is answered; anything else raises `TypeError`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi
import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

UFUNCS: dict[Any, Callable[..., Any]] = {
    np.add: lambda a, b: a + b,
    np.subtract: lambda a, b: a - b,
    np.multiply: lambda a, b: a * b,
    np.true_divide: lambda a, b: a / b,
    np.power: lambda a, b: a**b,
    np.negative: lambda a: -a,
    np.less: lambda a, b: a < b,
    np.greater: lambda a, b: a > b,
    np.square: lambda a: a * a,
    np.sqrt: casadi.sqrt,
    np.exp: casadi.exp,
    np.expm1: casadi.expm1,
    np.log: casadi.log,
    np.log1p: casadi.log1p,
    np.sin: casadi.sin,
    np.cos: casadi.cos,
    np.tanh: casadi.tanh,
    np.hypot: casadi.hypot,
    np.absolute: casadi.fabs,
    np.sign: casadi.sign,
    np.maximum: casadi.fmax,
    np.minimum: casadi.fmin,
}


class Expressions(NDArrayOperatorsMixin):
    """An array of expressions.

    Attributes
    ----------
    each
        The expressions, scalar `casadi.SX`, in an array of objects.
    """

    def __init__(self, each: Any) -> None:
        self.each = each

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the array."""
        return tuple(self.each.shape)

    def __getitem__(self, place: Any) -> Expressions:
        return Expressions(np.asarray(self.each[place], object))

    def __setitem__(self, place: Any, value: Any) -> None:
        self.each[place] = _objects(value)

    def sum(self, axis: int) -> Expressions:
        """Over an axis."""
        return Expressions(self.each.sum(axis=axis))

    def astype(self, _: type) -> Expressions:
        """Itself: truth is a number here."""
        return self

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__" or options.keys() - {"out"} or ufunc not in UFUNCS:
            return NotImplemented  # a += b: what is returned takes a's place
        return _applied(UFUNCS[ufunc], inputs)

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        answer = FUNCTIONS.get(func)
        return NotImplemented if answer is None else answer(*args, **kwargs)


def symbols(name: str, shape: tuple[int, ...]) -> Expressions:
    """Unknown numbers."""
    made = np.empty(shape, object)
    for place in np.ndindex(shape):
        made[place] = casadi.SX.sym(f"{name}_{'_'.join(map(str, place))}")
    return Expressions(made)


def column(given: Expressions) -> Any:
    """All of an array in a column of CasADi's, the last axis fastest."""
    return casadi.vertcat(*given.each.ravel().tolist())


def _objects(value: Any) -> Any:
    if isinstance(value, Expressions):
        return value.each
    numbers = np.asarray(value, float)
    made = np.empty(numbers.shape, object)
    for place in np.ndindex(numbers.shape):
        made[place] = casadi.SX(float(numbers[place]))
    return made


def _applied(function: Callable[..., Any], inputs: Sequence[Any]) -> Expressions:
    given = np.broadcast_arrays(*map(_objects, inputs))
    made = np.empty(given[0].shape, object)
    for place in np.ndindex(made.shape):
        made[place] = function(*(one[place] for one in given))
    return Expressions(made)


def _where(condition: Any, true: Any, false: Any) -> Expressions:
    return _applied(casadi.if_else, (condition, true, false))


def _clip(a: Any, a_min: Any, a_max: Any) -> Expressions:
    return _applied(lambda x, low, high: casadi.fmin(casadi.fmax(x, low), high), (a, a_min, a_max))


def _stack(arrays: Sequence[Any]) -> Expressions:
    return Expressions(np.stack([_objects(one) for one in arrays]))


def _zeros_like(given: Expressions, shape: tuple[int, ...] | None = None) -> Expressions:
    return Expressions(_objects(np.zeros(given.shape if shape is None else shape)))


def _moveaxis(a: Expressions, source: Any, destination: Any) -> Expressions:
    return Expressions(np.moveaxis(a.each, source, destination))


def _solve(a: Expressions, b: Expressions) -> Expressions:
    """Of matrices in the last two axes."""
    made = np.empty(b.shape, object)
    for place in np.ndindex(b.shape[:-2]):
        matrix = casadi.vertcat(*(casadi.horzcat(*row) for row in a.each[place].tolist()))
        found = casadi.solve(matrix, casadi.vertcat(*b.each[place][:, 0].tolist()))
        for row in range(b.shape[-2]):
            made[(*place, row, 0)] = found[row]
    return Expressions(made)


FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.where: _where,
    np.clip: _clip,
    np.stack: _stack,
    np.empty_like: _zeros_like,
    np.zeros_like: _zeros_like,
    np.moveaxis: _moveaxis,
    np.linalg.solve: _solve,
}

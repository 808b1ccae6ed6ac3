"""A plant through its inputs, in lanes: many simulations side by side, each with parameters of its own.

Runge's method of second order, or Kutta's of fourth, with fixed substeps (Kutta 1901): for machines that are
not stiff. A plant without states is evaluated at all times at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.calls import mistake, named, numbers
from forklift.plant.parts import Values
from forklift.plant.present import Present
from forklift.plant.steady import begun
from forklift.recordings.clocks import GAP_STEPS

Push = Callable[[Floats], Mapping[str, Floats]]
"""Of the times (lanes,): further inputs at ports, (lanes,)."""

USUAL = 0.8
"""Share of a clock's steps that its usual one is no shorter than: where channels' clocks are a little apart,
most steps from any sample to the next may be tiny."""


def run(
    machine: Present,
    time: Floats,
    u: Values,
    start: Values,
    p: Values,
    push: Push | None = None,
    finer: int = 1,
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Outputs and the variables of every moment, each (times, lanes).

    Parameters
    ----------
    time
        (times, lanes) [s]; a lane that has ended stands still.
    u
        Inputs, (times, lanes).
    start
        States at the start, (lanes,); those that are missing are steady with the first sample of the inputs,
        whatever is pushed.
    p
        Parameters, (lanes,) or numbers.
    finer
        By how much shorter the integrator's steps are than the plant has them.

    Raises
    ------
    ForkliftError
        ``"not-finite"``, ``"no-steady-state"``, ``"plant-invalid"`` for a mistake in the plant's functions.
    """
    shape = time.shape
    with np.errstate(all="ignore"):
        if machine.states:
            first = {name: values[0] for name, values in u.items()}
            states = _integrate(machine, time, u, begun(machine, time[0], first, start, p), p, push, finer)
        else:
            states = {}
        pushed = {}
        if push:
            pushed = dict(push(time))
        driven, w, bus, _ = machine.moment(time, states, u, p, machine.own(p), pushed)
        plant = machine.plant.name
        said = named(plant, "out", machine.plant.out, time, states, driven, w, p, bus)
    if missing := [one.name for one in machine.plant.outputs if one.name not in said]:
        raise mistake(plant, "out", f"gives no {missing[0]}; return every output", name=missing[0])
    outputs = {name: numbers(plant, "out", name, values, shape) for name, values in said.items()}
    for name, values in outputs.items():
        if not np.isfinite(values).all():
            row, lane = np.argwhere(~np.isfinite(values))[0]
            at = float(time[row, lane])
            raise ForkliftError(
                "not-finite",
                f"plant {plant}: {name} is {values[row, lane]:g} at {at:g} s; narrow the bounds of its "
                "parameters or states to where its laws hold, or give a shorter max_dt if it is stiff",
                name=name,
                time_s=at,
            )
    seen = {**states, **driven, **{name: value for name, value in bus.items()}}
    return outputs, {name: numbers(plant, "bus", name, value, shape) for name, value in seen.items()}


def _integrate(
    machine: Present, time: Floats, u: Values, start: Values, p: Values, push: Push | None, finer: int
) -> dict[str, Floats]:
    names = [state.name for state in machine.states]
    least = np.array([state.lower for state in machine.states])[:, None]
    most = np.array([state.upper for state in machine.states])[:, None]
    lanes = time.shape[1]
    x = np.array([np.broadcast_to(np.asarray(start[name], float), lanes) for name in names])
    path = np.empty((len(time), len(names), lanes))
    own = machine.own(p)
    held = {one.name for one in machine.plant.inputs if one.hold == "zero"}
    nothing: Mapping[str, Floats] = {}

    def rates(t: Floats, x: Floats, u: Values) -> Floats:
        at = dict(zip(names, x, strict=True))
        return machine.rates(names, t, at, u, p, own, push(t) if push else nothing)

    path[0] = x
    steps = np.diff(time, axis=0)
    substeps = finer * _counts(steps, machine.plant.max_dt)
    for k, step in enumerate(steps):
        count = int(substeps[k])
        h = step / count
        now = {name: values[k] for name, values in u.items()}
        change = {name: values[k + 1] - values[k] for name, values in u.items() if name not in held}
        for one in range(count):
            t = time[k] + one * h

            def at(share: float, now: Values = now, change: Values = change, one: int = one) -> Values:
                if not change:
                    return now
                part = (one + share) / count  # noqa: B023
                return {**now, **{name: now[name] + part * change[name] for name in change}}

            middle = at(0.5)
            a = rates(t, x, at(0.0))
            b = rates(t + 0.5 * h, x + 0.5 * h * a, middle)
            if machine.plant.order == 2:
                x = np.minimum(np.maximum(x + h * b, least), most)
                continue
            c = rates(t + 0.5 * h, x + 0.5 * h * b, middle)
            d = rates(t + h, x + h * c, at(1.0))
            x = np.minimum(np.maximum(x + h / 6.0 * (a + 2.0 * (b + c) + d), least), most)
        path[k + 1] = x
    return {name: path[:, k] for k, name in enumerate(names)}


def _counts(steps: Floats, longest: float) -> NDArray[np.intp]:
    """Into how many parts each of the steps (times, lanes) is cut, so that none is longer than `longest`.

    Where that is infinite, a gap of the clock is cut into steps as long as the lane's usual one.
    """
    if np.isfinite(longest):
        shares = steps.max(axis=1) / longest
    elif steps.max(initial=0.0) <= GAP_STEPS * steps.min(initial=np.inf):
        return np.ones(len(steps), np.intp)
    else:
        fresh = np.r_[True, (steps[:, 1:] != steps[:, :-1]).any(axis=0)]  # lanes of one recording are alike
        own = steps[:, fresh]
        going = np.where(own > 0.0, own, np.nan)  # a lane that has ended stands still
        shares = (own / np.nanquantile(going, USUAL, axis=0, method="higher")).max(axis=1)
        shares[shares <= GAP_STEPS] = 1.0
    counts: NDArray[np.intp] = np.maximum(1, np.ceil(shares - 1e-9)).astype(np.intp)
    return counts

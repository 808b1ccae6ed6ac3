"""Where a plant stands still: starts at which the rates of some states are zero, in lanes.

Newton's method with difference quotients, damped by the natural monotonicity test (Deuflhard 2011): a step is
halved until the next one, with the same Jacobian, would be shorter. A state that its rate presses against an
end of its range rests there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError

if TYPE_CHECKING:
    from forklift.plant.parts import State, Values
    from forklift.plant.present import Present

Rates = Callable[[Floats], Floats]
"""(states, lanes) of states, (states, lanes)."""

STEPS, HALVINGS = 50, 12
"""Most steps of Newton's method, and most halvings of one."""
NUDGE = 1e-7
"""Of the difference quotients, as a share of a state's size."""
CLOSE = 1e-10
"""A step shorter than this share of a state's size is the last."""
SINGULAR = 1e12
"""Condition from which on the rates do not tell where the states rest."""
FACTORS = (1.0, 0.1, 10.0, 0.01, 100.0)
"""How far from the end of a state's range, or from zero, Newton's method starts: times that of the guess."""


def begun(machine: Present, time: Floats, u: Values, start: Values, p: Values) -> dict[str, Floats]:
    """Every state's start, (lanes,): those that `start` lacks are steady at the first moment.

    Parameters
    ----------
    time, u
        (lanes,) of the first moment: time [s] and inputs.

    Raises
    ------
    ForkliftError
        ``"no-steady-state"``.
    """
    lanes = len(time)
    known = {name: np.broadcast_to(np.asarray(at, float), lanes) for name, at in start.items()}
    sought = [state for state in machine.states if state.name not in known]
    if not sought:
        return known
    least, most = (np.array([[getattr(one, end)] for one in sought]) for end in ("lower", "upper"))
    own = machine.own(p)

    def rates(x: Floats) -> Floats:
        at = {**known, **{one.name: row for one, row in zip(sought, x, strict=True)}}
        return machine.rates([one.name for one in sought], time, at, u, p, own, {})

    guess = np.array([[_guess(one)] for one in sought])
    ground = np.where(np.isfinite(least), least, np.where(np.isfinite(most), most, 0.0))
    found, open_ = np.full((len(sought), lanes), np.nan), np.ones(lanes, bool)
    with np.errstate(all="ignore"):
        for factor in FACTORS:
            first = np.clip(ground + factor * (guess - ground), least, most)
            end, done = _newton(rates, np.repeat(first, lanes, axis=1), least, most)
            found[:, open_ & done] = end[:, open_ & done]
            open_ &= ~done
            if not open_.any():
                break
        else:
            raise _none(machine, sought, u, end, rates(end), int(np.flatnonzero(open_)[0]))
    return {**known, **{one.name: row for one, row in zip(sought, found, strict=True)}}


def _guess(state: State) -> float:
    """Where the search starts: as the state has it, amid its range, or next to the end that it has."""
    if state.guess is not None:
        return state.guess
    finite = np.isfinite([state.lower, state.upper])
    if finite.all():
        return 0.5 * (state.lower + state.upper)
    return state.lower + 1.0 if finite[0] else state.upper - 1.0 if finite[1] else 1.0


def _newton(rates: Rates, x: Floats, least: Floats, most: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """(states, lanes) where it ends, and in which lanes that is a steady state."""
    done = np.zeros(x.shape[1], bool)
    lost = np.zeros(x.shape[1], bool)
    for _ in range(STEPS):
        size = np.maximum(np.abs(x), _size(least, most))
        rate = rates(x)
        slope = _slope(rates, x, rate, size, most)
        rests = _rests(x, rate, least, most)
        slope, regular = _without(slope, rests, size)
        lost |= ~(regular & np.isfinite(rate).all(axis=0)) & ~done
        slope[:, :, lost] = np.eye(len(x))[:, :, None]
        step = _solved(slope, np.where(rests, 0.0, -rate))
        step[:, lost | done] = 0.0
        length = _length(step, size)
        done |= (length <= CLOSE) & ~lost
        share = np.where(done | lost, 0.0, 1.0)
        for _ in range(HALVINGS):
            there = np.clip(x + share * step, least, most)
            again = rates(there)
            again = np.where(_rests(there, again, least, most), 0.0, again)
            shorter = _length(_solved(slope, -again), size) <= (1.0 - 0.25 * share) * length
            if (shorter | (share == 0.0)).all():
                break
            share = np.where(shorter, share, 0.5 * share)
        x = np.where(share == 0.0, x, np.clip(x + share * step, least, most))
        if (done | lost).all():
            break
    return x, done


def _size(least: Floats, most: Floats) -> Floats:
    """What is small of a state: against its range, or against one."""
    span = most - least
    return np.where(np.isfinite(span), 1e-3 * span, 1e-3)


def _rests(x: Floats, rate: Floats, least: Floats, most: Floats) -> NDArray[np.bool_]:
    return np.asarray(((x <= least) & (rate <= 0.0)) | ((x >= most) & (rate >= 0.0)))


def _slope(rates: Rates, x: Floats, rate: Floats, size: Floats, most: Floats) -> Floats:
    """(states, along states, lanes) of the rates."""
    slope = np.empty((len(x), *x.shape))
    for k in range(len(x)):
        move = NUDGE * size[k]
        move = np.where(x[k] + move > most[k], -move, move)
        there = x.copy()
        there[k] += move
        slope[:, k] = (rates(there) - rate) / (there[k] - x[k])
    return slope


def _without(slope: Floats, rests: NDArray[np.bool_], size: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """The same for states that do not rest at an end; and in which lanes it tells a step."""
    slope = np.where(rests[:, None] | rests[None, :], 0.0, slope)
    diagonal = np.arange(len(slope))
    slope[diagonal, diagonal] = np.where(rests, 1.0, slope[diagonal, diagonal])
    scaled = slope * size
    scaled = np.nan_to_num(scaled / np.abs(scaled).max(axis=1, keepdims=True))
    return slope, np.asarray(np.linalg.cond(np.moveaxis(scaled, -1, 0)) < SINGULAR)


def _solved(slope: Floats, right: Floats) -> Floats:
    return np.asarray(np.linalg.solve(np.moveaxis(slope, -1, 0), right.T[..., None])[..., 0].T)


def _length(step: Floats, size: Floats) -> Floats:
    return np.asarray(np.abs(step / size).max(axis=0))


def _none(
    machine: Present, sought: Sequence[State], u: Values, x: Floats, rate: Floats, lane: int
) -> ForkliftError:
    worst = int(np.argmax(np.abs(np.nan_to_num(rate[:, lane], nan=np.inf))))
    state, value = sought[worst], float(x[worst, lane])
    driven = ", ".join(f"{name} = {float(np.ravel(column)[lane]):.4g}" for name, column in u.items())
    return ForkliftError(
        "no-steady-state",
        f"plant {machine.plant.name}: state {state.name} finds no steady start with {driven or 'no input'}: "
        f"at {value:.4g} {state.unit} its rate is {float(rate[worst, lane]):.3g} {state.unit}/s, or does not "
        "tell where it rests; give it a guess, bounds, or another start",
        name=state.name,
        value=value,
        rate=float(rate[worst, lane]),
        unit=state.unit,
    )

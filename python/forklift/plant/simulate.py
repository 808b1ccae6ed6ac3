"""A plant run through inputs of one's own, as a rehearsal of what a diagnosis can find."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import ArrayLike

from forklift.base import arguments
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.machine import completed
from forklift.plant.parts import STEADY, Plant, State
from forklift.plant.present import Present
from forklift.plant.recording import Recording
from forklift.plant.run import run


def simulate_plant(
    plant: Plant,
    time_s: ArrayLike,
    u: Mapping[str, ArrayLike],
    values: Mapping[str, float] | None = None,
    present: Collection[str] = (),
) -> dict[str, Floats]:
    """Every output, (times,), without noise and without ends of its range.

    Parameters
    ----------
    plant, time_s, u
        The machine, its times [s] and inputs, (times,) each.
    values
        Parameters that are not as the plant has them; of an effect as ``"effect.parameter"``, of a state's
        start as ``"state.start"``: one that an output tells is by default the state's guess, else the middle
        of its bounds, or of one that has not both the number within them that is nearest to 0.
    present
        Ids of the effects that act.

    Raises
    ------
    ForkliftError
        ``"parameter-unknown"``, ``"recording-invalid"``, ``"channel-unknown"``, ``"not-finite"``,
        ``"no-steady-state"``.
    """
    given = dict(values or {})
    arguments.names(present=present)
    for one in present:
        if one not in {effect.id for effect in plant.effects}:
            raise ForkliftError(
                "parameter-unknown",
                f"plant {plant.name} has no effect {one}; it has "
                f"{', '.join(effect.id for effect in plant.effects) or 'none'}",
                name=one,
            )
    effects = tuple(effect for effect in plant.effects if effect.id in present)
    known = {one.name: one.value for one in plant.params}
    known |= {effect.full(one): one.value for effect in effects for one in effect.params}
    time = np.asarray(time_s, dtype=float)
    driven = {name: np.asarray(column, dtype=float) for name, column in u.items()}
    recording = completed(plant, Recording("simulated", time, driven, {}))
    machine = Present(plant, effects)
    start: dict[str, Floats] = {}
    for state in machine.states:
        name = f"{state.name}.start"
        begin = given.pop(name, state.start)
        if begin == STEADY:
            continue
        if isinstance(begin, str):
            begin = float(recording.u[begin][0]) if begin in recording.u else _guess(state)
        start[state.name] = np.array([begin])
    for name in given:
        if name not in known:
            raise ForkliftError("parameter-unknown", f"plant {plant.name} has no parameter {name}", name=name)
    p = {name: np.array([value]) for name, value in {**known, **given}.items()}
    columns = {name: column[:, None] for name, column in recording.u.items()}
    said, _ = run(machine, recording.time_s[:, None], columns, start, p)
    return {name: np.array(column[:, 0]) for name, column in said.items()}


def _guess(state: State) -> float:
    """Where a state starts that no input tells."""
    if state.guess is not None:
        return float(state.guess)
    middle = 0.5 * (state.lower + state.upper)
    return float(middle if np.isfinite(middle) else np.clip(0.0, state.lower, state.upper))

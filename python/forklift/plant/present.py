"""A plant with the effects that are present."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.plant.calls import mistake, named, no_number
from forklift.plant.parts import Effect, Plant, State, Values


@dataclass(frozen=True)
class Present:
    """A plant with the effects that are present."""

    plant: Plant
    effects: tuple[Effect, ...] = ()

    @property
    def states(self) -> tuple[State, ...]:
        """The plant's and the effects' own."""
        return (*self.plant.states, *(state for effect in self.effects for state in effect.states))

    def moment(
        self, t: Any, x: Values, u: Values, p: Values, own: Sequence[Values], push: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, Any], Mapping[str, Any], dict[str, Any]]:
        """Inputs as they act, what enters at every port, the bus, and the rates of the effects' states."""
        w: dict[str, Any] = {port.name: 0.0 for port in self.plant.ports}
        driven = dict(u)
        for name, value in push.items():
            if name in w:
                w[name] = value
            else:
                driven[name] = driven[name] + value
        plant = self.plant.name
        bus = named(plant, "bus", self.plant.bus, t, x, driven, p)
        rates: dict[str, Any] = {}
        for effect, values in zip(self.effects, own, strict=True):
            mine = {state.name for state in effect.states}
            what = f"term of effect {effect.id}"
            for name, value in named(plant, what, effect.term, x, driven, values, bus).items():
                if name in mine:
                    rates[name] = value
                elif name in w:
                    w[name] = w[name] + value
                elif name in driven:
                    driven[name] = driven[name] + value
                else:
                    raise mistake(
                        plant,
                        what,
                        f"adds to {name}, which is no port, input or state of its own; name one",
                        name=name,
                    )
        return driven, w, bus, rates

    def rates(
        self,
        names: Sequence[str],
        t: Floats,
        x: Values,
        u: Values,
        p: Values,
        own: Sequence[Values],
        push: Mapping[str, Any],
    ) -> Floats:
        """Of these states, (states, lanes).

        Raises
        ------
        ForkliftError
            ``"plant-invalid"`` for a mistake in the plant's functions.
        """
        driven, w, bus, more = self.moment(t, x, u, p, own, push)
        rhs, plant = self.plant.rhs, self.plant.name
        known = {**named(plant, "rhs", rhs, t, x, driven, w, p, bus), **more} if rhs else more
        out = np.empty((len(names), len(t)))
        for row, name in enumerate(names):
            if name not in known:
                raise mistake(plant, "rhs", f"gives no rate of {name}; return one of every state", name=name)
            try:
                out[row] = known[name]
            except (TypeError, ValueError) as error:
                raise no_number(plant, "rhs", name, error) from error
        return out

    def own(self, p: Values) -> list[dict[str, Any]]:
        """Each effect's parameters, by their short names beside the plant's."""
        return [{**p, **{one.name: p[effect.full(one)] for one in effect.params}} for effect in self.effects]

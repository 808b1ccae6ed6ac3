"""A plant with the effects that are present."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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
        bus = self.plant.bus(t, x, driven, p)
        rates: dict[str, Any] = {}
        for effect, values in zip(self.effects, own, strict=True):
            mine = {state.name for state in effect.states}
            for name, value in effect.term(x, driven, values, bus).items():
                if name in mine:
                    rates[name] = value
                elif name in w:
                    w[name] = w[name] + value
                else:
                    driven[name] = driven[name] + value
        return driven, w, bus, rates

    def own(self, p: Values) -> list[dict[str, Any]]:
        """Each effect's parameters, by their short names beside the plant's."""
        return [{**p, **{one.name: p[effect.full(one)] for one in effect.params}} for effect in self.effects]

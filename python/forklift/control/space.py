"""What a tuner searches: a lift's numbers, and load by load what goes beyond the PID.

A reference shaped to the swing's period: Singer & Seering (1990). A predictor: Smith (1957).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from forklift.base.arrays import Floats
from forklift.control.controller import Controller, LiftSettings, Shaper
from forklift.control.feedback import KNOTS, SPACING, pressures_of
from forklift.control.search import Sought
from forklift.recordings.channels import LIFTS, Lift

CURVE_LOADS_KG = (400.0, 800.0, 1200.0, 1600.0)
"""Where the feedback's gain and lead, and the shaper's delay are searched."""
FIRST_IMPULSE = 0.54
"""The shaper's first impulse, 1 / (1 + K), K = exp(-pi zeta / sqrt(1 - zeta^2)) (Singer & Seering 1990, (8)),
of a damping of 0.05: between the 0.09 of a slow and the 0.01 of a fast lowering."""
NUMBERS: dict[Lift, dict[str, Sought]] = {
    "free": {
        "integral": Sought(0.8, 0.2, 0.2, 5.0),
        "proportional": Sought(0.06, 0.02, 0.0, 0.1),
        "derivative": Sought(0.001, 0.002, 0.0, 0.02),
        "overspeed": Sought(2.5, 1.0, 0.0, 12.0),
        "overspeed_from": Sought(586.0, 2.0, 585.0, 620.0),
    },
    "main": {
        "integral": Sought(1.9, 0.2, 1.0, 4.0),
        "proportional": Sought(0.005, 0.005, 0.0, 0.1),
        "derivative": Sought(0.004, 0.001, 0.0, 0.02),
    },
}
"""Beside the greatest order of (4.7), which starts from the controller's. All chosen, after first searches.
More proportional part than a tenth kicks at every count of the encoder, which is 98 mm/s for a tick. The free
lift's `overspeed_from` is so near to the highest request that this is not missed by a hundredth; the main
lift does not overshoot it."""
U_MAX_MM_S = (10.0, 30.0)
"""Width, and how far either way."""
OF_METHOD: dict[str, dict[Lift, dict[str, Sought]]] = {
    "adaptation": {
        "free": {"adaptation_s": Sought(0.03, 0.01, 0.02, 0.5)},
        "main": {"adaptation_s": Sought(0.45, 0.1, 0.2, 20.0)},
    },
    "shaped": {lift: {"early_corner": Sought(20.0, 4.0, 2.0, 25.0)} for lift in LIFTS},
    "swing": {lift: {} for lift in LIFTS},
    "predictor": {
        "free": {"prediction": Sought(0.9, 0.2, 0.0, 1.0)},
        "main": {"prediction": Sought(0.1, 0.1, 0.0, 1.0)},
    },
}
GAIN, LEAD, DELAY = (0.5, 0.0, 8.0), (15.0, -360.0, 360.0), (0.02, 0.0, 0.4)
"""Width and bounds of the feedback's gain [mm/s per bar] and lead [degrees], of the shaper's delay [s]."""


@dataclass(frozen=True)
class Space:
    """What is searched of a lift, and the controllers that it holds.

    Attributes
    ----------
    start
        Whose settings stay where nothing is searched.
    lift
        Whose settings are.
    pressures
        (loads,) Mean pressure [Pa] of each of `CURVE_LOADS_KG`.
    numbers
        The numbers that are searched.
    curves
        ``"delay"`` of the shaper, ``"gain"`` and ``"lead"`` of the feedback: one value at each pressure.
    source
        What a controller says of where its numbers come from.
    """

    start: Controller
    lift: Lift
    pressures: Sequence[float]
    numbers: Mapping[str, Sought]
    curves: Mapping[str, Sequence[Sought]]
    source: str

    @classmethod
    def of(
        cls,
        start: Controller,
        lift: Lift,
        methods: Sequence[str],
        begun: LiftSettings | None,
        places: Sequence[tuple[float, float]],
        source: str,
    ) -> Space:
        """The numbers of the PID and of `methods`, from those of `begun` if there is one.

        Parameters
        ----------
        places
            Of each of `CURVE_LOADS_KG` the mean pressure [Pa] and the frequency of its swing [Hz].
        """
        u_max = getattr(start, lift).numbers["u_max"].value
        numbers = {  # in this order: the draws of a search go by it
            "integral": NUMBERS[lift]["integral"],
            "u_max": Sought(u_max, U_MAX_MM_S[0], u_max - U_MAX_MM_S[1], u_max + U_MAX_MM_S[1]),
            **NUMBERS[lift],
        }
        for method in methods:
            numbers |= OF_METHOD[method][lift]
        if begun is not None:
            numbers = {name: replace(one, start=begun.numbers[name].value) for name, one in numbers.items()}
        pressures = [pressure for pressure, _ in places]
        curves = {}
        if "shaped" in methods:
            delays = np.array([0.5 / frequency for _, frequency in places])
            if begun is not None and begun.shaper is not None:
                delays = _at(pressures, begun.shaper.spacing, begun.shaper.delay_s)
            curves["delay"] = [Sought(float(x), *DELAY) for x in delays]
        if "swing" in methods:
            swing = getattr(start, lift).swing
            gains = _at(pressures, swing.spacing, swing.gain_mm_s_per_bar)
            leads = _at(pressures, swing.spacing, swing.lead_deg)
            curves["gain"] = [Sought(float(x), *GAIN) for x in gains]
            curves["lead"] = [Sought(float(x), *LEAD) for x in leads]
        return cls(start, lift, pressures, numbers, curves, source)

    @property
    def sought(self) -> list[Sought]:
        """The numbers, and behind them the curves."""
        return [*self.numbers.values(), *(one for curve in self.curves.values() for one in curve)]

    def controller(self, values: Floats) -> Controller:
        """The controller of these values of `sought`, as few digits as a file holds."""
        numbers, *rest = np.split(
            values, np.cumsum([len(self.numbers), *map(len, self.curves.values())])[:-1]
        )
        curves = dict(zip(self.curves, rest, strict=True))
        rounded = {name: float(f"{x:.4g}") for name, x in zip(self.numbers, numbers, strict=True)}
        found = self.start.with_numbers(self.lift, self.source, **rounded)
        if "delay" in curves:
            shaper = Shaper(
                spacing=SPACING,
                delay_s=self._rounded(curves["delay"], 4),
                share=[FIRST_IMPULSE] * KNOTS,
                source=self.source,
            )
            found = found.with_shaper(self.lift, shaper)
        if "gain" in curves:
            update = {
                "gain_mm_s_per_bar": self._rounded(curves["gain"], 2),
                "lead_deg": self._rounded(curves["lead"], 1),
                "source": self.source,
            }
            swing = getattr(self.start, self.lift).swing
            found = found.with_swing(self.lift, swing.model_copy(update=update))
        return found

    def _rounded(self, curve: Floats, digits: int) -> list[float]:
        """A curve over the loads' pressures at a table's knots."""
        knots = pressures_of(SPACING, KNOTS)
        return [round(float(x), digits) for x in np.interp(knots, self.pressures, curve)]


def _at(pressures: Sequence[float], spacing: int, table: Sequence[float]) -> Floats:
    """A table over the pressure at these pressures [Pa]."""
    found: Floats = np.interp(pressures, pressures_of(spacing, len(table)), table)
    return found

"""What a controller that is tuned goes through: trucks of a make, loads, oil temperatures, delays, signals.

Source: Fri & Fahlén (2017), sections 4.4.1 and 4.5.1, (4.4): the NRMSE, here with penalties on swing and
overspeed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.control.closed_loop import (
    DELAY_TICKS,
    LOADS_KG,
    SIGNALS,
    STEADY,
    TEMPERATURES_DEGC,
    TICK_S,
    TOP,
    Integers,
    Lowering,
    lower,
    requests,
)
from forklift.control.controller import Controller
from forklift.control.metrics import nrmse_percent, plateaus
from forklift.control.transition import LEVELS_MM_S, transitions
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import LIFTS, Lift

FACTORS = (0.8, 1.2)
"""Of a load: the controller is not told it."""
DELAYS = (-1, 1)
"""What is tuned has to bear a tick more or less."""
TRUCKS = 6
"""Scattered ones beside the truck itself."""
TOP_TRUCKS = 30
"""As many, those among them, lower at the highest speed without load: what comes near the limit is rare."""
SPREADS = {
    "viscosity.nu_0": 0.15,
    "viscosity.lambda": 0.1,
    "volume.V": 0.1,
    "mass.moving": 0.05,
    "bulk.a_1": 0.1,
    "bulk.a_2": 0.1,
    "friction.F_pr": 0.2,
    "friction.c_v": 0.2,
    "friction.f_cfr": 0.2,
    "valve.omega": 0.1,
    "valve.f_hs": 0.2,
    "valve.C_D": 0.03,
}
"""Standard deviations of the logarithm of a lift's parameters. Chosen: a truck of the same make, with another
oil and other seals."""
SUBSTEPS = 2
"""Of a tick, while one searches."""

SWING_FLOOR_M_S = 0.01
"""Less swing than a share of this is not asked for: a count of the encoder in a fifth of a second."""
SHARE = 0.28
"""Of the swing of the controller one starts from: below a third, which is asked for."""
TOP_M_S = 0.597
"""The mean speed of a plateau at the highest speed, 3 mm/s below the limit of section 1.1."""
BETTER_PERCENT = 0.2
"""By this much the NRMSE has to be above that of the controllers it is measured against."""
TRANSITION_M_S, TRANSITION_WEIGHT = 2e-3, 2000.0
"""By so much the dip and the spike of a transition between the lifts have to be smaller than with the
controller in use, and what a m/s more costs. Chosen."""
WORST_WEIGHT, WORSE_WEIGHT, MEAN_WEIGHT = 30.0, 30.0, 15.0
"""Of the worst swing, of the mean of the worst eighth, and of the mean, each over the other controller's."""
ERROR_PERCENT, ERROR_WEIGHT = 0.9, 10.0
"""A steady speed that misses by more, in the mean of a point's members, costs by so much a percent. One per
cent is asked for (section 4.4); the weight is chosen."""
NRMSE_WEIGHT, ENOUGH_WEIGHT, ENOUGH_PERCENT, TOP_WEIGHT = 10.0, 0.5, 1.0, 5000.0
"""Of a percent of NRMSE that is missing, of one that is won up to `ENOUGH_PERCENT`, of a m/s above `TOP_M_S`.
All chosen."""
POINT_WEIGHT = {0.0: 0.3, 800.0: 1.5, 1500.0: 1.0}
"""Of a load. Without one a plateau's end is drift, hardly a swing. Chosen."""


def scattered(truck: Truck, count: int, seed: int) -> list[Truck]:
    """Trucks of the same make: parameters drawn by `SPREADS`, within their bounds."""
    random = np.random.default_rng(seed)
    names = [f"{lift}.{name}" for lift in LIFTS for name in SPREADS]
    spreads = np.tile(list(SPREADS.values()), len(LIFTS))
    limits = [(parameters()[name]["lower"], parameters()[name]["upper"]) for name in names]
    found = []
    for _ in range(count):
        factors = np.exp(spreads * random.standard_normal(len(names))).tolist()
        found.append(
            truck.with_values(
                {
                    name: min(max(truck.values[name] * factor, lower), upper)
                    for name, factor, (lower, upper) in zip(names, factors, limits, strict=True)
                }
            )
        )
    return found


@dataclass(frozen=True, eq=False)
class Scores:
    """Of controllers (first axis) and members (second axis)."""

    swing_m_s: Floats
    error_percent: Floats
    """Of the steady speed, on a plateau of six seconds and more."""
    nrmse_percent: Floats
    top_m_s: Floats
    """(controllers,) Of all trucks."""
    transition_m_s: Floats
    """(controllers, transitions, 2) Dips and spikes."""


Member = tuple[tuple[float, float], Truck, float, int]
"""The point of oil temperature and load that it belongs to, its truck, its own load and delay."""


class Trial:
    """What every candidate goes through, and what it costs beside the controllers `against`.

    They give the first one's swing, the best NRMSE of all, and the last one's transition, if it counts.
    """

    def __init__(
        self,
        truck: Truck,
        lift: Lift,
        delay: int,
        seed: int,
        against: Sequence[Controller],
        transition: bool = True,
    ) -> None:
        self.truck, self.lift, self.seed, self.transition = truck, lift, seed, transition
        self.later = delay - DELAY_TICKS[lift]
        self.points = [(t, load) for t in TEMPERATURES_DEGC for load in LOADS_KG]
        self.members = [
            (point, one, point[1] * factor, max(0, delay + later))
            for point in self.points
            for one in (truck, *scattered(truck, TRUCKS, seed))
            for factor in (FACTORS if point[1] else (1.0,))
            for later in DELAYS
        ]
        self.unladen = [
            ((t, 0.0), one, 0.0, delay)
            for t in TEMPERATURES_DEGC
            for one in (truck, *scattered(truck, TOP_TRUCKS, seed))
        ]
        self.against = self.scores(against)

    def scores(self, controllers: Sequence[Controller]) -> Scores:
        """What each does with every member."""
        shape = (len(controllers), len(self.members))
        nrmse, swing = [], []
        for signal in SIGNALS:
            speeds, references, request = self._lowered(controllers, signal, self.members)
            pairs = zip(references, speeds, strict=True)
            nrmse.append(np.reshape([nrmse_percent(*pair) for pair in pairs], shape))
            ends = [plateaus(request, speed, TICK_S) for speed in speeds]
            swing.append(np.reshape([max(p.oscillation_m_s for p in one) for one in ends], shape))
        speeds, _, request = self._lowered(controllers, STEADY, self.members)
        error = [abs(plateaus(request, speed, TICK_S)[0].error_percent) for speed in speeds]
        speeds, _, request = self._lowered(controllers, TOP, self.unladen)
        top = [max(p.mean_m_s for p in plateaus(request, speed, TICK_S)) for speed in speeds]
        rows = []
        if self.transition:
            rows = transitions(controllers, self.truck, later_ticks=self.later, seed=self.seed)
        # Speed by speed, of each the controllers in turn.
        jumps = np.reshape(
            [(r.dip_m_s, r.spike_m_s) for r in rows],
            (len(LEVELS_MM_S), len(controllers), len(rows) // (len(LEVELS_MM_S) * len(controllers)), 2),
        )
        return Scores(
            np.nan_to_num(np.max(swing, axis=0), nan=1e3),
            np.nan_to_num(np.reshape(error, shape), nan=1e3),
            np.nan_to_num(np.mean(nrmse, axis=0), nan=-1e3),
            np.nan_to_num(np.reshape(top, (len(controllers), -1)).max(axis=1), nan=1e3),
            np.nan_to_num(np.concatenate(list(jumps), axis=1), nan=1e3),
        )

    def cost(self, controllers: Sequence[Controller]) -> Floats:
        """(controllers,) What is to be small."""
        own, other = self.scores(controllers), self.against
        cost: Floats = TOP_WEIGHT * np.maximum(own.top_m_s - TOP_M_S, 0.0)
        if self.transition:
            excess = own.transition_m_s - (other.transition_m_s[-1] - TRANSITION_M_S)
            cost += TRANSITION_WEIGHT * np.maximum(excess, 0.0).sum(axis=(1, 2))
        for point in self.points:
            use = np.array([k for k, member in enumerate(self.members) if member[0] == point])
            allowed = np.maximum(other.swing_m_s[0, use], SWING_FLOOR_M_S)
            swing = own.swing_m_s[:, use]
            few = max(2, len(use) // 8)
            worst = swing.max(axis=1) / allowed.max()
            worse = np.sort(swing, axis=1)[:, -few:].mean(axis=1) / np.sort(allowed)[-few:].mean()
            missed = own.error_percent[:, use].mean(axis=1)
            better = own.nrmse_percent[:, use].mean(axis=1) - other.nrmse_percent[:, use].mean(axis=1).max()
            cost += POINT_WEIGHT[point[1]] * (
                WORST_WEIGHT * np.maximum(worst - SHARE, 0.0)
                + WORSE_WEIGHT * np.maximum(worse - SHARE, 0.0)
                + MEAN_WEIGHT * (swing / allowed).mean(axis=1)
            )
            cost += NRMSE_WEIGHT * np.maximum(BETTER_PERCENT - better, 0.0)
            cost += ERROR_WEIGHT * np.maximum(missed - ERROR_PERCENT, 0.0)
            cost -= ENOUGH_WEIGHT * np.minimum(better, ENOUGH_PERCENT)
        return cost

    def _lowered(
        self, controllers: Sequence[Controller], signal: int, members: Sequence[Member]
    ) -> tuple[Floats, Floats, Integers]:
        request = requests(self.lift, signal)
        lowerings = [
            Lowering(one, controller, load, t, request, delay_ticks=delay, stream=k)
            for controller in (c.only(self.lift) for c in controllers)
            for k, ((t, _), one, load, delay) in enumerate(members)
        ]
        run = lower(lowerings, lifts=self.lift, seed=self.seed + signal, substeps=SUBSTEPS)
        return run.speed_m_s[self.lift], run.reference_m_s[self.lift], request

"""Estimate at steady state: the area table and what acts with it, from plateaus of constant lowering.

Source: Fri & Fahlén (2017), section 3.6.1: the mechanics are left out, measured pressure, current and oil
temperature are the inputs, and Q = ½ A_c dx_G/dt, (3.38), is the output.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.forklift.geometry import FORKS_PER_CYLINDER
from forklift.plant.forklift.plateaus import Plateau, arrays, plateaus
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.campaign import Campaign, campaign_of
from forklift.recordings.channels import LIFTS, Lift

if TYPE_CHECKING:
    import polars as pl


SCALARS = ("valve.f_hs", "valve.Re_cr", "compensator.C_D", "compensator.Re_cr", "compensator.theta")
"""What is estimated beside the table; the column "Source" of Tables 5.1 and 5.2 says "Steady"."""

PRIOR = {
    "valve.f_hs": 0.5,
    "valve.Re_cr": 0.5,
    "compensator.C_D": 0.2,
    "compensator.Re_cr": 0.5,
    "compensator.theta": 0.5,
}
"""Standard deviations of the logarithms of the truck's values, before anything is measured: chosen, wide."""
PRIOR_AREA = 0.3
"""Of the logarithm by which the area rises from one knot to the next: chosen."""
PRIOR_SHIFT_A = 0.1
"""Of a current [A] by which the whole table is shifted: chosen, five half widths of the hysteresis."""
PRIOR_KNOT_A = 0.015
"""Of each inner knot's own current [A]: chosen; where a curve is knotted matters little."""

ODD = 3.0
"""Beyond this many standard errors a plateau pulls no harder (Huber 1964)."""
MORE_STARTS = 5
"""Random starts beside the truck's values: a table's kinks make minima of their own."""
TOLD = 0.5
"""The plateaus tell a value if they at least halve the standard deviation that it has before them."""
WARMER_K = 10.0
"""Temperatures closer than this [K] tell nothing of what only the viscosity shows: chosen."""


@dataclass(frozen=True)
class Estimate:
    """One value that was estimated."""

    name: str
    unit: str
    before: float
    """The truck's."""
    value: float
    standard_error: float
    """With the prior: of a value that the plateaus do not tell, the prior's own. Of a knot's area, that of
    the opening at the knot's current: the knot itself may lie elsewhere on the same curve."""
    told: Literal["alone", "together", "no"]
    """Whether the plateaus tell the value, tell it only together with another, or leave it where it was."""
    together_with: str | None = None


@dataclass(frozen=True)
class Fitted:
    """A plateau beside the estimated truck."""

    plateau: Plateau
    velocity_m_s: float
    """Of the forks, by the estimated truck [m/s]."""
    residual: float
    """Measured less fitted, in standard errors."""

    @property
    def odd(self) -> bool:
        """Whether it was held to be an outlier and its pull limited."""
        return abs(self.residual) > ODD


@dataclass(frozen=True, eq=False, repr=False)
class SteadyState:
    """What `steady_state` gives.

    Attributes
    ----------
    campaign, campaign_sha256
        What was measured.
    before
        The truck that was started from.
    truck
        The truck with the estimates put in; its sources say so.
    plateaus
        Every plateau, measured and fitted.
    estimates
        By full parameter name; knots carry their number, ``"free.valve.table_area.3"``.
    scatter
        By lift, how many times their standard errors the residuals spread; 1 if the model is right. It is
        contained in the standard errors where it exceeds 1.
    cannot_tell
        Sentences on what these plateaus cannot tell.
    """

    campaign: str
    campaign_sha256: str
    before: Truck
    truck: Truck
    plateaus: tuple[Fitted, ...]
    estimates: Mapping[str, Estimate]
    scatter: Mapping[Lift, float]
    cannot_tell: tuple[str, ...]

    @cached_property
    def rms_m_s(self) -> float:
        """Root mean square of measured less fitted fork velocity [m/s], odd plateaus left out."""
        kept = [fitted for fitted in self.plateaus if not fitted.odd]
        off = [fitted.plateau.velocity_m_s - fitted.velocity_m_s for fitted in kept or self.plateaus]
        return float(np.sqrt(np.mean(np.square(off))))

    def to_polars(self) -> pl.DataFrame:
        """The plateaus, a row each."""
        import polars as pl

        return pl.DataFrame(
            [
                vars(fitted.plateau)
                | {"fitted_m_s": fitted.velocity_m_s, "residual": fitted.residual, "odd": fitted.odd}
                for fitted in self.plateaus
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        """All of it as plain data, for JSON."""
        return {
            "campaign": self.campaign,
            "campaign_sha256": self.campaign_sha256,
            "truck_before_sha256": self.before.sha256,
            "truck_sha256": self.truck.sha256,
            "rms_m_s": self.rms_m_s,
            "scatter": dict(self.scatter),
            "estimates": {
                name: {key: value for key, value in vars(found).items() if key != "name"}
                for name, found in self.estimates.items()
            },
            "plateaus": self.to_polars().to_dicts(),
            "cannot_tell": list(self.cannot_tell),
        }

    def __repr__(self) -> str:
        return (
            f"SteadyState({self.campaign!r}, {len(self.plateaus)} plateaus, {len(self.estimates)} values, "
            f"{1e3 * self.rms_m_s:.2g} mm/s off)"
        )

    def __str__(self) -> str:
        rows = [
            f"{'value':<30} {'before':>11} {'estimated':>11} {'std. error':>11}  told",
            *(
                f"{found.name:<30} {found.before:>11.5g} {found.value:>11.5g} {found.standard_error:>11.2g}  "
                + (f"with {found.together_with}" if found.told == "together" else found.told)
                for found in self.estimates.values()
            ),
            "",
            f"{len(self.plateaus)} plateaus; measured and fitted differ by {1e3 * self.rms_m_s:.2g} mm/s.",
        ]
        return "\n".join([*rows, *self.cannot_tell])


def steady_state(
    campaign: Campaign | str | Path, truck: Truck | str | Path, *, lift: Lift | None = None
) -> SteadyState:
    """Estimate what acts at steady state from a campaign's plateaus, for one lift or each that has some.

    The velocity of each plateau (`forklift.plant.forklift.plateaus.plateaus`) is compared with the steady
    state of the core's own equations at the plateau's current, branch of hysteresis, pressure p_A and oil
    temperature (Fri & Fahlén 2017, section 3.6.1). Estimated are the currents and areas of the table's knots,
    which stay in order (the first knot, and knots within the dead zone, keep their areas), the half width of
    the hysteresis, both critical Reynolds numbers, and the compensator's discharge coefficient and jet angle.
    Each has a weak log-normal prior around the truck's value, so that what the plateaus do not tell stays
    there; what that is, is said. Minimised is the sum of Huber's losses over exact derivatives.

    Parameters
    ----------
    campaign
        Its recordings to be estimated on; those to be validated on are not looked at.
    truck
        What is not estimated, where to start, and around what the priors lie.
    lift
        ``"free"`` or ``"main"``; by default each lift that has plateaus.

    Raises
    ------
    ForkliftError
        ``"plateaus-missing"`` if no recording holds one, ``"argument-invalid"`` for another lift, and what
        `forklift.plant.forklift.simulate.predict` raises.
    """
    campaign, truck = campaign_of(campaign), truck_of(truck)
    if lift is not None and lift not in LIFTS:
        raise ForkliftError("argument-invalid", f"there is no lift {lift!r}; take free or main", name="lift")
    estimates: dict[str, Estimate] = {}
    fitted: list[Fitted] = []
    sentences: list[str] = []
    scatter: dict[Lift, float] = {}
    made = truck
    for which in LIFTS if lift is None else (lift,):
        found = _plateaus(campaign, truck, which)
        if not found:
            continue
        fit = _Fit(truck, which, found)
        fit.solve()
        # The commands bend the estimated hysteresis by other shares than the truck's.
        found = _plateaus(campaign, made.with_values(fit.values()), which)
        fit = _Fit(truck, which, found, fit.at)
        fit.solve()
        source = f"estimated at steady state from {campaign.name} ({len(found)} plateaus)"
        made = made.with_values(fit.values(), source=source)
        estimates |= fit.estimates()
        fitted += fit.fitted()
        sentences += fit.sentences()
        scatter[which] = fit.scatter
    if not fitted:
        raise ForkliftError(
            "plateaus-missing",
            f"campaign {campaign.name!r} holds no stretch of steady lowering"
            + (f" of the {lift} lift" if lift else "")
            + "; record a staircase: constant currents held for two seconds each, with pressure, oil "
            "temperature and position",
            name=campaign.name,
            lift=lift,
        )
    return SteadyState(
        campaign.name, campaign.sha256, truck, made, tuple(fitted), estimates, scatter, tuple(sentences)
    )


def _plateaus(campaign: Campaign, truck: Truck, lift: Lift) -> tuple[Plateau, ...]:
    return tuple(found for recording in campaign.estimate for found in plateaus(recording, truck, lift))


class _Fit:
    """One lift's estimation. Unknowns are in standard deviations of their priors, zero at the truck's values.

    They are: the logarithms of `SCALARS`, those of the area's rises, a shift of the table, and each inner
    knot's own shift.
    """

    def __init__(
        self, truck: Truck, lift: Lift, found: tuple[Plateau, ...], at: Floats | None = None
    ) -> None:
        self.truck, self.lift, self.found = truck, lift, found
        self.current = np.array(truck.values[f"{lift}.valve.table_current"])
        self.area = np.array(truck.values[f"{lift}.valve.table_area"])
        self.scalar = np.array([truck.values[f"{lift}.{name}"] for name in SCALARS], np.float64)
        self.rises = np.flatnonzero(np.diff(self.area) > 0.0) + 1
        """Knots whose area exceeds the one before."""
        knots = len(self.current)
        first = 0 if self.area[0] != self.area[1] else 1
        self.shifted = np.arange(first, knots)
        self.inner = np.arange(max(first, 1), knots - 1)
        self.prior = np.array([PRIOR[name] for name in SCALARS])
        self.at = np.zeros(len(SCALARS) + len(self.rises) + 1 + len(self.inner)) if at is None else at
        self.velocity, self.error = arrays(found, "velocity_m_s", "standard_error_m_s")
        self.scatter = 1.0
        self.names = (
            [f"{lift}.{name}" for name in SCALARS]
            + [f"{lift}.valve.table_current.{k}" for k in self.shifted]
            + [f"{lift}.valve.table_area.{k}" for k in self.rises[0] + np.arange(knots - self.rises[0])]
        )
        """What is estimated, and so the directions of derivatives."""

    def parts(self, at: Floats) -> tuple[Floats, Floats, float, Floats]:
        """The unknowns by kind."""
        a, b = len(SCALARS), len(SCALARS) + len(self.rises)
        return at[:a], at[a:b], float(at[b]), at[b + 1 :]

    def bounds(self) -> tuple[Floats, Floats]:
        """Of the unknowns: within the parameters' bounds, and knots in order."""
        lower, upper = np.full(len(self.at), -8.0), np.full(len(self.at), 8.0)
        for k, name in enumerate(SCALARS):
            spec = parameters()[f"{self.lift}.{name}"]
            if self.scalar[k] > 0.0:
                room = np.log(np.array([max(spec["lower"], 1e-12), spec["upper"]]) / self.scalar[k])
                lower[k], upper[k] = np.clip(room / self.prior[k], -8.0, 8.0)
        gaps = np.diff(self.current)
        shift = len(SCALARS) + len(self.rises)
        spec = parameters()[f"{self.lift}.valve.table_current"]
        free = gaps[self.shifted[0] - 1] / 2.0 if self.shifted[0] else self.current[0] - spec["lower"]
        lower[shift] = max(-8.0, -0.9 * free / PRIOR_SHIFT_A)
        upper[shift] = min(8.0, 0.9 * (spec["upper"] - self.current[-1]) / PRIOR_SHIFT_A)
        for place, knot in enumerate(self.inner.tolist(), start=shift + 1):
            room = 0.45 * min(gaps[knot - 1], gaps[knot]) / PRIOR_KNOT_A
            lower[place], upper[place] = max(-8.0, -room), min(8.0, room)
        # The start lies inside.
        return np.minimum(lower, -1e-9), np.maximum(upper, 1e-9)

    def table(self, at: Floats) -> tuple[Floats, Floats]:
        """Currents and areas of all knots."""
        _, rises, shift, own = self.parts(at)
        current = self.current.copy()
        current[self.shifted] += PRIOR_SHIFT_A * shift
        current[self.inner] += PRIOR_KNOT_A * own
        steps = np.diff(self.area, prepend=0.0)
        steps[self.rises] *= np.exp(PRIOR_AREA * rises)
        most = parameters()[f"{self.lift}.valve.table_area"]["upper"]
        return current, np.minimum(np.cumsum(steps), most)

    def values(self, at: Floats | None = None) -> dict[str, float | tuple[float, ...]]:
        """The truck's values at the unknowns."""
        at = self.at if at is None else at
        current, area = self.table(at)
        scalars = self.scalar * np.exp(self.prior * self.parts(at)[0])
        values: dict[str, float | tuple[float, ...]] = {
            f"{self.lift}.valve.table_current": tuple(current.tolist()),
            f"{self.lift}.valve.table_area": tuple(area.tolist()),
        }
        for name, value in zip(SCALARS, scalars, strict=True):
            spec = parameters()[f"{self.lift}.{name}"]
            values[f"{self.lift}.{name}"] = min(max(float(value), spec["lower"]), spec["upper"])
        return values

    def slopes(self, at: Floats) -> Floats:
        """(names, unknowns) derivatives of the values along the unknowns."""
        _, rises, _, _ = self.parts(at)
        a, b = len(SCALARS), len(SCALARS) + len(self.rises)
        d = np.zeros((len(self.names), len(at)))
        d[:a, :a] = np.diag(self.scalar * np.exp(self.prior * at[:a]) * self.prior)
        d[a : a + len(self.shifted), b] = PRIOR_SHIFT_A
        for place, k in enumerate(self.inner, start=b + 1):
            d[a + k - self.shifted[0], place] = PRIOR_KNOT_A
        areas = a + len(self.shifted)
        for place, (k, rise) in enumerate(zip(self.rises, rises, strict=True), start=a):
            step = (self.area[k] - self.area[k - 1]) * np.exp(PRIOR_AREA * rise)
            d[areas + k - self.rises[0] :, place] = PRIOR_AREA * step
        return d

    def model(self, at: Floats) -> tuple[Floats, Floats]:
        """Fork velocities (n,) [m/s] and their derivatives (n, unknowns)."""
        core = self.truck.with_values(self.values(at)).core
        inputs = arrays(
            self.found, "current_a", "hysteresis_direction", "pressure_pa", "oil_temperature_degc"
        )
        (rate,) = arrays(self.found, "pressure_rate_pa_s")
        v, slopes = core.steady_velocity(self.lift, *inputs, pressure_rate=rate, directions=self.names)
        return FORKS_PER_CYLINDER * v, FORKS_PER_CYLINDER * slopes @ self.slopes(at)

    def solve(self) -> None:
        """From several starts unless given one; then again, with the scatter that this left."""
        from scipy.optimize import least_squares

        kept: dict[bytes, tuple[Floats, Floats]] = {}

        def at(x: Floats) -> tuple[Floats, Floats]:
            if x.tobytes() not in kept:
                kept.clear()
                kept[x.tobytes()] = self.model(x)
            return kept[x.tobytes()]

        for again in (False, True):
            error = self.error * self.scatter

            def off(x: Floats, error: Floats = error) -> Floats:
                return np.concatenate([(at(x)[0] - self.velocity) / error, x])

            def jacobian(x: Floats, error: Floats = error) -> Floats:
                return np.vstack([at(x)[1] / error[:, None], np.eye(len(x))])

            lower, upper = self.bounds()
            random = np.random.default_rng(0).standard_normal((MORE_STARTS, len(self.at)))
            tries = []
            for start in (self.at,) if again or self.at.any() else (self.at, *random):
                inside = np.clip(start, lower + 1e-10, upper - 1e-10)
                tries.append(
                    least_squares(off, inside, jacobian, bounds=(lower, upper), loss="huber", f_scale=ODD)
                )
            self.at = min(tries, key=lambda found: float(found.cost)).x
            # Of residuals of unit variance the median size is 0.6745 (Hampel 1974).
            n = len(self.found)
            told = self._told(error)
            spread = float(np.median(np.abs(off(self.at)[:n]))) / 0.6745
            self.scatter *= max(1.0, spread * (n / max(n - told, 0.25 * n)) ** 0.5)
        self.jacobian = jacobian(self.at)[:n] / (self.scatter * self.error / error)[:, None]

    def _told(self, error: Floats) -> float:
        """How many unknowns the plateaus settle: the trace of the hat matrix."""
        j = self.model(self.at)[1] / error[:, None]
        information = j.T @ j
        return float(np.trace(np.linalg.solve(information + np.eye(len(self.at)), information)))

    def fitted(self) -> list[Fitted]:
        """The plateaus beside the estimated truck."""
        v = self.model(self.at)[0]
        residual = (self.velocity - v) / (self.error * self.scatter)
        rows = zip(self.found, v.tolist(), residual.tolist(), strict=True)
        return [Fitted(plateau, velocity, off) for plateau, velocity, off in rows]

    @cached_property
    def covariance(self) -> Floats:
        """Of the unknowns, with their priors; an odd plateau weighs as little as it pulled."""
        residual = np.abs([fitted.residual for fitted in self.fitted()])
        weight = np.minimum(1.0, ODD / np.maximum(residual, 1e-12))
        information = (self.jacobian * weight[:, None]).T @ self.jacobian
        return cast(Floats, np.linalg.inv(information + np.eye(len(self.at))))

    def estimates(self) -> dict[str, Estimate]:
        """Every value with its standard error and what the plateaus have to do with it."""
        slopes = self.slopes(self.at)
        self._along_the_curve(slopes)
        covariance = slopes @ self.covariance @ slopes.T
        prior = slopes @ slopes.T
        error, before = np.sqrt(np.diag(covariance)), np.sqrt(np.diag(prior))
        scale = np.where(error > 0.0, error, 1.0)
        correlation = np.abs(covariance / np.outer(scale, scale))
        np.fill_diagonal(correlation, 0.0)
        # What is left of an unknown's spread if all others are held.
        held = 1.0 / np.sqrt(np.diag(np.linalg.inv(self.covariance)))
        made = self.truck.with_values(self.values())
        estimates = {}
        for k, name in enumerate(self.names):
            told: Literal["alone", "together", "no"] = "alone" if error[k] < TOLD * before[k] else "no"
            partner = None
            if told == "no" and k < len(SCALARS) and held[k] < TOLD:
                told, partner = "together", self.names[int(np.argmax(correlation[k]))]
            table, _, knot = name.rpartition(".")
            whole = name in made.values
            if table.endswith("table_current"):
                # A knot moved along the curve is the same curve.
                told = "alone" if error[k] < TOLD * PRIOR_KNOT_A else "together"
                partner = None if told == "alone" else f"{self.lift}.valve.table_area.{knot}"
            spec = parameters()[name if whole else table]
            old, new = (
                np.atleast_1d(found.values[name if whole else table])[0 if whole else int(knot)]
                for found in (self.truck, made)
            )
            estimates[name] = Estimate(
                name, spec["unit"], float(old), float(new), float(error[k]), told, partner
            )
        return estimates

    def _along_the_curve(self, slopes: Floats) -> None:
        """Turns the slopes of the knots' areas into those of the curve at the knots' present currents."""
        current, area = self.table(self.at)
        steep = np.diff(area) / np.diff(current)
        steep = (np.append(steep, steep[-1]) + np.append(steep[0], steep)) / 2.0
        first = len(SCALARS) + len(self.shifted)
        for row, k in enumerate(range(self.rises[0], len(current)), start=first):
            slopes[row] -= steep[k] * slopes[len(SCALARS) + k - self.shifted[0]]

    def sentences(self) -> list[str]:
        """What these plateaus cannot tell, and what would."""
        estimates, lift = self.estimates(), self.lift
        current, temperature, direction = arrays(
            self.found, "current_a", "oil_temperature_degc", "hysteresis_direction"
        )
        sentences = []
        cold, warm = temperature.min(), temperature.max()
        if warm - cold < WARMER_K:
            sentences.append(
                f"The {lift} lift's plateaus lie between {cold:.0f} and {warm:.0f} degC: critical Reynolds "
                "numbers act through the viscosity, and opening and viscosity are told apart only by oil of "
                "another temperature."
            )
        if direction.min() > 0.0 or direction.max() < 0.0:
            branch = "rose" if direction.min() > 0.0 else "fell"
            sentences.append(
                f"The {lift} lift's current always {branch} before a plateau: the hysteresis and a shift of "
                "the table's currents are told only together; steps in the other direction part them."
            )
        for found in list(estimates.values())[: len(SCALARS)]:
            if found.told == "together":
                sentences.append(f"{found.name} is told only together with {found.together_with}.")
        silent = [name for name in self.names[: len(SCALARS)] if estimates[name].told == "no"]
        if silent:
            verb = "stays" if len(silent) == 1 else "stay"
            sentences.append(
                f"{', '.join(silent)} {verb} where the truck had them: the plateaus do not tell."
            )
        knots = [
            found for name, found in estimates.items() if ".table_area." in name and found.told != "alone"
        ]
        if knots:
            numbers = ", ".join(found.name.rpartition(".")[2] for found in knots)
            low, high = current.min(), current.max()
            sentences.append(
                f"The {lift} lift's plateaus have currents from {low:.2f} to {high:.2f} A; "
                f"areas of the knots {numbers} of its table rest on the truck's."
            )
        sentences.append(
            f"The {lift} lift's critical Reynolds numbers are told only as products with the viscosity, and "
            "its areas only as products with the valve's discharge coefficient; both are taken as the truck "
            "has them."
        )
        return sentences

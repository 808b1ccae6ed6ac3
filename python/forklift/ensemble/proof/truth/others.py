"""Laws of another shape than the catalogue's, at the same places: what real machines have instead.

Named ``EFFECT__SHAPE``, with the effect of the catalogue that lies nearest. The amplitude is the first
parameter, zero where nothing acts; that of a lift's own law is a pair over the lifts.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift.ensemble.proof.truth.effects import REFERENCE_K
from forklift.ensemble.proof.truth.model import Law

Values = dict[str, NDArray[np.float64]]


class AsymmetricBump(Law):
    """Friction rises steeply on one side of the place and falls off slowly on the other; widths in m."""

    def coulomb(self, F_c: Any, s: SimpleNamespace, k: Values) -> Any:
        name = "friction_position__asymmetric"
        away = s.x - k[f"{name}.centre"]
        width = np.where(away < 0.0, k[f"{name}.steep"], k[f"{name}.slow"])
        return F_c * (1 + k[f"{name}.rise"] * np.exp(-np.abs(away) / width))


class LoadTimesPosition(Law):
    """Rollers pressed by the load's moment: F_c (1 + rise · load/1 t · x/1 m)."""

    def coulomb(self, F_c: Any, s: SimpleNamespace, k: Values) -> Any:
        return F_c * (1 + k["friction_position__load.rise"] * k["load"] / 1000.0 * s.x)


class HyperbolicViscousFriction(Law):
    """sigma_2/(1 + rate (T - 20 degC)), rate [1/K]; in the cold not above five times sigma_2."""

    def viscous(self, sigma_2: Any, s: SimpleNamespace, k: Values) -> Any:
        fluid = 1 + k["friction_temperature__hyperbolic.rate"] * (s.T - REFERENCE_K)
        return sigma_2 / np.maximum(fluid, 0.2)


class KinkedViscousFriction(Law):
    """Grease that softens above `above` [degC] only: sigma_2 (1 - rate (T - above)), not below a fifth."""

    def viscous(self, sigma_2: Any, s: SimpleNamespace, k: Values) -> Any:
        name = "friction_temperature__kink"
        over = np.maximum(s.T - REFERENCE_K + 20.0 - k[f"{name}.above"], 0.0)
        return sigma_2 * np.maximum(1 - k[f"{name}.rate"] * over, 0.2)


class TurbulentLeakage(Law):
    """A scratch in the cylinder: `coefficient` [m³/(s Pa^½)] · sqrt(p_A - p_T)."""

    def outflow(self, q: Any, s: SimpleNamespace, k: Values) -> Any:
        p = s.p_A - k["p_D"]
        return q + k["leakage__turbulent.coefficient"] * p / np.sqrt(np.hypot(p, 1e4))


class LeakageAbove(Law):
    """A relief valve that weeps: `coefficient` [m³/(s Pa)] of what exceeds `above` [Pa]."""

    def outflow(self, q: Any, s: SimpleNamespace, k: Values) -> Any:
        over = np.maximum(s.p_A - k["leakage__above.above"], 0.0)
        return q + k["leakage__above.coefficient"] * over


class BackPressureToAPower(Law):
    """A return filter takes `coefficient` [Pa (s/m³)^power] q^power.

    q is the oil that leaves both compensators, behind a hose that swells with the time constant 20 ms.
    """

    shared = {"filtered": 1e-3}  # noqa: RUF012

    def back_pressure(self, p_D: Any, s: SimpleNamespace, k: Values) -> Any:
        name = "return_back_pressure__power"
        q = np.maximum(s.filtered, 1e-12)
        return p_D + k[f"{name}.coefficient"][0] * q ** k[f"{name}.power"][0]

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"filtered": (s.q_B.sum(axis=0) - s.filtered) / 0.02}


class SaturatingDwell(Law):
    """Friction grows at rest as growth (1 - e^(-age/time)) and is lost within 50 ms of motion."""

    memory = {"rest": 1.0}  # noqa: RUF012

    def coulomb(self, F_c: Any, s: SimpleNamespace, k: Values) -> Any:
        name = "friction_dwell__saturating"
        return F_c * (1 + k[f"{name}.growth"] * -np.expm1(-np.maximum(s.rest, 0.0) / k[f"{name}.time"]))

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        moving = s.speed**2 / (s.speed**2 + 0.005**2)
        return {"rest": 1 - moving - moving * s.rest / 0.05}


class RateLimitedOpening(Law):
    """The current at the valve changes by no more than a limit: slowness [s/A] is its inverse.

    The limit is rounded within 20 mA of the command, so that no lag is left as the slowness goes to nothing.
    """

    memory = {"ramped": 1.0}  # noqa: RUF012
    ROUNDED_A = 0.02
    LEAST_S_PER_A = 0.003

    def command(self, u: Any, s: SimpleNamespace, k: Values) -> Any:
        return np.where(k["valve_lag__rate_limit.slowness"] > 0.0, u + s.ramped - s.u, u)

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        slowness = np.maximum(k["valve_lag__rate_limit.slowness"], self.LEAST_S_PER_A)
        return {"ramped": np.tanh((s.u - s.ramped) / self.ROUNDED_A) / slowness}


class DissolvingAir(Law):
    """Bubbles, isothermal, that dissolve with the pressure and are gone at `solved` [Pa]."""

    def capacity(self, C: Any, s: SimpleNamespace, k: Values) -> Any:
        name = "entrained_air__dissolving"
        p = np.maximum(s.p_A, 2e4)
        left = np.maximum(1 - p / k[f"{name}.solved"], 0.0)
        return C + k[f"{name}.fraction"] * s.volume * 1e5 / p**2 * left


class ChainOfLags(Law):
    """The command passes four equal lags one after the other, of `delay` [s] together."""

    LINKS = ("link_1", "link_2", "link_3", "link_4")
    memory = dict.fromkeys(LINKS, 1.0)
    SHORTEST_S = 1e-4

    def command(self, u: Any, s: SimpleNamespace, k: Values) -> Any:
        # Without delay the command itself: the links are then as fast as may be, but not at once.
        return np.where(k["valve_delay__chain.delay"] > 0.0, u + s.link_4 - s.u, u)

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        time = np.maximum(k["valve_delay__chain.delay"] / 4, self.SHORTEST_S)
        before = [s.u, s.link_1, s.link_2, s.link_3]
        return {
            link: (given - getattr(s, link)) / time for link, given in zip(self.LINKS, before, strict=True)
        }


OTHERS = {
    "friction_position__asymmetric": AsymmetricBump,
    "friction_position__load": LoadTimesPosition,
    "friction_temperature__hyperbolic": HyperbolicViscousFriction,
    "friction_temperature__kink": KinkedViscousFriction,
    "leakage__turbulent": TurbulentLeakage,
    "leakage__above": LeakageAbove,
    "return_back_pressure__power": BackPressureToAPower,
    "friction_dwell__saturating": SaturatingDwell,
    "valve_lag__rate_limit": RateLimitedOpening,
    "entrained_air__dissolving": DissolvingAir,
    "valve_delay__chain": ChainOfLags,
}

QUIET = {
    "friction_position__asymmetric": dict(rise=0.0, centre=0.6, steep=0.03, slow=0.25),
    "friction_position__load": dict(rise=0.0),
    "friction_temperature__hyperbolic": dict(rate=0.0),
    "friction_temperature__kink": dict(rate=0.0, above=35.0),
    "leakage__turbulent": dict(coefficient=0.0),
    "leakage__above": dict(coefficient=0.0, above=7e6),
    "return_back_pressure__power": dict(coefficient=0.0, power=1.3),
    "friction_dwell__saturating": dict(growth=0.0, time=0.5),
    "valve_lag__rate_limit": dict(slowness=0.0),
    "entrained_air__dissolving": dict(fraction=0.0, solved=6e6),
    "valve_delay__chain": dict(delay=0.0),
}


def law(name: str, amplitude: Any = 0.0, **others: Any) -> Law:
    """A law of another shape; the amplitude of a lift's own is a pair, see `run.on`."""
    values: dict[str, Any] = QUIET[name] | others
    values[next(iter(values))] = amplitude
    return OTHERS[name](name, **values)


MOST = {
    "friction_position__asymmetric": 3.0,
    "friction_position__load": 1.5,
    "friction_temperature__hyperbolic": 0.05,
    "friction_temperature__kink": 0.032,
    "leakage__turbulent": 3e-8,
    "leakage__above": 2e-11,
    "return_back_pressure__power": 4e10,
    "friction_dwell__saturating": 2.0,
    "valve_lag__rate_limit": 1.0,
    "entrained_air__dissolving": 0.05,
    "valve_delay__chain": 0.1,
}
"""The amplitudes beyond which a truck would be taken to the workshop."""

DRAWN: dict[str, tuple[tuple[str, float, float], ...]] = {
    "friction_position__asymmetric": (("steep", 0.02, 0.05), ("slow", 0.15, 0.35)),
    "friction_temperature__kink": (("above", 25.0, 42.0),),
    "leakage__above": (("above", 3e6, 8e6),),
    "return_back_pressure__power": (("power", 1.1, 1.6),),
    "friction_dwell__saturating": (("time", 0.2, 1.2),),
    "entrained_air__dissolving": (("solved", 5e6, 1.2e7),),
}
"""Ranges from which a law's other values are drawn, evenly."""

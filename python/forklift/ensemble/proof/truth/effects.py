"""The catalogue's effects in this plant's words: one class each, its parameters named as in the catalogue.

A law of one lift has its amplitude as a pair over the lifts, `run.on`; at zero nothing acts. Where the
catalogue writes a law in a shape fit for its integrator (a factor on stiffness, a momentum), it stands here
as in the mechanics: a compliance in series, a mass on a spring.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift.ensemble.proof.truth.model import Law

Values = dict[str, NDArray[np.float64]]

REFERENCE_K = 293.0  # 20 degC
ATMOSPHERE_PA = 1e5


class MastCoupling(Law):
    """What the free lift moves rides on the second stage, which moves at twice the main cylinder's speed.

    T = 1/2 m_c,f (2 v_M + v_F)² + 1/2 (m_f + m_L)(2 v_M + 2 v_F)², so that
    M_FM = 2 m_c,f + 4 (m_f + m_L) [kg]; `factor` of it acts.
    """

    def masses(self, quantity: Any, s: SimpleNamespace, k: Values) -> Any:
        free, main, between = quantity
        ridden = 2 * 1 * k["m_c"][0] + 2 * 2 * k["m"][0]
        return free, main, between + k["mast_coupling.factor"][0] * ridden


class FrictionTemperature(Law):
    """sigma_2 [N s/m] falls by the factor e for every 1/`rate` [K] above 20 degC."""

    def viscous(self, sigma_2: Any, s: SimpleNamespace, k: Values) -> Any:
        return sigma_2 / np.exp(k["friction_temperature.rate"] * (s.T - REFERENCE_K))


class Leakage(Law):
    """Laminar flow through the seals' gap from cylinder to tank: `coefficient` [m³/(s Pa)] (p_A - p_T)."""

    def outflow(self, q: Any, s: SimpleNamespace, k: Values) -> Any:
        return q + k["leakage.coefficient"] * (s.p_A - k["p_D"])


class FrictionPosition(Law):
    """Coulomb and breakaway friction higher by `rise` at `centre` [m]; 1/e of it is left `width` [m] away."""

    def coulomb(self, F_c: Any, s: SimpleNamespace, k: Values) -> Any:
        away = (s.x - k["friction_position.centre"]) / k["friction_position.width"]
        return F_c + F_c * k["friction_position.rise"] * np.exp(-np.square(away))


class FrictionPressure(Law):
    """Seals pressed against the rod: `coefficient` [m²] p_A more Coulomb friction [N]."""

    def coulomb(self, F_c: Any, s: SimpleNamespace, k: Values) -> Any:
        return F_c + k["friction_pressure.coefficient"] * np.maximum(s.p_A, 0.0)


class FrictionDwell(Law):
    """Contacts age, friction grows by `growth` ln(1 + age/1 s); moving by `way` [m] renews them.

    d(age)/dt = 1 - |v| age/way.
    """

    memory = {"age": 1.0}  # noqa: RUF012

    def coulomb(self, F_c: Any, s: SimpleNamespace, k: Values) -> Any:
        return F_c * (1 + k["friction_dwell.growth"] * np.log1p(np.maximum(s.age, 0.0)))

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"age": 1 - s.speed / k["friction_dwell.way"] * s.age}


class BulkModulusTemperature(Law):
    """E [Pa] falls by the factor e for every 1/`rate` [K] above 20 degC."""

    def bulk_modulus(self, E: Any, s: SimpleNamespace, k: Values) -> Any:
        return E / np.exp(k["bulk_modulus_temperature.rate"] * (s.T - REFERENCE_K))


class EntrainedAir(Law):
    """Bubbles keep p V^n with the `exponent` n; at 1 bar they are `fraction` of the volume.

    -dV_air/dp = V_air/(n p) with V_air = fraction V (1 bar/p)^(1/n), beside the oil's V/E.
    """

    def capacity(self, C: Any, s: SimpleNamespace, k: Values) -> Any:
        p, n = np.maximum(s.p_A, 2e4), k["entrained_air.exponent"]
        V_air = k["entrained_air.fraction"] * s.volume * (ATMOSPHERE_PA / p) ** (1 / n)
        return C + V_air / (n * p)


class ChainElasticity(Law):
    """Chains of `compliance` [m/N] carry half of p_A A; the cylinder sinks by half of what they stretch.

    x is the cylinder's position under a chain that does not stretch. Per pressure that is
    A/2 · A/2 · compliance more volume, beside the oil's.
    """

    def capacity(self, C: Any, s: SimpleNamespace, k: Values) -> Any:
        return C + (k["A"] / 2) ** 2 * k["chain_elasticity.compliance"]


class EndCushion(Law):
    """An orifice brakes the last `length` [m] of the way down: up to `coefficient` [N s²/m²] v²."""

    def force(self, F: Any, s: SimpleNamespace, k: Values) -> Any:
        near = np.clip((k["end_cushion.length"] - s.x) / k["end_cushion.length"], 0.0, 1.0)
        return F + np.where(s.v < 0.0, k["end_cushion.coefficient"] * s.v**2 * near, 0.0)


class ChassisCompliance(Law):
    """The truck, a mass on its tyres, yields as the lifts gather speed.

    The ground's coordinate y lifts everything: T = 1/2 M y'² + sum over lifts of (1/2 M_k v_k² + mu_k v_k y')
    with mu = m_c + 2 m, M = M_t + m_c,main + m_main. Lagrange:
    M y'' + d y' + y/c = -sum mu_k a_k,  M_k a_k = F_k - mu_k y''.
    M_t = 1/(c omega²) of the truck alone, d = 2 `damping_ratio` omega M_t, omega = 2 pi `frequency` [Hz],
    c = `compliance` [m/N]. y'' is eliminated. A truck lighter than a tonne, or M less than 1.2 times
    what the lifts move, counts as that, as the catalogue says.
    """

    shared = {"ground": 0.01, "ground_rate": 0.1}  # noqa: RUF012
    shown = (("ground", 1.0),)

    def _truck(self, k: Values) -> Any:
        """1/M [1/kg], and spring and damper per M [1/s², 1/s]."""
        c, zeta = (k[f"chassis_compliance.{name}"][0] for name in ("compliance", "damping_ratio"))
        omega = 2 * np.pi * k["chassis_compliance.frequency"][0]
        per_truck = np.minimum(c * omega**2, 1e-3)
        carried = k["m_c"][1] + k["m"][1]
        share = 1 / (1 + per_truck * carried)
        moved = (k["m_c"] + k["m"]).sum(axis=0)
        per_mass = np.minimum(per_truck * share, 1 / (1.2 * moved))
        return per_mass, omega**2 * share, 2 * zeta * omega * share

    def _free_acceleration(self, s: SimpleNamespace, k: Values) -> Any:
        """y'' [m/s²] were it not for the lifts' accelerations."""
        _, spring, damper = self._truck(k)
        return -spring * s.ground - damper * s.ground_rate

    def force(self, F: Any, s: SimpleNamespace, k: Values) -> Any:
        return F - (k["m_c"] + 2 * k["m"]) * self._free_acceleration(s, k)

    def masses(self, quantity: Any, s: SimpleNamespace, k: Values) -> Any:
        free, main, between = quantity
        per_mass, mu = self._truck(k)[0], k["m_c"] + 2 * k["m"]
        return free - mu[0] ** 2 * per_mass, main - mu[1] ** 2 * per_mass, between - mu[0] * mu[1] * per_mass

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        pulled = ((k["m_c"] + 2 * k["m"]) * s.a).sum(axis=0) * self._truck(k)[0]
        return {"ground": s.ground_rate, "ground_rate": self._free_acceleration(s, k) - pulled}


class HoseResistance(Law):
    """Turbulent loss `coefficient` [Pa s²/m⁶] q|q| before the valve, q [m³/s] what the piston displaces."""

    def inlet(self, p: Any, s: SimpleNamespace, k: Values) -> Any:
        q = -k["A"] * s.v
        return p - k["hose_resistance.coefficient"] * np.sign(q) * q**2


class HoseInertance(Law):
    """The oil in the hose must be accelerated: p_in = p_A - `inertance` [kg/m⁴] dq/dt, q = -A v.

    The acceleration is the lift's from its own force balance.
    """

    def inlet(self, p: Any, s: SimpleNamespace, k: Values) -> Any:
        a = s.F / (k["m_c"] + 4 * k["m"])
        return p + k["hose_inertance.inertance"] * k["A"] * a


class ReturnBackPressure(Law):
    """Both lifts' oil goes through one return line: p_D = p_T + `coefficient` [Pa s²/m⁶] q², q >= 0."""

    def back_pressure(self, p_D: Any, s: SimpleNamespace, k: Values) -> Any:
        q = np.maximum((-k["A"] * s.v).sum(axis=0), 0.0)
        return p_D + k["return_back_pressure.coefficient"][0] * q**2


class ViscosityLaw(Law):
    """From the exponential (share 0) to Vogel's law ln nu = C + B/(T - `vogel` [K]) (share 1).

    Logarithms are mixed; B makes both agree at T_0 in value and slope. The oil's density falls by `share`
    times `expansion` [1/K].
    """

    def viscosity(self, nu: Any, s: SimpleNamespace, k: Values) -> Any:
        share, pole = k["viscosity_law.share"], k["viscosity_law.vogel"]
        at_T_0 = k["T_0"] - pole
        B = k["lam"] * at_T_0**2
        vogel = k["eta_0"] * np.exp(B / (s.T - pole) - B / at_T_0)
        return nu ** (1 - share) * vogel**share

    def density(self, rho: Any, s: SimpleNamespace, k: Values) -> Any:
        return rho * (1 - k["viscosity_law.share"] * k["viscosity_law.expansion"] * (s.T - k["T_0"]))


class OilTemperatureAtValve(Law):
    """Throttled power heats the oil at the valve by `resistance` [K/W], with the time constant `time` [s]."""

    memory = {"heating": 1e3}  # noqa: RUF012

    def viscosity(self, nu: Any, s: SimpleNamespace, k: Values) -> Any:
        return nu * np.exp(-k["lam"] * k["oil_temperature_at_valve.resistance"] * s.heating)

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        power = np.maximum(-s.v * k["A"] * s.p_A, 0.0)
        return {"heating": (power - s.heating) / k["oil_temperature_at_valve.time"]}


class ValveDelay(Law):
    """The command itself, as it was `delay` [s] ago."""

    dead_time = "delay"


class ValveLag(Law):
    """`share` of the command comes through a first-order lag of `time` [s]."""

    memory = {"lagged": 1.0}  # noqa: RUF012

    def command(self, u: Any, s: SimpleNamespace, k: Values) -> Any:
        return u - k["valve_lag.share"] * (s.u - s.lagged)

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"lagged": (s.u - s.lagged) / k["valve_lag.time"]}


class ValveCurrentLimit(Law):
    """Above a limit `share` of the command is lost; a coil warmed by its current squared has a lower one.

    limit/(1 + `warming` [1/A²] w), w [A²] the command squared behind a lag of `time` [s]; the corner is a
    hyperbola 20 mA wide.
    """

    memory = {"coil_heat": 1.0}  # noqa: RUF012

    def command(self, u: Any, s: SimpleNamespace, k: Values) -> Any:
        warm = 1 + k["valve_current_limit.warming"] * np.maximum(s.coil_heat, 0.0)
        over = s.u - k["valve_current_limit.limit"] / warm
        return u - k["valve_current_limit.share"] * (over + np.hypot(over, 0.02)) / 2

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"coil_heat": (s.u**2 - s.coil_heat) / k["valve_current_limit.time"]}


class ValveFlowForce(Law):
    """The jet's force on the spool is worth `coefficient` [A/N] of current, per opening times drop."""

    def command(self, u: Any, s: SimpleNamespace, k: Values) -> Any:
        return u - k["valve_flow_force.coefficient"] * s.A_valve * (s.p_A - s.p_B)


class CompensatorDynamics(Law):
    """`share` of the drop across the valve reaches the compensator through a lag of `time` [s]."""

    memory = {"felt": 1e6}  # noqa: RUF012

    def sensed(self, drop: Any, s: SimpleNamespace, k: Values) -> Any:
        return drop - k["compensator_dynamics.share"] * (drop - s.felt)

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"felt": (s.p_A - s.p_B - s.felt) / k["compensator_dynamics.time"]}


CATALOGUE = {
    "mast_coupling": MastCoupling,
    "friction_temperature": FrictionTemperature,
    "leakage": Leakage,
    "friction_position": FrictionPosition,
    "friction_pressure": FrictionPressure,
    "friction_dwell": FrictionDwell,
    "bulk_modulus_temperature": BulkModulusTemperature,
    "entrained_air": EntrainedAir,
    "chain_elasticity": ChainElasticity,
    "end_cushion": EndCushion,
    "chassis_compliance": ChassisCompliance,
    "hose_resistance": HoseResistance,
    "hose_inertance": HoseInertance,
    "return_back_pressure": ReturnBackPressure,
    "viscosity_law": ViscosityLaw,
    "oil_temperature_at_valve": OilTemperatureAtValve,
    "valve_delay": ValveDelay,
    "valve_lag": ValveLag,
    "valve_current_limit": ValveCurrentLimit,
    "valve_flow_force": ValveFlowForce,
    "compensator_dynamics": CompensatorDynamics,
}

QUIET = {
    "mast_coupling": dict(factor=0.0),
    "friction_temperature": dict(rate=0.0),
    "leakage": dict(coefficient=0.0),
    "friction_position": dict(rise=0.0, centre=0.7, width=0.15),
    "friction_pressure": dict(coefficient=0.0),
    "friction_dwell": dict(growth=0.0, way=0.01),
    "bulk_modulus_temperature": dict(rate=0.0),
    "entrained_air": dict(fraction=0.0, exponent=1.2),
    "chain_elasticity": dict(compliance=0.0),
    "end_cushion": dict(coefficient=0.0, length=0.1),
    "chassis_compliance": dict(compliance=0.0, frequency=2.5, damping_ratio=0.06),
    "hose_resistance": dict(coefficient=0.0),
    "hose_inertance": dict(inertance=0.0),
    "return_back_pressure": dict(coefficient=0.0),
    "viscosity_law": dict(share=0.0, vogel=175.0, expansion=7e-4),
    "oil_temperature_at_valve": dict(resistance=0.0, time=8.0),
    "valve_delay": dict(delay=0.0),
    "valve_lag": dict(share=0.0, time=0.2),
    "valve_current_limit": dict(share=0.0, limit=0.7, warming=0.2, time=30.0),
    "valve_flow_force": dict(coefficient=0.0),
    "compensator_dynamics": dict(share=0.0, time=0.1),
}
"""Each effect's parameters, the amplitude first and at its null value, the others amid the plausible."""


def law(name: str, amplitude: Any = 0.0, **others: Any) -> Law:
    """An effect of the catalogue; the amplitude of a lift's own is a pair, see `run.on`."""
    values: dict[str, Any] = QUIET[name] | others
    values[next(iter(values))] = amplitude
    return CATALOGUE[name](name, **values)

"""Physics that the catalogue lacks: each at its place in the equations, with its source.

The first value of a law is its amplitude, zero where nothing acts; that of a lift's own law is a pair over
the lifts. `SPECS` says of each where it acts, what it is a function of, and how large it may be.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift.ensemble.proof.truth.model import Law

Floats = NDArray[np.float64]
Values = dict[str, Floats]
REFERENCE_K = 293.0  # 20 degC


class RailWaviness(Law):
    """Rollers on a rail with a period: force [N] (1 + sin(2 pi x/period)) tanh(v/1 cm/s) against the motion.

    Grassie and Kalousek (1993), Rail corrugation: characteristics, causes and treatments, Proc. IMechE F 207.
    """

    def force(self, F: Floats, s: SimpleNamespace, k: Values) -> Any:
        wave = 1 + np.sin(2 * np.pi * s.x / k["rail_waviness.period"])
        return F - k["rail_waviness.force"] * wave * np.tanh(s.v / 0.01)


class SupplySag(Law):
    """The battery's resistance: each current falls by `share` [1/A] of the other valve's command.

    Chen and Rincón-Mora (2006), Accurate electrical battery model, IEEE Trans. Energy Conversion 21 (series
    resistance).
    """

    def command(self, u: Floats, s: SimpleNamespace, k: Values) -> Any:
        return u * (1 - k["supply_sag.share"] * s.u[::-1])


class CoilWarming(Law):
    """A voltage-driven coil: the current falls as copper warms by u² behind a lag of `time` [s].

    u/(1 + rise w), w [A²] the lagged square, `rise` [1/A²]: copper's 0.0039 1/K (IEC 60028) times
    kelvin per A².
    """

    memory = {"copper": 1.0}  # noqa: RUF012

    def command(self, u: Floats, s: SimpleNamespace, k: Values) -> Any:
        return u / (1 + k["coil_warming.rise"] * np.maximum(s.copper, 0.0))

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"copper": (s.u**2 - s.copper) / k["coil_warming.time"]}


class BouncingLoad(Law):
    """`share` of the load rests on a spring (a soft pallet): its own `frequency` [Hz] and `damping` ratio.

    Inman (2014), Engineering Vibration, section 4.1: two degrees of freedom. Lagrange, with r the spring's
    compression: mu (2 x'' + r'') = -mu (omega² r + 2 zeta omega r').
    """

    coordinates = {"bounce": 0.01}  # noqa: RUF012

    def lagrange(self, M: Floats, Q: Floats, at: dict[str, int], s: SimpleNamespace, k: Values) -> None:
        r, omega = at["bounce"], 2 * np.pi * k["bouncing_load.frequency"][0]
        hung = k["bouncing_load.share"] * k["load"]
        lifts = (hung > 0.0).astype(float)
        for lift in range(2):
            M[lift, r] += 2 * hung[lift]
            M[r, lift] += 2 * lifts[lift]
        M[r, r] += 1.0
        Q[r] -= omega**2 * s.bounce + 2 * k["bouncing_load.damping"][0] * omega * s.bounce_rate


class ShearThinning(Law):
    """Oil with a polymer thins at a high rate of shear: nu/(1 + `strength` (v/v_0)^2)^(1/2), v the
    cylinder's speed.

    Cross (1965), Rheology of non-Newtonian fluids, J. Colloid Science 20; `scale` [m/s] is v_0.
    """

    def viscosity(self, nu: Floats, s: SimpleNamespace, k: Values) -> Any:
        return nu / np.sqrt(1 + k["shear_thinning.strength"] * (s.v / k["shear_thinning.scale"]) ** 2)


class PressureViscosity(Law):
    """Barus's law: nu exp(coefficient p_A), `coefficient` [1/Pa].

    Barus (1893), Isothermals, isopiestics and isometrics relative to viscosity, Am. J. Science 45.
    """

    def viscosity(self, nu: Floats, s: SimpleNamespace, k: Values) -> Any:
        return nu * np.exp(k["pressure_viscosity.coefficient"] * np.clip(s.p_A, 0.0, 5e7))


class ChokedFlow(Law):
    """Cavitation in the valve: the flow is lost by `share` as the drop exceeds `above` [Pa].

    Nurick (1976), Orifice cavitation and its effect on spray mixing, J. Fluids Engineering 98.
    """

    def through(self, q: Floats, s: SimpleNamespace, k: Values) -> Any:
        over = s.drop / k["choked_flow.above"] - 1
        return q * (1 - k["choked_flow.share"] * (over + np.hypot(over, 0.1)) / (2 + np.abs(over)))


class SpoolBacklash(Law):
    """Play of `width` [A] between armature and spool, which follows its ends within 5 ms.

    Tao and Kokotović (1996), Adaptive Control of Systems with Actuator and Sensor Nonlinearities, chapter 2.
    """

    memory = {"played": 1.0}  # noqa: RUF012

    def command(self, u: Floats, s: SimpleNamespace, k: Values) -> Any:
        return np.where(k["spool_backlash.width"] > 0.0, u + s.played - s.u, u)

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        gap, half = s.u - s.played, k["spool_backlash.width"] / 2
        return {"played": (np.maximum(gap - half, 0.0) + np.minimum(gap + half, 0.0)) / 0.005}


class HoseCreep(Law):
    """A rubber hose gives way late: a Kelvin-Voigt wall of `compliance` [m³/Pa] with the time constant
    `time` [s].

    Longmore and Schlesinger (1991), Transmission of vibration and pressure fluctuations through hydraulic
    hoses, Proc. IMechE I 205. The wall follows p_A from rest; what flows into it is compliance/time (p_A -
    p_wall).
    """

    memory = {"crept": 1e6}  # noqa: RUF012

    def outflow(self, q: Floats, s: SimpleNamespace, k: Values) -> Any:
        rest = (k["m_c"] + 2 * k["m"]) * k["g"] / k["A"]
        return q + k["hose_creep.compliance"] / k["hose_creep.time"] * (s.p_A - rest - s.crept)

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        rest = (k["m_c"] + 2 * k["m"]) * k["g"] / k["A"]
        return {"crept": (s.p_A - rest - s.crept) / k["hose_creep.time"]}


class CoulombTemperature(Law):
    """Seals harden in the cold: Coulomb friction times exp(-rate (T - 20 degC)), `rate` [1/K].

    Müller and Nau (1998), Fluid Sealing Technology, chapter 5.
    """

    def coulomb(self, F_c: Floats, s: SimpleNamespace, k: Values) -> Any:
        return F_c * np.exp(-k["coulomb_temperature.rate"] * (s.T - REFERENCE_K))


class RollerMoment(Law):
    """The load's moment presses the rollers, the harder the less the mast's sections overlap.

    Friction [N] `friction` · load/1 t · 1/(1 - x/`overlap`) on top of Coulomb's; statics of a couple over the
    overlap. Hibbeler (2016), Engineering Mechanics: Statics, section 8.2.
    """

    def coulomb(self, F_c: Floats, s: SimpleNamespace, k: Values) -> Any:
        lever = 1 / np.maximum(1 - s.x / k["roller_moment.overlap"], 0.15)
        return F_c + k["roller_moment.friction"] * k["load"] / 1000 * lever


class ChainWeight(Law):
    """Chains and hoses that change sides: a force `stiffness` [N/m] (x - 1 m), downward where the lift
    is high.

    Mass per length of leaf chains: ISO 4347.
    """

    def force(self, F: Floats, s: SimpleNamespace, k: Values) -> Any:
        start = np.array([0.98, 1.96])[:, None, None]
        return F - k["chain_weight.stiffness"] * (s.x - start)


class RuptureValve(Law):
    """A lowering limiter throttles beyond a flow: `coefficient` [Pa s²/m²] (|v| - `above`)², v [m/s]
    the cylinder's.

    ISO 3691-1 (2011), 4.6.3.3 asks for one; the law is a sharp-edged orifice's that begins to act.
    """

    def inlet(self, p: Floats, s: SimpleNamespace, k: Values) -> Any:
        over = np.maximum(-s.v - k["rupture_valve.above"], 0.0)
        return p - k["rupture_valve.coefficient"] * over**2


class Accumulator(Law):
    """A gas-charged damper: `volume` [m³] of gas at its `charge` [Pa], compliant only above it.

    Pourmovahed and Otis (1990), An experimental thermal time-constant correlation for hydraulic accumulators,
    J. Dynamic Systems 112; polytropic with 1.4, V_0 (p_0/p)^(1/n)/(n p) beyond a corner of 2 bar.
    """

    def capacity(self, C: Floats, s: SimpleNamespace, k: Values) -> Any:
        p, charge = np.maximum(s.p_A, 2e4), k["accumulator.charge"]
        open_ = 0.5 * (1 + np.tanh((p - charge) / 2e5))
        return C + open_ * k["accumulator.volume"] * (charge / p) ** (1 / 1.4) / (1.4 * p)


class FilterViscosity(Law):
    """The return filter is laminar: back-pressure `coefficient` [Pa s/m³] nu(T)/nu(20 degC) q.

    ISO 3968 (2017): differential pressure of filters in proportion to viscosity and flow.
    """

    def back_pressure(self, p_D: Floats, s: SimpleNamespace, k: Values) -> Any:
        q = np.maximum(-k["A"] * s.v, 0.0)
        thinner = np.exp(-4.0 * k["lam"] * (s.T - REFERENCE_K))  # mineral oil is steeper than the valve's law
        return p_D + k["filter_viscosity.coefficient"] * thinner * q


class GreaseWarming(Law):
    """Grease thins where it is worked: Coulomb friction times 1 + `rise`/(1 + w), w the work done
    behind a lag.

    w' = |v|/`way` - w/`time`. Lugt (2013), Grease Lubrication in Rolling Bearings, chapter 5 (thixotropy).
    """

    memory = {"worked": 1.0}  # noqa: RUF012

    def coulomb(self, F_c: Floats, s: SimpleNamespace, k: Values) -> Any:
        w = np.maximum(s.worked, 0.0)
        return F_c * (1 + k["grease_warming.rise"] / (1 + w))

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"worked": s.speed / k["grease_warming.way"] - s.worked / k["grease_warming.time"]}


class QuadraticDrag(Law):
    """Oil pressed through the narrow passages of the cylinder: force `coefficient` [N s²/m²] v |v|.

    White (2016), Fluid Mechanics, section 6.9: minor losses.
    """

    def force(self, F: Floats, s: SimpleNamespace, k: Values) -> Any:
        return F - k["quadratic_drag.coefficient"] * s.v * s.speed


class HystereticMast(Law):
    """Bouc and Wen's hysteresis of bolted profiles: force [N] z, z' = (v - |v| |z| z)/`way`.

    Ismail, Ikhouane and Rodellar (2009), The hysteresis Bouc-Wen model, a survey, Arch. Comput. Methods
    Eng. 16.
    """

    memory = {"bent": 1.0}  # noqa: RUF012

    def force(self, F: Floats, s: SimpleNamespace, k: Values) -> Any:
        return F - k["hysteretic_mast.force"] * s.bent

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"bent": (s.v - s.speed * np.abs(s.bent) * s.bent) / k["hysteretic_mast.way"]}


class CloggedValve(Law):
    """Orifices silt up: the opening shrinks by `share` times what has silted.

    Merritt (1967), Hydraulic Control Systems, section 5-2: valve openings and their flaws; silting lock.
    It comes and goes with the time since the spool last moved far: silted' = (1 - silted)/`time` - 2
    |i'| silted, i' in A/s.
    """

    memory = {"silted": 1.0}  # noqa: RUF012

    def opening(self, area: Floats, s: SimpleNamespace, k: Values) -> Any:
        return area * (1 - k["silting.share"] * np.clip(s.silted, 0.0, 1.0))

    def rates(self, s: SimpleNamespace, k: Values) -> Values:
        return {"silted": (1 - s.silted) / k["silting.time"] - 2.0 * np.abs(s.di) * s.silted}


@dataclass(frozen=True)
class Spec:
    """What is known of a law beforehand.

    Attributes
    ----------
    law
        Its class.
    most
        The amplitude beyond which a truck would be taken to the workshop.
    others
        Ranges from which its other values are drawn, evenly in the logarithm.
    equations
        Where an answer may locate it.
    of
        What it is a function of, in words.
    lifts
        ``"one"`` or ``"both"``.
    """

    law: type[Law]
    most: float
    equations: tuple[str, ...]
    of: str
    others: tuple[tuple[str, float, float], ...] = ()
    lifts: str = "one"
    amplitude: str = ""


FORCES = ("friction", "force-balance")
VALVE = ("valve-dynamics", "valve-flow")
OIL = ("bulk-modulus", "cylinder-pressure")

SPECS: dict[str, Spec] = {
    "rail_waviness": Spec(
        RailWaviness, 900.0, FORCES, "position", (("period", 0.08, 0.4),), amplitude="force"
    ),
    "supply_sag": Spec(SupplySag, 0.1, VALVE, "the other lift's command", lifts="both", amplitude="share"),
    "coil_warming": Spec(
        CoilWarming, 0.4, VALVE, "the time and current so far", (("time", 4.0, 20.0),), amplitude="rise"
    ),
    "bouncing_load": Spec(
        BouncingLoad,
        0.5,
        (*FORCES, "chassis"),
        "the load's own motion",
        (("frequency", 1.2, 4.0), ("damping", 0.02, 0.1)),
        amplitude="share",
    ),
    "shear_thinning": Spec(
        ShearThinning,
        15.0,
        ("viscosity", *VALVE),
        "velocity",
        (("scale", 0.05, 0.2),),
        amplitude="strength",
    ),
    "pressure_viscosity": Spec(
        PressureViscosity, 1.5e-7, ("viscosity", *VALVE), "cylinder pressure", amplitude="coefficient"
    ),
    "choked_flow": Spec(ChokedFlow, 0.6, VALVE, "pressure drop", (("above", 2e5, 6e5),), amplitude="share"),
    "spool_backlash": Spec(SpoolBacklash, 0.12, VALVE, "the command so far", amplitude="width"),
    "hose_creep": Spec(
        HoseCreep, 3e-11, OIL, "pressure so far", (("time", 0.1, 0.8),), amplitude="compliance"
    ),
    "coulomb_temperature": Spec(CoulombTemperature, 0.05, ("friction",), "oil temperature", amplitude="rate"),
    "roller_moment": Spec(
        RollerMoment, 600.0, FORCES, "load and position", (("overlap", 2.2, 3.0),), amplitude="friction"
    ),
    "chain_weight": Spec(ChainWeight, 2500.0, FORCES, "position", amplitude="stiffness"),
    "rupture_valve": Spec(
        RuptureValve,
        6e7,
        (*VALVE, "force-balance"),
        "velocity",
        (("above", 0.1, 0.2),),
        amplitude="coefficient",
    ),
    "accumulator": Spec(
        Accumulator, 3e-4, OIL, "cylinder pressure", (("charge", 2e6, 8e6),), amplitude="volume"
    ),
    "filter_viscosity": Spec(
        FilterViscosity,
        3e9,
        ("tank", "compensator", *VALVE, "viscosity"),
        "velocity and oil temperature",
        amplitude="coefficient",
    ),
    "grease_warming": Spec(
        GreaseWarming,
        6.0,
        FORCES,
        "the way so far",
        (("way", 0.1, 0.6), ("time", 5.0, 30.0)),
        amplitude="rise",
    ),
    "quadratic_drag": Spec(QuadraticDrag, 3e4, FORCES, "velocity", amplitude="coefficient"),
    "hysteretic_mast": Spec(
        HystereticMast, 2500.0, FORCES, "position so far", (("way", 0.02, 0.2),), amplitude="force"
    ),
    "silting": Spec(CloggedValve, 0.5, VALVE, "time at rest", (("time", 0.3, 2.0),), amplitude="share"),
}


def law(name: str, amplitude: Any = 0.0, **others: float) -> Law:
    """A law that the catalogue lacks; the amplitude of a lift's own is a pair over the lifts."""
    spec = SPECS[name]
    middle = {key: float(np.sqrt(lower * upper)) for key, lower, upper in spec.others}
    return spec.law(name, **{spec.amplitude: amplitude}, **(middle | others))

"""The equations of both lifts, in Lagrange's form, with the places where a law may enter.

Mechanics: T = 1/2 q'ᵀ M q' with M = sum over bodies of m J Jᵀ, where J q' is a body's velocity; M q'' = Q
with Q the generalised forces of weight, pressure and friction. The coordinates q are the two cylinders'
positions and those that laws add (a truck on its tyres, a load on a spring). Hydraulics, valve and friction
are chapter 3 of Fri & Fahlén (2017). Arrays are over (lift, 1, recording), of numbers or of expressions; a
law by which one lift feels the other sums over the first axis. Each place is a method of `Law` that takes
what the thesis has there and gives what acts instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STATES = ("i", "di", "z_valve", "x", "v", "z", "p_A", "p_B", "A_comp")
SCALES = {
    "i": 1.0, "di": 10.0, "z_valve": 0.05, "x": 1.0, "v": 0.5, "z": 0.1,
    "p_A": 1e7, "p_B": 1e7, "A_comp": 1e-5,
}  # fmt: skip
"""Typical sizes."""
RATE_SCALE = 10.0  # 1/s, of a coordinate's rate over the coordinate

BODIES = (("m_c", 1.0), ("m", 2.0))
"""Of each lift: a mass, and how far it moves with the cylinder. The chain doubles the way of the forks."""


class Law:
    """A change of the thesis's model: overrides the places it concerns.

    ``memory`` names states of its own for each lift, ``shared`` those of the truck, each with a typical size;
    all start at zero, and `rates` gives their time derivatives by name. ``coordinates`` names further degrees
    of freedom q with their typical sizes; each has the states q and q_rate, and `lagrange` adds its bodies
    and forces.
    """

    memory: dict[str, float] = {}  # noqa: RUF012
    shared: dict[str, float] = {}  # noqa: RUF012
    coordinates: dict[str, float] = {}  # noqa: RUF012
    shown: tuple[tuple[str, float], ...] = ()
    """Shared states that add to the height of the forks, each with its factor."""
    seen: tuple[tuple[str, int, float], ...] = ()
    """Shared states that add to what a lift's encoder sees: state, place of the lift, factor."""
    dead_time = ""
    """The value that says by how much the command is late [s]."""

    def __init__(self, name: str = "", **values: Any) -> None:
        self.name = name or type(self).__name__
        self.values = values

    def rates(self, s: SimpleNamespace, k: dict[str, Floats]) -> dict[str, Floats]:
        """Time derivatives of memory and shared states, by name."""
        return {}

    def lagrange(
        self, M: Floats, Q: Floats, at: dict[str, int], s: SimpleNamespace, k: dict[str, Floats]
    ) -> None:
        """Add bodies to M, (q, q, ...), and generalised forces to Q, (q, ...); `at` is a coordinate's
        place."""

    def own(self) -> dict[str, float]:
        """The truck's states that the law has, with their typical sizes."""
        moved: dict[str, float] = {}
        for name, size in self.coordinates.items():
            moved |= {name: size, f"{name}_rate": RATE_SCALE * size}
        return self.shared | moved


PLACES = (
    "command",  # u [A] at the valve, (3.13)
    "opening",  # area [m²] of the proportional valve, (3.12)
    "viscosity",  # nu [m²/s], (3.1)
    "density",  # rho [kg/m³] in both orifices, (3.7)
    "back_pressure",  # p_D [Pa], (3.18)
    "inlet",  # p [Pa] before the proportional valve, in place of p_A
    "sensed",  # drop [Pa] across the valve as the compensator senses it, (3.15)
    "through",  # flow [m³/s] through the proportional valve, (3.7)
    "outflow",  # flow [m³/s] out of the cylinder, (3.20)
    "bulk_modulus",  # E [Pa] of the oil, (3.2)
    "capacity",  # V/E [m³/Pa] of the cylinder, (3.20)
    "coulomb",  # F_pr + m f_cfr [N], (3.34)
    "viscous",  # sigma_2 [N s/m], (3.5)
    "force",  # upward force [N] on the cylinder, (3.27), (3.33)
    "masses",  # inertia of free lift, of main lift, and between them [kg]
)


def through(laws: Sequence[Law], place: str, quantity: Any, s: SimpleNamespace, k: dict[str, Floats]) -> Any:
    """The quantity at a place after all laws that act there."""
    for law in laws:
        change = getattr(law, place, None)
        if change is not None:
            quantity = change(quantity, s, k)
    return quantity


def names(laws: Sequence[Law]) -> tuple[list[str], list[str]]:
    """Of the states of each lift, and of the truck's own."""
    return (
        [*STATES, *(state for law in laws for state in law.memory)],
        [state for law in laws for state in law.own()],
    )


def scales(laws: Sequence[Law]) -> Floats:
    """A typical size of each state, in the order of the state vector."""
    size = SCALES | {state: scale for law in laws for state, scale in (law.memory | law.own()).items()}
    each, own = names(laws)
    return np.array([size[state] for state in each for _ in range(2)] + [size[state] for state in own])


def split(y: Floats, laws: Sequence[Law]) -> SimpleNamespace:
    """The state vector, (states, 1, recordings), by names: a lift's over (lift, ...)."""
    each, own = names(laws)
    s = SimpleNamespace()
    for n, state in enumerate(each):
        setattr(s, state, y[2 * n : 2 * n + 2])
    for n, state in enumerate(own):
        setattr(s, state, y[2 * len(each) + n])
    return s


def at_rest(laws: Sequence[Law], k: dict[str, Floats], x: Floats) -> Floats:
    """At rest at the cylinder positions x: p_A carries the weight, p_B is half of it."""
    each, own = names(laws)
    p_A = (k["m_c"] + 2 * k["m"]) * k["g"] / k["A"]
    start = {"x": x, "p_A": p_A, "p_B": p_A / 2, "A_comp": k["A_leak"]}
    y = np.zeros((2 * len(each) + len(own), *p_A.shape[1:]))
    for state, value in start.items():
        n = each.index(state)
        y[2 * n : 2 * n + 2] = value
    return y


def flow(C_D: Floats, A: Floats, Re_cr: Floats, nu: Floats, rho: Floats, p: Floats) -> Floats:
    """Flow [m³/s] through area A [m²] under the pressure drop p [Pa]. (3.7)-(3.9)"""
    p_cr = 0.125 * np.pi * rho * (Re_cr * nu / C_D) ** 2 / A
    return C_D * A * np.sqrt(2 / rho) * p / np.sqrt(np.hypot(p, p_cr))


def table(i: Floats, k: dict[str, Floats]) -> Floats:
    """Opening [m²] at the current i [A], from its first, segment by segment."""
    way = np.clip(i - k["knot"], 0.0, k["knot_width"])
    opening: Floats = np.maximum(k["first_area"] + (way * k["knot_slope"]).sum(axis=0), k["A_floor"])
    return opening


def accelerations(s: SimpleNamespace, k: dict[str, Floats], laws: Sequence[Law]) -> Any:
    """q'' [m/s²] from M q'' = Q, the two cylinders' first, then those of the laws' coordinates."""
    inertia: Any = sum(k[mass] * way * way for mass, way in BODIES)
    free, main, between = through(laws, "masses", (inertia[0], inertia[1], 0.0), s, k)
    added = [name for law in laws for name in law.coordinates]
    if not added:
        determinant = free * main - between * between
        return np.stack(
            [
                (main * s.F[0] - between * s.F[1]) / determinant,
                (free * s.F[1] - between * s.F[0]) / determinant,
            ]
        )
    count = 2 + len(added)
    M = np.zeros_like(s.F, shape=(count, count, *s.F.shape[1:]))
    Q = np.zeros_like(s.F, shape=(count, *s.F.shape[1:]))
    M[0, 0], M[1, 1], M[0, 1], M[1, 0], Q[:2] = free, main, between, between, s.F
    at = {name: 2 + n for n, name in enumerate(added)}
    for law in laws:
        law.lagrange(M, Q, at, s, k)
    found = np.linalg.solve(np.moveaxis(M, (0, 1), (-2, -1)), np.moveaxis(Q, 0, -1)[..., None])
    return np.moveaxis(found[..., 0], -1, 0)


def rates(y: Floats, u: Floats, T: Floats, k: dict[str, Floats], laws: Sequence[Law]) -> Floats:
    """Time derivatives of the state vector at the commands u [A] and the oil temperature T [K]."""
    s = split(y, laws)
    s.u, s.T = u, T
    # friction (3.4), (3.5), (3.34), and the generalised forces on the cylinders
    s.speed = np.abs(s.v)
    F_c = through(laws, "coulomb", k["F_pr"] + k["m"] * k["f_cfr"], s, k)
    sigma_2 = through(laws, "viscous", k["sigma_2"], s, k)
    g_s = F_c * (1 + (k["K_brk"] - 1) * np.exp(-k["c_v"] * s.speed))
    dz = s.v - k["sigma_0"] * s.z / g_s * s.speed
    F_fr = k["sigma_0"] * s.z + k["sigma_1"] * dz + sigma_2 * s.v
    weight = k["g"] * sum(k[mass] * way for mass, way in BODIES)
    s.F = through(laws, "force", s.p_A * k["A"] - weight - F_fr, s, k)
    q = accelerations(s, k, laws)
    s.a = q[:2]
    # viscosity (3.1)
    s.A_valve = through(laws, "opening", table(s.i, k), s, k)
    nu = through(laws, "viscosity", k["eta_0"] * np.exp(-k["lam"] * (T - k["T_0"])), s, k)
    rho = through(laws, "density", k["rho"], s, k)
    # proportional valve (3.11)-(3.14)
    u = through(laws, "command", u, s, k)
    dz_valve = s.di - k["sigma_0h"] * s.z_valve / k["f_hs"] * np.abs(s.di)
    F_hs = k["sigma_0h"] * s.z_valve + k["sigma_1h"] * dz_valve
    ddi = k["omega"] ** 2 * (u - 2 * k["D"] / k["omega"] * s.di - s.i - F_hs)
    # flows (3.7); compensator (3.15)-(3.18); control volume (3.19)
    p_D = through(laws, "back_pressure", k["p_D"], s, k)
    s.drop = through(laws, "inlet", s.p_A, s, k) - s.p_B
    s.q_A = through(laws, "through", flow(k["C_D"], s.A_valve, k["Re_cr"], nu, rho, s.drop), s, k)
    A_comp, p_CD = np.maximum(s.A_comp, np.finfo(float).eps), s.p_B - p_D
    s.q_B = flow(k["C_Dc"], A_comp, k["Re_crc"], nu, rho, p_CD)
    p_flow = p_CD * A_comp * k["C_Dc"] * np.cos(k["theta"]) / k["A_spool"]
    slope = (k["A_max"] - k["A_leak"]) / k["p_reg"]
    sensed = through(laws, "sensed", s.drop, s, k)
    A_s = np.clip(k["A_max"] - slope * (sensed + p_flow - k["p_set"]), k["A_leak"], k["A_max"])
    dp_B = k["E"] / k["V"] * (s.q_A - s.q_B)
    # cylinder (3.2), (3.20), (3.21)
    E_A = k["a_1"] * k["E_max"] * np.log(np.maximum(k["a_2"] * s.p_A / k["p_max"] + k["a_3"], 1.05))
    s.volume = k["V_0"] + s.x * k["A"]
    capacity = through(laws, "capacity", s.volume / through(laws, "bulk_modulus", E_A, s, k), s, k)
    s.capacity = capacity
    dp_A = -(through(laws, "outflow", s.q_A, s, k) + k["A"] * s.v) / capacity
    s.dp_A = dp_A
    each = [s.di, ddi, dz_valve, s.v, s.a, dz, dp_A, dp_B, (A_s - A_comp) / k["tau"]]
    own: list[Floats] = []
    place = 2
    for law in laws:
        changes = law.rates(s, k)
        each += [changes[state] for state in law.memory]
        own += [changes[state] for state in law.shared]
        for name in law.coordinates:
            own += [getattr(s, f"{name}_rate"), q[place]]
            place += 1
    out = np.empty_like(y)
    for n, change in enumerate(each):
        out[2 * n : 2 * n + 2] = change
    for n, change in enumerate(own):
        out[2 * len(each) + n] = change
    return out

"""The parameters of both lifts, and other trucks of the same make."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Any

import numpy as np

Lift = dict[str, Any]
"""A lift's values by the letters of the thesis: floats, and the arrays ``current`` and ``area``."""

LIFTS = ("free", "main")

LETTERS = {
    "rho": "oil.density", "g": "gravity.g", "T_0": "viscosity.T_0", "p_D": "tank.pressure",
    "E": "volume.E", "V": "volume.V", "E_max": "bulk.E_max", "p_max": "bulk.p_max", "D": "valve.D",
    "sigma_0h": "valve.sigma_0", "sigma_1h": "valve.sigma_1", "C_D": "valve.C_D", "A_floor": "valve.A_min",
    "A_max": "compensator.A_max", "A_leak": "compensator.A_leak", "A_spool": "compensator.A_spool",
    "p_reg": "compensator.p_reg", "p_set": "compensator.p_set", "tau": "compensator.tau",
    "m": "mass.moving", "m_c": "cylinder.mass", "A": "cylinder.area", "V_0": "cylinder.V_0",
    "eta_0": "viscosity.nu_0", "lam": "viscosity.lambda", "a_1": "bulk.a_1", "a_2": "bulk.a_2",
    "a_3": "bulk.a_3", "F_pr": "friction.F_pr", "K_brk": "friction.K_brk", "c_v": "friction.c_v",
    "f_cfr": "friction.f_cfr", "sigma_0": "friction.sigma_0", "sigma_1": "friction.sigma_1",
    "sigma_2": "friction.sigma_2", "omega": "valve.omega", "f_hs": "valve.f_hs", "Re_cr": "valve.Re_cr",
    "C_Dc": "compensator.C_D", "Re_crc": "compensator.Re_cr", "theta": "compensator.theta",
    "current": "valve.table_current", "area": "valve.table_area",
}  # fmt: skip
"""The thesis's letters, and where their values stand in the truck's file."""

SCATTER = 0.12  # standard deviation of the logarithm of what the thesis estimated
AREA_SCATTER = 0.05  # the same of each opening of the area table
CURRENT_SCATTER_A = 0.01  # of the currents of its inner knots

ESTIMATED = (
    "eta_0", "lam", "V_0", "a_1", "a_2", "a_3", "F_pr", "K_brk", "c_v", "f_cfr", "sigma_0", "sigma_1",
    "sigma_2", "omega", "f_hs", "Re_cr", "C_Dc", "Re_crc", "theta",
)  # fmt: skip
"""What the thesis estimated; all else is known."""


def _thesis() -> tuple[Lift, Lift]:
    """Tables 5.1 and 5.2, from the shipped file."""
    text = files("forklift.plant.forklift").joinpath("trucks", "thesis.toml").read_text(encoding="utf-8")
    told = tomllib.loads(text)

    def lift(name: str) -> Lift:
        found = {}
        for letter, place in LETTERS.items():
            part, key = place.split(".")
            value = told[name][part][key]["value"]
            found[letter] = np.array(value, float) if isinstance(value, list) else float(value)
        return found

    return lift("free"), lift("main")


THESIS = _thesis()


def scattered(
    seed: int | np.random.Generator, scatter: float = SCATTER, area: float = AREA_SCATTER
) -> tuple[Lift, Lift]:
    """Both lifts of another truck; `scatter` and `area` are standard deviations of logarithms."""
    random = np.random.default_rng(seed)
    free, main = (_scattered(lift, random, scatter, area) for lift in THESIS)
    return free, main


def _scattered(lift: Lift, random: np.random.Generator, scatter: float, area_scatter: float) -> Lift:
    own = {name: lift[name] * np.exp(scatter * random.standard_normal()) for name in ESTIMATED}
    inner = np.r_[0.0, np.ones(len(lift["current"]) - 2), 0.0]
    while True:
        current = lift["current"] + CURRENT_SCATTER_A * inner * random.standard_normal(len(inner))
        area = lift["area"] * np.exp(area_scatter * random.standard_normal(len(inner)))
        if (np.diff(current) > 0.0).all() and (np.diff(area) >= 0.0).all():
            return lift | own | {"current": current, "area": area}

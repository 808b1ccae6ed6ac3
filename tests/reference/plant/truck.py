"""The parameters of both lifts, and other trucks of the same make."""

from __future__ import annotations

import numpy as np

from reference.witness import FREE, MAIN

LIFTS = ("free", "main")
THESIS = (FREE, MAIN)

SCATTER = 0.12  # standard deviation of the logarithm of what the thesis estimated
AREA_SCATTER = 0.05  # the same of each opening of the area table
CURRENT_SCATTER_A = 0.01  # of the currents of its inner knots

ESTIMATED = (
    "eta_0", "lam", "V_0", "a_1", "a_2", "a_3", "F_pr", "K_brk", "c_v", "f_cfr", "sigma_0", "sigma_1",
    "sigma_2", "omega", "f_hs", "Re_cr", "C_Dc", "Re_crc", "theta",
)  # fmt: skip
"""What the thesis estimated; all else is known."""


def scattered(seed: int) -> tuple[dict, dict]:
    """Both lifts of another truck."""
    random = np.random.default_rng(seed)
    return tuple(_scattered(lift, random) for lift in THESIS)


def _scattered(lift: dict, random: np.random.Generator) -> dict:
    own = {name: lift[name] * np.exp(SCATTER * random.standard_normal()) for name in ESTIMATED}
    inner = np.r_[0.0, np.ones(len(lift["current"]) - 2), 0.0]
    while True:
        current = lift["current"] + CURRENT_SCATTER_A * inner * random.standard_normal(len(inner))
        area = lift["area"] * np.exp(AREA_SCATTER * random.standard_normal(len(inner)))
        if (np.diff(current) > 0.0).all() and (np.diff(area) >= 0.0).all():
            return lift | own | {"current": current, "area": area}

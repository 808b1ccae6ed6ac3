"""One lift of a truck through a recording's command, by CVODE in C: what a fit without forklift runs."""

import ctypes
from collections.abc import Mapping
from pathlib import Path

import numpy as np

MOST_KNOTS = 24  # of free_lift.h

SCALE = {
    "si": 1.0,
    "sdi": 10.0,
    "szv": 0.04,
    "sx": 1.0,
    "sv": 0.5,
    "sz": 0.5,
    "spa": 1e7,
    "spb": 1e7,
    "sac": 2e-5,
}
SETTINGS = {
    "rtol": 1e-6,
    "restart": 0,
    "stop": 0,
    "order": 5,
    "nls": 0.1,
    "setup": 20,
    "jacage": 51,
    "dgamma": 0.3,
}

PARAMETERS = (
    "viscosity.nu_0", "viscosity.T_0", "viscosity.lambda", "oil.density", "gravity.g", "tank.pressure",
    "volume.V", "volume.E", "cylinder.area", "cylinder.V_0", "cylinder.mass", "cylinder.stroke_lower",
    "cylinder.stroke_upper", "mass.moving", "bulk.E_max", "bulk.p_max", "bulk.a_1", "bulk.a_2",
    "bulk.a_3", "friction.F_pr", "friction.K_brk", "friction.c_v", "friction.f_cfr", "friction.sigma_0",
    "friction.sigma_1", "friction.sigma_2", "valve.D", "valve.omega", "valve.f_hs", "valve.Re_cr",
    "valve.C_D", "valve.sigma_0", "valve.sigma_1", "valve.A_min", "compensator.A_max",
    "compensator.A_leak", "compensator.A_spool", "compensator.p_reg", "compensator.p_set",
    "compensator.tau", "compensator.C_D", "compensator.Re_cr", "compensator.theta",
)  # fmt: skip
"""A lift's parameters in the order of free_lift.h."""


class Cvode:
    """The library of lift_cvode.c at one set of settings."""

    def __init__(self, library: Path, settings: Mapping[str, float]) -> None:
        chosen = SETTINGS | SCALE | settings
        self._settings = np.array([chosen[name] for name in (*SETTINGS, *SCALE)], float)
        lib = ctypes.CDLL(str(library))
        pointer, real, whole = ctypes.c_void_p, ctypes.c_double, ctypes.c_int64
        self._simulate = lib.lift_simulate  # ctypes lets go of the interpreter's lock while it runs
        self._simulate.argtypes = [pointer, real, real, real, real, whole, pointer, pointer, pointer]
        assert lib.lift_parameter_numbers() == len(PARAMETERS) + 1 + 2 * MOST_KNOTS

    @staticmethod
    def possible(parameters: np.ndarray) -> bool:
        """Whether the valve's table rises from knot to knot."""
        at = len(PARAMETERS)
        current, area = parameters[at + 1 :].reshape(2, MOST_KNOTS)[:, : int(parameters[at])]
        return bool((np.diff(current) > 0.0).all() and (np.diff(area) >= 0.0).all())

    def __call__(
        self,
        parameters: np.ndarray,
        load_kg: float,
        temperature_degc: float,
        start_m: float,
        tick_s: float,
        command_a: np.ndarray,
    ) -> np.ndarray | None:
        """(n, 4) x, v, p_A, p_B at n samples a tick apart, whose command is held.

        None of an impossible lift, and if CVODE gives up.
        """
        if not self.possible(parameters):
            return None
        ticks = len(command_a) - 1
        command = np.ascontiguousarray(command_a, float)
        out = np.empty((ticks + 1, 4))
        done = self._simulate(
            parameters.ctypes.data, load_kg, temperature_degc, start_m, tick_s, ticks,
            command.ctypes.data, self._settings.ctypes.data, out.ctypes.data,
        )  # fmt: skip
        return out if done and np.isfinite(out).all() else None


def parameters_of(values: Mapping[str, float], lift: str) -> np.ndarray:
    """What `Cvode` wants, from a truck's numbers by full name (knots numbered)."""
    scalars = [values[f"{lift}.{name}"] for name in PARAMETERS]
    current, area = (
        [values[name] for name in values if name.startswith(f"{lift}.valve.table_{column}.")]
        for column in ("current", "area")
    )
    rest = [0.0] * (MOST_KNOTS - len(current))
    return np.array([*scalars, len(current), *current, *rest, *area, *rest], float)

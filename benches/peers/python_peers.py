"""Peers driven from Python on compiled functions: scikit-sundae's CVODE, two LSODAs, SciPy's Radau and BDF.

The right-hand side and Jacobian are those of free_lift.h, called from numba without passing through Python.
Each lowering is one call; the command is read by time, as in the C peers without stops.
"""

import ctypes
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from lowerings import START_M, TICK_S, Lowerings
from numba import njit
from scipy.integrate import odeint, solve_ivp
from sksundae.cvode import CVODE

SHOWN = [3, 4, 6, 7]  # x, v, p_A, p_B among the nine states
SCALE = np.array([1, 10, 0.04, 1, 0.5, 0.5, 1e7, 1e7, 2e-5])  # A, A/s, A, m, m/s, m, Pa, Pa, m²

Solve = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float], np.ndarray]


class Lift:
    """The functions of free_lift.so, and the four methods upon them."""

    def __init__(self, library: Path) -> None:
        lib = ctypes.CDLL(str(library))
        pointer, real = ctypes.c_void_p, ctypes.c_double
        lib.lift_set.argtypes = [pointer, real, real]
        lib.lift_at_rest.argtypes = [pointer, real, pointer]
        lib.lift_rates.argtypes = [pointer, real, pointer, pointer]
        lib.lift_jacobian.argtypes = [pointer, pointer, pointer]
        for function in (lib.lift_set, lib.lift_at_rest, lib.lift_rates, lib.lift_jacobian):
            function.restype = None
        self._lib, self._numbers = lib, lib.lift_numbers()
        c_rates, c_jacobian = lib.lift_rates, lib.lift_jacobian

        @njit
        def fill(t, y, dy, k, command):
            tick = min(max(int(t / TICK_S), 0), len(command) - 1)
            c_rates(k.ctypes, command[tick], y.ctypes, dy.ctypes)

        @njit
        def rates(t, y, k, command):
            dy = np.empty(9)
            fill(t, y, dy, k, command)
            return dy

        @njit
        def jacobian(t, y, k, command):
            columns = np.empty((9, 9))
            c_jacobian(k.ctypes, y.ctypes, columns.ctypes)
            return columns.T

        @njit
        def fill_jacobian(t, y, jac, k):
            columns = np.empty((9, 9))
            c_jacobian(k.ctypes, y.ctypes, columns.ctypes)
            jac[:] = columns.T

        self._fill, self._rates, self._jacobian, self._fill_jacobian = fill, rates, jacobian, fill_jacobian

    def integrate(self, solve: Solve, lowerings: Lowerings, rtol: float) -> tuple[np.ndarray, float]:
        """All lowerings by one method; trajectories and processor seconds, as the C peers give."""
        out = np.empty((len(lowerings), lowerings.command_a.shape[1] + 1, 4))
        times = np.arange(out.shape[1]) * TICK_S
        self._one(solve, lowerings, 0, times[:3], rtol)  # compiles
        begin = time.process_time()
        for n in range(len(lowerings)):
            out[n] = self._one(solve, lowerings, n, times, rtol)[:, SHOWN]
        return out, time.process_time() - begin

    def _one(self, solve: Solve, lowerings: Lowerings, n: int, times: np.ndarray, rtol: float) -> np.ndarray:
        k, y = np.empty(self._numbers), np.empty(9)
        self._lib.lift_set(k.ctypes.data, lowerings.load_kg[n], lowerings.temperature_degc[n])
        self._lib.lift_at_rest(k.ctypes.data, START_M, y.ctypes.data)
        return solve(k, lowerings.command_a[n], y, times, rtol)

    def at_rest(self, lowerings: Lowerings) -> tuple[np.ndarray, np.ndarray]:
        """By lowering the numbers of free_lift.h, and the nine states at rest."""
        numbers, starts = np.empty((len(lowerings), self._numbers)), np.empty((len(lowerings), 9))
        for n, (k, y) in enumerate(zip(numbers, starts, strict=True)):
            self._lib.lift_set(k.ctypes.data, lowerings.load_kg[n], lowerings.temperature_degc[n])
            self._lib.lift_at_rest(k.ctypes.data, START_M, y.ctypes.data)
        return numbers, starts

    def sundae(self, k, command, y, times, rtol):
        """CVODE through scikit-sundae, order 3 as in the best setting of the C peer."""

        def rates(t, y, dy):
            self._fill(t, y, dy, k, command)

        def jacobian(t, y, dy, jac):
            self._fill_jacobian(t, y, jac, k)

        solver = CVODE(rates, rtol=rtol, atol=rtol * SCALE, jacfn=jacobian, max_order=3, max_num_steps=10**7)
        return solver.solve(times, y).y

    def lsoda(self, k, command, y, times, rtol):
        """LSODA (ODEPACK) through scipy.integrate.odeint."""
        return odeint(
            self._rates, y, times, (k, command), self._jacobian, tfirst=True,
            rtol=rtol, atol=rtol * SCALE, mxstep=10**7,
        )  # fmt: skip

    def numbalsoda(self, k, command, y, times, rtol):
        """LSODA in C++ through numbalsoda: no Python within a lowering; its own difference quotients."""
        import numbalsoda

        address = ctypes.cast(self._lib.lift_rates_scaled, ctypes.c_void_p).value
        data = np.concatenate([[TICK_S, len(command)], k, SCALE, command])
        states, done = numbalsoda.lsoda(address, y / SCALE, times, data, rtol, rtol, 10**7)
        if not done:
            raise RuntimeError("numbalsoda: LSODA did not reach the end")
        return states * SCALE

    def radau(self, k, command, y, times, rtol):
        """SciPy's Radau, order 5."""
        return self._solve_ivp("Radau", k, command, y, times, rtol)

    def bdf(self, k, command, y, times, rtol):
        """SciPy's BDF, orders 1 to 5."""
        return self._solve_ivp("BDF", k, command, y, times, rtol)

    def _solve_ivp(self, method, k, command, y, times, rtol):
        done = solve_ivp(
            self._rates, (times[0], times[-1]), y, method, times, args=(k, command), jac=self._jacobian,
            rtol=rtol, atol=rtol * SCALE,
        )  # fmt: skip
        return done.y.T

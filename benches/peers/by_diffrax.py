"""A peer on JAX: diffrax's implicit Runge–Kutta methods, all lowerings at once under vmap, on the processor.

The right-hand side is that of free_lift.h, written once more in jax.numpy, as diffrax differentiates it
itself. What does not change within a lowering comes from free_lift.h. Double precision; compiling is not
timed.
"""

import time
from collections.abc import Callable

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from lowerings import TICK_S, Lowerings

jax.config.update("jax_enable_x64", True)

SHOWN = [3, 4, 6, 7]
NUMBERS = [
    "kappa", "kappa_c", "weight", "inertia", "friction", "c_flow", "root", "root_c", "w2", "two_d_w",
    "s0_f", "s0", "s1", "k_brk", "c_v", "sigma_0", "sigma_1", "sigma_2", "area", "v_0", "e_a", "e_slope",
    "e_offset", "e_volume", "p_tank", "a_min", "a_max", "a_leak", "slope", "p_set", "tau", "lower", "knots",
]  # fmt: skip
MOST_KNOTS = 24
MOST_STEPS = 200_000


def _flow(root, kappa, a, p):
    """Through an orifice [m³/s], (3.7)."""
    critical = kappa / a
    return root * a * p * (p * p + critical * critical) ** -0.25


def _rates(t, y, given):
    """Of the nine states, as free_lift_rates has them; `given` the numbers, the table, the commands."""
    k, current, opening, command, scale = given
    i, di, zv, _, v, z, p_a, p_b, a_comp = y * scale
    u = command[jnp.clip((t / TICK_S).astype(int), 0, len(command) - 1)]
    dzv = di - k["s0_f"] * zv * jnp.abs(di)
    a_v = jnp.maximum(jnp.interp(i, current, opening), k["a_min"])
    a_c, p_c = jnp.maximum(a_comp, 1e-15), p_b - k["p_tank"]
    q_a = _flow(k["root"], k["kappa"], a_v, p_a - p_b)
    q_b = _flow(k["root_c"], k["kappa_c"], a_c, p_c)
    a_s = k["a_max"] - k["slope"] * (p_a - p_b + p_c * a_c * k["c_flow"] - k["p_set"])
    e_a = k["e_a"] * jnp.log(jnp.maximum(k["e_slope"] * p_a + k["e_offset"], 1.05))
    g_s = k["friction"] * (1.0 + (k["k_brk"] - 1.0) * jnp.exp(-k["c_v"] * jnp.abs(v)))
    dz = v - k["sigma_0"] * z / g_s * jnp.abs(v)
    force = p_a * k["area"] - k["weight"] - k["sigma_0"] * z - k["sigma_1"] * dz - k["sigma_2"] * v
    volume = jnp.maximum(k["v_0"] + y[3] * scale[3] * k["area"], 0.1 * k["v_0"])
    rates = [
        di,
        k["w2"] * (u - k["two_d_w"] * di - i - k["s0"] * zv - k["s1"] * dzv),
        dzv,
        v,
        force / k["inertia"],
        dz,
        e_a / volume * (-q_a - k["area"] * v),
        k["e_volume"] * (q_a - q_b),
        (jnp.clip(a_s, k["a_leak"], k["a_max"]) - a_comp) / k["tau"],
    ]
    return jnp.stack(rates) / scale


def solver(
    numbers: np.ndarray, starts: np.ndarray, scale: np.ndarray, lowerings: Lowerings, rtol: float
) -> Callable[[], tuple[np.ndarray, float]]:
    """What integrates all lowerings and gives x, v, p_A, p_B at each tick, and its processor seconds.

    `numbers` (n, of a free_lift) and `starts` (n, 9) come from free_lift.h; states are in units of `scale`.
    """
    k = {name: jnp.array(numbers[:, place]) for place, name in enumerate(NUMBERS)}
    last = int(numbers[0, NUMBERS.index("knots")])
    table = len(NUMBERS)
    current = numbers[:, table : table + last]
    opening = numbers[:, table + MOST_KNOTS : table + MOST_KNOTS + last]
    ticks = lowerings.command_a.shape[1]
    times = jnp.arange(ticks + 1) * TICK_S

    def one(k, current, opening, command, y):
        done = diffrax.diffeqsolve(
            diffrax.ODETerm(_rates),
            diffrax.Kvaerno5(),
            0.0,
            ticks * TICK_S,
            1e-4,
            y,
            (k, current, opening, command, jnp.array(scale)),
            saveat=diffrax.SaveAt(ts=times),
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=rtol),
            max_steps=MOST_STEPS,
        )
        return done.ys

    every = jax.jit(jax.vmap(one))
    tables = (jnp.array(current), jnp.array(opening), jnp.array(lowerings.command_a))
    given = (k, *tables, jnp.array(starts / scale))
    every(*given).block_until_ready()

    def run() -> tuple[np.ndarray, float]:
        start = time.process_time()
        states = every(*given).block_until_ready()
        spent = time.process_time() - start
        return np.asarray(states * scale)[:, :, SHOWN], spent

    return run

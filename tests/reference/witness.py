"""A second, independent statement of the thesis's model: the whole truck on one page of NumPy.

Fri & Fahlén, *Modelling and Control of a Forklift's Hydraulic Lowering Function* (Linköping University,
LiTH-ISY-EX--17/5050--SE, 2017), chapter 3, with the values of Tables 5.1 and 5.2. It shares no code with
the Rust core, is written for reading rather than speed, and exists to be compared with. Everything is in
SI units; x and v are the cylinder's and positive upward, a load is the mass on the forks.
"""

import numpy as np
from scipy.integrate import solve_ivp

COMMON = dict(
    rho=860.0, g=9.82, T_0=293.0, p_D=1e5, E=7e8, V=2000e-9,  # oil, tank, control volume
    E_max=18000e5, p_max=280e5, D=1.0, sigma_0h=0.5, sigma_1h=0.1, C_D=0.67, A_floor=1e-9,  # valve
    A_max=100e-6, A_leak=1e-9, A_spool=3.14e-4, p_reg=2.7e5, p_set=5.4e5, tau=0.01,  # compensator
)  # fmt: skip

FREE = COMMON | dict(
    m=278.0, m_c=12.6, A=np.pi * (0.055 / 2) ** 2, V_0=0.0055302, x_0=0.98,
    eta_0=4.45e-5, lam=0.0050814, a_1=0.15703, a_2=11.841, a_3=367.5,
    F_pr=113.81, K_brk=3.769, c_v=261.2, f_cfr=2.6445, sigma_0=2517.2, sigma_1=14342.0, sigma_2=4137.8,
    omega=34.327, f_hs=0.018723, Re_cr=5543.9, C_Dc=0.84417, Re_crc=18546.0, theta=0.63222,
    current=np.array([0, 0.36, 0.45, 0.60, 0.80, 1.0, 1.2, 1.4]),
    area=np.array([0, 0, 0.13, 0.66, 1.55, 2.6, 3.7, 4.4]) * 1e-5,
)  # fmt: skip

MAIN = COMMON | dict(
    m=520.0, m_c=283.0, A=2 * np.pi * (0.04 / 2) ** 2, V_0=0.0054528, x_0=1.96,
    eta_0=4.29e-5, lam=0.0070604, a_1=0.13983, a_2=5.7224, a_3=202.59,
    F_pr=269.6, K_brk=7.3149, c_v=254.49, f_cfr=2.68e-5, sigma_0=5976.3, sigma_1=16163.0, sigma_2=21997.0,
    omega=47.015, f_hs=0.023916, Re_cr=5931.0, C_Dc=0.7342, Re_crc=5370.9, theta=0.17686,
    current=np.array([0, 0.40, 0.50, 0.60, 0.80, 1.0, 1.2, 1.4]),
    area=np.array([0, 0, 0.16, 0.52, 1.7, 3.3, 5.1, 6.8]) * 1e-5,
)  # fmt: skip

STATES = ("i", "di", "z_valve", "x", "v", "z", "p_A", "p_B", "A_comp")
ATOL = np.array([1e-9, 1e-8, 1e-10, 1e-9, 1e-9, 1e-11, 1e-1, 1e-1, 1e-13])  # A, A/s, A, m, m/s, m, Pa, Pa, m²


def flow(C_D, A, Re_cr, nu, rho, p):
    """Flow [m³/s] through area A [m²] under the pressure drop p [Pa]; nu in m²/s. (3.7)-(3.9)"""
    p_cr = rho / 2 * (Re_cr * nu / (C_D * np.sqrt(4 * A / np.pi))) ** 2
    return C_D * A * np.sqrt(2 / rho) * p / (p**2 + p_cr**2) ** 0.25


def rates(y, u, k, m, T):
    """Time derivatives of STATES under the command u [A]; k a lift, m moving mass and load [kg], T [K]."""
    i, di, z_valve, x, v, z, p_A, p_B, A_comp = y
    nu = k["eta_0"] * np.exp(-k["lam"] * (T - k["T_0"]))  # (3.1)
    # proportional valve (3.11)-(3.14)
    dz_valve = di - k["sigma_0h"] * z_valve / k["f_hs"] * np.abs(di)
    F_hs = k["sigma_0h"] * z_valve + k["sigma_1h"] * dz_valve
    ddi = k["omega"] ** 2 * (u - 2 * k["D"] / k["omega"] * di - i - F_hs)
    A_valve = np.maximum(np.interp(i, k["current"], k["area"]), k["A_floor"])
    q_A = flow(k["C_D"], A_valve, k["Re_cr"], nu, k["rho"], p_A - p_B)
    # pressure compensator (3.15)-(3.18), A.10; control volume (3.19), tank 3.2.6
    A_comp, p_CD = np.maximum(A_comp, np.finfo(float).eps), p_B - k["p_D"]
    p_flow = p_CD * A_comp * k["C_Dc"] * np.cos(k["theta"]) / k["A_spool"]
    slope = (k["A_max"] - k["A_leak"]) / k["p_reg"]
    A_s = np.clip(k["A_max"] - slope * (p_A - p_B + p_flow - k["p_set"]), k["A_leak"], k["A_max"])
    dA_comp = (A_s - A_comp) / k["tau"]
    q_B = flow(k["C_Dc"], A_comp, k["Re_crc"], nu, k["rho"], p_CD)
    dp_B = k["E"] / k["V"] * (q_A - q_B)
    # cylinder (3.2), (3.20), (3.21)
    E_A = k["a_1"] * k["E_max"] * np.log(k["a_2"] * p_A / k["p_max"] + k["a_3"])
    dp_A = E_A / (k["V_0"] + x * k["A"]) * (-q_A - k["A"] * v)
    # friction (3.4), (3.5), (3.34) and force balance (3.27), (3.33)
    g_s = (k["F_pr"] + m * k["f_cfr"]) * (1 + (k["K_brk"] - 1) * np.exp(-k["c_v"] * np.abs(v)))
    dz = v - k["sigma_0"] * z / g_s * np.abs(v)
    F_fr = k["sigma_0"] * z + k["sigma_1"] * dz + k["sigma_2"] * v
    dv = (p_A * k["A"] - (k["m_c"] + 2 * m) * k["g"] - F_fr) / (k["m_c"] + 4 * m)
    return np.array([di, ddi, dz_valve, v, dv, dz, dp_A, dp_B, dA_comp])


def at_rest(lift, load_kg):
    """The state at rest at x_0: the cylinder carries the weight, the volume half its pressure."""
    p_A = (lift["m_c"] + 2 * (lift["m"] + load_kg)) * lift["g"] / lift["A"]
    return np.array([0, 0, 0, lift["x_0"], 0, 0, p_A, p_A / 2, lift["A_leak"]])


def simulate(lift, time, command, load_kg, temperature_degc, rtol=1e-8):
    """The states at `time` [s], shape (len(time), 9), with command[n] [A] held from time[n] to time[n+1]."""
    m, T = lift["m"] + load_kg, temperature_degc + 273.0
    y = [at_rest(lift, load_kg)]
    for n in range(len(time) - 1):
        step = solve_ivp(
            lambda t, y, u=command[n]: rates(y, u, lift, m, T), (time[n], time[n + 1]), y[-1],
            method="Radau", rtol=rtol, atol=ATOL * (rtol / 1e-8), vectorized=True,
        )  # fmt: skip
        y.append(step.y[:, -1])
    return np.array(y)

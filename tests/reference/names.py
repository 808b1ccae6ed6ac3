"""What a lift's values are called: by the witness's letters, the truck file's names."""

NAMES = {
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

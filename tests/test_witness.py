"""The NumPy witness agrees with the reference trajectories, each computed without the other's code."""

import numpy as np
import pytest

from reference import trajectory, witness

LIFTS = {"free": witness.FREE, "main": witness.MAIN}


def test_all_reference_trajectories_are_here():
    assert len(trajectory.NAMES) == 12


@pytest.mark.parametrize(
    "name", ["free_prms1_800kg_40c", "free_steps_1500kg_60c", "main_prms1_0kg_20c", "main_steps_1500kg_60c"]
)
def test_witness_agrees_with_reference(name):
    ref = trajectory.read(name, duration_s=4.0)
    y = witness.simulate(
        LIFTS[ref.lift], ref.time_s, ref.command_a, ref.load_kg, ref.temperature_degc, rtol=1e-7
    )
    i, _, _, x, v, _, p_A, p_B, _ = y.T
    assert np.abs(ref.cylinder_velocity_m_s).max() > 0.05  # the forks do move
    np.testing.assert_allclose(i, ref.valve_current_a, rtol=0, atol=1e-6)
    np.testing.assert_allclose(x, ref.cylinder_position_m, rtol=0, atol=1e-7)
    np.testing.assert_allclose(v, ref.cylinder_velocity_m_s, rtol=0, atol=1e-6)
    np.testing.assert_allclose(p_A, ref.cylinder_pressure_pa, rtol=1e-5)
    np.testing.assert_allclose(p_B / p_A, ref.volume_pressure_pa / ref.cylinder_pressure_pa, atol=1e-4)


@pytest.mark.parametrize("lift", LIFTS)
def test_rest_is_an_equilibrium_of_the_force_balance(lift):
    k = LIFTS[lift]
    dv = witness.rates(witness.at_rest(k, 800.0), 0.0, k, k["m"] + 800.0, 313.0)[4]
    assert abs(dv) < 1e-12

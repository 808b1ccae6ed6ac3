"""The numbers by which docs/reading.md decides between two readings of the thesis, row by row."""

import math

import numpy as np
import pytest

from forklift import Truck, commands, simulate

VALUES = Truck.read("thesis").values
PASCAL_PER_MPA = 1e6


def of(lift: str) -> dict[str, float]:
    return {name.partition(".")[2]: value for name, value in VALUES.items() if name.startswith(f"{lift}.")}


def holding_pressure(lift: str, load_kg: float, cylinders: float = 1.0) -> float:
    """p_A in (3.27) or (3.33) at rest [Pa]; `cylinders` scales the area."""
    p = of(lift)
    weight = (p["cylinder.mass"] + 2 * (p["mass.moving"] + load_kg)) * p["gravity.g"]
    return weight / (cylinders * p["cylinder.area"])


def period(lift: str, load_kg: float, x: float, logarithm=math.log, cylinders: float = 1.0) -> float:
    """Of the undamped swing of mass on oil, 2π√(MV/(E·A²)) from (3.20) and (3.27) [s]."""
    p = of(lift)
    area = cylinders * p["cylinder.area"]
    pressure = holding_pressure(lift, load_kg, cylinders)
    ratio = p["bulk.a_2"] * pressure / p["bulk.p_max"] + p["bulk.a_3"]
    bulk = p["bulk.a_1"] * p["bulk.E_max"] * logarithm(ratio)
    inertia = p["cylinder.mass"] + 4 * (p["mass.moving"] + load_kg)
    return 2 * math.pi * math.sqrt(inertia * (p["cylinder.V_0"] + area * x) / bulk) / area


def test_row_1_the_natural_logarithm_gives_the_period_of_section_4_5_2():
    assert period("free", 800.0, 0.98) == pytest.approx(0.38, abs=0.005)
    assert period("free", 800.0, 0.98, math.log10) == pytest.approx(0.57, abs=0.005)


def test_row_2_a_single_main_cylinder_could_not_carry_the_load():
    alone = holding_pressure("main", 1500.0, cylinders=0.5) / PASCAL_PER_MPA
    assert alone == pytest.approx(34, abs=0.5)
    assert alone > VALUES["main.bulk.p_max"] / PASCAL_PER_MPA == 28
    assert period("main", 800.0, 0.98, cylinders=0.5) == pytest.approx(0.83, abs=0.005)


def test_row_3_the_viscosity_is_a_hydraulic_oils_if_it_is_kinematic():
    assert VALUES["free.viscosity.nu_0"] * 1e6 == pytest.approx(44.5)  # mm2/s


def test_row_10_friction_with_the_total_mass_fits_the_axis_of_figure_3_5():
    p = of("free")
    speed = 0.6 / 2  # of the cylinder
    friction = (
        p["friction.F_pr"] + (p["mass.moving"] + 1000.0) * p["friction.f_cfr"] + p["friction.sigma_2"] * speed
    )
    assert friction == pytest.approx(4.7e3, abs=50)
    assert friction < 5e3


def test_row_15_the_derivative_filter_is_a_low_pass_of_20_radians_a_second():
    pole = math.exp(-20.0 * 0.02)
    assert round(pole, 4) == 0.6703
    assert round(1 - pole, 4) == 0.3297


def test_row_16_the_scale_of_the_controllers_table_in_kelvin():
    def scale(degc: float) -> float:
        return -0.0030497 * (degc + 273) + 1.8571  # Table 5.3, free lift

    assert scale(20) == pytest.approx(0.96, abs=0.005)
    assert scale(60) == pytest.approx(0.84, abs=0.005)


def test_row_21_a_slit_of_the_encoder():
    assert math.pi * 80 / 128 == pytest.approx(1.963, abs=0.0005)


def test_row_23_an_abrupt_stop_goes_beyond_the_maximum_pressure():
    current = commands.steps_to_current(np.repeat([0, 174, 0], [50, 19, 60]))
    command = commands.Command.of_samples(50.0, main=current)
    stop = simulate(Truck.read("thesis"), command, load_kg=1500.0, oil_temperature_degc=60.0, lifts="main")
    assert stop["pressure_main_pa"].max() > VALUES["main.bulk.p_max"]


def test_the_flow_force_is_a_fraction_of_the_drop_that_makes_it():
    def fraction(lift: str) -> float:
        p = of(lift)
        force = p["compensator.C_D"] * math.cos(p["compensator.theta"]) / p["compensator.A_spool"]
        return p["compensator.A_max"] * force

    assert fraction("free") == pytest.approx(0.22, abs=0.005)
    assert fraction("main") == pytest.approx(0.23, abs=0.005)

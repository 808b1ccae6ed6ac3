"""Effects that are absent are left out of what a run is known by, and nothing else is."""

import pytest

from forklift.plant.forklift.absent import without_absent

LEAK = "main.leakage.coefficient"
HUMP = {"free.friction_position.rise": 0.0, "free.friction_position.centre": 0.3}
CURVE = {f"free.free_shape.shape_{k}": 0.0 for k in range(7)} | {"free.free_shape.lower": 1.0}
PLAIN = {"free.friction.sigma_2": 4000.0, "dither.amplitude": 1e-3, "free.valve.area_3": 1e-6}


@pytest.mark.parametrize("absent", [{LEAK: 0.0}, HUMP, CURVE])
def test_an_effect_whose_amplitudes_are_all_quiet_is_left_out_with_its_further_parameters(absent):
    assert without_absent(PLAIN | absent, ()) == PLAIN


@pytest.mark.parametrize(
    "present",
    [{LEAK: 1e-14}, HUMP | {"free.friction_position.rise": -0.1}, CURVE | {"free.free_shape.shape_6": 1e-9}],
)
def test_one_that_acts_is_kept_whole(present):
    assert without_absent(PLAIN | present, ()) == PLAIN | present


def test_one_that_is_switched_off_in_a_truck_that_has_it_is_kept():
    assert without_absent(PLAIN | {LEAK: 0.0}, {LEAK: 1e-12}) == PLAIN | {LEAK: 0.0}

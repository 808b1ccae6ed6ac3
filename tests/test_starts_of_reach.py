"""A cushion is looked for where the lift came by: one that turned back before its stop met no shorter one."""

from __future__ import annotations

from itertools import pairwise

import pytest

from forklift.plant.forklift.hypotheses import effect_specs, starting_values

LENGTH = next(one for one in effect_specs()["end_cushion"]["parameters"] if one["name"] == "length")


@pytest.mark.parametrize("stop", [0.0, 0.15])
@pytest.mark.parametrize("lowest", [0.0, 0.02, 0.13])
def test_every_start_reaches_to_where_the_lift_came_by(stop, lowest):
    highest = 0.9
    lengths = [length for (length,) in starting_values("end_cushion", (stop + lowest, stop + highest), stop)]
    assert lengths == sorted(set(lengths))
    assert all(lowest < one <= LENGTH["upper"] for one in lengths)
    assert lengths[0] < lowest + LENGTH["plausible_upper"]  # a short way into what it travelled
    assert lengths[-1] == pytest.approx(min(highest, LENGTH["upper"]))  # and all of it, as far as may be
    ratios = [after / before for before, after in pairwise(lengths)]
    assert max(ratios) < 2.5  # from 0.05 m a search ends at 0.053 m where the cushion has 0.17 m


def test_without_an_encoder_it_starts_where_it_is_plausible():
    lengths = [length for (length,) in starting_values("end_cushion", None)]
    assert all(LENGTH["plausible_lower"] < one < LENGTH["plausible_upper"] for one in lengths)


def test_a_lift_below_its_stop_by_a_count_starts_there():
    lengths = [length for (length,) in starting_values("end_cushion", (-0.001, 0.4), 0.0)]
    assert lengths[0] >= LENGTH["plausible_lower"]

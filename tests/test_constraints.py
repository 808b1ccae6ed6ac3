"""Bounds and priors that the caller of a fit gives."""

import numpy as np
import pytest

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, fit
from forklift.fitting.constraints import constrained
from forklift.plant.forklift.unknowns import unknowns
from small_campaign import raised

TRUCK = Truck.read("thesis")
EVERY = unknowns(TRUCK, ("free",))
NAME = "free.friction.sigma_2"


def unknown(name: str = NAME, **given: dict[str, tuple[float, float]]):
    found = constrained(EVERY, given.get("bounds", {}), given.get("priors", {}))
    return next(one for one in found if one.name == name)


@pytest.mark.parametrize("name", [one.name for one in EVERY if not one.name[-1].isdigit()])
def test_bounds_are_the_ends_and_nothing_else_moves(name):
    plain = unknown(name)
    at = [float(plain.values(theta)[0]) for theta in (-0.1, 0.0, 0.2)]
    low, high = min(at), max(at)
    one = unknown(name, bounds={name: (low, high)})
    assert sorted(float(one.values(end)[0]) for end in (one.lower, one.upper)) == pytest.approx([low, high])
    assert (one.start, one.width) == (plain.start, plain.width)


def test_a_prior_moves_the_start_and_the_width_and_leaves_the_ends():
    plain = unknown()
    mean, deviation = 1.1 * plain.start[0], 0.01 * plain.start[0]
    one = unknown(priors={NAME: (mean, deviation)})
    assert float(one.values(0.0)[0]) == pytest.approx(mean)
    assert float(one.slopes(0.0)[0]) == pytest.approx(deviation)
    for end, other in ((one.lower, plain.lower), (one.upper, plain.upper)):
        assert float(one.values(end)[0]) == pytest.approx(float(plain.values(other)[0]))


def test_both_together():
    mean = 1.1 * unknown().start[0]
    one = unknown(priors={NAME: (mean, 0.1 * mean)}, bounds={NAME: (0.9 * mean, 1.2 * mean)})
    assert float(one.values(one.upper)[0]) == pytest.approx(1.2 * mean)


START = unknown().start[0]


@pytest.mark.parametrize(
    ("what", "given", "code"),
    [
        ("bounds", {"free.friction.sigma_3": (1.0, 2.0)}, "argument-invalid"),
        ("bounds", {NAME: 3.0}, "argument-invalid"),
        ("bounds", {NAME: (1.0, 2.0, 3.0)}, "argument-invalid"),
        ("bounds", {NAME: ("a", "b")}, "argument-invalid"),
        ("bounds", {NAME: (2.0 * START, 0.5 * START)}, "bounds-invalid"),
        ("bounds", {NAME: (1.1 * START, 1.2 * START)}, "bounds-invalid"),
        ("bounds", {NAME: (-1e9, 1e9)}, "bounds-invalid"),
        ("bounds", {NAME: (np.nan, 1e9)}, "bounds-invalid"),
        ("bounds", [NAME], "argument-invalid"),
        ("priors", {NAME: (START, 0.0)}, "prior-invalid"),
        ("priors", {NAME: (START, -1.0)}, "prior-invalid"),
        ("priors", {NAME: (START, np.inf)}, "prior-invalid"),
        ("priors", {NAME: (-1e9, 1.0)}, "prior-invalid"),
        ("priors", {"free.valve.table_area.3": (1e-5, 1e-6)}, "argument-invalid"),
    ],
)
def test_what_is_wrong_is_told(what, given, code):
    other = {"bounds": {}, "priors": {}} | {what: given}
    error = raised(constrained, EVERY, other["bounds"], other["priors"])
    assert error.code == code
    assert error.message.startswith(what) or what in error.message


def test_what_moves_together_has_none_of_its_own():
    pair = ("free.friction.sigma_2", "main.friction.sigma_2")
    both = unknowns(TRUCK, ("free", "main"), together=[pair])
    assert raised(constrained, both, {pair[0]: (0.0, 1e9)}, {}).code == "argument-invalid"


def test_a_fit_stays_within_them_and_says_so():
    campaign = Campaign.read(CAMPAIGNS / "null")
    few = Campaign("few", campaign.sample_rate_hz, campaign.estimate[:1] + campaign.validate[:1])
    hold = [one.name for one in EVERY if one.name != NAME]
    free = fit(few, TRUCK, hold=hold, starts=1)
    best, start = float(free.truck.values[NAME]), float(TRUCK.values[NAME])
    assert abs(best - start) > 1e-6 * start
    ends = (0.5 * (start + best), 2.0 * start) if best < start else (0.1 * start, 0.5 * (start + best))
    found = fit(few, TRUCK, hold=hold, starts=1, bounds={NAME: ends})
    assert ends[0] * (1 - 1e-9) <= float(found.truck.values[NAME]) <= ends[1] * (1 + 1e-9)
    assert found.to_dict()["options"]["bounds"] == {NAME: list(ends)}
    tight = fit(few, TRUCK, hold=hold, starts=1, priors={NAME: (start, 1e-6 * start)})
    assert abs(float(tight.truck.values[NAME]) - start) < 0.5 * abs(best - start)

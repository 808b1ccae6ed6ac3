"""A campaign that cannot support a fit is refused in one sentence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from campaigns import CAMPAIGNS
from forklift import Campaign
from forklift.plant.forklift.checks.suitability import suitability
from forklift.recordings.channels import LIFTS
from invalid_campaign import (
    F0,
    F1,
    F8,
    M0,
    M1,
    M8,
    PF,
    PM,
    THESIS,
    XF,
    XM,
    B,
    H,
    Mutation,
    chain,
    clock,
    column,
    commanded_with,
    dead,
    each,
    every,
    exchanged,
    good,
    held,
    later,
    level,
    lost,
    only,
    other_lift,
    response_of,
    then,
    times,
    without,
)
from small_campaign import raised
from test_broken_campaigns import check_sentence


@dataclass(frozen=True)
class Broken:
    """What breaks a good campaign, and what is said of it."""

    name: str
    code: str
    mutation: Mutation
    says: tuple[str, ...]
    facts: dict[str, Any] = field(default_factory=dict)


BROKEN = [
    # nothing to fit
    Broken(
        "only validate recordings",
        "estimate-missing",
        lambda found: [r for r in found if r.role == "validate"],
        ("2 recordings", 'role = "estimate"'),
    ),
    Broken("no recordings", "estimate-missing", lambda found: [], ("0 recordings",)),
    # no excitation
    Broken(
        "valves never opened",
        "no-excitation",
        each(commanded_with(level(0.3))),
        ("current_free_a", "300 mA", "0.36 A", F0),
        {"channel": "current_free_a", "value": 0.3},
    ),
    Broken(
        "one level",
        "no-excitation",
        each(commanded_with(level(0.7))),
        ("one level only", "0.7 A", "current_main_a"),
        {"channel": "current_free_a"},
    ),
    Broken(
        "commanded, but never moving",
        "no-excitation",
        each(response_of(level(0.0))),
        ("free lift moves by at most 0 m", F0, "19.6 mm"),
        {"channel": XF},
    ),
    Broken(
        "one lift, never commanded above its opening",
        "no-excitation",
        then(only("main"), each(commanded_with(level(0.0)))),
        ("current_main_a is at most 0 A", "0.4 A"),
        {"lift": "main"},
    ),
    # a dead or stuck channel
    Broken(
        "dead pressure",
        "channel-stuck",
        each(column(PF, dead), F0),
        (PF, "0.00 to 7.98 s", "ignore"),
        {"file": F0, "channel": PF, "from_s": 0.0, "files": [F0]},
    ),
    Broken(
        "pressure dead at zero", "channel-stuck", each(column(PM, times(0.0)), M1), (PM, "0 Pa"), {"file": M1}
    ),
    Broken(
        "dead pressure everywhere",
        "channel-stuck",
        each(column(PM, dead)),
        (PM, M0),
        {"file": M0, "channel": PM},
    ),
    Broken(
        "dead pressure of the resting lift",
        "channel-stuck",
        each(column(PM, dead), F1),
        (PM,),
        {"file": F1, "channel": PM},
    ),
    Broken(
        "pressure stuck for 0.8 s",
        "channel-stuck",
        each(column(PF, held(200, 240)), F8),
        (PF, "4.00 to 4.78 s"),
        {"file": F8, "channel": PF, "samples": 40},
    ),
    Broken(
        "height stuck",
        "channel-stuck",
        each(column(H, held(150, 400)), M0),
        (H, "3.00 to 7.98 s"),
        {"file": M0, "channel": H},
    ),
    Broken(
        "dead encoder",
        "channel-stuck",
        each(column(XF, dead), F0),
        (XF, "forks move"),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "dead encoder, no height",
        "channel-stuck",
        each(chain(without(H), column(XF, dead))),
        (XF, "pressure"),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "encoder stuck half-way",
        "channel-stuck",
        each(column(XM, held(200, 400)), M8),
        (XM,),
        {"file": M8, "channel": XM},
    ),
    Broken(
        "encoder stuck in a recording of both",
        "channel-stuck",
        each(column(XM, held(200, 400)), B),
        (XM,),
        {"file": B, "channel": XM},
    ),
    Broken(
        "recorder stopped",
        "recording-frozen",
        each(every(held(200, 270)), F1),
        ("4.00 to 5.38 s", PF, H),
        {"file": F1},
    ),
    Broken(
        "the lift stands though commanded",
        "command-unanswered",
        each(response_of(level(0.0)), F0),
        ("current_free_a", "stands still"),
        {"file": F0, "channel": "current_free_a"},
    ),
    # swapped lifts
    Broken(
        "encoders swapped",
        "lifts-swapped",
        each(exchanged("position", "m"), F0),
        (XF, XM, "exchanged"),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "encoders swapped, no height",
        "lifts-swapped",
        each(chain(without(H), exchanged("position", "m")), M0),
        (XF, XM, "lift = 'main'"),
        {"file": M0},
    ),
    Broken(
        "pressures swapped",
        "lifts-swapped",
        each(exchanged("pressure", "pa"), F8),
        (PF, PM),
        {"file": F8, "channel": PF},
    ),
    Broken(
        "pressures swapped everywhere",
        "lifts-swapped",
        each(exchanged("pressure", "pa")),
        (PF, PM),
        {"file": F0},
    ),
    Broken(
        "pressures swapped, both",
        "lifts-swapped",
        each(exchanged("pressure", "pa"), B),
        (PF, PM),
        {"file": B},
    ),
    Broken(
        "lift and currents swapped",
        "lifts-swapped",
        each(other_lift, F0),
        ("lift = 'main'", "enter lift = 'free'"),
        {"file": F0},
    ),
    Broken(
        "all swapped against lift",
        "lifts-swapped",
        then(only("free", "main"), each(other_lift)),
        ("lift = 'main'",),
        {"file": F0, "files": [F0, F1, F8, M0, M1, M8]},
    ),
    Broken(
        "currents swapped against lift",
        "lift-contradicts-current",
        each(exchanged("current", "a"), M0),
        ("current_free_a", 'lift = "main"'),
        {"file": M0},
    ),
    Broken(
        "currents swapped, both",
        "lifts-swapped",
        each(exchanged("current", "a"), B),
        ("current_free_a", "current_main_a"),
        {"file": B, "channel": "current_free_a"},
    ),
    # units
    Broken(
        "bar for Pa",
        "unit-wrong",
        each(column(PF, times(1e-5)), F0),
        (PF, "bar", "multiply it by 100000"),
        {"file": F0, "channel": PF},
    ),
    Broken(
        "bar for Pa everywhere", "unit-wrong", each(column(PM, times(1e-5))), (PM, "bar"), {"channel": PM}
    ),
    Broken(
        "1e5 Pa for Pa", "value-out-of-bounds", each(column(PF, times(1e5)), F1), (PF, "unit"), {"file": F1}
    ),
    Broken(
        "MPa after bar",
        "unit-wrong",
        each(chain(column(PF, times(1e-6)), column(PM, times(1e-6)))),
        (PF, "MPa"),
        {},
    ),
    Broken(
        "a tenth of the pressure",
        "pressure-implausible",
        each(column(PF, times(0.1)), F1),
        (PF, "load_kg = 1500", "14.8 MPa"),
        {"file": F1, "channel": PF},
    ),
    Broken(
        "kgf/cm2 mistaken by ten",
        "pressure-implausible",
        each(column(PM, times(5.0)), M0),
        (PM, "5.17 MPa"),
        {"file": M0, "channel": PM},
    ),
    Broken("position times 1e5", "unit-wrong", each(column(XF, times(1e3)), F0), (XF, "mm"), {"file": F0}),
    Broken(
        "position times 1e5", "value-out-of-bounds", each(column(XF, times(1e5)), F0), (XF,), {"file": F0}
    ),
    Broken(
        "position by 1e-5",
        "position-implausible",
        each(column(XF, times(1e-5)), F0),
        (XF,),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "all positions by 1e-5",
        "position-implausible",
        each(chain(column(XF, times(1e-5)), column(XM, times(1e-5)))),
        (XF,),
        {"channel": XF},
    ),
    Broken(
        "position by 1e-5, no height",
        "position-implausible",
        each(chain(without(H), column(XM, times(1e-5))), M1),
        (XM,),
        {"file": M1, "channel": XM},
    ),
    Broken(
        "position in decimetres",
        "position-implausible",
        each(column(XM, times(10.0)), F1),
        (XM, "2.2 m"),
        {"file": F1, "channel": XM},
    ),
    Broken(
        "the cylinder's position for the forks'",
        "height-contradicts-position",
        each(column(XF, times(0.5)), F0),
        (XF, H),
        {"file": F0, "channel": XF},
    ),
    Broken(
        "height by 1e-5",
        "height-contradicts-position",
        each(column(H, times(1e-5)), M0),
        (H, "scale"),
        {"file": M0, "channel": H},
    ),
    Broken("height times 1e5", "value-out-of-bounds", each(column(H, times(1e5)), M0), (H,), {"file": M0}),
    Broken(
        "the resting lift's position by 1e-5",
        "height-contradicts-position",
        each(column(XM, times(1e-5)), F0),
        (XM, "3.92 m"),
        {"file": F0},
    ),
    Broken(
        "current by 1e-5",
        "command-implausible",
        each(column("current_free_a", times(1e-5)), F0),
        ("current_free_a", "opens at 360 mA"),
        {"file": F0, "channel": "current_free_a"},
    ),
    Broken(
        "kA everywhere",
        "command-implausible",
        each(chain(column("current_free_a", times(1e-3)), column("current_main_a", times(1e-3)))),
        ("current_free_a",),
        {"channel": "current_free_a"},
    ),
    Broken(
        "current times 1e5",
        "value-out-of-bounds",
        each(column("current_main_a", times(1e5)), M0),
        ("current_main_a",),
        {"file": M0},
    ),
    Broken("mA for A", "unit-wrong", each(column("current_main_a", times(1e3)), M0), ("mA",), {"file": M0}),
    Broken(
        "temperature by 1e-5",
        "temperature-implausible",
        each(column("oil_temperature_degc", times(1e-5)), B),
        ("oil_temperature_degc",),
        {"file": B, "channel": "oil_temperature_degc"},
    ),
    Broken(
        "temperature times 1e5",
        "value-out-of-bounds",
        each(column("oil_temperature_degc", times(1e5)), B),
        ("oil_temperature_degc",),
        {"file": B},
    ),
    Broken("time times 1e5", "sample-rate-mismatch", each(clock(times(1e5)), F0), (), {"file": F0}),
    Broken("time by 1e-5", "sample-rate-mismatch", each(clock(times(1e-5)), F0), (), {"file": F0}),
    Broken(
        "all times by 1e-5",
        "clock-implausible",
        each(clock(times(1e-5))),
        ("time_s", "2e-07 s"),
        {"channel": "time_s"},
    ),
    Broken("all times times 1e5", "clock-implausible", each(clock(times(1e5))), ("time_s", "2 ks"), {}),
    # clocks that jump
    Broken(
        "time jumps",
        "clock-jump",
        each(clock(lambda t: np.r_[t[:200], t[200:] + 1.5]), F0),
        ("time_s", "5.5"),
        {"file": F0},
    ),
    Broken("half a second lost", "samples-lost", each(lost(200, 25), F0), (XF, H, "4.00 s"), {"file": F0}),
    Broken("half a second lost everywhere", "samples-lost", each(lost(180, 25)), (H, "3.60 s"), {"file": F0}),
    Broken(
        "half a second lost, no height",
        "channel-jump",
        each(chain(without(H), lost(330, 25)), M0),
        (XM, "6.60 s"),
        {"file": M0, "channel": XM},
    ),
    Broken(
        "encoder loses counts",
        "channel-jump",
        each(column(XF, lambda v: np.r_[v[:250], v[250:] - 0.06]), F1),
        (XF, "5.00 s"),
        {"file": F1, "channel": XF},
    ),
    Broken(
        "command half-way 1.5 s late",
        "command-shifted",
        each(later("current_free_a", 150, 75), F0),
        ("current_free_a", "too early"),
        {"file": F0, "channel": "current_free_a"},
    ),
    Broken(
        "response 1.5 s late",
        "command-shifted",
        each(column("current_main_a", lambda v: np.r_[v[75:], np.full(75, v[-1])]), M1),
        ("current_main_a", "too late"),
        {"file": M1},
    ),
]


@pytest.mark.parametrize("broken", BROKEN, ids=lambda broken: broken.name)
def test_what_cannot_be_fitted_is_told_in_one_sentence(broken):
    error = raised(suitability, tuple(broken.mutation(good())), THESIS)
    assert error.code == broken.code, error
    for words in broken.says:
        assert words in error.message, error
    for name, value in broken.facts.items():
        assert error.facts[name] == value, (name, error.facts)
    check_sentence(error)


S, P = "free_steps_0kg_30c.csv", "free_prms1_1500kg_60c.csv"

BROKEN_NULL = [
    ("no-excitation", each(response_of(level(0.0))), "free lift moves by at most"),
    (
        "no-excitation",
        each(chain(*(column(f"current_{x}_a", times(0.2)) for x in LIFTS), every(dead))),
        "valve opens",
    ),
    ("channel-stuck", each(column(PF, held(300, 335)), P), "6.00 to 6.68 s"),
    ("channel-stuck", each(column(XF, held(250, 500)), P), "position_free_m stands"),
    ("lifts-swapped", each(exchanged("pressure", "pa")), "pressure_main_pa"),
    ("lifts-swapped", each(exchanged("position", "m"), S), "position_main_m"),
    ("lifts-swapped", each(other_lift, S), "enter lift = 'free'"),
    ("unit-wrong", each(column(PF, times(1e-5)), P), "bar"),
    ("position-implausible", each(column(XF, times(1e-5)), S), "position_free_m"),
    ("height-contradicts-position", each(column(H, times(1e-5))), "fork_height_m"),
    ("samples-lost", each(lost(300, 40), S), "6.00 s"),
    ("clock-jump", each(clock(lambda t: np.r_[t[:300], t[300:] + 0.8]), S), "time_s"),
    ("command-shifted", each(later("current_free_a", 200, 100), P), "current_free_a"),
]


@pytest.mark.parametrize(
    ("code", "mutation", "says"), BROKEN_NULL, ids=lambda value: value if isinstance(value, str) else ""
)
def test_a_shared_campaign_broken_is_told(code, mutation, says):
    found = Campaign.read(CAMPAIGNS / "null").recordings
    error = raised(suitability, tuple(mutation(found)), THESIS)
    assert error.code == code, error
    assert says in error.message, error
    check_sentence(error)

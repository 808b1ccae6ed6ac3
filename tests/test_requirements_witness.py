"""The six templates against rtamt, which evaluates signal temporal logic on whole signals."""

import numpy as np
import pytest

from forklift.ensemble import specification
from forklift.ensemble.sweep import sweep

rtamt = pytest.importorskip("rtamt")

FAR = 1e6
"""Robustness of what is true or false and has no margin."""

REQUIRE = {
    "always": {"signal": "speed", "upper": 0.3, "from_s": 0.4, "to_s": 2.0},
    "stays_inside": {"signal": "pressure", "lower": 2e6, "upper": 8e6, "from_s": 0.0, "to_s": 2.8},
    "never_after_settling": {"signal": "speed", "peak_to_peak_s": 0.4, "after_s": 0.6, "upper": 0.03},
    "settles": {"signal": "error", "within_s": 0.5, "band": 0.25},
    "responds": {"signal": "speed", "within_s": 0.5, "share": 0.6},
    "reaches": {"signal": "speed", "lower": 0.2, "upper": 0.6, "from_s": 0.2, "to_s": 1.0},
}


@pytest.fixture(scope="module")
def found():
    return sweep(
        {
            "name": "witness",
            "lifts": "free",
            "duration_s": 3.0,
            "substeps": 2,
            "members": 6,
            "controller": "thesis",
            "profile": [{"from_s": 0.2, "level": 0.3}, {"from_s": 1.5, "level": 0.4}],
            "vary": {
                "load_kg": {"uniform": [200.0, 1500.0]},
                "oil_temperature_degc": {"uniform": [20.0, 60.0]},
            },
            "require": [
                {"name": name, "template": name, "scale": 1.0} | own for name, own in REQUIRE.items()
            ],
        }
    )


def robustness(name, own, table):
    """What rtamt says at the start of a member's signals."""
    speed = -table["velocity_free_m_s"].to_numpy()
    request = table["request"].to_numpy()
    step = np.diff(request, prepend=0.0)
    since, count = np.zeros(len(step)), 0
    for k in range(len(step)):
        count = 0 if k == 0 or step[k] != 0.0 else count + 1
        since[k] = count
    error = speed - table["reference_free_m_s"].to_numpy()
    x = {"speed": speed, "error": error, "pressure": table["pressure_free_pa"].to_numpy()}[own["signal"]]
    if "peak_to_peak_s" in own:
        back = round(own["peak_to_peak_s"] / 0.02)
        x = np.array([np.ptp(x[max(k - back, 0) : k + 1]) for k in range(len(x))])
    ticks = {key: round(own[key] / 0.02) for key in ("from_s", "to_s", "after_s", "within_s") if key in own}
    signals = {"x": x, "distance": np.abs(x - request)}
    if name in ("always", "stays_inside", "reaches"):
        low, high = own.get("lower", -FAR * FAR), own.get("upper", FAR * FAR)
        word = "eventually" if name == "reaches" else "always"
        text = f"{word}[{ticks['from_s']}:{ticks['to_s']}]((x >= {low}) and (x <= {high}))"
    elif name == "responds":
        within, last = ticks["within_s"], len(x) - 1
        signals["trigger"] = np.where((step != 0.0) & (np.arange(len(x)) + within <= last), FAR, -FAR)
        signals["least"] = np.zeros(len(x))
        # The tolerance is that of the step which is being answered.
        tolerance, held = np.zeros(len(x)), 0.0
        for k in range(len(x)):
            held = (1.0 - own["share"]) * abs(step[k]) if step[k] != 0.0 else held
            tolerance[k] = held
        signals["left"] = tolerance - signals["distance"]
        text = f"always((trigger <= 0) or (eventually[0:{within}](left >= 0)))"
    else:
        bound, least = (
            (own["upper"], ticks["after_s"]) if "upper" in own else (own["band"], ticks["within_s"])
        )
        signals["calm"] = np.where(since >= least, -FAR, FAR)
        signals["size"] = np.abs(x)
        text = f"always((calm >= 0) or (size <= {bound}))"
    spec = rtamt.StlDiscreteTimeSpecification()
    used = [signal for signal in (*signals,) if signal in text]
    for signal in used:
        spec.declare_var(signal, "float")
    spec.spec = text
    spec.parse()
    data = {"time": list(range(len(x)))} | {signal: list(map(float, signals[signal])) for signal in used}
    return spec.evaluate(data)[0][1]


@pytest.mark.parametrize("name", list(REQUIRE))
def test_a_margin_is_rtamts_robustness(found, name):
    assert set(REQUIRE) == set(specification.FORMULAS)
    for index in range(6):
        one = found.replay(index)
        expected = robustness(name, REQUIRE[name], one.table)
        assert one.margins[name] == pytest.approx(expected, rel=1e-9, abs=1e-12), index

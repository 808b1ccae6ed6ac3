"""At which places free curves are screened."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from forklift import Truck
from forklift.diagnosis import curves
from forklift.diagnosis.criteria import CURVE_NEAR, CURVES_AT, MOST_PLACES
from forklift.diagnosis.curves import credible
from forklift.plant.forklift.model import Forklift


@pytest.mark.parametrize(
    ("near", "screened"),
    [(1, CURVES_AT), (CURVES_AT + 2, CURVES_AT + 2), (MOST_PLACES + 3, MOST_PLACES)],
    ids=["one stands out", "six are alike", "all are alike"],
)
def test_every_place_that_is_nearly_as_credible_as_the_first_is_asked(near, screened):
    evidences = [100.0 * (CURVE_NEAR + 0.01) if k else 100.0 for k in range(near)]
    evidences += [100.0 * (CURVE_NEAR - 0.01)] * 12
    inputs = [SimpleNamespace(evidence=one) for one in evidences]
    assert list(credible(inputs)) == inputs[:screened]


@pytest.mark.parametrize("where", ["", "free", "main"])
def test_what_acts_on_the_whole_truck_acts_on_each_lift(where):
    """So that its law is tested too."""
    truck = Forklift(Truck.read("thesis"), ("free", "main"))
    given = cast(Any, SimpleNamespace(equations=("tank",), where=where))
    lifts = [where] if where else ["free", "main"]
    assert truck.acted_on(given) == tuple(f"{lift}.return_pressure" for lift in lifts)


def test_where_an_accepted_name_acts_a_curve_is_screened_however_credible_the_place_is(monkeypatch):
    """A curve there mends the name's law."""
    names = ["own", *(f"place {k}" for k in range(CURVES_AT + 2))]
    machine = SimpleNamespace(
        places=[SimpleNamespace(name=name, part="main", equation=name) for name in names],
        past=frozenset(),
        acted_on=lambda hypothesis: {"own"},
        curves=lambda place, variable, lower, upper: (place.name,),
    )
    problem = SimpleNamespace(samples=(), moments=lambda x, part: [{"speed": np.array([0.0, 1.0])}])
    at = SimpleNamespace(problem=problem, x=np.zeros(1))
    refit = cast(Any, Named(at, at, ("leakage",)))
    inputs = [SimpleNamespace(port=name, evidence=100.0 - 90.0 * (k > 0)) for k, name in enumerate(names[1:])]
    inputs.append(SimpleNamespace(port="own", evidence=1.0))
    screened: list[str] = []

    def screen(problem: Any, x: Any, hypotheses: Any, pairs: int, slow: bool) -> Any:
        screened.extend(hypotheses)
        return SimpleNamespace(ranked=[])

    monkeypatch.setattr(curves, "screen", screen)
    curves.FreeCurves(cast(Any, machine), {refit: cast(Any, inputs)})(refit)
    assert screened == ["own", *names[1:CURVES_AT]]


def test_how_near_a_name_acts_is_told_by_the_most_credible_input_where_it_acts():
    """A chassis that gives way acts where no input may enter, so that no place speaks against it."""
    ports = ["stiffness", "flow", "current", "friction", "dry_friction", "opening"]
    places = [SimpleNamespace(name=one, part="main", equation=one.removeprefix("dry_")) for one in ports]
    acts = {"air": ("stiffness",), "hose": ("flow", "current"), "dwell": ("friction", "dry_friction")}
    machine = SimpleNamespace(
        places=places, acted_on=lambda one: {**acts, "chassis": (), "limit": ("opening",)}[one]
    )
    evidences = [200.0, 150.0, 160.0, 100.0, 120.0, 90.0]
    inputs = [SimpleNamespace(port=port, evidence=one) for port, one in zip(ports, evidences, strict=True)]
    refit = cast(Any, object())
    near = curves.FreeCurves(
        cast(Any, machine), {refit: cast(Any, sorted(inputs, key=lambda one: -one.evidence))}
    ).near
    shares = [near(refit, cast(Any, one)) for one in ("air", "hose", "dwell", "chassis", "limit")]
    assert shares == [1.0, 0.8, 0.6, 1.0, 0.0]


def test_what_would_mend_a_law_is_screened_once_at_a_place(monkeypatch):
    screened: list[str] = []

    def screen(problem: str, x: Any, hypotheses: Any, most: int, slow: bool) -> tuple[str, bool]:
        screened.append(problem)
        return problem, slow

    monkeypatch.setattr(curves, "screen", screen)
    machine = SimpleNamespace(places=(), acted_on=lambda one: ())
    refit, offered = cast(Any, Named(None, None, ())), curves.FreeCurves(cast(Any, machine), {})
    here, there = (cast(Any, SimpleNamespace(problem=name, x=None)) for name in ("here", "there"))
    assert offered.laws(refit, here, slow=True) == offered.laws(refit, here, slow=True) == ("here", True)
    assert screened == ["here"]
    assert offered.laws(refit, there, slow=True) == ("there", True)
    assert offered.laws(refit, there) == ("there", False)
    assert screened == ["here", "there", "there"]


@dataclass(frozen=True, eq=False)
class Named:
    """A fit with a name."""

    early: Any
    told_from: Any
    hypotheses: tuple[str, ...]
    quiet: bool = False

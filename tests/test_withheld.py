"""What is not asked, since all recordings have its condition in common, is asked where a curve over that
condition explains what is left over."""

from dataclasses import dataclass, replace
from typing import Any, cast

import pytest

from forklift.diagnosis.curves import FreeCurves
from forklift.diagnosis.hypothesis import Hypothesis

OIL, LOAD = "oil_temperature_degc", "load_kg"


@dataclass(frozen=True)
class Refit:
    hypotheses: tuple[Hypothesis, ...]


def hypothesis(name: str, kind: str = "physics", needs: tuple[str, ...] = ()) -> Hypothesis:
    plain = Hypothesis(name, cast(Any, kind), name, "main", "friction", name, cast(Any, None))
    return replace(plain, needs_two_of=needs)


WITHHELD = (
    hypothesis("friction_temperature", needs=(OIL,)),
    hypothesis("friction_pressure", needs=(LOAD,)),
)


@pytest.mark.parametrize(
    ("variable", "asked"),
    [
        ("oil_temperature", ["friction_temperature"]),
        ("load", ["friction_pressure"]),
        ("velocity", []),
        (None, []),
    ],
)
def test_a_curve_over_a_condition_has_the_names_over_it_asked(variable: str | None, asked: list[str]) -> None:
    curve = hypothesis("unknown", "unknown")
    general = FreeCurves(cast(Any, None), {}, made={curve: (variable or "position", 0.0, 1.0)})
    final = Refit((curve,) if variable else (hypothesis("leakage"),))
    assert [one.id for one in general.told_by(cast(Any, final), WITHHELD)] == asked

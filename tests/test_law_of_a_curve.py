"""A curve that is another name's law gives that name, where it leaves nothing of the one it was to mend."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from forklift.diagnosis.criteria import AS_NEAR
from forklift.diagnosis.curve_trials import named_by_its_law
from forklift.plant.forklift.effects import EFFECTS
from forklift.plant.forklift.truck import Truck
from forklift.plant.forklift.unnamed import answer
from forklift.recordings.recording import Recording


def name(id: str, where: str = "free", law_of: str = "") -> Any:
    return SimpleNamespace(id=id, where=where, label=f"{where}.{id}", law_of=law_of, name=id)


DELAY, LAG, OTHER = name("valve_delay"), name("valve_lag"), name("valve_lag", "main")
CURVE, PLAIN = name("unknown", law_of="valve_lag"), name("unknown")


@dataclass
class Race:
    squares: float = 100.0
    tried: list[tuple[Any, ...]] = field(default_factory=list)

    @property
    def refitter(self) -> Any:
        return self

    def say(self, what: str) -> None:
        pass

    def slightly(self, hypotheses: tuple[Any, ...], after: Any) -> Any:
        self.tried.append(hypotheses)
        return SimpleNamespace(squares=self.squares, hypotheses=hypotheses)


def refit(*hypotheses: Any, clear: bool = False) -> Any:
    return SimpleNamespace(hypotheses=hypotheses, squares=100.0, quiet=True, clear=lambda one: clear)


@pytest.mark.parametrize(
    ("curve", "clear", "squares", "named"),
    [
        (CURVE, False, 100.0 + AS_NEAR, True),
        (CURVE, False, 101.0 + AS_NEAR, False),  # the lag with its curve explains clearly less
        (CURVE, True, 100.0, False),  # the dead time is still there beside the curve
        (PLAIN, False, 100.0, False),  # that is no name's law
    ],
)
def test_a_name_is_replaced_by_the_one_whose_law_the_curve_is(curve, clear, squares, named):
    race: Any = Race(squares)
    mended = refit(DELAY, curve, clear=clear)
    found = named_by_its_law(race, refit(), refit(DELAY), mended, [DELAY, OTHER, LAG])
    assert (found is not None) is named
    if found:
        assert found.hypotheses == (LAG, CURVE)


def test_a_name_that_has_its_own_law_mended_stays():
    race: Any = Race()
    assert named_by_its_law(race, refit(), refit(LAG), refit(LAG, CURVE), [DELAY, LAG]) is None
    assert not race.tried


def test_a_valves_answer_as_a_curve_is_the_law_of_a_lag_of_the_catalogue():
    channels = {name: np.full(3, 0.1) for name in ("current_free_a", "current_main_a", "pressure_free_pa")}
    time = np.array([0.0, 0.1, 0.2])
    case: Any = SimpleNamespace(recording=Recording("a.csv", "free", 0.0, "estimate", time, channels))
    curve = answer(Truck.read("thesis"), "free", [case])
    assert curve.law_of in {effect.id for effect in EFFECTS if effect.equation == curve.equation}

"""Whether a mismatch shows on recordings held out and on none that was fitted."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from forklift.diagnosis.refit import Refit


def judged(role: str, explained: bool) -> Any:
    return SimpleNamespace(role=role, explained=explained, mean_square=1.0 if explained else 5.0)


def refit(held: bool, fitted: tuple[bool, ...], *, finished: bool = True) -> tuple[Refit, list[int]]:
    asked: list[int] = []

    def rest() -> tuple[Any, ...]:
        asked.append(1)
        return tuple(judged("estimate", one) for one in fitted)

    made: Any = Refit(
        (), *(None,) * 2, (judged("validate", held),), (0.0, 0.0), finished, *(None,) * 1, rest=rest
    )
    return made, asked


@pytest.mark.parametrize(
    ("held", "fitted", "alone"),
    [
        (False, (True, True), True),
        (False, (True, False), False),
        (True, (True, True), False),
        (False, (), False),  # where none is held out, all were fitted
    ],
)
def test_only_what_no_fitted_recording_shows(held, fitted, alone):
    assert refit(held, fitted)[0].held_out_alone is alone


def test_fitted_recordings_are_not_simulated_for_what_is_explained_or_given_up():
    for one, asked in (refit(True, (True,)), refit(False, (True,), finished=False)):
        assert not one.held_out_alone
        assert not asked

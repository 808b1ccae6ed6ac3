"""The ablation takes away what it says: names that the diagnosis really looks up when it runs."""

from __future__ import annotations

import sys
from pathlib import Path
from types import CodeType, FunctionType, ModuleType

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "proofs"))

import without
from forklift import Campaign
from forklift.diagnosis.curve_trials import General

CAMPAIGNS = Path(__file__).parent / "campaigns"
PLACES = {
    "location": {("engine", "unknown_inputs"), ("engine", "FreeCurves")},
    "rivals": {("forklifts", "hypotheses"), ("selection", "FIRST"), ("selection", "FURTHER")}
    | {("selection", "rivals")},
    "held-out": set(),
}


def names(code: CodeType) -> set[str]:
    """All that a function and those inside it look up."""
    inner = [names(one) for one in code.co_consts if isinstance(one, CodeType)]
    return set(code.co_names).union(*inner)


def looked_up(module: ModuleType) -> set[str]:
    """The globals that a module's own functions look up, and the methods of its classes."""
    given = [one for one in vars(module).values() if getattr(one, "__module__", "") == module.__name__]
    methods = [one for found in given if isinstance(found, type) for one in vars(found).values()]
    own = [one for one in (*given, *methods) if isinstance(one, FunctionType)]
    return set().union(*(names(one.__code__) for one in own if one.__module__ == module.__name__))


@pytest.mark.parametrize("step", without.STEPS)
def test_a_step_left_out_is_left_out_and_put_back(step):
    modules = {name: getattr(without, name) for name in ("engine", "forklifts", "selection")}
    before = {name: dict(vars(module)) for name, module in modules.items()}
    with without.without(step):
        changed = {
            (name, key)
            for name, module in modules.items()
            for key, value in vars(module).items()
            if value is not before[name][key]
        }
    assert changed == PLACES[step]
    assert all(key in looked_up(modules[name]) for name, key in changed)
    assert all(vars(module) == before[name] for name, module in modules.items())


def test_who_offers_no_shapes_offers_them_as_those_who_do():
    asked = [name for name in vars(General) if not name.startswith("_") or name == "__call__"]
    assert asked == ["__call__", "laws", "faint", "twins", "near"]
    none = without.NoShapes(("free",), {})
    assert none(None) == none.twins(None, None) == []
    assert none.laws(None, None).ranked == ()
    assert none.faint(None, None) is None
    assert none.near(None, None) == 0.0


def test_without_recordings_held_out_only_fitted_ones_are_seen():
    campaign = Campaign.read(CAMPAIGNS / "leak")
    assert {one.role for one in campaign.recordings} == {"estimate", "validate"}
    assert {one.role for one in without.seen("held-out", campaign).recordings} == {"estimate"}
    assert without.seen("rivals", campaign) is campaign

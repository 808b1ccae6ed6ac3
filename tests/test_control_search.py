"""The search that tunes controllers: it finds a minimum along a bent valley, within its bounds, again, and
goes on where it was stopped."""

import json
import resource
from pathlib import Path

import numpy as np
import pytest

from forklift.base.alone import alone_with
from forklift.base.errors import ForkliftError
from forklift.control import tune as tuning
from forklift.control.controller import Controller
from forklift.control.search import Journal, Sought, minimised
from forklift.control.trial import scattered
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import LIFTS


def bent(tried: list[np.ndarray]) -> np.ndarray:
    """Rosenbrock's (1960) function, in steps of 1e-4: a valley whose direction must be learnt."""
    x, y = np.array(tried).T
    return np.floor(1e4 * (100.0 * (y - x * x) ** 2 + (1.0 - x) ** 2)) / 1e4


def found(seed: int, upper: float = 3.0, cost=bent, **more) -> np.ndarray:
    sought = [Sought(-1.2, 0.3, -3.0, upper), Sought(1.0, 0.3, -3.0, 3.0)]
    return minimised(cost, sought, generations=150, candidates=12, seed=seed, **more)


def test_it_follows_a_bent_valley_to_its_end() -> None:
    for seed in range(4):
        assert np.allclose(found(seed), [1.0, 1.0], atol=0.05)


def test_it_stays_within_its_bounds_and_finds_the_best_there() -> None:
    best = found(1, upper=0.5)
    assert best[0] <= 0.5
    assert np.allclose(best, [0.5, 0.25], atol=0.03)


def test_a_seed_gives_the_same_again_and_the_start_is_never_lost() -> None:
    assert np.array_equal(found(3), found(3))
    assert not np.array_equal(found(3), found(4))
    at = [Sought(1.0, 1.0, -3.0, 3.0)] * 2
    kept = minimised(bent, at, generations=3, candidates=6, seed=0)
    assert np.array_equal(kept, [1.0, 1.0])


@pytest.mark.parametrize("torn", [False, True])
def test_a_search_that_was_stopped_goes_on_to_the_same_end(tmp_path: Path, torn: bool) -> None:
    """Also where the kill came in the middle of a line."""
    path, asked = tmp_path / "kept", []

    def stopping(tried: list[np.ndarray]) -> np.ndarray:
        if len(asked) == 40:
            raise KeyboardInterrupt
        asked.append(len(tried))
        return bent(tried)

    with pytest.raises(KeyboardInterrupt):
        found(2, cost=stopping, journal=Journal(path, "this"))
    if torn:
        path.write_text(path.read_text()[:-20])
    asked.clear()

    def counting(tried: list[np.ndarray]) -> np.ndarray:
        asked.append(len(tried))
        return bent(tried)

    again = found(2, cost=counting, journal=Journal(path, "this"))
    rest = len(asked)
    assert np.array_equal(again, found(2, cost=counting))
    assert len(asked) - rest == rest + (39 if torn else 40)  # only what was missing was worked out
    asked.clear()
    assert np.array_equal(again, found(2, cost=counting, journal=Journal(path, "this")))
    assert not asked  # it is over: nothing is worked out again


def test_any_seed_is_taken() -> None:
    assert np.array_equal(found(2**70), found(2**70))


def test_two_searches_do_not_share_what_they_keep(tmp_path: Path) -> None:
    thesis, kept = Controller.read("thesis"), tmp_path / "kept"
    with alone_with(kept), pytest.raises(ForkliftError, match="another call") as told:
        tuning.tune(thesis, Truck.read("thesis"), kept=kept)
    assert told.value.code == "folder-in-use"


def test_trucks_of_the_same_make_stay_within_what_a_truck_can_be() -> None:
    spec = parameters()["free.valve.C_D"]
    edge = Truck.read("thesis").with_values({"free.valve.C_D": 0.999 * spec["upper"]})
    drawn = [truck.values["free.valve.C_D"] for truck in scattered(edge, 8, seed=1)]
    assert max(drawn) == spec["upper"]
    assert min(drawn) < 0.999 * spec["upper"]


def test_a_full_disk_is_told_in_a_sentence(tmp_path: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (5, before[1]))
    try:
        with pytest.raises(ForkliftError) as told:
            Journal(tmp_path / "kept", "this")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert told.value.code == "not-writable"


def test_what_was_kept_of_another_search_is_not_taken(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    path.write_text(json.dumps("another") + "\n" + json.dumps([0.0] * 12) + "\n")
    assert np.array_equal(found(2, journal=Journal(path, "this")), found(2))


def test_a_search_begins_with_another_controllers_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are what it ends at where nothing else costs less."""

    class First:
        def __init__(self, *_: object) -> None: ...

        def cost(self, tried: list[Controller]) -> np.ndarray:
            return np.arange(len(tried), dtype=float)

    monkeypatch.setattr(tuning, "Trial", First)
    monkeypatch.setattr(tuning, "GENERATIONS", {"free": 1, "main": 1})
    thesis, calm = Controller.read("thesis"), Controller.read("calm")
    found = tuning.tune(thesis, Truck.read("thesis"), start=calm, transition=False)
    for lift in LIFTS:
        own, other = getattr(found, lift), getattr(calm, lift)
        for name in ("proportional", "integral", "derivative", "u_max", "adaptation_s", "prediction"):
            assert own.numbers[name].value == pytest.approx(other.numbers[name].value, rel=1e-3), name
            assert "from calm" in own.numbers[name].source
        assert np.allclose(own.swing.lead_deg[3:6], other.swing.lead_deg[3:6], atol=20.0)
        assert own.swing.frequency_hz == pytest.approx(other.swing.frequency_hz)
        assert own.table == getattr(thesis, lift).table

"""What is doubted where nothing is left over but conditions further off than is plausible."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from forklift.diagnosis.rules import completes


def refit(
    hypotheses=(), *, complete=False, strains_alone=False, squares=1000.0, excess=10.0, mean_square=1.2
):
    return SimpleNamespace(
        hypotheses=hypotheses,
        complete=complete,
        strained=strains_alone,
        strains_alone=strains_alone,
        slight=False,
        finished=True,
        identifiable=True,
        squares=squares,
        excess=excess,
        missing=0.0 if complete else 1.0,
        loo_log_score=None,
        worst=SimpleNamespace(mean_square=mean_square),
    )


LOAD = SimpleNamespace(label="load_entered", amplitude=None, kind="parameter")
LAW = SimpleNamespace(label="free.leakage", amplitude="free.leakage.coefficient", kind="physics")
REFITTER = SimpleNamespace(together=1.0, later=0.5)


@pytest.mark.parametrize("strains_alone", [True, False])
def test_a_condition_that_takes_away_all_strain_need_not_gain_more_than_chance(strains_alone):
    best = refit(strains_alone=strains_alone)
    assert completes(refit((LOAD,), complete=True, squares=990.0), best, REFITTER) is strains_alone
    assert not completes(refit((LOAD,), complete=True, squares=1001.0), best, REFITTER)
    assert not completes(refit((LOAD,), complete=False, squares=990.0), best, REFITTER)


def test_a_law_must_gain_what_it_must_anywhere():
    best = refit(strains_alone=True)
    assert not completes(refit((LAW,), complete=True, squares=990.0), best, REFITTER)
    assert completes(refit((LAW,), complete=True, squares=900.0), best, REFITTER)

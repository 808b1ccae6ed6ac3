"""What became of every hypothesis is told alike in the list, its title and the JSON."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bent_line import LINE
from forklift import diagnose
from forklift.diagnosis.ledger import Considered, considered, uncontested
from forklift.diagnosis.screening import Screened
from forklift.plant.protocol import Addition, Hypothesis
from forklift.plant.recording import Recording
from forklift.report import ledger


def hypothesis(name):
    return Hypothesis(name, "physics", name, "", "", name, Addition())


CAUSE, FAR, NEAR, NEVER = (hypothesis(name) for name in ("cause", "far", "near", "never"))


def refit(*hypotheses, finished):
    return SimpleNamespace(hypotheses=hypotheses, finished=finished, reduced_chi2=2.0)


def outcome(*refits):
    """Of a diagnosis that tried these and named `CAUSE`."""
    singles = [Screened((one,), 5.0, (1.0,), (0.1,)) for one in (CAUSE, FAR, NEAR, NEVER)]
    return SimpleNamespace(
        verdict="missing-physics",
        findings=SimpleNamespace(unexcited=""),
        selection=SimpleNamespace(steps=[SimpleNamespace(refits=refits)], unnamed=(), skipped=()),
        screening=SimpleNamespace(singles=singles, untestable=()),
        causes=(SimpleNamespace(hypothesis=CAUSE),),
        unidentifiable=(),
    )


def fates(found):
    told = [one.to_dict() for one in considered(found)]
    words = SimpleNamespace(at=lambda name, where: name, kinds={"physics": "effect"}, noun="model")
    given = {"hypotheses": told, "verdict": "missing-physics"}
    table = ledger.considered(given, words)
    return ledger.counts(given), table, {row[0].lower(): row[3] for row in table.rows}


def test_what_was_given_up_is_not_counted_as_fitted():
    found = outcome(refit(CAUSE, finished=True), refit(FAR, finished=False), refit(NEAR, finished=True))
    count, table, fate = fates(found)
    assert (count["considered"], count["fitted"], count["given_up"]) == (4, 2, 1)
    assert "4 hypotheses considered: 2 fitted, 1 begun and given up, 1 not tried" in table.title
    assert "given up" in fate["far"]
    assert "leaves 2" in fate["near"]
    assert "named" in fate["cause"]
    assert "given up" not in fate["never"] + fate["near"] + fate["cause"]


def test_what_was_fitted_beside_another_after_it_was_given_up_alone_is_fitted():
    (one,) = [
        one
        for one in considered(outcome(refit(FAR, finished=False), refit(CAUSE, FAR, finished=True)))
        if one.hypothesis is FAR
    ]
    assert not one.given_up
    assert one.to_dict()["beside"] == ["cause"]


@pytest.mark.parametrize(("others", "contested"), [((), False), ((refit(FAR, finished=False),), True)])
def test_a_cause_is_uncontested_only_if_nothing_else_was_begun(others, contested):
    said = uncontested(outcome(refit(CAUSE, finished=True), *others))
    assert said.startswith("not contested") is not contested


def test_a_hypothesis_that_was_never_begun_is_neither():
    told = Considered(NEVER, 5.0, "", None, False).to_dict()
    assert not told["fitted"]
    assert not told["given_up"]


def bent(c):
    """Recordings of a line that is bent by `c`, in its noise, and their diagnosis."""
    recordings = []
    for k in range(4):
        random = np.random.default_rng(k)
        u = random.uniform(-2.0, 2.0, 200)
        y = 2.0 * u + c * u**2 + random.normal(0.0, 0.05, 200)
        recordings += Recording(f"r{k}", np.arange(200.0), {"u": u}, {"y": y}).split(0.6)
    return diagnose(LINE, recordings)


def test_where_nothing_is_missing_it_is_told_from_which_size_on_it_would_be_tried():
    straight = bent(0.0)
    (one,) = [row for row in straight.to_dict()["hypotheses"] if row["id"] == "bend"]
    least = one["tried_from"]
    assert straight.verdict == "no-mismatch"
    assert least["unit"] == "1"
    # 800 samples of deviation 0.05; of u² what no slope makes up for: 16/5 on average.
    assert least["value"] == pytest.approx(np.sqrt(2.0 * 12.0) * 0.05 / np.sqrt(800 * 16.0 / 5.0), rel=0.3)
    assert bent(least["value"] / 3.0).verdict == "no-mismatch"
    more = bent(3.0 * least["value"])
    assert [cause.hypothesis.id for cause in more.causes] == ["bend"]
    assert all(row["tried_from"] is None for row in more.to_dict()["hypotheses"])


def test_a_hypothesis_fitted_from_another_start_does_not_stand_beside_itself():
    """Several starts of one hypothesis have one label."""
    elsewhere = replace(FAR, addition=Addition(values=(("far.at", 1.0),)))
    found = outcome(refit(CAUSE, finished=True), refit(CAUSE, elsewhere, finished=True))
    (far,) = (one.to_dict() for one in considered(found) if one.hypothesis.label == "far")
    assert far["beside"] == ["cause"]

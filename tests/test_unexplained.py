"""A sensor that stands still is no explanation of what is left over in all other signals."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from forklift.diagnosis import sentences
from forklift.diagnosis.causes import Cause
from forklift.diagnosis.criteria import DOUBTFUL
from forklift.diagnosis.engine import loudest, verdict
from forklift.diagnosis.outcome import Location, Outcome
from forklift.diagnosis.refit import Refit
from forklift.plant.findings import InvalidStretch
from forklift.plant.forklift.vocabulary import ForkliftWords
from forklift.plant.hypotheses import invalid_hypothesis
from forklift.plant.protocol import Addition, Hypothesis


def cause(one: Hypothesis) -> Cause:
    return Cause(one, 1.0, "complete", (), ())


def hypothesis(name: str, kind: Any) -> Hypothesis:
    return Hypothesis(name, kind, name, "free", "friction", name, Addition())


STUCK = cause(invalid_hypothesis(InvalidStretch("a.csv", "pressure_free_pa", 4.0, 6.0, "stuck")))
LEAK, CURVE = cause(hypothesis("leakage", "physics")), cause(hypothesis("unknown", "unknown"))


@pytest.mark.parametrize(
    ("complete", "worst", "strained", "accepted", "found", "said"),
    [
        (True, 1.0, False, False, (), "sensor-fault"),
        (False, 0.9 * DOUBTFUL, False, False, (), "sensor-fault"),
        (False, 147.0, False, False, (), "unknown-effect"),
        (False, 0.9 * DOUBTFUL, True, False, (), "unknown-effect"),
        (False, 0.9 * DOUBTFUL, False, True, (), "unknown-effect"),  # several explain it as well
        (False, 147.0, False, True, (LEAK,), "missing-physics"),
    ],
)
def test_what_was_seen_before_any_fit_is_the_verdict_only_where_nothing_is_left_over(
    complete: bool, worst: float, strained: bool, accepted: bool, found: tuple[Cause, ...], said: str
) -> None:
    baseline = SimpleNamespace(
        complete=complete, strained=strained, worst=SimpleNamespace(mean_square=worst), fitted_alone=False
    )
    final = SimpleNamespace() if accepted else baseline
    selection = cast(Any, SimpleNamespace(baseline=baseline, final=final))
    assert verdict(selection, found, (STUCK,)) == said


@pytest.mark.parametrize("hopeless", [False, True])
@pytest.mark.parametrize(("fitted", "said"), [(1.3, "no-mismatch"), (31.0, "unknown-effect")])
def test_what_acts_in_recordings_that_were_fitted_alone_is_a_mismatch(fitted, said, hopeless) -> None:
    held, other = (
        SimpleNamespace(
            file=f"{role}.csv",
            channel=role,
            role=role,
            explained=square < DOUBTFUL,
            mean_square=square,
            excess=square,
            strain=0.0,
        )
        for role, square in (("validate", 0.8), ("estimate", fitted))
    )
    nothing = cast(Any, None)
    baseline = Refit((), nothing, nothing, (held,), (0.0, 0.0), True, nothing, rest=lambda: (other,))  # type: ignore[arg-type, return-value]
    assert baseline.complete
    assert baseline.fitted_alone is (said == "unknown-effect")
    assert baseline.shown_in == (("estimate.csv",) if baseline.fitted_alone else ())
    assert loudest(baseline) == ("estimate" if said == "unknown-effect" else "validate")
    selection = cast(Any, SimpleNamespace(baseline=baseline, final=baseline))
    assert verdict(selection, (), hopeless=hopeless) == ("no-mismatch" if hopeless else said)


@pytest.mark.parametrize(
    ("name", "causes", "unexplained"),
    [
        ("unknown-effect", (STUCK,), True),
        ("unknown-effect", (), True),
        ("unknown-effect", (CURVE, STUCK), False),
        ("sensor-fault", (STUCK,), False),
        ("missing-physics", (LEAK, STUCK), False),
    ],
)
def test_something_is_missing_without_a_cause_though_a_sensor_stands_still(
    name: str, causes: tuple[Cause, ...], unexplained: bool
) -> None:
    found = cast(Any, SimpleNamespace(verdict=name, causes=causes))
    found.explaining = Outcome.explaining.fget(found)  # type: ignore[attr-defined]
    assert Outcome.unexplained.fget(found) is unexplained  # type: ignore[attr-defined]
    assert STUCK not in found.explaining


@pytest.mark.parametrize("fitted", [False, True])
@pytest.mark.parametrize("files", [(), ("a.csv",), ("a.csv", "b.csv"), ("a.csv", "b.csv", "c.csv", "d.csv")])
def test_the_sentence_says_what_is_missing_first_and_the_sensor_beside_it(
    files: tuple[str, ...], fitted: bool
) -> None:
    found = SimpleNamespace(
        verdict="unknown-effect",
        causes=(STUCK,),
        explaining=(),
        unexplained=True,
        doubted=(),
        confounded=(),
        after=SimpleNamespace(predictions=()),
        judged_on="validate",
        recordings=(),
        findings=SimpleNamespace(unexcited=""),
        final=SimpleNamespace(held_out=(), hypotheses=()),
        baseline=SimpleNamespace(
            fitted_alone=fitted and bool(files),
            shown_in=files,
            judged=[SimpleNamespace(file=f"{name}.csv") for name in "abcdefgh"],
        ),
        location=Location("main", "valve-flow", "position_main_m", "it is a function of the load", 1.0),
        machine=SimpleNamespace(words=ForkliftWords(), part_word="lift"),
    )
    said = sentences.sentence(cast(Any, found))
    assert said.startswith(
        "Something is missing that no hypothesis explains: it acts on the flow through the valve"
    )
    assert said.index("a function of the load") < said.index("Besides, the signal stands still")
    assert all(file in said for file in files if len(files) < 4)
    assert ("4 of the recordings" in said) is (fitted and len(files) == 4)


@pytest.mark.parametrize(("recordings", "told"), [("ab", True), ("a", False)])
def test_what_shows_in_all_recordings_shows_in_none_alone(recordings: str, told: bool) -> None:
    judged = [SimpleNamespace(file=name) for name in recordings]
    refit = cast(Any, SimpleNamespace(shown_in=("a",), judged=judged))
    assert bool(sentences.shown_alone(refit)) is told


@pytest.mark.parametrize(
    ("causes", "said"),
    [
        (["it leaks (free lift)"], "it leaks (free lift)"),
        (["it sags (free lift)", "it sags (main lift)"], "it sags (free lift and main lift)"),
        (
            ["it leaks (main lift)", "air is in it (main lift)"],
            "it leaks (main lift) and air is in it (main lift)",
        ),
        (["the return line builds up pressure"], "the return line builds up pressure"),
        (
            ["it sags (free lift), or equally on the oil", "it sags (main lift)"],
            "it sags (free lift), or equally on the oil and it sags (main lift)",
        ),
    ],
)
def test_what_acts_in_two_places_is_said_once(causes: list[str], said: str) -> None:
    assert sentences.in_one(causes) == said


@pytest.mark.parametrize(
    ("complete", "said"),
    [
        (True, "explains all 2 recordings held out down to the sensors' noise."),
        (False, "held out but for what may be chance, at most 1.6 times the noise power in any signal."),
    ],
)
def test_of_a_sensor_that_stands_still_is_said_what_is_left_without_its_samples(
    complete: bool, said: str
) -> None:
    """Nothing was found beside it, and nothing falls from a number to the same."""
    worst = SimpleNamespace(mean_square=1.6)
    baseline = SimpleNamespace(complete=complete, worst=worst, hypotheses=())
    found = SimpleNamespace(
        verdict="sensor-fault",
        causes=(STUCK,),
        explaining=(),
        judged_on="validate",
        recordings=[SimpleNamespace(role=role) for role in ("estimate", "validate", "validate")],
        findings=SimpleNamespace(unexcited=""),
        baseline=baseline,
        final=baseline,
        confounded=(),
        machine=SimpleNamespace(words=ForkliftWords()),
        after=SimpleNamespace(predictions=()),
    )
    assert sentences.sentence(cast(Any, found)).endswith(said)

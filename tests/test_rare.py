"""Failures too rare to count: as counting finds them where one can count, and the likeliest and worst."""

import json

import numpy as np
import pytest

from forklift.app.main import run
from forklift.base.errors import ForkliftError
from forklift.ensemble.rare import rare
from forklift.ensemble.sweep import sweep

TOGETHER = [{"names": ["load_kg", "free.viscosity.nu_0"], "matrix": [[1.0, -0.9], [-0.9, 1.0]]}]
"""Heavy trucks have thin oil: more of them are fast."""


def document(upper=0.212, **changes):
    """The free lift's valve opened for a second: too fast only with much load and thin oil."""
    return {
        "name": "opened",
        "lifts": "free",
        "duration_s": 1.2,
        "substeps": 2,
        "members": 30_000,
        "seed": 11,
        "profile": [{"from_s": 0.0, "level": 0.0}, {"from_s": 0.2, "level": 0.7}],
        "vary": {
            "load_kg": {"normal": [600.0, 150.0]},
            "free.viscosity.nu_0": {"log_normal": [1.0, 0.1], "relative": True},
        },
        "require": [{"name": "slow", "template": "always", "signal": "speed", "upper": upper, "scale": 0.2}],
    } | changes


@pytest.fixture(scope="module")
def alone():
    return rare(document(), members=500)


@pytest.fixture(scope="module")
def together():
    return rare(document(correlate=TOGETHER), members=500)


def test_it_is_what_counting_finds(alone, together):
    for found, correlate in ((alone, ()), (together, TOGETHER)):
        counted = sweep(document(correlate=correlate)).probability
        interval = found.failures.interval
        assert max(counted.lower, interval.lower) < min(counted.upper, interval.upper)


def test_quantities_drawn_together_fail_together(alone, together):
    assert together.failures.interval.lower > alone.failures.interval.upper


def test_the_likeliest_failure_fails_and_lies_nearer_to_the_middle_than_counted_ones(alone):
    likeliest = alone.likeliest
    assert likeliest.verdict == "overspeed"
    assert likeliest.margins["slow"] < 0.0
    assert likeliest.table["speed_free_m_s"].max() > 0.212
    table = sweep(document()).to_polars()
    failed = table.filter(table["margin.slow"] < 0.0)
    viscosity = alone.truck.values["free.viscosity.nu_0"]

    def away(load, nu_0):
        return np.hypot((load - 600.0) / 150.0, np.log(nu_0 / viscosity) / 0.1)

    counted = away(failed["load_kg"].to_numpy(), failed["free.viscosity.nu_0"].to_numpy()).min()
    found = away(likeliest.varied["load_kg"], likeliest.varied["free.viscosity.nu_0"])
    assert abs(found - counted) < 0.25
    # The first-order estimate of a reliability, Φ(−β), is of the probability's order.
    from scipy.stats import norm

    assert 0.3 < alone.failures.interval.estimate / norm.sf(found) < 3.0


def test_the_worst_case_is_at_the_corner_of_what_was_searched(alone):
    worst = alone.worst
    table = sweep(document(members=2000)).to_polars()
    assert worst.margin <= table["margin.slow"].min() / 0.2
    assert worst.trajectory.margins["slow"] / 0.2 == pytest.approx(worst.margin)
    assert worst.trajectory.varied["load_kg"] == pytest.approx(600.0 + 3.0 * 150.0, rel=0.02)
    nearer = rare(document(), members=100, runs=2, within=1.0).worst
    assert nearer.margin > worst.margin
    assert abs(nearer.trajectory.varied["load_kg"] - 600.0) <= 150.0 * (1.0 + 1e-9)


def test_no_number_depends_on_threads(alone):
    assert rare(document(), members=500, threads=1).to_dict() == alone.to_dict()


def test_where_nothing_fails_it_says_that_this_is_no_proof():
    found = rare(document(upper=1e3), members=100, runs=2)
    assert found.failures.interval.estimate == 0.0
    assert found.likeliest is None
    assert found.worst.margin > 0.0
    assert "no proof" in found.verdict
    assert "keeps every requirement" in str(found)


@pytest.mark.parametrize(
    ("change", "given", "named"),
    [
        ({}, {"members": 105}, "members"),
        ({}, {"members": 10}, "members"),
        ({}, {"runs": 1}, "runs"),
        ({}, {"generations": 0}, "generations"),
        ({}, {"within": 0.0}, "within"),
        ({}, {"within": float("nan")}, "within"),
        ({}, {"within": float("inf")}, "within"),
        ({"vary": {}}, {}, "varies"),
    ],
)
def test_a_number_out_of_bounds_is_refused(change, given, named):
    with pytest.raises(ForkliftError, match=named) as caught:
        rare(document(**change), **given)
    assert caught.value.code == "argument-invalid"


def test_the_command_says_and_writes_the_same(tmp_path, capsys):
    spec, out = tmp_path / "sweep.toml", tmp_path / "rare"
    given = document(members=2000)
    lines = [
        f"{key} = {json.dumps(given[key])}" for key in ("name", "lifts", "duration_s", "substeps", "seed")
    ]
    for stretch in given["profile"]:
        lines += ["[[profile]]", *(f"{key} = {value}" for key, value in stretch.items())]
    lines += ["[vary.load_kg]", "normal = [600.0, 150.0]"]
    lines += ['[vary."free.viscosity.nu_0"]', "log_normal = [1.0, 0.1]", "relative = true"]
    lines += ["[[require]]", *(f"{key} = {json.dumps(value)}" for key, value in given["require"][0].items())]
    spec.write_text("\n".join(lines) + "\n")
    call = ["rare", str(spec), "--members", "200", "--runs", "3", "--generations", "5", "--out", str(out)]
    assert run(call) == 0
    said = capsys.readouterr().out
    assert "likeliest failure" in said
    assert "load_kg" in said
    assert {one.name for one in out.iterdir()} == {"rare.json", "likeliest.csv", "worst.csv"}
    assert run([*call, "--json"]) == 0  # over the earlier result
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((out / "rare.json").read_text())
    assert told["likeliest_failure"]["verdict"] == "overspeed"
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "note.txt").write_text("mine")
    assert run([*call[:-1], str(tmp_path / "mine")]) == 2
    assert "note.txt" in capsys.readouterr().err


def test_values_outside_their_bounds_fail_and_stop_nothing():
    """A tenth of the loads is negative: such a member is a failure of a sweep, too, and has no lowering."""
    vary = {"load_kg": {"normal": [100.0, 100.0 / 1.2816]}}
    found = rare(document(upper=1e3, vary=vary), members=200, runs=4)
    assert 0.1 in found.failures.interval
    assert found.likeliest is None
    assert found.worst.trajectory.varied["load_kg"] >= 0.0
    assert "outside its parameter's bounds" in str(found)
    assert (
        rare(document(upper=1e3, vary={"load_kg": {"normal": [-9e3, 1.0]}}), members=100, runs=2).worst
        is None
    )

"""Sweeps at their edges: what cannot be meant is refused, and what is told holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from scipy.stats import truncnorm

from forklift.base.alone import alone_in
from forklift.base.errors import ForkliftError
from forklift.control.closed_loop import Lowering, lower
from forklift.control.compare import compare_controllers
from forklift.control.controller import Controller, Curve
from forklift.ensemble import specification
from forklift.ensemble.intervals import over_replicates, over_scrambles
from forklift.ensemble.members import Members
from forklift.ensemble.reduce import Tally, axis
from forklift.ensemble.sweep import begun, sweep
from forklift.plant.forklift.truck import Truck
from test_sweep import document

TOGETHER = [[1.0, 0.9], [0.9, 1.0]]


@pytest.mark.parametrize("share", [1.0 / 64.0, 0.25, 0.5, 0.9])
def test_scrambles_that_are_alike_leave_both_ends_open(share: float) -> None:
    """Where each differs to one side with 1 − 0.025^(1/n), n are alike in 2.5 % of the cases."""
    found = over_scrambles([share] * 16)
    assert found.lower < share < found.upper
    assert (1.0 - (found.upper - share) / (1.0 - share)) ** 16 == pytest.approx(0.025)
    assert (found.lower / share) ** 16 == pytest.approx(0.025)


@pytest.mark.parametrize(("share", "open_end"), [(0.0, "upper"), (1.0, "lower")])
def test_scrambles_without_a_failure_or_with_nothing_else_leave_one_end_open(share, open_end) -> None:
    found = over_scrambles([share] * 16)
    ends = {"lower": found.lower, "upper": found.upper}
    assert abs(1.0 - abs(ends.pop(open_end) - share)) ** 16 == pytest.approx(0.05)
    assert list(ends.values()) == [share]


@pytest.mark.parametrize("runs", [10, 20, 30, 50])
def test_an_interval_over_runs_of_which_some_miss_failures_holds_their_mean(runs: int) -> None:
    """One of twenty runs finds a thousandth of what the others find."""
    held = inside = 0
    for repeat in range(100):
        random = np.random.default_rng([runs, repeat])
        found = np.where(
            random.random(runs) < 0.05, 1e-9, 1e-6 * np.exp(0.4 * random.normal(size=runs) - 0.08)
        )
        interval = over_replicates(found)
        held += 0.95e-6 in interval
        inside += interval.estimate in interval
    assert inside == 100
    assert held >= 85


def test_a_quantity_drawn_together_with_two_others_needs_one_matrix() -> None:
    names = ["load_kg", "oil_temperature_degc", "free.viscosity.nu_0"]
    blocks = [{"names": names[:2], "matrix": TOGETHER}, {"names": names[1:], "matrix": TOGETHER}]
    with pytest.raises(ForkliftError) as told:
        specification.check(document(correlate=blocks))
    assert (told.value.code, told.value.facts["value"]) == ("value-invalid", names[1])
    apart = document(correlate=blocks[:1])
    assert specification.check(apart).correlate[0].names == tuple(names[:2])


@pytest.mark.parametrize("kind", ["normal", "log_normal"])
@pytest.mark.parametrize("cut", [(3.0, 5.0), (-5.0, -3.0), (-1.0, 4.0), (5.0, 10.0)])
def test_a_maps_cells_reach_over_what_a_cut_leaves(kind: str, cut: tuple[float, float]) -> None:
    """From the 1st to the 99th percentile of the cut distribution."""
    numbers = [0.0, 1.0, *cut] if kind == "normal" else [1.0, 1.0, *np.exp(cut).tolist()]
    edges = axis("load_kg", kind, numbers).edges
    assert (np.diff(edges) > 0.0).all()
    ends = np.log(edges[[0, -1]]) if kind == "log_normal" else edges[[0, -1]]
    assert ends == pytest.approx(truncnorm(*cut).ppf([0.01, 0.99]), rel=1e-6)


@pytest.mark.parametrize("least", [0.0, -5.0])
def test_a_cut_below_zero_cuts_nothing_of_a_log_normal(least: float) -> None:
    edges = axis("load_kg", "log_normal", [100.0, 0.1, least, 150.0]).edges
    assert edges == pytest.approx(axis("load_kg", "log_normal", [100.0, 0.1, 1e-12, 150.0]).edges)
    assert (np.diff(edges) > 0.0).all()


@pytest.mark.parametrize(
    "vary",
    [{"choice": []}, {"log_normal": [0.0, 1.0]}, {"log_uniform": [-1.0, 2.0]}, {"normal": [1.0, 0.0]}],
)
def test_a_distribution_that_cannot_be_is_refused_before_its_map_is_laid_out(vary: dict) -> None:
    with pytest.raises(ForkliftError) as told:
        sweep(document(members=2, vary={"load_kg": vary}))
    assert told.value.code in ("argument-invalid", "value-invalid")
    assert "load_kg" in told.value.message


@pytest.mark.parametrize("scrambles", [0, 1, 3])
def test_the_number_of_members_that_is_proposed_is_taken(scrambles: int) -> None:
    given = document(sampling="sobol", members=33, scrambles=scrambles)
    with pytest.raises(ForkliftError, match="such as") as told:
        sweep(given)
    proposed = int(told.value.message.rsplit(" ", 1)[1])
    members = Members.of(given | {"members": proposed, "scrambles": max(scrambles, 2)})
    assert members.count == proposed


@pytest.mark.parametrize("by_argument", [False, True])
def test_the_unit_of_what_is_asked_for_is_that_of_what_ran(by_argument: bool) -> None:
    """Speeds of a controller, currents without one, also where the controller is given beside the file."""
    given = document(
        members=2,
        profile=[{"from_s": 0.0, "level": 0.0}, {"from_s": 0.2, "level": 0.3}],
        vary={"profile.1": {"uniform": [0.2, 0.4]}},
    )
    found = sweep(given, controller=Controller.read("thesis") if by_argument else None)
    assert found.to_xarray()["profile.1"].attrs["units"] == ("m/s" if by_argument else "A")


def test_what_ceases_to_be_finite_is_the_worst_whatever_its_margins_were() -> None:
    members = Members.of(document(members=3, vary={}))
    tally: Tally = begun(members)
    table = members_of(members)
    words = table["verdict"].dtype.categories.to_list()  # type: ignore[attr-defined]
    broken = pl.Series("verdict", ["stable", "not_finite", "stable"], dtype=pl.Enum(words))
    tally.add(table.with_columns(broken))
    assert tally.worst is not None
    assert tally.worst["index"][0] == 1
    assert tally.worst["least_scaled_margin"][0] == -np.inf


def members_of(members: Members) -> pl.DataFrame:
    from forklift.ensemble import chunks

    return chunks.run(members, 0)


def test_two_sweeps_into_one_folder_do_not_break_each_other(tmp_path) -> None:
    folder = tmp_path / "swept"
    whole = sweep(document(members=8), out=folder)
    with alone_in(folder), pytest.raises(ForkliftError) as told:
        sweep(document(members=8), out=folder)
    assert told.value.code == "folder-in-use"
    begins = tmp_path / "begins"
    begins.mkdir()
    with alone_in(begins), pytest.raises(ForkliftError) as told:
        sweep(document(members=8), out=begins)
    assert told.value.code == "folder-in-use"
    assert not (begins / "sweep.json").exists()  # it is the other's to say what the folder holds
    assert sweep(document(members=4), out=begins).tally.members == 4
    assert sweep(document(members=8), out=folder).to_dict()["verdicts"] == whole.to_dict()["verdicts"]


def test_a_controllers_file_stands_beside_the_sweeps(tmp_path, monkeypatch) -> None:
    (tmp_path / "here").mkdir()
    Controller.read("thesis").write(tmp_path / "here" / "mine.toml")
    lines = [
        'name = "own"\nlifts = "free"\ncontroller = "mine.toml"\nmembers = 2\n',
        "[[profile]]\nfrom_s = 0.0\nlevel = 0.2\n",
        '[[require]]\nname = "slow"\ntemplate = "always"\nsignal = "speed"\nupper = 0.6\nscale = 0.6\n',
    ]
    path = tmp_path / "here" / "sweep.toml"
    path.write_text("".join(lines), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert Members.of(path).controller.hash == Controller.read("thesis").hash


LOWERING = Lowering(Truck.read("thesis"), Controller.read("thesis"), 0.0, 40.0, np.zeros(5, np.int32))


@pytest.mark.parametrize(
    "call",
    [
        lambda: replace(LOWERING, delay_ticks=-1),
        lambda: replace(LOWERING, pressure_noise_pa=float("nan")),
        lambda: replace(LOWERING, temperature_noise_k=-0.1),
        lambda: replace(LOWERING, request_mm_s=np.array([0.0, 1e10])),
        lambda: replace(LOWERING, request_mm_s=np.array([0.0, np.nan])),
        lambda: lower([LOWERING], substeps=-1),
        lambda: lower([LOWERING], substeps=10**9),
        lambda: lower([LOWERING], seed=2**70),
        lambda: lower([replace(LOWERING, stream=-1)]),
        lambda: lower([replace(LOWERING, start_m=(0.5,))]),
        lambda: lower([replace(LOWERING, load_kg="a")]),
        lambda: compare_controllers([LOWERING.controller], LOWERING.truck, lifts="free"),
        lambda: LOWERING.controller.with_word(-1),
    ],
)
def test_a_lowering_that_cannot_be_meant_is_refused(call) -> None:
    with pytest.raises(ForkliftError) as told:
        call()
    assert told.value.code == "argument-invalid"


@pytest.mark.parametrize("wrong", [{"spacing": 2**40}, {"first": 10**10, "spacing": 3}])
def test_a_tables_knots_lie_within_what_the_word_holds(wrong) -> None:
    with pytest.raises(ValueError, match="less than or equal"):
        Curve(values=[0.0, 1.0], source="test", **wrong)


CALM = {"name": "calm", "signal": "speed", "scale": 0.1, "peak_to_peak_s": 1.0}


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        (CALM | {"template": "settles", "within_s": 0.2, "band": 0.05}, "peak_to_peak_s"),
        (CALM | {"template": "responds", "within_s": 2.0, "share": 0.8}, "peak_to_peak_s"),
        (CALM | {"template": "never_after_settling", "upper": 0.1}, "after_s"),
        (CALM | {"template": "always", "upper": 0.1, "from_s": 20.0}, "from_s, to_s"),
    ],
)
def test_a_requirement_that_cannot_be_meant_is_refused_by_its_name(wrong: dict, name: str) -> None:
    other = {"name": "slow", "template": "always", "signal": "speed", "upper": 0.45, "scale": 0.45}
    with pytest.raises(ForkliftError) as told:
        sweep(document(require=[other, wrong], members=2), controller=Controller.read("thesis"))
    assert told.value.code == "argument-invalid"
    assert told.value.facts["name"] == f'{name} of [[require]] "calm"'


@pytest.mark.parametrize(
    "asked",
    [
        {"template": "always", "signal": "error", "upper": 0.1},
        {"template": "responds", "signal": "speed", "within_s": 1.0, "share": 0.8},
    ],
)
def test_without_a_controller_no_speed_is_asked_for(asked: dict) -> None:
    given = document(require=[asked | {"name": "follows", "scale": 0.1}], members=2)
    with pytest.raises(ForkliftError, match="without a controller"):
        sweep(given)
    found = sweep(document(members=2)).to_polars()
    follows = ["free.overshoot_m_s", "free.settling_time_s", "free.steady_error_m_s"]
    assert found.select(follows).fill_nan(None).null_count().row(0) == (2, 2, 2)
    assert found["free.peak_speed_m_s"].is_finite().all()


def test_a_member_whose_controller_cannot_be_made_fails_and_stops_nothing() -> None:
    """Currents whose least is above their greatest."""
    ends = {"uniform": [0.0, 1400.0]}
    given = document(
        members=16,
        chunk=16,
        profile=[{"from_s": 0.0, "level": 0.0}, {"from_s": 0.2, "level": 0.3}],
        vary={"controller.free.i_min": ends, "controller.free.i_max": ends},
    )
    table = sweep(given, controller=Controller.read("thesis")).to_polars()
    upside_down = table["controller.free.i_min"] >= table["controller.free.i_max"]
    assert 0 < upside_down.sum() < 16
    assert ((table["verdict"].cast(pl.String) == "out_of_bounds") == upside_down).all()

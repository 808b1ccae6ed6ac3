"""Sweeps: a member is a function of seed and index, a folder survives anything, and a page says it all."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import forklift
from forklift.base.errors import ForkliftError
from forklift.control.controller import Controller
from forklift.ensemble import chunks, specification
from forklift.ensemble.members import Members
from forklift.ensemble.reduce import Tally
from forklift.ensemble.sweep import of_folder, replay, sweep
from forklift.plant.forklift.truck import Truck
from pages import Text

THESIS = Truck.read("thesis")


def document(**changes):
    """A small open-loop sweep of the free lift: the profile's levels are currents."""
    found = {
        "name": "open loop",
        "lifts": "free",
        "duration_s": 3.0,
        "substeps": 2,
        "members": 200,
        "chunk": 48,
        "seed": 7,
        "worst": 5,
        "settle_s": 1.5,
        "profile": [{"from_s": 0.0, "level": 0.0}, {"from_s": 0.2, "level": 0.7}],
        "vary": {
            "load_kg": {"uniform": [0.0, 1500.0]},
            "oil_temperature_degc": {"uniform": [10.0, 60.0]},
            "free.viscosity.nu_0": {"log_normal": [1.0, 0.1], "relative": True},
        },
        "require": [
            {"name": "slow", "template": "always", "signal": "speed", "upper": 0.45, "scale": 0.45},
            {
                "name": "calm",
                "template": "never_after_settling",
                "signal": "speed",
                "peak_to_peak_s": 1.0,
                "after_s": 1.5,
                "upper": 0.05,
                "scale": 0.05,
            },
        ],
    }
    return found | changes


def digest(folder):
    """Of every member's file."""
    files = sorted((folder / chunks.FOLDER).iterdir())
    return [(file.name, hashlib.sha256(file.read_bytes()).hexdigest()) for file in files]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep") / "swept"
    return sweep(document(), out=folder)


def test_the_page_the_json_and_the_text_count_alike(swept):
    told = swept.to_dict()
    assert sum(told["verdicts"].values()) == told["members"] == 200
    assert told["failures"] == 200 - told["verdicts"]["stable"]
    assert sum(map(sum, told["map"]["members"])) == 200
    assert sum(map(sum, told["map"]["failures"])) == told["failures"]
    assert 0 < told["failures"] < 200
    table = swept.to_polars()
    assert [int((table[f"margin.{name}"] < 0).sum()) for name in ("slow", "calm")] == [
        one["broken"] for one in told["requirements"]
    ]
    assert json.loads((swept.folder / "result.json").read_text())["failures"] == told["failures"]
    page = forklift.base.present.page(swept)
    assert f"{told['failures']} of 200" in page
    assert str(swept.worst["index"][0]) in page


def test_the_worst_are_the_least_margins_of_all(swept):
    table = swept.to_polars()
    least = np.minimum(table["margin.slow"].to_numpy() / 0.45, table["margin.calm"].to_numpy() / 0.05)
    order = np.lexsort((table["index"].to_numpy(), least))[:5]
    assert swept.worst["index"].to_list() == table["index"].to_numpy()[order].tolist()


def test_no_byte_of_a_chunk_depends_on_threads_and_no_number_on_its_size(swept, tmp_path):
    one = sweep(document(), out=tmp_path / "one", threads=1)
    assert digest(one.folder) == digest(swept.folder)
    other = sweep(document(chunk=7))
    assert other.to_polars().equals(swept.to_polars())


def test_in_single_precision_a_sweep_finds_what_it_finds_in_double(swept, tmp_path):
    single = sweep(document(precision="single"), out=tmp_path / "single")
    both = [one.to_polars() for one in (swept, single)]
    for name in ("margin.slow", "margin.calm"):
        apart = np.abs(np.subtract(*(table[name].to_numpy() for table in both)))
        assert 0.0 < apart.max() < 1e-4
    assert single.tally.failures == swept.tally.failures
    # Its bits are its own, on one thread, in other chunks, and of one member alone.
    assert digest(sweep(document(precision="single"), out=tmp_path / "one", threads=1).folder) == digest(
        single.folder
    )
    assert sweep(document(precision="single", chunk=7)).to_polars().equals(both[1])
    assert single.replay(17).margins["slow"] == both[1]["margin.slow"][17]
    # A folder of the other precision is not gone on with, and one from before there was a choice is.
    checked = [specification.check(document(**more)) for more in ({}, {"precision": "single"})]
    assert checked[0].sha256 != checked[1].sha256
    assert checked[0].sha256 == specification.check(document(precision="double")).sha256
    with pytest.raises(ForkliftError, match="precision"):
        specification.check(document(precision="half"))


def test_a_folder_goes_on_where_it_stood(swept, tmp_path):
    folder = tmp_path / "again"
    again = sweep(document(), out=folder)
    assert again.made == 200
    for name in ("000001", "000003"):
        (folder / chunks.FOLDER / f"{name}.parquet").unlink()
    (folder / chunks.FOLDER / ".000001.parquet.1.tmp").write_text("half")
    again = sweep(document(), out=folder)
    assert again.made == 48 + 48
    assert digest(folder) == digest(swept.folder)
    assert sweep(document(), out=folder).made == 0
    with pytest.raises(ForkliftError, match="another sweep") as caught:
        sweep(document(seed=8), out=folder)
    assert caught.value.code == "output-exists"


@pytest.mark.skipif(os.name == "nt", reason="needs SIGKILL")
def test_what_was_killed_and_goes_on_has_the_same_bytes(tmp_path):
    settings = document(members=600, chunk=16)
    whole = sweep(settings, out=tmp_path / "whole")
    folder = tmp_path / "killed"
    script = f"from forklift.ensemble.sweep import sweep; sweep({settings!r}, out={str(folder)!r})"
    place = folder / chunks.FOLDER
    for least in (1, 8, 20):
        process = subprocess.Popen([sys.executable, "-c", script], env=os.environ)
        deadline = time.monotonic() + 60.0
        while process.poll() is None and time.monotonic() < deadline:
            if place.is_dir() and len(list(place.glob("*.parquet"))) >= least:
                process.send_signal(signal.SIGKILL)
                break
            time.sleep(0.002)
        process.wait()
    sweep(settings, out=folder)
    assert digest(folder) == digest(whole.folder)


def test_a_member_by_itself_has_its_numbers_and_its_trajectory(swept):
    table = swept.to_polars()
    for index in (0, 47, 48, 199):
        row = table.row(index, named=True)
        one = replay(*of_folder(swept.folder), index)
        assert one.verdict == row["verdict"]
        assert one.margins == {name: row[f"margin.{name}"] for name in ("slow", "calm")}
        assert one.varied == {name: row[name] for name in document()["vary"]}
        assert -one.table["velocity_free_m_s"].min() == row["free.peak_speed_m_s"]
    with pytest.raises(ForkliftError, match="no member 200"):
        replay(*of_folder(swept.folder), 200)


@pytest.mark.parametrize("lifts", ["free", "main"])
def test_the_trajectory_that_is_drawn_breaks_what_its_margins_say(lifts):
    """Requirements and references speak of the forks, which the main lift's cylinder moves twice as far."""
    found = sweep(document(lifts=lifts, members=16, vary={"load_kg": {"uniform": [0.0, 1500.0]}}))
    for index in found.worst["index"][:3]:
        one = found.replay(int(index))
        speed = one.table[f"speed_{lifts}_m_s"].to_numpy()
        assert 0.45 - speed.max() == pytest.approx(one.margins["slow"], abs=1e-12)
        # From 1.5 s after the step at 0.2 s on, each time over the second before.
        swing = [np.ptp(speed[last - 50 : last + 1]) for last in range(85, len(speed))]
        assert 0.05 - max(swing) == pytest.approx(one.margins["calm"], abs=2e-3)


def test_columns_have_units_and_the_page_says_what_was_drawn(swept):
    data = swept.to_xarray()
    assert data["load_kg"].attrs["units"] == "kg"
    assert data["free.viscosity.nu_0"].attrs["units"] == "m2/s"
    assert data["margin.slow"].attrs["units"] == "m/s"
    assert data["free.peak_pressure_pa"].attrs["units"] == "Pa"
    text = Text(forklift.base.present.page(swept)).everything
    for said in ("Oil temperature", "uniform, 10 to 60", "log-normal, median 1 times", "0.7 A from 0.2 s on"):
        assert said in text
    assert "load_kg" not in text


def test_the_single_run_of_the_same_steps_has_the_same_bits(swept):
    """The open loop is a recording replayed, delayed by the four ticks between sensors and coil."""
    one = swept.replay(3)
    time_s = one.table["time_s"].to_numpy()
    current = np.concatenate([np.zeros(4), one.table["current_free_a"].to_numpy()[:-4]])
    truck = THESIS.with_values({"free.viscosity.nu_0": one.varied["free.viscosity.nu_0"]})
    run = truck.core.simulate(
        time_s,
        time_s,
        np.stack([current, np.zeros_like(current)], axis=1),
        np.full(len(time_s), one.varied["oil_temperature_degc"]),
        one.varied["load_kg"],
        lifts="free",
        solver="fixed",
        substeps=2,
    )
    velocity = list(forklift.plant.forklift.tables.outputs()).index("velocity_free_m_s")
    assert np.array_equal(run["outputs"][:, velocity], one.table["velocity_free_m_s"].to_numpy())


def test_what_is_out_of_bounds_has_a_verdict():
    vary = {"load_kg": {"uniform": [-500.0, 500.0]}}
    found = sweep(document(vary=vary, members=64))
    outside = found.to_polars()["load_kg"].to_numpy() < 0.0
    assert found.tally.verdicts["out_of_bounds"] == outside.sum() > 0
    assert forklift.base.present.page(found)


def test_a_sobol_sweep_has_an_interval_over_scrambles_and_a_grid_has_none():
    found = sweep(document(sampling="sobol", members=256, scrambles=16))
    assert "16 scrambles" in found.probability.method
    assert found.probability.estimate == pytest.approx(found.tally.failures / 256)
    # A member does not depend on the chunk that holds it.
    assert (
        sweep(document(sampling="sobol", members=256, scrambles=16, chunk=3))
        .to_polars()
        .equals(found.to_polars())
    )
    vary = {"load_kg": {"grid": [0.0, 1500.0, 4]}, "oil_temperature_degc": {"choice": [20.0, 40.0, 60.0]}}
    grid = sweep(document(sampling="grid", vary=vary))
    assert grid.probability is None
    assert grid.tally.seen.tolist() == [[1, 1, 1]] * 4
    assert sorted(set(grid.to_polars()["load_kg"])) == [0.0, 500.0, 1000.0, 1500.0]


def test_points_of_a_scrambled_sequence_fill_their_cells():
    members = Members(specification.check(document(sampling="sobol", members=512, scrambles=2)), THESIS)
    values, _ = members.draw(0, 256)
    counts, _ = np.histogram(values[:, 0], bins=16, range=(0.0, 1500.0))
    assert set(counts) == {16}
    assert not np.array_equal(values, members.draw(256, 512)[0])


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"members": 0}, "value-invalid"),
        ({"sampling": "sobol", "members": 100}, "value-invalid"),
        ({"typo": 1}, "key-unknown"),
        ({"require": []}, "value-invalid"),
        ({"conditions": {"load": 3.0}}, "value-invalid"),
        ({"vary": {"load_kg": {}}}, "value-invalid"),
        ({"vary": {"load": {"uniform": [0.0, 1.0]}}}, "argument-invalid"),
        ({"vary": {"load_kg": {"uniform": [1.0, 0.0]}}}, "argument-invalid"),
        ({"substeps": 0}, "value-invalid"),
        ({"duration_s": -1.0}, "argument-invalid"),
    ],
)
def test_a_mistake_is_one_sentence(change, code):
    with pytest.raises(ForkliftError) as caught:
        sweep(document(**change))
    assert caught.value.code == code


@pytest.mark.parametrize("template", list(specification.FORMULAS))
def test_every_template_has_its_formula(template):
    given = {
        "name": "x", "template": template, "signal": "speed", "scale": 1.0, "lower": 0.0, "upper": 1.0,
        "from_s": 0.5,
        "to_s": 2.0, "after_s": 1.0, "within_s": 1.0, "band": 0.1, "share": 0.8,
    }  # fmt: skip
    assert "speed" in specification.Require(**given).formula


def test_a_tally_is_the_same_however_its_members_are_cut(swept):
    members = Members(swept.specification, THESIS)
    table = swept.to_polars()
    tally = Tally(members.specification, swept.tally.axes)
    for piece in (table[:13], table[13:14], table[14:]):
        tally.add(piece)
    assert tally.verdicts == swept.tally.verdicts
    assert tally.worst.equals(swept.worst)


def controlled(**changes):
    """A small closed-loop sweep of the main lift: the profile's levels are speeds."""
    return (
        document(
            name="closed loop",
            controller="thesis",
            lifts="main",
            duration_s=5.0,
            members=64,
            profile=[{"from_s": 0.2, "level": 0.2}],
            vary={
                "load_kg": {"uniform": [0.0, 1500.0]},
                "oil_temperature_degc": {"uniform": [10.0, 60.0]},
                "controller.main.integral": {"uniform": [0.5, 1.5], "relative": True},
                "delay_ticks": {"choice": [3, 4, 5]},
            },
        )
        | changes
    )


def test_the_thesis_controller_follows_its_reference_within_the_envelope():
    found = sweep(controlled())
    table = found.to_polars()
    assert found.tally.verdicts["not_finite"] == found.tally.verdicts["out_of_bounds"] == 0
    # The mean of a second, while the load may swing about it.
    assert np.nanmax(np.abs(table["main.steady_error_m_s"].to_numpy())) < 0.05
    assert table["main.steady_peak_speed_m_s"].max() < 0.6
    one = found.replay(5)
    assert one.margins["slow"] == table["margin.slow"][5]
    assert one.table["reference_main_m_s"].max() == pytest.approx(0.2, abs=5e-3)
    assert np.array_equal(one.table["current_free_a"].to_numpy(), np.zeros(250))


def test_a_swept_controller_has_all_its_parts():
    damped = Controller.read("damped")

    def currents(controller):
        swept = sweep(controlled(members=2), controller=controller)
        return swept.replay(1).table["current_main_a"].to_numpy()

    whole = currents(damped)
    assert whole.max() > 0.5
    for changed in (damped.with_shaper("main", None), damped.with_swing("main", None)):
        assert not np.array_equal(currents(changed), whole)


def test_a_folder_knows_its_controller_again(tmp_path):
    folder = sweep(controlled(members=8), out=tmp_path / "swept").folder
    spec, truck, controller = of_folder(folder)
    again = sweep(spec, truck=truck, controller=controller, out=folder)
    assert again.made == 0
    assert again.controller.hash == controller.hash
    with pytest.raises(ForkliftError, match="another sweep"):
        sweep(spec, truck=truck, controller=controller.with_word(32), out=folder)


CORRELATED = {
    "vary": {
        "free.viscosity.nu_0": {"log_normal": [1.0, 0.1], "relative": True},
        "free.friction.c_v": {"normal": [1.0, 0.1], "relative": True},
        "load_kg": {"uniform": [0.0, 1500.0]},
    },
    "correlate": [
        {"names": ["free.viscosity.nu_0", "free.friction.c_v"], "matrix": [[1.0, -0.8], [-0.8, 1.0]]}
    ],
}


def test_what_is_drawn_together_has_its_correlation_and_each_its_own_distribution():
    members = Members(specification.check(document(members=20_000, **CORRELATED)), THESIS)
    values, _ = members.draw(0, 20_000)
    logarithm = np.log(values[:, 0] / THESIS.values["free.viscosity.nu_0"])
    other = values[:, 1] / THESIS.values["free.friction.c_v"] - 1.0
    found = np.corrcoef(logarithm, other)[0, 1]
    assert found == pytest.approx(-0.8, abs=0.02)
    assert logarithm.std() == pytest.approx(0.1, rel=0.03)
    assert other.std() == pytest.approx(0.1, rel=0.03)
    assert abs(np.corrcoef(values[:, 2], other)[0, 1]) < 0.03
    # A member's values do not depend on who is drawn beside it.
    pieces = [members.draw(first, first + 7)[0] for first in range(0, 70, 7)]
    assert np.array_equal(np.concatenate(pieces), values[:70])


@pytest.mark.parametrize(
    ("names", "matrix", "said"),
    [
        (["load_kg", "typo"], [[1.0, 0.0], [0.0, 1.0]], "not varied"),
        (["load_kg", "load_kg"], [[1.0, 0.0], [0.0, 1.0]], "twice"),
        (["load_kg"], [[1.0, 0.0], [0.0, 1.0]], "rows and columns"),
        (["load_kg", "free.friction.c_v"], [[1.0, 0.5], [0.4, 1.0]], "symmetric"),
        (["load_kg", "free.friction.c_v"], [[2.0, 0.5], [0.5, 1.0]], "symmetric"),
        (
            ["load_kg", "free.friction.c_v", "free.viscosity.nu_0"],
            [[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]],
            "positive semidefinite",
        ),
    ],
)
def test_correlations_that_nothing_can_have_are_refused(names, matrix, said):
    with pytest.raises(ForkliftError, match=said) as caught:
        specification.check(document(vary=CORRELATED["vary"], correlate=[{"names": names, "matrix": matrix}]))
    assert caught.value.code == "value-invalid"


def test_two_that_are_the_same_are_drawn_the_same():
    same = [{"names": ["free.viscosity.nu_0", "load_kg"], "matrix": [[1.0, 1.0], [1.0, 1.0]]}]
    members = Members(specification.check(document(vary=CORRELATED["vary"], correlate=same)), THESIS)
    values, _ = members.draw(0, 200)
    assert np.array_equal(np.argsort(values[:, 0]), np.argsort(values[:, 2]))


def test_values_that_fall_as_theta_rises_are_correlated_the_other_way_round():
    from forklift.ensemble.uncertainty import of_knowledge
    from forklift.fitting.intervals import Knowledge
    from forklift.plant.forklift.unknowns import unknowns

    every = {one.name: one for one in unknowns(THESIS, ("free",))}
    chosen = [every["free.compensator.theta"], every["free.viscosity.nu_0"], every["free.compensator.C_D"]]
    covariance = 1e-4 * np.array([[1.0, 0.8, 0.3], [0.8, 1.0, 0.1], [0.3, 0.1, 1.0]])
    told = of_knowledge(chosen, Knowledge(covariance, (), (), (), {}, covariance), THESIS.values)
    theta = np.random.default_rng(1).multivariate_normal(np.zeros(3), covariance, 4000)
    values = np.array([[one.values(t)[0] for one, t in zip(chosen, row, strict=True)] for row in theta])
    found = np.corrcoef(values, rowvar=False)
    np.testing.assert_allclose(told["correlate"][0]["matrix"], found, atol=0.05)
    assert found[0, 1] < -0.5


def test_a_sweep_that_another_version_began_is_not_gone_on_with(tmp_path):
    folder = sweep(document(members=20), out=tmp_path / "swept").folder
    mark = folder / "sweep.json"
    mark.write_text(json.dumps(json.loads(mark.read_text()) | {"version": "0.0.0"}))
    with pytest.raises(ForkliftError, match="another version"):
        sweep(document(members=20), out=folder)


def test_a_fits_covariance_is_drawn(null_fit):
    from forklift.ensemble.uncertainty import of_knowledge

    given = of_knowledge(null_fit.unknowns, null_fit.knowledge, null_fit.truck.values)
    spec = specification.check(document(members=4000) | given)
    values, _ = Members(spec, null_fit.truck).draw(0, 4000)
    names = list(spec.vary)
    unknown = null_fit.unknowns[0]
    place = names.index(unknown.name)
    column = np.log(values[:, place]) if unknown.scale == "log" else values[:, place]
    wanted = unknown.width * np.sqrt(null_fit.knowledge.covariance[0, 0])
    if unknown.scale == "log":
        assert column.std() == pytest.approx(wanted, rel=0.1)
    found = np.corrcoef(values, rowvar=False)
    told = np.array(given["correlate"][0]["matrix"])
    strong = np.abs(told) > 0.5
    assert np.abs(found - told)[strong].max() < 0.25


@pytest.mark.parametrize("width", [1280, 390])
def test_in_a_browser_a_sweeps_page_is_drawn_and_nothing_reaches_beyond_the_edge(swept, tmp_path, width):
    from browser import shown_whole

    file = tmp_path / "report.html"
    file.write_text(forklift.base.present.page(swept), encoding="utf-8")
    shown_whole(file, width)


@pytest.mark.skipif(os.name == "nt", reason="needs SIGKILL")
def test_two_workers_of_a_cluster_one_of_them_killed_give_the_bytes_of_the_local_run(tmp_path):
    distributed = pytest.importorskip("distributed")
    settings = document(members=400, chunk=20)
    here = sweep(settings, out=tmp_path / "here")
    folder = tmp_path / "there"
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as workers:
        script = (
            "from forklift.ensemble.sweep import sweep; "
            f"sweep({settings!r}, out={str(folder)!r}, scheduler={workers.scheduler_address!r})"
        )
        process = subprocess.Popen([sys.executable, "-c", script], env=os.environ)
        deadline, place = time.monotonic() + 120.0, folder / chunks.FOLDER
        while process.poll() is None and time.monotonic() < deadline:
            if place.is_dir() and any(place.glob("*.parquet")):
                os.kill(next(iter(workers.workers.values())).process.process.pid, signal.SIGKILL)
                break
            time.sleep(0.01)
        assert process.wait(timeout=180.0) == 0
    assert digest(folder) == digest(here.folder)


@pytest.mark.parametrize(
    "change",
    [{"seed": -1}, {"substeps": -1}, {"substeps": 0}, {"settle_s": -1.0}, {"band_m_s": -0.1}, {"worst": -1}],
)
def test_a_number_that_cannot_be_meant_is_refused(change):
    with pytest.raises(ForkliftError) as caught:
        sweep(document(**change))
    assert caught.value.code == "value-invalid"
    assert next(iter(change)) in caught.value.message


def test_a_sweep_in_which_nothing_varies_but_the_noise_is_kept_and_shown(tmp_path):
    found = sweep(document(vary={}, members=5, worst=2), out=tmp_path / "sweep")
    told = json.loads((found.folder / "result.json").read_text(encoding="utf-8"))
    assert told["map"]["axes"] == []
    assert told["members"] == 5

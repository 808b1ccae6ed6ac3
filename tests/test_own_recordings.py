"""Recordings of a machine of one's own: clocks, units and names as files have them, and what is refused."""

import json

import numpy as np
import polars as pl
import pytest
import scipy.io

from forklift import diagnose
from forklift.base.errors import ForkliftError
from forklift.plant import campaign
from forklift.plant.hypotheses import hypotheses
from forklift.plant.machine import NumpyMachine
from forklift.plant.own import PlantSubject
from forklift.plant.parts import Effect, Input, Output, Param, State
from forklift.plant.recording import Recording
from forklift.plant.sensors import sensors
from forklift.plant.simulate import simulate_plant
from test_machines import decay

MACHINE = """
from forklift import Plant
from forklift.plant.parts import Input, Output, Param, State
machine = Plant(
    name="relay",
    states=(State("x", start=0.0),),
    params=(Param("a", "1/s", 0.5, 0.05, 5.0),),
    inputs=(Input("u", unit="A"), Input("duty", unit="1", hold="linear")),
    outputs=(Output("y", unit="bar", sigma=0.1),),
    ports=(),
    rhs=lambda t, x, u, w, p, bus: {"x": u["u"] - p["a"] * x["x"]},
    out=lambda t, x, u, w, p, bus: {"y": x["x"]},
)
"""


def folder(tmp_path, columns, channels="", entries=("run.csv",)):
    """A campaign whose files have these columns, and its machine."""
    (tmp_path / "machine.py").write_text(MACHINE)
    for entry in dict.fromkeys(entries):
        pl.DataFrame(columns).write_csv(tmp_path / entry)
    listed = "".join(f'[[recording]]\nfile = "{entry}"\n' for entry in entries)
    (tmp_path / "campaign.toml").write_text(f"[channels]\n{channels}\n{listed}")
    return campaign.read(tmp_path, campaign.machine(tmp_path / "machine.py")).recordings


TIME = [0.0, 0.1, 0.2]


def test_a_unit_in_brackets_counts_mapped_or_not_and_a_share_is_one_hundredth(tmp_path):
    columns = {
        "time_s": TIME,
        "coil [mA]": [250.0, 500.0, 0.0],
        "duty [%]": [50.0] * 3,
        "y [mbar]": [1e3] * 3,
    }
    (one,) = folder(tmp_path, columns, '"coil [mA]" = "u"')
    np.testing.assert_allclose(one.u["u"], [0.25, 0.5, 0.0])
    np.testing.assert_allclose(one.u["duty"], 0.5)
    np.testing.assert_allclose(one.y["y"], 1.0)


def test_a_millipascal_is_no_megapascal(tmp_path):
    (one,) = folder(tmp_path, {"time_s": TIME, "u": TIME, "duty": TIME, "y [mPa]": [1e8] * 3})
    np.testing.assert_allclose(one.y["y"], 1.0)


def test_a_scale_takes_the_place_of_the_files_unit_and_a_unit_that_is_told_goes_before_it(tmp_path):
    columns = {"time_s": TIME, "coil [mA]": [250.0] * 3, "duty": [0.5] * 3, "press [kPa]": [200.0] * 3}
    channels = (
        '"coil [mA]" = { channel = "u", scale = 0.002 }\n"press [kPa]" = { channel = "y", unit = "psi" }'
    )
    (one,) = folder(tmp_path, columns, channels)
    np.testing.assert_allclose(one.u["u"], 0.5)
    np.testing.assert_allclose(one.y["y"], 200.0 * 0.0689475729, rtol=1e-6)


@pytest.mark.parametrize(
    ("columns", "channels", "entries", "code"),
    [
        ({"time_s": TIME, "u": TIME, "v": TIME, "duty": TIME}, 'v = "u"', ("run.csv",), "column-repeated"),
        ({"time_s": TIME, "u": TIME, "duty": TIME}, '"Presure" = "y"', ("run.csv",), "source-missing"),
        ({"time_s": TIME, "u": TIME, "duty": TIME}, "", ("run.csv", "run.csv"), "recording-repeated"),
        ({"time_s": TIME, "u": TIME, "duty": TIME}, "", ("run.csv", "RUN.csv"), "recording-repeated"),
        ({"time_s": TIME, "u": TIME, "duty": TIME}, "", ("../run.csv",), "path-escapes"),
        ({"time_s": TIME, "u": ["1", "oops", "2"], "duty": TIME}, "", ("run.csv",), "cell-not-a-number"),
        ({"time_s": TIME, "u [bar]": TIME, "duty": TIME}, "", ("run.csv",), "unit-of-another-kind"),
        (
            {"time_s": TIME, "w": TIME, "duty": TIME},
            'w = { channel = "u", unit = "bananas" }',
            ("run.csv",),
            "unit-unknown",
        ),
    ],
)
def test_what_cannot_be_meant_is_refused(tmp_path, columns, channels, entries, code):
    with pytest.raises(ForkliftError) as caught:
        folder(tmp_path, columns, channels, entries)
    assert caught.value.code == code


@pytest.mark.parametrize("name", ["t", "time", "time [s]"])
def test_a_channel_may_be_called_like_a_time(tmp_path, name):
    plain = name.partition(" ")[0]
    late = [2.0, 3.0, 5.0]
    plant = decay(outputs=(Output(plain, unit="s"),), out=lambda t, x, u, w, p, bus: {plain: x["x"]})
    pl.DataFrame({"time_s": TIME, name: late, "u": TIME}).write_csv(tmp_path / "r.csv")
    (tmp_path / "campaign.toml").write_text('[[recording]]\nfile = "r.csv"\n')
    (one,) = campaign.read(tmp_path, plant).recordings
    assert (one.time_s.tolist(), one.y[plain].tolist()) == (TIME, late)
    pl.DataFrame({name: TIME, "u": TIME}).write_csv(tmp_path / "r.csv")
    with pytest.raises(ForkliftError) as caught:
        campaign.read(tmp_path, plant)
    assert (caught.value.code, caught.value.channel) == ("column-missing", "time_s")


def test_a_time_may_be_mapped_to_a_channel_and_is_no_input_that_is_computed(tmp_path):
    (one,) = folder(tmp_path, {"time_s": TIME, "t": [5.0] * 3, "duty": TIME}, 't = "u"')
    assert (one.time_s.tolist(), one.u["u"].tolist()) == (TIME, [5.0] * 3)
    plant = decay(inputs=(Input("u"), Input("t", derived=lambda time, u: time)))
    pl.DataFrame({"t": TIME, "u": TIME}).write_csv(tmp_path / "run.csv")
    (tmp_path / "campaign.toml").write_text('[[recording]]\nfile = "run.csv"\n')
    (one,) = campaign.read(tmp_path, plant).recordings
    assert (one.time_s.tolist(), list(one.u)) == (TIME, ["u"])


@pytest.mark.parametrize(
    ("mapped", "code"),
    [
        ("scale = 0.0", "scale-invalid"),
        ("scale = nan", "scale-invalid"),
        ("scale = inf", "scale-invalid"),
        ("offset = -inf", "scale-invalid"),
        ('scale = "0.001"', "campaign-invalid"),
        ("scale = true", "campaign-invalid"),
        ("unit = 3", "campaign-invalid"),
    ],
)
def test_a_scale_that_cannot_be_is_refused(tmp_path, mapped, code):
    with pytest.raises(ForkliftError) as caught:
        folder(tmp_path, {"time_s": TIME, "v": TIME, "duty": TIME}, f'v = {{ channel = "u", {mapped} }}')
    assert caught.value.code == code
    if code == "scale-invalid":
        assert (caught.value.line, caught.value.channel) == (2, "u")


@pytest.mark.parametrize("load", ["nan", "inf", '"heavy"', "true"])
def test_a_condition_is_a_finite_number(tmp_path, load):
    plant = decay()
    (tmp_path / "campaign.toml").write_text(
        f'[[recording]]\nfile = "r.csv"\nconditions = {{ load = {load} }}\n'
    )
    with pytest.raises(ForkliftError) as caught:
        campaign.read(tmp_path, plant)
    assert (caught.value.code, caught.value.name) == ("campaign-invalid", "recording.0.conditions.load")


@pytest.mark.parametrize(
    ("time", "code", "line"),
    [
        ([0.0, 1.0, 2.0, 1.5, 3.0], "time-not-increasing", 5),
        ([0.0, 1.0, 2.0, 2.0, 3.0], "time-not-increasing", 5),
        ([0.0, 1.0, np.nan, 2.0, 3.0], "sample-missing", 4),
    ],
)
def test_times_are_put_in_no_other_order(tmp_path, time, code, line):
    with pytest.raises(ForkliftError) as caught:
        folder(tmp_path, {"time_s": time, "u": time, "duty": time, "y": time})
    assert (caught.value.code, caught.value.line) == (code, line)


def on_own_clocks(tmp_path, **series):
    """A campaign of one MAT-file in which each channel has a clock of its own: times and values."""
    (tmp_path / "machine.py").write_text(MACHINE)
    named = "".join(f'"{name}.values" = "{name}"\n' for name in series)
    (tmp_path / "campaign.toml").write_text(f'[channels]\n{named}[[recording]]\nfile = "run.mat"\n')
    signals = {name: {"time": time, "values": values} for name, (time, values) in series.items()}
    scipy.io.savemat(tmp_path / "run.mat", signals)
    return campaign.read(tmp_path, campaign.machine(tmp_path / "machine.py")).recordings[0]


def test_a_clock_of_a_channels_own_must_increase_too(tmp_path):
    even, back = np.arange(5.0), np.array([0.0, 1.0, 2.0, 1.5, 3.0])
    with pytest.raises(ForkliftError) as caught:
        on_own_clocks(tmp_path, u=(even, even), duty=(even, even), y=(back, even))
    assert (caught.value.code, caught.value.channel) == ("time-not-increasing", "y")


def test_outputs_on_several_clocks_have_lost_nothing_and_end_with_the_inputs(tmp_path):
    quick, slow = 0.01 * np.arange(1001), 0.1 * np.arange(101)
    short = quick[:201]
    one = on_own_clocks(
        tmp_path,
        u=(quick, np.sin(quick)),
        duty=(short + 0.005, short),
        y=(slow + 0.003, slow),
    )
    assert one.time_s[0] == pytest.approx(0.005)
    assert one.time_s[-1] == pytest.approx(2.005)
    assert np.isfinite(one.u["duty"]).all()
    np.testing.assert_allclose(one.u["duty"], one.time_s - 0.005, atol=1e-12)  # on the straight line
    held = one.u["u"][1:] - np.sin(np.floor(one.time_s[1:] / 0.01 + 1e-6) * 0.01)
    np.testing.assert_allclose(held, 0.0, atol=1e-12)
    np.testing.assert_allclose(one.y["y"][one.rows["y"]], slow[1:21], atol=1e-12)
    plant = campaign.machine(tmp_path / "machine.py")
    subject = PlantSubject(plant)
    assert [caution.code for caution in subject.cautions([one])] == []
    late = next(found for found in hypotheses(plant, [one]) if found.id == "sensor_lag")
    assert late.addition.free[0].upper * late.addition.free[0].width == pytest.approx(0.4)
    assert subject.rate_hz(one, "y") == pytest.approx(10.0)
    head = one.between(0, 100, "head")
    np.testing.assert_array_equal(
        head.y["y"][head.rows["y"]], one.y["y"][one.rows["y"]][: len(head.rows["y"])]
    )
    one.y["y"][one.rows["y"][3]] = np.nan
    (caution,) = subject.cautions([one])
    assert (caution.code, "1 of y" in caution.sentence) == ("samples-missing", True)


def test_inputs_that_are_never_known_together_are_refused(tmp_path):
    time = np.arange(5.0)
    with pytest.raises(ForkliftError) as caught:
        on_own_clocks(tmp_path, u=(time, time), duty=(time + 10.0, time), y=(time, time))
    assert caught.value.code == "time-not-common"


def test_a_campaign_that_is_not_utf_8_is_refused(tmp_path):
    folder(tmp_path, {"time_s": TIME, "u": TIME, "duty": TIME})
    (tmp_path / "campaign.toml").write_bytes("# Messung von Öl".encode("latin-1"))
    with pytest.raises(ForkliftError) as caught:
        campaign.read(tmp_path, campaign.machine(tmp_path / "machine.py"))
    assert caught.value.code == "campaign-syntax"


def test_a_row_with_a_cell_too_few_is_refused(tmp_path):
    folder(tmp_path, {"time_s": TIME, "u": TIME, "duty": TIME})
    file = tmp_path / "run.csv"
    file.write_text(file.read_text().replace("0.1,0.1,0.1", "0.1,0.1"))
    with pytest.raises(ForkliftError) as caught:
        campaign.read(tmp_path, campaign.machine(tmp_path / "machine.py"))
    assert caught.value.code == "row-ragged"


def test_an_output_that_is_slower_than_the_input_has_its_own_noise():
    plant = decay(outputs=(Output("y"),))
    random = np.random.default_rng(5)
    time = np.arange(4000) * 0.02
    true = np.exp(-0.1 * time)
    y = true + random.normal(0.0, 0.05, len(time))
    every = np.full(len(time), np.nan)
    every[::5] = y[::5]
    quick, slow = (
        sensors(plant, [Recording("r", time, {"u": np.zeros(len(time))}, {"y": column})])["y"].noise
        for column in (y, every)
    )
    assert quick == pytest.approx(0.05, rel=0.1)
    assert slow == pytest.approx(0.05, rel=0.1)


def test_a_diagnosis_bears_recordings_in_which_nothing_changes():
    """A free decay: no input moves and no condition differs, so that nothing can be correlated."""
    time = np.linspace(0.0, 8.0, 161)
    quiet = {"u": np.zeros(len(time))}
    recordings = []
    for seed, role in ((1, "estimate"), (2, "validate")):
        y = simulate_plant(decay(), time, quiet, {"a": 0.8, "x.start": 2.0})["y"]
        noise = np.random.default_rng(seed).normal(0.0, 0.01, len(time))
        recordings.append(Recording(f"r{seed}", time, quiet, {"y": y + noise}, role))
    found = diagnose(decay(outputs=(Output("y", sigma=0.01),)), recordings)
    assert found.verdict == "no-mismatch"
    assert "correlation" not in json.dumps(found.to_dict()["deficient"])


def test_the_order_of_conditions_does_not_follow_the_sets_order():
    names = [f"c{k}" for k in range(9)]
    time = np.linspace(0.0, 1.0, 20)
    recordings = [
        Recording(
            f"r{k}", time, {"u": np.zeros(20)}, {"y": np.zeros(20)}, conditions=dict.fromkeys(names[::-1], k)
        )
        for k in range(2)
    ]
    columns = PlantSubject(decay()).covariates(recordings, [], {})
    assert list(columns["r0"]) == names


def test_a_restart_leaves_no_sample_out():
    plant = decay(states=(State("x", start="y"),), score="restart", horizon_s=5.0)
    for count, end in ((21, 10.0), (22, 10.5), (20, 9.5), (12, 5.5), (11, 5.0)):
        time = np.linspace(0.0, end, count)
        one = Recording("r", time, {"u": np.zeros(count)}, {"y": np.zeros(count)})
        pieces = NumpyMachine(plant).pieces(one)
        assert sum(len(piece) for piece in pieces) == count
        assert min(len(piece) for piece in pieces) > 1
    sparse = np.r_[np.linspace(0.0, 3.0, 31), np.linspace(30.0, 33.0, 31)]
    for time, horizon in ((np.linspace(0.0, 3.0, 31), 0.05), (sparse, 1.0)):
        one = Recording("r", time, {"u": np.zeros(len(time))}, {"y": np.zeros(len(time))})
        machine = NumpyMachine(decay(states=(State("x", start="y"),), score="restart", horizon_s=horizon))
        assert sum(len(piece) for piece in machine.pieces(one)) == len(time)


def test_an_effect_that_is_not_there_is_refused_and_a_state_starts_within_its_bounds():
    size = Param("size", "1", 0.1, 0.0, 1.0)
    extra = Effect("leak", "a leak", (size,), ("balance",), lambda x, u, p, bus: {"balance": -p["size"]})
    plant = decay(effects=(extra,))
    time, u = np.linspace(0.0, 1.0, 11), {"u": np.zeros(11)}
    for present in (["leek"], "no leak"):
        with pytest.raises(ForkliftError):
            simulate_plant(plant, time, u, present=present)
    for lower, upper, start in (
        (0.0, np.inf, 0.0),
        (-np.inf, -2.0, -2.0),
        (1.0, 3.0, 2.0),
        (-np.inf, np.inf, 0.0),
    ):
        one = decay(states=(State("x", start="y", lower=lower, upper=upper),), inputs=(Input("u"),))
        assert simulate_plant(one, time, u)["y"][0] == start

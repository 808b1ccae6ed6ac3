"""Commands: the test signals of section 3.5 and the file that holds a command."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forklift import ForkliftError, commands
from forklift.plant.forklift.commands import Command

HEAD = "time_s,current_free_a,current_main_a\n"


def test_a_prms_keeps_to_the_working_range_and_switches_about_as_often_as_asked():
    steps = commands.prms(20_000, seed=1)
    assert (steps.min(), steps.max()) == (58, 174)
    assert len(np.unique(steps)) == 8
    assert np.mean(np.diff(steps) != 0) == pytest.approx(0.05 * 7 / 8, rel=0.15)


def test_a_prms_depends_on_its_seed_alone():
    assert np.array_equal(commands.prms(500, seed=3), commands.prms(500, seed=3))
    assert not np.array_equal(commands.prms(500, seed=3), commands.prms(500, seed=4))


def test_settings_of_a_prms_are_its_own():
    steps = commands.prms(5000, 1, low=100, high=120, levels=3, switching_probability=0.2)
    assert sorted(set(steps.tolist())) == [100, 110, 120]


def test_a_staircase_holds_each_level():
    assert commands.staircase([80, 0, 120], 2).tolist() == [80, 80, 0, 0, 120, 120]


def test_the_ecu_has_255_steps_of_1_75_ampere():
    current = commands.steps_to_current(np.array([0, 255]))
    np.testing.assert_allclose(current, [0.0, 1.75])
    assert commands.quantise_current([0.0034])[0] == 0.0
    np.testing.assert_allclose(commands.quantise_current([0.0036]), commands.steps_to_current([1]))


def test_a_low_pass_starts_at_rest_and_reaches_a_step():
    current = np.r_[np.zeros(10), np.ones(200)]
    filtered = commands.low_pass(current, 50.0, 3.0)
    assert np.all(filtered[:10] == 0)
    assert np.all(np.diff(filtered) >= 0)
    assert filtered[-1] == pytest.approx(1.0, abs=1e-6)


def test_dither_leaves_the_mean_as_it_was():
    command = Command.of_samples(50.0, free=np.full(51, 0.8)).with_dither(0.05, 100.0)
    held = np.diff(command.time_s)
    assert np.sum(held * command.current_free_a[:-1]) / held.sum() == pytest.approx(0.8)
    assert np.ptp(command.current_free_a) == pytest.approx(0.1)
    assert not command.current_main_a.any()


@pytest.mark.parametrize("kind", commands.GENERATORS)
def test_a_generated_command_moves_the_lifts_it_is_for_after_a_rest(kind):
    command = commands.generate(kind, "main", duration_s=12.0)
    assert len(command.time_s) == 600
    assert not command.current_free_a.any()
    assert command.current_main_a.max() > 0.5
    assert not command.current_main_a[:50].any()


def test_both_lifts_move_differently():
    command = commands.generate("prms", "both", duration_s=12.0)
    assert not np.array_equal(command.current_free_a, command.current_main_a)


@pytest.mark.parametrize(
    "call",
    [
        lambda: commands.generate("noise", "free", duration_s=12.0),
        lambda: commands.generate("prms", "free", duration_s=0.1),
        lambda: commands.generate("prms", "free", duration_s=float("nan")),
        lambda: commands.prms(100, 1, switching_probability=2.0),
        lambda: commands.prms(100, 1, low=174, high=58),
        lambda: commands.prms(100, 1, high=300),
        lambda: commands.prms(-1, 1),
        lambda: commands.prms(100, 2**70),
        lambda: commands.staircase([300], 5),
        lambda: commands.steps_to_current([0.5]),
        lambda: commands.dither([0.0, 1.0], [0.5, 0.5], -1.0, 60.0),
        lambda: commands.low_pass([1.0, 2.0], 50.0, -1.0),
        lambda: commands.low_pass("strong", 50.0, 3.0),
        lambda: Command.of_samples(50.0),
        lambda: Command.of_samples(0.0, free=np.zeros(5)),
        lambda: Command.of_samples(50.0, free=np.zeros(5), main=np.zeros(4)),
        lambda: Command.of_samples(50.0, free=np.zeros(1)),
        lambda: Command.of_samples(50.0, free=np.array([0.0, np.nan])),
        lambda: Command([0.0, 0.0], [0.0, 0.0], [0.0, 0.0]),
    ],
)
def test_a_bad_call_is_one_clear_error(call):
    with pytest.raises(ForkliftError) as caught:
        call()
    assert caught.value.code in ("argument-invalid", "argument-shape", "command-malformed")
    assert "\n" not in caught.value.message


def test_a_command_is_immutable_and_tells_what_it_is():
    command = commands.generate("prms", "free", duration_s=12.0)
    with pytest.raises(ValueError, match="read-only"):
        command.current_free_a[0] = 1.0
    assert "600 samples" in repr(command)
    assert command.currents.shape == (600, 2)


@given(st.lists(st.floats(0, 1.75), min_size=2, max_size=50), st.floats(1, 1000))
def test_a_written_command_reads_back_equal(tmp_path_factory, current, rate):
    path = tmp_path_factory.mktemp("command") / "command.csv"
    command = Command.of_samples(rate, free=current, main=current[::-1])
    again = Command.read(command.write(path))
    assert again == command
    assert hash(again) == hash(command)
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", None),
        (HEAD, None),
        (f"{HEAD}0,0,0\n", None),
        ("time_s,current_free_a\n0,0\n1,0\n", 1),
        (HEAD.replace("main", "tilt"), 1),
        (f"{HEAD}0,0,0\n0,0,0\n", 3),
        (f"{HEAD}0,0,0\n0.02,x,0\n", 3),
        (f"{HEAD}0,0,0\n0.02,,0\n", 3),
        (f"{HEAD}0,0,0\n0.02,0,nan\n", 3),
        (f"{HEAD}0,0,0\n0.02,0,inf\n", 3),
        (f"{HEAD}0,0,0\n0.02,0\n", 3),
        (HEAD.replace(",", ";"), 1),
    ],
)
def test_a_broken_file_is_refused_with_its_line(tmp_path, text, line):
    path = tmp_path / "command.csv"
    path.write_text(text)
    with pytest.raises(ForkliftError) as caught:
        Command.read(path)
    assert str(path) in caught.value.message
    if line:
        assert caught.value.line == line


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ForkliftError) as caught:
        Command.read(tmp_path / "command.csv")
    assert caught.value.code == "file-unreadable"

"""A mistake in a machine of one's own is told as one, with its place, whichever of its functions makes it."""

import inspect

import numpy as np
import pytest

import forklift
from forklift.app import main as cli
from forklift.base.errors import ForkliftError
from forklift.plant.parts import Effect, Input, Output, Param, State
from forklift.plant.simulate import simulate_plant
from test_machines import decay, recording
from test_own_recordings import MACHINE

TIME = np.linspace(0.0, 1.0, 11)
QUIET = {"u": np.zeros(11)}


def wrong(*given):
    """Asks for a parameter that there is not."""
    return {"x": {}["gain"]}


LINE = inspect.getsourcelines(wrong)[1] + 2


def with_effect(term):
    size = Param("size", "1", 0.1, 0.0, 1.0)
    return {"effects": (Effect("leak", "a leak", (size,), ("balance",), term),)}


DERIVED = (Input("u"), Input("v", derived=wrong))


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"rhs": wrong}, "rhs"),
        ({"out": wrong}, "out"),
        ({"bus": wrong}, "bus"),
        ({"rhs": wrong, "states": (State("x", start="steady"),)}, "rhs"),
        (with_effect(wrong), "term of effect leak"),
        ({"inputs": DERIVED}, "derived input v"),
    ],
)
def test_a_function_that_fails_is_told_with_its_line(changed, what):
    plant = decay(**changed)
    with pytest.raises(ForkliftError) as caught:
        simulate_plant(plant, TIME, QUIET, present=[one.id for one in plant.effects])
    error = caught.value
    assert (error.code, error.name, error.error) == ("plant-invalid", what, "KeyError")
    assert (error.file, error.line) == (__file__, LINE)
    assert isinstance(error.__cause__, KeyError)


@pytest.mark.parametrize(
    "changed",
    [
        {"rhs": lambda *_: None},
        {"rhs": lambda *_: {"x": "fast"}},
        {"rhs": lambda *_: {"x": np.zeros(7)}},
        {"out": lambda *_: 3.0},
        {"out": lambda *_: {"y": np.zeros(7)}},
        {"out": lambda *_: {}},
        {"bus": lambda *_: {"flow": "much"}},
        with_effect(lambda *_: {"balanse": 1.0}),
        with_effect(lambda *_: 1.0),
    ],
)
def test_what_a_function_gives_must_be_numbers_by_name(changed):
    plant = decay(**changed)
    with pytest.raises(ForkliftError) as caught:
        simulate_plant(plant, TIME, QUIET, present=[one.id for one in plant.effects])
    assert caught.value.code == "plant-invalid"


def test_an_effect_that_fails_is_not_passed_over_by_a_diagnosis():
    plant = decay(**with_effect(wrong), outputs=(Output("y", sigma=0.01),))
    recordings = [recording(decay(), 1), recording(decay(), 2, "validate")]
    with pytest.raises(ForkliftError) as caught:
        forklift.diagnose(plant, recordings)
    assert (caught.value.code, caught.value.line) == ("plant-invalid", LINE)


@pytest.mark.parametrize("raised", [KeyboardInterrupt, MemoryError])
def test_what_is_no_mistake_of_the_function_passes(raised):
    def fails(*given):
        raise raised

    with pytest.raises(raised):
        simulate_plant(decay(out=fails), TIME, QUIET)


def test_the_command_names_the_line_and_a_code(tmp_path, capsys):
    (tmp_path / "machine.py").write_text(MACHINE.replace('p["a"] * x', 'p["gain"] * x'))
    (tmp_path / "run.csv").write_text("time_s,u,duty,y\n0,0,0,0\n1,0,0,0\n2,0,0,0\n")
    call = ["simulate", "--machine", str(tmp_path / "machine.py"), "--command", str(tmp_path / "run.csv")]
    assert cli.run(call) == cli.REFUSED
    said = capsys.readouterr().err
    line = next(k for k, text in enumerate(MACHINE.splitlines(), 1) if "rhs=" in text)
    assert f"line {line}" in said
    assert "[plant-invalid]" in said

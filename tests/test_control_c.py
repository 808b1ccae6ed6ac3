"""The exported C: the same bits as the core, no overflow, no undefined behaviour, every branch; on a
Cortex-M too.

`proofs/controller.py` runs the same checks on ten million ticks and both word lengths.
"""

import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "proofs"))

import control_c  # type: ignore[import-not-found]
from forklift.control.c_export import FILES, export_c
from forklift.control.controller import Controller


def needs(*tools: str) -> None:
    missing = control_c.missing(*tools)
    if missing:
        pytest.skip(f"{', '.join(missing)} not installed (see .ci/run)")


@pytest.fixture(params=[16, 32], ids=["16 bits", "32 bits"])
def exported(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Controller, Path]:
    controller = Controller.read("damped").with_word(request.param)
    return controller, export_c(controller, tmp_path / "ecu")


def test_the_c_gives_the_bits_of_the_core_from_random_states(exported: tuple[Controller, Path]) -> None:
    needs("cc")
    controller, folder = exported
    assert control_c.equal(controller, folder, seed=5, ticks=20_000)
    # The comparison can fail: another digest is refused.
    assert not control_c.run_test(folder, seed=5, ticks=20_000, digest=1)


@pytest.mark.parametrize("helper", ["times", "rounded", "truncated", "saturated", "table"])
def test_the_helpers_of_the_c_give_the_bits_of_the_core(helper: str, tmp_path: Path) -> None:
    """Some upper arguments, the ends and zero among them, with every lower one; the proof takes all."""
    needs("cc")
    controller = Controller.read("damped")
    folder = export_c(controller, tmp_path / "ecu")
    numbers = [number for name, number in control_c.helpers(controller) if name == helper]
    assert numbers
    for first, last in ((-32768, -32766), (-2, 2), (32766, 32768)):
        assert control_c.helper_equal(controller, folder, helper, numbers[0], first, last)


def test_a_controller_without_feedback_of_the_pressure_has_the_same_bits_too(tmp_path: Path) -> None:
    needs("cc")
    controller = Controller.read("thesis")
    folder = export_c(controller, tmp_path / "ecu")
    assert control_c.equal(controller, folder, seed=9, ticks=20_000)


def test_the_files_name_the_configuration_they_hold(exported: tuple[Controller, Path]) -> None:
    controller, folder = exported
    assert sorted(path.name for path in folder.iterdir()) == sorted(FILES)
    for name in FILES[:4]:
        assert controller.hash in (folder / name).read_text()
    assert Controller.read(folder / "controller.toml").hash == controller.hash
    source = (folder / "forklift_control.c").read_text()
    for word in ("float", "double", "malloc", " long", "/ config", "@"):
        assert word not in source


def test_random_states_reach_every_line_and_branch(exported: tuple[Controller, Path]) -> None:
    needs("gcc", "gcov")
    assert control_c.coverage(exported[1]) == {"Lines executed": 100.0, "Taken at least once": 100.0}


def test_eva_finds_no_alarm_and_finds_one_without_the_clamp_of_the_integrator(
    exported: tuple[Controller, Path],
) -> None:
    needs("frama-c")
    folder = exported[1]
    assert control_c.alarms(folder) == 0
    assert control_c.alarms(control_c.without_clamp(folder)) > 0


def test_the_ranges_that_eva_prints_lie_within_those_of_the_crate(
    exported: tuple[Controller, Path],
) -> None:
    needs("frama-c")
    assert control_c.outside_the_crates_ranges(*exported) == []


def test_cppcheck_finds_nothing_against_misra(exported: tuple[Controller, Path]) -> None:
    needs("cppcheck")
    assert control_c.misra(exported[1]) == []


@pytest.mark.parametrize("processor", list(control_c.MACHINES))
def test_an_emulated_cortex_gives_the_same_bits(processor: str, tmp_path: Path) -> None:
    needs("arm-none-eabi-gcc", "qemu-system-arm")
    controller = Controller.read("damped")
    folder = export_c(controller, tmp_path / "ecu")
    assert control_c.on_cortex(controller, folder, processor, ticks=2_000)


def test_a_tick_takes_a_counted_number_of_instructions_and_bytes(tmp_path: Path) -> None:
    """Work is pinned by counts; what a tick costs in microseconds depends on the processor's clock. With all
    that a controller can have, a tick is below a twentieth of 20 ms at 8 MHz and an instruction a cycle."""
    needs("arm-none-eabi-gcc", "qemu-system-arm")
    controller = Controller.read("damped")
    folder = export_c(controller, tmp_path / "ecu")
    counted = control_c.instructions(controller, folder, "cortex-m4", ticks=8)
    assert 500 < counted["mean"] <= counted["most"] < 8_000
    size = control_c.size(folder, "cortex-m4")
    assert size["static"] == 0
    assert size["state"] == 888
    assert size["flash"] < 5_000
    assert size["stack"] < 400


def test_a_folder_with_something_else_in_it_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    shown = subprocess.run(
        [sys.executable, "-m", "forklift", "control", "export-c", "thesis", "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert shown.returncode == 2
    assert "notes.txt" in shown.stderr
    assert (tmp_path / "notes.txt").read_text() == "mine"

"""A controller for a truck of one's own: with its tables it does there what it did on the truck it is of."""

import numpy as np
import pytest

from forklift.app.main import run
from forklift.control.compare import compare_controllers
from forklift.control.controller import Controller
from forklift.control.own_truck import for_truck
from forklift.control.presets import scaling_error
from forklift.plant.forklift.speed_table import TemperatureScaling, speed_to_current
from forklift.plant.forklift.truck import Truck

THESIS = Truck.read("thesis")
WIDER = THESIS.with_values(
    {f"{lift}.valve.table_area": tuple(1.25 * a for a in THESIS.values[f"{lift}.valve.table_area"])
     for lift in ("free", "main")},
    source="a valve that opens a quarter further",
)  # fmt: skip


def rows(controller, truck, lift="free"):
    return compare_controllers(
        [controller], truck, lifts=(lift,), loads_kg=(800.0,), oil_temperatures_degc=(20.0, 40.0, 60.0)
    )


@pytest.mark.parametrize("lift", ["free", "main"])
def test_without_feedback_the_speed_is_right_where_its_table_holds(lift):
    today = Controller.read("today")
    made, own = rows(today, WIDER, lift)[1], rows(for_truck(today, WIDER), WIDER, lift)[1]
    kept = rows(today, THESIS, lift)[1]
    assert abs(made.error_percent - kept.error_percent) > 10.0
    assert own.error_percent == pytest.approx(kept.error_percent, abs=1.5)


def test_with_feedback_no_steady_speed_is_above_the_limit_and_it_follows_better():
    thesis = Controller.read("thesis")
    made, own = rows(thesis, WIDER), rows(for_truck(thesis, WIDER), WIDER)
    assert any(row.breaches for row in made)
    assert not any(row.breaches for row in own)
    for one, other in zip(made, own, strict=True):
        assert np.mean(other.nrmse_percent) > np.mean(one.nrmse_percent)


@pytest.mark.parametrize("lift", ["free", "main"])
def test_its_scaling_leaves_little_over_at_all_temperatures_and_loads(lift):
    """Half of what the table alone does; no more than a quarter above Table 5.3 with its best table."""
    numbers = getattr(for_truck(Controller.read("thesis"), THESIS), lift).numbers
    scaling = TemperatureScaling(
        numbers["a"].value, numbers["b"].value, 1e-3 * numbers["c"].value, 1e-3 * numbers["d"].value
    )
    table = speed_to_current(THESIS, lift, oil_temperature_degc=40.0)
    speeds, degc = 1e-3 * np.arange(50.0, 551.0, 50.0), np.array([20.0, 40.0, 60.0])

    def left(one):
        found = one.left_over(table, speeds, degc, np.array([0.0, 800.0, 1500.0]))
        return np.sqrt(np.mean(found**2))

    assert left(scaling) < left(TemperatureScaling(0.0, 1.0, 0.0, 0.0)) / 2.0
    assert left(scaling) < 1.25 * scaling_error(THESIS, lift, 12.0)


def test_what_has_no_scaling_gets_none_and_gains_stay():
    today = Controller.read("today")
    own = for_truck(today, WIDER)
    assert own.free.numbers == today.free.numbers
    damped = Controller.read("damped")
    assert for_truck(damped, WIDER).free.swing == damped.free.swing
    assert for_truck(damped, WIDER).main.numbers["integral"] == damped.main.numbers["integral"]


def test_the_command_writes_what_the_function_gives(tmp_path, capsys):
    truck, out = tmp_path / "mine.toml", tmp_path / "mine_pid.toml"
    WIDER.write(truck)
    assert run(["control", "for-truck", "thesis", "--truck", str(truck), "--out", str(out)]) == 0
    assert Controller.read(out).hash == for_truck(Controller.read("thesis"), Truck.read(truck)).hash
    assert run(["control", "for-truck", "thesis", "--truck", str(truck), "--out", str(tmp_path)]) == 2
    assert run(["control", "for-truck", "nobody", "--truck", str(truck), "--out", str(out)]) == 2
    hot = ["control", "for-truck", "thesis", "--truck", str(truck), "--out", str(out), "--temperature", "500"]
    assert run(hot) == 2
    assert "500" in capsys.readouterr().err

"""A truck's free shapes: what they say, and that a simulation with one does what it says."""

import re
from dataclasses import replace

import numpy as np
import pytest

from forklift import ForkliftError, Truck, commands, simulate
from forklift.plant.forklift.free_curve import COEFFICIENTS, FINE, FreeCurve, ports, variables
from forklift.plant.forklift.physical import physical
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.unknowns import unknowns

THESIS = Truck.read("thesis")
WARMTH = FreeCurve("free", "viscous_friction", "oil_temperature", -10.0, 80.0)


def lowered(truck, *, temperature=40.0, load_kg=800.0, lift="free"):
    """A second at rest, three at one opening, one shut."""
    command = commands.Command.of_samples(50.0, **{lift: np.repeat([0.0, 0.7, 0.0], [50, 150, 50])})
    return simulate(truck, command, load_kg=load_kg, oil_temperature_degc=temperature, solver="fixed")


def test_through_a_law_of_the_catalogue_it_imitates_that_effect():
    rate = 0.02
    celsius = np.linspace(-10.0, 80.0, 50)
    imitation = WARMTH.through(celsius, np.exp(-rate * (celsius - 20.0)))
    law = THESIS.with_values({"free.friction_temperature.rate": rate})
    for temperature in (0.0, 37.0, 70.0):
        runs = [
            lowered(truck, temperature=temperature)["pressure_free_pa"]
            for truck in (THESIS, law, THESIS.with_values(imitation.parameters()))
        ]
        assert np.abs(runs[2] - runs[1]).max() < 1e-4 * np.abs(runs[0] - runs[1]).max()


def test_a_force_over_the_position_stands_in_the_pressure():
    at = np.linspace(0.5, 1.0, 30)
    bump = FreeCurve("free", "force", "position", 0.5, 1.0).through(
        at, 800.0 * np.exp(-(((at - 0.75) / 0.1) ** 2))
    )
    plain, other = (lowered(truck) for truck in (THESIS, THESIS.with_values(bump.parameters())))
    change = (plain["pressure_free_pa"] - other["pressure_free_pa"])[70:190]
    force = bump.at(0.5 * other["position_free_m"][70:190])
    error = change * THESIS.values["free.cylinder.area"] - force
    assert np.abs(error).mean() < 0.05 * np.abs(force).max()


def test_a_shape_after_the_command_moved_is_gone_when_its_time_is_over():
    late = FreeCurve("main", "opening", "time_since_command", 0.0, 1.5)
    late = late.through(np.linspace(0.0, 1.5, 30), 0.8 + 0.2 * np.linspace(0.0, 1.0, 30))
    plain, other = (lowered(truck, lift="main") for truck in (THESIS, THESIS.with_values(late.parameters())))
    speeds = [run["velocity_main_m_s"] for run in (plain, other)]
    assert abs(speeds[1][75]) < 0.95 * abs(speeds[0][75])
    assert speeds[1][180] == pytest.approx(speeds[0][180], rel=5e-3)


def test_what_fades_acts_while_the_variable_changes_and_no_more_when_it_stands():
    """A force of 1 kN for every 0.7 A that the command has lately changed by."""
    fading = FreeCurve("free", "force", "command", -0.7, 0.7, 0.3, fades=True)
    fading = fading.through(np.linspace(-0.7, 0.7, 30), 1000.0 * np.linspace(-1.0, 1.0, 30))
    run = lowered(THESIS.with_values(fading.parameters()))
    spot = 2.0 * run["free.free_shape.spot"] - 1.0
    opened = np.exp(-(run.time_s[50:200] - run.time_s[50]) / 0.3)
    np.testing.assert_allclose(spot[51:200], opened[1:], atol=0.02)
    plain = lowered(THESIS)
    late, at_rest = (run["velocity_free_m_s"] - plain["velocity_free_m_s"])[[195, 49]]
    assert abs(at_rest) < 1e-4
    assert abs(late) < 2e-3


def test_a_file_from_before_curves_that_fade_is_read(tmp_path):
    truck = THESIS.with_values(WARMTH.parameters())
    file = tmp_path / "old.toml"
    truck.write(file)
    old = "".join(line for line in file.read_text().splitlines(keepends=True) if not line.startswith("fades"))
    file.write_text(old)
    assert "fades" not in old
    assert FreeCurve.of(Truck.read(file), "free") == WARMTH


def test_a_lag_holds_a_shape_back():
    force = FreeCurve("free", "force", "command", 0.0, 0.7, 0.0, (-0.2, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0))
    slow = FreeCurve("free", "force", "command", 0.0, 0.7, 0.5, force.coefficients)
    runs = [lowered(THESIS.with_values(shape.parameters())) for shape in (force, slow)]
    spots = [run["free.free_shape.spot"] for run in runs]
    opened = np.flatnonzero(spots[0] > 0.5)[0]
    assert spots[0][opened + 1] == pytest.approx(1.0)
    assert spots[1][opened + 24] == pytest.approx(1.0 - np.exp(-25 * 0.02 / 0.5), abs=0.02)


def test_a_truck_tells_the_shape_it_has():
    shape = FreeCurve("main", "force", "velocity", -0.4, 0.0, 0.1, (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7))
    truck = THESIS.with_values(shape.parameters())
    assert FreeCurve.of(truck, "main") == shape
    assert FreeCurve.of(truck, "free") is None
    at, values = shape.curve()
    assert (at[0], at[-1]) == (-0.4, 0.0)
    # Even coefficients are a straight line: 0.2 to 0.6 of the 2 kN that are typical.
    np.testing.assert_allclose(values, np.linspace(400.0, 1200.0, 101))
    assert shape.unit == "N"
    assert shape.sentence == (
        "On the main lift something adds 800 N more to the force where the velocity of the cylinder is 0 m/s "
        "than where it is −400 mm/s, with a lag of 100 ms."
    )
    assert shape.formula.startswith("force(velocity) = f [N], f = 200 B0 + 400 B1 + ")


@pytest.mark.parametrize(("ways", "tops"), [(1, 0), (4, 4), (6, 6)])
def test_a_curve_that_comes_and_goes_at_equal_distances_says_so(ways, tops):
    """Rollers, a chain's links: the distance is what a mechanic looks for."""
    at = np.linspace(0.0, 1.2, 400)
    curve = FreeCurve("free", "force", "position", 0.0, 1.2, coefficients=(0.0,) * FINE)
    told = curve.through(at, 300.0 * (1.0 - np.cos(2.0 * np.pi * ways * at / 1.2))).sentence
    assert ("maxima" in told) == (tops > 0)
    if tops:
        count, apart = re.search(
            r"It has (\d+) maxima, one every (\d+) mm or so of the position", told
        ).groups()
        assert int(count) == tops
        assert float(apart) == pytest.approx(1200.0 / ways, rel=0.03)


def test_what_has_no_name_is_told_in_quantities_that_a_reader_knows():
    curve = FreeCurve("main", "friction", "position", 0.0, 1.5)
    at = np.linspace(0.0, 1.5, 60)
    truck = Truck.read("thesis").with_values(curve.through(at, 1.0 + 0.2 * at / 1.5).parameters())
    told = physical(truck, [], "free_shape", "main")
    assert all(part in told for part in ("by 1 where", " 0 m, ", "1.2 where", " 1.5 m.")), told
    ringing = {"mass": 240.0, "frequency": 2.36, "damping_ratio": 0.0875}
    truck = Truck.read("thesis").with_values(
        {f"free.hidden_resonance.{name}": x for name, x in ringing.items()}
    )
    told = physical(truck, [], "hidden_resonance", "free")
    assert all(part in told for part in ("240 kg", "2.36 Hz", "0.0875"))


def test_beyond_its_range_a_shape_is_what_it_is_at_the_end():
    shape = FreeCurve("free", "friction", "position", 0.0, 1.0, 0.0, (0.0, 0.3, -0.2, 0.5, 0.1, 0.4, 1.0))
    np.testing.assert_allclose(shape.at([-1.0, 2.0]), shape.at([0.0, 1.0]))
    assert shape.unit == "1"


def test_what_is_known_of_no_point_goes_on_evenly():
    at = np.linspace(20.0, 30.0, 20)
    shape = WARMTH.through(at, np.full(20, 1.3))
    np.testing.assert_allclose(shape.curve()[1], 1.3, rtol=1e-3)


def test_a_fit_moves_the_curve_and_its_lag_and_leaves_the_choices():
    truck = THESIS.with_values(WARMTH.parameters())
    moved = {found.name for found in unknowns(truck, ["free"]) if "free_shape" in found.name}
    shape = {f"free.free_shape.shape_{k}" for k in range(COEFFICIENTS)}
    assert moved == {*shape, "free.free_shape.lag"}


def test_every_port_and_variable_can_be_chosen():
    for port in ports():
        for variable in variables():
            shape = FreeCurve("free", port, variable, 0.0, 1.0)
            for one in (shape, replace(shape, lag_s=0.4, fades=True)):
                assert FreeCurve.of(THESIS.with_values(one.parameters()), "free") == one
    spec = parameters()
    assert spec["free.free_shape.port"]["upper"] == len(ports()) - 1
    assert spec["free.free_shape.variable"]["upper"] == len(variables()) - 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"port": "weather"}, "there is no port weather"),
        ({"variable": "mood"}, "there is no variable mood"),
        ({"lower": 1.0}, "the range from 1 to 1 is none"),
        ({"coefficients": (1.0,)}, "a shape has 7 or 40, not 1"),
    ],
)
def test_what_is_no_shape_is_refused(changes, message):
    given = {"lift": "free", "port": "force", "variable": "position", "lower": 0.0, "upper": 1.0} | changes
    with pytest.raises(ForkliftError, match=message) as caught:
        FreeCurve(**given)
    assert caught.value.code == "argument-invalid"


def test_a_saved_curve_names_its_port_and_its_variable(tmp_path):
    shape = FreeCurve("main", "force", "position", 0.1, 1.2, coefficients=(0.1,) * 7)
    truck = Truck.read("thesis").with_values(shape.parameters(), source="a test")
    truck.write(tmp_path / "truck.toml")
    text = (tmp_path / "truck.toml").read_text(encoding="utf-8")
    assert 'port = { value = "force"' in text
    assert 'variable = { value = "position"' in text
    assert Truck.read(tmp_path / "truck.toml").values == truck.values
    old = text.replace('"force"', repr(float(list(ports()).index("force"))))  # as files once had it
    (tmp_path / "old.toml").write_text(old, encoding="utf-8")
    assert Truck.read(tmp_path / "old.toml").values == truck.values
    (tmp_path / "wrong.toml").write_text(text.replace('"force"', '"forse"'), encoding="utf-8")
    with pytest.raises(ForkliftError, match="did you mean force"):
        Truck.read(tmp_path / "wrong.toml")

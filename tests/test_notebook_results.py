"""In a notebook: results draw themselves, names complete to what is public, and a path is enough."""

import subprocess
import sys

import numpy as np
import pytest

import forklift
from campaigns import CAMPAIGNS
from forklift import Campaign, Command, Truck, commands, compare, predict, simulate
from pages import in_a_notebook
from small_campaign import raised


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return Campaign.read(CAMPAIGNS / "leak")


@pytest.fixture(scope="module")
def simulation():
    command = commands.generate("prms", "free", duration_s=2.0)
    return simulate("thesis", command, load_kg=800, oil_temperature_degc=40, lifts="free")


def axes(figure) -> list[str]:
    """Of each panel its title, from top to bottom."""
    return [axis.title.text for axis in figure.select_yaxes()]


def test_a_simulation_plots_what_was_simulated(simulation):
    figure = simulation.plot()
    names = ["velocity_free_m_s", "pressure_free_pa", "position_free_m", "current_free_a"]
    assert [title.split("<")[0] for title in axes(figure)] == names
    assert "[bar]" in axes(figure)[1]
    np.testing.assert_array_equal(figure.data[1].y, 1e-5 * simulation["pressure_free_pa"])
    np.testing.assert_array_equal(figure.data[0].x, simulation.time_s)
    assert figure.data[3].line.shape == "hv"


def test_a_recording_plots_every_channel(campaign):
    recording = campaign[0]
    figure = recording.plot()
    assert {title.split("<")[0] for title in axes(figure)} == set(recording.channels)
    assert axes(figure)[-1].startswith("current_main_a")


def test_a_comparison_plots_measured_beside_simulated(campaign):
    found = compare(campaign, Truck.read("thesis"))
    figure = found.plot()
    held = next(one for one in found.predictions if one.recording.role == "validate")
    assert len(figure.data) == 2 * len(held.signals)
    assert [line.name for line in figure.data[:2]] == ["measured", "simulated"]
    file = campaign.estimate[0].file
    one = next(one for one in found.predictions if one.recording.file == file)
    drawn = found.plot(file).data[1]
    np.testing.assert_array_equal(drawn.y, one.signals[0].simulated)
    assert raised(found.plot, "nix.csv").code == "recording-unknown"


def test_figures_are_html(campaign):
    assert "plotly" in campaign[0].plot().to_html(include_plotlyjs=False)


def test_a_truck_a_campaign_and_a_simulation_show_themselves(campaign, simulation):
    truck = Truck.read("thesis").with_values({"mast_coupling.factor": 0.5})
    shown = in_a_notebook(truck)
    assert "viscosity.nu_0" in shown
    assert "mast_coupling.factor" in shown
    assert "4.45e-05" in shown
    shown = in_a_notebook(campaign)
    assert "6 held out" in shown
    assert all(one.file in shown for one in campaign)
    shown = in_a_notebook(simulation)
    assert "800 kg" in shown
    assert "pressure_free_pa" in shown
    assert "pressure_main_pa" not in shown


def test_completion_offers_public_names_only():
    script = "import forklift; forklift.Truck; forklift.simulate; print(*dir(forklift))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == sorted(forklift.__all__)


def test_a_truck_may_be_a_name_or_a_path(campaign, tmp_path):
    path = Truck.read("thesis").write(tmp_path / "mine.toml")
    command = Command([0.0, 0.5, 1.0], [0.0, 0.6, 0.6], [0.0, 0.0, 0.0])
    conditions = {"load_kg": 800.0, "oil_temperature_degc": 40.0}
    first, second, third = (
        simulate(one, command, **conditions).outputs for one in (Truck.read(path), path, str(path))
    )
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(first, third)
    np.testing.assert_array_equal(
        predict("thesis", campaign[0]).outputs, predict(Truck.read("thesis"), campaign[0]).outputs
    )
    assert raised(simulate, "theses", command, **conditions).code == "truck-unknown"
    assert raised(simulate, 3, command, **conditions).code == "argument-invalid"


def test_a_campaign_may_be_a_folder(campaign):
    found = compare(CAMPAIGNS / "leak", "thesis")
    assert found.origin.sha256 == campaign.sha256
    assert found.machine.truck == Truck.read("thesis")

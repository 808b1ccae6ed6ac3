"""The page of a simulation: command, velocity, pressure and position of each lift."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from forklift.base.numbers import amount
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.vocabulary import SHOWN
from forklift.recordings.channels import LIFTS, Lift
from forklift.report import page
from forklift.report.blocks import Figure, Page, Panel, Section, Table
from forklift.report.traces import MOST_POINTS, decimate, numbers

if TYPE_CHECKING:
    from typing import Any

    from forklift.plant.forklift.simulate import Simulation


def simulation_page(simulation: Simulation) -> str:
    """The page of a simulation."""
    lifts = [lift for lift in LIFTS if np.isfinite(simulation[f"position_{lift}_m"]).any()]
    said = [_lowering(simulation, lift) for lift in lifts]
    conditions = (
        f"{simulation.load_kg:g} kg on the forks, oil at {simulation.oil_temperature_degc.mean():.0f} °C, "
        f"{simulation.time_s[-1] - simulation.time_s[0]:.1f} s"
    )
    work = [[name.replace("_", " "), str(value)] for name, value in simulation.statistics.items()]
    return page.html(
        Page(
            f"{simulation.truck.name} lowering {simulation.load_kg:g} kg",
            f"Simulation of truck {simulation.truck.name}: {conditions}",
            said[0] if said else "Nothing was simulated.",
            said[1:],
            (),
            [
                Section("curves", "Curves", "", [_figure(simulation, lift) for lift in lifts]),
                Section(
                    "provenance",
                    "Provenance",
                    "",
                    [
                        Table(
                            "Made from",
                            ["What", "SHA-256"],
                            [[f"Truck {simulation.truck.name}", simulation.truck.sha256]],
                            [False, False],
                        ),
                        Table("Solver", ["What", "Value"], work, [False, True]),
                    ],
                ),
            ],
            {},
        )
    )


def _lowering(simulation: Simulation, lift: Lift) -> str:
    """What one lift does, in a sentence."""
    position, velocity = simulation[f"position_{lift}_m"], simulation[f"velocity_{lift}_m_s"]
    pressure = simulation[f"pressure_{lift}_pa"]
    return (
        f"{lift.capitalize()} lift: from {position[0]:.2f} to {position[-1]:.2f} m, lowering at up to "
        f"{max(-velocity.min(), 0.0):.2f} m/s, with {amount(float(pressure.min()), 'Pa')} to "
        f"{amount(float(pressure.max()), 'Pa')} in its cylinder."
    )


def _figure(simulation: Simulation, lift: Lift) -> Figure:
    """Four curves over one time, one above the other."""
    names = (f"velocity_{lift}_m_s", f"pressure_{lift}_pa", f"position_{lift}_m")
    curves = [(outputs()[name]["unit"], simulation[name]) for name in names]
    curves.append(("A", simulation.to_polars()[f"current_{lift}_a"].to_numpy()))
    time, *kept = decimate(MOST_POINTS, simulation.time_s, *(values for _, values in curves))
    data = []
    axes: dict[str, Any] = {}
    for place, ((unit, _), values) in enumerate(zip(curves, kept, strict=True)):
        quantity, printed, scale = SHOWN[unit]
        number = "" if place == 0 else str(place + 1)
        data.append(
            {
                "type": "scatter", "mode": "lines", "name": quantity, "x": numbers(time),
                "y": numbers(values * scale), "yaxis": f"y{number}", "hovertemplate": "%{y:.4g}",
                "line": {"color": "@after", "width": 1.8},
            }
        )  # fmt: skip
        bottom = 1.0 - (place + 1) / len(curves)
        axes[f"yaxis{number}"] = {
            "title": {"text": f"{quantity.capitalize()} [{printed}]"},
            "domain": [bottom + 0.03, bottom + 1.0 / len(curves)],
            "nticks": 4,
        }
    last = str(len(curves))
    layout = axes | {"xaxis": {"title": {"text": "Time [s]"}, "anchor": f"y{last}"}}
    return Figure(f"{lift.capitalize()} lift", "", [Panel("", data, layout)], height=680)

"""Results as one self-contained HTML page: the verdict and tables first, then the curves.

Panels are laid out as Figures 5.7 to 5.9 of the thesis: measured against simulated velocity and pressure.
Plotly draws them in the reader's browser; its script stands in the page once, so that nothing is fetched.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from forklift.names import LIFTS, Lift, amount, commanded, outputs
from forklift.tables import percent, share, validation_rows

if TYPE_CHECKING:
    from jinja2 import Template

    from forklift.compare import Comparison, Prediction
    from forklift.simulate import Simulation

Floats = NDArray[np.float64]

MOST_POINTS = 1000
"""Points of a curve in the page: twice the pixels of a panel."""
DIGITS = 5
"""Significant digits of a point in the page: finer than a pixel."""

SHOWN: Mapping[str, tuple[str, str, float]] = {
    "m/s": ("velocity", "m/s", 1.0),
    "Pa": ("pressure", "MPa", 1e-6),
    "m": ("position", "m", 1.0),
    "A": ("current", "A", 1.0),
    "degC": ("temperature", "°C", 1.0),
}
"""By unit: what a panel calls the quantity, and the unit it is drawn in."""


def comparison_page(comparison: Comparison) -> str:
    """The page of a comparison."""
    lifts = [lift for lift in LIFTS if len(comparison.validation(lift))]
    return page(
        title=f"{comparison.campaign.name} compared with {comparison.truck.name}",
        summary=comparison.verdict,
        tables=[
            table for lift in lifts for table in (_validation(comparison, lift), _where(comparison, lift))
        ],
        details=[_all_fits(comparison)],
        groups=[curves([_figure(comparison, prediction, lift) for lift, prediction in shown(comparison)])],
        footer=[
            f"Campaign {comparison.campaign.name}: {len(comparison.predictions)} recordings, "
            f"sha256 {comparison.campaign.sha256[:12]}",
            f"Truck {comparison.truck.name} ({comparison.truck.origin}), "
            f"sha256 {comparison.truck.sha256[:12]}",
            "Predictions run free from the start of each recording: nothing is corrected by measurements. "
            "Velocities are the derivative of the fork height, or of the lift's own encoder, through a "
            "Savitzky–Golay filter of 11 samples and second order, measured and simulated alike.",
        ],
    )


def shown(comparison: Comparison) -> list[tuple[Lift, Prediction]]:
    """Each recording's commanded lifts in the order of the page: validate recordings first."""
    order = {"validate": 0, "estimate": 1}
    found = sorted(
        (order.get(prediction.recording.role, 2), LIFTS.index(lift), position)
        for position, prediction in enumerate(comparison.predictions)
        for lift in commanded(prediction.recording.lift)
    )
    return [(LIFTS[lift], comparison.predictions[position]) for _, lift, position in found]


def simulation_page(simulation: Simulation) -> str:
    """The page of a simulation: command, velocity, pressure and position of each lift."""
    lifts = [lift for lift in LIFTS if np.isfinite(simulation[f"position_{lift}_m"]).any()]
    work = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in simulation.statistics.items())
    conditions = (
        f"{simulation.load_kg:g} kg on the forks, oil at {simulation.oil_temperature_degc.mean():.0f} °C, "
        f"{simulation.time_s[-1] - simulation.time_s[0]:.1f} s"
    )
    return page(
        title=f"{simulation.truck.name} lowering {simulation.load_kg:g} kg",
        summary=[_lowering(simulation, lift) for lift in lifts],
        tables=[],
        details=[],
        groups=[
            curves(
                [
                    {
                        "title": f"{lift.capitalize()} lift",
                        "note": conditions,
                        "panels": _simulated(simulation, lift),
                    }
                    for lift in lifts
                ]
            )
        ],
        footer=[f"Truck {simulation.truck.name}, sha256 {simulation.truck.sha256[:12]}", f"Solver: {work}"],
    )


def curves(figures: list[dict[str, Any]]) -> dict[str, Any]:
    """Figures of curves over time, as a group of the page."""
    return {"title": "Curves", "note": "", "figures": figures}


def _lowering(simulation: Simulation, lift: Lift) -> str:
    """What one lift does, in a sentence."""
    position, velocity = simulation[f"position_{lift}_m"], simulation[f"velocity_{lift}_m_s"]
    pressure = simulation[f"pressure_{lift}_pa"]
    return (
        f"{lift.capitalize()} lift: from {position[0]:.2f} to {position[-1]:.2f} m, lowering at up to "
        f"{max(-velocity.min(), 0.0):.2f} m/s, with {amount(float(pressure.min()), 'Pa')} to "
        f"{amount(float(pressure.max()), 'Pa')} in its cylinder."
    )


def _simulated(simulation: Simulation, lift: Lift) -> list[dict[str, Any]]:
    time, driven = simulation.time_s, simulation.to_polars()
    names = (f"velocity_{lift}_m_s", f"pressure_{lift}_pa", f"position_{lift}_m")
    return [
        *(panel("", outputs()[name]["unit"], time, simulated=simulation[name]) for name in names),
        panel("commanded", "A", time, simulated=driven[f"current_{lift}_a"].to_numpy()),
    ]


def decimate(time: Floats, *curves: Floats) -> tuple[Floats, ...]:
    """`time` and `curves`, thinned to about `MOST_POINTS` samples that keep each stretch's extremes.

    Curves share the kept samples, so that they can be read against each other.
    """
    if len(time) <= MOST_POINTS:
        return (time, *curves)
    stretches = np.array_split(np.arange(len(time)), MOST_POINTS // (2 * len(curves)))
    keep = {0, len(time) - 1}
    for stretch in stretches:
        for curve in curves:
            part = curve[stretch]
            if np.isfinite(part).any():
                keep |= {int(stretch[np.nanargmin(part)]), int(stretch[np.nanargmax(part)])}
            else:
                keep.add(int(stretch[0]))
    at = np.array(sorted(keep))
    return (time[at], *(curve[at] for curve in curves))


def _figure(comparison: Comparison, prediction: Prediction, lift: Lift) -> dict[str, Any]:
    """A recording's pair of panels for one commanded lift."""
    notes = []
    for channel in _pair(lift):
        fit = _fit(comparison, prediction, channel)
        if fit["nrmse_percent"] is not None:
            notes.append(
                f"{SHOWN[fit['unit']][0]} fit {percent(fit['nmse_percent'])} % (NMSE), "
                f"{percent(fit['nrmse_percent'])} % (NRMSE)"
            )
    return figure(lift, {"simulated": prediction}, notes)


def figure(lift: Lift, simulated: Mapping[str, Prediction], notes: list[str]) -> dict[str, Any]:
    """Velocity and pressure of one recording, measured beside what one or more trucks say."""
    first = next(iter(simulated.values()))
    recording = first.recording
    panels = []
    for channel in _pair(lift):
        unit = outputs()[channel]["unit"]
        found = {name: prediction.signal(channel) for name, prediction in simulated.items()}
        measured = first.signal(channel)
        if measured is None:
            said = {name: prediction.simulation[channel] for name, prediction in simulated.items()}
            panels.append(panel("not measured", unit, recording.time_s, **said))
            continue
        said = {name: signal.simulated for name, signal in found.items() if signal is not None}
        panels.append(panel("", unit, recording.time_s, measured=measured.measured, **said))
    conditions = (
        f"{lift} lift, {recording.load_kg:g} kg, {first.oil_temperature_degc:.0f} °C, {recording.role}"
    )
    return {"title": recording.file, "note": "; ".join([conditions, *notes]), "panels": panels}


def _pair(lift: Lift) -> tuple[str, str]:
    return f"velocity_{lift}_m_s", f"pressure_{lift}_pa"


def _fit(comparison: Comparison, prediction: Prediction, channel: str) -> dict[str, Any]:
    """The fit of a recording's signal; empty of numbers where it was not measured."""
    found = comparison.fits.filter(_is(comparison, prediction.recording.file, channel)).to_dicts()
    return found[0] if found else {"nrmse_percent": None}


def _is(comparison: Comparison, file: str, channel: str) -> Any:
    import polars as pl

    return (pl.col("file") == file) & (pl.col("channel") == channel)


def panel(of: str, unit: str, time: Floats, **curves: Floats) -> dict[str, Any]:
    """Curves over time, of a quantity told by its unit."""
    quantity, shown, scale = SHOWN[unit]
    thin, *thinned = decimate(time, *curves.values())
    return {
        "title": f"{quantity.capitalize()} [{shown}]" + (f", {of}" if of else ""),
        "x": numbers(thin),
        "x_title": "Time [s]",
        "curves": {name: numbers(curve * scale) for name, curve in zip(curves, thinned, strict=True)},
    }


def numbers(values: Floats) -> list[float | None]:
    """For the page's data: rounded, and None for what is not finite."""
    return [float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None for value in values.tolist()]


def _validation(comparison: Comparison, lift: Lift) -> dict[str, Any]:
    table = comparison.validation(lift)
    judged = (table["role"] == "validate").all()
    like = "5.4" if lift == "free" else "5.5"
    return {
        "title": f"Velocity of the {lift} lift: model fit, laid out as Table {like}"
        + ("" if judged else " (no validate recordings, so all of them)"),
        "head": ["Temperature [°C]", "Load [kg]", "Fit (NMSE) [%]", "Fit (NRMSE) [%]", "Recording"],
        "numeric": [True, True, True, True, False],
        "rows": validation_rows(table),
    }


def _where(comparison: Comparison, lift: Lift) -> dict[str, Any]:
    rows = [
        [
            row["phase"],
            f"{row['seconds']:.1f}",
            share(row["share_of_time"]),
            share(row["share_of_misfit"]),
        ]
        for row in comparison.where(lift).iter_rows(named=True)
    ]
    return {
        "title": f"Where the misfit of the {lift} lift's velocity lies",
        "head": ["Phase", "Seconds", "Share of time [%]", "Share of misfit [%]"],
        "numeric": [False, True, True, True],
        "rows": rows,
    }


def _all_fits(comparison: Comparison) -> dict[str, Any]:
    rows = [
        [
            row["file"], row["role"], row["channel"], "yes" if row["commanded"] else "at rest",
            percent(row["nmse_percent"]), percent(row["nrmse_percent"]),
            "—" if row["rmse"] is None else f"{row['rmse']:.3g}", row["unit"],
        ]
        for row in comparison.fits.iter_rows(named=True)
    ]  # fmt: skip
    return {
        "title": "All recordings and signals",
        "head": [
            "Recording",
            "Role",
            "Signal",
            "Commanded",
            "Fit (NMSE) [%]",
            "Fit (NRMSE) [%]",
            "RMSE",
            "Unit",
        ],
        "numeric": [False, False, False, False, True, True, True, False],
        "rows": rows,
    }


def page(*, groups: list[dict[str, Any]], command: str | None = None, **parts: Any) -> str:
    """The whole page: summary, tables and details, groups of figures, the command that repeats it."""
    from plotly.offline import get_plotlyjs  # type: ignore[import-untyped]

    from forklift import __version__

    panels = [panel for group in groups for figure in group["figures"] for panel in figure["panels"]]
    places = iter(range(len(panels)))
    outline = [
        group
        | {
            "figures": [figure | {"panels": list(_numbered(figure, places))} for figure in group["figures"]],
            "names": list(_names(group)),
        }
        for group in groups
    ]
    data = json.dumps(panels, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return _template().render(
        **parts, groups=outline, command=command, data=data, plotly=get_plotlyjs(), version=__version__
    )


def _numbered(figure: dict[str, Any], places: Iterator[int]) -> Iterator[dict[str, Any]]:
    for one in figure["panels"]:
        yield {"id": next(places), "title": one["title"], "height": one.get("height")}


def _names(group: dict[str, Any]) -> dict[str, None]:
    """The curves that occur, in order: the group's legend."""
    panels = [panel for figure in group["figures"] for panel in figure["panels"]]
    return dict.fromkeys(name for panel in panels for name in panel.get("curves", ()))


@cache
def _template() -> Template:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html")

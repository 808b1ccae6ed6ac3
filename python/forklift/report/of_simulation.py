"""The page of a simulation: its curves, one above the other."""

from __future__ import annotations

from typing import Any

from forklift.base.sheet import Curves, Sheeted
from forklift.report import page
from forklift.report.blocks import Figure, Page, Panel, Section, Table
from forklift.report.traces import MOST_POINTS, decimate, instants, numbers

HEIGHT_PX = 170
"""Of one curve."""


def simulation_page(simulation: Sheeted) -> str:
    """The page of a run of any machine."""
    sheet = simulation.sheet()
    made = [list(row) for row in sheet.made_from]
    work = [list(row) for row in sheet.work]
    return page.html(
        Page(
            sheet.title,
            sheet.head,
            sheet.sentences[0] if sheet.sentences else "Nothing was simulated.",
            sheet.sentences[1:],
            (),
            [
                Section("curves", "Curves", "", [_figure(one) for one in sheet.curves]),
                Section(
                    "provenance",
                    "Provenance",
                    "",
                    [
                        *([Table("Made from", ["What", "SHA-256"], made, [False, False])] if made else []),
                        *([Table("Solver", ["What", "Value"], work, [False, True])] if work else []),
                    ],
                ),
            ],
            {},
        )
    )


def _figure(drawn: Curves) -> Figure:
    """Curves over one time, one above the other."""
    time, *kept = decimate(MOST_POINTS, drawn.time_s, *(one.values for one in drawn.curves))
    data = []
    axes: dict[str, Any] = {}
    count = len(drawn.curves)
    for place, (one, values) in enumerate(zip(drawn.curves, kept, strict=True)):
        number = "" if place == 0 else str(place + 1)
        data.append(
            {
                "type": "scatter", "mode": "lines", "name": one.name, "x": instants(time),
                "y": numbers(values), "yaxis": f"y{number}", "hovertemplate": "%{y:.4g}",
                "line": {"color": "@after", "width": 1.8},
            }
        )  # fmt: skip
        bottom = 1.0 - (place + 1) / count
        unit = f" [{one.unit}]" if one.unit else ""
        axes[f"yaxis{number}"] = {
            "title": {"text": f"{one.name}{unit}"},
            "domain": [bottom + 0.03, bottom + 1.0 / count],
            "nticks": 4,
        }
    last = str(count) if count > 1 else ""
    layout = axes | {"xaxis": {"title": {"text": "Time [s]"}, "anchor": f"y{last}"}}
    return Figure(drawn.title, "", [Panel("", data, layout)], height=max(HEIGHT_PX * count, 2 * HEIGHT_PX))

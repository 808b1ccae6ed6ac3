"""Figures in a notebook: the lines of a result, panel by panel over one time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from forklift.base.plotted import Kind, Line, Plotted
from forklift.base.typeset import DRAWN, printed

STYLE: Mapping[Kind, Mapping[str, Any]] = {
    "measured": {"color": "#8a929c", "width": 3},
    "simulated": {"color": "#0072b2", "width": 1.8},
    "command": {"color": "#57606a", "width": 1.5, "shape": "hv"},
}
"""By kind; as on a page in daylight."""
PANEL_PX, MARGIN_PX = 170, 90
"""Height of a panel, and of what is around all."""


def figure(_: Plotted, heading: str, lines: Sequence[Line]) -> Any:
    """Lines of a result as a plotly figure."""
    from plotly import graph_objects  # type: ignore[import-untyped]
    from plotly.subplots import make_subplots  # type: ignore[import-untyped]

    panels = list(dict.fromkeys(line.panel for line in lines))
    if not panels:
        return graph_objects.Figure()
    drawn = make_subplots(rows=len(panels), shared_xaxes=True, vertical_spacing=0.15 / len(panels))
    told: set[Kind] = set()
    for line in lines:
        row, (unit, scale) = panels.index(line.panel) + 1, DRAWN.get(line.unit, (line.unit, 1.0))
        trace = graph_objects.Scatter(
            x=line.time_s,
            y=scale * line.values,
            name=line.kind,
            legendgroup=line.kind,
            showlegend=line.kind not in told,
            mode="lines",
            line=dict(STYLE[line.kind]),
            connectgaps=True,
            hovertemplate=f"%{{y:.4g}} {printed(unit)}",
        )
        drawn.add_trace(trace, row=row, col=1)
        drawn.update_yaxes(title_text=f"{line.panel}<br>[{printed(unit)}]", row=row, col=1)
        told.add(line.kind)
    drawn.update_xaxes(title_text="Time [s]", row=len(panels), col=1)
    drawn.update_layout(
        title=heading,
        height=MARGIN_PX + PANEL_PX * len(panels),
        hovermode="x unified",
        template="plotly_white",
    )
    return drawn

"""Where what is left over lies: every recording by signal and phase of the motion, as colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from forklift.estimation.judgement import AT_NOISE
from forklift.phases import PHASES, of_recording
from forklift.report.blocks import Figure, Panel
from forklift.report.words import signal

if TYPE_CHECKING:
    from forklift.campaign import Campaign
    from forklift.estimation.judgement import Judged
    from forklift.truck import Truck

STRONGEST = 100.0
"""Mean square of the strongest colour."""
STILL = 0.1
"""Mean square below which a signal stands still, so that it has no noise either."""
COLUMN_PX, ROW_PX, LETTER_PX = 34, 24, 6.2
SCALE = [[0.0, "@cold"], [0.5, "@warm"], [1.0, "@hot"]]

Cells = Mapping[tuple[str, str, str], tuple[float, int]]
"""By file, channel and phase: mean square and samples."""


def heat(campaign: Campaign, truck: Truck, models: Mapping[str, Sequence[Judged]], note: str) -> Figure:
    """One drawing per model, all in the same colours."""
    phases = {one.file: of_recording(one, truck) for one in campaign.recordings}
    cells = {label: _cells(judged, phases) for label, judged in models.items()}
    role = {one.file: one.role for judged in models.values() for one in judged}
    files = sorted(role, key=lambda file: role[file] != "validate")
    seen = {key[1:] for known in cells.values() for key in known}
    channels = dict.fromkeys(one.channel for judged in models.values() for one in judged)
    columns = [(channel, phase) for channel in channels for phase in PHASES if (channel, phase) in seen]
    return Figure(
        "Where the difference lies",
        note,
        [_panel(label, known, files, role, columns) for label, known in cells.items()],
        height=160 + ROW_PX * len(files),
        least_px=_labels_px(files) + COLUMN_PX * len(columns),
        choose="Model",
    )


def _cells(judged: Sequence[Judged], phases: Mapping[str, Mapping[str, NDArray[np.intp]]]) -> Cells:
    cells: dict[tuple[str, str, str], tuple[float, int]] = {}
    for one in judged:
        if one.mean_square < STILL or not len(one.left):
            continue
        which = phases[one.file][one.channel][one.rows]
        for index in np.unique(which).tolist():
            left = one.left[which == index]
            cells[one.file, one.channel, PHASES[index]] = float(np.mean(left**2)), len(left)
    return cells


def _panel(
    label: str,
    cells: Cells,
    files: Sequence[str],
    role: Mapping[str, str],
    columns: Sequence[tuple[str, str]],
) -> Panel:
    known = [[cells.get((file, *column)) for column in columns] for file in files]
    squares = [[None if cell is None else cell[0] for cell in row] for row in known]
    places = list(range(len(columns)))
    trace = {
        "type": "heatmap",
        "x": places,
        "y": list(files),
        "z": [[None if ms is None else round(_strength(ms), 3) for ms in row] for row in squares],
        "text": [["" if ms is None else brief(ms) for ms in row] for row in squares],
        "texttemplate": "%{text}",
        "textfont": {"size": 10},
        "customdata": [
            [
                None if cell is None else [signal(channel), phase, brief(cell[0]), cell[1]]
                for (channel, phase), cell in zip(columns, row, strict=True)
            ]
            for row in known
        ],
        "hovertemplate": "%{y}<br>%{customdata[0]}, %{customdata[1]}<br>%{customdata[2]} times the noise's "
        "square, over %{customdata[3]} samples<extra></extra>",
        "hoverongaps": False,
        "zmin": 0.0,
        "zmax": 1.0,
        "xgap": 1,
        "ygap": 1,
        "colorscale": SCALE,
        "colorbar": {
            "orientation": "h", "thickness": 10, "len": 0.4, "x": 1, "xanchor": "right", "y": 0,
            "yref": "container", "yanchor": "bottom", "ypad": 4, "outlinewidth": 0,
            "tickvals": [_strength(ms) for ms in (1.0, 3.0, 10.0, 30.0, 100.0)],
            "ticktext": ["1 (noise)", "3", "10", "30", "100"],
        },
    }  # fmt: skip
    return Panel(label, [trace], _layout(columns, files, role))


def _labels_px(files: Sequence[str]) -> int:
    return 20 + round(LETTER_PX * max(map(len, files), default=0))


def _layout(
    columns: Sequence[tuple[str, str]], files: Sequence[str], role: Mapping[str, str]
) -> dict[str, Any]:
    held = sum(role[file] == "validate" for file in files)
    channels = list(dict.fromkeys(channel for channel, _ in columns))
    first = [next(k for k, column in enumerate(columns) if column[0] == channel) for channel in channels]
    ends = [*first[1:], len(columns)]
    return {
        "margin": {"l": _labels_px(files), "r": 22, "t": 30, "b": 120},
        "dragmode": False,
        "hovermode": "closest",
        "xaxis": {
            "tickvals": list(range(len(columns))), "ticktext": [phase for _, phase in columns],
            "tickangle": -60, "showgrid": False, "zeroline": False, "fixedrange": True, "automargin": False,
        },
        "yaxis": {
            "autorange": "reversed", "showgrid": False, "zeroline": False, "fixedrange": True,
            "type": "category", "dtick": 1, "automargin": False, "tickfont": {"size": 10},
        },
        "annotations": [
            {
                "text": signal(channel).replace(" of the ", "<br>of the "), "x": 0.5 * (start + end - 1),
                "xref": "x", "y": 1, "yref": "paper", "yanchor": "bottom", "showarrow": False,
                "font": {"size": 10, "color": "@soft"},
            }
            for channel, start, end in zip(channels, first, ends, strict=True)
        ]
        + [
            {
                "text": text, "x": 1, "xref": "paper", "xanchor": "left", "y": 0.5 * (start + end - 1),
                "yref": "y", "textangle": 90, "showarrow": False, "font": {"size": 10, "color": "@soft"},
            }
            for text, start, end in (("held out", 0, held), ("fitted on", held, len(files)))
            if end - start > 1
        ],
        "shapes": [
            {
                "type": "line", "xref": "x", "yref": "paper", "x0": start - 0.5, "x1": start - 0.5, "y0": 0,
                "y1": 1, "line": {"color": "@ink", "width": 1},
            }
            for start in first[1:]
        ]
        + [
            {
                "type": "line", "xref": "paper", "yref": "y", "x0": 0, "x1": 1, "y0": held - 0.5,
                "y1": held - 0.5, "line": {"color": "@ink", "width": 1},
            }
        ] * (0 < held < len(files)),
    }  # fmt: skip


def _strength(mean_square: float) -> float:
    return float(np.clip(np.log(max(mean_square, 1.0)) / np.log(STRONGEST), 0.0, 1.0))


def brief(mean_square: float) -> str:
    """As a cell has room for it."""
    return f"{mean_square:.1f}" if mean_square < 9.95 else f"{mean_square:.0f}"


def note_on_noise() -> str:
    """What the numbers are."""
    return (
        "Each cell is the mean square of measured less simulated, in units of the noise of that sensor: 1 is "
        f"noise alone, up to about {AT_NOISE:g} counts as explained. Phases: the valve has just opened "
        "(start), its command has just moved (step change), neither (steady), it has just shut (stop), it "
        "stays shut (hold). Empty: the signal stands still there, or the phase does not occur."
    )

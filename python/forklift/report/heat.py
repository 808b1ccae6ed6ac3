"""Where what is left over lies: every recording by signal and phase of the motion, as colours."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from forklift.fitting.criteria import AT_NOISE
from forklift.report.blocks import Figure, Panel

if TYPE_CHECKING:
    from forklift.fitting.residuals import ChannelResidual
    from forklift.plant.subject import Subject, Words
    from forklift.recordings.noise import Sensor

LEAST_STRONGEST = 5.0
"""Mean square of the strongest colour, at least; else the greatest there is."""
STILL = 0.1
"""Mean square below which a signal stands still, so that it has no noise either."""
AT_REST = 0.5
"""Mean square below which an encoder's cell has no number: it is at rest."""
FEW_TICKS, TICKS = (1.0, 2.0, 3.0, 5.0, 10.0), (1.0, 3.0, 10.0, 30.0, 100.0)
MANY_TICKS = (1.0, *(10.0**power for power in range(1, 10)))
FEW_MOST, MOST = 20.0, 1e3
"""The greatest mean square that the first ticks are for, and the second."""
MOST_ROWS = 60
"""A map of more recordings, or stretches, is not drawn."""
COLUMN_PX, ROW_PX, LETTER_PX = 46, 20, 6.6
HEAD_PX, FOOT_PX = 76, 46
THREE_DIGITS = 99.5
"""Mean square from which a number is as wide as a cell on paper, and set smaller."""
DARK = 0.54
"""Share of the scale from which a colour is told from the background's: its number has the other ink."""
SCALE = [[0.0, "@cold"], [0.5, "@warm"], [1.0, "@hot"]]

Cells = Mapping[tuple[str, str, str], tuple[float, int, bool]]
"""By file, channel and phase: mean square, samples, and whether an encoder read them."""


def heat(
    machine: Subject,
    recordings: Sequence[Any],
    models: Mapping[str, Sequence[ChannelResidual]],
    sensors: Mapping[str, Sensor],
) -> list[Figure]:
    """The models below each other, in the same colours; `sensors` by channel. Nothing of too many rows."""
    role = {one.file: one.role for judged in models.values() for one in judged}
    files = sorted(role, key=lambda file: role[file] != "validate")
    if len(files) > MOST_ROWS:
        return []
    phases = {piece.file: machine.labels(piece) for one in recordings for piece in machine.pieces(one)}
    names = machine.phases
    encoders = {channel for channel, sensor in sensors.items() if sensor.count}
    cells = {label: _cells(judged, phases, names, encoders) for label, judged in models.items()}
    seen = {key[1:] for known in cells.values() for key in known}
    channels = _worst_first(next(iter(models.values())))
    columns = [(channel, phase) for channel in channels for phase in names if (channel, phase) in seen]
    greatest = max((cell[0] for known in cells.values() for cell in known.values()), default=1.0)
    top = max(greatest, LEAST_STRONGEST)
    rows = ROW_PX * len(files)
    numbered = list(enumerate(cells.items()))
    data = [_trace(label, k, known, files, columns, top, machine.words) for k, (label, known) in numbered]
    data += [_digits(k, known, files, columns, top) for k, (_, known) in numbered]
    return [
        Figure(
            "Where the difference lies" + (", before and after" if len(cells) > 1 else ""),
            _note(machine.phase_note, greatest),
            [Panel("", data, _layout(list(cells), columns, files, role, machine.words))],
            height=len(cells) * (HEAD_PX + rows) + FOOT_PX,
            least_px=_labels_px(files) + COLUMN_PX * len(columns),
        )
    ]


def _worst_first(judged: Sequence[ChannelResidual]) -> list[str]:
    """Signals by the most that they leave over in a recording: what a narrow screen shows comes first."""
    worst: dict[str, float] = {}
    for one in judged:
        worst[one.channel] = max(one.mean_square, worst.get(one.channel, 0.0))
    return sorted(worst, key=lambda channel: -worst[channel])


def _cells(
    judged: Sequence[ChannelResidual],
    phases: Mapping[str, Mapping[str, NDArray[np.intp]]],
    names: Sequence[str],
    encoders: Collection[str],
) -> Cells:
    cells: dict[tuple[str, str, str], tuple[float, int, bool]] = {}
    for one in judged:
        if one.mean_square < STILL or not len(one.left):
            continue
        which = phases[one.file][one.channel][one.rows]
        for index in np.unique(which).tolist():
            left = one.left[which == index]
            cells[one.file, one.channel, names[index]] = (
                float(np.mean(left**2)),
                len(left),
                one.channel in encoders,
            )
    return cells


def _trace(
    label: str,
    place: int,
    cells: Cells,
    files: Sequence[str],
    columns: Sequence[tuple[str, str]],
    top: float,
    words: Words,
) -> dict[str, Any]:
    known = [[cells.get((file, *column)) for column in columns] for file in files]
    squares = [[None if cell is None else cell[0] for cell in row] for row in known]
    marks = FEW_TICKS if top < FEW_MOST else TICKS if top < MOST else MANY_TICKS
    ticks = [tick for tick in marks if tick <= top]
    axes = {"xaxis": f"x{place + 1}", "yaxis": f"y{place + 1}"} if place else {}
    return {
        "type": "heatmap",
        "name": label,
        **axes,
        "x": list(range(len(columns))),
        "y": _short(files),
        "z": [[None if ms is None else round(_strength(ms, top), 3) for ms in row] for row in squares],
        "customdata": [
            [
                None if cell is None else [words.signal(channel), phase, f"{cell[0]:.2g}", cell[1]]
                for (channel, phase), cell in zip(columns, row, strict=True)
            ]
            for row in known
        ],
        "hovertemplate": "%{y}<br>%{customdata[0]}, %{customdata[1]}<br>%{customdata[2]} times the noise "
        "power, over %{customdata[3]} samples<extra></extra>",
        "hoverongaps": False,
        "zmin": 0.0,
        "zmax": 1.0,
        "xgap": 1,
        "ygap": 1,
        "colorscale": SCALE,
        "showscale": place == 0,
        "colorbar": {
            "orientation": "h", "thickness": 10, "len": 0.4, "x": 1, "xanchor": "right", "y": 0,
            "yref": "container", "yanchor": "bottom", "ypad": 4, "outlinewidth": 0, "tickangle": 0,
            "tickvals": [_strength(tick, top) for tick in ticks],
            "ticktext": [brief(tick, False).removesuffix(".0") for tick in ticks],
        },
    }  # fmt: skip


def _digits(
    place: int, cells: Cells, files: Sequence[str], columns: Sequence[tuple[str, str]], top: float
) -> dict[str, Any]:
    """The cells' numbers, in the colour that can be read on theirs."""
    axes = {"xaxis": f"x{place + 1}", "yaxis": f"y{place + 1}"} if place else {}
    seen = [
        (k, short, cell)
        for file, short in zip(files, _short(files), strict=True)
        for k, column in enumerate(columns)
        if (cell := cells.get((file, *column))) is not None
    ]
    return {
        "type": "scatter",
        "mode": "text",
        **axes,
        "x": [k for k, _, _ in seen],
        "y": [short for _, short, _ in seen],
        "text": [brief(*cell[::2]) for _, _, cell in seen],
        "textfont": {
            "size": [10.0 if cell[0] >= THREE_DIGITS else 11.5 for _, _, cell in seen],
            "color": ["@onhot" if _strength(cell[0], top) > DARK else "@oncold" for _, _, cell in seen],
        },
        "hoverinfo": "skip",
    }


def _short(files: Sequence[str]) -> list[str]:
    """Names of recordings without their ending, if all have the same, so that a narrow screen shows more."""
    ends = {Path(file).suffix for file in files}
    return [file.removesuffix(*ends) for file in files] if len(ends) == 1 else list(files)


def _labels_px(files: Sequence[str]) -> int:
    return 20 + round(LETTER_PX * max(map(len, _short(files)), default=0))


def _layout(
    models: Sequence[str],
    columns: Sequence[tuple[str, str]],
    files: Sequence[str],
    role: Mapping[str, str],
    words: Words,
) -> dict[str, Any]:
    """The models below each other, the names of signals and phases above each."""
    held = sum(role[file] == "validate" for file in files)
    rows = ROW_PX * len(files)
    area = len(models) * (rows + HEAD_PX) - HEAD_PX
    layout: dict[str, Any] = {
        "margin": {"l": _labels_px(files), "r": 22, "t": HEAD_PX, "b": FOOT_PX},
        "dragmode": False,
        "hovermode": "closest",
        "annotations": [],
        "shapes": [],
    }
    for place, model in enumerate(models):
        end = str(place + 1) if place else ""
        top = 1.0 - place * (rows + HEAD_PX) / area
        domain = [max(0.0, top - rows / area), top]
        layout[f"xaxis{end}"] = {
            "tickvals": list(range(len(columns))), "side": "top", "anchor": f"y{end}", "tickangle": 0,
            "ticktext": [phase.replace(" ", "<br>") for _, phase in columns], "tickfont": {"size": 11},
            "showgrid": False, "zeroline": False, "fixedrange": True, "automargin": False, "ticks": "",
            "range": [-0.5, len(columns) - 0.5],
        }  # fmt: skip
        layout[f"yaxis{end}"] = {
            "range": [len(files) - 0.5, -0.5], "showgrid": False, "zeroline": False, "fixedrange": True,
            "type": "category", "dtick": 1, "automargin": False, "tickfont": {"size": 11},
            "anchor": f"x{end}", "domain": domain,
        }  # fmt: skip
        layout["annotations"] += [
            *_signals(columns, f"x{end}", top, words),
            *_roles(held, len(files), f"y{end}"),
        ]
        if model:
            layout["annotations"].append(
                {
                    "text": f"<b>{model}</b>", "x": 0, "xref": "paper", "xanchor": "right", "y": top,
                    "yref": "paper", "yanchor": "bottom", "showarrow": False, "xshift": -6, "yshift": 4,
                    "font": {"size": 14},
                }
            )  # fmt: skip
        layout["shapes"] += _lines(columns, held, len(files), f"x{end}", f"y{end}", domain)
    return layout


def _groups(columns: Sequence[tuple[str, str]]) -> list[tuple[str, int, int]]:
    """Each channel with its first column, and the one after its last."""
    channels = list(dict.fromkeys(channel for channel, _ in columns))
    first = [next(k for k, column in enumerate(columns) if column[0] == channel) for channel in channels]
    return list(zip(channels, first, [*first[1:], len(columns)], strict=True))


def _signals(columns: Sequence[tuple[str, str]], x: str, top: float, words: Words) -> list[dict[str, Any]]:
    return [
        {
            "text": words.signal(channel).replace(" of the ", "<br>of the "),
            "x": 0.5 * (start + end - 1), "xref": x, "y": top, "yref": "paper", "yanchor": "bottom",
            "yshift": 41, "showarrow": False, "font": {"size": 12, "color": "@soft"},
        }
        for channel, start, end in _groups(columns)
    ]  # fmt: skip


def _roles(held: int, count: int, y: str) -> list[dict[str, Any]]:
    return [
        {
            "text": text, "x": 1, "xref": "paper", "xanchor": "left", "y": 0.5 * (start + end - 1),
            "yref": y, "textangle": 90, "showarrow": False, "font": {"size": 11, "color": "@soft"},
        }
        for text, start, end in (("held out", 0, held), ("fitted on", held, count))
        if end - start > 2
    ]  # fmt: skip


def _lines(
    columns: Sequence[tuple[str, str]], held: int, count: int, x: str, y: str, domain: Sequence[float]
) -> list[dict[str, Any]]:
    """Between signals, and between recordings held out and fitted on."""
    ink = {"type": "line", "line": {"color": "@ink", "width": 1}}
    upright = [
        ink | {"xref": x, "x0": start - 0.5, "x1": start - 0.5,
               "yref": "paper", "y0": domain[0], "y1": domain[1]}
        for _, start, _ in _groups(columns)[1:]
    ]  # fmt: skip
    level = ink | {"xref": "paper", "x0": 0, "x1": 1, "yref": y, "y0": held - 0.5, "y1": held - 0.5}
    return upright + [level] * (0 < held < count)


def _strength(mean_square: float, top: float) -> float:
    return float(np.clip(np.log(max(mean_square, 1.0)) / np.log(top), 0.0, 1.0))


def brief(mean_square: float, encoder: bool) -> str:
    """As a cell has room for it, in three letters: from a thousand on one digit and the power of ten."""
    if encoder and mean_square < AT_REST:
        return "·"
    if mean_square < 999.5:
        return f"{mean_square:.1f}" if mean_square < 9.95 else f"{mean_square:.0f}"
    digit, _, power = f"{mean_square:.0e}".partition("e")
    return f"{digit}e{int(power)}"


def _note(phases: str, greatest: float) -> str:
    """What the numbers are."""
    return (
        "Each cell is the mean square left over there, in units of the noise power of that sensor: 1 "
        "is noise "
        f"alone. Over a whole signal of a recording up to about {AT_NOISE:g} is taken for noise; a single "
        "cell may lie above. As in every number that is left over, parameters were moved within their "
        "uncertainty to suit each recording, so that it is not the squared error of the drawn curve. "
        "A dot: an encoder at rest, which "
        f"reads the same count all the time and leaves next to nothing. {phases} Empty: the signal stands "
        "still, or the phase does not occur. Colours are logarithmic."
        + (" 2e5 is 200 000." if greatest >= 999.5 else "")
    )

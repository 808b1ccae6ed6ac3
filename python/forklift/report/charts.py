"""Small drawings, each of one kind of number."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.fitting.intervals import QUANTILE
from forklift.report.blocks import Bars, Figure, Panel
from forklift.report.traces import instants, numbers
from forklift.report.words import Quantity, number, printed, spans

if TYPE_CHECKING:
    from forklift.base.arrays import Floats
    from forklift.fitting.intervals import Knowledge
    from forklift.report.curves import Against

MOST_DOTS = 1000
"""Of a cloud."""
AXIS_LETTERS = 36
"""A line of what stands beside a vertical axis."""
ROW_PX = 17
"""Height of a row of the correlations."""


def law(
    where: Quantity, noun: str, found: Sequence[tuple[Against, Quantity]], own: bool, more: str = ""
) -> Figure:
    """The unknown input against each variable, with its band and what the final model has there.

    `noun`: what was fitted; `own`: whether the place is that of the cause that was named; `more`: what else
    is to be noted.
    """
    return Figure(
        f"What the recordings ask for: {where.name}",
        f"Dots: what has to act there, moment by moment, for the fitted {noun} to follow the recordings, "
        "without knowing any cause. Dotted line and band: the same as a function of one variable, with its "
        "95 % interval. Solid line: what the final model has there, drawn in the same way: its own readings "
        f"were put in the recordings' place. All is relative to the fitted {noun}, which has taken up the "
        "mean already, and smoothed, which makes it smaller; so only the shape counts, not where zero lies, "
        "and the cause has the size said above. Where the dotted and the solid line agree, "
        "the final model has what the recordings ask for; in grey stretches no recording tells."
        + ("" if own else " No single place stands for that cause; of those there are, this explains most.")
        + more,
        [_against(one, where, variable, noun) for one, variable in found],
        height=400,
        choose="Against",
    )


def _against(one: Against, where: Quantity, variable: Quantity, noun: str) -> Panel:
    scale, its_scale = where.scale, variable.scale
    seen = spans(one.values.tolist())
    gaps = [(low[1], high[0]) for low, high in pairwise(seen)]
    at = numbers(its_scale * one.at)
    curve = scale * one.curve
    data: list[dict[str, Any]] = [
        {
            "type": "scatter", "mode": "markers", "name": "asked for, moment by moment",
            "x": numbers(its_scale * one.values), "y": numbers(scale * one.found), "hoverinfo": "skip",
            "marker": {"size": 4, "color": "@measured", "opacity": 0.35},
        }
    ]  # fmt: skip
    if np.isfinite(one.band).all():
        data.append(
            {
                "type": "scatter", "mode": "lines", "name": "95 % of the curve", "x": at + at[::-1],
                "y": numbers(curve + scale * one.band) + numbers((curve - scale * one.band)[::-1]),
                "fill": "toself", "fillcolor": "@band", "line": {"width": 0}, "hoverinfo": "skip",
            }
        )  # fmt: skip
    data.append(_line("asked for, as a function", at, numbers(curve), "@before", "dot"))
    if one.law is not None:
        data.append(_line("what the final model has there", at, numbers(scale * one.law), "@after", "solid"))
    layout = {
        "xaxis": {"title": {"text": variable.titled}},
        "yaxis": {
            "title": {"text": Quantity(f"Against the fitted {noun}", where.unit).titled},
            "exponentformat": "power",
            "range": [scale * end for end in _range(one)],
        },
        "showlegend": True,
        "shapes": [
            {
                "type": "rect", "xref": "x", "yref": "paper", "x0": its_scale * low, "x1": its_scale * high,
                "y0": 0, "y1": 1, "fillcolor": "@gap", "line": {"width": 0}, "layer": "below",
            }
            for low, high in gaps
        ],
        "annotations": [
            {
                "text": "no recording", "x": its_scale * 0.5 * (low + high), "xref": "x", "y": 0,
                "yref": "paper", "yanchor": "bottom", "showarrow": False, "font": {"color": "@soft"},
            }
            for low, high in gaps
        ],
    }  # fmt: skip
    return Panel(f"{variable.name} (explains {100.0 * max(one.explained, 0.0):.0f} %)", data, layout)


def _range(one: Against) -> list[float]:
    """The curves and all but the wildest moments."""
    low, high = np.quantile(one.found, [0.01, 0.99]) if len(one.found) else (0.0, 0.0)
    lines = [one.curve] + ([] if one.law is None else [one.law])
    low, high = min(low, *(line.min() for line in lines)), max(high, *(line.max() for line in lines))
    return [float(low - 0.1 * (high - low)), float(high + 0.1 * (high - low))]


def _line(name: str, x: Sequence[Any], y: Sequence[Any], colour: str, dash: str) -> dict[str, Any]:
    return {
        "type": "scatter", "mode": "lines+markers", "name": name, "x": x, "y": y,
        "line": {"color": colour, "width": 2.5, "dash": dash},
        "marker": {"size": 6, "symbol": "circle" if dash == "solid" else "x"},
        "hovertemplate": "%{y:.3g}",
    }  # fmt: skip


def reduced_chi2(title: str, rows: Sequence[tuple[str, float, str]], note: str) -> Bars:
    """What explanations leave over: name, mean square, and ``before``, ``after`` or ``rival``."""
    ends = [*(max(value, 1e-3) for _, value, _ in rows), 1.0]
    low, high = np.log(0.5 * min(ends)), np.log(max(*ends, 2.0))

    def at(value: float) -> float:
        return round(float(100.0 * (np.log(max(value, 1e-3)) - low) / (high - low)), 1)

    return Bars(
        title,
        f"{note} The scale is logarithmic and begins at {number(float(np.exp(low)), 2)}.",
        [(name, number(value), at(value), kind) for name, value, kind in rows],
        at(1.0),
        "1: noise alone",
    )


def over_time(what: Quantity, time: Floats, values: Floats) -> Panel:
    """One input of a recording that should be made."""
    line = {
        "type": "scatter", "mode": "lines", "name": what.name, "x": instants(time), "y": numbers(values),
        "line": {"color": "@after", "width": 2}, "hovertemplate": f"%{{y:.3g}} {what.unit}",
    }  # fmt: skip
    return Panel(what.name, [line], _over_time(what))


def scattered(
    label: str, x: Quantity, y: Quantity, values: Floats, added: Floats, band: Floats | None = None
) -> Panel:
    """One quantity against another, as dots, thinned evenly; `band`: half the width of one around a line on
    which they lie."""
    kept = np.unique(np.linspace(0, len(values) - 1, min(len(values), MOST_DOTS)).astype(int))
    dots: dict[str, Any] = {
        "type": "scatter", "mode": "markers", "name": label, "x": numbers(values[kept]),
        "y": numbers(added[kept]), "marker": {"size": 4, "color": "@after", "opacity": 0.6},
        "hovertemplate": "%{x:.3g}: %{y:.3g}<extra></extra>",
    }  # fmt: skip
    data = [dots]
    if band is not None and band.any():
        along = kept[np.argsort(values[kept])]
        over, under = (added + sign * band for sign in (1.0, -1.0))
        data.insert(
            0,
            {
                "type": "scatter", "mode": "lines", "name": "95 % interval", "hoverinfo": "skip",
                "x": numbers(np.concatenate([values[along], values[along][::-1]])),
                "y": numbers(np.concatenate([over[along], under[along][::-1]])),
                "fill": "toself", "fillcolor": "@band", "line": {"width": 0},
            },
        )  # fmt: skip
    layout = {
        "hovermode": "closest",
        "xaxis": {"title": {"text": x.titled}},
        "yaxis": {"title": {"text": "<br>".join(wrap(y.titled, AXIS_LETTERS))}},
    }
    return Panel(label, data, layout)


def _over_time(what: Quantity) -> dict[str, Any]:
    return {"xaxis": {"title": {"text": "Time [s]"}}, "yaxis": {"title": {"text": what.titled}}}


def profile(name: str, unit: str, values: Any, rise: Any, normal: Any, interval: str) -> Figure:
    """How much worse everything fits with one parameter held."""
    level = QUANTILE**2
    x = numbers(values)
    curves = (("profile", rise, "@after", "solid"), ("parabola", normal, "@measured", "dot"))
    data = [
        {
            "type": "scatter", "mode": "lines", "name": label, "x": x, "y": numbers(curve),
            "line": {"color": colour, "width": 2, "dash": dash, "shape": "spline"},
            "hovertemplate": "%{y:.3g}",
        }
        for label, curve, colour, dash in curves
    ]  # fmt: skip
    layout = {
        "xaxis": {"title": {"text": f"{name} [{printed(unit) or '1'}]"}},
        "yaxis": {"title": {"text": "Rise of −2 ln posterior"}},
        "showlegend": True,
        "shapes": [
            {
                "type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": level, "y1": level,
                "line": {"color": "@soft", "width": 1, "dash": "dash"},
            }
        ],
    }  # fmt: skip
    note = (
        f"{interval}. How much worse everything fits with {name} held and all else fitted anew; dotted: the "
        "parabola that the intervals in the table assume. The dashed level bounds 95 %."
    )
    return Figure(f"Profile of {name}", note, [Panel("", data, layout)])


def correlations(names: Sequence[str], known: Knowledge) -> Figure:
    """Of the estimates' errors."""
    matrix = [[round(v, 2) if np.isfinite(v) else None for v in row] for row in known.correlation.tolist()]
    places = [str(k + 1) for k in range(len(names))]
    trace = {
        "type": "heatmap", "z": matrix, "x": places,
        "y": [f"{name}  {k}" for name, k in zip(names, places, strict=True)],
        "customdata": [[[row, column] for column in names] for row in names],
        "hovertemplate": "%{customdata[0]}<br>%{customdata[1]}<br>%{z:.2f}<extra></extra>",
        "zmin": -1, "zmax": 1, "xgap": 1, "ygap": 1,
        "colorscale": [[0, "@before"], [0.5, "@panel"], [1, "@after"]],
        "colorbar": {"thickness": 8, "len": 0.5, "y": 1, "yanchor": "top", "outlinewidth": 0,
                     "tickvals": [-1, 0, 1]},
    }  # fmt: skip
    plain = {"showgrid": False, "zeroline": False, "type": "category", "fixedrange": True}
    layout = {
        "hovermode": "closest",
        "dragmode": False,
        "xaxis": plain | {"tickangle": 0, "tickfont": {"size": 9}},
        "yaxis": plain | {"autorange": "reversed", "dtick": 1, "tickfont": {"size": 10}},
    }
    note = (
        "Of the estimates' errors. Near 1 or −1, two parameters are known together only: as a difference or "
        "a sum, a ratio or a product. Columns carry the rows' numbers."
    )
    return Figure("Correlations", note, [Panel("", [trace], layout)], 60 + ROW_PX * len(names),
                  260 + 12 * len(names))  # fmt: skip

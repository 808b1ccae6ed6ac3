"""The page of a sweep: how many members fail and how surely, where, by which requirement, and the worst of
them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.report import page
from forklift.report.blocks import Code, Fact, Figure, Page, Panel, Section, Table, Text
from forklift.report.traces import MOST_POINTS, decimate, numbers

if TYPE_CHECKING:
    from forklift.ensemble.reduce import Axis
    from forklift.ensemble.sweep import Sweep, Trajectory

MOST_DRAWN = 10
"""Trajectories on a page; each has some thousand points."""
CELL_PX = 26
SCALE = [[0.0, "@panel"], [0.25, "@warm"], [1.0, "@hot"]]


def sweep_page(sweep: Sweep) -> str:
    """The page of a sweep."""
    tally, spec = sweep.tally, sweep.specification
    trajectories = [sweep.replay(int(k)) for k in sweep.worst["index"][:MOST_DRAWN] if _runs(sweep, int(k))]
    lifts = "both lifts" if spec.lifts == "both" else f"the {spec.lifts} lift"
    about = (
        f"Sweep of truck {sweep.truck.name}: {tally.members} lowerings of {lifts}, {spec.duration_s:g} s "
        f"each, "
        f"{_sampling(sweep)}"
    )
    sections = [_map(sweep), _requirements(sweep), _worst(sweep, trajectories), _provenance(sweep)]
    return page.html(
        Page(
            f"{spec.name}: {tally.failures} of {tally.members} fail",
            about,
            sweep.verdict,
            [],
            _facts(sweep),
            [section for section in sections if section],
            {
                "member": "One simulated lowering: a truck, its load, its oil and its sensors' noise, drawn "
                "at random.",
                "margin": "How far a member is from breaking a requirement, in the requirement's unit. "
                "Negative: it is broken.",
                "scaled margin": "A margin divided by the scale that the sweep declares for the requirement. "
                "It ranks members.",
            },
        )
    )


def _runs(sweep: Sweep, index: int) -> bool:
    row = sweep.worst.filter(sweep.worst["index"] == index)
    return str(row["verdict"][0]) != "out_of_bounds"


def _sampling(sweep: Sweep) -> str:
    spec = sweep.specification
    if spec.sampling == "sobol":
        return f"{spec.scrambles} scrambled Sobol sequences"
    return "drawn independently" if spec.sampling == "independent" else "one for each point of a grid"


def _facts(sweep: Sweep) -> list[Fact]:
    tally = sweep.tally
    share = f"{tally.failures} of {tally.members}"
    found = [Fact("How many fail?", share, _by_verdict(sweep))]
    if sweep.probability:
        p = sweep.probability
        found.append(
            Fact(
                "How sure is that?",
                f"{100 * p.lower:.3g} to {100 * p.upper:.3g} %",
                [f"{100 * p.level:g} % interval of the probability of a failure, by {p.method}."],
            )
        )
    if tally.failures and tally.axes:
        found.append(Fact("Where do they lie?", _densest(sweep)))
    if len(sweep.worst):
        worst = sweep.worst.row(0, named=True)
        varied = ", ".join(f"{name} {worst[name]:.4g}" for name in sweep.specification.vary)
        found.append(
            Fact(
                "Which is the worst?",
                f"member {worst['index']}",
                [varied, f"Verdict: {_said(worst['verdict'])}."],
            )
        )
    return found


def _by_verdict(sweep: Sweep) -> list[str]:
    verdicts = sweep.tally.verdicts.items()
    return [f"{_said(name).capitalize()}: {count}." for name, count in verdicts if count]


def _said(verdict: str) -> str:
    return verdict.replace("_", " ")


def _densest(sweep: Sweep) -> str:
    tally = sweep.tally
    share = tally.failed / np.maximum(tally.seen, 1)
    place = np.unravel_index(int(np.argmax(share)), share.shape)
    where = [
        f"{axis.name} {axis.edges[k]:.4g} to {axis.edges[k + 1]:.4g}"
        for axis, k in zip(tally.axes, place, strict=True)
    ]
    return f"{100 * share[place]:.3g} % at " + ", ".join(where)


def _map(sweep: Sweep) -> Section | None:
    tally = sweep.tally
    if not tally.axes:
        return None
    lead = (
        "The share of members in a cell that fail, and the least scaled margin of a cell's members: how "
        "near the worst "
        "of them comes to failing. Cells without members are blank."
    )
    x = tally.axes[0]
    if len(tally.axes) == 1:
        share = [
            f / n if n else None for f, n in zip(tally.failed.tolist(), tally.seen.tolist(), strict=True)
        ]
        bars = {
            "type": "bar", "x": numbers(x.middles), "y": share, "marker": {"color": "@hot"},
            "customdata": tally.seen.tolist(),
            "hovertemplate": "%{x:.4g}: %{y:.3g} of %{customdata} fail<extra></extra>",
        }  # fmt: skip
        titles = {"xaxis": {"title": {"text": x.name}}, "yaxis": {"title": {"text": "Share that fails"}}}
        margins = bars | {
            "y": numbers(tally.least), "marker": {"color": "@after"}, "hovertemplate": "%{x:.4g}: "
            "%{y:.3g}<extra></extra>",
        }  # fmt: skip
        axes = titles | {"yaxis": {"title": {"text": "Least scaled margin"}}}
        panels = [Panel("Share that fails", [bars], titles), Panel("Least scaled margin", [margins], axes)]
        return Section("map", "Where they fail", lead, [Figure("Failures", "", _told_first(sweep, panels))])
    y = tally.axes[1]
    seen, failed = tally.seen.T, tally.failed.T
    share = [
        [f / n if n else None for f, n in zip(row_f, row_n, strict=True)]
        for row_f, row_n in zip(failed.tolist(), seen.tolist(), strict=True)
    ]
    heat = {
        "type": "heatmap", "x": numbers(x.middles), "y": numbers(y.middles), "z": share, "zmin": 0, "zmax": 1,
        "xgap": 1, "ygap": 1, "colorscale": SCALE, "customdata": seen.tolist(),
        "hovertemplate": f"{x.name} %{{x:.4g}}<br>{y.name} %{{y:.4g}}<br>%{{z:.3g}} of %{{customdata}} fail"
        "<extra></extra>",
        "colorbar": {"thickness": 10, "title": {"text": "share"}, "outlinewidth": 0},
    }  # fmt: skip
    layout: dict[str, Any] = {
        "hovermode": "closest",
        "xaxis": _axis(x),
        "yaxis": _axis(y),
    }
    near = heat | {
        "z": [numbers(row) for row in tally.least.T],
        "colorscale": [[0.0, "@hot"], [0.5, "@warm"], [1.0, "@panel"]],
        "hovertemplate": f"{x.name} %{{x:.4g}}<br>{y.name} %{{y:.4g}}<br>least margin %{{z:.3g}} of "
        f"%{{customdata}}"
        "<extra></extra>",
        "colorbar": {"thickness": 10, "title": {"text": "margin"}, "outlinewidth": 0},
    }  # fmt: skip
    del near["zmin"], near["zmax"]
    panels = [Panel("Share that fails", [heat], layout), Panel("Least scaled margin", [near], layout)]
    figure = Figure("Stability map", "", _told_first(sweep, panels), height=120 + CELL_PX * y.cells)
    return Section("map", "Where they fail", lead, [figure])


def _told_first(sweep: Sweep, panels: list[Panel]) -> list[Panel]:
    """The one that says something first: where nothing fails that is the margin."""
    return panels if sweep.tally.failures else panels[::-1]


def _axis(axis: Axis) -> dict[str, Any]:
    return {"title": {"text": axis.name}, "showgrid": False, "zeroline": False}


def _requirements(sweep: Sweep) -> Section:
    tally = sweep.tally
    rows = [
        [require.name, require.formula, str(tally.broken[require.name]), str(tally.unasked[require.name])]
        for require in sweep.specification.require
    ]
    table = Table(
        "Requirements",
        ["Requirement", "Formula in signal temporal logic", "Broken", "Never asked"],
        rows,
        [False, False, True, True],
        "Never asked: no step, or no steady stretch before the lift landed. since: time since the speed "
        "asked for "
        "changed; step: by how much.",
    )
    return Section("requirements", "What was asked", "One member may break several.", [table])


def _worst(sweep: Sweep, trajectories: list[Trajectory]) -> Section | None:
    if not len(sweep.worst):
        return None
    vary = list(sweep.specification.vary)
    head = ["Member", "Verdict", "Scaled margin", *vary]
    rows = [
        [
            str(row["index"]),
            _said(str(row["verdict"])),
            f"{row['least_scaled_margin']:.3g}",
            *(f"{row[name]:.4g}" for name in vary),
        ]
        for row in sweep.worst.iter_rows(named=True)
    ]
    blocks: list[Any] = [Table("The least margins", head, rows, [True, False, True, *(True for _ in vary)])]
    if trajectories:
        lifts = ("free", "main") if sweep.specification.lifts == "both" else (sweep.specification.lifts,)
        panels = [_trajectory(one, lift) for one in trajectories for lift in lifts]
        note = "True speed and pressure, not what the sensors read. Dotted: the controller's reference."
        blocks.append(Figure("Trajectories", note, panels, height=480, choose="Member"))
    else:
        blocks.append(Text("None of them could be run."))
    return Section("worst", "The worst members", "Ranked by the least scaled margin.", blocks)


def _trajectory(one: Trajectory, lift: str) -> Panel:
    table = one.table
    signals = (
        -table[f"velocity_{lift}_m_s"].to_numpy(),
        table[f"reference_{lift}_m_s"].to_numpy(),
        table[f"pressure_{lift}_pa"].to_numpy() * 1e-5,
        table[f"current_{lift}_a"].to_numpy(),
    )
    finite = np.isfinite(np.stack(signals)).all(axis=0)
    time = table["time_s"].to_numpy()[finite]
    time, speed, reference, pressure, current = decimate(MOST_POINTS, time, *(s[finite] for s in signals))
    x = numbers(time)
    curves = (
        ("speed", speed, "y", "@after", "solid", "m/s"),
        ("reference", reference, "y", "@measured", "dot", "m/s"),
        ("pressure", pressure, "y2", "@after", "solid", "bar"),
        ("current", current, "y3", "@after", "solid", "A"),
    )
    data = [
        {
            "type": "scatter", "mode": "lines", "name": name, "x": x, "y": numbers(values), "yaxis": axis,
            "line": {"color": colour, "width": 1.8, "dash": dash}, "hovertemplate": f"%{{y:.4g}} {unit}",
        }
        for name, values, axis, colour, dash, unit in curves
    ]  # fmt: skip
    layout: dict[str, Any] = {
        "xaxis": {"title": {"text": "Time [s]"}, "anchor": "y3"},
        "yaxis": {"title": {"text": "Speed [m/s]"}, "domain": [0.54, 1.0]},
        "yaxis2": {"title": {"text": "Pressure [bar]"}, "domain": [0.27, 0.5], "nticks": 4},
        "yaxis3": {"title": {"text": "Current [A]"}, "domain": [0.0, 0.23], "nticks": 4},
    }
    return Panel(f"Member {one.index}, {lift} lift: {_said(one.verdict)}", data, layout)


def _provenance(sweep: Sweep) -> Section:
    spec = sweep.specification
    rows = [
        ["Specification", spec.sha256],
        [f"Truck {sweep.truck.name}", sweep.truck.sha256],
        *([[f"Controller {sweep.controller.name}", sweep.controller.hash]] if sweep.controller else []),
        ["Seed", str(spec.seed)],
        ["Substeps of a tick", str(spec.substeps)],
    ]
    blocks: list[Any] = [Table("Made from", ["What", "Value or SHA-256"], rows, [False, False])]
    if sweep.folder is not None and len(sweep.worst):
        index = sweep.worst["index"][0]
        blocks.append(Code("One member again", f"forklift replay {sweep.folder.name} {index}"))
    return Section("provenance", "Provenance", "", blocks)

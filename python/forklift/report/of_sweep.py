"""The page of a sweep: how many members fail and how surely, where, by which requirement, and the worst of
them."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.base.typeset import amount, capital, number, printed
from forklift.ensemble.quantities import Quantity, distribution, quantity
from forklift.ensemble.tables import signals, tick_s, verdicts
from forklift.recordings.channels import commanded
from forklift.report import page
from forklift.report.blocks import Code, Fact, Figure, Page, Panel, Section, Table, Text
from forklift.report.traces import MOST_POINTS, decimate, instants, numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from forklift.ensemble.sweep import Sweep
    from forklift.ensemble.trajectory import Trajectory

MOST_DRAWN = 10
"""Trajectories on a page; each has some thousand points."""
CELL_PX = 26
SCALE = [[0.0, "@panel"], [0.25, "@warm"], [1.0, "@hot"]]


def sweep_page(sweep: Sweep) -> str:
    """The page of a sweep."""
    tally, spec = sweep.tally, sweep.specification
    trajectories = [sweep.replay(int(k)) for k in sweep.worst["index"][:MOST_DRAWN] if _runs(sweep, int(k))]
    about = (
        f"Sweep of {tally.members} lowerings of {_lifts(sweep)}: truck {sweep.truck.name}, {_driven(sweep)}, "
        f"{spec.duration_s:g} s each, {_sampling(sweep)}"
    )
    sections = [
        _swept(sweep),
        _map(sweep),
        _requirements(sweep),
        _worst(sweep, trajectories),
        _provenance(sweep),
    ]
    known = {
        _said(name): f"A verdict: {verdicts()[name]['meaning']}."
        for name, count in tally.verdicts.items()
        if count
    }
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
                "scaled margin": "A margin divided by the scale that the sweep declares for the requirement: "
                "0 at the limit, -1 a whole scale beyond it. It ranks members.",
            }
            | known,
        )
    )


def _lifts(sweep: Sweep) -> str:
    lifts = sweep.specification.lifts
    return "both lifts" if lifts == "both" else f"the {lifts} lift"


def _driven(sweep: Sweep) -> str:
    return f"controller {sweep.controller.name}" if sweep.controller else "currents given"


def _swept(sweep: Sweep) -> Section:
    """What every member goes through, and what is drawn for it."""
    spec = sweep.specification
    unit = "m/s" if sweep.controller else "A"
    asked = "; ".join(f"{amount(one.level, unit)} from {amount(one.from_s, 's')} on" for one in spec.profile)
    lead = (
        f"Every member is asked for {asked}. What is not in the table is the truck's, the controller's or "
        "the sweep's own number. A probability of failure is that of a member drawn so, of this model, and "
        "not of a fleet."
    )
    rows = []
    for name, vary in spec.vary.items():
        of = _quantity(sweep, name)
        rows.append([_named(of.label), printed(of.unit) or "1", distribution(vary, name)])
    for name, value in spec.conditions.items():
        of = _quantity(sweep, name)
        rows.append([_named(of.label), printed(of.unit) or "1", f"{number(value, 4)} in every member"])
    table = Table("What was drawn", ["Quantity", "Unit", "Distribution"], rows, [False, False, False])
    return Section("swept", "What was swept", lead, [table] if rows else [])


def _quantity(sweep: Sweep, name: str) -> Quantity:
    return quantity(sweep.specification, name, controlled=sweep.controller is not None)


def _named(label: str) -> str:
    """As a heading; a parameter's own name stays as it is."""
    return label if "." in label.partition(" ")[0] else capital(label)


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
                [
                    f"{100 * p.level:g} % interval of the probability of a failure, by {p.method}, where "
                    "trucks are as they were drawn here."
                ],
            )
        )
    if tally.failures and tally.axes:
        found.append(_densest(sweep))
    if len(sweep.worst):
        worst = sweep.worst.row(0, named=True)
        varied = (
            f"{_named(of.label)}: {amount(worst[name], of.unit, 4)}."
            for name in sweep.specification.vary
            for of in [_quantity(sweep, name)]
        )
        found.append(
            Fact(
                "Which is the worst?",
                f"Member {worst['index']}: {_said(worst['verdict'])}",
                [f"{capital(_closest(sweep, worst))}.", *varied],
            )
        )
    return found


def _by_verdict(sweep: Sweep) -> list[str]:
    verdicts = sweep.tally.verdicts.items()
    return [f"{_said(name).capitalize()}: {count}." for name, count in verdicts if count]


def _said(verdict: str) -> str:
    return verdict.replace("_", " ")


def _densest(sweep: Sweep) -> Fact:
    """The cell of the map in which the largest share fails."""
    tally = sweep.tally
    share = tally.failed / np.maximum(tally.seen, 1)
    place = np.unravel_index(int(np.argmax(share)), share.shape)
    where = []
    for axis, k in zip(tally.axes, place, strict=True):
        of = _quantity(sweep, axis.name)
        ends = f"{number(axis.edges[k])} to {amount(axis.edges[k + 1], of.unit)}"
        where.append(f"{of.label} {ends}")
    failed, seen = int(tally.failed[place]), int(tally.seen[place])
    return Fact(
        "Where do most fail?",
        _named(", ".join(where)),
        [
            f"{failed} of the {seen} members in that cell of the map fail ({100 * share[place]:.3g} %), the "
            f"largest share of its {share.size} cells; {failed} of all {tally.failures} failures."
        ],
    )


def _closest(sweep: Sweep, row: Mapping[str, Any]) -> str:
    """The requirement of which a member has the least scaled margin, and that margin in its unit."""
    margins = [
        (row[f"margin.{one.name}"] / one.scale, one, row[f"margin.{one.name}"])
        for one in sweep.specification.require
        if row.get(f"margin.{one.name}") is not None and np.isfinite(row[f"margin.{one.name}"])
    ]
    if not margins:
        return "no requirement could be judged"
    _, one, margin = min(margins, key=lambda known: known[0])
    left = amount(abs(margin), signals()[one.signal]["unit"])
    return f"{one.name}: {f'{left} beyond its limit' if margin < 0.0 else f'{left} to spare'}"


def _map(sweep: Sweep) -> Section | None:
    tally = sweep.tally
    if not tally.axes:
        return None
    lead = (
        "The share of members in a cell that fail, and the least scaled margin of a cell's members: how near "
        "the worst of them comes to failing (0 is at the limit, below it is broken). Cells without members "
        "are blank."
    )
    x = tally.axes[0]
    across = _quantity(sweep, x.name).heading
    if len(tally.axes) == 1:
        share = [
            f / n if n else None for f, n in zip(tally.failed.tolist(), tally.seen.tolist(), strict=True)
        ]
        bars = {
            "type": "bar", "x": numbers(x.middles), "y": share, "marker": {"color": "@hot"},
            "customdata": tally.seen.tolist(),
            "hovertemplate": "%{x:.4g}: %{y:.3g} of %{customdata} fail<extra></extra>",
        }  # fmt: skip
        titles = {
            "xaxis": {"title": {"text": _named(across)}},
            "yaxis": {"title": {"text": "Share that fails"}},
        }
        margins = bars | {
            "y": numbers(tally.least), "marker": {"color": "@after"}, "hovertemplate": "%{x:.4g}: "
            "%{y:.3g}<extra></extra>",
        }  # fmt: skip
        axes = titles | {"yaxis": {"title": {"text": "Least scaled margin"}}}
        panels = [Panel("Share that fails", [bars], titles), Panel("Least scaled margin", [margins], axes)]
        return Section("map", "Where they fail", lead, [Figure("Failures", "", _told_first(sweep, panels))])
    y = tally.axes[1]
    up = _quantity(sweep, y.name).heading
    seen, failed = tally.seen.T, tally.failed.T
    percent: list[list[float | None]] = [
        [100.0 * f / n if n else None for f, n in zip(row_f, row_n, strict=True)]
        for row_f, row_n in zip(failed.tolist(), seen.tolist(), strict=True)
    ]
    heat = {
        "type": "heatmap", "x": numbers(x.middles), "y": numbers(y.middles), "z": percent, "zmin": 0,
        "zmax": max([1.0, *(one for row in percent for one in row if one is not None)]),
        "xgap": 1, "ygap": 1, "colorscale": SCALE, "customdata": seen.tolist(),
        "hovertemplate": f"{across} %{{x:.4g}}<br>{up} %{{y:.4g}}<br>%{{z:.3g}} % of %{{customdata}} fail"
        "<extra></extra>",
        "colorbar": {"thickness": 10, "title": {"text": "% fail"}, "outlinewidth": 0},
    }  # fmt: skip
    layout: dict[str, Any] = {
        "hovermode": "closest",
        "xaxis": _axis(across),
        "yaxis": _axis(up),
    }
    near = heat | {
        "z": [numbers(row) for row in tally.least.T],
        "colorscale": [[0.0, "@hot"], [0.5, "@warm"], [1.0, "@panel"]],
        "hovertemplate": f"{across} %{{x:.4g}}<br>{up} %{{y:.4g}}<br>least margin %{{z:.3g}} of "
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


def _axis(heading: str) -> dict[str, Any]:
    return {"title": {"text": _named(heading)}, "showgrid": False, "zeroline": False}


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
        "Times in s, speeds in m/s, pressures in Pa. G: always, F: at some time. since: time since the speed "
        "asked for changed; step: by how much; peak_to_peak(x, 1 s): over the second before. Never asked: no "
        "step, or no steady stretch before the lift landed.",
    )
    lead = "One member may break several."
    follows = ("responds", "reaches", "settles")
    if not any(one.signal == "error" or one.template in follows for one in sweep.specification.require):
        lead += " None of them asks that the speed follows what is asked for: a stable member may be slower."
    return Section("requirements", "What was asked", lead, [table])


def _worst(sweep: Sweep, trajectories: list[Trajectory]) -> Section | None:
    if not len(sweep.worst):
        return None
    vary = list(sweep.specification.vary)
    head = [
        "Member",
        "Verdict",
        "Least margin",
        "Scaled",
        *(_named(_quantity(sweep, name).heading) for name in vary),
    ]
    rows = [
        [
            str(row["index"]),
            _said(str(row["verdict"])),
            _closest(sweep, row),
            number(row["least_scaled_margin"]) if np.isfinite(row["least_scaled_margin"]) else "—",
            *(number(row[name], 4) for name in vary),
        ]
        for row in sweep.worst.iter_rows(named=True)
    ]
    blocks: list[Any] = [
        Table("The least margins", head, rows, [True, False, False, *(True for _ in [*vary, 0])])
    ]
    if trajectories:
        lifts = commanded(sweep.specification.lifts)
        panels = [_trajectory(one, lift) for one in trajectories for lift in lifts]
        note = (
            "The forks' true lowering speed and the true pressure, not what the sensors read. Dotted: the "
            "controller's reference."
        )
        blocks.append(Figure("Trajectories", note, panels, height=480, choose="Member"))
    else:
        blocks.append(Text("None of them could be run."))
    if sweep.folder is not None:
        words = ["forklift", "replay", sweep.folder.name, str(sweep.worst["index"][0]), "--out", "member.csv"]
        blocks.append(Code("One member again", shlex.join(words)))
    lead = (
        f"The {len(rows)} with the least scaled margin, of {sweep.tally.members}; negative margins are "
        "broken requirements."
    )
    return Section("worst", "The worst members", lead, blocks)


def _trajectory(one: Trajectory, lift: str) -> Panel:
    table = one.table
    signals = (
        table[f"speed_{lift}_m_s"].to_numpy(),
        table[f"reference_{lift}_m_s"].to_numpy(),
        table[f"pressure_{lift}_pa"].to_numpy() * 1e-5,
        table[f"current_{lift}_a"].to_numpy(),
    )
    finite = np.isfinite(np.stack(signals)).all(axis=0)
    time = table["time_s"].to_numpy()[finite]
    time, speed, reference, pressure, current = decimate(MOST_POINTS, time, *(s[finite] for s in signals))
    x = instants(time)
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
        ["Specification (SHA-256)", spec.sha256],
        [f"Truck {sweep.truck.name} (SHA-256)", sweep.truck.sha256],
        *(
            [[f"Controller {sweep.controller.name} (its own hash)", sweep.controller.hash]]
            if sweep.controller
            else []
        ),
        ["Seed", str(spec.seed)],
        [
            "Step of the integrator",
            f"{amount(1e3 * tick_s() / spec.substeps, 'ms')}, {spec.substeps} to a tick",
        ],
    ]
    blocks: list[Any] = [Table("Made from", ["What", "Value"], rows, [False, False])]
    return Section("provenance", "Provenance", "", blocks)

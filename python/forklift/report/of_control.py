"""The page of controllers side by side: how well they follow, how much they swing, how one lift takes
over."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isnan
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.report import page
from forklift.report.blocks import Block, Code, Fact, Figure, Page, Panel, Section, Table
from forklift.report.traces import instants, numbers

if TYPE_CHECKING:
    from forklift.control.compare import ControlComparison, Curves, Passage, Row
    from forklift.control.transition import Transition

COLOURS = ("@before", "@measured", "@after")
"""Of the controllers in their order; further ones begin anew."""
DASHES = ("solid", "dash", "longdash")
"""Of those that share a colour."""


def control_page(told: ControlComparison) -> str:
    """The page of a comparison of controllers."""
    from forklift.control.closed_loop import DELAY_TICKS, TICK_S

    names = [one.name for one in told.controllers]
    free, main = (round(1e3 * TICK_S) * (ticks + told.later_ticks) for ticks in DELAY_TICKS.values())
    about = (
        f"Controllers {', '.join(f'“{name}”' for name in names)} on the truck “{told.truck.name}”, "
        f"simulated in closed loop: both lifts, loads of 0, 800 and "
        f"1500 kg, oil of 20, "
        f"40 and 60 °C, two reference signals; {free} ms from sensors to valve (main lift {main} ms)"
    )
    verdict, *more = _verdict(told)
    sections = [_following(told), _curves(told), _transition(told), _provenance(told)]
    return page.html(
        Page(
            " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names) + " lowering",
            about,
            verdict,
            more,
            [_fact_following(told), _fact_swing(told), _fact_limit(told), _fact_transition(told)],
            sections,
            {
                "NRMSE": "100 % for a speed that is the reference at every moment, 0 % for one no better "
                "than the "
                "reference's mean: (3.40) of Fri & Fahlén (2017).",
                "160 ms late": "The NRMSE of the reference itself 160 ms later, the nominal delay. It is no "
                "bound: a valve begins to answer sooner, and a shaped reference is ahead of the one that it "
                "is measured against.",
                "swing": "Half of what lies between the least and the greatest speed in the last 0.8 s of "
                "a plateau. "
                "Drift counts as well.",
                "steady error": "Mean speed less the speed asked for, after six seconds at 0.25 m/s.",
                "dip, spike": "How far the sum of both lifts' speeds falls below the lesser of the mean "
                "speeds before and "
                "after a transition, and how far it rises above the greater.",
            },
        )
    )


def _by_point(rows: tuple[Row, ...]) -> dict[tuple[str, float, float], dict[str, Row]]:
    found: dict[tuple[str, float, float], dict[str, Row]] = {}
    for row in rows:
        found.setdefault((row.lift, row.oil_temperature_degc, row.load_kg), {})[row.controller] = row
    return found


def signed(value: float, digits: int) -> str:
    """A number with its sign; what is printed as zero has none."""
    said = f"{value:+.{digits}f}"
    return said[1:] if float(said) == 0.0 else said.replace("-", "−")


def _ends(values: Sequence[float], digits: int) -> str:
    """From the first to the last, in one line of a cell."""
    return "\u00a0–\u00a0".join(f"{value:.{digits}f}" for value in values)


def _mean(row: Row) -> float:
    return sum(row.nrmse_percent) / len(row.nrmse_percent)


def _verdict(told: ControlComparison) -> list[str]:
    """The last controller against each of the others, one sentence each."""
    *others, last = [one.name for one in told.controllers]
    points = _by_point(told.rows)
    if not others:
        least, most = (f(_mean(rows[last]) for rows in points.values()) for f in (min, max))
        return [f"Controller “{last}” follows its reference with an NRMSE of {least:.0f} to {most:.0f} %."]
    said = []
    for other in others:
        better = sum(_mean(rows[last]) > _mean(rows[other]) for rows in points.values())
        gains = [_mean(rows[last]) - _mean(rows[other]) for rows in points.values()]
        said.append(
            f"Controller “{last}” follows better than “{other}” at {better} of {len(points)} operating "
            f"points; the difference is {signed(min(gains), 1)} to {signed(max(gains), 1)} points of NRMSE."
        )
    return said


def _fact_following(told: ControlComparison) -> Fact:
    ranges = {}
    for one in told.controllers:
        values = [x for row in told.rows if row.controller == one.name for x in row.nrmse_percent]
        ranges[one.name] = (min(values), max(values))
    best = max(ranges, key=lambda name: sum(ranges[name]))
    late = [x for row in told.rows for x in row.perfect_percent]
    return Fact(
        "How well do they follow?",
        f"“{best}” best: {ranges[best][0]:.0f} to {ranges[best][1]:.0f} %",
        [
            "NRMSE, over operating points and signals. "
            f"The reference itself 160 ms late has {min(late):.0f} to {max(late):.0f} %.",
            *(f"{name}: {low:.0f} to {high:.0f} %." for name, (low, high) in ranges.items()),
        ],
    )


def _fact_swing(told: ControlComparison) -> Fact:
    lines = []
    for one in told.controllers:
        loaded = [row for row in told.rows if row.controller == one.name and row.load_kg > 0.0]
        worst = max(loaded, key=lambda row: row.oscillation_m_s)
        lines.append(
            f"{one.name}: up to {worst.oscillation_m_s:.3f} m/s ({worst.lift} lift, {worst.load_kg:.0f} kg, "
            f"{worst.oil_temperature_degc:.0f} °C)."
        )
    least = min(
        (
            max(row.oscillation_m_s for row in told.rows if row.controller == one.name and row.load_kg > 0.0),
            one.name,
        )
        for one in told.controllers
    )
    return Fact(
        "How much does the load swing?", f"Least with “{least[1]}”: {least[0]:.3f} m/s at most", lines
    )


def _fact_limit(told: ControlComparison) -> Fact:
    lines = []
    for one in told.controllers:
        rows = [row for row in told.rows if row.controller == one.name and row.breaches]
        fastest = max(row.fastest_m_s for row in told.rows if row.controller == one.name)
        where = ", ".join(
            f"{row.lift} {row.load_kg:.0f} kg {row.oil_temperature_degc:.0f} °C" for row in rows
        )
        said = f" at {where}" if rows else ""
        lines.append(f"{one.name}: up to {fastest:.3f} m/s; {'above' if rows else 'never above'}{said}.")
    faulty = sorted({row.controller for row in told.rows if row.breaches})
    return Fact(
        "Is it ever faster than 0.6 m/s?",
        f"Yes: {', '.join(f'“{one}”' for one in faulty)}" if faulty else "No, none is.",
        lines,
    )


def _fact_transition(told: ControlComparison) -> Fact:
    lines, worst = [], {}
    for one in told.controllers:
        own = [row for row in told.transitions if row.controller == one.name]
        ended = [row for row in own if not isnan(row.duration_s)]
        said = f"{one.name}: "
        if ended:
            worst[one.name] = max(max(row.dip_m_s, row.spike_m_s) for row in ended)
            dip, spike = max(row.dip_m_s for row in ended), max(row.spike_m_s for row in ended)
            said += f"dips by up to {dip:.3f}, jumps by up to {spike:.3f} m/s"
        if len(ended) < len(own):
            # What never gives over is no smooth transition.
            worst[one.name] = inf
            said += f"{'; ' if ended else ''}{len(own) - len(ended)} of {len(own)} never come to their end"
        lines.append(f"{said}.")
    smooth = min(worst, key=lambda name: worst[name])
    value = f"Most smoothly with “{smooth}”" if worst[smooth] < inf else "With none at every operating point"
    return Fact("How does the free lift take over?", value, lines)


def _following(told: ControlComparison) -> Section:
    from forklift.control.compare import measured_on

    blocks, measured = [], measured_on(told.truck)
    for lift, number in (("free", "5.6"), ("main", "5.7")):
        rows = []
        for (of, t, load), found in _by_point(told.rows).items():
            if of != lift:
                continue
            for name, row in found.items():
                known = measured(row)
                rows.append(
                    [
                        f"{t:.0f}",
                        f"{load:.0f}",
                        name,
                        _ends(sorted(row.nrmse_percent), 1),
                        _ends(sorted(row.perfect_percent), 1),
                        f"{row.oscillation_m_s:.4f}",
                        signed(row.error_percent, 2),
                        f"{row.fastest_m_s:.3f}" + (", too fast" if row.breaches else ""),
                        _ends(known, 0) if known else "",
                    ]
                )
        head = [
            "Oil [°C]",
            "Load [kg]",
            "Controller",
            "NRMSE [%]",
            "160 ms late [%]",
            "Swing [m/s]",
            "Steady error [%]",
            "Fastest [m/s]",
            "Measured by the thesis [%]",
        ]
        numeric = [True, True, False, True, True, True, True, True, True]
        blocks.append(Table(f"{lift.capitalize()} lift, as Table {number}", head, rows, numeric))
    lead = "Each lift by itself; the two ends are those of two reference signals."
    return Section("tables", "How well each follows", lead, blocks)


def _look(k: int) -> tuple[str, str]:
    return COLOURS[k % len(COLOURS)], DASHES[(k // len(COLOURS)) % len(DASHES)]


def _line(name: str, x: Any, y: Any, axis: str, colour: str, dash: str, unit: str) -> dict[str, Any]:
    return {
        "type": "scatter", "mode": "lines", "name": name, "x": x, "y": y, "yaxis": axis,
        "line": {"color": colour, "width": 1.8, "dash": dash}, "hovertemplate": f"%{{y:.4g}} {unit}",
        "showlegend": axis == "y",
    }  # fmt: skip


def _curves(told: ControlComparison) -> Section:
    figures = []
    for lift, numbered in (
        ("free", "5.10, 5.12 to 5.14 and Appendix B"),
        ("main", "5.11, 5.15 to 5.17 and Appendix C"),
    ):
        own = [one for one in told.curves if one.lift == lift]
        # As the thesis does: 800 kg first.
        panels = [_panel(told, one) for one in sorted(own, key=lambda one: one.load_kg != 800.0)]
        note = (
            f"As Figures {numbered}. True speed of the forks, what the cylinder's pressure does, what the "
            f"valve is "
            "ordered. Dotted: the reference."
        )
        figures.append(
            Figure(f"{lift.capitalize()} lift", note, panels, height=560, choose="Operating point")
        )
    return Section("curves", "Lowerings", "", figures)


def _panel(told: ControlComparison, one: Curves) -> Panel:
    x = instants(one.time_s)
    data = []
    first = next(iter(one.reference_m_s.values()))
    data.append(_line("reference", x, numbers(first), "y", "@soft", "dot", "m/s"))
    for k, controller in enumerate(told.controllers):
        name, (colour, dash) = controller.name, _look(k)
        data.append(_line(name, x, numbers(one.speed_m_s[name]), "y", colour, dash, "m/s"))
        data.append(_line(name, x, numbers(1e-5 * one.pressure_pa[name]), "y2", colour, dash, "bar"))
        current_a = 1e-3 * one.current_ma[name].astype(np.float64)
        data.append(_line(name, x, numbers(current_a), "y3", colour, dash, "A"))
    layout = {
        "xaxis": {"title": {"text": "Time [s]"}, "anchor": "y3"},
        "yaxis": {"title": {"text": "Speed [m/s]"}, "domain": [0.5, 1.0]},
        "yaxis2": {"title": {"text": "Pressure [bar]"}, "domain": [0.25, 0.45], "nticks": 4},
        "yaxis3": {"title": {"text": "Current [A]"}, "domain": [0.0, 0.2], "nticks": 4},
        "showlegend": True,
    }
    label = f"{one.load_kg:.0f} kg, {one.oil_temperature_degc:.0f} °C, signal {one.signal}"
    return Panel(label, data, layout)


def _transition(told: ControlComparison) -> Section:
    panels = [
        _passage(one)
        for one in sorted(
            told.passages,
            key=lambda one: (one.load_kg != 800.0, one.load_kg, one.oil_temperature_degc, one.level_m_s),
        )
    ]
    note = (
        "As Figure 5.18 and Appendix D. The main lift comes down first, then the free lift takes over; "
        "both speeds "
        "together are what the driver sees."
    )
    rows = [
        _transition_row(row)
        for row in sorted(told.transitions, key=lambda r: (r.level_m_s, r.oil_temperature_degc, r.load_kg))
    ]
    head = [
        "Asked [m/s]",
        "Oil [°C]",
        "Load [kg]",
        "Controller",
        "Before [m/s]",
        "After [m/s]",
        "Dip [m/s]",
        "Spike [m/s]",
        "Lasts [s]",
    ]
    numeric = [True, True, True, False, True, True, True, True, True]
    blocks: list[Block] = [
        Figure("Transition", note, panels, height=380, choose="Transition"),
        Table("Dip and spike of the total speed", head, rows, numeric),
    ]
    return Section("transition", "From the main lift to the free lift", "", blocks)


def _transition_row(row: Transition) -> list[str]:
    values = (row.before_m_s, row.after_m_s, row.dip_m_s, row.spike_m_s)
    return [
        f"{row.level_m_s:.1f}",
        f"{row.oil_temperature_degc:.0f}",
        f"{row.load_kg:.0f}",
        row.controller,
        *("—" if isnan(value) else f"{value:.3f}" for value in values),
        "—" if isnan(row.duration_s) else f"{row.duration_s:.2f}",
    ]


def _passage(one: Passage) -> Panel:
    x = instants(one.time_s)
    free, main = one.speed_m_s["free"], one.speed_m_s["main"]
    data = [
        _line("both together", x, numbers(free + main), "y", "@after", "solid", "m/s"),
        _line("free lift", x, numbers(free), "y", "@before", "solid", "m/s"),
        _line("main lift", x, numbers(main), "y", "@measured", "solid", "m/s"),
        _line("reference, free", x, numbers(one.reference_m_s["free"]), "y", "@before", "dot", "m/s"),
        _line("reference, main", x, numbers(one.reference_m_s["main"]), "y", "@measured", "dot", "m/s"),
    ]
    layout = {
        "xaxis": {"title": {"text": "Time [s]"}},
        "yaxis": {"title": {"text": "Speed [m/s]"}, "rangemode": "tozero"},
        "showlegend": True,
    }
    label = (
        f"{one.load_kg:.0f} kg, {one.oil_temperature_degc:.0f} °C, {one.level_m_s:.1f} m/s, {one.controller}"
    )
    return Panel(label, data, layout)


def _provenance(told: ControlComparison) -> Section:
    rows = [
        [f"Truck {told.truck.name}", told.truck.sha256],
        *([f"Controller {one.name}, {one.word}-bit words", one.hash] for one in told.controllers),
        ["Seed of the sensors' noise", str(told.seed)],
        ["Delay beside the usual [ticks]", str(told.later_ticks)],
    ]
    blocks: list[Any] = [Table("Made from", ["What", "Value, hash or SHA-256"], rows, [False, False])]
    if told.command:
        blocks.append(Code("Once more", told.command))
    return Section("provenance", "Provenance", "", blocks)

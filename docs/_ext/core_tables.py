"""Directives that put the core's own tables into a page: no name, unit, bound or meaning is typed twice.

``{parameters}`` (argument: the submodels' names, e.g. ``valve``), ``{bounds}``, ``{states}``, ``{outputs}``,
``{channels}``, ``{effects}``, and ``{measurements}``, which includes a file of results if there is one.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from forklift import Truck, _core
from forklift.plant.forklift.effects import EFFECTS
from forklift.recordings.channels import LIFTS

Cell = str | nodes.Node


def code(text: str) -> nodes.Node:
    return nodes.literal(text, text)


def number(value: float | Sequence[float] | None) -> str:
    if value is None:
        return "–"
    if isinstance(value, Sequence):
        return ", ".join(map(number, value))
    return f"{value:.10g}"


def table(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> nodes.table:
    group = nodes.tgroup(cols=len(header))
    group += [nodes.colspec(colwidth=1) for _ in header]
    body = nodes.tbody()
    for row in rows:
        body += _row(row)
    head = nodes.thead()
    head += _row(header)
    group += [head, body]
    whole = nodes.table()
    whole += group
    return whole


def _row(cells: Sequence[Cell]) -> nodes.row:
    row = nodes.row()
    for cell in cells:
        entry = nodes.entry()
        entry += nodes.paragraph("", "", nodes.Text(cell) if isinstance(cell, str) else cell)
        row += entry
    return row


class Parameters(SphinxDirective):
    """The parameters of some submodels, with the values of the thesis's truck."""

    optional_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        heads = self.arguments[0].split() if self.arguments else []
        values = Truck.read("thesis").values
        rows = [
            [
                code(spec["name"]),
                spec["symbol"],
                spec["unit"],
                *(number(values[f"{lift}.{spec['name']}"]) for lift in LIFTS),
                spec["equation"],
                spec["meaning"],
            ]
            for spec in _core.parameter_table()
            if not heads or spec["name"].partition(".")[0] in heads
        ]
        if not rows:
            raise self.error(f"no parameter belongs to {' or '.join(heads)}")
        return [table(["name", "symbol", "unit", *LIFTS, "equation", "meaning"], rows)]


class Bounds(SphinxDirective):
    """The bounds of all parameters, with the reason of each."""

    def run(self) -> list[nodes.Node]:
        rows = [
            [
                code(spec["name"]),
                number(spec["lower"]),
                number(spec["upper"]),
                spec["unit"],
                spec["scale"],
                spec["origin"],
                spec["bounds_reason"],
            ]
            for spec in _core.parameter_table()
        ]
        return [table(["name", "lower", "upper", "unit", "scale", "origin", "why these bounds"], rows)]


class States(SphinxDirective):
    """The states of one lift."""

    def run(self) -> list[nodes.Node]:
        rows = [
            [code(spec["name"]), spec["unit"], number(spec["scale"]), spec["meaning"]]
            for spec in _core.state_table()
        ]
        return [table(["name", "unit", "typical size", "meaning"], rows)]


class Outputs(SphinxDirective):
    """The outputs of a simulation."""

    def run(self) -> list[nodes.Node]:
        rows = [[code(spec["name"]), spec["unit"], spec["meaning"]] for spec in _core.output_table()]
        return [table(["name", "unit", "meaning"], rows)]


class Channels(SphinxDirective):
    """The columns of a recording."""

    def run(self) -> list[nodes.Node]:
        rows = [
            [
                code(spec["name"]),
                spec["unit"],
                number(spec["lower"]),
                number(spec["upper"]),
                number(spec["typical_lower"]),
                spec["meaning"],
            ]
            for spec in _core.channel_table()
        ]
        return [table(["name", "unit", "least", "greatest", "largest at least", "meaning"], rows)]


class Effects(SphinxDirective):
    """The catalogue of effects: what the core and what Python know of each."""

    def run(self) -> list[nodes.Node]:
        return [
            self._section(spec, effect) for spec, effect in zip(_core.effect_table(), EFFECTS, strict=True)
        ]

    def _section(self, spec: Any, effect: Any) -> nodes.section:
        section = nodes.section(ids=[nodes.make_id(spec["id"])], names=[spec["id"]])
        section += nodes.title("", "", code(spec["id"]))
        head = "LIFT." if spec["scope"] == "lift" else ""
        confused = [nodes.Text("Confused with: ")]
        for k, other in enumerate(effect.confused_with):
            confused += [nodes.Text(", " if k else ""), code(other)]
        section += [
            nodes.literal_block(spec["equation"], spec["equation"], language="text"),
            nodes.paragraph("", f"Source: {spec['source']}."),
            nodes.paragraph("", effect.signature),
            nodes.paragraph("", "", *confused, nodes.Text(".")),
            table(
                [
                    "parameter",
                    "symbol",
                    "unit",
                    "bounds",
                    "plausible",
                    "null value",
                    "meaning",
                    "why these bounds",
                ],
                [
                    [
                        code(f"{head}{spec['id']}.{row['name']}"),
                        row["symbol"],
                        row["unit"],
                        f"{number(row['lower'])} to {number(row['upper'])}",
                        f"{number(row['plausible_lower'])} to {number(row['plausible_upper'])}",
                        number(spec["quiet"]) if k < spec["amplitudes"] else "–",
                        row["meaning"],
                        row["bounds_reason"],
                    ]
                    for k, row in enumerate(spec["parameters"])
                ],
            ),
        ]
        for state, output, factor in spec["shows"]:
            section += nodes.paragraph(
                "",
                "",
                code(state),
                nodes.Text(f", times {number(factor)}, is part of "),
                code(output),
                nodes.Text("."),
            )
        if spec["states"]:
            section += table(
                ["state", "unit", "typical size", "meaning"],
                [
                    [code(row["name"]), row["unit"], number(row["scale"]), row["meaning"]]
                    for row in spec["states"]
                ],
            )
        return section


class Ports(SphinxDirective):
    """The places where an effect may enter a lift's equations."""

    def run(self) -> list[nodes.Node]:
        rows = [
            [code(spec["name"]), spec["unit"], spec["join"], number(spec["typical"]), spec["meaning"]]
            for spec in _core.port_table()
        ]
        return [table(["port", "unit", "joins as a", "counts as one", "meaning"], rows)]


class ShapeVariables(SphinxDirective):
    """What a free shape may be a function of."""

    def run(self) -> list[nodes.Node]:
        rows = [
            [code(spec["name"]), spec["unit"], number(spec["finest"]), spec["meaning"]]
            for spec in _core.shape_variables()
        ]
        return [table(["variable", "unit", "narrowest range", "meaning"], rows)]


class Measurements(SphinxDirective):
    """A markdown file relative to the page, or a note how to make it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        path = Path(self.env.doc2path(self.env.docname)).parent / self.arguments[0]
        self.env.note_dependency(str(path))
        if not path.exists():
            text = "Nothing has been measured in this copy yet; the command above makes the table."
            return [nodes.paragraph("", text)]
        holder = nodes.container()
        lines = path.read_text(encoding="utf-8").splitlines()
        self.state.nested_parse(StringList(lines, source=str(path)), 0, holder)
        return holder.children


def setup(app: Sphinx) -> dict[str, bool]:
    directives = (Parameters, Bounds, States, Outputs, Channels, Effects, Ports, ShapeVariables, Measurements)
    for directive in directives:
        app.add_directive(directive.__name__.lower(), directive)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

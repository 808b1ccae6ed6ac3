"""A page as one HTML file: the template, the style and the script around the blocks, plotly's script once."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forklift.report.blocks import Block, Explorer, Figure, Page

if TYPE_CHECKING:
    from jinja2 import Environment


def html(page: Page) -> str:
    """The page as a file that needs no other."""
    from plotly.offline import get_plotlyjs  # type: ignore[import-untyped]

    from forklift import __version__

    drawn = [block for section in page.sections for block in section.blocks if _is_drawn(block)]
    return (
        _environment()
        .get_template("page.html")
        .render(
            page=page,
            places={id(block): place for place, block in enumerate(drawn)},
            data=_data(drawn),
            plotly=get_plotlyjs(),
            version=__version__,
        )
    )


def fragment(template: str, **parts: Any) -> str:
    """A piece of HTML from one of the templates, everything in it escaped."""
    return _environment().get_template(template).render(**parts)


def _is_drawn(block: Block) -> bool:
    return isinstance(block, Figure | Explorer)


def _data(drawn: list[Block]) -> str:
    """What the script draws, by place, such that nothing in it ends the script."""
    text = json.dumps([*drawn], default=vars, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


@cache
def _environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["ident"] = id
    return environment

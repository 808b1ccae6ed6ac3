"""What a page is made of: facts for the reader in a hurry, then sections of text, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar


@dataclass(frozen=True)
class Bar:
    """A cell that draws intervals, in per cent of its width: thin before, thick after, upright the start."""

    title: str
    before: tuple[float, float] | None
    """From where, and how wide."""
    after: tuple[float, float]
    start: float


Cell = str | Bar


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    kind: ClassVar = "text"
    body: str
    note: bool = False
    """Whether it is small print."""


@dataclass(frozen=True)
class Points:
    """A list of sentences, with a heading of its own if it has a title."""

    kind: ClassVar = "points"
    items: Sequence[str]
    title: str = ""


@dataclass(frozen=True)
class Code:
    """Something to type."""

    kind: ClassVar = "code"
    label: str
    body: str


@dataclass(frozen=True)
class Table:
    """Rows of cells below a title; folded away until asked for, if it is long."""

    kind: ClassVar = "table"
    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    numeric: Sequence[bool]
    note: str = ""
    folded: bool = False


@dataclass(frozen=True)
class Bars:
    """Lengths to compare, each below its label, with a mark that all are held against."""

    kind: ClassVar = "bars"
    title: str
    note: str
    rows: Sequence[tuple[str, str, float, str]]
    """Label, number, length in per cent, and ``before``, ``after`` or ``rival``."""
    mark: float
    """Where the mark stands, in per cent."""
    mark_label: str


@dataclass(frozen=True)
class Panel:
    """One drawing, as plotly takes it; colours are names of the page's, with an ``@`` before them."""

    label: str
    """What a reader chooses it by, where a figure has several."""
    data: Sequence[Mapping[str, Any]]
    layout: Mapping[str, Any]


@dataclass(frozen=True)
class Figure:
    """A drawing, or several of which one is seen at a time."""

    kind: ClassVar = "figure"
    title: str
    note: str
    panels: Sequence[Panel]
    height: int = 300
    least_px: int = 0
    """Width below which it is scrolled sideways and not squeezed."""
    choose: str = "Show"
    """The label of the choice between panels."""


@dataclass(frozen=True)
class Sketch:
    """A drawing that is whole as it stands."""

    kind: ClassVar = "sketch"
    title: str
    note: str
    svg: str


@dataclass(frozen=True)
class Signal:
    """One signal of one recording: measured beside what one or two models say, at common times."""

    title: str
    unit: str
    note: str
    curves: Mapping[str, Sequence[float | None]]
    """``x``, ``measured`` and one for each side."""
    band: tuple[float, float] | None = None
    """Where simulated less measured would lie 95 times in 100, were there nothing but the sensor's noise."""


@dataclass(frozen=True)
class Drive:
    """What drove a recording: one drawing below its signals, of one input or of several in one unit."""

    title: str
    unit: str
    curves: Mapping[str, Sequence[float | None]]
    """``x`` [s] and each input, by what it is called."""
    held: bool = True
    """Whether a sample holds until the next."""


@dataclass(frozen=True)
class Replay:
    """One recording, signal by signal, and what drove it."""

    title: str
    group: str
    note: str
    signals: Sequence[Signal]
    drives: Sequence[Drive]
    """The same in all recordings."""


@dataclass(frozen=True)
class Explorer:
    """Recordings to choose from, drawn one signal at a time."""

    kind: ClassVar = "explorer"
    title: str
    note: str
    sides: Sequence[str]
    """``before`` and ``after``, or ``simulated``."""
    recordings: Sequence[Replay]
    first: tuple[int, int] = (0, 0)
    """Recording and signal that are seen first."""


Block = Text | Points | Code | Table | Bars | Figure | Sketch | Explorer


@dataclass(frozen=True)
class Fact:
    """A reader's question and its answer: a few words first, then sentences."""

    question: str
    answer: str
    details: Sequence[str] = ()


@dataclass(frozen=True)
class Section:
    """A part of the page, with a place in its contents."""

    name: str
    title: str
    lead: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Page:
    """A whole page."""

    title: str
    about: str
    """What was done to what: the line above the verdict."""
    verdict: str
    """The one sentence."""
    more: Sequence[str]
    """Further sentences of the verdict."""
    facts: Sequence[Fact]
    sections: Sequence[Section]
    glossary: Mapping[str, str]
    """Words of the page that a reader may not know."""
    beside: Sequence[Table] = ()
    """What else the first screen names, folded."""

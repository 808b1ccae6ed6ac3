"""What draws itself in a notebook: lines over time, as data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from forklift.base import present
from forklift.base.arrays import Floats

Kind = Literal["measured", "simulated", "command"]


@dataclass(frozen=True, eq=False)
class Line:
    """One quantity over time.

    Attributes
    ----------
    panel
        What it is drawn in: lines of one panel share an axis, e.g. ``"velocity_free_m_s"``.
    unit
        Of its values; the same for all lines of a panel.
    time_s, values
        (n,); NaN where there is no sample.
    kind
        Measured, simulated, or commanded, which is held between samples.
    """

    panel: str
    unit: str
    time_s: Floats
    values: Floats
    kind: Kind


class Plotted(ABC):
    """What has lines to draw."""

    @abstractmethod
    def lines(self) -> Sequence[Line]:
        """Panel by panel, from top to bottom."""

    @abstractmethod
    def heading(self) -> str:
        """What is drawn, in one line."""

    def plot(self) -> Any:
        """A `plotly.graph_objects.Figure`: its panels one above the other, over one time."""
        return present.figure(self, self.heading(), self.lines())

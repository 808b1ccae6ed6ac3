"""Measured and simulated values of a recording, as lines to draw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from forklift.base.errors import ForkliftError
from forklift.base.plotted import Line


def compared_lines(
    predictions: Sequence[Any], units: Mapping[str, str], file: str | None = None
) -> list[Line]:
    """Every signal of one recording, twice; by default of the first that was held out.

    Parameters
    ----------
    predictions
        Each with its ``recording`` and its ``signals``: channel, measured and simulated values at the
        recording's times.
    units
        By channel.

    Raises
    ------
    ForkliftError
        ``"recording-unknown"``.
    """
    one = chosen(predictions, file)
    time = one.recording.time_s
    found = []
    for signal in one.signals:
        unit = units[signal.channel]
        found.append(Line(signal.channel, unit, time, signal.measured, "measured"))
        found.append(Line(signal.channel, unit, time, signal.simulated, "simulated"))
    return found


def chosen(predictions: Sequence[Any], file: str | None) -> Any:
    """The prediction of a recording, see `compared_lines`."""
    files = [one.recording.file for one in predictions]
    if file is None:
        return next((one for one in predictions if one.recording.role == "validate"), predictions[0])
    if file not in files:
        near = get_close_matches(str(file), files, n=1)
        raise ForkliftError(
            "recording-unknown",
            f"there is no recording {file!r}; "
            + (f"did you mean {near[0]!r}?" if near else f"there are {', '.join(files)}"),
            file=str(file),
            known=files,
        )
    return predictions[files.index(file)]

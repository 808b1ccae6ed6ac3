"""Rows of the comparison, CVODE's time at equal error, and the one markdown table."""

from dataclasses import dataclass, field

import numpy as np
from lowerings import Error

HEAD = (
    "| method | setting | lowerings | v median | v worst | p_A median | p_A worst | ms per lowering "
    "| times CVODE at its error | times CVODE at {target:.1e} m/s |"
)
CVODE = "CVODE, C"


@dataclass
class Row:
    """One method at one setting: its error, and milliseconds per lowering of each repeat."""

    method: str
    setting: str
    lowerings: int
    error: Error
    ms: list[float] = field(default_factory=list)

    @property
    def time_ms(self) -> float:
        return float(np.median(self.ms))


def time_at(rows: list[Row], method: str, error: float) -> float | None:
    """Least time [ms] at which a method reaches this median error of v [m/s], over its families of settings.

    Between two tolerances of a family it is interpolated, logarithm upon logarithm; looser than a family's
    loosest its loosest counts. None where no family is as accurate.
    """
    times = [_family_time(family, error) for family in families(rows, method).values()]
    return min((time for time in times if time is not None), default=None)


def families(rows: list[Row], method: str) -> dict[str, list[Row]]:
    """A method's rows by what they share: the setting but its tolerance or substeps, which it names last."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        if row.method == method:
            found.setdefault(row.setting.rpartition(", ")[0], []).append(row)
    return found


def ratios_at(rows: list[Row], method: str, error: float) -> dict[str, float]:
    """How many times as fast as CVODE each family of a method reaches this median error of v [m/s]."""
    times = {name: _family_time(family, error) for name, family in families(rows, method).items()}
    best = time_at(rows, CVODE, error)
    return {name: best / time for name, time in times.items() if best is not None and time is not None}


def _family_time(family: list[Row], error: float) -> float | None:
    family = sorted(family, key=lambda row: row.error.v_median)
    errors = np.log([row.error.v_median for row in family])
    if np.log(error) < errors[0]:
        return None
    return float(np.exp(np.interp(np.log(error), errors, np.log([row.time_ms for row in family]))))


def markdown(rows: list[Row], target: float) -> str:
    """The table; above 1 in the last two columns is faster than CVODE's best setting."""
    lines = [HEAD.format(target=target), "|---|---|" + "---:|" * 8]
    fixed = time_at(rows, CVODE, target)
    for row in rows:
        equal = time_at(rows, CVODE, row.error.v_median)
        ratios = [f"{t / row.time_ms:.2f}" if t is not None else "–" for t in (equal, fixed)]
        e = row.error
        errors = [f"{value:.1e}" for value in (e.v_median, e.v_worst, e.p_median, e.p_worst)]
        cells = [row.method, row.setting, str(row.lowerings), *errors, f"{row.time_ms:.3g}", *ratios]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)

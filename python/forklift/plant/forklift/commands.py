"""Commands: the test signals of section 3.5, and the currents of both valves over time.

The ECU quantises a valve's current to 256 steps; a test signal is made in steps, turned into a current
and low-passed before it reaches the valve::

    steps = commands.prms(600, seed=1)
    current = commands.low_pass(commands.steps_to_current(steps), 50.0, 3.0)
    command = commands.Command.of_samples(50.0, free=current)

or all at once: ``commands.generate("prms", "free", duration_s=12.0)``.
Defaults that are not given here are the core's. Source: Fri & Fahlén (2017), section 3.5, Figure 3.7.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forklift import _core
from forklift.base import arguments, output
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.recordings.channels import LIFTS, REQUIRED, Lifts, commanded
from forklift.recordings.formats import csv
from forklift.recordings.formats.signals import Place

if TYPE_CHECKING:
    import polars as pl

Steps = NDArray[np.int64]


SAMPLE_RATE_HZ = 50.0
"""Section 3.5."""
CUTOFF_HZ = 3.0
"""Of the low-pass on a generated command: chosen, the thesis has one but does not say which."""
WORKING_RANGE = (58, 174)
"""Steps between which the valves neither are shut nor saturate, section 3.5."""
STAIRS = 6
"""Levels of a generated staircase: chosen; the thesis says "several evenly spaced"."""
REST_S = 1.0
"""How long a generated command leaves the valves shut at first: chosen, to show that the truck is at rest."""

LONGEST_S = 3600.0
"""Longest generated command [s]: a lowering takes seconds and a day's recordings minutes, so that what is
longer than an hour is a slip, and would fill the memory."""

GENERATORS = ("prms", "staircase")


def prms(
    n_samples: int,
    seed: int,
    *,
    low: int | None = None,
    high: int | None = None,
    levels: int | None = None,
    switching_probability: float | None = None,
) -> Steps:
    """A pseudo-random multilevel signal, section 3.5.

    At each sample, with the switching probability, the level is drawn anew from `levels` evenly spaced
    ones between `low` and `high`. The thesis's settings are the default: 58 to 174, 8 levels, 0.05.

    Parameters
    ----------
    n_samples, seed
        Length, and the seed that the signal alone depends on.
    low, high, levels, switching_probability
        Working range in steps of the ECU (0 to 255), number of levels, probability per sample.

    Returns
    -------
    (n_samples,) integer steps.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for a setting out of its range.
    """
    given = _given(low=low, high=high, levels=levels, switching_probability=switching_probability)
    return np.asarray(_of_core(_core.prms, n_samples, seed, **given), np.int64)


def staircase(levels: Sequence[int] | Steps, samples_per_level: int) -> Steps:
    """Steps to given levels, each held long enough for a steady state, section 3.5.

    Returns
    -------
    (len(levels) * samples_per_level,) integer steps of the ECU.
    """
    return np.asarray(_of_core(_core.staircase, np.asarray(levels), samples_per_level), np.int64)


def steps_to_current(steps: ArrayLike) -> Floats:
    """The valve current [A] that integer steps (0 to 255) of the ECU stand for; same shape."""
    return np.asarray(_of_core(_core.steps_to_current, np.asarray(steps)), np.float64)


def quantise_current(current: ArrayLike) -> Floats:
    """The current [A] as the ECU commands it: rounded to its steps; same shape."""
    return np.asarray(_of_core(_core.quantise_current, _floats(current)), np.float64)


def low_pass(current: ArrayLike, sample_rate_hz: float, cutoff_hz: float) -> Floats:
    """A first-order low-pass, starting at rest at the first sample.

    Without it the valve shuts so fast that the pressure spike might damage the hardware (section 3.5).

    Parameters
    ----------
    current
        (n,) [A], evenly sampled at `sample_rate_hz` [Hz].
    cutoff_hz
        Where the gain is 1/√2 [Hz].
    """
    return np.asarray(_of_core(_core.low_pass, _floats(current), sample_rate_hz, cutoff_hz), np.float64)


def dither(
    time_s: ArrayLike, current: ArrayLike, amplitude: float, frequency_hz: float
) -> tuple[Floats, Floats]:
    """A square wave on a held command, where that is above zero; it acts through the hysteresis, (3.11).

    Parameters
    ----------
    time_s, current
        (n,) [s] and (n,) [A], held between samples.
    amplitude, frequency_hz
        Of the square wave [A], [Hz].

    Returns
    -------
    Times (m,) [s] and currents (m,) [A] of the refined command: every sample and every edge.
    """
    refined = _of_core(_core.dither, _floats(time_s), _floats(current), amplitude, frequency_hz)
    return np.asarray(refined[0], np.float64), np.asarray(refined[1], np.float64)


def generate(kind: Literal["prms", "staircase"], lift: Lifts, *, duration_s: float, seed: int = 1) -> Command:
    """A command as section 3.5 describes, ready for the valves of `lift`; the other valve stays shut.

    Parameters
    ----------
    kind
        ``"prms"``, or ``"staircase"``: levels across the working range, the valve shut in between.
    duration_s
        Length [s], with one second at rest first; `LONGEST_S` at most.
    seed
        Of a prms; the main lift's takes the seed after it, so that both lifts move differently.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for another kind, or a duration that leaves no room to move or is beyond
        `LONGEST_S`.
    """
    if kind not in GENERATORS:
        raise ForkliftError(
            "argument-invalid", f"there is no generator {kind!r}; take {' or '.join(GENERATORS)}", name="kind"
        )
    if lift not in ("both", *LIFTS):
        raise ForkliftError(
            "argument-invalid", f"there is no lift {lift!r}; take both, free or main", name="lift"
        )
    duration_s, seed = arguments.number("duration_s", duration_s), arguments.whole("seed", seed)
    rest = round(REST_S * SAMPLE_RATE_HZ)
    if not (duration_s * SAMPLE_RATE_HZ >= rest + 2 * STAIRS):
        raise ForkliftError(
            "argument-invalid",
            f"the duration is {duration_s:g} s, which leaves no room to move after {REST_S:g} s at rest; "
            "give more seconds",
            name="duration_s",
            value=duration_s,
        )
    if duration_s > LONGEST_S:
        raise ForkliftError(
            "argument-invalid",
            f"the duration is {duration_s:g} s, where {LONGEST_S:g} s are the most, as no lowering takes "
            "longer; give fewer seconds",
            name="duration_s",
            value=duration_s,
            upper=LONGEST_S,
        )
    n = round(duration_s * SAMPLE_RATE_HZ) - rest
    currents = {}
    for which in commanded(lift):
        steps = prms(n, seed + LIFTS.index(which)) if kind == "prms" else _stairs(n)
        current = steps_to_current(np.concatenate([np.zeros(rest, np.int64), steps]))
        currents[which] = quantise_current(low_pass(current, SAMPLE_RATE_HZ, CUTOFF_HZ))
    return Command.of_samples(SAMPLE_RATE_HZ, free=currents.get("free"), main=currents.get("main"))


def _stairs(n_samples: int) -> Steps:
    levels = np.linspace(*WORKING_RANGE, STAIRS).round().astype(np.int64)
    up_and_shut = np.column_stack([levels, np.zeros_like(levels)]).ravel()
    return staircase(up_and_shut, -(-n_samples // len(up_and_shut)))[:n_samples]


@dataclass(frozen=True, eq=False)
class Command:
    """The currents commanded to both proportional valves, each held until the next sample.

    Parameters
    ----------
    time_s
        (n,) [s], strictly increasing, n ≥ 2.
    current_free_a, current_main_a
        (n,) [A], as the ECU sends them after its low-pass and before dither.

    Raises
    ------
    ForkliftError
        ``"command-malformed"`` if a sample is missing, lengths differ or time does not increase.
    """

    time_s: Floats
    current_free_a: Floats
    current_main_a: Floats

    def __post_init__(self) -> None:
        for name in REQUIRED:
            column = np.array(_floats(getattr(self, name)))
            column.flags.writeable = False
            object.__setattr__(self, name, column)
        if problem := self._problem():
            raise ForkliftError("command-malformed", f"the command's {problem[0]}", **problem[1])

    @classmethod
    def of_samples(
        cls, sample_rate_hz: float, *, free: ArrayLike | None = None, main: ArrayLike | None = None
    ) -> Command:
        """A command from evenly sampled currents [A], starting at 0 s; a valve not given stays shut."""
        given = [_floats(current) for current in (free, main) if current is not None]
        if not given:
            raise ForkliftError("command-malformed", "a command needs a current; give free, main or both")
        if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0):
            raise ForkliftError(
                "command-malformed",
                f"the sample rate is {sample_rate_hz} Hz; it must be positive",
                name="sample_rate_hz",
                value=sample_rate_hz,
            )
        shut = np.zeros_like(given[0])
        return cls(
            np.arange(len(shut)) / sample_rate_hz,
            shut if free is None else _floats(free),
            shut if main is None else _floats(main),
        )

    @classmethod
    def read(cls, path: str | Path) -> Command:
        """Read a CSV file with exactly the columns ``time_s, current_free_a, current_main_a``.

        Raises
        ------
        ForkliftError
            ``"file-unreadable"`` or ``"command-malformed"``, with ``file`` and ``line`` among the facts.
        """
        columns, lines = _columns(arguments.path("path", path))
        place = Place(str(path), str(path), lines=lines)
        for name, column in columns.items():
            if len(bad := np.flatnonzero(~np.isfinite(column))):
                raise place.error(
                    "command-malformed",
                    f"{name} is missing; a command holds at every instant, so give every row a finite number",
                    row=int(bad[0]),
                    channel=name,
                )
        time = columns["time_s"]
        if len(falls := np.flatnonzero(np.diff(time) <= 0)):
            row = int(falls[0]) + 1
            raise place.error(
                "command-malformed",
                f"time_s is {time[row]:g} after {time[row - 1]:g}; it must increase from row to row",
                row=row,
                channel="time_s",
                value=float(time[row]),
            )
        if len(time) < 2:
            raise place.error(
                "command-malformed", f"there are {len(time)} samples; a command needs two at least"
            )
        return cls(*(columns[name] for name in REQUIRED))

    def write(self, path: str | Path) -> Path:
        """Write the CSV file that `Command.read` reads back equal; whole or not at all."""
        return output.write_file(path, lambda temporary: self.to_polars().write_csv(temporary))

    def with_dither(self, amplitude: float, frequency_hz: float) -> Command:
        """The command with `dither` on both currents. Recorded commands are those before dither."""
        both = [
            dither(self.time_s, current, amplitude, frequency_hz)
            for current in (self.current_free_a, self.current_main_a)
        ]
        return Command(both[0][0], both[0][1], both[1][1])

    def to_polars(self) -> pl.DataFrame:
        """The three columns as a `polars.DataFrame`."""
        import polars as pl

        return pl.DataFrame({name: getattr(self, name) for name in REQUIRED})

    @property
    def currents(self) -> Floats:
        """(n, 2) [A], free and main, as the core takes them."""
        return np.column_stack([self.current_free_a, self.current_main_a])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Command) and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in REQUIRED
        )

    def __hash__(self) -> int:
        return hash(tuple(getattr(self, name).tobytes() for name in REQUIRED))

    def __repr__(self) -> str:
        return (
            f"Command({len(self.time_s)} samples, {self.time_s[0]:g} to {self.time_s[-1]:g} s, "
            f"free up to {self.current_free_a.max():.3f} A, main up to {self.current_main_a.max():.3f} A)"
        )

    def _problem(self) -> tuple[str, dict[str, Any]] | None:
        for name in REQUIRED:
            column = getattr(self, name)
            if column.shape != self.time_s.shape or column.ndim != 1 or len(column) < 2:
                what = (
                    f"{name} has shape {column.shape}; give columns of the same length, two samples at least"
                )
                return what, {"name": name, "value": column.shape}
            if not np.isfinite(column).all():
                row = int(np.flatnonzero(~np.isfinite(column))[0])
                return f"{name}[{row}] is {column[row]}; give a finite number", {"name": name, "row": row}
        falls = np.flatnonzero(np.diff(self.time_s) <= 0)
        if len(falls):
            row = int(falls[0]) + 1
            return f"time_s[{row}] is {self.time_s[row]:g}, not after its predecessor; sort it", {
                "name": "time_s",
                "row": row,
            }
        return None


def _columns(path: Path) -> tuple[dict[str, Floats], NDArray[np.int64] | None]:
    """The three columns of a command's CSV file, and the line of each row."""
    place = Place(str(path), str(path))

    def all_of_them(names: Sequence[str]) -> list[str]:
        if sorted(names) != sorted(REQUIRED):
            raise place.error(
                "command-malformed",
                f"the columns are {', '.join(names)}; a command has {', '.join(REQUIRED)} and no other",
                line=1,
                found=list(names),
            )
        return list(names)

    try:
        signals = csv.read(place, all_of_them)
    except (OSError, ValueError) as error:
        why = (getattr(error, "strerror", None) or str(error)).lower()
        raise place.error(
            "file-unreadable", f"the file cannot be read ({why}); give a command's CSV file"
        ) from None
    return {name: series.values for name, series in signals.series.items()}, signals.lines


def _floats(values: ArrayLike) -> Floats:
    try:
        return np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise ForkliftError("argument-invalid", "a signal must be an array of numbers") from None


def _given(**settings: Any) -> dict[str, Any]:
    """The settings that were given; the core has the others' defaults."""
    return {name: value for name, value in settings.items() if value is not None}


def _of_core(function: Callable[..., Any], *arguments: Any, **settings: Any) -> Any:
    """A function of the core; what it cannot even convert is refused like what it does not accept."""
    try:
        return function(*arguments, **settings)
    except (TypeError, OverflowError) as error:
        raise ForkliftError(
            "argument-invalid", f"an argument of {function.__name__} is of the wrong kind or size: {error}"
        ) from None

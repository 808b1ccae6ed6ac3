"""``sweep.toml``: what a sweep varies, how it samples, and what it asks of every member."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from forklift.base import toml
from forklift.base.errors import ForkliftError
from forklift.base.malformed import first_wrong
from forklift.ensemble.tables import conditions, signals
from forklift.recordings.channels import Lift, Lifts, commanded

Sampling = Literal["independent", "sobol", "grid"]

_STRICT = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

DISTRIBUTIONS = ("uniform", "log_uniform", "normal", "log_normal", "choice", "grid")
"""Ways of varying; `grid` is [lower, upper, number] and the others are those of the core."""

FORMULAS = {
    "always": "G[{from_s}, {to_s}] ({x} >= {lower} and {x} <= {upper})",
    "stays_inside": "G[{from_s}, {to_s}] ({x} >= {lower} and {x} <= {upper})",
    "never_after_settling": "G (since >= {after_s} -> {x} <= {upper})",
    "settles": "G (since >= {within_s} -> abs({x}) <= {band})",
    "responds": "G (step -> F[0, {within_s}] (abs({x} - request) <= (1 - {share}) abs(step)))",
    "reaches": "F[{from_s}, {to_s}] ({x} >= {lower} and {x} <= {upper})",
}
"""Each template in signal temporal logic: `since` the last step of what is asked for, `step` its size."""


class Vary(BaseModel):
    """``[vary.NAME]``: one distribution; `relative` to the value that the truck or the conditions have."""

    model_config = _STRICT
    uniform: tuple[float, float] | None = None
    log_uniform: tuple[float, float] | None = None
    normal: tuple[float, float] | tuple[float, float, float, float] | None = None
    log_normal: tuple[float, float] | tuple[float, float, float, float] | None = None
    choice: tuple[float, ...] | None = None
    grid: tuple[float, float, int] | None = None
    relative: bool = False

    def kind(self, name: str) -> str:
        """The one distribution that is given."""
        given = [kind for kind in DISTRIBUTIONS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ForkliftError(
                "value-invalid",
                f"vary.{name} gives {' and '.join(given) or 'no distribution'}; give one of "
                f"{', '.join(DISTRIBUTIONS)}",
                name=f"vary.{name}",
            )
        return given[0]


class Correlate(BaseModel):
    """``[[correlate]]``: what is drawn together, with the correlations of a Gaussian copula (Nelsen 2006).

    Each keeps its own distribution; between normal ones the matrix is their correlation.
    """

    model_config = _STRICT
    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]

    def wrong(self, varied: Mapping[str, Vary]) -> str | None:
        """What is amiss with it, if anything is."""
        unknown = [name for name in self.names if name not in varied]
        if unknown:
            return f"names {unknown[0]}, which is not varied"
        if len(set(self.names)) < len(self.names):
            return "names something twice"
        n = len(self.names)
        if len(self.matrix) != n or any(len(row) != n for row in self.matrix):
            return f"has {n} names; give a matrix of {n} rows and columns"
        for i in range(n):
            for j in range(n):
                if abs(self.matrix[i][j] - self.matrix[j][i]) > 1e-9 or abs(self.matrix[i][j]) > 1.0 + 1e-9:
                    return "has a matrix that is not one of correlations: symmetric, from -1 to 1"
            if abs(self.matrix[i][i] - 1.0) > 1e-9:
                return "has a matrix without ones on its diagonal"
        if self.factor is None:
            return "has a matrix that no variables can have: it is not positive semidefinite"
        return None

    @property
    def factor(self) -> tuple[tuple[float, ...], ...] | None:
        """L with L Lᵀ the matrix, by Cholesky; of variables that are the same but for rounding too."""
        n = len(self.names)
        rows = [[0.0] * n for _ in range(n)]
        for j in range(n):
            left = self.matrix[j][j] - sum(x * x for x in rows[j][:j])
            if left < -1e-6:
                return None
            # What is nothing but rounding is nothing: a variable that follows from those before it.
            pivot = left**0.5 if left > 1e-9 else 0.0
            rows[j][j] = pivot
            for i in range(j + 1, n):
                rest = self.matrix[i][j] - sum(a * b for a, b in zip(rows[i][:j], rows[j][:j], strict=True))
                if pivot == 0.0:
                    if abs(rest) > 1e-4:
                        return None
                    continue
                rows[i][j] = rest / pivot
        return tuple(tuple(row) for row in rows)


class Stretch(BaseModel):
    """``[[profile]]``: from a time on, the lowering speed asked for [m/s]; without a controller a current
    [A]."""

    model_config = _STRICT
    from_s: float
    level: float


class Require(BaseModel):
    """``[[require]]``: a template with its bounds, in the signal's unit, and the scale that margins are
    divided by."""

    model_config = _STRICT
    name: str
    template: str
    signal: str
    scale: float
    lift: Lift | None = None
    peak_to_peak_s: float | None = None
    lower: float | None = None
    upper: float | None = None
    from_s: float | None = None
    to_s: float | None = None
    after_s: float | None = None
    within_s: float | None = None
    band: float | None = None
    share: float | None = None

    def asked(self, lifts: tuple[str, ...]) -> dict[str, float | str]:
        """As the core takes it."""
        given = self.model_dump(exclude={"scale", "lift"}, exclude_none=True)
        return given | {"lift": float(lifts.index(self.lift or lifts[0]))}

    @property
    def formula(self) -> str:
        """The requirement in signal temporal logic."""
        x = (
            self.signal
            if self.peak_to_peak_s is None
            else f"peak_to_peak({self.signal}, {self.peak_to_peak_s:g} s)"
        )
        numbers = self.model_dump(exclude={"name", "template", "signal"})
        ends = {"from_s": 0.0, "to_s": float("inf"), "lower": float("-inf"), "upper": float("inf")}
        filled = {key: ends.get(key) if value is None else value for key, value in numbers.items()}
        text = FORMULAS[self.template].format(x=x, **filled)
        return text.replace(f"{x} >= -inf and ", "").replace(f" and {x} <= inf", "")


class Specification(BaseModel):
    """The whole of a sweep's TOML file.

    Attributes
    ----------
    truck
        A shipped truck's name, or a truck's TOML file.
    controller
        None: the profile's levels are currents [A].
    lifts
        Which lifts run.
    members
        How many; a grid has its own number.
    scrambles
        Of a Sobol sequence: independent ones, which alone give an interval; members / scrambles is a power
        of two.
    substeps
        Of the integrator in a tick of 20 ms.
    precision
        Of the trucks' numbers: "double" (64 bits) or "single" (32 bits: half the time and twice the lanes
        where the processor has AVX-512, and an error far below that of the substeps, docs/sweeps.md). The
        controllers' integers are the same.
    settle_s, band_m_s
        After a step of what is asked for, how long it has to stand to be steady, and the error that counts
        as settled: of the measures, not of the requirements.
    worst
        How many members with the least scaled margin are kept.
    chunk
        Members of a file; no number depends on it.
    """

    model_config = _STRICT
    name: str
    truck: str = "thesis"
    controller: str | None = None
    lifts: Lifts
    duration_s: float = 10.0
    substeps: int = Field(3, ge=1, le=1000)
    precision: Literal["double", "single"] = "double"
    seed: int = Field(1, ge=0, lt=2**64)
    members: int = 1000
    sampling: Sampling = "independent"
    scrambles: int = 16
    settle_s: float = Field(3.0, ge=0.0)
    band_m_s: float = Field(0.05, ge=0.0)
    worst: int = Field(10, ge=0)
    chunk: int = 4096
    conditions: Mapping[str, float] = {}
    profile: tuple[Stretch, ...]
    vary: Mapping[str, Vary] = {}
    correlate: tuple[Correlate, ...] = ()
    require: tuple[Require, ...]

    @property
    def sha256(self) -> str:
        """A hash of all but `worst`, and what stands at a default that came later.

        Truck and controller are in it by name: their numbers are compared beside it.
        """
        # What is drawn alone has the hash that it had before there was a choice.
        unused = {"worst"} if self.correlate else {"worst", "correlate"}
        if self.precision == "double":
            unused.add("precision")
        kept = self.model_dump(mode="json", exclude=unused)
        return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()


def of(given: Specification | Mapping[str, Any] | str | Path) -> Specification:
    """A specification that is one already, a mapping, or a TOML file.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for anything else, and those of `check` and `read`.
    """
    if isinstance(given, Specification):
        return given
    if isinstance(given, Mapping):
        return check(given)
    if isinstance(given, str | Path):
        return read(given)
    raise ForkliftError(
        "argument-invalid",
        f"the sweep is a {type(given).__name__}; give a specification, a mapping or a TOML file",
        name="given",
    )


def read(path: str | Path) -> Specification:
    """The specification in a TOML file, checked; the paths of a truck and a controller are relative to it.

    Raises
    ------
    ForkliftError
        ``"file-unreadable"``, ``"toml-syntax"``, ``"key-unknown"``, ``"value-invalid"``.
    """
    path = Path(path)
    try:
        document = toml.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        why = (error.strerror or "it is not there").lower()
        raise ForkliftError(
            "file-unreadable", f"{path} cannot be read ({why}); name a sweep's TOML file", file=str(path)
        ) from None
    except (UnicodeDecodeError, toml.TOMLDecodeError) as error:
        raise ForkliftError(
            "toml-syntax", f"{path} is not TOML ({error}); correct it", file=str(path)
        ) from None
    for part in ("truck", "controller"):
        named = document.get(part)
        if isinstance(named, str) and named.endswith(".toml") and not Path(named).is_absolute():
            document[part] = str((path.parent / named).resolve())
    return check(document, str(path))


def check(document: Mapping[str, Any], where: str = "sweep") -> Specification:
    """`document` as a specification.

    Raises
    ------
    ForkliftError
        ``"key-unknown"``, ``"value-invalid"``.
    """
    try:
        found = Specification.model_validate(document)
    except ValidationError as error:
        wrong = first_wrong(error, Specification)
        code = "key-unknown" if wrong.unknown else "value-invalid"
        raise ForkliftError(code, f"{where}: {wrong.sentence}", name=wrong.name, file=where) from None
    for name, vary in found.vary.items():
        vary.kind(name)
    for one in found.correlate:
        problem = one.wrong(found.vary)
        if problem is None and found.sampling == "grid":
            problem = "has no meaning on a grid"
        if problem:
            raise ForkliftError(
                "value-invalid",
                f"{where}: correlate of {', '.join(one.names)} {problem}",
                name="correlate",
                file=where,
            )
    together = [name for one in found.correlate for name in one.names]
    twice = next((name for name in together if together.count(name) > 1), None)
    if twice:
        raise ForkliftError(
            "value-invalid",
            f"{where}: {twice} stands in two [[correlate]]; give one, with the matrix of all that go with it",
            name="correlate",
            value=twice,
            file=where,
        )
    for name in found.conditions:
        if name not in conditions():
            raise ForkliftError(
                "value-invalid",
                f"{where}: conditions.{name} is unknown; take one of {', '.join(conditions())}",
                name=f"conditions.{name}",
            )
    names = [require.name for require in found.require]
    if not names or len(set(names)) < len(names):
        raise ForkliftError(
            "value-invalid",
            f"{where}: give one or more [[require]], each with a name of its own",
            name="require",
        )
    lifts = commanded(found.lifts)
    for require in found.require:
        problem = _wrong(require, lifts)
        if problem:
            raise ForkliftError(
                "value-invalid",
                f"{where}: require {require.name!r} {problem}",
                name=f"require.{require.name}",
            )
    return found


def _wrong(require: Require, lifts: tuple[str, ...]) -> str | None:
    if require.template not in FORMULAS:
        return f"has the template {require.template!r}; take one of {', '.join(FORMULAS)}"
    if require.signal not in signals():
        return f"speaks of {require.signal!r}; take one of {', '.join(signals())}"
    if require.lift and require.lift not in lifts:
        return f"speaks of the {require.lift} lift, which does not run; this sweep runs {' and '.join(lifts)}"
    if not require.scale > 0.0:
        return f"has the scale {require.scale:g}; give a positive one, in the signal's unit"
    return None

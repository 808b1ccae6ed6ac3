"""A controller: its settings with their sources, in the units of the ECU (mm, mm/s, mA).

Source: Fri & Fahlén (2017), chapter 4; Table 5.3; Figures A.16 to A.19.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from forklift import _core
from forklift.base import output, toml
from forklift.base.errors import ForkliftError
from forklift.base.malformed import first_wrong
from forklift.plant.forklift.speed_table import speed_to_current
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import LIFTS, Lift

SHIPPED = Path(__file__).parent / "controllers"
WORDS = (16, 32)
"""Word lengths [bits] of gains and tables."""
TABLE_SPACING = 5
"""The base-2 logarithm of the distance of a speed table's knots: 32 mm/s. Chosen: a straight line between
knots is then within 4 mA of the thesis truck's curve above the first knot."""


class Number(BaseModel):
    """A setting and where it comes from."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    value: float
    source: str


class Curve(BaseModel):
    """Values at knots that stand 2^spacing apart, from `first` on."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    first: int = Field(default=0, ge=-(2**20), le=2**20)
    spacing: int = Field(ge=0, le=14)
    values: list[float]
    source: str


class Swing(BaseModel):
    """Feedback of the pressure's swing over the mean pressure: knots 2^spacing steps of the sensor apart."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    spacing: int = Field(ge=0, le=14)
    frequency_hz: list[float]
    damping: list[float]
    gain_mm_s_per_bar: list[float]
    lead_deg: list[float]
    source: str


class Shaper(BaseModel):
    """The reference as two impulses, `share` at once and the rest `delay_s` later, over the mean pressure.

    Knots are 2^spacing steps of the sensor apart. A swing whose period is twice the delay is not excited:
    Singer & Seering (1990), J. Dynamic Systems, Measurement and Control 112(1), (7) and (8).
    """

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    spacing: int = Field(ge=0, le=14)
    delay_s: list[float]
    share: list[float]
    source: str


class LiftSettings(BaseModel):
    """One lift's settings.

    Attributes
    ----------
    numbers
        By name; `lift_settings` has each one's unit, bounds and meaning.
    table
        From lowering speed of the forks [mm/s] to current [mA].
    ratio
        The lift's share of the reference, 0 to 1, over the forks' height [encoder counts]: (4.10), (4.11).
    swing
        Feedback of the pressure's swing; None without.
    shaper
        How the reference is shaped; None if it is not.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    numbers: dict[str, Number]
    table: Curve
    ratio: Curve
    swing: Swing | None = None
    shaper: Shaper | None = None


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)

    name: str
    word: int = 16
    shared: dict[str, Number]
    free: LiftSettings
    main: LiftSettings


def lift_settings() -> dict[str, Mapping[str, Any]]:
    """The settings of a lift by name: unit, bounds, meaning."""
    return {row["name"]: row for row in _core.lift_setting_table()}


def shared_settings() -> dict[str, Mapping[str, Any]]:
    """The settings that both lifts share by name: unit, bounds, meaning."""
    return {row["name"]: row for row in _core.shared_setting_table()}


GivenCurve = tuple[int, int, list[float]]
GivenSwing = tuple[int, list[float], list[float], list[float], list[float]]
GivenShaper = tuple[int, list[float], list[float]]
GivenLift = tuple[list[float], GivenCurve, GivenCurve, GivenSwing | None, GivenShaper | None]
Given = tuple[list[float], GivenLift, GivenLift, int]
"""As the core takes them: both lifts' numbers, the free lift, the main lift, the word."""


@dataclass(frozen=True)
class Controller:
    """Settings of a controller, immutable and checked by the core.

    Attributes
    ----------
    shared
        What both lifts share, by name; `shared_settings` has each one's unit, bounds and meaning.
    free, main
        Of each lift.
    word
        Length of gains and tables in fixed point, 16 or 32 bits.

    Raises
    ------
    ForkliftError
        ``"parameter-missing"``, ``"parameter-unknown"``, ``"parameter-out-of-bounds"``,
        ``"argument-invalid"``, ``"table-length"``.
    """

    name: str
    shared: Mapping[str, Number]
    free: LiftSettings
    main: LiftSettings
    word: int = 16
    core: _core.Controller = field(init=False, repr=False, compare=False)
    """The same controller as the core holds it: integers."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "core", _core.Controller(*self.given))

    @property
    def given(self) -> Given:
        """Everything as the core takes it."""
        shared = _ordered("shared", self.shared, shared_settings())
        return shared, _given("free", self.free), _given("main", self.main), self.word

    @classmethod
    def read(cls, name_or_path: str | Path) -> Controller:
        """A shipped controller by name (``"thesis"``, ``"today"``, ``"damped"``, ``"calm"``), or that of
        a TOML file.

        Raises
        ------
        ForkliftError
            ``"file-unreadable"``, ``"toml-syntax"``, ``"controller-malformed"`` and those of the class.
        """
        path = Path(name_or_path)
        if str(name_or_path) in shipped():
            path = SHIPPED / f"{name_or_path}.toml"
        try:
            text = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError):
            raise ForkliftError(
                "file-unreadable",
                f"there is no controller {name_or_path}; give a TOML file or one of {', '.join(shipped())}",
                file=str(path),
            ) from None
        try:
            found = _File.model_validate(toml.loads(text))
        except toml.TOMLDecodeError as error:
            raise ForkliftError(
                "toml-syntax", f"{path}: this is not TOML ({error})", file=str(path)
            ) from None
        except ValidationError as error:
            wrong = first_wrong(error, _File)
            raise ForkliftError(
                "controller-malformed", f"{path}: {wrong.sentence}", file=str(path), name=wrong.name
            ) from None
        return cls(found.name, found.shared, found.free, found.main, found.word)

    def write(self, path: str | Path) -> Path:
        """Write the TOML file that `read` reads back equal; whole or not at all.

        Raises
        ------
        ForkliftError
            ``"not-writable"``; ``"output-exists"`` if something else than a controller stands there.
        """
        output.check_alike(path, "controller", Controller.read)
        return output.write_text(path, _toml(self))

    @property
    def hash(self) -> str:
        """Of the integers: the exported C shows the same."""
        return self.core.hash

    def with_word(self, word: int) -> Controller:
        """The same settings in words of 16 or 32 bits."""
        if word not in WORDS:
            raise ForkliftError(
                "argument-invalid", f"word is {word!r}; give 16 or 32 bits", name="word", value=word
            )
        return replace(self, word=word)

    def with_numbers(self, lift: Lift, source: str, **values: float) -> Controller:
        """Another controller with some numbers of a lift replaced."""
        settings: LiftSettings = getattr(self, lift)
        numbers = settings.numbers | {k: Number(value=v, source=source) for k, v in values.items()}
        return self._with(lift, settings.model_copy(update={"numbers": numbers}))

    def with_swing(self, lift: Lift, swing: Swing | None) -> Controller:
        """Another controller with a lift's pressure feedback replaced."""
        settings: LiftSettings = getattr(self, lift)
        return self._with(lift, settings.model_copy(update={"swing": swing}))

    def with_shaper(self, lift: Lift, shaper: Shaper | None) -> Controller:
        """Another controller with a lift's reference shaped in another way."""
        settings: LiftSettings = getattr(self, lift)
        return self._with(lift, settings.model_copy(update={"shaper": shaper}))

    def _with(self, lift: Lift, settings: LiftSettings) -> Controller:
        return replace(self, free=settings) if lift == "free" else replace(self, main=settings)

    def only(self, lift: Lift) -> Controller:
        """The controller of one lift alone: the reference is all its own."""
        changed = {}
        for name in LIFTS:
            share = 1.0 if name == lift else 0.0
            ratio = Curve(spacing=0, values=[share, share], source="one lift alone")
            changed[name] = getattr(self, name).model_copy(update={"ratio": ratio})
        return replace(self, **changed)


def shipped() -> tuple[str, ...]:
    """The names of the controllers that come with forklift."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.toml")))


def speed_table(truck: Truck, lift: Lift, *, oil_temperature_degc: float, load_kg: float = 0.0) -> Curve:
    """The truck's steady state inverted, at the knots of a controller's table."""
    speeds = [1e-3 * (1 << TABLE_SPACING) * k for k in range(33)]
    found = speed_to_current(
        truck, lift, speeds=speeds, load_kg=load_kg, oil_temperature_degc=oil_temperature_degc
    )
    last = min(int(found.reached.sum()) + 1, len(speeds))
    source = (
        f"steady state of truck {truck.name} (sha256 {truck.sha256[:12]}), {load_kg:g} kg, "
        f"{oil_temperature_degc:g} degC"
    )
    return Curve(
        spacing=TABLE_SPACING,
        values=[round(1e3 * float(a), 2) for a in found.current_a[:last]],
        source=source,
    )


def _ordered(
    where: str, numbers: Mapping[str, Number], known: Mapping[str, Mapping[str, Any]]
) -> list[float]:
    for name in numbers:
        if name not in known:
            raise ForkliftError(
                "parameter-unknown", f"{where}.{name} is no setting; there are {', '.join(known)}", name=name
            )
    for name, row in known.items():
        if name not in numbers:
            raise ForkliftError(
                "parameter-missing",
                f"setting {where}.{name} is missing; give it a value in {row['unit']} between {row['lower']} "
                f"and {row['upper']}",
                name=f"{where}.{name}",
            )
    return [numbers[name].value for name in known]


def _given(name: str, lift: LiftSettings) -> GivenLift:
    swing, shaper = lift.swing, lift.shaper
    return (
        _ordered(name, lift.numbers, lift_settings()),
        (lift.table.first, lift.table.spacing, lift.table.values),
        (lift.ratio.first, lift.ratio.spacing, lift.ratio.values),
        None
        if swing is None
        else (swing.spacing, swing.frequency_hz, swing.damping, swing.gain_mm_s_per_bar, swing.lead_deg),
        None if shaper is None else (shaper.spacing, shaper.delay_s, shaper.share),
    )


def _toml(controller: Controller) -> str:
    lines = [f"name = {toml.written(controller.name)}", f"word = {controller.word}", ""]

    def numbers(head: str, rows: Mapping[str, Number], known: Mapping[str, Mapping[str, Any]]) -> None:
        lines.append(f"[{head}]")
        lines.extend(
            f"{name} = {{ value = {float(rows[name].value)!r}, source = {toml.written(rows[name].source)} }}"
            f"  # {known[name]['unit']}"
            for name in known
        )
        lines.append("")

    def fields(head: str, model: BaseModel) -> None:
        lines.append(f"[{head}]")
        for name, value in model.model_dump().items():
            shown = toml.written(value) if isinstance(value, str) else _numbers(value)
            lines.append(f"{name} = {shown}")
        lines.append("")

    numbers("shared", controller.shared, shared_settings())
    for lift in LIFTS:
        settings: LiftSettings = getattr(controller, lift)
        numbers(f"{lift}.numbers", settings.numbers, lift_settings())
        fields(f"{lift}.table", settings.table)
        fields(f"{lift}.ratio", settings.ratio)
        if settings.swing:
            fields(f"{lift}.swing", settings.swing)
        if settings.shaper:
            fields(f"{lift}.shaper", settings.shaper)
    return "\n".join(lines).rstrip() + "\n"


def _numbers(value: int | Sequence[float]) -> str:
    return str(value) if isinstance(value, int) else "[" + ", ".join(repr(float(x)) for x in value) + "]"

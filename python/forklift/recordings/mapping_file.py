"""``channels.toml``: how the signals of logs are mapped to channels, for recordings that come later."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forklift.base import toml
from forklift.base.errors import ForkliftError

_KEYS = ("channels", "ignore", "dbc")


@dataclass(frozen=True)
class Mapped:
    """What is said of the signals of logs.

    Attributes
    ----------
    channels
        As ``[channels]`` of a campaign file: a signal's name to its channel, or to a table with its unit.
    ignore
        Columns to pass over.
    dbc
        The DBCs of CAN logs.
    """

    channels: Mapping[str, Any]
    ignore: Sequence[str] = ()
    dbc: Sequence[str] = ()

    def written(self) -> str:
        """The same as a TOML file."""
        lines = [
            "# How these recordings' logs were mapped; forklift convert --extend maps further ones alike."
        ]
        if self.ignore:
            lines.append(f"ignore = {toml.written(list(self.ignore))}")
        if self.dbc:
            lines.append(f"dbc = {toml.written([os.path.abspath(one) for one in self.dbc])}")
        lines += ["", "[channels]"]
        for name, source in self.channels.items():
            if isinstance(source, str):
                lines.append(f"{toml.written(name)} = {toml.written(source)}")
            else:
                inside = ", ".join(
                    f"{key} = {toml.written(value) if isinstance(value, str) else repr(float(value))}"
                    for key, value in source.items()
                )
                lines.append(f"{toml.written(name)} = {{ {inside} }}")
        return "\n".join(lines) + "\n"


def mapped(
    channels: Mapping[str, str | Mapping[str, Any]] | str | Path | None,
    ignore: Iterable[str],
    dbc: str | Path | Sequence[str | Path],
) -> Mapped:
    """What the options say, and what the file says if `channels` is one; the options' DBCs come first.

    Raises
    ------
    ForkliftError
        ``"mapping-unreadable"``.
    """
    bases = [str(dbc)] if isinstance(dbc, str | Path) else [str(file) for file in dbc]
    if isinstance(channels, str | Path):
        stated = _read(Path(channels))
        return Mapped(stated.channels, [*stated.ignore, *ignore], bases or stated.dbc)
    plain = {
        name: source if isinstance(source, str) else dict(source) for name, source in (channels or {}).items()
    }
    return Mapped(plain, list(ignore), bases)


def _read(path: Path) -> Mapped:
    """The file; its DBCs stand beside it unless their paths are absolute."""
    try:
        found = toml.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise ForkliftError(
            "mapping-unreadable",
            f"{path} cannot be read as TOML ({error}); make one with forklift info FILE --write {path.name}",
            file=str(path),
        ) from error
    channels, ignore, dbc = found.get("channels", {}), found.get("ignore", []), found.get("dbc", [])
    dbc = [dbc] if isinstance(dbc, str) else dbc
    wrong = [key for key in found if key not in _KEYS]
    if not isinstance(channels, dict):
        wrong.append("channels that are no table")
    wrong += [
        f"{key} that is no list of texts"
        for key, told in (("ignore", ignore), ("dbc", dbc))
        if not isinstance(told, list) or not all(isinstance(one, str) for one in told)
    ]
    if wrong:
        raise ForkliftError(
            "mapping-unreadable",
            f"{path} holds {wrong[0]}; it may hold [channels], ignore and dbc",
            file=str(path),
        )
    return Mapped(channels, ignore, [str(path.parent / file) for file in dbc])

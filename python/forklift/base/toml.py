"""TOML as people write it: what no one would is refused at once, not after minutes."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Sequence
from typing import Any

TOMLDecodeError = tomllib.TOMLDecodeError

LARGEST = 2**20
"""Characters; thousands of recordings take fewer."""
DEEPEST = 50
"""Tables within tables, and names within a dotted key: the parser takes the square of the latter's time."""

_TEXT = re.compile(r"""\"{3}[\s\S]*?\"{3}|'{3}[\s\S]*?'{3}|"(?:\\.|[^"\\\n])*"|'[^'\n]*'|\#[^\n]*""")
_BRACKET = re.compile(r"[][{}]")
_LONG_KEY = re.compile(rf"""(?<![\w"-])(?:[\w"-]++[ \t]*+\.[ \t]*+){{{DEEPEST}}}""")


def loads(text: str) -> dict[str, Any]:
    """The document.

    Raises
    ------
    TOMLDecodeError
        If it is not TOML, or of a size or depth that no file of this program has.
    """
    if len(text) > LARGEST:
        raise TOMLDecodeError(
            f"It has {len(text)} characters, where {LARGEST} are enough (at line 1, column 1)"
        )
    bare = _TEXT.sub(lambda found: '""' + "\n" * found[0].count("\n"), text)
    if found := _LONG_KEY.search(bare):
        line = bare.count("\n", 0, found.start()) + 1
        raise TOMLDecodeError(f"A key has more than {DEEPEST} parts (at line {line}, column 1)")
    depth = 0
    for found in _BRACKET.finditer(bare):  # before the parser, which goes as deep itself
        depth += 1 if found[0] in "[{" else -1
        if depth > DEEPEST:
            line = bare.count("\n", 0, found.start()) + 1
            raise TOMLDecodeError(f"It is nested beyond reason (at line {line}, column 1)")
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise TOMLDecodeError("It is nested beyond reason (at end of document)") from None
    except TOMLDecodeError:
        raise
    except ValueError:  # a number of thousands of digits
        raise TOMLDecodeError("It holds a number that is too long (at end of document)") from None
    _check_depth(document)
    return document


def written(value: str | Sequence[str]) -> str:
    """A text, or a list of texts, as a TOML file has it: JSON, but for what TOML wants escaped too."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")


def _check_depth(document: dict[str, Any]) -> None:
    level: list[Any] = [document]
    for _ in range(DEEPEST):
        inner = (one.values() if isinstance(one, dict) else one for one in level)
        level = [value for values in inner for value in values if isinstance(value, dict | list)]
        if not level:
            return
    raise TOMLDecodeError("It is nested beyond reason (at end of document)")

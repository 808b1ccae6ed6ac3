"""What an extra of this package needs, and the command that installs it, from wherever the package came."""

from __future__ import annotations

import shlex
import sys
from importlib.metadata import PackageNotFoundError, requires


def how_to_install(extra: str, module: str) -> str:
    """A command of the running interpreter that brings an extra's libraries by their own names.

    The package's name would do from a registry only; a checkout has no such name. `module` stands where the
    package's metadata cannot be read.
    """
    try:
        every = requires("forklift") or []
    except PackageNotFoundError:
        every = []
    marks = (f"extra == '{extra}'", f'extra == "{extra}"')
    wanted = [one.partition(";")[0].strip() for one in every if one.strip().endswith(marks)]
    return shlex.join([sys.executable or "python", "-m", "pip", "install", *(wanted or [module])])

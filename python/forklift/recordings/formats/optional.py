"""Libraries that only some formats need."""

from __future__ import annotations

import importlib
from types import ModuleType

from forklift.base.extras import how_to_install
from forklift.recordings.formats.signals import Place


def require(module: str, extra: str, place: Place) -> ModuleType:
    """The library `module`, which an extra brings.

    Raises
    ------
    ForkliftError
        ``"extra-missing"``.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise place.error(
            "extra-missing",
            f"reading it needs {module}; install it with {how_to_install(extra, module)}",
            extra=extra,
            module=module,
        ) from error

"""Libraries that only some formats need."""

from __future__ import annotations

import importlib
from types import ModuleType

from forklift.recordings.formats.signals import Place


def require(module: str, extra: str, place: Place) -> ModuleType:
    """The library `module`, which ``pip install "forklift[extra]"`` brings.

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
            f'reading it needs {module}; install it with pip install "forklift[{extra}]"',
            extra=extra,
            module=module,
        ) from error

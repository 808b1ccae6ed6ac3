"""The bounds that decide answers: the upper-case numbers of the diagnosis's one module of criteria, but for
those that count something."""

from __future__ import annotations

from importlib import import_module

CRITERIA = "forklift.diagnosis.criteria"
"""The module whose upper-case numbers are the bounds."""
FITTING = "forklift.fitting.criteria"
"""Where some of them stand: fitting knows nothing of the diagnosis, which tells them as its own."""
VARIABLE = "FORKLIFT_CRITERIA"
"""In the environment of a diagnosis: bounds under another value, as a JSON object."""


def bounds() -> dict[str, float]:
    """Every bound by its name that is no whole number."""
    return {
        name: float(value)
        for name, value in vars(import_module(CRITERIA)).items()
        if name.isupper() and isinstance(value, float) and not name.startswith("_")
    }

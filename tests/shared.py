"""Where shared campaigns lie: the folder in FORKLIFT_SHARED, else ``shared`` beside the checkout."""

import os
from pathlib import Path

import pytest


def campaign(name: str) -> Path:
    """The folder of a shared campaign; skips the test if it is not there."""
    root = Path(os.environ.get("FORKLIFT_SHARED") or Path(__file__).parents[2] / "shared")
    folder = root / "campaigns" / name
    if not folder.is_dir():
        pytest.skip(f"there is no shared campaign {name}; set FORKLIFT_SHARED to the folder of shared data")
    return folder

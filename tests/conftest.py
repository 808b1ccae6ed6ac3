"""What several test modules share: results that take seconds to make."""

from pathlib import Path

import pytest

from forklift import Campaign, Truck, fit
from forklift.fit import Fit

CAMPAIGNS = Path(__file__).parent / "campaigns"
"""Campaigns that stand in the repository."""


@pytest.fixture(scope="session")
def null_fit() -> Fit:
    """The thesis's truck fitted to the campaign `null`, which it can explain."""
    return fit(Campaign.read(CAMPAIGNS / "null"), Truck.read("thesis"))

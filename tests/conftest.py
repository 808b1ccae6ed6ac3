"""What several test modules share: results that take seconds to make."""

import pytest

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, fit
from forklift.fit import Fit


@pytest.fixture(scope="session")
def null_fit() -> Fit:
    """The thesis's truck fitted to the campaign `null`, which it can explain."""
    return fit(Campaign.read(CAMPAIGNS / "null"), Truck.read("thesis"))

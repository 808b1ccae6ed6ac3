"""What several test modules share: results that take seconds to make."""

import json

import pytest
from hypothesis import settings

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, fit
from forklift.fitting.fit import Fit
from pages import Text

# How long a case takes is no test of anything on a busy machine: time goes into benches.
settings.register_profile("timeless", deadline=None)
settings.load_profile("timeless")


@pytest.fixture(scope="session")
def null_fit() -> Fit:
    """The thesis's truck fitted to the campaign `null`, which it can explain."""
    return fit(Campaign.read(CAMPAIGNS / "null"), Truck.read("thesis"))


# Of a diagnosis that a module has written into its `folder`.


@pytest.fixture(scope="module")
def told(folder):
    return json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def said(page):
    return Text(page)

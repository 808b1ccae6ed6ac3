"""A load that was weighed is known to 1 %, an empty fork's exactly; oil better if it was recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from forklift import Campaign, Truck
from forklift.plant.forklift.model import (
    ENTERED_TEMPERATURE_WIDTH_K,
    LOAD_ACCURACY,
    OWN,
    TEMPERATURE_WIDTH_K,
    Forklift,
)

NULL = Path(__file__).parent / "campaigns" / "null"


@pytest.mark.parametrize("file", ["free_prms1_0kg_20c.csv", "free_prms1_800kg_20c.csv"])
def test_each_load_has_a_width_of_its_own(file):
    recording = next(one for one in Campaign.read(NULL).recordings if one.file == file)
    truck = Truck.read("thesis")
    load = OWN.index("load")
    weighed = Forklift(truck, load_accuracy=LOAD_ACCURACY).case(recording, {})
    assert weighed.width[load] == pytest.approx(0.01 * recording.load_kg)
    assert (load in weighed.free) is bool(recording.load_kg)
    assert Forklift(truck).case(recording, {}).width[load] == 0.0
    doubted = Forklift(truck, load_width_kg=50.0, load_accuracy=LOAD_ACCURACY).case(recording, {})
    assert doubted.width[load] == 50.0


def test_an_oil_temperature_that_was_entered_is_known_worse_than_one_that_was_recorded():
    recording = Campaign.read(NULL).recordings[0]
    without = replace(
        recording,
        channels={name: one for name, one in recording.channels.items() if name != "oil_temperature_degc"},
    )
    truck, oil = Forklift(Truck.read("thesis"), oil_temperature_degc=20.0), OWN.index("oil_temperature")
    assert truck.case(recording, {}).width[oil] == TEMPERATURE_WIDTH_K
    assert truck.case(without, {}).width[oil] == ENTERED_TEMPERATURE_WIDTH_K

"""A load that was weighed is known to one per cent of it; an empty fork's exactly."""

from __future__ import annotations

from pathlib import Path

import pytest

from forklift import Campaign, Truck
from forklift.plant.forklift.model import LOAD_ACCURACY, OWN, Forklift

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

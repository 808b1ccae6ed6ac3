"""The drawing of a lift's circuit, with what an answer is about marked."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from forklift.plant.forklift.circuit import PARTS, circuit
from forklift.plant.forklift.vocabulary import EQUATIONS


def marked(svg, kind="marked"):
    groups = ElementTree.fromstring(svg).iter("g")
    return {group.find("text").text for group in groups if group.get("class") == kind}


@pytest.mark.parametrize("equation", sorted(EQUATIONS))
def test_every_equation_has_its_place_or_there_is_no_drawing(equation):
    svg = circuit({equation}, {"tank"}, "the main lift")
    if equation == "any":
        assert svg == ""
        return
    assert marked(svg) == {PARTS[equation][2]}
    assert marked(svg, "tied") == ({"tank"} if equation != "tank" else set())
    assert PARTS[equation][2] in ElementTree.fromstring(svg).get("aria-label")


def test_what_nothing_is_said_of_is_drawn_without_a_mark():
    drawn = marked(circuit({"friction"}, set(), "the free lift"), "part")
    assert {"valve", "compensator", "tank", "cylinder"} <= drawn
    assert not {"other lift", "sensor", "as entered"} & drawn

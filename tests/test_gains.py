"""A sensor's gain that the truck's own parameters make up for is found, not what a linear step promises."""

from __future__ import annotations

import tomllib

import polars as pl
import pytest

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, diagnose
from forklift.diagnosis.numbers import of_hypothesis

SCALE = 0.94
USED = ("_0kg_20c", "_1500kg_20c")


@pytest.fixture(scope="module")
def misread(tmp_path_factory):
    """The free lift's encoder counts six in a hundred too little, and nothing else tells the fork height."""
    folder, source = tmp_path_factory.mktemp("misread"), CAMPAIGNS / "null"
    head, *tables = (source / "campaign.toml").read_text(encoding="utf-8").split("[[recording]]")
    kept = [table for table in tables if any(part in table for part in USED)]
    for table in kept:
        file = tomllib.loads(table)["file"]
        recorded = pl.read_csv(source / file).drop("fork_height_m")
        recorded.with_columns(pl.col("position_free_m") * SCALE).write_csv(folder / file)
    (folder / "campaign.toml").write_text("[[recording]]".join([head, *kept]), encoding="utf-8")
    return diagnose(Campaign.read(folder), Truck.read("thesis"))


def test_an_encoder_s_scale_is_told_where_no_other_sensor_tells_the_height(misread):
    (cause,) = misread.causes
    assert (misread.verdict, cause.hypothesis.id) == ("sensor-fault", "position_scale")
    assert cause.form == "complete"
    (number,) = of_hypothesis(misread.selection.final, cause.hypothesis)
    assert number.lower <= SCALE <= number.upper
    assert number.upper - number.lower < 0.005

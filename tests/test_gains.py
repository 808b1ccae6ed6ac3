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


def _misread(folder, scale):
    """The free lift's encoder counts too little, and nothing else tells the fork height."""
    source = CAMPAIGNS / "null"
    head, *tables = (source / "campaign.toml").read_text(encoding="utf-8").split("[[recording]]")
    kept = [table for table in tables if any(part in table for part in USED)]
    for table in kept:
        file = tomllib.loads(table)["file"]
        recorded = pl.read_csv(source / file).drop("fork_height_m")
        recorded.with_columns(pl.col("position_free_m") * scale).write_csv(folder / file)
    (folder / "campaign.toml").write_text("[[recording]]".join([head, *kept]), encoding="utf-8")
    return diagnose(Campaign.read(folder), Truck.read("thesis"))


@pytest.mark.parametrize(
    ("scale", "shows"),
    [
        pytest.param(0.94, True, id="in the signals"),
        pytest.param(0.988, False, id="hardly, where a curve follows what is left"),
        pytest.param(0.99, False, id="in all recordings together, as a dead time would"),
    ],
)
def test_an_encoder_s_scale_is_told_where_no_other_sensor_tells_the_height(tmp_path, scale, shows):
    misread = _misread(tmp_path, scale)
    (cause,) = misread.causes
    assert (misread.verdict, cause.hypothesis.id) == ("sensor-fault", "position_scale")
    assert cause.form == "complete"
    (number,) = of_hypothesis(misread.selection.final, cause.hypothesis)
    assert number.lower <= scale <= number.upper
    assert number.upper - number.lower < 0.005
    assert misread.selection.baseline.quiet is not shows

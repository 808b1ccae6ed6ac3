"""What happened in one recording alone: a fault no other shows, and no machine's."""

from __future__ import annotations

from shutil import copytree

import numpy as np
import polars as pl

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, diagnose


def test_a_pressure_that_jumps_for_a_second_in_one_fitted_recording_is_told_with_its_file(tmp_path):
    folder = copytree(CAMPAIGNS / "null", tmp_path / "null")
    file = next(one.file for one in Campaign.read(folder).recordings if one.role == "estimate")
    table = pl.read_csv(folder / file)
    channel = "pressure_main_pa" if file.startswith("main") else "pressure_free_pa"
    jump = 5e5 * table["time_s"].is_between(3.0, 4.0).to_numpy()
    table.with_columns(pl.Series(channel, np.add(table[channel], jump))).write_csv(folder / file)
    found = diagnose(Campaign.read(folder), Truck.read("thesis"))
    assert found.verdict == "unknown-effect"
    assert not found.causes
    assert found.baseline.complete
    assert found.location.signal == channel
    assert file in str(found)
    assert file in found.next_why

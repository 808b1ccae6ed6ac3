"""The tutorial's motor as a machine of one's own: its Python file, and recordings in a folder."""

from pathlib import Path

import numpy as np
import polars as pl

from test_machines import tutorial


def motor_bench(folder: Path) -> Path:
    """``motor.py``, ``campaign.toml`` and CSV files, the speed in rpm under another name."""
    _, blocks = tutorial()
    names: dict[str, object] = {}
    for block in blocks[:2]:
        exec(compile(block, "machines.md", "exec"), names)
    (folder / "motor.py").write_text(f"{blocks[0]}\nmachine = plant\n", encoding="utf-8")
    campaign = ['name = "bench"', "[channels]", '"speed sensor" = { channel = "omega", unit = "rpm" }']
    for one in names["recordings"]:
        outputs = {"speed sensor": one.y["omega"] * 60.0 / (2.0 * np.pi)}
        pl.DataFrame({"time_s": one.time_s, **one.u, **outputs}).write_csv(folder / f"{one.file}.csv")
        campaign += ["[[recording]]", f'file = "{one.file}.csv"', f'role = "{one.role}"']
    (folder / "campaign.toml").write_text("\n".join(campaign), encoding="utf-8")
    return folder

"""A small campaign in every format, made on the spot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from forklift import ForkliftError

RATE_HZ = 50.0
ROWS = 60


def signals(lift: str = "free") -> dict[str, np.ndarray]:
    """One recording's columns in SI units: a staircase of current, and sensors that answer it somehow."""
    time = np.arange(ROWS) / RATE_HZ
    stairs = np.repeat([0.0, 0.5, 0.75, 0.25, 0.0], ROWS // 5)
    lowered = 0.98 - np.cumsum(stairs) / RATE_HZ
    return {
        "time_s": time,
        "current_free_a": stairs if lift == "free" else 0 * stairs,
        "current_main_a": stairs if lift == "main" else 0 * stairs,
        "position_free_m": np.floor(lowered * 500) / 500,
        "pressure_free_pa": 2.3e6 + 1e5 * np.sin(9 * time),
        "oil_temperature_degc": np.full(ROWS, 20.5),
    }


def csv_text(columns: dict[str, np.ndarray]) -> str:
    """A CSV file of columns; NaN becomes an empty cell."""
    rows = zip(*columns.values(), strict=True)
    cells = (",".join("" if np.isnan(x) else repr(float(x)) for x in row) for row in rows)
    return "\n".join([",".join(columns), *cells]) + "\n"


TOML = """\
name = "small"
sample_rate_hz = 50.0

[[recording]]
file = "free.csv"
lift = "free"
load_kg = 0.0
role = "estimate"

[[recording]]
file = "main.csv"
lift = "main"
load_kg = 800.0
role = "validate"
"""

MAPPED = """\
name = "mapped"
sample_rate_hz = 50.0

[channels]
"t" = {{ channel = "time_s" }}
"ValveCurrFL" = {{ channel = "current_free_a", scale = 0.001 }}
"ValveCurrML" = {{ channel = "current_main_a", scale = 0.001, offset = 0.0 }}
"pA" = {{ channel = "pressure_free_pa", scale = 1e5 }}

[[recording]]
file = "{file}"
lift = "free"
load_kg = 1e2
role = "estimate"
"""
"""With the names and units of `foreign`; to be formatted with the file's name."""


def foreign() -> dict[str, np.ndarray]:
    """The recording as a vehicle's logger might call and scale it."""
    own = signals()
    return {
        "t": own["time_s"],
        "ValveCurrFL": own["current_free_a"] * 1000.0,
        "ValveCurrML": own["current_main_a"] * 1000.0,
        "pA": own["pressure_free_pa"] / 1e5,
    }


def make(folder: Path) -> Path:
    """The plain campaign."""
    folder.mkdir()
    (folder / "campaign.toml").write_text(TOML)
    for lift in ("free", "main"):
        (folder / f"{lift}.csv").write_text(csv_text(signals(lift)))
    return folder


def make_mapped(folder: Path, suffix: str, columns: dict[str, np.ndarray] | None = None) -> Path:
    """One recording in another format, with ``[channels]``."""
    folder.mkdir()
    (folder / "campaign.toml").write_text(MAPPED.format(file=f"run{suffix}"))
    WRITERS[suffix](folder / f"run{suffix}", columns or foreign())
    return folder


def write_csv(path: Path, columns: dict[str, np.ndarray]) -> None:
    path.write_text(csv_text(columns))


def write_parquet(path: Path, columns: dict[str, np.ndarray]) -> None:
    import polars

    polars.DataFrame(columns).fill_nan(None).write_parquet(path)


def write_mat5(path: Path, columns: dict[str, np.ndarray]) -> None:
    from scipy.io import savemat

    savemat(path, columns | {"comment": "a letter is no signal", "sample_rate": 50.0})


def write_mat73(path: Path, columns: dict[str, np.ndarray]) -> None:
    h5py = pytest.importorskip("h5py", reason="h5py (the extra mat) is not installed")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        letters = file.create_dataset(
            "comment", data=np.frombuffer(b"abc", np.uint8).astype(np.uint16)[None, :]
        )
        letters.attrs["MATLAB_class"] = np.bytes_("char")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_mdf4(path: Path, columns: dict[str, np.ndarray]) -> None:
    asammdf = pytest.importorskip("asammdf", reason="asammdf (the extra mdf) is not installed")
    time = columns["t"]
    with asammdf.MDF(version="4.10") as mdf:
        found = [asammdf.Signal(values, time, name=name) for name, values in columns.items() if name != "t"]
        mdf.append(found, acq_name="ECU")
        mdf.save(path, overwrite=True)


WRITERS = {".csv": write_csv, ".parquet": write_parquet, ".mat": write_mat5, ".mf4": write_mdf4}


def snapshot(folder: Path) -> dict[str, bytes]:
    """Every file below `folder`, to see that nothing was written."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def raised(call, *args, **kwargs) -> ForkliftError:
    """The error that a call raises."""
    with pytest.raises(ForkliftError) as found:
        call(*args, **kwargs)
    return found.value

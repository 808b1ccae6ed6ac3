"""The rows of this package's own Rust core: a program that reads and writes the files of lowerings.h."""

import shlex
import tempfile
from pathlib import Path

import native
import numpy as np
from lowerings import Lowerings

# What to try, one row each: the label in the table, and what follows the two file names as name=value.
SETTINGS: dict[str, dict[str, float]] = {
    "f64, 2 substeps a tick": {"substeps": 2},
    "f64, 3 substeps a tick": {"substeps": 3},
    "f64, 4 substeps a tick": {"substeps": 4},
    "f64, 8 substeps a tick": {"substeps": 8},
    "8 lanes, 2 substeps a tick": {"substeps": 2, "lanes": 8},
    "8 lanes, 3 substeps a tick": {"substeps": 3, "lanes": 8},
    "8 lanes, 4 substeps a tick": {"substeps": 4, "lanes": 8},
    "16 lanes, 2 substeps a tick": {"substeps": 2, "lanes": 16},
    "16 lanes, 3 substeps a tick": {"substeps": 3, "lanes": 16},
    "16 lanes, 4 substeps a tick": {"substeps": 4, "lanes": 16},
    "adaptive, tolerance 1e-3": {"tolerance": 1e-3},
    "adaptive, tolerance 1e-4": {"tolerance": 1e-4},
    "adaptive, tolerance 1e-6": {"tolerance": 1e-6},
}


def ours(lowerings: Lowerings, setting: dict[str, float], program: str) -> tuple[np.ndarray, float]:
    """Run `program LOWERINGS TRAJECTORIES name=value ...`; x, v, p_A, p_B at each tick, and the seconds.

    The seconds are what the program itself writes: wall time of one core for the integration of all
    lowerings, without starting up and without files. `program` may carry arguments of its own.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lowerings"
        lowerings.write(path)
        return native.integrate(shlex.split(program), path, setting)

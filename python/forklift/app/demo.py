"""A demonstration without a forklift: record a truck that conceals something, and find it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from forklift import _core
from forklift.base import output
from forklift.diagnosis import files as diagnosis_files
from forklift.diagnosis.diagnose import diagnose
from forklift.diagnosis.progress import Progress
from forklift.diagnosis.result import Diagnosis
from forklift.fitting.compare import compare, result_files
from forklift.plant.forklift.commands import SAMPLE_RATE_HZ, generate
from forklift.plant.forklift.simulate import Simulation, simulate
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.truck import Truck
from forklift.recordings.campaign import FILE, Campaign
from forklift.recordings.channels import Lift

SEED = 1
SCATTER = 0.12
"""Standard deviation of the logarithm of what the thesis estimated: a truck of the same make."""

CONCEALED = {"main.leakage.coefficient": 1e-12}
"""What the recorded truck has and the thesis's has not [m³/(s Pa)]: its main lift sinks at rest."""

MARK = "truth.toml"


@dataclass(frozen=True)
class _Plan:
    lift: Lift
    kind: str
    seed: int
    load_kg: float
    oil_temperature_degc: float
    role: str

    @property
    def file(self) -> str:
        return f"{self.lift}_{self.kind}{self.seed}_{self.load_kg:g}kg_{self.oil_temperature_degc:g}c.csv"


RECORDINGS = (
    _Plan("free", "prms", 1, 0.0, 20.0, "estimate"),
    _Plan("free", "prms", 1, 1500.0, 60.0, "estimate"),
    _Plan("free", "prms", 2, 0.0, 20.0, "validate"),
    _Plan("free", "prms", 2, 1500.0, 60.0, "validate"),
    _Plan("main", "prms", 1, 0.0, 20.0, "estimate"),
    _Plan("main", "prms", 1, 1500.0, 60.0, "estimate"),
    _Plan("main", "prms", 2, 0.0, 20.0, "validate"),
    _Plan("main", "prms", 2, 1500.0, 60.0, "validate"),
)
"""What is recorded: the corners of the thesis's operating points, section 3.5."""

DURATION_S = 10.0

RESULT = frozenset(
    {MARK, f"campaign/{FILE}"}
    | {f"campaign/{plan.file}" for plan in RECORDINGS}
    | {f"compare/{file}" for file in result_files([plan.file for plan in RECORDINGS])}
    | {f"found/{file}" for file in diagnosis_files.files([plan.file for plan in RECORDINGS])}
)
"""The files of a demonstration."""


def demo(
    out: str | Path,
    *,
    seed: int = SEED,
    progress: Callable[[], None] = lambda: None,
    say: Callable[[Progress], None] | None = None,
) -> Diagnosis:
    """Make ``OUT/campaign``, compare it with the thesis's truck, and find what that truck lacks.

    ``OUT/truth.toml`` is the truck that was recorded: the thesis's with its estimated parameters scattered,
    and with `CONCEALED`. ``OUT/compare`` holds the comparison, ``OUT/found`` the diagnosis, which knows the
    recordings alone. The folder appears whole or not at all; only an earlier demonstration is replaced.

    Parameters
    ----------
    seed
        Of the truck and of the sensors' noise.
    progress
        Called twice for each of `RECORDINGS`.
    say
        Told how far the diagnosis is.

    Raises
    ------
    ForkliftError
        ``"output-exists"``, ``"not-writable"``.
    """
    thesis = Truck.read("thesis")
    truth = concealing(scattered(thesis, seed))
    with output.folder(out, RESULT, MARK) as temporary:
        truth.write(temporary / MARK)
        folder = temporary / "campaign"
        folder.mkdir()
        for stream, plan in enumerate(RECORDINGS):
            simulation = simulate(
                truth,
                generate("prms", plan.lift, duration_s=DURATION_S, seed=plan.seed),
                load_kg=plan.load_kg,
                oil_temperature_degc=plan.oil_temperature_degc,
            )
            measured(simulation, seed, stream).write_csv(folder / plan.file)
            progress()
        (folder / FILE).write_text(_campaign_toml(), encoding="utf-8", newline="\n")
        campaign = replace(Campaign.read(folder), folder=Path(out) / "campaign")
        compare(campaign, thesis, progress=lambda _: progress()).write(temporary / "compare")
        found = diagnose(campaign, thesis, progress=say)
        found.write(temporary / "found")
    return found


def concealing(truck: Truck) -> Truck:
    """The truck with what the demonstration conceals."""
    made = truck.with_values(CONCEALED, source="concealed by the demonstration")
    return Truck(truck.name, made.values, made.sources)


def scattered(truck: Truck, seed: int) -> Truck:
    """A truck whose estimated parameters are `truck`'s times a log-normal factor around 1."""
    random = np.random.default_rng(seed)
    values: dict[str, float | tuple[float, ...]] = {}
    for name, value in truck.values.items():
        spec = parameters()[name]
        factor = float(np.exp(SCATTER * random.standard_normal()))
        if name.endswith("table_area"):
            values[name] = tuple(knot * factor for knot in value)  # type: ignore[union-attr]
        elif spec["scale"] == "log" and spec["origin"] in ("steady", "prms") and isinstance(value, float):
            values[name] = min(max(value * factor, spec["lower"]), spec["upper"])
    made = truck.with_values(values, source=f"{truck.name}, scattered by {100 * SCATTER:g} %, seed {seed}")
    return Truck("demo", made.values, made.sources)


def measured(simulation: Simulation, seed: int, stream: int) -> pl.DataFrame:
    """What the truck's sensors would have recorded; `stream` tells recordings of one `seed` apart."""
    columns = {"time_s": simulation.time_s}
    driven = simulation.to_polars()
    for name in ("current_free_a", "current_main_a"):
        columns[name] = driven[name].to_numpy()
    for name in ("position_free_m", "position_main_m"):
        columns[name] = _core.encoder(simulation[name])
    for place, name in enumerate(("pressure_free_pa", "pressure_main_pa")):
        columns[name] = _core.pressure_sensor(simulation[name], seed, 10 * stream + place)
    temperature = driven["oil_temperature_degc"].to_numpy()
    columns["oil_temperature_degc"] = _core.temperature_sensor(temperature, seed, 10 * stream + 2)
    columns["fork_height_m"] = _core.height_sensor(simulation["fork_height_m"], seed, 10 * stream + 3)
    return pl.DataFrame(columns)


def _campaign_toml() -> str:
    head = f'name = "demo"\nsample_rate_hz = {SAMPLE_RATE_HZ}\n'
    entries = (
        f'\n[[recording]]\nfile = "{plan.file}"\nlift = "{plan.lift}"\n'
        f'load_kg = {plan.load_kg}\nrole = "{plan.role}"\n'
        for plan in RECORDINGS
    )
    return head + "".join(entries)

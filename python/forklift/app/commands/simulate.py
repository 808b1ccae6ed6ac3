"""`forklift simulate`: one lowering under a command."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from forklift.app.options import THESIS, Json, LiftName, Machine, TruckName, no_meaning, not_beside
from forklift.app.terminal import busy, print_json, print_tables, say_written
from forklift.base.errors import ForkliftError

if TYPE_CHECKING:
    from forklift.plant.forklift.commands import Command
    from forklift.plant.forklift.simulate import Simulation
    from forklift.plant.simulation import PlantSimulation

EXAMPLE = (
    "Example: forklift simulate --lift free --load 800 --temperature 40 --command prms --seed 1 "
    "--out lowering.csv --plot lowering.html"
)


PAGES = (".html",)
"""Suffixes of a page."""
SEED, DURATION_S = 1, 12.0
"""Of a generated command, unless told."""


class _Solver(StrEnum):
    ADAPTIVE = "adaptive"
    FIXED = "fixed"


def simulate(
    load: Annotated[float | None, typer.Option("--load", help="Of a truck: mass on the forks [kg].")] = None,
    temperature: Annotated[
        float | None, typer.Option("--temperature", help="Of a truck: oil temperature in the tank [°C].")
    ] = None,
    lift: Annotated[
        LiftName | None,
        typer.Option(
            "--lift",
            help="The lifts to simulate, and to move if the command is generated.",
            show_default=LiftName.BOTH.value,
        ),
    ] = None,
    command: Annotated[
        str,
        typer.Option(
            "--command",
            help="prms, staircase, or a CSV file with time_s, current_free_a, current_main_a; of a machine "
            "of your own, a file with its inputs.",
        ),
    ] = "prms",
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, help="Seed of a generated prms.", show_default=str(SEED))
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            help="Length of a generated command [s], an hour at most.",
            show_default=str(DURATION_S),
        ),
    ] = None,
    truck: TruckName = None,
    machine: Machine = None,
    values: Annotated[
        Path | None,
        typer.Option("--values", help="Of a machine of your own: the parameters.json of a fit or diagnosis."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Write all outputs over time: a .csv or .parquet file.")
    ] = None,
    plot: Annotated[Path | None, typer.Option("--plot", help="Write the curves as an .html page.")] = None,
    with_states: Annotated[bool, typer.Option("--states", help="Write the states too.")] = False,
    solver: Annotated[_Solver | None, typer.Option("--solver", help="Which integrator.")] = None,
    tolerance: Annotated[float | None, typer.Option("--tolerance", help="Of the adaptive solver.")] = None,
    substeps: Annotated[
        int | None, typer.Option("--substeps", help="Per sample, of the fixed solver.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Simulate one lowering under a command, from rest; or a machine of your own through its inputs."""
    from forklift.base import output
    from forklift.plant.forklift.simulate import FORMATS
    from forklift.plant.forklift.simulate import simulate as verb
    from forklift.plant.forklift.truck import Truck

    for path, suffixes in ((out, FORMATS), (plot, PAGES)):
        if path:
            output.check_file(path)
            output.check_suffix(path, suffixes)
    if machine:
        trucks = {"load": load, "temperature": temperature, "states": with_states or None, "solver": solver}
        trucks |= {"tolerance": tolerance, "substeps": substeps}
        not_beside(machine, **trucks, truck=truck, lift=lift, seed=seed, duration=duration)
    if values and not machine:
        raise ForkliftError(
            "option-not-wanted",
            f"--values {values} is of a machine of your own; name it by --machine, or leave the option out",
            name="--values",
        )
    if machine:
        _own(machine, command, values, out, plot, as_json=as_json)
        return
    if not out:
        no_meaning("without --out, to which the states would be written", states=with_states)
    if load is None or temperature is None:
        missing = "--load" if load is None else "--temperature"
        raise ForkliftError(
            "argument-missing",
            f"missing option {missing}: a truck's lowering needs a load and an oil temperature; give it, or "
            "name a machine of your own by --machine",
            name=missing,
        )
    chosen, lift = Truck.read(truck or THESIS), lift or LiftName.BOTH
    commanded = _command(command, lift.value, seed, duration)
    with busy("Simulating"):
        result = verb(
            chosen,
            commanded,
            load_kg=load,
            oil_temperature_degc=temperature,
            lifts=lift.value,
            solver=solver.value if solver else None,
            tolerance=tolerance,
            substeps=substeps,
        )
    _tell(result, [result.write(out, with_states=with_states)] if out else [], plot, as_json=as_json)


def _own(
    machine: Path, inputs: str, values: Path | None, out: Path | None, plot: Path | None, *, as_json: bool
) -> None:
    """A machine of one's own through the inputs of a file."""
    from forklift.plant import campaign, simulation

    plant = campaign.machine(machine)
    if not Path(inputs).is_file():
        raise ForkliftError(
            "file-unreadable",
            f"there is no file {inputs}; name by --command a file with the inputs of {plant.name}: "
            f"{', '.join(one.name for one in plant.inputs if one.derived is None)}",
            file=inputs,
        )
    driven = campaign.inputs(inputs, plant)
    known, effects = simulation.found(values, plant) if values else ({}, ())
    with busy("Simulating"):
        result = simulation.simulated(plant, driven, known, effects)
    _tell(result, [result.write(out)] if out else [], plot, as_json=as_json)


def _tell(
    result: Simulation | PlantSimulation, written: list[Path], plot: Path | None, *, as_json: bool
) -> None:
    from forklift.base import output, present
    from forklift.report import tables

    if plot:
        written.append(output.write_text(plot, present.page(result)))
    if as_json:
        print_json(result.to_dict() | {"written": [str(path) for path in written]})
    else:
        print_tables(tables.listed(result.listing()))
        say_written(*written)


def _command(name: str, lift: str, seed: int | None, duration: float | None) -> Command:
    from forklift.plant.forklift import commands

    if name in commands.GENERATORS:
        duration, seed = DURATION_S if duration is None else duration, SEED if seed is None else seed
        return commands.generate(name, lift, duration_s=duration, seed=seed)  # type: ignore[arg-type]
    if not Path(name).exists():
        raise ForkliftError(
            "file-unreadable",
            f"there is no command file {name}; give {' or '.join(commands.GENERATORS)} or a CSV file's path",
            file=name,
        )
    no_meaning("beside a command that is read from a file", seed=seed, duration=duration)
    return commands.Command.read(name)

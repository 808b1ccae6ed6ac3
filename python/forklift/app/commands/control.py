"""`forklift control`: simulate, compare and tune controllers, and export one as C."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from forklift.app.interruption import keeping
from forklift.app.terminal import tuning
from forklift.base import output

control = typer.Typer(
    name="control",
    help="Close the loop around a simulated truck, compare controllers, tune one, export it as C.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)

_Name = Annotated[str, typer.Argument(help="A shipped controller (thesis, today, damped, calm) or a file.")]
_Truck = Annotated[str, typer.Option(help="A shipped truck or a TOML file.")]


class _Lift(StrEnum):
    FREE = "free"
    MAIN = "main"


@control.command(epilog="Example: forklift control simulate thesis --lift free --load 800 --temperature 60")
def simulate(
    controller: _Name,
    truck: _Truck = "thesis",
    lift: Annotated[_Lift, typer.Option(help="The lift that is lowered alone.")] = _Lift.FREE,
    load: Annotated[float, typer.Option(help="Load [kg].")] = 800.0,
    temperature: Annotated[float, typer.Option(help="Oil temperature [°C].")] = 40.0,
    signal: Annotated[int, typer.Option(min=1, max=2, help="Which reference signal.")] = 1,
    delay: Annotated[int | None, typer.Option(min=0, help="From sensors to valve [ticks].")] = None,
    out: Annotated[Path | None, typer.Option(help="A CSV file for the run, a row a tick.")] = None,
) -> None:
    """Lower one lift by a controller and print how well it follows the reference."""
    from forklift.control.closed_loop import DELAY_TICKS, Lowering, lower, requests, trace
    from forklift.control.compare import summary
    from forklift.control.controller import Controller
    from forklift.plant.forklift.truck import Truck

    if out is not None:
        output.check_suffix(out, (".csv",))
        output.check_file(out)
    chosen = Controller.read(controller).only(lift.value)
    request = requests(lift.value, signal)
    ticks = DELAY_TICKS[lift.value] if delay is None else delay
    lowering = Lowering(Truck.read(truck), chosen, load, temperature, request, delay_ticks=ticks)
    run = lower([lowering], lifts=lift.value)
    typer.echo(summary(request, run, lift.value))
    if out is not None:
        output.write_file(out, lambda temporary: trace(run).write_csv(temporary))
        typer.echo(f"wrote {out}")


@control.command(epilog="Example: forklift control compare thesis today damped")
def compare(
    controllers: Annotated[list[str], typer.Argument(help="Controllers to set side by side.")],
    truck: _Truck = "thesis",
    later: Annotated[int, typer.Option(help="By how many ticks the delay is longer.")] = 0,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report.html, compare.json, compare.txt.")
    ] = None,
) -> None:
    """Set controllers side by side as Tables 5.6 and 5.7: both lifts, three loads, three temperatures, two
    signals; and the transition between the lifts."""
    from forklift.control.compare import FILES, control_comparison
    from forklift.control.controller import Controller
    from forklift.plant.forklift.truck import Truck

    if out is not None:
        output.check_folder(out, FILES, FILES[0])
    found = [Controller.read(name) for name in controllers]
    told = control_comparison(found, Truck.read(truck), later_ticks=later)
    typer.echo(str(told))
    if out is not None:
        told.write(out)
        typer.echo(f"wrote {out / 'report.html'}")


@control.command("export-c", epilog="Example: forklift control export-c thesis --out ecu")
def export_c(
    controller: _Name,
    out: Annotated[Path, typer.Option(help="The folder for the C files.")],
    word: Annotated[int | None, typer.Option(help="Word length, 16 or 32 bits.")] = None,
    ranges: Annotated[bool, typer.Option("--ranges", help="Also print the range of every variable.")] = False,
) -> None:
    """Write a controller as C99, with a self-checking test; print the ranges of its variables on demand."""
    from forklift.control.c_export import export_c as write
    from forklift.control.c_export import range_table
    from forklift.control.controller import Controller

    chosen = Controller.read(controller)
    if word is not None:
        chosen = chosen.with_word(word)
    folder = write(chosen, out)
    typer.echo(f"wrote {folder}: configuration {chosen.hash}, {chosen.word}-bit words")
    if ranges:
        typer.echo(range_table(chosen))


@control.command(
    "for-truck", epilog="Example: forklift control for-truck thesis --truck mine.toml --out mine_pid.toml"
)
def for_truck(
    controller: _Name,
    truck: Annotated[str, typer.Option(help="The truck whose tables it gets: a TOML file, as of a fit.")],
    out: Annotated[Path, typer.Option(help="The TOML file of the controller.")],
    temperature: Annotated[float, typer.Option(help="At which its tables hold [°C].")] = 40.0,
) -> None:
    """Give a controller the speed tables of a truck, and its scaling with temperature; the gains stay."""
    from forklift.control.controller import Controller
    from forklift.control.own_truck import for_truck as verb
    from forklift.plant.forklift.truck import Truck

    output.check_suffix(out, (".toml",))
    output.check_alike(out, "controller", Controller.read)
    verb(Controller.read(controller), Truck.read(truck), oil_temperature_degc=temperature).write(out)
    typer.echo(f"wrote {out}")


@control.command(epilog="Example: forklift control tune thesis --out damped.toml")
def tune(
    controller: _Name,
    out: Annotated[Path, typer.Option(help="The TOML file of the tuned controller.")],
    truck: _Truck = "thesis",
    delay: Annotated[int | None, typer.Option(min=0, help="From sensors to valve [ticks].")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the noise, the search and the trucks.")] = 1,
    name: Annotated[str | None, typer.Option(help="Its name; the file's unless told.")] = None,
    transition: Annotated[
        bool,
        typer.Option(help="Whether the transition between the lifts counts; without it lifts swing less."),
    ] = True,
    methods: Annotated[
        str, typer.Option(help="What is added to the gains: some of adaptation,shaped,swing,predictor.")
    ] = "adaptation,shaped,swing,predictor",
    start: Annotated[
        str | None, typer.Option(help="A controller with whose numbers the search begins.")
    ] = None,
) -> None:
    """Tune a controller's gains and what goes beyond them on a truck, and write it with its sources.

    It takes some minutes. After a stop the same command goes on: OUT.search keeps how far it was.
    """
    from dataclasses import replace

    from forklift.control.closed_loop import DELAY_TICKS
    from forklift.control.controller import Controller
    from forklift.control.tune import tune as tuned
    from forklift.plant.forklift.truck import Truck

    output.check_suffix(out, (".toml",))
    output.check_alike(out, "controller", Controller.read)
    delays = None if delay is None else dict.fromkeys(DELAY_TICKS, delay)
    with_ = tuple(part for part in methods.split(",") if part)
    kept = out.with_name(f"{out.name}.search")
    with tuning() as progress, keeping(kept, "the same command"):
        found = tuned(
            Controller.read(controller),
            Truck.read(truck),
            methods=with_,
            delays_ticks=delays,
            seed=seed,
            transition=transition,
            start=None if start is None else Controller.read(start),
            kept=kept,
            progress=progress,
        )
    replace(found, name=name or out.stem).write(out)
    kept.unlink(missing_ok=True)
    typer.echo(f"wrote {out}")

"""The command line: one thin function per command, which calls the verb and prints its result."""

from __future__ import annotations

import json
import os
import signal
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
import typer.core

from forklift.app.control import control
from forklift.app.terminal import (
    busy,
    counting,
    print_json,
    print_tables,
    say_written,
    searching,
    sweeping,
    telling,
)
from forklift.base.errors import ForkliftError
from forklift.recordings import units
from forklift.recordings.channels import channels as known_channels

if TYPE_CHECKING:
    from collections.abc import Iterable

    from forklift.plant.findings import Caution
    from forklift.plant.forklift.commands import Command

REFUSED = 2
"""Exit status of a mistake in the call, its files or its numbers; also of a run that failed."""
INTERRUPTED = 130
"""Exit status after Ctrl-C (128 + SIGINT)."""

_CHANNELS = tuple(known_channels())

PAGES = (".html",)
"""Suffixes of a page."""


class _Commands(typer.core.TyperGroup):
    """Ctrl-C reaches `run` as one error, before Typer makes a silent exit of it."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise ForkliftError("interrupted", "interrupted") from None


app = typer.Typer(
    cls=_Commands,
    name="forklift",
    help="Simulate a forklift's hydraulic lowering function, compare it with recordings, fit it to them, "
    "and find which physics it lacks.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


app.add_typer(control)


class _Lift(StrEnum):
    BOTH = "both"
    FREE = "free"
    MAIN = "main"


class _Role(StrEnum):
    ESTIMATE = "estimate"
    VALIDATE = "validate"


class _Solver(StrEnum):
    ADAPTIVE = "adaptive"
    FIXED = "fixed"


Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for a script.")]
TruckName = Annotated[
    str, typer.Option("--truck", help="A shipped truck's name, or the path of a truck's TOML file.")
]


def _version(asked: bool) -> None:
    if asked:
        from forklift import __version__

        typer.echo(f"forklift {__version__}")
        raise typer.Exit


@app.callback()
def _forklift(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@app.command(
    epilog="Example: forklift simulate --lift free --load 800 --temperature 40 --command prms --seed 1 "
    "--out lowering.csv --plot lowering.html"
)
def simulate(
    load: Annotated[float, typer.Option("--load", help="Mass on the forks [kg].")],
    temperature: Annotated[float, typer.Option("--temperature", help="Oil temperature in the tank [°C].")],
    lift: Annotated[
        _Lift, typer.Option("--lift", help="The lifts to simulate, and to move if the command is generated.")
    ] = _Lift.BOTH,
    command: Annotated[
        str,
        typer.Option(
            "--command",
            help="prms, staircase, or a CSV file with time_s, current_free_a, current_main_a.",
        ),
    ] = "prms",
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of a generated prms.")] = 1,
    duration: Annotated[
        float, typer.Option("--duration", help="Length of a generated command [s], an hour at most.")
    ] = 12.0,
    truck: TruckName = "thesis",
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
    """Simulate one lowering under a command, from rest."""
    from forklift.base import output
    from forklift.plant.forklift.simulate import FORMATS
    from forklift.plant.forklift.simulate import simulate as verb
    from forklift.plant.forklift.truck import Truck
    from forklift.report import tables

    for path, suffixes in ((out, FORMATS), (plot, PAGES)):
        if path:
            output.check_file(path)
            output.check_suffix(path, suffixes)
    chosen = Truck.read(truck)
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
    written = []
    if out:
        written.append(result.write(out, with_states=with_states))
    if plot:
        from forklift.report.of_simulation import simulation_page

        written.append(output.write_text(plot, simulation_page(result)))
    if as_json:
        print_json(result.to_dict() | {"written": [str(path) for path in written]})
    else:
        print_tables(tables.simulation_table(result))
        say_written(*written)


@app.command(epilog="Example: forklift compare campaign --truck thesis --out result")
def compare(
    campaign: Annotated[Path, typer.Argument(help="The campaign's folder, with its campaign.toml.")],
    truck: TruckName = "thesis",
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder to write predictions, fit.csv, compare.json and report.html to."),
    ] = None,
    temperature: Annotated[
        float | None, typer.Option("--temperature", help="Oil temperature [°C] of recordings without one.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Replay every recording of a campaign on a truck and tell how well it fits."""
    from forklift import compare as verb
    from forklift.base import output
    from forklift.base.result_files import PAGE, earlier_files
    from forklift.fitting.compare import MARK, result_files
    from forklift.plant.forklift.checks.faults import findings
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.campaign import Campaign
    from forklift.report import tables

    if out:
        output.check_folder(out, earlier_files(out, MARK, result_files), MARK)
    chosen = Truck.read(truck)
    found = Campaign.read(campaign)
    with counting("Replaying recordings", len(found.recordings)) as step:
        result = verb(found, chosen, oil_temperature_degc=temperature, progress=lambda _: step())
    if out:
        result.write(out)
    told = findings(found.recordings, chosen)
    if as_json:
        print_json(result.to_dict() | {"findings": [one.to_dict() for one in told]})
        return
    _say_findings(told)
    for sentence in result.verdict:
        typer.echo(sentence)
    print_tables(*tables.comparison_tables(result))
    if out:
        say_written(out / PAGE, out / "fit.csv", out / "predictions")


@app.command(epilog="Example: forklift fit campaign --truck thesis --out fitted")
def fit(
    campaign: Annotated[Path, typer.Argument(help="The campaign's folder, with its campaign.toml.")],
    out: Annotated[
        Path, typer.Option("--out", help="Folder to write truck.toml, report.html, fit.json and tables to.")
    ],
    truck: TruckName = "thesis",
    starts: Annotated[
        int | None,
        typer.Option("--starts", min=1, help="Searches; else one, and three if that leaves something over."),
    ] = None,
    profile: Annotated[
        list[str] | None,
        typer.Option("--profile", help="A parameter whose profile likelihood is wanted; may be repeated."),
    ] = None,
    hold: Annotated[
        list[str] | None,
        typer.Option("--hold", help="A parameter to leave as the truck has it; may be repeated."),
    ] = None,
    also: Annotated[
        list[str] | None,
        typer.Option("--also", help="A parameter to estimate besides the thesis's; may be repeated."),
    ] = None,
    together: Annotated[
        list[str] | None,
        typer.Option("--together", help="NAME,NAME,..: parameters that move together; may be repeated."),
    ] = None,
    load_width: Annotated[
        float, typer.Option("--load-width", help="Standard deviation of the entered loads [kg].")
    ] = 0.0,
    temperature: Annotated[
        float | None, typer.Option("--temperature", help="Oil temperature [°C] of recordings without one.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the scattered starts.")] = 1,
    as_json: Json = False,
) -> None:
    """Fit a truck to a campaign's estimate recordings and judge it on the others; Ctrl-C keeps the best."""
    from forklift import fit as verb
    from forklift.base import output
    from forklift.base.result_files import PAGE
    from forklift.fitting import files as fit_files
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.campaign import Campaign
    from forklift.report import tables

    output.check_folder(out, fit_files.earlier(out), fit_files.MARK)
    chosen = Truck.read(truck)
    found = Campaign.read(campaign)
    with searching() as progress:
        result = verb(
            found,
            chosen,
            hold=hold or (),
            also=also or (),
            together=[group.split(",") for group in together or ()],
            load_width_kg=load_width,
            oil_temperature_degc=temperature,
            starts=starts,
            profiles=profile or (),
            seed=seed,
            progress=progress,
        )
    result.write(out)
    if as_json:
        print_json(result.to_dict())
    else:
        for sentence in result.verdict:
            typer.echo(sentence)
        print_tables(*tables.fit_tables(result))
        say_written(*(out / name for name in (PAGE, fit_files.TRUCK, fit_files.MARK)))
    if result.interrupted:
        print(f"forklift: interrupted; the best truck so far is in {out}.", file=sys.stderr)
        raise typer.Exit(INTERRUPTED)


@app.command(epilog="Example: forklift diagnose campaign --truck thesis --out found")
def diagnose(
    campaign: Annotated[Path, typer.Argument(help="The campaign's folder, with its campaign.toml.")],
    out: Annotated[
        Path,
        typer.Option(
            "--out", help="Folder to write report.html, truck.toml, diagnosis.json and predictions to."
        ),
    ],
    truck: TruckName = "thesis",
    temperature: Annotated[
        float | None, typer.Option("--temperature", help="Oil temperature [°C] of recordings without one.")
    ] = None,
    machine: Annotated[
        Path | None,
        typer.Option(
            "--machine",
            help="Python file with a machine = Plant(...) of your own, instead of a truck.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Find where model and recordings part, name what is missing, and show what the model gains by it."""
    from forklift import diagnose as verb
    from forklift.base import output
    from forklift.base.result_files import PAGE
    from forklift.diagnosis import files as diagnosis_files
    from forklift.plant import campaign as own
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.campaign import Campaign

    output.check_folder(out, diagnosis_files.earlier(out), diagnosis_files.MARK)
    given: dict[str, Any]
    if machine is not None:
        plant = own.machine(machine)
        given = {"machine": plant, "recordings": own.read(campaign, plant), "origin": str(machine)}
    else:
        chosen, found = Truck.read(truck), Campaign.read(campaign)
        given = {"machine": chosen, "recordings": found, "oil_temperature_degc": temperature}
    with telling() as progress:
        result = verb(progress=progress, **given)
    result.write(out)
    if as_json:
        print_json(result.to_dict())
    else:
        typer.echo(str(result))
        say_written(out / PAGE, out / result.machine.file, out / diagnosis_files.MARK)


@app.command(epilog="Example: forklift prove --seed 7 --campaigns 20 --out proof --jobs 2")
def prove(
    out: Annotated[Path, typer.Option("--out", help="Folder of the proof; the same call goes on in it.")],
    seed: Annotated[
        int,
        typer.Option("--seed", min=0, help="Below 1,000,000: for development; above: to be told, used once."),
    ] = 1,
    campaigns: Annotated[int, typer.Option("--campaigns", min=1, help="How many to draw.")] = 20,
    only: Annotated[
        str | None,
        typer.Option("--only", help="Kinds or ids of what is concealed, by commas; others are skipped."),
    ] = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Campaigns side by side.")] = 1,
    keep: Annotated[bool, typer.Option("--keep", help="Keep campaigns, diagnoses and truth.")] = False,
    limit: Annotated[float, typer.Option("--limit", help="Longest time for a diagnosis [s].")] = 3600.0,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Halve and double each bound that decides an answer.")
    ] = False,
    score_open: Annotated[
        Path | None,
        typer.Option("--score-open", help="Score this folder of open campaigns instead of drawing."),
    ] = None,
    answers: Annotated[
        Path | None,
        typer.Option("--answers", help="Answer file of the open campaigns, else FOLDER/answers.json."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Prove the diagnosis on sealed campaigns of an independent plant with concealed physics."""
    from forklift.base import output
    from forklift.ensemble.proof import open as opened
    from forklift.ensemble.proof import prove as proof
    from forklift.ensemble.proof import sensitivity as bounds
    from forklift.report.of_proof import proof_page, proof_text

    def say(line: str) -> None:
        typer.echo(line, err=as_json)

    if sensitivity:
        rows = bounds.sensitivity(seed, campaigns, out, only=only, jobs=jobs, limit_s=limit, progress=say)
        print_json(rows) if as_json else say(bounds.text(rows))
        return
    if score_open:
        found = opened.score_open(score_open, out, answers=answers, only=only, limit_s=limit, progress=say)
    else:
        found = proof.prove(
            seed, campaigns, out, only=only, jobs=jobs, keep=keep, limit_s=limit, progress=say
        )
    page = output.write_text(out / proof.PAGE, proof_page(found))
    if as_json:
        print_json(found.score)
    else:
        typer.echo(proof_text(found))
        say_written(page, out / proof.SCORE)


@app.command(epilog="Example: forklift sweep examples/sweep.toml --out swept")
def sweep(
    spec: Annotated[Path, typer.Argument(help="The sweep's TOML file: what varies and what is asked.")],
    out: Annotated[
        Path,
        typer.Option(
            "--out", help="Folder for members, result.json and report.html; part of a sweep goes on."
        ),
    ],
    threads: Annotated[int, typer.Option("--threads", min=0, help="Threads; 0 takes all.")] = 0,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Address of a Dask scheduler that runs the chunks.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Lower thousands of varied trucks and tell how many fail what is asked, where, and how surely."""
    from forklift.base import output, present
    from forklift.ensemble.sweep import PAGE
    from forklift.ensemble.sweep import sweep as verb

    with sweeping() as progress:
        result = verb(spec, out=out, threads=threads, scheduler=scheduler, progress=progress)
    output.write_text(out / PAGE, present.page(result))
    if as_json:
        print_json(result.to_dict())
        return
    typer.echo(str(result))
    say_written(out / PAGE, out / "result.json", out / "members")


@app.command(epilog="Example: forklift replay swept 4711 --out member.csv")
def replay(
    folder: Annotated[Path, typer.Argument(help="A sweep's folder.")],
    member: Annotated[int, typer.Argument(min=0, help="The member's index.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Write its trajectory: a .csv or .parquet file.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run one member of a sweep again, to the bit, and show what it does."""
    from forklift.base import output
    from forklift.ensemble.sweep import of_folder
    from forklift.ensemble.sweep import replay as verb

    if out:
        output.check_file(out)
        output.check_suffix(out, (".csv", ".parquet"))
    found = verb(*of_folder(folder), member)
    if out:
        found.write(out)
    if as_json:
        print_json(found.to_dict())
        return
    typer.echo(str(found))
    if out:
        say_written(out)


@app.command(epilog="Example: forklift info thesis")
def info(
    what: Annotated[
        str | None,
        typer.Argument(help="A campaign's folder, a log, a shipped truck's name or a truck's file."),
    ] = None,
    dbc: Annotated[
        list[Path] | None, typer.Option("--dbc", help="What the frames of a CAN log hold; may be repeated.")
    ] = None,
    write: Annotated[
        Path | None, typer.Option("--write", help="Write the proposed [channels] to a .toml file.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Tell what a campaign, a log or a truck holds; of nothing: version, trucks, effects and parameters.

    Of a log: every signal with its clock, unit, range and course, and the [channels] it proposes.
    """
    from forklift.recordings.formats import SUFFIXES
    from forklift.report import tables

    if what is None:
        print_json(_about()) if as_json else _print_about()
    elif Path(what).is_dir() or Path(what).name == "campaign.toml":
        from forklift.recordings.campaign import Campaign

        campaign = Campaign.read(what)
        print_json(campaign.to_dict()) if as_json else print_tables(tables.campaign_table(campaign))
    elif Path(what).suffix.lower() in SUFFIXES:
        from forklift.base import output
        from forklift.recordings.inspect import inspect

        if write:
            output.check_file(write)
            output.check_suffix(write, (".toml",))
        log = inspect(what, dbc=dbc or ())
        head = f"dbc = {json.dumps([os.path.abspath(one) for one in dbc])}\n\n" if dbc else ""
        if write:
            output.write_text(write, head + log.mapping())
        if as_json:
            print_json(log.to_dict() | {"written": [str(write)] if write else []})
            return
        print_tables(tables.log_table(log))
        typer.echo(log.mapping())
        if write:
            say_written(write)
    else:
        from forklift.plant.forklift.truck import Truck

        truck = Truck.read(what)
        print_json(truck.to_dict()) if as_json else print_tables(tables.truck_table(truck))


@app.command(
    epilog="Example: forklift convert free_800kg.mf4 main_800kg.mf4 --channels channels.toml --out campaign. "
    "The channels a recording may hold: " + ", ".join(_CHANNELS)
)
def convert(
    source: Annotated[
        list[Path],
        typer.Argument(help="A campaign, or recordings: .mf4, .mat, .parquet, .csv; CAN: .blf, .asc, .mf4."),
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder of the plain campaign to write.")],
    lift: Annotated[_Lift | None, typer.Option("--lift", help="Which valves were commanded.")] = None,
    load: Annotated[float | None, typer.Option("--load", help="Mass on the forks [kg].")] = None,
    role: Annotated[
        _Role | None, typer.Option("--role", help="May it be fitted on, or only judged on?")
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="Of the campaign; else the folder's.")] = None,
    rate: Annotated[
        float | None, typer.Option("--rate", help="Sample rate to bring everything to [Hz].")
    ] = None,
    channel: Annotated[
        list[str] | None,
        typer.Option(
            "--channel",
            help="NAME=CHANNEL, NAME=CHANNEL,UNIT or NAME=CHANNEL,SCALE,OFFSET: what a signal is; may be "
            "repeated.",
        ),
    ] = None,
    channels: Annotated[
        Path | None,
        typer.Option("--channels", help="A TOML file with [channels], as info FILE --write makes it."),
    ] = None,
    propose: Annotated[
        bool, typer.Option("--propose", help="Map the signals as info FILE proposes it.")
    ] = False,
    dbc: Annotated[
        list[Path] | None, typer.Option("--dbc", help="What the frames of a CAN log hold; may be repeated.")
    ] = None,
    table: Annotated[
        Path | None, typer.Option("--table", help="A CSV file with the columns file, lift, load_kg, role.")
    ] = None,
    cut: Annotated[bool, typer.Option("--cut", help="Cut each file into its lowerings.")] = False,
    extend: Annotated[bool, typer.Option("--extend", help="Add to the campaign that stands there.")] = False,
    ignore: Annotated[
        list[str] | None, typer.Option("--ignore", help="A column to pass over; may be repeated.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier campaign.")] = False,
    truck: TruckName = "thesis",
    as_json: Json = False,
) -> None:
    """Turn recordings of any format and unit into a campaign of CSV files in SI units.

    Lift and load come from the options, else from the table, else from each file's name (free_800kg.mf4),
    else they are asked for.
    """
    from forklift import convert as verb
    from forklift.plant.forklift.checks.faults import findings
    from forklift.plant.forklift.truck import Truck
    from forklift.report import tables

    def ask(file: str, what: str) -> Any:
        if what == "lift":
            return typer.prompt(f"{file}: which lift was commanded (free, main or both)?", err=True)
        return typer.prompt(f"{file}: how many kilograms were on the forks?", type=float, err=True)

    with busy("Reading and checking"):
        campaign = verb(
            source if len(source) > 1 else source[0],
            out,
            lift=lift.value if lift else None,
            load_kg=load,
            role=role.value if role else None,
            name=name,
            sample_rate_hz=rate,
            channels=dict(map(_mapping, channel)) if channel else channels,
            ignore=ignore or (),
            dbc=dbc or (),
            table=table,
            cut=cut,
            propose=propose,
            extend=extend,
            ask=ask if sys.stdin.isatty() and sys.stderr.isatty() else None,
            overwrite=overwrite,
        )
        found = findings(campaign.recordings, Truck.read(truck))
    if as_json:
        print_json(campaign.to_dict() | {"findings": [one.to_dict() for one in found]})
    else:
        _say_findings(found)
        print_tables(tables.campaign_table(campaign))
        say_written(out)


_truck = typer.Typer(no_args_is_help=True, help="Make a truck of your own.")
app.add_typer(_truck, name="truck")


@_truck.command(
    name="new",
    epilog='Example: forklift truck new mine --set "free.bore=55 mm # data sheet" '
    '--set "free.mass.moving=310 kg" '
    "--out mine.toml",
)
def truck_new(
    name: Annotated[str, typer.Argument(help="The truck's name.")],
    out: Annotated[Path, typer.Option("--out", help="The .toml file to write.")],
    told: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="PARAMETER=VALUE UNIT # SOURCE, as forklift info lists the parameters; LIFT.bore and "
            "LIFT.cylinders stand for the area, LIFT.valve.points=0.36:0,0.5:2e-6 for the area table; may be "
            "repeated.",
        ),
    ] = None,
    base: Annotated[
        str, typer.Option("--from", help="The truck that everything else is taken from.")
    ] = "thesis",
    as_json: Json = False,
) -> None:
    """Write the file of a truck of your own: what you know of it, over another truck for the rest.

    In a terminal it asks for what a data sheet tells and no option told.
    """
    from forklift.base import output
    from forklift.plant.forklift.new_truck import ASKED, new_truck, still_of
    from forklift.plant.forklift.tables import parameters
    from forklift.plant.forklift.truck import Truck

    output.check_file(out)
    output.check_suffix(out, (".toml",))
    start = Truck.read(base)
    known: dict[str, str] = {}
    for text in told or ():
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise ForkliftError(
                "argument-invalid",
                f"--set {text!r} is not PARAMETER=VALUE; write it like free.mass.moving=310 kg",
                name="set",
                value=text,
            )
        known[key.strip()] = value.strip()
    if sys.stdin.isatty() and sys.stderr.isatty():
        for key in (f"{lift}.{one}" for lift in ("free", "main") for one in ASKED):
            if key in known or (key.endswith(".area") and f"{key.split('.')[0]}.bore" in known):
                continue
            spec = parameters()[key]
            value = typer.prompt(
                f"{key}: {spec['meaning']} [{spec['unit']}], # and its source; empty: as {start.name}",
                default="", show_default=False, err=True,
            )  # fmt: skip
            if value.strip():
                known[key] = value
    made = new_truck(name, known, start)
    written = made.write(out)
    left = still_of(made, start)
    if as_json:
        print_json(made.to_dict() | {"written": [str(written)], "as_before": left})
        return
    if left:
        typer.echo(f"As {start.name}, though a data sheet would tell them: {', '.join(left)}.")
    say_written(written)


@app.command(epilog="Example: forklift demo demo")
def demo(
    out: Annotated[
        Path, typer.Argument(help="A new folder, or an earlier demonstration, which is replaced.")
    ] = Path("demo"),
    as_json: Json = False,
) -> None:
    """Record a truck that conceals something, and find it: locate, name, model, improve."""
    from forklift.app.demo import RECORDINGS
    from forklift.app.demo import demo as verb

    with counting("Recording and replaying", 2 * len(RECORDINGS)) as step, telling() as told:
        found = verb(out, progress=step, say=told)
    if as_json:
        print_json(found.to_dict())
        return
    campaign, page = out / "campaign", out / "compare" / "report.html"
    truth = out / "truth.toml"
    typer.echo(f"{campaign} holds {len(RECORDINGS)} recordings of a simulated truck, {truth}.")
    typer.echo(f"How far the thesis's truck is from them: look at {page} in a browser.")
    typer.echo("")
    typer.echo(str(found))
    typer.echo("")
    typer.echo(
        f"All of it is in {out / 'found'}: look at {out / 'found' / 'report.html'}; "
        f"{out / 'found' / 'truck.toml'} is the truck with what was found."
    )
    typer.echo(f"The same again: forklift diagnose {campaign} --truck thesis --out {out / 'found'}")


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 2 refused with one sentence, 130 interrupted."""
    signal.signal(signal.SIGTERM, _terminated)
    sys.exit(run(arguments))


def _terminated(number: int, _: object) -> None:
    """Leave as an exception does, so that nothing half-written stays behind."""
    sys.exit(128 + number)


def run(arguments: list[str] | None = None) -> int:
    """Run the command line and give its exit status; never a traceback."""
    try:
        status = app(arguments, prog_name="forklift", standalone_mode=False)
    except KeyboardInterrupt:
        return _interrupted()
    except ForkliftError as error:
        if error.code != "interrupted":
            return _refuse(error.message)
        return _interrupted()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if type(error).__name__ == "Abort":
            return _interrupted()
        if explain := getattr(error, "format_message", None):
            if not explain():  # the help that a call without arguments gets
                return REFUSED
            return _refuse(f"{explain().rstrip('.')}; `{_help_for(error)} --help` tells how")
        return _refuse(_unforeseen(error))
    return status if isinstance(status, int) else 0


def _interrupted() -> int:
    print("forklift: interrupted; nothing was left half-written.", file=sys.stderr)
    return INTERRUPTED


def _refuse(message: str) -> int:
    sentence = " ".join(message.split())
    print(f"forklift: {sentence}{'' if sentence.endswith(('.', '?')) else '.'}", file=sys.stderr)
    return REFUSED


def _help_for(error: Exception) -> str:
    context = getattr(error, "ctx", None)
    return context.command_path if context else "forklift"


def _unforeseen(error: Exception) -> str:
    if os.environ.get("FORKLIFT_TRACEBACK"):
        import traceback

        traceback.print_exception(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory; ask for a shorter run or fewer recordings"
    if isinstance(error, OSError):
        return f"{error.filename or 'a file'}: {(error.strerror or str(error)).lower()}"
    return (
        f"a mistake in forklift itself ({type(error).__name__}: {error}); "
        "set FORKLIFT_TRACEBACK=1, run it again and report what it prints"
    )


def _command(name: str, lift: str, seed: int, duration: float) -> Command:
    from forklift.plant.forklift import commands

    if name in commands.GENERATORS:
        return commands.generate(name, lift, duration_s=duration, seed=seed)  # type: ignore[arg-type]
    if not Path(name).exists():
        raise ForkliftError(
            "file-unreadable",
            f"there is no command file {name}; give {' or '.join(commands.GENERATORS)} or a CSV file's path",
            file=name,
        )
    return commands.Command.read(name)


def _say_findings(found: Iterable[Caution]) -> None:
    """What is wrong with recordings, a line each, before all that is made of them."""
    for one in found:
        typer.echo(f"Check [{one.code}]: {one.sentence}.")


def _mapping(text: str) -> tuple[str, dict[str, str | float]]:
    """``ValveCurrFL=current_free_a,0.001,0`` or ``pA=pressure_free_pa,bar`` as an entry of ``[channels]``."""
    name, equals, rest = text.partition("=")
    channel, *numbers = rest.split(",")
    if name and channel and len(numbers) == 1 and units.known(numbers[0]):
        return name, {"channel": channel, "unit": numbers[0]}
    try:
        scaled: dict[str, str | float] = dict(zip(("scale", "offset"), map(float, numbers), strict=False))
        if not (equals and name and channel) or len(numbers) > len(scaled):
            raise ValueError
    except ValueError:
        raise ForkliftError(
            "argument-invalid",
            f"--channel {text!r} is not NAME=CHANNEL,SCALE,OFFSET; "
            "write it like ValveCurrFL=current_free_a,0.001",
            name="channel",
            value=text,
        ) from None
    return name, {"channel": channel, **scaled}


def _about() -> dict[str, Any]:
    from forklift import __version__, _core
    from forklift.plant.forklift import tables as names
    from forklift.plant.forklift.truck import shipped

    return {
        "version": __version__,
        "trucks": list(shipped()),
        "effects": _core.effect_table(),
        "parameters": _core.parameter_table(),
        "states": list(names.states().values()),
        "outputs": list(names.outputs().values()),
        "channels": list(known_channels().values()),
    }


def _print_about() -> None:
    from forklift import __version__
    from forklift.plant.forklift.truck import shipped
    from forklift.report import tables

    typer.echo(f"forklift {__version__}; trucks that ship with it: {', '.join(shipped())}")
    print_tables(tables.effect_table(), tables.parameter_table())


if __name__ == "__main__":
    main()

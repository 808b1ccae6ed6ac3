"""`forklift convert`: recordings of any format into a campaign."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from forklift.app.options import THESIS, Json, LiftName, TruckName
from forklift.app.terminal import busy, print_json, print_tables, say_findings, say_written
from forklift.base.errors import ForkliftError
from forklift.recordings import units
from forklift.recordings.channels import channels as known_channels

EXAMPLE = (
    "Example: forklift convert free_800kg.mf4 main_800kg.mf4 --channels channels.toml --out campaign. "
    "The channels a recording may hold: " + ", ".join(known_channels())
)


class _Role(StrEnum):
    ESTIMATE = "estimate"
    VALIDATE = "validate"


def convert(
    source: Annotated[
        list[Path],
        typer.Argument(help="A campaign, or recordings: .mf4, .mat, .parquet, .csv; CAN: .blf, .asc, .mf4."),
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder of the plain campaign to write.")],
    lift: Annotated[LiftName | None, typer.Option("--lift", help="Which valves were commanded.")] = None,
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
    truck: TruckName = None,
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

    if channel and channels:
        raise ForkliftError(
            "option-not-wanted",
            f"--channel and --channels {channels} both map names; give one of them",
            name="channel",
        )
    compared = Truck.read(truck or THESIS)
    with busy("Reading and checking") as silent:

        def ask(file: str, what: str) -> Any:
            with silent():
                if what == "lift":
                    return typer.prompt(f"{file}: which lift was commanded (free, main or both)?", err=True)
                return typer.prompt(f"{file}: how many kilograms were on the forks?", type=float, err=True)

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
        found = findings(campaign.recordings, compared)
    if as_json:
        print_json(campaign.to_dict() | {"findings": [one.to_dict() for one in found]})
    else:
        say_findings(found)
        print_tables(tables.campaign_table(campaign))
        say_written(out)


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

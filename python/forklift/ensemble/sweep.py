"""The verb `sweep`: many closed-loop lowerings, how many of them fail, which, and how surely."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from forklift import __version__
from forklift.base import output
from forklift.base.alone import LOCK, alone_in
from forklift.base.errors import ForkliftError
from forklift.base.numbers import all_defined
from forklift.base.result_files import PAGE, json_rows
from forklift.control.controller import Controller
from forklift.ensemble import chunks, specification
from forklift.ensemble.controllers import of_data, to_data
from forklift.ensemble.intervals import ConfidenceSequence, Interval, clopper_pearson, over_scrambles
from forklift.ensemble.members import Members
from forklift.ensemble.quantities import units
from forklift.ensemble.reduce import STABLE, Tally, axis
from forklift.ensemble.specification import Specification
from forklift.ensemble.trajectory import Trajectory, trajectory
from forklift.plant.forklift.truck import Truck

if TYPE_CHECKING:
    import xarray as xr

MARK = "sweep.json"
"""The file that makes a folder a sweep's."""
RESULT = "result.json"
FILES = (MARK, RESULT, PAGE, LOCK)


@dataclass(frozen=True)
class Progress:
    """How far a sweep is.

    Attributes
    ----------
    done, members
        Members so far, and all.
    failures
        Of those so far.
    rate
        Members a second, of those that this run made; 0 before the first.
    interval
        Of the failure probability, where it may be looked at at any time.
    """

    done: int
    members: int
    failures: int
    rate: float
    interval: Interval | None


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """What `sweep` gives.

    Attributes
    ----------
    tally
        Counts, map and worst members.
    probability
        Of a member failing; None where the sampling has no interval (a grid).
    folder
        Where the members lie; None if they were not kept.
    seconds, made
        How long it took, and how many members this run made; the others were there already.
    """

    specification: Specification
    truck: Truck
    controller: Controller | None
    tally: Tally
    probability: Interval | None
    folder: Path | None
    seconds: float
    made: int
    kept: tuple[pl.DataFrame, ...] = field(default=(), repr=False)

    @property
    def verdict(self) -> str:
        """The one sentence."""
        tally = self.tally
        name, count = tally.specification.name, tally.members
        if tally.failures == 0:
            said = f"None of {count} members of {name!r} fails a requirement"
        else:
            worst = max((v for v in tally.verdicts if v != STABLE), key=lambda v: tally.verdicts[v])
            said = (
                f"{tally.failures} of {count} members of {name!r} fail ({100 * tally.failures / count:.3g} "
                f"%), "
                f"most often by {worst.replace('_', ' ')} ({tally.verdicts[worst]})"
            )
        if self.probability is None:
            return f"{said}; a grid has no probability."
        low, high = 100 * self.probability.lower, 100 * self.probability.upper
        return (
            f"{said}; the probability of a failure lies between {low:.3g} % and {high:.3g} % "
            f"({100 * self.probability.level:g} % interval, {self.probability.method})."
        )

    @property
    def worst(self) -> pl.DataFrame:
        """The members with the least scaled margins, the worst first; ``least_scaled_margin`` ranks them."""
        assert self.tally.worst is not None
        return self.tally.worst

    def members(self) -> Iterator[pl.DataFrame]:
        """All members, chunk by chunk in order."""
        if self.folder is None:
            yield from self.kept
            return
        found = Members(self.specification, self.truck, self.controller)
        for chunk in range(found.chunks):
            yield chunks.load(self.folder, chunk)

    def to_polars(self) -> pl.DataFrame:
        """All members, a row each: index, what varied, verdict, margins, measures."""
        return pl.concat(list(self.members()))

    def to_xarray(self) -> xr.Dataset:
        """All members over the dimension ``member``, with units."""
        import xarray as xr

        table, known = self.to_polars(), units(self.specification, controlled=self.controller is not None)
        data = {
            name: (
                "member",
                table[name].cast(pl.String).to_numpy() if name == "verdict" else table[name].to_numpy(),
                {"units": known[name]} if name in known else {},
            )
            for name in table.columns
            if name != "index"
        }
        return xr.Dataset(data, {"member": table["index"].to_numpy()}, {"name": self.specification.name})

    def replay(self, index: int) -> Trajectory:
        """One member again, with its trajectory; its numbers have the bits they had in the sweep."""
        return replay(self.specification, self.truck, self.controller, index)

    def to_dict(self) -> dict[str, Any]:
        """The result without its members, for JSON."""
        tally = self.tally
        return {
            "schema": 1,
            "name": self.specification.name,
            "specification": self.specification.model_dump(mode="json"),
            "specification_sha256": self.specification.sha256,
            "truck": {"name": self.truck.name, "sha256": self.truck.sha256},
            "controller": self.controller and {"name": self.controller.name, "hash": self.controller.hash},
            "members": tally.members,
            "failures": tally.failures,
            "verdict": self.verdict,
            "verdicts": dict(tally.verdicts),
            "requirements": [
                {
                    "name": require.name,
                    "formula": require.formula,
                    "broken": tally.broken[require.name],
                    "never_asked": tally.unasked[require.name],
                }
                for require in self.specification.require
            ],
            "probability": self.probability.to_dict() if self.probability else None,
            "map": {
                "axes": [{"name": axis.name, "edges": axis.edges.tolist()} for axis in tally.axes],
                "members": tally.seen.tolist(),
                "failures": tally.failed.tolist(),
                "least_scaled_margin": all_defined(tally.least.tolist()),
            },
            "worst": json_rows(self.worst),
        }

    def write(self, path: str | Path) -> Path:
        """All members as one ``.parquet`` or ``.csv`` file."""
        return output.write_table(path, self.to_polars())

    def __repr__(self) -> str:
        name, tally = self.specification.name, self.tally
        return f"Sweep({name!r}, {tally.members} members, {tally.failures} failures)"

    def __str__(self) -> str:
        rows = [f"{name:>22} {count:>10d}" for name, count in self.tally.verdicts.items() if count]
        return "\n".join([self.verdict, *rows])


def sweep(
    given: Specification | Mapping[str, Any] | str | Path,
    *,
    truck: Truck | None = None,
    controller: Controller | None = None,
    out: str | Path | None = None,
    threads: int = 0,
    scheduler: str | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Sweep:
    """Run every member of a sweep, or those that a run broken off had not.

    Parameters
    ----------
    given
        A specification, its content as a mapping, or the path of its TOML file.
    truck, controller
        In the place of those that the specification names.
    out
        A folder to keep the members in, one file a chunk. If it holds a part of the same sweep, only what is
        missing is run.
    threads
        Of this machine; 0 takes all. No bit depends on it.
    scheduler
        The address of a Dask scheduler that runs the chunks instead; needs `out`, and the extra ``cluster``.

    Raises
    ------
    ForkliftError
        ``"output-exists"`` if `out` holds something else, ``"folder-in-use"`` if another call still writes
        to it, ``"value-invalid"``, ``"argument-invalid"``, and those of `specification.read` and of
        `Truck.read`.
    """
    members = Members.of(given, truck, controller, threads)
    spec, truck, controller = members.specification, members.truck, members.controller
    total = members.count
    _ = members.core  # first: it refuses what can have no map
    tally = begun(members)
    if scheduler is not None and out is None:
        raise ForkliftError("argument-invalid", "a sweep on a scheduler needs a folder; give out", name="out")
    elsewhere = _elsewhere(members, scheduler)  # before anything is written: it may not answer
    sequence = ConfidenceSequence(total) if spec.sampling == "independent" else None
    kept: list[pl.DataFrame] = []
    clock, made = time.perf_counter(), 0
    with _kept_in(Path(out), members) if out is not None else nullcontext() as folder:
        for table, new in chunks.all_of(members, folder, elsewhere=elsewhere):
            before = tally.failures
            tally.add(table)
            made += len(table) * new
            if folder is None:
                kept.append(table)
            now = sequence.add(tally.failures - before, len(table)) if sequence else None
            if progress:
                spent = time.perf_counter() - clock
                progress(Progress(tally.members, total, tally.failures, made / spent if spent else 0.0, now))
        seconds = time.perf_counter() - clock
        found = Sweep(spec, truck, controller, tally, probability(tally), folder, seconds, made, tuple(kept))
        if folder is not None:
            text = json.dumps(found.to_dict(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
            output.write_text(folder / RESULT, text)
    return found


def begun(members: Members) -> Tally:
    """A tally that has seen nothing yet."""
    spec = members.specification
    varied = [members._varied(name, vary) for name, vary in spec.vary.items()]
    axes = tuple(axis(*one) for one in varied[:2])
    scramble = members.count // spec.scrambles if spec.sampling == "sobol" else 0
    return Tally(spec, axes, scramble)


def probability(tally: Tally) -> Interval | None:
    """Of a failure, by the interval that the sampling allows."""
    sampling = tally.specification.sampling
    if sampling == "grid":
        return None
    if sampling == "sobol":
        return over_scrambles([count / tally.scramble for _, count in sorted(tally.shares.items())])
    return clopper_pearson(tally.failures, tally.members)


def replay(spec: Specification, truck: Truck, controller: Controller | None, index: int) -> Trajectory:
    """One member of a sweep by itself, with its trajectory.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for a member that the sweep does not have.
    """
    members = Members(spec, truck, controller, 1)
    if not 0 <= index < members.count:
        raise ForkliftError(
            "argument-invalid",
            f"there is no member {index}; this sweep has members 0 to {members.count - 1}",
            name="member",
            value=index,
        )
    values, streams = members.draw(index, index + 1)
    return trajectory(members, values[0], int(streams[0]), index)


def of_folder(folder: str | Path) -> tuple[Specification, Truck, Controller | None]:
    """The sweep that a folder holds.

    Raises
    ------
    ForkliftError
        ``"file-unreadable"``.
    """
    path = Path(folder) / MARK
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        spec = specification.check(document["specification"], str(path))
        values = {name: _tupled(value) for name, value in document["truck"]["values"].items()}
        controller = of_data(document["controller"]) if document["controller"] else None
        return spec, Truck(document["truck"]["name"], values), controller
    except (OSError, ValueError, KeyError, TypeError):
        raise ForkliftError(
            "file-unreadable",
            f"{folder} holds no sweep ({MARK} cannot be read); name a sweep's folder",
            file=str(path),
        ) from None


@contextmanager
def _kept_in(folder: Path, members: Members) -> Iterator[Path]:
    """`folder`, this call's alone: it holds this sweep as far as it was run, or nothing."""
    spec, truck = members.specification, members.truck
    document = {
        "version": __version__,
        "specification": spec.model_dump(mode="json"),
        "specification_sha256": spec.sha256,
        "controller": members.controller and to_data(members.controller),
        "truck": {
            "name": truck.name,
            "sha256": truck.sha256,
            "values": {name: list(v) if isinstance(v, tuple) else v for name, v in truck.values.items()},
        },
    }
    known = {*FILES, *(f"{chunks.FOLDER}/{chunks.path(folder, k).name}" for k in range(members.chunks))}
    if not (folder / MARK).is_file():
        folder = output.check_standing(folder, known, MARK, (LOCK,))
        with output.writing(folder):
            folder.mkdir(exist_ok=True)
    else:
        _check_same(folder, document)
    with alone_in(folder):
        if (folder / MARK).is_file():
            _check_same(folder, document)
        else:
            output.write_text(folder / MARK, json.dumps(document, indent=1, ensure_ascii=False) + "\n")
        yield folder


def _check_same(folder: Path, document: Mapping[str, Any]) -> None:
    try:
        earlier = json.loads((folder / MARK).read_text(encoding="utf-8"))
        same = all(earlier[key] == document[key] for key in ("version", "specification_sha256", "controller"))
        same = same and earlier["truck"]["sha256"] == document["truck"]["sha256"]
    except (ValueError, KeyError, TypeError):
        same = False
    if not same:
        raise ForkliftError(
            "output-exists",
            f"{folder} holds another sweep, truck or controller, or one that another version of forklift "
            "began; name a folder that does not exist yet",
            file=str(folder),
        )


def _elsewhere(members: Members, scheduler: str | None) -> Callable[..., Any] | None:
    """What makes chunks on a cluster; None if this machine does."""
    if scheduler is None:
        return None
    from forklift.ensemble.cluster import runner

    return runner(members, scheduler)


def _tupled(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value

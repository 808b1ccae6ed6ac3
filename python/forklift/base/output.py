"""Results appear whole or not at all: written beside their place, then renamed into it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from forklift.base.errors import ForkliftError

if TYPE_CHECKING:
    import polars as pl

CAMPAIGN = "campaign.toml"
"""The file that lists a campaign's recordings; nothing of them is ever replaced by a single result."""


def write_file(path: str | Path, write: Callable[[Path], None]) -> Path:
    """Let `write` fill a temporary sibling of `path`, then rename it to `path`.

    An earlier file of that name is replaced; if anything fails, or Ctrl-C is pressed, it stays as it was.

    Raises
    ------
    ForkliftError
        ``"not-writable"`` if the folder does not exist or cannot be written.
    """
    path = check_file(path)
    temporary = _beside(path)
    try:
        with writing(path):
            write(temporary)
            os.replace(temporary, path)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
    return path


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """What the system says against writing `path`, as an error of this package.

    Raises
    ------
    ForkliftError
        ``"not-writable"``.
    """
    try:
        yield
    except OSError as error:
        raise _not_writable(path, error) from None


def check_file(path: str | Path) -> Path:
    """`path` if a file may be written there, over an earlier one or anew, but for a part of a campaign.

    Raises
    ------
    ForkliftError
        ``"not-writable"``; ``"output-exists"`` for a ``campaign.toml`` and the recordings that it lists.
    """
    path = _named(path)
    try:
        _must_be_folder(path.parent)
        if path.is_dir():
            raise ForkliftError(
                "not-writable", f"{path} is a folder; give the name of a file to write", file=str(path)
            )
        if path.is_file() and (campaign := _campaign_of(path)):
            raise ForkliftError(
                "output-exists",
                f"{path} belongs to the campaign in {campaign}, so it is left alone; name another file",
                file=str(path),
            )
    except OSError as error:  # a name too long, say
        raise _not_writable(path, error) from None
    return path


def _campaign_of(path: Path) -> Path | None:
    """The folder of the campaign that a file is a part of: its list, or what that lists."""
    for folder in path.absolute().parents[:3]:
        listed = folder / CAMPAIGN
        if not listed.is_file():
            continue
        name = path.absolute().relative_to(folder).as_posix()
        text = listed.read_text(encoding="utf-8", errors="replace")
        if name == CAMPAIGN or any(f"{mark}{name}{mark}" in text for mark in ('"', "'")):
            return folder
    return None


def check_alike(path: str | Path, what: str, read: Callable[[Path], object]) -> Path:
    """`path` as `check_file` has it, if nothing stands there or what `read` reads: `what` would be written.

    Raises
    ------
    ForkliftError
        ``"output-exists"`` for anything else; those of `check_file`.
    """
    path = check_file(path)
    if path.exists():
        try:
            read(path)
        except ForkliftError:
            raise ForkliftError(
                "output-exists",
                f"{path} is no {what}, so it is left alone; name another file for the {what}",
                file=str(path),
            ) from None
    return path


def check_suffix(path: str | Path, suffixes: Collection[str]) -> None:
    """`path` ends with one of `suffixes`, in any case.

    Raises
    ------
    ForkliftError
        ``"format-unknown"``.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in suffixes:
        raise ForkliftError(
            "format-unknown",
            f"{path} ends with {suffix or 'no suffix'}; this is written as {' or '.join(suffixes)}",
            file=str(path),
        )


def write_text(path: str | Path, text: str) -> Path:
    """`text` as the whole UTF-8 file `path`, see `write_file`."""
    return write_file(path, lambda temporary: _write_text(temporary, text))


def write_table(path: str | Path, table: pl.DataFrame) -> Path:
    """`table` as the whole ``.csv`` or ``.parquet`` file `path`, see `write_file`.

    Raises
    ------
    ForkliftError
        ``"format-unknown"`` for another suffix, ``"not-writable"``.
    """
    check_suffix(path, (".csv", ".parquet"))
    put = table.write_csv if Path(path).suffix.lower() == ".csv" else table.write_parquet
    return write_file(path, lambda temporary: put(temporary))


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def check_folder(
    path: str | Path, known: Collection[str], mark: str, unfinished: Collection[str] = ()
) -> Path:
    """`path`, absolute, if `folder` can write a result there: see `check_standing`.

    The temporary folder is made and removed again, so that nothing is computed in vain.

    Raises
    ------
    ForkliftError
        Those of `check_standing`; ``"not-writable"`` if nothing can be made beside it, or its name is too
        long.
    """
    path = check_standing(path, known, mark, unfinished)
    with writing(path):
        temporary = _beside(path)
        temporary.mkdir()
        temporary.rmdir()
    return path


def check_standing(
    path: str | Path, known: Collection[str], mark: str, unfinished: Collection[str] = ()
) -> Path:
    """`path`, absolute, if a result may stand there: nothing yet, an empty folder, or an earlier result.

    An earlier result is a folder that holds the file `mark` and nothing but the files `known`, which are
    relative to it and written with ``/``; so nothing of anyone else's is replaced with it. The files
    `unfinished` may stand there in any case.

    Raises
    ------
    ForkliftError
        ``"output-exists"`` if anything else stands there; ``"not-writable"`` if its parent is missing.
    """
    path = _named(path).resolve()
    _must_be_folder(path.parent)
    if not os.path.lexists(path):
        return path
    if not path.is_dir():
        raise ForkliftError(
            "output-exists", f"{path} is a file; name a folder that does not exist yet", file=str(path)
        )
    found = _below(path) - set(unfinished)
    if found and (foreign := sorted(found - set(known)) or ([] if mark in found else sorted(found))):
        raise ForkliftError(
            "output-exists",
            f"{path} is not an earlier result (it holds {foreign[0]}), so it is left alone; "
            "name a folder that does not exist yet",
            file=str(path),
            found=foreign,
        )
    return path


@contextmanager
def folder(
    path: str | Path, known: Collection[str], mark: str, unfinished: Collection[str] = ()
) -> Iterator[Path]:
    """An empty temporary sibling folder to fill, which takes the place of `path` when all went well.

    See `check_standing` for what may be replaced. If anything fails, `path` stays as it was.
    """
    path = check_standing(path, known, mark, unfinished)
    temporary = _beside(path)
    try:
        with writing(path):
            temporary.mkdir()
            yield temporary
            _replace_folder(temporary, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _replace_folder(new: Path, path: Path) -> None:
    if not path.exists() or not any(path.iterdir()):
        os.replace(new, path)
        return
    earlier = new.with_suffix(".earlier")
    os.replace(path, earlier)
    try:
        os.replace(new, path)
    except BaseException:
        os.replace(earlier, path)
        raise
    shutil.rmtree(earlier, ignore_errors=True)


def _beside(path: Path) -> Path:
    """Where a result is written before it takes its place."""
    return path.with_name(f".{path.name}.{os.getpid()}.tmp")


def _below(folder: Path) -> set[str]:
    """Every file, link and empty folder below `folder`, relative to it."""
    found = set()

    def unreadable(error: OSError) -> None:
        raise _not_writable(folder, error)

    for here, folders, files in os.walk(folder, onerror=unreadable):
        inside = [name for name in folders if (Path(here) / name).is_symlink()]
        for name in [*files, *inside]:
            found.add((Path(here) / name).relative_to(folder).as_posix())
        if not (files or folders) and Path(here) != folder:
            found.add(Path(here).relative_to(folder).as_posix())
    return found


def _named(path: str | Path) -> Path:
    if str(path) in ("", "."):  # Path("") is "."
        raise ForkliftError(
            "not-writable",
            "The path of the result is empty or the current folder; name a file or another folder",
            file=str(path),
        )
    return Path(path)


def _must_be_folder(path: Path) -> None:
    if path.exists() and not path.is_dir():
        raise ForkliftError(
            "not-writable", f"{path} is a file, not a folder; name another place", file=str(path)
        )
    if not path.is_dir():
        raise ForkliftError(
            "not-writable", f"The folder {path} does not exist; make it first or name another", file=str(path)
        )


def _not_writable(path: Path, error: OSError) -> ForkliftError:
    why = error.strerror or "the system does not allow it"
    return ForkliftError(
        "not-writable",
        f"{path} cannot be written ({why.lower()}); choose another place or free this one",
        file=str(path),
    )

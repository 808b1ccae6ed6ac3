"""The command line: its commands, and how it ends."""

from __future__ import annotations

import io
import os
import signal
import sys
from typing import Annotated, Any

import typer
import typer.core

from forklift.app import interruption
from forklift.app.commands import (
    compare,
    convert,
    demo,
    diagnose,
    fit,
    info,
    prove,
    rare,
    replay,
    simulate,
    sweep,
    truck,
)
from forklift.app.commands.control import control
from forklift.app.options import INTERRUPTED as INTERRUPTED
from forklift.app.options import REFUSED
from forklift.base.errors import ForkliftError
from forklift.base.memory import collect_seldom, keep_freed


class _Commands(typer.core.TyperGroup):
    """Ctrl-C reaches `run` as one error, before Typer makes a silent exit of it."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise ForkliftError("interrupted", interruption.NOTHING) from None


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
app.command(epilog=simulate.EXAMPLE)(simulate.simulate)
app.command(epilog=compare.EXAMPLE)(compare.compare)
app.command(epilog=fit.EXAMPLE)(fit.fit)
app.command(epilog=diagnose.EXAMPLE)(diagnose.diagnose)
app.command(epilog=prove.EXAMPLE)(prove.prove)
app.command(epilog=sweep.EXAMPLE)(sweep.sweep)
app.command(epilog=replay.EXAMPLE)(replay.replay)
app.command(epilog=rare.EXAMPLE)(rare.rare)
app.command(epilog=info.EXAMPLE)(info.info)
app.command(epilog=convert.EXAMPLE)(convert.convert)
app.add_typer(truck.truck, name="truck")
app.command(epilog=demo.EXAMPLE)(demo.demo)


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


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 2 refused with one sentence, 130 interrupted."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a redirected one may know few characters
            stream.reconfigure(errors="replace")
    signal.signal(signal.SIGTERM, _terminated)
    keep_freed()
    collect_seldom()
    sys.exit(run(arguments))


def _terminated(*_: object) -> None:
    """As Ctrl-C, so that what can be kept is, and nothing half-written stays behind."""
    interruption.terminated()
    raise KeyboardInterrupt


def run(arguments: list[str] | None = None) -> int:
    """Run the command line and give its exit status; never a traceback."""
    try:
        status = app(arguments, prog_name="forklift", standalone_mode=False)
    except KeyboardInterrupt:
        return _interrupted()
    except ForkliftError as error:
        if error.code != "interrupted":
            return _refuse(error.message, error.code)
        return _interrupted(error.message)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if type(error).__name__ == "Abort":
            return _interrupted()
        if explain := getattr(error, "format_message", None):
            if not explain():  # the help that a call without arguments gets
                return REFUSED
            return _refuse(
                f"{explain().rstrip('.')}; `{_help_for(error)} --help` tells how", "argument-invalid"
            )
        return _refuse(_unforeseen(error))
    return status if isinstance(status, int) else 0


def _interrupted(sentence: str = interruption.NOTHING) -> int:
    print(f"forklift: {sentence}.", file=sys.stderr)
    return interruption.status()


def _refuse(message: str, code: str = "") -> int:
    """One sentence, and the error's code for a script, which does not change."""
    sentence = " ".join(message.split())
    end = "" if sentence.endswith((".", "?")) else "."
    print(f"forklift: {sentence}{end}{f' [{code}]' if code else ''}", file=sys.stderr)
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


if __name__ == "__main__":
    main()

"""Binary formats are read in a child process.

On a damaged file their libraries do not only raise: asammdf and scipy.io can crash the interpreter or read
memory that is not theirs, polars can abort, asammdf can go in circles. In a child, all of that is one error.
The child starts with the first such file and serves the following ones; it ends with its parent, and its
temporary files with it. Where no process can be started, the file is read here.
"""

from __future__ import annotations

import atexit
import importlib
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import threading
import warnings
from pathlib import Path
from typing import IO, Any

from forklift.base.errors import ForkliftError
from forklift.recordings.formats.signals import Choose, Place, Signals, unreadable

LONGEST_S = 60.0
"""How long a reader may take before it is given up [s], far above its start of about a second."""
LONGEST_S_PER_BYTE = 1e-6
"""… and for each byte of the file [s]: 1 MB/s, below any disk or network that recordings come from."""

_START = (
    "import sys; sys.path[:] = {path!r}; from forklift.recordings.formats.isolation import serve; serve()"
)


def read(module: str, place: Place, choose: Choose) -> Signals:
    """``module.read(place, choose)``, in the child process.

    Raises
    ------
    ForkliftError
        What the module raises; ``"recording-unreadable"`` if it raises anything else, crashes or does not
        end.
    """

    name = module.rpartition(".")[2]
    limit = LONGEST_S + Path(place.path).stat().st_size * LONGEST_S_PER_BYTE
    try:
        kind, result = _child.ask((module, place, choose), limit)
    except OSError:
        kind, result = _answer(module, place, choose)
    if kind == "signals":
        assert isinstance(result, Signals)
        return result
    if isinstance(result, ForkliftError):
        raise result
    raise unreadable(place, name, result)


class _Child:
    """The child process: one request after another, one answer each."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._folder = ""
        self._parent = 0
        self._lock = threading.Lock()

    def ask(self, request: Any, limit: float) -> tuple[str, Any]:
        """The child's answer: ``("signals", …)``, ``("error", …)`` or ``("failed", why)``.

        Raises
        ------
        OSError
            If the child cannot be started.
        """
        with self._lock:
            process = self._running()
            assert process.stdin is not None
            assert process.stdout is not None
            out_of_time = threading.Event()
            timer = threading.Timer(limit, _give_up, (process, out_of_time))
            timer.daemon = True
            timer.start()
            try:
                _send(process.stdin, request)
                answer: tuple[str, Any] = pickle.load(process.stdout)
            except Exception:  # whatever a broken pipe or half an answer raises
                self._end()
                return "failed", "no end" if out_of_time.is_set() else "crash"
            except BaseException:  # Ctrl-C: the answer that is under way must not be taken for the next one's
                self._end()
                raise
            finally:
                timer.cancel()
            return answer

    def _running(self) -> subprocess.Popen[bytes]:
        if self._parent != os.getpid():  # a fork must not speak through its parent's pipes
            self._process, self._folder, self._parent = None, "", os.getpid()
        if self._process is None or self._process.poll() is not None:
            self._end()
            self._folder = tempfile.mkdtemp(prefix="forklift-")
            self._process = subprocess.Popen(
                [sys.executable or "python", "-c", _START.format(path=[str(path) for path in sys.path])],
                env=os.environ | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), self._folder),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        return self._process

    def _end(self) -> None:
        process, self._process = self._process, None
        if self._parent != os.getpid():
            return
        if process is not None:
            process.kill()
            process.communicate()
        if self._folder:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = ""


def _give_up(process: subprocess.Popen[bytes], out_of_time: threading.Event) -> None:
    out_of_time.set()
    process.kill()


_child = _Child()


def folder() -> str:
    """Where the process that reads has its temporary files; empty if there is none."""
    return _child._folder


def end() -> None:
    """End the process that reads, if there is one; the next file starts another."""
    _child._end()


atexit.register(end)


def serve() -> None:
    """The child's loop. Whatever a library prints goes nowhere: the pipe carries answers alone."""
    warnings.simplefilter("ignore")
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    requests = sys.stdin.buffer
    while True:
        try:
            module, place, choose = pickle.load(requests)
        except (EOFError, KeyboardInterrupt):
            return
        try:
            _send(answers, _answer(module, place, choose))
        except KeyboardInterrupt:
            return


def _answer(module: str, place: Place, choose: Choose) -> tuple[str, Any]:
    try:
        return "signals", importlib.import_module(module).read(place, choose)
    except ForkliftError as error:
        return "error", error
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a panic in polars is no Exception
        return "failed", f"{type(error).__name__}: {error}"[:1000]


def _send(pipe: IO[bytes], message: Any) -> None:
    pipe.write(pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL))
    pipe.flush()

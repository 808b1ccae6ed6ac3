"""The processes that diagnose: whoever started them ends them, too."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock


class Processes:
    """Those that run at present."""

    def __init__(self) -> None:
        self._running: set[subprocess.Popen[str]] = set()
        self._lock = Lock()
        self._ended = False

    def run(
        self, command: Sequence[str], *, cwd: Path, environment: Mapping[str, str], limit_s: float
    ) -> tuple[int, str]:
        """Status of a program, and what it wrote.

        Raises
        ------
        subprocess.TimeoutExpired
            If it is not done after `limit_s`; it is killed then.
        KeyboardInterrupt
            After `end`: nothing is begun any more.
        """
        with self._lock:
            if self._ended:
                raise KeyboardInterrupt
            process = subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd, env=environment
            )
            self._running.add(process)
        try:
            wrote = "".join(process.communicate(timeout=limit_s))
        except BaseException:
            process.kill()
            process.communicate()
            raise
        finally:
            with self._lock:
                self._running.discard(process)
        return process.returncode, wrote

    def end(self) -> None:
        """Ask all that run to stop, and begin none any more."""
        with self._lock:
            self._ended = True
            for process in self._running:
                process.terminate()

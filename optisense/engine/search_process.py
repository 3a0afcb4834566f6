"""The process that runs a study for the engine: start, stop, and search for a running one."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from optisense import errors
from optisense.errors import OptiSenseError, SearchError
from optisense.folders import holder_of
from optisense.untrusted_files import read_json

PROCESS_FILE = "process.json"
"""Name of the file in the study's folder while one of these processes runs it; it tells how to end
the process.
"""

LOG_FILE = "search.log"
"""Name of the file of the process's messages, which shows why it died."""

LOG_END = 2000
"""Number of bytes at the end of the process's log in which the reason is looked up if it ended
unexpectedly; a Python error with its cause fits.
"""


class SearchProcess:
    """Running search."""

    def __init__(self, folder: Path, workers: int, budget: int | None, go_on: bool) -> None:
        """Start the process.

        Args:
            workers: number of processes that score trials.
            budget: total number of trials; the study's own budget if None.
            go_on: whether it continues after the end of this process.
        """
        self.folder = folder
        self.go_on = go_on
        command = [sys.executable, "-m", "optisense.engine.searcher", str(folder)]
        command += ["--workers", str(workers)]
        command += [] if budget is None else ["--budget", str(budget)]
        command += ["--go-on"] if go_on else []
        environment = {**os.environ}
        environment["PYTHONPATH"] = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
        with (folder / LOG_FILE).open("ab") as log:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=environment,
                start_new_session=True,  # Ctrl-C in the front end's terminal is not for it
            )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """True if the process has not ended."""
        return self._process.poll() is None

    def stop(self) -> None:
        """Ask it to end after the trials in progress; a second call drops them."""
        with contextlib.suppress(OSError, ValueError):
            assert self._process.stdin is not None
            self._process.stdin.write(b"stop\n")
            self._process.stdin.flush()

    def outcome(self) -> dict[str, Any]:
        """Return the result that the process wrote at its end.

        Raises:
            OptiSenseError: the search failed, or the process died.
        """
        assert self._process.stdout is not None
        output = self._process.stdout.read()
        code = self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):
                if stream is not None:
                    stream.close()
        try:
            outcome: dict[str, Any] = json.loads(output)
        except ValueError:
            way = f"signal {-code}" if code < 0 else f"exit code {code}"
            raise SearchError(
                f"the process of the search has ended unexpectedly ({way}); its finished trials "
                "are kept",
                where=str(self.folder),
                hint=_last_line(self.folder / LOG_FILE),
            ) from None
        if "error" in outcome:
            raise _error_of(outcome["error"])
        return outcome


def is_running(folder: Path) -> bool:
    """Return whether any process runs a study at present."""
    return holder_of(folder) is not None


def stop_other(folder: Path) -> bool:
    """Ask the process that runs a study to end; False if none does.

    Raises:
        SearchError: the study is run, but not by an engine of this machine.
    """
    holder = holder_of(folder)
    if holder is None:
        return False
    try:
        number = int(read_json(folder / PROCESS_FILE, SearchError)["pid"])
    except (SearchError, ValueError, LookupError, TypeError):
        number = None
    if number != holder.process or holder.is_elsewhere:
        raise SearchError(
            f"the study is run by a program that can't be stopped from here: {holder}",
            where=str(folder),
            hint="Press Ctrl-C where it was started; nothing that it has finished is lost",
        )
    with contextlib.suppress(ProcessLookupError):
        os.kill(number, signal.SIGINT)
    return True


def _error_of(data: dict[str, Any]) -> OptiSenseError:
    kind = getattr(errors, str(data.get("kind")), SearchError)
    made: OptiSenseError = kind(data["message"], where=data.get("where"), hint=data.get("hint"))
    return made


def _last_line(log: Path) -> str | None:
    """Return the last line of a log, or None."""
    try:
        text = log.read_bytes()[-LOG_END:].decode("utf-8", "replace").strip()
    except OSError:
        return None
    return text.splitlines()[-1] if text else None

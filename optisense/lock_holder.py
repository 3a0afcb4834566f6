"""The process that holds the lock of a folder, read from its lock file."""

from __future__ import annotations

import json
import os
import socket
import sys
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

BOOT_FILE = Path("/proc/sys/kernel/random/boot_id")
"""File that identifies the running kernel on Linux; absent elsewhere."""

MOST_TEXT = 1_000_000
"""Largest number of bytes read of a lock file; those of designs of 1000 parts take 40,000."""


@dataclass(frozen=True)
class Holder:
    """Content of a lock file.

    Attributes:
        process: id of the process that wrote it.
        host: name of its machine.
        boot: boot identifier of its machine; empty if there is none.
        began: local time of its start, ISO 8601.
        command: command line of the process.
        making: files that it was about to make, relative to the folder; empty once complete.
        folders: folders that it was about to create for them.
    """

    process: int
    host: str
    boot: str
    began: str
    command: str
    making: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()

    @staticmethod
    def of_this_process() -> Holder:
        """Return the holder that stands for this process."""
        words = [Path(sys.argv[0]).name if sys.argv else "python", *sys.argv[1:2]]
        return Holder(
            process=os.getpid(),
            host=socket.gethostname(),
            boot=boot_identifier(),
            began=datetime.now().astimezone().isoformat(timespec="seconds"),
            command=" ".join(words),
        )

    @property
    def is_elsewhere(self) -> bool:
        """True if it is on another machine, as far as known."""
        if self.boot and self.boot == boot_identifier():
            return False
        return self.host != socket.gethostname()

    def __str__(self) -> str:
        return f"process {self.process} on {self.host}, '{self.command}', since {self.began}"


UNKNOWN = Holder(0, "this machine", "", "now", "unknown")
"""Holder that has not recorded its identity yet."""


def read_holder(file: int) -> Holder | None:
    """Return the content of a lock file, or None if it can't be parsed."""
    try:
        data: Any = json.loads(os.pread(file, MOST_TEXT, 0))
        texts = {name: str(data[name]) for name in ("host", "boot", "began", "command")}
        making, folders = ([str(each) for each in data[name]] for name in ("making", "folders"))
        return Holder(int(data["process"]), **texts, making=tuple(making), folders=tuple(folders))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def process_lives(process: int) -> bool:
    """Return whether a process of this machine is running."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def boot_identifier() -> str:
    """Return the identifier of the running kernel; empty if there is none."""
    try:
        return BOOT_FILE.read_text(encoding="ascii").strip()
    except OSError:
        return ""

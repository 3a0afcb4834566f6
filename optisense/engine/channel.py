"""Standard output as a channel for messages and nothing else."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Mapping
from typing import Any

from optisense.engine.protocol import to_line


class Channel:
    """Writes messages, one a line, from any thread."""

    def __init__(self, descriptor: int) -> None:
        """Write to an open file descriptor, which from here on is the channel's own."""
        self._descriptor = descriptor
        self._lock = threading.Lock()
        self._gone = False

    @staticmethod
    def of_standard_output() -> Channel:
        """The process's standard output; whatever else prints goes to standard error from now on.

        On the level of file descriptors, so that libraries in C are kept out as well.
        """
        sys.stdout.flush()
        own = os.dup(1)
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        return Channel(own)

    @property
    def gone(self) -> bool:
        """Whether nobody reads any more."""
        return self._gone

    def send(self, message: Mapping[str, Any]) -> None:
        """Write a message; one to a reader that has gone is dropped."""
        line = memoryview(to_line(message))
        with self._lock:
            if self._gone:
                return
            try:
                while line:
                    line = line[os.write(self._descriptor, line) :]
            except OSError:
                self._gone = True

    def close(self) -> None:
        """Nothing can be sent any more."""
        with self._lock:
            self._gone = True
            with contextlib.suppress(OSError):
                os.close(self._descriptor)

"""Standard output as a channel for messages only."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Mapping
from typing import Any

from optisense.engine.protocol import to_line


class Channel:
    """Writer of messages, one per line, for any thread."""

    def __init__(self, descriptor: int) -> None:
        """Write to an open file descriptor, which belongs to the channel from here on."""
        self._descriptor = descriptor
        self._lock = threading.Lock()
        self._gone = False

    @staticmethod
    def of_standard_output() -> Channel:
        """Return a channel on the process's standard output, and redirect all other output to
        standard error.

        The redirection is on the level of file descriptors, so that it holds for libraries in C as
        well.
        """
        sys.stdout.flush()
        own = os.dup(1)
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        return Channel(own)

    @property
    def gone(self) -> bool:
        """True if the reader has closed the channel."""
        return self._gone

    def send(self, message: Mapping[str, Any]) -> None:
        """Write a message; it is dropped if the reader has closed the channel."""
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
        """Close the channel; further messages are dropped."""
        with self._lock:
            self._gone = True
            with contextlib.suppress(OSError):
                os.close(self._descriptor)

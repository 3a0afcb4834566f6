"""``optisense engine``: run the process that serves front ends."""

from __future__ import annotations

import sys

from optisense import starting
from optisense.cli import stopping
from optisense.cli.console import EXIT_INTERRUPTED, messages


def engine() -> None:
    """Serve a front end on standard input and output, with lines of JSON (see docs/engine.md)."""
    if sys.stdin.isatty():
        messages.print(
            "This command serves programs, which write requests to its standard input, one JSON "
            "object per line. Ctrl-D ends it."
        )
    from optisense.engine.server import serve

    starting.begin()
    serve(lambda: stopping.exit_code(EXIT_INTERRUPTED))

"""The command line: one file per command, no logic that the Python API lacks."""

import sys

from optisense.starting import exit_on_signals

if sys.argv[:1] == ["-m"]:  # so it is while Python looks for what ``python -m`` names
    exit_on_signals()

from optisense.cli.app import app, main

__all__ = ["app", "main"]

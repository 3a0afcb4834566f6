"""The command line: one file per command, no logic that the Python API lacks."""

from optisense.cli.app import app, main

__all__ = ["app", "main"]

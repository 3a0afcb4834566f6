"""Commands by name. The module of a command is imported when the command is called, so that no
command waits for the imports of others.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

_MODULES = {
    "new": "new",
    "check": "check",
    "render": "render",
    "dataset": "dataset",
    "evaluate": "evaluate",
    "search": "search",
    "apply": "apply",
    "verify": "verify",
    "report": "report",
    "tolerance": "tolerance",
    "ledger": "ledger",
    "contacts": "contacts",
    "compare": "compare",
    "calibrate": "calibrate",
    "export": "export",
    "studio": "studio",
    "engine": "engine",
    "doctor": "doctor",
    "cage": "cage_app",
    "library": "library_app",
    "task": "task_app",
}
"""The function or group that defines each command, in the module of the command's name."""


class Commands(TyperGroup):
    """Group of all commands of ``optisense``, each of which is made on first use."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands: dict[str, Any] = dict.fromkeys(_MODULES)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of a name, or None if there is none."""
        if cmd_name in _MODULES and self.commands[cmd_name] is None:
            self.commands[cmd_name] = _command(cmd_name)
        return self.commands.get(cmd_name)


def _command(name: str) -> Any:
    home = getattr(import_module(f"optisense.cli.{name}"), _MODULES[name])
    alone = typer.Typer(add_completion=False, rich_markup_mode="rich")
    if isinstance(home, typer.Typer):
        alone.add_typer(home, name=name)
    else:
        alone.command(name)(home)
    return _reflowed(typer.main.get_group(alone).commands[name])


def _reflowed(command: Any) -> Any:
    """Return a command whose help has a line for each paragraph, as have its subcommands.

    Typer would keep the line breaks of docstrings, which are longer than lines of a terminal.
    """
    paragraphs = (command.help or "").split("\n\n")
    command.help = "\n\n".join(" ".join(each.split()) for each in paragraphs) or None
    for below in getattr(command, "commands", {}).values():
        _reflowed(below)
    return command

"""Preferences of the extension: the command that starts the engine."""

from __future__ import annotations

import os
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import bpy
from bpy.props import StringProperty

PACKAGE = __package__.rpartition(".")[0]
ENVIRONMENT = "OPTISENSE_ENGINE"


when_changed: list[Callable[[], None]] = []
"""Callbacks for a change of the engine's command."""


def _changed(values: bpy.types.AddonPreferences, context: bpy.types.Context) -> None:
    for each in when_changed:
        each()


class OPTISENSE_AP_preferences(bpy.types.AddonPreferences):
    """Settings that outlive a session of Blender."""

    bl_idname = PACKAGE

    engine: StringProperty(
        name="Engine",
        description="Command that starts the engine, for example /home/me/.venv/bin/optisense "
        "engine",
        update=_changed,
    )

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.prop(self, "engine")
        command = engine_command()
        text = "Found: " + shlex.join(command) if command else "No engine was found. " + HOW_TO_GET
        self.layout.label(text=text, icon="CHECKMARK" if command else "ERROR")


HOW_TO_GET = "Type 'optisense studio' in a terminal, or set the engine's path in the preferences"


def preferences() -> bpy.types.AddonPreferences | None:
    """Return the extension's preferences; None if it is registered without being installed."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return addon.preferences if addon else None


def engine_command() -> list[str]:
    """Return the command that starts the engine; empty if none is known.

    The preferences come first, then the environment variable `OPTISENSE_ENGINE`, which `optisense
    studio` sets and which `register` copies into the preferences, then the search path.
    """
    own = preferences()
    command = own.engine.strip() if own is not None else ""
    command = command or os.environ.get(ENVIRONMENT, "")
    if command:
        return _split(command)
    found = shutil.which("optisense")
    return [found, "engine"] if found else []


def _split(command: str) -> list[str]:
    """Split a command into words; a path with spaces needs no quotes, `engine` may be omitted."""
    program = command.removesuffix(" engine").strip()
    if not Path(program).is_file():
        return shlex.split(command)
    is_ours = Path(program).stem == "optisense"
    return [program, "engine"] if is_ours or program != command else [program]


def register() -> None:
    command, own = os.environ.get(ENVIRONMENT, ""), preferences()
    if command and own is not None and own.engine != command:
        own.engine = command  # so that a Blender started without `optisense studio` finds it too

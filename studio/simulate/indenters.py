"""Meshes of indenter files, read by the engine, so that they are drawn as they press."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.mesh_file import Mesh
from ..engine import session
from ..scene.collections import objects_of
from ..scene.contacts import absolute_file, file_meshes, redraw, when_file_unknown

_asked: set[str] = set()


def ask_for_mesh(file: str) -> None:
    """Request the mesh of a file, and redraw the contacts that press with it."""
    if file in _asked:
        return
    _asked.add(file)

    def known(result: dict[str, Any]) -> None:
        _asked.discard(file)
        files = result["mesh"]
        file_meshes[file] = Mesh(np.load(files["vertices"]), np.load(files["faces"]))
        for scene in bpy.data.scenes:
            for contact in objects_of(scene, "CONTACT"):
                if (
                    contact.optisense.indenter == "mesh"
                    and absolute_file(contact.optisense) == file
                ):
                    redraw(contact)
        session.redraw()

    def refused(error: session.EngineError) -> None:
        _asked.discard(file)
        session.say(error)

    session.ask("mesh", known, refused, file=file, role="indenter", name="indenter")


HOOKS = ((when_file_unknown, ask_for_mesh),)


def unregister() -> None:
    file_meshes.clear()
    _asked.clear()

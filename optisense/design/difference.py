"""Comparison of two designs: whether they are equal, and where they differ."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import numpy as np

from optisense.design import SensorDesign
from optisense.design.fields import Steps
from optisense.design.sensor_design import dotted
from optisense.geometry import TriangleMesh

SAME_NUMBER = 1e-9
"""Relative difference up to which numbers count as equal; it covers rounding in a file."""

LONGEST_LIST = 60
"""Largest number of characters of a list that is shown whole; it fits a line of a terminal."""

SAME_PLACE = 1e-5
"""Distance up to which vertices count as equal, mm; mesh files hold a limited number of digits."""


def design_values(design: SensorDesign) -> dict[str, Any]:
    """Return all values that affect the simulation; names of files and provenance are left out."""
    data = design.model_dump(mode="json", exclude={"provenance", "description", "name"})
    for part in data["parts"].values():
        del part["mesh"]
    return data


def mesh_digests(design: SensorDesign) -> dict[str, str]:
    """Return digests by part that distinguish meshes of the same name."""
    return {name: _print_of(mesh) for name, mesh in design.meshes.items()}


def fingerprint(design: SensorDesign) -> str:
    """Return a short text that is equal for designs whose simulations are equal."""
    digest = hashlib.sha256(json.dumps(design_values(design), sort_keys=True).encode())
    for name in sorted(design.meshes):
        mesh = design.meshes[name]
        digest.update(name.encode())
        _digest(mesh, digest)
    for value in design.values_of_kinds().values():
        for data in value.contents().values():
            digest.update(data)
    return digest.hexdigest()


def differences(old: SensorDesign, new: SensorDesign) -> list[str]:
    """Return the changes from one design to another, one per line: 'PATH: OLD -> NEW'."""
    found = plain_differences(design_values(old), design_values(new))
    for name in sorted(set(old.meshes) | set(new.meshes)):
        if name in old.meshes and name in new.meshes:
            said = _compare_meshes(old.meshes[name], new.meshes[name])
            if said:
                found.append(f"mesh of part '{name}': {said}")
    return found


def notes(design: SensorDesign) -> dict[str, Any]:
    """Return a summary of a design (JSON-ready), from which later edits can be found."""
    return {
        "values": design_values(design),
        "meshes": {
            name: [len(mesh.vertices), len(mesh.faces), _print_of(mesh)]
            for name, mesh in sorted(design.meshes.items())
        },
    }


def differences_from(noted: dict[str, Any], new: SensorDesign) -> list[str]:
    """Return the changes of a design since its `notes` were written."""
    found = plain_differences(noted["values"], design_values(new))
    now = notes(new)["meshes"]
    for name, (vertices, faces, mark) in noted["meshes"].items():
        if name in now and now[name][2] != mark:
            same = now[name][:2] == [vertices, faces]
            said = "vertices moved" if same else f"{faces} triangles -> {now[name][1]} triangles"
            found.append(f"mesh of part '{name}': {said}")
    return found


def plain_differences(old: Any, new: Any) -> list[str]:
    """Return the changes between values, one per line, as JSON has them: tuples equal lists."""
    found: list[str] = []
    before, now = (json.loads(json.dumps(each)) for each in (old, new))
    _compare(before, now, (), found)
    return found


def _compare(old: Any, new: Any, path: Steps, found: list[str]) -> None:
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [*old, *(key for key in new if key not in old)]:
            if key not in new:
                found.append(f"{dotted((*path, key))}: removed")
            elif key not in old:
                found.append(f"{dotted((*path, key))}: added")
            else:
                _compare(old[key], new[key], (*path, key), found)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            _compare(one, other, (*path, index), found)
    elif not _same(old, new):
        found.append(f"{dotted(path)}: {_short(old)} -> {_short(new)}")


def _same(old: Any, new: Any) -> bool:
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in (old, new))
    if not numbers:
        return bool(old == new)
    return abs(old - new) <= SAME_NUMBER * max(abs(old), abs(new), 1e-3)


def _short(value: Any) -> str:
    if isinstance(value, list):
        text = json.dumps(value, ensure_ascii=False)
        return text if len(text) <= LONGEST_LIST else f"{len(value)} entries"
    if isinstance(value, dict):
        return "a section"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _print_of(mesh: TriangleMesh) -> str:
    digest = hashlib.sha256()
    _digest(mesh, digest)
    return digest.hexdigest()


def _digest(mesh: TriangleMesh, digest: hashlib._Hash) -> None:
    digest.update(np.ascontiguousarray(mesh.vertices, "<f8").tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, "<i4").tobytes())


def _compare_meshes(old: TriangleMesh, new: TriangleMesh) -> str | None:
    if old.vertices.shape != new.vertices.shape or old.faces.shape != new.faces.shape:
        return f"{len(old.faces)} triangles -> {len(new.faces)} triangles"
    if not np.array_equal(old.faces, new.faces):
        return "triangles over other vertices"
    moved = float(np.linalg.norm(old.vertices - new.vertices, axis=1).max(initial=0.0))
    return f"vertices moved by up to {moved:.4g} mm" if moved > SAME_PLACE else None

"""Simplified models of the objects that the paper presses into GelBelt and GelSight Svelte; mm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from optisense.geometry import MeshIndenter, TriangleMesh
from optisense.geometry.mesh import grid_faces

SCREW_RADIUS, SCREW_PITCH, THREAD_DEPTH, SCREW_LENGTH = 3.0, 1.0, 0.6, 16.0
"""Outer radius, pitch, depth of the thread and length of an M6 screw (ISO 261), mm.

The screw lies on its side, along x.
"""

BOARD_PITCH, HOLE, BOARD_SIDE = 2.54, 1.3, 20.0
"""Pitch (0.1 inch) and side of the square holes of a breadboard, and side of the board, mm."""

TOOTH_PITCH, TOOTH_HEIGHT, RACK_LENGTH, RACK_WIDTH = 3.14, 2.25, 22.0, 8.0
"""Pitch, height of the teeth, length and width of a rack of module 1 mm (ISO 53), mm."""

STUD_PITCH, STUD_RADIUS, STUD_HEIGHT = 8.0, 2.4, 1.7
"""Pitch, radius and height of the studs of a toy brick, which point to the sensor, mm."""

SAMPLES_A_MM = 12
"""Number of heights per mm along each axis; details of 0.1 mm are resolved."""


def screw() -> MeshIndenter:
    """Return a screw on its side: a cylinder whose radius follows a helix."""
    along = np.linspace(-SCREW_LENGTH / 2, SCREW_LENGTH / 2, SAMPLES_A_MM * int(SCREW_LENGTH) + 1)
    around = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 121)
    x, angle = np.meshgrid(along, around, indexing="ij")
    turn = (x / SCREW_PITCH + angle / (2.0 * np.pi)) % 1.0
    radius = SCREW_RADIUS - THREAD_DEPTH * np.abs(2.0 * turn - 1.0)
    points = np.stack([x, radius * np.sin(angle), -radius * np.cos(angle)], axis=-1)
    return _indenter(points)


def breadboard() -> MeshIndenter:
    """Return a plate with a grid of square holes."""
    steps = int(BOARD_SIDE * SAMPLES_A_MM)
    x, y = _grid(BOARD_SIDE, BOARD_SIDE, steps, steps)
    inside = np.maximum(*(np.abs((v / BOARD_PITCH) % 1.0 - 0.5) for v in (x, y))) * BOARD_PITCH
    depth = np.clip((0.5 * HOLE - inside) / 0.15, 0.0, 1.0) * 0.8
    return _indenter(np.stack([x, y, depth], axis=-1))


def rack() -> MeshIndenter:
    """Return a rack whose teeth lie across x, with flanks of 20 degrees."""
    x, y = _grid(RACK_LENGTH, RACK_WIDTH, int(RACK_LENGTH * SAMPLES_A_MM), 16)
    away = np.abs((x / TOOTH_PITCH) % 1.0 - 0.5) * TOOTH_PITCH
    flank = TOOTH_HEIGHT * np.tan(np.radians(20.0))
    depth = np.clip((away - (0.25 * TOOTH_PITCH - 0.5 * flank)) / flank, 0.0, 1.0) * TOOTH_HEIGHT
    return _indenter(np.stack([x, y, depth], axis=-1))


def brick() -> MeshIndenter:
    """Return a brick with two rows of three studs."""
    length, width = 3 * STUD_PITCH - 0.2, 2 * STUD_PITCH - 0.2
    x, y = _grid(length, width, int(length * SAMPLES_A_MM), int(width * SAMPLES_A_MM))
    centre_x = (np.round(x / STUD_PITCH)) * STUD_PITCH
    centre_y = (np.floor(y / STUD_PITCH) + 0.5) * STUD_PITCH
    away = np.hypot(x - centre_x, y - centre_y)
    depth = np.clip((away - STUD_RADIUS) / 0.1, 0.0, 1.0) * STUD_HEIGHT
    return _indenter(np.stack([x, y, depth], axis=-1))


OBJECTS: dict[str, Callable[[], MeshIndenter]] = {
    "screw": screw,
    "breadboard": breadboard,
    "rack": rack,
    "brick": brick,
}


def _grid(length: float, width: float, columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of a centred grid, each (columns + 1, rows + 1) mm."""
    x = np.linspace(-length / 2, length / 2, columns + 1)
    y = np.linspace(-width / 2, width / 2, rows + 1)
    first, second = np.meshgrid(x, y, indexing="ij")
    return first, second


def _indenter(points: np.ndarray) -> MeshIndenter:
    """Return the indenter of a grid of points (a, b, 3) mm that face downwards."""
    faces = grid_faces(*points.shape[:2])
    mesh = TriangleMesh(points.reshape(-1, 3), faces)
    if mesh.face_normals[:, 2].sum() > 0.0:
        mesh = mesh.flipped()
    return MeshIndenter(mesh.vertex_normals())

"""The objects, and the kind of indenter for them.

Sizes are those of the real things where these are small enough for a fingertip: ISO metric threads
and nuts, DIN 7985 pan heads, Braille by ISO 17049; the brick is a toy brick at half scale.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import ContactError
from optisense.geometry.indenter_kinds import FACET_ERROR, IndenterKind, quantity
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.objects._relief import (
    Relief,
    disc,
    dome,
    hexagon,
    raised,
    rectangle,
    star,
    strokes,
    wall,
)
from optisense.near import suggestion


def _screw_head(x: FloatArray, y: FloatArray) -> FloatArray:
    radius = np.hypot(x, y)
    head = 5.0 - np.sqrt(np.maximum(25.0 - radius**2, 0.0))
    cross = np.minimum(rectangle(x, y, 3.2, 0.8), rectangle(x, y, 0.8, 3.2))
    recess = np.clip(-2.75 * cross, 0.0, 1.0)  # a flank of 70 degrees
    return head + recess + wall(disc(x, y, 2.8))


def _screw_thread(x: FloatArray, y: FloatArray) -> FloatArray:
    pitch, radius, depth = 0.7, 2.0, 0.43
    turn = np.arcsin(np.clip(y / radius, -1.0, 1.0)) / (2.0 * np.pi)
    # Flanks of 60 degrees, cut off flat at crests and roots.
    zigzag = np.abs(np.mod(x / pitch + turn, 1.0) - 0.5) * 2.0
    local = radius - np.clip(1.25 * zigzag - 0.125, 0.0, 1.0) * depth
    side = radius - np.sqrt(np.maximum(local**2 - y**2, 0.0))
    return side + wall(np.abs(x) - 3.5)


def _coin(x: FloatArray, y: FloatArray) -> FloatArray:
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    rim = np.clip(2.0 * (radius - 3.85), 0.0, 0.25)
    figure = 0.25 * np.minimum(1.0, 1.6 * star(x, y, 5, 2.7, 1.1))
    step = 2.0 * np.pi / 30.0
    aside = np.mod(angle + 0.5 * step, step) - 0.5 * step
    beads = dome(np.hypot(radius - 3.35, 3.35 * aside), 0.26, 0.18)
    return -rim - figure - beads + wall(radius - 4.5)


def _brick(x: FloatArray, y: FloatArray) -> FloatArray:
    pitch, stud = 4.0, 1.2
    studs = np.hypot(np.abs(x) - 0.5 * pitch, np.abs(y) - 0.5 * pitch) - stud
    return -raised(studs, 0.9) + wall(rectangle(x, y, 8.0, 8.0))


def _cable(x: FloatArray, y: FloatArray) -> FloatArray:
    radius, lay = 0.75, 7.0
    lowest = np.full(x.shape, 2.0)
    for phase in (0.0, np.pi):
        turn = 2.0 * np.pi * x / lay + phase
        middle, height = radius * np.cos(turn), radius * np.sin(turn)
        inside = radius**2 - (y - middle) ** 2
        wire = 2.0 * radius + height - np.sqrt(np.maximum(inside, 0.0))
        lowest = np.where(inside > 0.0, np.minimum(lowest, wire), lowest)
    return lowest + wall(np.abs(x) - 4.0)


def _wedge(x: FloatArray, y: FloatArray) -> FloatArray:
    flanks = np.maximum(-np.tan(np.radians(20.0)) * x, np.tan(np.radians(35.0)) * x)
    return flanks + wall(np.abs(y) - 3.0)


_LETTERS: list[tuple[float, list[list[tuple[float, float]]]]] = [
    (
        -3.3,
        [
            [(0.0, 0.0), (0.0, 2.4), (0.8, 2.4), (1.2, 2.1), (1.2, 1.6), (0.8, 1.25), (0.0, 1.25)],
            [(0.6, 1.25), (1.25, 0.0)],
        ],
    ),
    (
        -1.4,
        [[(1.2, 2.4), (0.0, 2.4), (0.0, 0.0), (1.2, 0.0)], [(0.0, 1.25), (0.9, 1.25)]],
    ),
    (0.3, [[(0.0, 0.0), (0.65, 2.4), (1.3, 0.0)], [(0.25, 0.8), (1.05, 0.8)]]),
    (
        2.2,
        [[(0.0, 0.0), (0.0, 2.4), (0.6, 2.4), (1.2, 1.7), (1.2, 0.7), (0.6, 0.0), (0.0, 0.0)]],
    ),
]
"""The letters R, E, A and D: where each begins (mm) and its strokes (mm)."""


def _letters(x: FloatArray, y: FloatArray) -> FloatArray:
    lines = [
        [(left + across, up - 1.2) for across, up in stroke]
        for left, letter in _LETTERS
        for stroke in letter
    ]
    # The letters read correctly from the back of the object, so they are mirrored on its face, like
    # a printer's types.
    return -raised(strokes(x, y, lines) - 0.2, 0.5) + wall(rectangle(x, y, 7.8, 3.4))


def _nut(x: FloatArray, y: FloatArray) -> FloatArray:
    radius = np.hypot(x, y)
    chamfer = np.tan(np.radians(30.0)) * np.maximum(radius - 2.65, 0.0)
    hole = np.maximum(1.75 - radius, 0.0) + wall(1.5 - radius)
    return np.maximum(chamfer, hole) + wall(hexagon(x, y, 5.5))


def _weave(x: FloatArray, y: FloatArray) -> FloatArray:
    pitch = 1.3
    threads = np.sin(np.pi * x / pitch) ** 2 * np.cos(np.pi * y / pitch) ** 2
    threads += np.cos(np.pi * x / pitch) ** 2 * np.sin(np.pi * y / pitch) ** 2
    return -0.35 * threads + wall(disc(x, y, 3.5))


def _key(x: FloatArray, y: FloatArray) -> FloatArray:
    edge = np.zeros(x.shape)
    for middle, depth in zip((-3.2, -1.6, 0.0, 1.6, 3.2), (0.35, 0.8, 0.5, 0.95, 0.2), strict=True):
        cut = depth - np.maximum(np.abs(x - middle) - 0.25, 0.0)  # flanks of 45 degrees
        edge = np.maximum(edge, cut)
    return edge + wall(rectangle(x, y, 8.4, 2.0))


def _bean(x: FloatArray, y: FloatArray) -> FloatArray:
    inside = 1.0 - (x / 3.6) ** 2 - (y / 2.5) ** 2
    side = np.where(inside > 0.0, 1.9 * (1.0 - np.sqrt(np.maximum(inside, 0.0))), 2.0)
    furrow = 0.5 * np.exp(-(((y - 0.3 * np.sin(0.9 * x)) / 0.28) ** 2))
    return side + furrow


def _braille(x: FloatArray, y: FloatArray) -> FloatArray:
    pitch = 2.5
    dots = np.zeros(x.shape)
    for column, row in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 0)):
        away = np.hypot(x - (column - 0.5) * pitch, y - (row - 1.0) * pitch)
        dots = np.maximum(dots, dome(away, 0.75, 0.48))
    return -dots + wall(rectangle(x, y, 5.0, 7.4))


OBJECTS: dict[str, Relief] = {
    "screw-head": Relief(
        "Screw head", "The pan head of an M3 screw with its cross.", (5.6, 5.6), 0.5, _screw_head
    ),
    "screw-thread": Relief(
        "Screw thread", "An M4 thread that lies on its side, 7 mm of it.", (7.0, 4.0), 0.6,
        _screw_thread,
    ),
    "coin": Relief(
        "Coin", "A coin of 9 mm: a star, beads and a rim, 0.25 mm high.", (9.0, 9.0), 0.4, _coin
    ),
    "brick": Relief(
        "Brick", "Four studs of a toy brick at half scale, 2.4 mm wide.", (8.0, 8.0), 0.5, _brick
    ),
    "cable": Relief(
        "Cable", "A twisted pair of wires of 1.5 mm, 8 mm of it.", (8.0, 3.0), 0.6, _cable
    ),
    "wedge": Relief(
        "Wedge", "An edge of 6 mm between flanks of 20 and 35 degrees.", (5.0, 6.0), 0.7, _wedge
    ),
    "letters": Relief(
        "Letters", "The word READ in raised letters of 2.8 mm.", (7.8, 3.4), 0.45, _letters
    ),
    "nut": Relief("Nut", "An M3 nut, 5.5 mm across its flats.", (6.4, 5.5), 0.45, _nut),
    "weave": Relief(
        "Weave", "A woven texture with 1.3 mm from thread to thread.", (7.0, 7.0), 0.4, _weave
    ),
    "key": Relief(
        "Key", "The edge of a key of 2 mm with five cuts.", (8.4, 2.0), 0.7, _key
    ),
    "bean": Relief(
        "Bean", "A coffee bean of 7 x 5 mm with its furrow.", (7.2, 5.0), 0.6, _bean
    ),
    "braille": Relief(
        "Braille", "Five dots of a Braille cell, 0.48 mm high.", (5.0, 7.4), 0.45, _braille
    ),
}  # fmt: skip
"""The objects by the names that contacts give them."""


@dataclass(frozen=True)
class ObjectIndenter(IndenterKind):
    """One of the objects that come with the package.

    Attributes:
        name: name of the object, a key of `OBJECTS`.
        scale: factor on its size.
    """

    kind: ClassVar[str] = "object"

    name: str
    scale: float = quantity("", "The factor on the object's real size.", 1.0, low=0.01, high=100.0)

    def __post_init__(self) -> None:
        """Raise ContactError if there is no such object, or the scale is outside its limits."""
        if self.name not in OBJECTS:
            near = suggestion(self.name, OBJECTS)
            raise ContactError(
                f"there is no object '{self.name}'", hint=near or "Known: " + ", ".join(OBJECTS)
            )
        super().__post_init__()

    @classmethod
    def from_text(cls, text: str) -> ObjectIndenter:
        """Read NAME or NAME,SCALE; see `IndenterKind.from_text`."""
        name, separator, scale = text.strip().partition(",")
        try:
            return cls(name, float(scale) if separator else 1.0)
        except ValueError:
            raise ContactError(
                f"the scale of an object is '{scale}'",
                hint="Write object:NAME or object:NAME,SCALE",
            ) from None

    @classmethod
    def from_plain(cls, values: Mapping[str, Any]) -> ObjectIndenter:
        """Read `name` and optionally `scale`; see `IndenterKind.from_plain`."""
        name, scale = values.get("name"), values.get("scale", 1.0)
        if not isinstance(name, str) or not set(values) <= {"name", "scale"}:
            raise ContactError(
                "an object needs a 'name' and may have a 'scale'",
                hint="Known: " + ", ".join(OBJECTS),
            )
        if isinstance(scale, bool) or not isinstance(scale, int | float):
            raise ContactError(f"the scale of an object is {scale!r}", hint="Give a number")
        return cls(name, float(scale))

    @cached_property
    def _mesh(self) -> TriangleMesh:
        return OBJECTS[self.name].mesh().transformed(np.eye(3) * self.scale)

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """Return the triangles up to that height, or all of them; see `Indenter.mesh`."""
        whole = self._mesh
        near = whole.vertices[whole.faces, 2].min(axis=1) <= reach
        return whole.with_faces(whole.faces[near]).compacted()

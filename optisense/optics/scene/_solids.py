"""Transparent solids, the opaque sheets on them, and the interfaces between media."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray
from optisense.geometry.containment import inside
from optisense.geometry.mesh import TriangleMesh
from optisense.optics.scene.surfaces import CLEAR, RGB

AIR = "air"
"""Name of the medium around all solids."""

PROBE = 0.02
"""Distance (mm) off a sheet or a light at which the medium beside it is looked up: ten times the
distance below which faces touch, and no more than the thinnest film that a design holds."""


@dataclass(frozen=True)
class Solid:
    """A closed transparent part.

    Attributes:
        name: the part's name, for messages.
        mesh: closed mesh, mm.
        medium: the name of its optical material.
        ior: its refractive index.
        roughness: roughness of its surface (microfacet alpha), 0 for smooth.
        priority: rank among overlapping solids; the one with the larger number fills the overlap.
        absorption: absorption coefficient of the medium at R, G, B, 1/mm.
        indices: refractive index at R, G, B; None if it is `ior` in all channels.
    """

    name: str
    mesh: TriangleMesh
    medium: str
    ior: float
    roughness: float = 0.0
    priority: int = 0
    absorption: RGB = CLEAR
    indices: RGB | None = None

    def index(self, channel: int) -> float:
        """Return the refractive index at R, G or B (0 to 2)."""
        return self.ior if self.indices is None else self.indices[channel]


AROUND = Solid("", TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)), AIR, 1.0)
"""The air around all solids, which has no shape."""


@dataclass(frozen=True)
class Sheet:
    """An opaque surface (a coating, a mirror, the skin of a blocker), which may lie on solids.

    Attributes:
        name: the part's name.
        mesh: open or closed mesh, mm.
        kind: name of the kind of sheet, for messages.
    """

    name: str
    mesh: TriangleMesh
    kind: str = "coating"


@dataclass(frozen=True)
class Interface:
    """A refracting surface between two media.

    Attributes:
        mesh: open or closed mesh, mm; its normals point from `inside` to `outside`.
        inside, outside: names of the media; "air" where there is no solid.
        ior_inside, ior_outside: their refractive indices.
        roughness: microfacet alpha, that of the rougher of the two solids that touch.
        names: the solids that it bounds, the one on its inside first.
        etas: index on the inside over that on the outside, at R, G, B; None if the ratio of
            `ior_inside` and `ior_outside` holds for all channels.
        absorption: absorption coefficients (1/mm) at R, G, B, on the inside and on the outside.
    """

    mesh: TriangleMesh
    inside: str
    outside: str
    ior_inside: float
    ior_outside: float
    roughness: float
    names: tuple[str, ...]
    etas: RGB | None = None
    absorption: tuple[RGB, RGB] = (CLEAR, CLEAR)


def solid_at(points: FloatingArray, solids: Sequence[Solid]) -> NDArray[np.int64]:
    """Return the number (n,) of the solid at each point (n, 3), mm; -1 for air."""
    found = np.full(len(points), -1)
    rank = np.full(len(points), -np.inf)
    for number, solid in enumerate(solids):
        here = inside(points, solid.mesh) & (solid.priority > rank)
        found[here], rank[here] = number, solid.priority
    return found

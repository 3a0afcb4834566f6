"""Removal of the seams between solids that touch, such as the layers of a gel."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations

import numpy as np

from optisense.geometry.coincidence import Overlay, cut, find_coincident
from optisense.geometry.connected import connected_components
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.overlaps import CONTACT


def without_seams(solids: Sequence[TriangleMesh]) -> list[TriangleMesh]:
    """Return one mesh for each group of solids that touch, without the faces (or parts of faces) at
    which they do; cached for the next calls with the same solids.

    A solid that touches no other is returned as it is. The layers of a gel become one body, as
    thick as all of them together.

    Args:
        solids: closed meshes, mm, with outward face normals; faces touch within `CONTACT`.
    """
    return list(_without_seams(tuple(solids))) if len(solids) > 1 else list(solids)


@lru_cache(maxsize=8)
def _without_seams(solids: tuple[TriangleMesh, ...]) -> tuple[TriangleMesh, ...]:
    seams: list[list[Overlay]] = [[] for _ in solids]
    touching = []
    for one, other in combinations(range(len(solids)), 2):
        found = find_coincident(solids[one], solids[other], CONTACT, facing=True)
        if len(found.pairs):
            touching.append((one, other))
            seams[one].append(found)
            seams[other].append(found.reversed())
    ends = np.array(touching, dtype=np.int64).reshape(-1, 2)
    group = connected_components(len(solids), ends[:, 0], ends[:, 1])
    outer = [cut(solid, at)[-1] if at else solid for solid, at in zip(solids, seams, strict=True)]
    bodies = [[outer[k] for k in np.flatnonzero(group == number)] for number in np.unique(group)]
    return tuple(body[0] if len(body) == 1 else TriangleMesh.joined(body) for body in bodies)

"""What is left of a solid without the space that it shares with another one."""

from __future__ import annotations

import weakref

from optisense.geometry.bodies import united
from optisense.geometry.common_space import as_manifold, of_manifold, thick_place
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.overlaps import CONTACT

Rests = weakref.WeakKeyDictionary[TriangleMesh, TriangleMesh | None]

_rests: weakref.WeakKeyDictionary[TriangleMesh, Rests] = weakref.WeakKeyDictionary()


def without(first: TriangleMesh, second: TriangleMesh) -> TriangleMesh:
    """Return a solid without the space that it shares with another one, or the solid itself if they
    share none or nothing would be left; cached for the next call with the same solids.

    Unlike `common_space`, this also finds solids that share space without crossing each other's
    surfaces, as those with sides in one plane. Bodies of one solid may overlap.

    Args:
        first, second: closed meshes, mm.
    """
    beside = _rests.setdefault(first, weakref.WeakKeyDictionary())
    if second not in beside:
        beside[second] = _carved(first, second)
    rest = beside[second]
    return first if rest is None else rest


def _carved(first: TriangleMesh, second: TriangleMesh) -> TriangleMesh | None:
    if ((first.bounds[0] >= second.bounds[1]) | (first.bounds[1] <= second.bounds[0])).any():
        return None
    if thick_place(as_manifold(first) ^ as_manifold(second), CONTACT) is None:
        return None
    # A difference of solids that overlap themselves counts the space of two bodies twice.
    rest = as_manifold(united(first)) - as_manifold(united(second))
    return None if rest.is_empty() else of_manifold(rest)

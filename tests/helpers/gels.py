"""Gels by their skin and their bodies, into which contacts are pressed."""

from __future__ import annotations

from optisense.geometry import SensingSurface, TriangleMesh
from optisense.geometry.contact import place
from optisense.mechanics import Elasticity, Gel

MINI_GEL = Elasticity(0.435, 0.49)
"""Constants of the gel of a GelSight Mini; its friction is 1."""


def pad(width: float, depth: float, thickness: float) -> tuple[TriangleMesh, TriangleMesh]:
    """Return the skin of a flat gel, which looks into it, and its body, mm."""
    half = width / 2, depth / 2
    top = TriangleMesh.grid((width, depth)).flipped()
    return top, TriangleMesh.box((-half[0], -half[1], -thickness), (*half, 0.0))


def gel_of(skin, *bodies, elasticity=MINI_GEL, origin=(0, 0, 0), placed=None):
    """Return the gel below a skin; x and y of its surface are those of the frame at the origin."""
    surface = SensingSurface(skin, origin, (1, 0, 0), (0, 1, 0))
    usual = placed or (lambda contact: place(contact, surface, list(bodies)))
    return Gel(surface, skin, list(bodies), elasticity, usual)

"""Geometry: meshes, cages, indenters, and the places and depths of contacts."""

from optisense.geometry._indenters import Cylinder, MeshIndenter, Plane, Sphere
from optisense.geometry._places import nine_places
from optisense.geometry.cage import cage_points, cage_weights, deform
from optisense.geometry.contact import Contact, available_depth, locate, place
from optisense.geometry.contact_text import parse_contact, parse_place
from optisense.geometry.indenter_kinds import (
    INDENTERS,
    Indenter,
    IndenterKind,
    quantity,
    register_indenter,
)
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.rays import RayHits, ray_hits
from optisense.geometry.surface import SensingSurface, SurfacePoint

__all__ = [
    "INDENTERS",
    "Contact",
    "Cylinder",
    "Indenter",
    "IndenterKind",
    "MeshIndenter",
    "Plane",
    "RayHits",
    "SensingSurface",
    "Sphere",
    "SurfacePoint",
    "TriangleMesh",
    "available_depth",
    "cage_points",
    "cage_weights",
    "deform",
    "locate",
    "nine_places",
    "parse_contact",
    "parse_place",
    "place",
    "quantity",
    "ray_hits",
    "register_indenter",
]

"""Keywords of the design file as choices of menus."""

from __future__ import annotations

Items = list[tuple[str, str, str]]

OBJECT_KINDS: Items = [
    ("NONE", "None", "Not part of the sensor"),
    ("PART", "Part", "A solid or surface of the sensor"),
    ("LIGHT", "Light", "One light of a group"),
    ("CAMERA", "Camera", "The sensor's camera"),
    ("CAGE", "Cage", "Control points that bend parts"),
    ("CONTACT", "Contact", "An object that presses on the sensor"),
    ("REFERENCE", "Reference", "A shape that parts, lights and the camera are placed by"),
    ("SHOWN", "Shown", "Drawn by the extension, such as chief rays; not saved"),
]

ROLES: Items = [
    ("sensing_surface", "Sensing surface", "Inside of the opaque coating; normals point inward"),
    ("elastomer", "Elastomer", "A closed, soft, transparent solid"),
    ("support", "Support", "A closed, rigid, transparent solid"),
    ("mirror", "Mirror", "A reflecting surface or solid"),
    ("blocker", "Blocker", "Opaque: stops light"),
    ("interface", "Interface", "A refracting sheet"),
    ("indenter", "Indenter", "An object that touches the sensor"),
]

REFERENCES: Items = [
    ("sensing_surface", "Sensing surface reference", "Becomes the coated surface"),
    ("camera", "Camera reference", "Place of the camera"),
    ("light", "Light reference", "Place of lights"),
    ("support", "Support structure reference", "Becomes a transparent support"),
    ("elastomer", "Elastomer reference", "Becomes the gel"),
    ("indenter", "Indenter reference", "Becomes a contact of this shape"),
    ("mirror", "Mirror reference", "Becomes a mirror"),
    ("blocker", "Blocking reference", "Becomes an opaque part"),
    ("interface", "Interface reference", "Becomes a refracting sheet"),
]

PROJECTIONS: Items = [
    ("perspective", "Perspective", "A pinhole camera"),
    ("equidistant", "Fisheye", "Equal angles are equal distances in the picture"),
]

INDENTERS: Items = [
    ("sphere", "Sphere", "A ball"),
    ("cylinder", "Cylinder", "A lying cylinder"),
    ("plane", "Plane", "A flat face"),
    ("mesh", "Mesh", "A mesh file; its lowest point touches first"),
]

PRESSING: Items = [
    ("DEPTH", "Depth", "The indenter is pressed in to this depth"),
    (
        "FORCE",
        "Force",
        "The indenter is pressed in with this force; the elastic gel determines the depth",
    ),
]

SKINS: Items = [
    ("elastic", "Elastic", "The gel deforms around contacts as well; forces are known"),
    ("conforming", "Conforming", "The skin takes the shape of the indenter; forces are not known"),
]

GHOST = "ghost "
"""Beginning of the keys of objects that show the best parts of a search."""

LOOKS: dict[str, tuple[float, float, float, float]] = {
    "sensing_surface": (0.55, 0.57, 0.6, 0.5),
    "elastomer": (0.95, 0.62, 0.35, 0.16),
    "support": (0.45, 0.75, 0.95, 0.16),
    "mirror": (0.85, 0.88, 0.93, 0.9),
    "blocker": (0.06, 0.07, 0.09, 0.22),
    "interface": (0.47, 0.38, 0.92, 0.3),
    "indenter": (0.48, 0.37, 0.07, 1.0),
}
"""Colour (linear red, green, blue) and opacity of each role: gel and acrylic look like glass and
housings fade, so that lights and the lit parts are visible.
"""

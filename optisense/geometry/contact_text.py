"""Contacts written as text, for the command line.

    contact  = indenter "@" place ":" depth [ ":" rotation ]
    indenter = "sphere:" radius
             | "cylinder:" radius [ "," length ]
             | "plane" [ ":" tilt_x "," tilt_y [ "," size ] ]
             | "mesh:" path [ "," scale ]
    place    = u "," v  |  x "," y "," z

Lengths are in mm, angles in degrees; two numbers are surface coordinates, three are a point in
the frame of the design. Examples: `sphere:1.5@0,0:0.8`, `cylinder:2@1,-3:0.5:90`,
`plane:0,5@0,0:0.3`, `mesh:screw.stl,1000@2,2:0.4`.
"""

from __future__ import annotations

import difflib

from optisense.errors import ContactError
from optisense.geometry.contact import Contact
from optisense.geometry.indenters import Cylinder, Indenter, MeshIndenter, Plane, Sphere

_KINDS = ("sphere", "cylinder", "plane", "mesh")
_FORM = "write it as KIND:SIZE@U,V:DEPTH, for example sphere:1.5@0,0:0.8, in mm without the unit"


def parse_contact(text: str) -> Contact:
    """Read a contact such as `sphere:1.5@0,0:0.8`; the module says all it may be.

    Raises:
        ContactError: the text is not a contact, or its numbers make no sense. (A mesh file is
            read when the contact is placed.)
    """
    try:
        shape, separator, rest = text.strip().rpartition("@")
        if not separator:
            raise ContactError("there is no '@' before the place", hint=_FORM)
        fields = rest.split(":")
        if len(fields) not in (2, 3):
            raise ContactError("there is no depth after the place", hint=_FORM)
        coordinates = _numbers(fields[0], "the place", (2, 3))
        depth = _numbers(fields[1], "the depth", (1,))[0]
        rotation = _numbers(fields[2], "the rotation", (1,))[0] if len(fields) == 3 else 0.0
        indenter = _indenter(shape)
        if len(coordinates) == 3:
            x, y, z = coordinates
            return Contact(indenter, point=(x, y, z), depth=depth, rotation=rotation)
        u, v = coordinates
        return Contact(indenter, at=(u, v), depth=depth, rotation=rotation)
    except ContactError as error:
        raise ContactError(
            error.message, where=f"contact '{text}'", hint=error.hint or _FORM
        ) from error


def _indenter(text: str) -> Indenter:
    kind, _, sizes = text.strip().partition(":")
    if kind == "sphere":
        return Sphere(*_numbers(sizes, "the radius of the sphere", (1,)))
    if kind == "cylinder":
        return Cylinder(*_numbers(sizes, "the radius of the cylinder", (1, 2)))
    if kind == "plane":
        return Plane(*_numbers(sizes, "the tilt of the plane", (2, 3))) if sizes else Plane()
    if kind == "mesh":
        return _mesh_indenter(sizes)
    near = difflib.get_close_matches(kind, _KINDS, 1)
    raise ContactError(
        f"'{kind}' is not a kind of indenter",
        hint=f"did you mean '{near[0]}'?" if near else "use one of " + ", ".join(_KINDS),
    )


def _mesh_indenter(text: str) -> MeshIndenter:
    path, separator, scale = text.rpartition(",")
    if separator and path:
        try:
            return MeshIndenter(path, float(scale))
        except ValueError:  # the comma belongs to the file name
            pass
    if not text:
        raise ContactError("no mesh file is named", hint="write mesh:PATH@U,V:DEPTH")
    return MeshIndenter(text)


def _numbers(text: str, name: str, counts: tuple[int, ...]) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in counts:
        wanted = " or ".join(str(count) for count in counts)
        kind = "number" if wanted == "1" else "numbers"
        raise ContactError(f"{name} needs {wanted} {kind}, not '{text}'", hint=_FORM)
    return values

"""Contacts written as text, for the command line.

    contact  = indenter "@" place ":" ( depth | force "N" ) [ ":" rotation ] { ";" motion }
    motion   = "shift=" u "," v  |  "twist=" angle
    indenter = "sphere:" radius
             | "cylinder:" radius [ "," length [ "," angle ] ]
             | "plane" [ ":" tilt_x "," tilt_y [ "," size ] ]
             | "mesh:" path [ "," scale ]
             | "object:" name [ "," scale ]
             | any other kind in `INDENTERS` and its numbers
    place    = u "," v  |  x "," y "," z

Lengths are in mm, forces in newtons, angles in degrees; two numbers are surface coordinates, three
are a point in the frame of the design. Examples: `sphere:1.5@0,0:0.8`, `cylinder:2@1,-3:0.5:90`,
`plane:0,5@0,0:0.3`, `mesh:screw.stl,1000@2,2:0.4`, `sphere:3@0,0:2N`,
`sphere:1.5@0,0:0.8;shift=0.2,0;twist=5`.
"""

from __future__ import annotations

import math

from optisense.errors import ContactError
from optisense.geometry.contact import Contact
from optisense.geometry.indenter_kinds import INDENTERS, Indenter

INDENTER_FORM = (
    "Write sphere:RADIUS, cylinder:RADIUS[,LENGTH], plane, mesh:FILE[,SCALE] or object:NAME"
)
_FORM = "Write it as KIND:SIZE@U,V:DEPTH, for example sphere:1.5@0,0:0.8, in mm without the unit"


def parse_contact(text: str) -> Contact:
    """Read a contact such as `sphere:1.5@0,0:0.8`; see the module for the syntax.

    Raises:
        ContactError: the text is not a contact, or its numbers are invalid. (A mesh file is read
            when the contact is placed.)
    """
    try:
        shape, separator, rest = text.strip().rpartition("@")
        if not separator:
            raise ContactError("there is no '@' before the place", hint=_FORM)
        rest, *motions = rest.split(";")
        shift, twist = _motion(motions)
        fields = rest.split(":")
        if len(fields) not in (2, 3):
            raise ContactError("there is no depth after the place", hint=_FORM)
        coordinates = _numbers(fields[0], "the place", (2, 3))
        depth, force = _depth_or_force(fields[1])
        rotation = _numbers(fields[2], "the rotation", (1,))[0] if len(fields) == 3 else 0.0
        u, v, *rest_of_point = coordinates
        return Contact(
            parse_indenter(shape),
            at=None if rest_of_point else (u, v),
            point=(u, v, rest_of_point[0]) if rest_of_point else None,
            depth=depth,
            rotation=rotation,
            force=force,
            shift=shift,
            twist=twist,
        )
    except ContactError as error:
        raise ContactError(
            error.message, where=f"contact '{text}'", hint=error.hint or _FORM
        ) from error


def _motion(words: list[str]) -> tuple[tuple[float, float], float]:
    """Return the shift and the twist of words such as `shift=0.2,0`."""
    shift, twist = Contact.shift, Contact.twist
    for word in words:
        name, _, value = word.partition("=")
        if name.strip() == "shift":
            u, v = _numbers(value, "the shift", (2,))
            shift = u, v
        elif name.strip() == "twist":
            twist = _numbers(value, "the twist", (1,))[0]
        else:
            raise ContactError(
                f"'{word}' is no motion of a contact that can be read",
                hint="Write ;shift=U,V in mm or ;twist=DEGREES",
            )
    return shift, twist


def parse_place(text: str) -> tuple[float, float] | tuple[float, float, float]:
    """Read a place such as `3,-2`, in mm; see the module for the syntax.

    Raises:
        ContactError: the text is neither two nor three finite numbers.
    """
    try:
        numbers = _numbers(text, "a place", (2, 3))
        if not all(map(math.isfinite, numbers)):
            raise ContactError(f"a place needs finite numbers, not '{text}'")
    except ContactError as error:
        raise ContactError(
            error.message, where=f"place '{text}'", hint="Write it as U,V in mm, for example 3,-2"
        ) from error
    if len(numbers) == 2:
        return numbers[0], numbers[1]
    return numbers[0], numbers[1], numbers[2]


def parse_indenter(text: str) -> Indenter:
    """Read an indenter, such as `sphere:1.5`.

    Raises:
        ContactError: there is no such kind of indenter, or its numbers are invalid.
    """
    kind, _, sizes = text.strip().partition(":")
    try:
        return INDENTERS.find(kind).from_text(sizes)
    except ContactError as error:
        hint = error.hint or INDENTER_FORM
        raise ContactError(error.message, where=f"indenter '{text}'", hint=hint) from error


def _depth_or_force(text: str) -> tuple[float, float | None]:
    """Return the depth of a number without a unit, or the default depth and a force in N."""
    word = text.strip()
    if word[-1:] in ("N", "n") and word[:-1].strip()[-1:] in "0123456789.":
        return Contact.depth, _numbers(word[:-1], "the force", (1,))[0]
    return _numbers(text, "the depth", (1,))[0], None


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

"""Kinds of indenters that can be named in the text of contacts, in requests of front ends and in
the studio.

A kind is one class. Its numbers are the fields of a dataclass, each made by `quantity`, which holds
their units, limits and help; from them follow the text form (`cylinder:2,10`) and the form of
requests (`{"kind": "cylinder", "radius": 2}`). The kinds of this package are in `_indenters.py` and
`objects/_catalogue.py` of this folder; docs/extending.md adds one.
"""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from optisense.errors import ContactError, MeshError, OwnCodeError
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.rotations import turn_about_axes
from optisense.keyword_types import is_real
from optisense.near import suggestion
from optisense.own_code import REPAIR, failures_named
from optisense.registry import Registry, must_derive, place_of_definition
from optisense.text import brief

OWN_PACKAGE = __name__.partition(".")[0]
"""Name of the package whose indenters return what `Indenter.mesh` promises."""

FACET_ERROR = 4e-4
"""Largest distance (mm) of facets from the exact shape: a hundredth of the width that a pixel of
the built-in sensors sees (0.04 mm and more)."""

ABOVE_ZERO = 5e-324
"""Lower limit of factors that must be above 0: the smallest positive number in double precision."""

SMALLEST = 1e-3
"""Smallest length (mm) of an indenter: no camera sees the contact of a ball of this radius."""

LARGEST = 1e4
"""Largest length (mm) of an indenter: on the 20 mm of a sensor, a ball of this radius deviates from
a plane by 5e-3 mm."""


class Indenter(Protocol):
    """Anything that can be pressed into a sensor.

    A convex indenter, which cannot shade itself, may have the attribute ``convex = True``; its
    images then take fewer shadow rays.
    """

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """Return the surface from its lowest point up to height `reach`, or more of it.

        Args:
            reach: height (mm) above which parts cannot touch the sensor and may be left out.
            facet_error: largest distance of the facets from the exact shape, mm.

        Returns:
            A mesh with outward shading normals in the indenter's frame, whose lowest point is at
            z = 0, except for the error of the facets.
        """
        ...


@dataclass(frozen=True)
class Quantity:
    """One number of an indenter.

    Attributes:
        unit: unit, such as "mm"; empty for a plain number.
        help: description, one sentence.
        low, high: smallest and largest allowed value.
    """

    unit: str
    help: str
    low: float = -math.inf
    high: float = math.inf

    def check(self, owner: str, name: str, value: Any) -> None:
        """Raise ContactError if a value is not a finite number or is outside the limits."""
        if is_real(value) and math.isfinite(value) and self.low <= value <= self.high:
            return
        if self.low == ABOVE_ZERO:
            hint = "Give one above 0"
        elif math.isfinite(self.low) and math.isfinite(self.high):
            hint = f"Keep it from {self.low:g} to {self.high:g} {self.unit}".rstrip()
        else:
            hint = "Give a finite number"
        title = name.replace("_", " ")
        text = f"{value:g}" if is_real(value) else brief(repr(value))
        raise ContactError(f"the {title} of an indenter ({owner}) is {text}", hint=hint)


def quantity(
    unit: str,
    help: str,
    default: float | None = None,
    *,
    low: float = -math.inf,
    high: float = math.inf,
) -> Any:
    """Return a field of an indenter's dataclass; the field is required if it has no default.

    Args:
        unit: unit, such as "mm"; empty for a plain number.
        help: description, one sentence.
        default: default value; None if the number is required.
        low, high: smallest and largest allowed value.
    """
    metadata = {"quantity": Quantity(unit, help, low, high)}
    if default is None:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


@dataclass(frozen=True)
class IndenterKind(ABC):
    """Base of indenters that have a name; a subclass is a frozen dataclass of quantities.

    Attributes:
        kind: the name in text and requests, in lower case.
        convex: whether it is convex, so that no part of its surface can shade another.
    """

    kind: ClassVar[str]
    convex: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Raise ContactError if a number is outside its limits."""
        for name, each in self.quantities().items():
            each.check(self.kind, name, getattr(self, name))

    @abstractmethod
    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """Return the mesh; see `Indenter.mesh`."""

    def tilted(self, tilt_x: float, tilt_y: float) -> Indenter:
        """Return the indenter rotated by angles (degrees) about its x and then its y axis."""
        return Tilted(self, tilt_x, tilt_y)

    @classmethod
    def quantities(cls) -> dict[str, Quantity]:
        """Return the numbers of this kind by name, in the order of the text form."""
        return {
            each.name: each.metadata["quantity"]
            for each in dataclasses.fields(cls)
            if "quantity" in each.metadata
        }

    @classmethod
    def from_text(cls, text: str) -> IndenterKind:
        """Read the text after the colon: the numbers in their order.

        Raises:
            ContactError: there are too few or too many numbers, or one is outside its limits.
        """
        fields = dataclasses.fields(cls)
        needed = sum(each.default is MISSING for each in fields)
        words = text.split(",") if text else []
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = [math.nan] * (len(fields) + 1)
        if not needed <= len(values) <= len(fields):
            names = [each.name.upper() for each in fields]
            form = ",".join(names[:needed]) + "".join(f"[,{name}]" for name in names[needed:])
            if not needed:
                form = form.replace(",", "", 1)
            raise ContactError(
                f"a {cls.kind} can't be read from '{text}'", hint=f"Write {cls.kind}:{form}"
            )
        return cls(*values)

    @classmethod
    def from_plain(cls, values: Mapping[str, Any]) -> IndenterKind:
        """Read the numbers of a request, by name.

        Raises:
            ContactError: a value is missing, unknown, not a number, or outside its limits.
        """
        known = {each.name: each for each in dataclasses.fields(cls)}
        for name in values:
            if name not in known:
                raise ContactError(f"a {cls.kind} has no '{name}'", hint=suggestion(name, known))
        for name, each in known.items():
            if each.default is MISSING and name not in values:
                raise ContactError(
                    f"a {cls.kind} needs '{name}'", hint=each.metadata["quantity"].help
                )
        numbers = {}
        for name, value in values.items():
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ContactError(
                    f"the {name} of a {cls.kind} is {value!r}, which is no number",
                    hint=known[name].metadata["quantity"].help,
                )
            numbers[name] = float(value)
        return cls(**numbers)


def mesh_of(indenter: Indenter, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
    """Return the mesh of an indenter (see `Indenter.mesh`), which is checked if its class is not of
    this package.

    Raises:
        OwnCodeError: the method `mesh` fails, or returns what can't be pressed in.
        MeshError, ContactError: a mesh file can't be read, or is empty or of the wrong size.
    """
    if type(indenter).__module__.partition(".")[0] == OWN_PACKAGE:
        return indenter.mesh(reach, facet_error)
    name = getattr(indenter, "kind", type(indenter).__name__)
    what, where = f"mesh() of the indenter '{name}'", place_of_definition(type(indenter).mesh)
    with failures_named(what, where):
        mesh = indenter.mesh(reach, facet_error)
    problem = _misfit(mesh, name, facet_error)
    if problem is None:
        return mesh
    raise OwnCodeError(f"{what} returned {problem}", where=where, hint=REPAIR)


def _misfit(mesh: object, name: str, facet_error: float) -> str | None:
    """Return why an object is no mesh of an indenter with facets as near to it, mm; or None."""
    if not isinstance(mesh, TriangleMesh):
        return f"{brief(repr(mesh))} instead of a TriangleMesh"
    try:
        mesh.validate(name, closed=False)
    except MeshError as error:
        return f"a mesh that can't be used: {error.message}"
    lowest = mesh.bounds[0, 2]
    if abs(lowest) > facet_error:
        return f"a mesh whose lowest point is at z = {lowest:g} instead of 0"
    return None


@dataclass(frozen=True)
class Tilted:
    """An indenter rotated about its x and then its y axis, and moved along z so that its lowest
    point is at z = 0.

    The point that was lowest stays above the place of the contact, so that small tilts move the
    indenter by little.

    Attributes:
        indenter: the indenter that is rotated.
        tilt_x, tilt_y: angles of rotation, degrees.
    """

    indenter: Indenter
    tilt_x: float
    tilt_y: float

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """Return the mesh of the whole rotated indenter; see `Indenter.mesh`."""
        whole = mesh_of(self.indenter, np.inf, facet_error)
        return lowest_at_zero(whole.transformed(turn_about_axes(self.tilt_x, self.tilt_y)))


def lowest_at_zero(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh moved along z so that its lowest point is at z = 0."""
    return TriangleMesh(mesh.vertices - (0.0, 0.0, mesh.bounds[0, 2]), mesh.faces, mesh.normals)


def tilted(indenter: Indenter, tilt_x: float, tilt_y: float) -> Indenter:
    """Return any indenter rotated by angles (degrees) about its x and then its y axis."""
    if isinstance(indenter, IndenterKind):
        return indenter.tilted(tilt_x, tilt_y)
    return Tilted(indenter, tilt_x, tilt_y)


def _check(name: str, kind: Any) -> None:
    must_derive(IndenterKind, ContactError, "kind of indenter")(name, kind)
    if not isinstance(getattr(kind, "kind", None), str):
        problem, hint = "has no attribute 'kind'", "Give it one: its name in text, in lower case"
    elif "__dataclass_fields__" not in vars(kind):
        problem, hint = "is no dataclass", "Decorate it with @dataclasses.dataclass(frozen=True)"
    elif not _reads_itself(kind) and (plain := _plain_fields(kind)):
        problem = f"has fields without a quantity: {', '.join(plain)}"
        hint = "Make them with optisense.geometry.quantity, or override from_text and from_plain"
    else:
        return
    raise ContactError(
        f"the class of the kind of indenter '{name}' {problem}",
        where=place_of_definition(kind),
        hint=hint,
    )


def _reads_itself(kind: type[IndenterKind]) -> bool:
    """Return whether a kind has its own reading of text and of requests."""
    return all(
        getattr(kind, name).__func__ is not getattr(IndenterKind, name).__func__
        for name in ("from_text", "from_plain")
    )


def _plain_fields(kind: type[IndenterKind]) -> list[str]:
    return [each.name for each in dataclasses.fields(kind) if "quantity" not in each.metadata]


INDENTERS: Registry[type[IndenterKind]] = Registry(
    "kind of indenter",
    "optisense.indenters",
    ContactError,
    {
        "sphere": "optisense.geometry._indenters:Sphere",
        "cylinder": "optisense.geometry._indenters:Cylinder",
        "plane": "optisense.geometry._indenters:Plane",
        "mesh": "optisense.geometry._indenters:MeshIndenter",
        "object": "optisense.geometry.objects._catalogue:ObjectIndenter",
    },
    _check,
)
"""Registry of the kinds of indenters; other packages add theirs under the entry-point group
`optisense.indenters`."""


def register_indenter(kind: type[IndenterKind]) -> type[IndenterKind]:
    """Add a kind of indenter by its `kind`; usable as a class decorator.

    Raises:
        ContactError: the name is taken or malformed, or the class does not fit.
    """
    _check(getattr(kind, "__name__", repr(kind)), kind)
    return INDENTERS.register(kind.kind, kind)


def indenter_from_plain(values: Mapping[str, Any]) -> IndenterKind:
    """Return the indenter of a request: its kind, and its numbers by name.

    Raises:
        ContactError: there is no such kind, or its numbers are invalid.
    """
    rest = dict(values)
    kind = rest.pop("kind", None)
    if not isinstance(kind, str):
        raise ContactError(
            "the indenter has no kind", hint="Known: " + ", ".join(INDENTERS.names())
        )
    return INDENTERS.find(kind).from_plain(rest)

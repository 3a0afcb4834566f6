"""Warnings about indenters that are smaller than anything that is pressed into a sensor."""

from __future__ import annotations

import numpy as np

from optisense.geometry._indenters import MeshIndenter
from optisense.geometry.contact import Contact
from optisense.geometry.indenter_kinds import Indenter, Tilted
from optisense.geometry.mesh import TriangleMesh

SMALL = 0.1
"""Largest extent, mm, below which an indenter is probably in another unit: two to three pixels of
the built-in sensors.
"""

COARSE = 0.01
"""Error of facets, mm, with which the extent is measured: a tenth of `SMALL`."""

PER_METRE = 1000.0
"""Factor from metres, the unit of robot models, to mm."""


def size_warning(contact: Contact) -> str | None:
    """Return a sentence about an indenter that is smaller than `SMALL` or than the depth of its
    contact, with the scale that a mesh file may need, or None.

    Raises:
        MeshError, ContactError: the mesh of the indenter can't be read.
    """
    reach = contact.depth
    mesh = contact.indenter.mesh(reach, COARSE)
    size = float(np.ptp(mesh.bounds, axis=0).max())
    if contact.force is None and size < reach:
        said = f"an indenter {size:.2g} mm large is pressed {reach:g} mm deep"
    elif size < SMALL:
        said = f"an indenter is {size:.2g} mm large, too small for the camera"
    else:
        return None
    file = _file(contact.indenter)
    if file is None:
        return said
    scaled = f"mesh:{file.source},{PER_METRE * file.scale:g}"
    return f"{said}; if its file is in metres, write {scaled}"


def _file(indenter: Indenter) -> MeshIndenter | None:
    """Return an indenter that is a mesh file, without its tilt, or None."""
    if isinstance(indenter, Tilted):
        return _file(indenter.indenter)
    if isinstance(indenter, MeshIndenter) and not isinstance(indenter.source, TriangleMesh):
        return indenter
    return None

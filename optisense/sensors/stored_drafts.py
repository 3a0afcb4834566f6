"""Drafts of the built-in sensors, which front ends show until they have one of their own.

`python scripts/stored_drafts.py` makes the files anew.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.errors import DesignError
from optisense.picture_files import read_picture
from optisense.sensors.registry import SENSORS, build

FOLDER = Path(__file__).parent / "drafts"
"""Folder of the drafts, a PNG file for each sensor."""


def stored_draft(design: SensorDesign) -> NDArray[np.uint8] | None:
    """Return the draft (h, w, 3) of a built-in sensor, without contacts and with the automatic
    exposure; None for a design that differs from all built-in sensors.

    Raises:
        DesignError: the file of the draft is damaged.
    """
    file = FOLDER / f"{design.name}.png"
    if design.name not in SENSORS or not file.is_file():
        return None
    own = build(design.name)
    same = own.model_dump() == design.model_dump() and all(
        np.array_equal(mesh.vertices, design.meshes[name].vertices)
        and np.array_equal(mesh.faces, design.meshes[name].faces)
        for name, mesh in own.meshes.items()
    )
    return read_picture(file, DesignError) if same else None

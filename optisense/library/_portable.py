"""Designs with lights of the user's own library, made to open on any machine."""

from __future__ import annotations

from typing import Any

from optisense.design.sensor_design import SensorDesign
from optisense.library.loader import entry, is_own


def with_own_lights(design: SensorDesign) -> SensorDesign:
    """Return the design, or a copy that describes the user's own lights itself.

    Materials and coatings are always copied into a design, and a camera's numbers too. A light is
    only named; other machines know the built-in ones. So each group whose light is one of the
    user's own gets it as its `emitter`, and saving the design copies its files.

    Raises:
        LibraryError: a light of the user can't be read.
    """
    groups = [
        name
        for name, group in design.lights.items()
        if group.emitter is None and is_own("light", group.model)
    ]
    if not groups:
        return design
    result = design.copy()
    for name in groups:
        emitter: Any = entry("light", result.lights[name].model).value
        folder = emitter.folder
        if folder is not None:  # In the design its files lie as in the library: lights/NAME.ies.
            emitter.renamed(lambda file, own=folder.name: f"{own}/{file}", folder.parent)
        result.lights[name].emitter = emitter
    return result

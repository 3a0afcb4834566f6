"""Materials, coatings, lights and cameras that designs can name, each number with its source."""

from optisense.library import ies
from optisense.library.entries import CameraModel, Entry, LightEntry, Source
from optisense.library.loader import (
    camera,
    coating,
    emitter,
    entry,
    light,
    material,
    names,
)
from optisense.library.scattering import specularity_to_roughness

__all__ = [
    "CameraModel",
    "Entry",
    "LightEntry",
    "Source",
    "camera",
    "coating",
    "emitter",
    "entry",
    "ies",
    "light",
    "material",
    "names",
    "specularity_to_roughness",
]

"""Materials, coatings, lights and cameras that designs can name, each number with its source."""

from optisense.design.materials import flake_lobe, specularity_to_roughness
from optisense.library._designs import (
    OVERDRIVEN,
    NominalFlux,
    nominal_flux,
    typical_colour,
    unused_imaging,
    unusual_fluxes,
    with_imaging,
    with_own_lights,
)
from optisense.library._entries import (
    AnyEntry,
    CameraModel,
    Entry,
    LightEntry,
    Source,
    TypicalLight,
)
from optisense.library.adding import Added, add_file, add_ies, add_tuning, parse_colour
from optisense.library.loader import (
    camera,
    coating,
    emitter,
    entry,
    is_own,
    light,
    material,
    names,
)
from optisense.library.storage import own_folder

__all__ = [
    "OVERDRIVEN",
    "Added",
    "AnyEntry",
    "CameraModel",
    "Entry",
    "LightEntry",
    "NominalFlux",
    "Source",
    "TypicalLight",
    "add_file",
    "add_ies",
    "add_tuning",
    "camera",
    "coating",
    "emitter",
    "entry",
    "flake_lobe",
    "is_own",
    "light",
    "material",
    "names",
    "nominal_flux",
    "own_folder",
    "parse_colour",
    "specularity_to_roughness",
    "typical_colour",
    "unused_imaging",
    "unusual_fluxes",
    "with_imaging",
    "with_own_lights",
]

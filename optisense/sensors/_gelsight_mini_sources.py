"""Sources of the numbers of GelSight Mini."""

from __future__ import annotations

from optisense.design import Provenance, Status
from optisense.sensors._sources import FLUXES, XP565, provenance_of


def provenance() -> dict[str, Provenance]:
    """Return the provenance by dotted path."""
    cad = "published CAD (gsmini_shell, 2022-10-24)"
    order = (
        "rows of 5 at 4 mm pitch on the guide's edges: count, pitch and place are not published; "
        "which side has which colour agrees with the shading of published ball presses"
    )
    assumed, sourced = Status.ASSUMED, Status.SOURCED
    table: dict[str, tuple[Status, str]] = {
        "coating": (sourced, "opaque grey without metal flakes, Lambertian (gsrobotics FAQ)"),
        "coating.reflectance": (assumed, "near the calibrated albedo of a flat gel, about 0.45"),
        **XP565,
        "materials.silicone-xp565.elasticity.youngs_modulus": (
            sourced,
            "E is 6 C10 with C10 = 0.0725 MPa, fitted to measured forces on this sensor's gel "
            "(FEATS project, published simulation input)",
        ),
        "materials.acrylic.ior": (sourced, "PMMA, Sultanova 2009 at 589 nm"),
        "parts.gel": (
            sourced,
            f"footprint 25.25 x 20.75 mm from the {cad}, thickness 4.25 mm from the datasheet "
            "(second hand); drawn flat and without its 1.5 mm corner radius: its sag is 0.23 mm "
            "over the field of view",
        ),
        "parts.skin": (sourced, "top face of the gel"),
        "parts.tray": (sourced, f"28.23 x 23.73 x 1 mm from the {cad}; its material is assumed"),
        "parts.guide": (assumed, "25.25 x 20.75 x 4 mm acrylic, in optical contact with the tray"),
        **{f"lights.{colour}": (assumed, order) for colour in ("red", "green", "blue")},
        **FLUXES,
        "camera.position": (assumed, "pupil 17 mm behind the back of the tray"),
        "camera.fov": (
            Status.DERIVED,
            "the width that shows 18.6 mm of the flat gel (datasheet, second hand), refracted "
            "through 13 mm air, 5 mm acrylic and 4.25 mm gel; from the assumed pupil",
        ),
        "camera.resolution": (sourced, "320 x 240 is the default of gsrobotics"),
    }
    return provenance_of(table)

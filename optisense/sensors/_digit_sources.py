"""Sources of the numbers of DIGIT."""

from __future__ import annotations

from collections.abc import Iterable

from optisense.design import Provenance, Status
from optisense.sensors._sources import FLUXES, provenance_of


def provenance(frosted: Iterable[str]) -> dict[str, Provenance]:
    """Provenance by dotted path; `frosted` names the faces of the acrylic that are frosted."""
    assumed, sourced, derived = Status.ASSUMED, Status.SOURCED, Status.DERIVED
    cad = "measured in the published CAD of DIGIT (facebookresearch/digit-design)"
    row = (
        f"34 mm apart along the acrylic's edge, {cad}; 1.55 mm under the gel, 0.2 mm from the edge "
        "and facing it are assumed. Published pictures are blue at the straight end, red left, "
        "green right, each brightest near its LED: lower LEDs, or a smoother edge, show less of it"
    )
    table: dict[str, tuple[Status, str]] = {
        "coating": (assumed, "grey, opaque and diffuse"),
        "coating.reflectance": (assumed, "as other grey coatings of the library"),
        "materials.silicone-solaris": (assumed, "the gel's silicone is not published"),
        "materials.silicone-solaris.elasticity": (
            assumed,
            "Young's modulus of Solaris by Gent's formula from its Shore hardness of 15A",
        ),
        "materials.acrylic.ior": (sourced, "PMMA, Sultanova 2009 at 589 nm"),
        "materials.black-plastic": (assumed, "the housing is printed in black"),
        "parts.gel": (
            sourced,
            f"outline, wall, height and dome {cad}; the dome is drawn as a paraboloid between "
            "its published rim and height, the edge as a parabola 0.6 mm wide and 0.78 mm high",
        ),
        "parts.skin": (assumed, "dome, rounded edge and wall of the gel are coated"),
        "parts.acrylic": (sourced, f"outline and thickness {cad}"),
        "parts.housing": (
            derived,
            f"opening of 18.58 x 25.19 mm and cavity of 20.8 x 30 mm {cad}; its height, its walls "
            "and where the acrylic lies in it are assumed",
        ),
        **{f"lights.{colour}": (derived, row) for colour in ("red", "green", "blue")},
        **FLUXES,
        "camera.position": (
            sourced,
            "pupil 21.7 mm under the top of the gel (configuration of the simulator TACTO; a "
            "community calibration has 22); under the middle of the outline is assumed",
        ),
        "camera.fov": (
            derived,
            "46.83 degrees across 240 pixels are TACTO's 60 along 320; a community calibration has "
            "45 along 320",
        ),
        "camera.resolution": (sourced, "240 x 320, at which DIGIT is used"),
    }
    for name in frosted:
        table[f"parts.acrylic.faces.{name}"] = (
            assumed,
            "cut by a laser and not polished; with a polished edge the picture is brightest far "
            "from each LED, unlike published ones",
        )
    return provenance_of(table)

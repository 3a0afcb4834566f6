"""Sources of the numbers of GelSight Svelte."""

from __future__ import annotations

from optisense.design import Provenance, Status
from optisense.sensors._sources import BALANCED, XP565, provenance_of

ANIMATION = (
    "side view in an animation on the first author's web site, digitised to about 1 pixel at an "
    "assumed scale of 0.70 mm a pixel (0.6 to 0.8 would fit a finger)"
)


def provenance(tip: bool) -> dict[str, Provenance]:
    """Return the provenance by dotted path; `tip` tells whether there is a blue light group."""
    assumed, derived, sourced = Status.ASSUMED, Status.DERIVED, Status.SOURCED
    table: dict[str, tuple[Status, str]] = {
        "coating": (assumed, "opaque grey; the coating of the sensor is not published"),
        **XP565,
        "materials.silicone-xp565.ior": (assumed, "the silicone of the skin is not published"),
        "materials.mirror-silver": (assumed, "the mirrors' metal is not published"),
        "parts.skin": (
            derived,
            f"outline of the palm: {ANIMATION}; drawn straight across, 20 mm wide (assumed)",
        ),
        "parts.gel": (assumed, "3.5 mm thick, 20 mm wide; neither is published"),
        "parts.M1": (
            derived,
            f"ends (5.8, 13.3) and (10.4, 88.2), arc of radius 130.5 mm: {ANIMATION}; stored "
            "flat, drawn straight across; 22 mm wide, nearly as wide as the body (assumed)",
        ),
        "parts.M2": (
            derived,
            f"lower end (16.7, -2.8), 22.4 degrees from the z axis: {ANIMATION}; as much of its "
            "24.3 mm as sees M1 past the gel; 18 mm wide (assumed)",
        ),
        "parts.M1.thickness": (assumed, "1 mm, usual for mirrors of plastic sheet"),
        "parts.M2.thickness": (assumed, "1 mm, as M1"),
        "parts.body.thickness": (assumed, "1 mm, usual for printed shells of this size"),
        "parts.side-walls.thickness": (assumed, "1 mm, as the body"),
        "parts.led-covers.thickness": (assumed, "1 mm, as the body"),
        "parts.led-covers": (
            assumed,
            "channels along both sides of the gel, without which the camera would see the LEDs",
        ),
        "parts.body": (
            derived,
            f"outline of the back: {ANIMATION}; the base is assumed; absorbs all light",
        ),
        "parts.side-walls": (assumed, "flat, as wide apart as mirrors and LEDs need"),
        "cages.M1.c_min": (derived, "flat (OptiSense paper), through the middle of the arc"),
        "cages.M1.c_max": (
            derived,
            "the largest curvature that stays clear of the skin (OptiSense paper): a parabola "
            "with its middle at rest, its ends forward until 0.5 mm are left",
        ),
        "cages.M1.blend": (
            derived,
            f"sagitta 5.5 mm, that of the arc in the {ANIMATION}, over the largest one; the "
            "parabola departs from the arc by less than 0.06 mm",
        ),
        "lights.red": (assumed, "red and green rows on the two sides: from memory of a press "
                       "report; 8 a side at 8 mm pitch, facing the sides of the gel: assumed"),
        "lights.green": (assumed, "as red"),
        "lights.red.flux": (derived, BALANCED),
        "lights.green.flux": (assumed, "as red"),
        "camera.model": (assumed, "an OV5647 in a small housing fits; the camera is not published"),
        "camera.position": (derived, f"the origin: {ANIMATION}"),
        "camera.direction": (derived, "the middle of the angles that camera.fov spans"),
        "camera.fov": (
            derived,
            "the angle between both ends of M2 (with view='palm': from its upper end to where it "
            "shows the lower end of M1), seen from the pupil",
        ),
        "camera.resolution": (sourced, "what the benchmarks of this project render"),
    }  # fmt: skip
    if tip:
        table["lights.blue"] = (assumed, "an option; not known to be in the sensor")
    return provenance_of(table)

"""Sources of the numbers of GelBelt. Its authors publish few of them."""

from __future__ import annotations

import math

from optisense.design import Provenance, Status
from optisense.sensors._sources import XP565, provenance_of


def gelbelt_sources(
    light_design: int,
    drawn: float,
    run: float,
    radius: float,
    layers: tuple[float, float],
    width: float,
) -> dict[str, Provenance]:
    """Return the provenance of a GelBelt with one of its light designs.

    No light reaches the return of the belt, which is not modelled: half a turn around a wheel, and
    a straight run. Lengths of the modelled inner face and of this run, the radius of the wheel, the
    thickness of tape and gel and the width of the belt are in mm.
    """
    tape, gel = layers
    inner, outer = radius + tape, radius + tape + gel
    left_out = math.pi * radius + run
    volume = width * (0.5 * math.pi * (outer**2 - inner**2) + gel * run)
    area = width * (math.pi * outer + run)
    way_back = f"{left_out:.0f} of {drawn + left_out:.0f} mm along the inner face"
    assumed, sourced, derived = Status.ASSUMED, Status.SOURCED, Status.DERIVED
    paper = "OptiSense paper, GelBelt"
    where = {
        1: "on the sides of the acrylic",
        2: "red and blue on the sides of the belt, green next to the acrylic",
        3: "red and blue on the sides of the belt, green behind a small roller",
    }[light_design]
    row = f"8 LEDs at 4 mm pitch, {where}: places are from the {paper}, counts are assumed"
    table: dict[str, tuple[Status, str]] = {
        "coating": (sourced, f"aluminium powder ({paper})"),
        "coating.reflectance": (assumed, "aluminium powder is brighter than grey paint"),
        "coating.specularity": (sourced, f"below 0.3 is best ({paper}); 0.2 is assumed"),
        **XP565,
        "materials.silicone-xp565.ior": (assumed, "no index in the maker's datasheet"),
        "materials.clear-tape.ior": (assumed, "polypropylene tape, usual value"),
        "materials.air-film.ior": (sourced, f"a thin layer of air is trapped ({paper})"),
        "materials.acrylic.ior": (sourced, "PMMA, Sultanova 2009 at 589 nm"),
        "parts.gel": (
            assumed,
            "3 mm of silicone XP-565, as wide as the window; 36 mm assumed; drawn as far as a "
            f"quarter turn around each wheel: the belt's way back is left out, {way_back}; it "
            f"takes {volume / 1000.0:.1f} cm^3 more",
        ),
        "parts.skin": (
            assumed,
            "outer face of the gel where it does not lie on a wheel; far-coat has the rest that is "
            f"drawn, and the belt's way back takes {area / 100.0:.0f} cm^2 more",
        ),
        "parts.tape": (
            assumed,
            "0.05 mm, usual for clear tape; drawn as far as the gel: the belt takes "
            f"{drawn + left_out:.0f} mm of it",
        ),
        "parts.film": (assumed, "0.02 mm: any gap of more than some wavelengths does the same"),
        "parts.window": (assumed, "50 x 36 x 6 mm"),
        "parts.wheels": (
            assumed,
            "radius 25 mm, so that a camera 42 mm from the sensing surface fits into the loop of "
            "the belt; axes 90 mm apart, so that they keep clear of the window; drawn black",
        ),
        "parts.far-coat": (
            assumed,
            "black, and drawn for a quarter turn only: light that gets there does not come back",
        ),
        "parts.far-coat.thickness": (assumed, "0.1 mm, usual for a sprayed coat of silicone"),
        **{f"lights.{colour}": (assumed, row) for colour in ("red", "green", "blue")},
        "lights.red.flux": (
            assumed,
            "a third of green, dimmed with resistors; only ratios matter to an auto-exposed "
            "picture",
        ),
        "lights.green.flux": (
            assumed,
            "nominal for a green SMD 3528 (library): green comes from one end and has a longer "
            "way than red and blue",
        ),
        "lights.blue.flux": (assumed, "as red"),
        "camera.position": (assumed, "42 mm from the sensing surface"),
        "camera.fov": (derived, "Raspberry Pi camera module 2 (datasheet); the module is assumed"),
        "camera.resolution": (assumed, "small enough for video rates"),
    }
    return provenance_of(table)

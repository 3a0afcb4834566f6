"""GelSight Mini with the light and the camera of a real unit.

`optisense calibrate` has fitted the powers of the lights, the camera's place and its processing to
published photographs; `scripts/fitted_mini.py` repeats the fit. The camera's processing is that of
the library's camera `gelsight-mini`, and the other numbers are in a YAML file beside this module.
Nobody has built the cylindrical and the spherical form, so these have the light
and the camera of the flat one.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import as_file, files
from typing import Any

from optisense import library
from optisense.design import Provenance, SensorDesign, Status, set_value
from optisense.design.yaml_reader import read_yaml
from optisense.sensors._gelsight_mini_ideal import (
    GelSightMiniDimensions,
    gelsight_mini_ideal,
    gelsight_mini_ideal_cylindrical,
    gelsight_mini_ideal_spherical,
)
from optisense.sensors.dimensions import describe_changes

FITTED_NUMBERS = "gelsight_mini_fitted.yaml"
"""Name of the file with the value at each fitted path, and its source."""

FITTED_CAMERA = "gelsight-mini"
"""Camera of the library with the fitted shading, stray light, colours and tone curve."""

VIEW_WIDTH = 20.3
"""Width of the skin that pictures of real units show, mm, from the size of balls in them; the
maker's datasheet states 18.6."""

GUIDE_SIZE = 28.23, 23.73
"""Size of a light guide as large as the tray, mm: with one as large as the gel, pictures have a
green border that no real unit shows."""


def unfitted_design(
    build: Callable[..., SensorDesign] = gelsight_mini_ideal, **dimensions: Any
) -> SensorDesign:
    """Return the design that the fit starts from: an ideal GelSight Mini, or a bent form of it,
    with a wide view and guide.
    """
    own: dict[str, Any] = {"view_width": VIEW_WIDTH, "guide_size": GUIDE_SIZE}
    design = build(**own | dimensions)
    design.name = design.name.replace("-ideal", "")
    what, _, _ = design.description.partition(", ideal camera")
    design.description = f"{what}, light and camera of a real unit"
    fields = GelSightMiniDimensions.model_fields
    defaults = {name: field.default for name, field in fields.items()} | own
    describe_changes(design, dimensions, defaults)
    assumed = Status.ASSUMED
    width, height = GUIDE_SIZE
    design.provenance["parts.guide"] = Provenance(
        status=assumed,
        source=f"{width:g} x {height:g} x 4 mm acrylic, as large as the tray: so photographs show "
        "no green border",
    )
    design.provenance["camera.fov"] = Provenance(
        status=Status.DERIVED,
        source=f"the width that shows {VIEW_WIDTH:g} mm of the flat gel, as photographs of balls "
        "do, refracted through air, acrylic and gel; from the assumed pupil",
    )
    return design


def gelsight_mini(**dimensions: Any) -> SensorDesign:
    """Build a GelSight Mini whose light and camera are those of a real unit.

    Its camera mixes colours, and has a tone curve, a black level and dark corners. So its pictures
    resemble those of the unit, and scores of pictures differ from those of `gelsight_mini_ideal`,
    whose camera is ideal.

    Args:
        dimensions: arguments of `gelsight_mini_ideal`. The defaults of `view_width` and
            `guide_size` are 20.3 mm and 28.23 x 23.73 mm. `led_flux` replaces the fitted powers.

    Raises:
        DesignError: dimensions contradict one another; the message says which.
        LibraryError: there is no such coating.
    """
    return _fitted(gelsight_mini_ideal, dimensions)


def gelsight_mini_cylindrical(rise: float = 6.0, **dimensions: Any) -> SensorDesign:
    """Build a GelSight Mini whose gel is bent to a cylinder along the short side (y), with the
    light and the camera of a real, flat unit.

    Args:
        rise: displacement of control points, mm: see `gelsight_mini_ideal_cylindrical`.
        dimensions: arguments of `gelsight_mini`.

    Raises:
        DesignError: see `gelsight_mini`; or the rise presses the gel through its tray.
    """
    return _fitted(gelsight_mini_ideal_cylindrical, {"rise": rise, **dimensions})


def gelsight_mini_spherical(rise: float = 9.0, **dimensions: Any) -> SensorDesign:
    """Build a GelSight Mini whose gel is bent to a dome, with the light and the camera of a real,
    flat unit.

    Args:
        rise: displacement of a control point, mm: see `gelsight_mini_ideal_spherical`.
        dimensions: arguments of `gelsight_mini`.

    Raises:
        DesignError: see `gelsight_mini`; or the rise presses the gel through its tray.
    """
    return _fitted(gelsight_mini_ideal_spherical, {"rise": rise, **dimensions})


def _fitted(build: Callable[..., SensorDesign], dimensions: dict[str, Any]) -> SensorDesign:
    """Return the design with the fitted numbers; a camera that `dimensions` move along its axis
    keeps its fitted place across it.
    """
    design = library.with_imaging(unfitted_design(build, **dimensions), FITTED_CAMERA)
    with as_file(files("optisense.sensors") / FITTED_NUMBERS) as path:
        fitted, _ = read_yaml(path)
    for place, entry in fitted.items():
        value = entry["value"]
        if place.endswith(".flux") and dimensions.get("led_flux") is not None:
            continue
        if place == "camera.position":
            value = [*value[:2], design.camera.position[2]]
        calibrated = Provenance(status=Status.CALIBRATED, source=entry["source"])
        # Sources of whole parts and groups stay: they hold for the numbers that are not fitted.
        sources = design.provenance | {place: calibrated}
        design = set_value(design, place, value)
        design.provenance = sources
    return design

"""Transfer of a library camera's imaging (shading, noise, colours) to a design."""

from __future__ import annotations

from typing import Any

from optisense.design.addressing import set_value
from optisense.design.camera import Camera
from optisense.design.sensor_design import Provenance, SensorDesign
from optisense.errors import LibraryError
from optisense.library.loader import camera, entry, names


def with_imaging(
    design: SensorDesign, name: str, *, focus_distance: float | None = None
) -> SensorDesign:
    """Return the design with the shading, noise, colours and tone curve of a camera of the library.

    The view is not changed: pose, projection, field of view and resolution. Data that the library
    lacks for that camera, such as its distortion, are not changed either. The sources of the
    numbers become the design's provenance.

    Args:
        design: design, which is not changed.
        name: name of the library's camera.
        focus_distance: distance from the entrance pupil to the focus in air, mm; it gives the lens
            the blur of its depth of field. None does not change the blur.

    Raises:
        LibraryError: there is no such camera, it has no such numbers, or the focal length and
            f-number for its depth of field are unknown.
        DesignError: the numbers do not fit the design.
    """
    known, found = camera(name), entry("camera", name)
    values: dict[str, Any] = known.imaging()
    sources = {field: found.source(field) for field in values}
    if focus_distance is not None:
        if known.focal_length is None or known.f_number is None:
            raise LibraryError(
                f"the focal length or the f-number of camera '{name}' is not known",
                hint="Give the design's camera a blur of kind 'defocus' with its numbers",
            )
        values["blur"] = {
            "kind": "defocus",
            "focal_length": known.focal_length,
            "f_number": known.f_number,
            "focus_distance": focus_distance,
        }
        sources["blur"] = found.source("f_number")
    if not values:
        raise LibraryError(
            f"the library has no data on distortion, shading, noise, colours or tone curve of "
            f"camera '{name}'",
            hint="Choose a camera with such data, or give the design's camera its own",
        )
    of_camera = design.camera.model_dump(mode="json") | values
    result = set_value(design, "camera", of_camera)
    replaced = [["camera", field] for field in values]
    provenance = {
        path: value
        for path, value in design.provenance.items()
        if path.split(".")[:2] not in replaced
    }
    for field, source in sources.items():
        if source is not None:
            provenance[f"camera.{field}"] = Provenance(status=source.status, source=source.source)
    result.provenance = provenance
    return result


def unused_imaging(used: Camera) -> str | None:
    """Return a sentence that says which data of the library an ideal camera does not use.

    Returns:
        None if the camera is not ideal, or the library has no such camera or no data on its
        shading, noise, colours or tone curve.
    """
    if not used.is_ideal or used.model not in names("camera"):
        return None
    fields = [field.replace("_", " ") for field in camera(used.model).imaging()]
    if not fields:
        return None
    *others, last = fields
    what = f"{', '.join(others)} and {last}" if others else last
    return f"the camera is ideal: {what} of {used.model} are not used"

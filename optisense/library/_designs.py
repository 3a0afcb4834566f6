"""Library parts in designs: imaging of cameras, the user's own lights, and typical fluxes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from optisense.design.addressing import set_value
from optisense.design.camera import Camera
from optisense.design.fields import Colour
from optisense.design.sensor_design import Provenance, SensorDesign
from optisense.errors import LibraryError
from optisense.library._entries import LightEntry, TypicalLight
from optisense.library.loader import camera, entry, is_own, names

OVERDRIVEN = 1.05
"""Ratio of a light's flux to its nominal flux from which on it is remarked."""

FAINT = 0.01
"""Ratio of a group's flux to the median of the groups that are on below which it is remarked: watts
in place of milliwatts are a thousandth, and the groups of the built-in sensors have 0.46 and more.
"""


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


def typical_colour(model: str, colour: Colour) -> tuple[str, TypicalLight] | None:
    """Return name and numbers of the colour of a library's light that has these shares of R, G and
    B, or None if the library has none, or can't read its entry.
    """
    try:
        found = entry("light", model)
    except LibraryError:
        return None
    assert isinstance(found, LightEntry)
    wanted = np.array(colour) / sum(colour)
    for name, typical in found.typical.items():
        if np.allclose(np.array(typical.colour) / sum(typical.colour), wanted, atol=1e-3):
            return name, typical
    return None


class NominalFlux(NamedTuple):
    """Flux of a light at its nominal current, in one colour.

    Attributes:
        flux: radiant flux, mW. That of a mixed colour is the largest at which none of its red,
            green and blue LEDs exceeds its own nominal flux.
        light: the light in words, such as "red smd-3528".
        colour: name of the colour in the library; that of the LED that limits a mixed colour.
        words: the flux in words, with the current if it is known.
    """

    flux: float
    light: str
    colour: str
    words: str


def nominal_flux(model: str, colour: Colour) -> NominalFlux | None:
    """Return the nominal flux of a light of the library that has these shares of R, G and B, or
    None if the library does not state that of one of its LEDs.
    """
    leds = [(1.0, typical_colour(model, colour))]
    mixed = leds[0][1] is None
    if mixed:
        shares = np.array(colour) / sum(colour)
        unit = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        leds = [(float(shares[k]), typical_colour(model, unit[k])) for k in np.flatnonzero(shares)]
    limits: list[tuple[float, str, TypicalLight]] = []
    for share, known in leds:
        if known is None or known[1].flux is None:
            return None
        limits.append((known[1].flux / share, *known))
    flux, name, typical = min(limits, key=lambda limit: limit[0])
    at = f" at {typical.current:g} mA" if typical.current else ""
    if not mixed:
        return NominalFlux(flux, f"{name} {model}", name, f"{flux:g} mW{at}")
    flux = float(f"{flux:.9g}")  # without the rounding of the division
    words = f"{flux:g} mW, of which its {name} LED gives {typical.flux:g} mW{at}"
    return NominalFlux(flux, f"{model} of this colour", name, words)


def unusual_fluxes(design: SensorDesign) -> list[str]:
    """Return a sentence for each light group whose flux is above the nominal flux that the library
    names for its light and colour, or far below that of the other groups that are on.
    """
    found: list[str] = []
    usual = float(np.median([group.flux for group in design.lights.values() if group.flux] or [0]))
    for name, group in design.lights.items():
        if 0.0 < group.flux < FAINT * usual:
            found.append(
                f"lights {name}: {group.flux:g} mW each is {group.flux / usual:.2g} times the "
                f"median of the groups, {usual:g} mW: fluxes are in mW; 0 switches a group off"
            )
            continue
        nominal = nominal_flux(group.model, group.colour)
        if nominal is not None and group.flux > OVERDRIVEN * nominal.flux:
            found.append(
                f"lights {name}: {group.flux:g} mW each is {group.flux / nominal.flux:.2g} times "
                f"the nominal flux of a {nominal.light}, which is {nominal.words}: "
                "lower it, or use a brighter light"
            )
    return found

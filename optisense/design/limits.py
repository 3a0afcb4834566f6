"""Sizes, refractive indices and absorption that a tactile sensor can have; others are mistakes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from optisense.design.fields import Steps
from optisense.design.materials import Medium
from optisense.design.parts import TRANSPARENT_SOLIDS, Part, Role
from optisense.design.problems import Diagnostic
from optisense.design.sensor_design import Meshes, SensorDesign
from optisense.errors import DesignError

LARGEST = 1000.0
"""Largest size of a part, and largest distance of a light or camera from the origin, mm; larger
numbers come from a wrong unit."""

PLACE_HINT = "Give positions in millimetres"
"""Remedy for places that are too far away."""

SMALLEST = 0.5
"""Smallest size of a part in its largest dimension, mm; thin parts are larger in the others."""

MOST_OF_A_GAS = 1.002
"""Largest refractive index of a gas: at atmospheric pressure none has more; air has 1.0003."""

LEAST_OF_A_SOLID = 1.29
"""Smallest refractive index of a clear solid, that of the fluoropolymer Teflon AF 2400 (assumed:
its data sheet was not at hand). Water has 1.33. Aerogels have less, but they scatter light, and
media are simulated as clear."""

MOST_OF_A_SOLID = 2.15
"""Largest refractive index of a clear glass on sale, Sumita's K-PSFn214P, whose name gives 2.14
(its data sheet was not at hand; K-PSFn2 has 1.997 in the maker's catalogue of 2017 by
refractiveindex.info). Crystals such as diamond, 2.42, have more, but nobody makes a sensor of
them."""

MOST_OF_AN_ELASTOMER = 1.65
"""Largest refractive index of a clear elastomer. Silicones for lamps reach 1.62 at 633 nm: Mosley
et al., "High refractive index thermally stable phenoxyphenyl and phenylthiophenyl silicones for
light-emitting diode applications", J. Appl. Polym. Sci. 131, 39824 (2014)."""

LEAST_TRANSMITTED = 1.0 / 255.0
"""Smallest share of the light that a useful transparent part transmits over its smallest extent:
one level of a picture of eight bits whose brightest level is the light without absorption."""

MOST_ABSORPTION_OF_A_GEL = 0.25
"""Largest absorption coefficient (1/mm) of a gel with which the images of contacts are accurate:
at 0.2, the steep flanks of a ball are 2 % too bright, at 0.3 5 % and at 0.4 10 %, compared with
photon mapping. Clear silicones have 0.03 and less."""


def unit_slips(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Return problems of parts, lights and camera whose sizes or distances suggest another unit."""
    problems: list[Diagnostic] = []
    for name, mesh in meshes.items():
        place = design.where("parts", name, "mesh")
        extent = float(np.ptp(mesh.bounds, axis=0).max())
        far = float(np.abs(mesh.bounds).max())
        if extent > LARGEST or far > 2.0 * LARGEST:
            size = f"{extent:.6g} mm large" if extent > LARGEST else f"{far:.6g} mm from the origin"
            problems.append(
                Diagnostic(
                    f"part '{name}' is {size}: looks like micrometres or another smaller unit",
                    place,
                    f"Scale the mesh to millimetres; a sensor is smaller than {LARGEST:g} mm",
                )
            )
        elif extent < SMALLEST:
            problems.append(
                Diagnostic(
                    f"part '{name}' is only {extent:.3g} mm large: looks like metres or inches",
                    place,
                    "Scale the mesh to millimetres (metres times 1000)",
                )
            )
    for cage_name, cage in design.cages.items():
        far = float(np.abs(cage.current_points()).max())
        if far > 2.0 * LARGEST:
            problems.append(
                Diagnostic(
                    f"cage '{cage_name}' has a control point {far:.6g} mm from the origin",
                    design.where("cages", cage_name, "points"),
                    "Give control points in millimetres",
                )
            )
    for label, position, path in placed_things(design):
        slip = place_slip(position)
        if slip is not None:
            problems.append(Diagnostic(f"{label} {slip}", design.where(*path), PLACE_HINT))
    return problems


def refuse_far(label: str, position: ArrayLike) -> None:
    """Raise DesignError if a light or camera, named by `label`, is at a place (3,), mm, farther
    from the origin than `LARGEST`, or not finite.
    """
    slip = place_slip(position)
    if slip is not None:
        raise DesignError(f"{label} {slip}", hint=PLACE_HINT)


def place_slip(position: ArrayLike) -> str | None:
    """Return a text that says how a light or camera at (3,), mm, is too far away, or None."""
    distance = float(np.linalg.norm(position))
    if distance <= LARGEST:
        return None
    return f"is {distance:.6g} mm from the origin: is its position in millimetres?"


def placed_things(
    design: SensorDesign,
) -> list[tuple[str, tuple[float, float, float], Steps]]:
    """Return the camera and all lights: name in words, position (mm) and its path in the design."""
    found: list[tuple[str, tuple[float, float, float], Steps]] = [
        ("the camera", design.camera.position, ("camera", "position"))
    ]
    for name, group in design.lights.items():
        for index, light in enumerate(group.lights):
            label = f"light {index} of group '{name}'"
            found.append((label, light.position, ("lights", name, "lights", index, "position")))
    return found


def is_gas(medium: Medium) -> bool:
    """Return whether a medium can only be a gas, such as air."""
    return medium.ior <= MOST_OF_A_GAS


def index_problems(design: SensorDesign) -> list[Diagnostic]:
    """Return problems of refractive indices that no transparent material has, each material once.

    A gas is allowed: air gaps lie between parts, and a membrane may be filled with it.
    """
    problems: dict[str, Diagnostic] = {}
    for name, part, material, medium in _solids(design):
        soft = part.role is Role.ELASTOMER
        most = MOST_OF_AN_ELASTOMER if soft else MOST_OF_A_SOLID
        if is_gas(medium) or LEAST_OF_A_SOLID <= medium.ior <= most:
            continue
        what = "clear elastomer" if soft else "transparent solid"
        problems.setdefault(
            material,
            Diagnostic(
                f"no {what} has a refractive index of {medium.ior:g}: material "
                f"'{material}' of part '{name}'",
                design.where("materials", material, "ior"),
                f"Give {LEAST_OF_A_SOLID:g} to {most:g}, or 1 for air",
            ),
        )
    return list(problems.values())


def absorption_problems(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Return warnings about gels that absorb more than images are accurate for, and transparent
    solids that absorb practically all light, each material once.
    """
    problems: dict[str, Diagnostic] = {}
    for name, part, material, medium in _solids(design):
        if name not in meshes:
            continue
        extent = float(np.ptp(meshes[name].vertices, axis=0).min())
        left = np.exp(-min(medium.absorption) * extent)
        if left < LEAST_TRANSMITTED:
            message = (
                f"part '{name}' absorbs practically all light: over its smallest extent of "
                f"{extent:.3g} mm, material '{material}' transmits {left:.1g} of the "
                "light of its clearest channel"
            )
            hint = "The unit of 'absorption' is 1/mm; opaque parts are blockers"
        elif part.role is Role.ELASTOMER and max(medium.absorption) > MOST_ABSORPTION_OF_A_GEL:
            message = (
                f"material '{material}' of the gel absorbs {max(medium.absorption):g} per mm: the "
                "steep flanks of contacts are rendered some per cent too bright"
            )
            hint = "In Python, `estimator='sppm'` is accurate, and slower"
        else:
            continue
        where = design.where("materials", material)
        problems.setdefault(material, Diagnostic(message, where, hint, severity="warning"))
    return list(problems.values())


def _solids(design: SensorDesign) -> Iterator[tuple[str, Part, str, Medium]]:
    """Yield the name of each transparent solid, the part, and its material's name and medium; the
    index of a sheet is relative.
    """
    for name, part in design.parts.items():
        material = design.materials.get(part.material or "")
        medium = None if material is None else material.medium()
        if part.material is not None and medium is not None and part.role in TRANSPARENT_SOLIDS:
            yield name, part, part.material, medium

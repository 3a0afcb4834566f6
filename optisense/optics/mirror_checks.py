"""Check that the camera sees the sensing surface by the mirrors of the design."""

from __future__ import annotations

from optisense.design import SensorDesign
from optisense.design.materials import Conductor
from optisense.design.parts import Role
from optisense.design.problems import Diagnostic
from optisense.optics.scene.assembly import SMOOTH_METAL, is_mirror

CHECK_RAYS = 96
"""Number of chief rays of a check across the picture. A column of them is then 0.01 of all, a
tenth of `LEAST_BY_MIRROR`."""

LEAST_BY_MIRROR = 0.1
"""Smallest share of the chief rays on the sensing surface that a mirror must reflect to count as
used. In GelSight Svelte both mirrors reflect all of them; of a camera that looks past the mirrors,
they reflect 0.006."""


def mirror_problems(design: SensorDesign, views: dict[frozenset[str], float]) -> list[Diagnostic]:
    """Return warnings about mirrors by which the camera sees almost none of the sensing surface.

    A part counts as a mirror if that is its role and its metal is smooth; a rough or white one
    reflects no image.

    Args:
        design: a design, with or without mirrors.
        views: shares of the view by set of mirrors, from `RayModel.views_by_mirrors` with
            `CHECK_RAYS`.

    Returns:
        A warning for each unused mirror, or a single one if the camera sees nothing of the sensing
        surface.
    """
    mirrors = [
        name
        for name, part in design.parts.items()
        if part.role is Role.MIRROR
        and part.material is not None
        and is_mirror(design.materials[part.material].reflection())
    ]
    if mirrors and not views:
        return [
            Diagnostic(
                "the camera sees nothing of the sensing surface, neither by mirrors nor directly",
                design.where("camera"),
                "Check the camera's position and direction, and what is in its way",
                "warning",
            )
        ]
    problems = []
    for name in mirrors:
        share = sum(part for way, part in views.items() if name in way)
        if share < LEAST_BY_MIRROR:
            message = (
                f"the mirror '{name}' shows the camera {100 * share:.0f} % of what it sees of the "
                "sensing surface"
            )
            hint = (
                "Check the positions of mirror and camera; ignore this if the mirror only turns "
                "the light of lamps"
            )
            problems.append(Diagnostic(message, design.where("parts", name), hint, "warning"))
    return problems


def polished(design: SensorDesign) -> SensorDesign | None:
    """Return a design whose rough metal mirrors are smooth; None if it has no rough ones."""
    smooth = dict(design.materials)
    for name in _rough_mirrors(design):
        material = design.parts[name].material or ""
        reflection = design.materials[material].reflection()
        smooth[material] = Conductor(eta=reflection.eta, k=reflection.k)
    if all(smooth[name] is material for name, material in design.materials.items()):
        return None
    return design.model_copy(update={"materials": smooth})


def rough_mirror_problems(
    design: SensorDesign, views: dict[frozenset[str], float]
) -> list[Diagnostic]:
    """Return warnings about mirrors that are too rough for the camera to see by them.

    Args:
        design: a design with rough mirrors.
        views: shares of the view of the `polished` design.
    """
    problems = []
    for name, roughness in _rough_mirrors(design).items():
        share = sum(part for way, part in views.items() if name in way)
        if share >= LEAST_BY_MIRROR:
            message = (
                f"the camera sees nothing by the mirror '{name}' of roughness {roughness:g}; by a "
                f"smooth one it would see {100 * share:.0f} % of its view of the sensing surface"
            )
            hint = f"Give the mirror's material a roughness below {SMOOTH_METAL:g}"
            problems.append(Diagnostic(message, design.where("parts", name), hint, "warning"))
    return problems


def _rough_mirrors(design: SensorDesign) -> dict[str, float]:
    """Return the roughness of the mirrors of metal that is too rough to reflect images."""
    surfaces = {
        name: design.materials[part.material].reflection()
        for name, part in design.parts.items()
        if part.role is Role.MIRROR and part.material is not None
    }
    return {
        name: surface.roughness
        for name, surface in surfaces.items()
        if surface.is_metal and not is_mirror(surface)
    }


def views_in_words(views: dict[frozenset[str], float]) -> str:
    """Return words that name the sets of mirrors of the camera's views, the most used first."""
    phrases = []
    for way, share in sorted(views.items(), key=lambda each: -each[1]):
        names = " and ".join(f"'{name}'" for name in sorted(way))
        phrases.append(f"{100 * share:.0f} % {'by ' + names if names else 'directly'}")
    return ", ".join(phrases)

"""Sources of numbers that several built-in sensors share."""

from __future__ import annotations

from collections.abc import Mapping

from optisense.design import Provenance, Status

Sources = Mapping[str, tuple[Status, str]]
"""Status and text of the source by dotted path."""

XP565: Sources = {
    "materials.silicone-xp565.ior": (Status.ASSUMED, "the gel's silicone is not published"),
    "materials.silicone-xp565.elasticity": (
        Status.ASSUMED,
        "Poisson ratio usual for silicones; friction as the FEATS project takes it",
    ),
    "materials.silicone-xp565.elasticity.youngs_modulus": (
        Status.ASSUMED,
        "as the gel of a GelSight Mini, fitted to measured forces (FEATS project)",
    ),
}
"""Silicone of the gels whose own silicone is not known."""


def provenance_of(sources: Sources) -> dict[str, Provenance]:
    """Return the provenance of a design by dotted path."""
    return {path: Provenance(status=s, source=text) for path, (s, text) in sources.items()}

"""Searches of GelSight Svelte's mirror under several interpretations of the paper.

The OptiSense paper bends the mirror "between flat and most curved", and considers "a simplified
sensing surface" and "the centre of the sensing surface" first. Each choice of bounds and skin is
searched by the gradient method, which needs few trials.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from optisense.design import SensorDesign
from optisense.geometry import TriangleMesh
from optisense.optics import OpticalModel
from paper.claims import Claim
from paper.evaluations import design_of, median_stretch, sensor, tuples
from paper.experiment import Values
from paper.spread import shown, spread
from paper.svelte_mirror import BEST, SENSOR, statements
from paper.unit import Found, Record, Unit

SPACES: dict[str, dict[str, dict[str, Any]]] = {
    "between flat and most curved": {"cages.M1.blend": {"between": [0.0, 1.0]}},
    "8 mm to either side": {
        "cages.M1.points.x": {"around": 8.0},
        "cages.M1.points.y": {"around": 1.0},
        "cages.M1.points.z": {"around": 2.0},
    },
}
"""Search spaces: blends of the two built-in mirrors, and points of the cage (mm) as in the case
study of docs/case-studies.md."""

SKINS = ("whole", "middle third")
"""Which part of the skin is the sensing surface; the paper does not say how it is simplified."""

LEAST_PICTURE = 0.1
"""Smallest share of the pixels that must see the sensing surface: a third of the skin is in 18 % of
the picture at the start, where the usual limit is 20 %."""


def factors() -> dict[str, tuple[str, ...]]:
    """Return the options of each factor, the default first, in the order of `units`."""
    return {"the mirror bends": tuple(SPACES), "part of the skin": SKINS}


def units(settings: Values) -> dict[tuple[str, str], Unit]:
    """Return the search of the mirror under each reading of bounds and skin."""
    return {
        (bounds, skin): Unit(
            bent_mirror,
            {
                "design": sensor(SENSOR),
                "skin": skin,
                "space": space,
                "budget": settings["mirror_trials"],
                "settings": {
                    "ray_resolution": settings["mirror_resolution"],
                    "least_picture": LEAST_PICTURE,
                },
            },
            f"Svelte's mirror, {bounds}, {skin} of the skin",
        )
        for bounds, space in SPACES.items()
        for skin in SKINS
    }


def bent_mirror(inputs: Mapping[str, Any], folder: Path) -> Found:
    """Search the mirror by AOAP; return AOAP and the stretch of circles, at the start and the best.

    The inputs are `design`, `skin` (one of `SKINS`), `space`, `budget` and `settings`.
    """
    from optisense.search import Around, search

    design = design_of(inputs["design"])
    if inputs["skin"] == SKINS[1]:
        crop_to_middle(design)
    space = {
        path: Around(each["around"]) if "around" in each else tuple(each["between"])
        for path, each in inputs["space"].items()
    }
    study = folder / "study"
    result = search(
        design,
        space,
        "aoap",
        method="gradient",
        budget=inputs["budget"],
        settings=tuples(inputs["settings"]),
        out=study,
        resume=(study / "study.json").is_file(),
    )
    if result.interrupted:
        raise KeyboardInterrupt
    size = tuple(inputs["settings"]["ray_resolution"])
    found = {
        name: {
            "aoap": trial.score,
            "stretch": median_stretch(OpticalModel(trial.design).chief_rays(size)),
        }
        for name, trial in (("first", result.start), ("best", result.best))
    }
    result.study.close()
    return Found(found)


def crop_to_middle(design: SensorDesign) -> None:
    """Keep the middle third of the skin along the finger (z)."""
    mesh = design.meshes["skin"]
    heights = mesh.vertices[mesh.faces].mean(axis=1)[:, 2]
    low, high = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    third = (high - low) / 3.0
    faces = mesh.faces[(heights > low + third) & (heights < high - third)]
    used, numbers = np.unique(faces, return_inverse=True)
    design.meshes["skin"] = TriangleMesh(
        mesh.vertices[used], numbers.reshape(-1, 3).astype(np.int32)
    )


def claims_of(record: Record) -> list[Claim]:
    """Return the paper's statements on the mirror, with verdicts from one search."""
    nothing = {"aoap": None, "stretch": None}
    first, best = (
        {key: spread([record.values.get(name, nothing)[key]]) for key in nothing}
        for name in ("first", "best")
    )
    says = f"CMA-ES raises AOAP to {BEST:g} (here: the gradient method)."
    return statements(first, best, says, shown(best["aoap"]))

"""Search the height and power of a GelSight Mini's red lamps for a better score; keep the study."""

import optisense as ots
from optisense.search import Around, search

result = search(
    ots.load("gelsight-mini-ideal"),
    {"lights.red.shift.z": Around(1.5), "lights.red.flux": (1.0, 5.0)},
    objective="normdiff",
    budget=2,  # a real search takes a few hundred trials, and nine places
    # small pictures of two balls at once
    settings={
        "resolution": (120, 90),
        "photons": "draft",
        "places": [(-4, -3), (4, 3)],
        "together": True,
    },
    out="study",
)
print(f"{result.start.score:.4g} -> {result.best.score:.4g}")
print(result.best.values)
ots.save_design(result.best.design, "better-mini")

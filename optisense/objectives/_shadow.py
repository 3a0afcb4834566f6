"""Shadow: the share of the skin around a pressed ball that loses a colour."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives._uniformity import COLOURS, UNLIT
from optisense.objectives.registry import no_pixels, objective
from optisense.quality import SCORE_PHOTONS

if TYPE_CHECKING:
    from optisense.geometry import Contact
    from optisense.objectives.evaluation import Evaluation
    from optisense.optics import TactileImage

LOST = 0.25
"""Share of a colour's light from which on its loss counts: a quarter, which a reader can detect,
and several times the noise of an image's light."""

ACROSS = 160
"""Width (pixels) of the images. Shadows are larger than a ball's contact, which at this width has
some hundred pixels on the built-in sensors."""


@objective(
    "shadow",
    title="Shadow",
    draw=_figures.draw_shadow,
    beside=COLOURS,
    reads=no_pixels,
    range=(0.0, 1.0),
    lower_is_better=True,
    numbers=COLOURS,
)
def shadow(evaluation: Evaluation) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The share of the skin around a pressed ball that loses a colour.

    It is the share of the pixels that lose a quarter or more of any colour, among those that see
    the skin beside the ball and are lit in that colour; the mean over places. Small images are
    rendered for it.
    """
    before = _image(evaluation, [])
    seen = np.linalg.norm(before.normals, axis=2) > 0.5
    places: list[dict[str, Any]] = []
    maps = []
    for contact in evaluation.contacts:
        image = _image(evaluation, [contact])
        beside = seen & ~image.contact_mask
        usual, now = before.radiance[beside], image.radiance[beside]
        lit = usual > UNLIT * usual.max(initial=0.0)
        if not lit.any():
            raise ObjectiveError("no light arrives beside the contacts", hint="Check the lights")
        lost = lit & (now < (1.0 - LOST) * usual)
        shares = lost.sum(axis=0) / np.maximum(lit.sum(axis=0), 1)
        places.append(
            {
                "share": float(lost.any(axis=1).sum() / lit.any(axis=1).sum()),
                **{name: float(share) for name, share in zip(COLOURS, shares, strict=True)},
            }
        )
        taken = np.full((*beside.shape, 3), np.nan)
        taken[beside] = lost
        maps.append(taken)
    parts: dict[str, Any] = {
        name: float(np.mean([place[name] for place in places])) for name in COLOURS
    }
    parts["places"] = places
    return float(np.mean([place["share"] for place in places])), parts, {"maps": maps}


def _image(evaluation: Evaluation, contacts: Sequence[Contact]) -> TactileImage:
    """Return a small image of the sensor under contacts."""
    settings = evaluation.settings
    return evaluation.model.render(
        contacts,
        resolution=evaluation.design.camera.size_at(ACROSS),
        photons=SCORE_PHOTONS if settings.photons is None else settings.photons,
        seed=settings.seed,
        partial=False,
        skin=settings.skin,
    )

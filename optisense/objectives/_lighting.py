"""Objectives of the light on the skin: uniformity, shadow and power."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives.registry import no_pixels, objective
from optisense.quality import SCORE_PHOTONS

if TYPE_CHECKING:
    from optisense.geometry import Contact
    from optisense.objectives.evaluation import Evaluation
    from optisense.optics import TactileImage

DIM, BRIGHT = 5.0, 95.0
"""Percentiles of the light in the pixels that see the skin that define its dim and bright parts.
The extremes would be single pixels beside a light or in a corner."""

UNLIT = 0.01
"""Share of the brightest colour's level below which a colour counts as unlit: a few levels of 255,
little more than the camera's noise.
"""

COLOURS = ("red", "green", "blue")


@objective(
    "uniformity",
    title="Uniformity",
    beside=COLOURS,
    reads=no_pixels,
    range=(0.0, 1.0),
    numbers=COLOURS,
)
def uniformity(evaluation: Evaluation) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The evenness of the light on the untouched skin: dim over bright, for the least even colour.

    The value is the ratio of the 5th to the 95th percentile of the linear light in the pixels that
    see the skin, the smallest over those of red, green and blue that are lit; 1 is even.
    """
    evaluation.view.refuse_less(evaluation.settings)
    image = evaluation.untouched
    light = image.radiance[np.linalg.norm(image.normals, axis=2) > 0.5].astype(np.float64)
    dim, bright = np.percentile(light, (DIM, BRIGHT), axis=0)
    lit = bright > UNLIT * bright.max()
    if not lit.any():
        raise ObjectiveError("no light arrives on the skin", hint="Check the lights")
    ratios = {
        name: float(low / high)
        for name, low, high, some in zip(COLOURS, dim, bright, lit, strict=True)
        if some
    }
    least = min(ratios, key=lambda name: ratios[name])
    return ratios[least], {**ratios, "least_even": least}, {}


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
        skin=settings.skin,
    )


@objective(
    "power",
    title="Power",
    range=(0.0, math.inf),
    unit="mW",
    lower_is_better=True,
    rays_only=True,
    usual=(66.0, 4.5),  # GelSight360, DIGIT
    numbers=("lights",),
)
def power(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The radiant flux, in mW, of all LEDs of the sensor.

    The electrical power is the radiant flux over the LEDs' efficiency.
    """
    lights = evaluation.design.lights
    groups = {name: group.flux * len(group.lights) for name, group in lights.items()}
    parts = {
        "groups": groups,
        "lights": sum(len(group.lights) for group in lights.values()),
    }
    return float(sum(groups.values())), parts

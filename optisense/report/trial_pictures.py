"""Pictures of nine pressed balls with their outlines and numbers, and of the trials of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.errors import OptiSenseError, SetupError
from optisense.geometry import Contact, Sphere
from optisense.objectives import Settings
from optisense.objectives.press import nearest_press
from optisense.report._study_figures import spread_out
from optisense.search.evaluation.outcome import rank_of
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

LEAST_PIXELS = 12
"""Smallest number of pixels of a visible ball (about 4 x 3); smaller ones can't be made out."""

LEAST_PIECE = 6
"""Smallest number of pixels of a piece of a ball, cut by a mirror's edge, with an outline."""


LETTERS = 10.0
"""Width that is kept free for a number beside a ball, in pixels of the picture."""


@dataclass(frozen=True)
class Ball:
    """Ball in a picture.

    Attributes:
        number: number of the ball, from 1.
        pixels: number of pixels that it covers.
        outlines: corners (k, 2), as column and row, of a polygon around each piece of it, in pixels
            from the upper left, the largest piece first; a folded mirror shows one ball in several
            pieces.
    """

    number: int
    pixels: int
    outlines: tuple[FloatArray, ...] = ()

    @property
    def seen(self) -> bool:
        """True if the ball is large enough to be made out."""
        return self.pixels >= LEAST_PIXELS


def nine_balls(
    model: OpticalModel, settings: Settings, across: int, photons: int
) -> tuple[TactileImage, list[Contact]]:
    """Return an image of the nine balls that objectives press in, and the balls.

    Args:
        settings: settings with the radius and the depth of the balls, and with the skin.
        across: width of the image, pixels.

    Raises:
        OptiSenseError: the design can't be rendered.
    """
    contacts = model.nine_contacts(Sphere(settings.radius), settings.depth)
    size = model.design.camera.size_at(across)
    skin = settings.skin
    image = model.render(contacts, resolution=size, photons=photons, skin=skin)
    return image, contacts


def find_balls(
    points: NDArray[np.float32], mask: NDArray[np.bool_], places: FloatArray
) -> tuple[Ball, ...]:
    """Return the balls of a picture; each pixel belongs to the ball whose position is nearest.

    Args:
        points: points (h, w, 3) that the pixels see, mm.
        mask: mask (h, w) of the pixels that see a ball.
        places: positions (n, 3) of the balls, mm.
    """
    from scipy.ndimage import label

    owner = nearest_press(points, mask, places)
    balls = []
    for number in range(len(places)):
        own = owner == number
        pieces, count = label(own)
        sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
        large = [piece for piece in np.argsort(-sizes) if sizes[piece] >= LEAST_PIECE]
        outlines = tuple(_around(pieces == 1 + piece) for piece in large)
        balls.append(Ball(number + 1, int(own.sum()), outlines))
    return tuple(balls)


def _around(piece: NDArray[np.bool_]) -> FloatArray:
    """Return the convex polygon (k, 2) around all pixels of a piece, half a pixel wider."""
    from shapely import MultiPoint

    rows, columns = np.nonzero(piece)
    middles = np.column_stack([columns, rows]) + 0.5
    # The hull comes first: its few corners are widened in a thousandth of the time of all pixels.
    hull = MultiPoint(middles).convex_hull.buffer(1.5, quad_segs=4)
    return np.asarray(hull.exterior.coords)[:-1]


def marks_svg(balls: Sequence[Ball], width: int, height: int) -> Markup:
    """Return outlines and numbers of the visible balls as SVG, to lie over a picture.

    Args:
        width, height: size of the picture, pixels.
    """
    shapes = []
    for ball in balls:
        if not (ball.seen and ball.outlines):
            continue
        for outline in ball.outlines:
            corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in outline)
            shapes.append(f'<polygon points="{corners}"/>')
        shapes.append(_number(ball, width))
    return Markup(
        f'<svg class="marks" viewBox="0 0 {width} {height}" aria-hidden="true">'
        + "".join(shapes)
        + "</svg>"
    )


def _number(ball: Ball, width: int) -> str:
    """Return the ball's number beside its largest piece, where it covers nothing of it."""
    low, high = ball.outlines[0].min(axis=0), ball.outlines[0].max(axis=0)
    right = high[0] + LETTERS < width
    x = high[0] + 1.0 if right else low[0] - 1.0
    anchor = "start" if right else "end"
    y = max(low[1] + 4.0, 10.0)
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{ball.number}</text>'


def count_in_words(balls: Sequence[Ball]) -> str:
    """Return the number of balls that the picture shows, as a sentence; empty if there are none."""
    if not balls:
        return ""
    hidden = [str(ball.number) for ball in balls if not ball.seen]
    if not hidden:
        return f"All {len(balls)} are in view."
    names = " and ".join([", ".join(hidden[:-1]), hidden[-1]] if len(hidden) > 1 else hidden)
    return (
        f"{len(balls) - len(hidden)} of the {len(balls)} are in view; {names} "
        f"{'is' if len(hidden) == 1 else 'are'} hidden, or too small to make out."
    )


ACROSS = 240
"""Width of a picture in pixels: it is shown at most 390 pixels wide, beside the trial's numbers."""

PHOTONS = 200_000
"""Number of photons of a picture: its noise, some 4 %, is hardly visible at this size."""

MOST_PICTURES = 500
"""Largest number of pictures that are kept, of 130 KB each; the oldest is dropped first."""


class TrialPictures:
    """Renderer of trials with the nine balls that objectives press in; a trial whose picture is
    still kept is not rendered again.
    """

    def __init__(self, study: Study) -> None:
        """Store the settings; nothing is rendered yet."""
        taken = ("radius", "depth", "skin")
        given = study.settings.settings
        self._settings = Settings(**{key: given[key] for key in taken if key in given})
        self._model: OpticalModel | None = None
        self._found: dict[int, NDArray[np.uint8] | None] = {}

    def of(self, trial: Trial) -> NDArray[np.uint8] | None:
        """Return the picture (h, w, 3) of a trial, or None if its design can't be rendered.

        Raises:
            SetupError: the renderer can't run on this machine.
        """
        if trial.number not in self._found:
            try:
                self._found[trial.number] = self._rendered(trial)
            except SetupError:
                raise
            except OptiSenseError:
                self._found[trial.number] = self._model = None
            while len(self._found) > MOST_PICTURES:
                del self._found[next(iter(self._found))]
        return self._found[trial.number]

    def _rendered(self, trial: Trial) -> NDArray[np.uint8]:
        from optisense.optics import OpticalModel

        design = trial.design
        if self._model is None:
            self._model = OpticalModel(design)
        else:
            self._model.set_design(design)
        image, _ = nine_balls(self._model, self._settings, ACROSS, PHOTONS)
        return image.picture()


def select_for_pictures(study: Study, trials: Sequence[Trial], count: int) -> list[Trial]:
    """Return the trials that a reader is most likely to look at: some along the front of several
    objectives, and the best ones by the first.

    Args:
        count: largest number of trials.
    """
    names = study.settings.names
    fine = [trial for trial in trials if np.isfinite(trial.score)]
    front = spread_out(study.front, names[0], count) if len(names) > 1 else []
    best = sorted(fine, key=lambda trial: rank_of(trial.outcome, names[0]), reverse=True)
    return list({trial.number: trial for trial in (*front, *best)}.values())[:count]

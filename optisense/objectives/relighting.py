"""The presses of a sensor under lights of any colours and powers, from one rendering.

Light is additive: an image is the sum of the layers of the light groups, each times its flux. Each
press is therefore rendered once, with a layer for each group, and its pixels under other lights are
a weighted sum of layers: exact, and thousands of times faster than a new image.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.design.lenses.film import PictureWindow
from optisense.design.responses import PictureChain
from optisense.errors import ObjectiveError
from optisense.objectives._exposure import exposure_for
from optisense.objectives.evaluation import Evaluation
from optisense.objectives.press import Press

if TYPE_CHECKING:
    from optisense.design import SensorDesign
    from optisense.optics import ChiefRays, TactileImage

ByteMask = NDArray[np.bool_]
Layers = NDArray[np.float32]


@dataclass(frozen=True)
class _Seen:
    """One press with the data needed to relight it.

    Attributes:
        press: the unexposed press at full size.
        small: the unexposed press, cropped to the box of its contact.
        box: rows and columns of that box.
        around: rows and columns of the box, extended by pixels whose overexposure spreads into it.
        touched: (h', w') mask, within `around`, of the pixels that contacts touch in the image.
        own: (n,) mask of those of these pixels that belong to the press (and not to others).
        layers: (groups, 3, n) radiance of these pixels for lights of 1 mW per channel.
    """

    press: Press
    small: Press
    box: tuple[slice, slice]
    around: tuple[slice, slice]
    touched: ByteMask
    own: ByteMask
    layers: Layers


class Relighting:
    """A sensor whose presses can be relit with any lights.

    Attributes:
        model: the optical model of the sensor.
        settings: settings of its images.
        groups: the light groups, in the order of their layers.
    """

    def __init__(self, evaluation: Evaluation) -> None:
        """Render each press once. The evaluation is not needed afterwards.

        Raises:
            ObjectiveError: a place is not seen.
            OptiSenseError: the sensor can't be rendered.
        """
        self.model = evaluation.model
        self.settings = evaluation.settings
        image = evaluation.untouched
        self.groups = tuple(image.unit_layers)
        self._untouched = np.stack([_planes(layer) for layer in image.unit_layers.values()])
        self._shape = image.contact_mask.shape
        views = {
            name: self._as_image(layer)
            for name, layer in zip(self.groups, self._untouched, strict=True)
        }
        self._image = replace(image, layers={}, unit_layers=views)
        self._seen = [self._keep(press, image) for press, image in evaluation.each_press()]

    @cached_property
    def chief_rays(self) -> ChiefRays:
        """Chief rays of the untouched sensor; light does not change them."""
        return Evaluation(self.model, self.settings).chief_rays

    def flux_of(self, design: SensorDesign) -> NDArray[np.float64]:
        """Return the power (groups, 3), mW, of each light of a design in R, G, B.

        Raises:
            ObjectiveError: the design's light groups are not those that were rendered.
        """
        if tuple(design.lights) != self.groups:
            raise ObjectiveError(
                "the design has other light groups than were rendered",
                hint="Only colours and powers can be changed without a new rendering",
            )
        return np.array([group.channel_flux() for group in design.lights.values()])

    def untouched(self, flux: ArrayLike) -> NDArray[np.float32]:
        """Return the untouched radiance (h, w, 3) under lights of a power (groups, 3), mW."""
        return self._as_image(_mixed(self._untouched, flux))

    def image(self, flux: ArrayLike) -> TactileImage:
        """Return the image of the untouched sensor under lights of a power (groups, 3), mW."""
        given = np.asarray(flux, dtype=np.float64)
        return self._image.relight(dict(zip(self.groups, given, strict=True)))

    def exposure(self, flux: ArrayLike) -> float:
        """Return the exposure (radiance to response) under lights of a power (groups, 3), mW."""
        return self._exposure(self.untouched(flux), self._contacts(flux))

    def presses(self, flux: ArrayLike, *, whole: bool = False) -> list[Press]:
        """Return the presses under lights of a power (groups, 3), mW.

        Args:
            flux: power (mW) of each light in R, G, B, by group.
            whole: whether images have full size; otherwise they are cropped to the box of the
                contact, which contains all its pixels.

        Raises:
            ObjectiveError: a press is overexposed or black under these lights.
        """
        background, contacts = self.untouched(flux), self._contacts(flux)
        exposure = self._exposure(background, contacts)
        found = self._lit_presses(background, contacts, exposure, whole)
        for press in found:
            press.check()
        return found

    def presses_exposed(
        self, flux: ArrayLike, exposure: float, *, whole: bool = False
    ) -> list[Press]:
        """Return the presses under lights of a power (groups, 3), mW, with a given exposure; they
        may be overexposed or black.

        Args:
            flux, whole: see `presses`.
            exposure: factor from radiance to the camera's response.
        """
        return self._lit_presses(self.untouched(flux), self._contacts(flux), exposure, whole)

    def _lit_presses(
        self,
        background: NDArray[np.float32],
        contacts: list[NDArray[np.float32]],
        exposure: float,
        whole: bool,
    ) -> list[Press]:
        found = []
        for seen, contact in zip(self._seen, contacts, strict=True):
            response = self._response(seen, background, contact, exposure, whole)
            press = replace(
                seen.press if whole else seen.small,
                response=response,
                respond_untouched=partial(
                    self._untouched_response, seen, background, exposure, whole
                ),
            )
            found.append(press)
        return found

    def relit(self, design: SensorDesign, *, whole: bool = True) -> Evaluation:
        """Return an evaluation of a design that differs only in the colours and powers of its
        lights.

        Args:
            design: the design, as in `flux_of`.
            whole: whether images have full size, as in `presses`.
        """
        return _Relit(self, design, whole)

    def _keep(self, press: Press, image: TactileImage) -> _Seen:
        rows, columns = press.box
        height, width = press.mask.shape
        reach = self._camera.reach(width)
        around = (
            slice(max(0, rows.start - reach), min(height, rows.stop + reach)),
            slice(max(0, columns.start - reach), min(width, columns.stop + reach)),
        )
        touched = image.contact_mask[around]
        layers = np.stack(
            [layer[around][touched].T for layer in image.unit_layers.values()]
        )  # fmt: skip
        box = press.box
        cut = {
            name: getattr(press, name)[box].copy()
            for name in ("mask", "response", "normals", "points", "before")
        }
        own = press.mask[around][touched]
        window = PictureWindow.part(press.mask.shape, box)
        small = replace(press, **cut, window=window, geometry={})
        return _Seen(press, small, box, around, touched, own, layers)

    def _contacts(self, flux: ArrayLike) -> list[NDArray[np.float32]]:
        """Return for each press the radiance (n, 3) of the pixels that contacts touch."""
        return [_mixed(seen.layers, flux).T for seen in self._seen]

    def _as_image(self, planes: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return planes (3, h * w) viewed as an image (h, w, 3)."""
        return np.moveaxis(planes.reshape(3, *self._shape), 0, -1)

    def _exposure(
        self, untouched: NDArray[np.float32], contacts: list[NDArray[np.float32]]
    ) -> float:
        given = self.settings.exposure
        if given != "auto":
            return float(given)
        pairs = zip(self._seen, contacts, strict=True)
        pressed = [self._camera.metered(each[seen.own], seen.press.mask) for seen, each in pairs]
        return exposure_for(untouched, pressed, self._camera)

    def _response(
        self,
        seen: _Seen,
        background: NDArray[np.float32],
        contact: NDArray[np.float32],
        exposure: float,
        whole: bool,
    ) -> NDArray[np.float32]:
        """Return the camera's response of the whole image, or of the box of the contact."""
        radiance = background[seen.around].copy()
        radiance[seen.touched] = contact
        exposed = radiance * np.float32(exposure)
        if whole:
            image = background * np.float32(exposure)
            image[seen.around] = exposed
            return self._camera.respond(image, seed=self.settings.seed)
        return self._response_of_box(seen, exposed, self._camera)

    def _untouched_response(
        self, seen: _Seen, background: NDArray[np.float32], exposure: float, whole: bool
    ) -> NDArray[np.float32]:
        """Return the response of the untouched sensor, without noise."""
        camera = self._camera.without_noise()
        if whole:
            return camera.respond(background * np.float32(exposure))
        return self._response_of_box(seen, background[seen.around] * np.float32(exposure), camera)

    def _response_of_box(
        self, seen: _Seen, exposed: NDArray[np.float32], camera: PictureChain
    ) -> NDArray[np.float32]:
        """Return the response in the box of a contact from the exposed pixels around it."""
        seed = self.settings.seed
        inner = tuple(
            slice(box.start - around.start, box.stop - around.start)
            for box, around in zip(seen.box, seen.around, strict=True)
        )
        around = PictureWindow.part(self._shape, seen.around)
        if not camera.spreads(exposed, around):
            box = PictureWindow.part(self._shape, seen.box)
            return camera.respond(exposed[inner], box, seed)
        return camera.respond(exposed, around, seed)[inner]

    @property
    def _camera(self) -> PictureChain:
        return self.model.picture_chain


class _Relit(Evaluation):
    """An evaluation whose images are sums of layers."""

    def __init__(self, relighting: Relighting, design: SensorDesign, whole: bool) -> None:
        self._flux = relighting.flux_of(design)
        super().__init__(relighting.model.relit(design), relighting.settings)
        self._relighting = relighting
        self._whole = whole

    @property
    def chief_rays(self) -> ChiefRays:
        """Chief rays of the untouched sensor; light does not change them."""
        return self._relighting.chief_rays

    @property
    def untouched(self) -> TactileImage:
        """The image of the untouched sensor under these lights."""
        return self.shared("untouched image", lambda: self._relighting.image(self._flux))

    def _auto_exposure(self) -> float:
        return self._relighting.exposure(self._flux)

    @property
    def _untouched_radiance(self) -> NDArray[np.float32]:
        return self.shared("untouched radiance", lambda: self._relighting.untouched(self._flux))

    def _presses(self) -> list[Press]:
        return self._relighting.presses(self._flux, whole=self._whole)

    def _exposed(self, exposure: float) -> list[Press]:
        return self._relighting.presses_exposed(self._flux, exposure, whole=self._whole)


def _planes(layer: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the channels of a layer (h, w, 3) as planes (3, h * w)."""
    return np.ascontiguousarray(np.moveaxis(layer, -1, 0)).reshape(3, -1)


def _mixed(layers: Layers, flux: ArrayLike) -> NDArray[np.float32]:
    """Return the sum (3, n) of layers (groups, 3, n), each times its flux (groups, 3).

    It is computed in single precision and in the order of the groups, like the image itself.
    """
    weights = np.asarray(flux, dtype=np.float32)
    total = np.zeros(layers.shape[1:], dtype=np.float32)
    for group, channel in zip(*np.nonzero(weights), strict=True):
        total[channel] += layers[group, channel] * weights[group, channel]
    return total

"""Images and rays that the objectives of one sensor share, computed once on first use."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.design.camera_checks import camera_fault
from optisense.design.lenses.film import PictureWindow
from optisense.design.limits import index_problems
from optisense.design.problems import Diagnostic
from optisense.errors import ObjectiveError, OptiSenseError
from optisense.geometry import Contact, Sphere
from optisense.objectives._exposure import (
    UnexposedPress,
    are_apart,
    box_around,
    exposure_for,
    radiance_in,
)
from optisense.objectives.press import Press, nearest_press, press_frame
from optisense.objectives.settings import ACROSS, VIEW_ACROSS, Settings
from optisense.objectives.view import View, view_of
from optisense.quality import SCORE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, OpticalModel, RenderProgress, TactileImage

_T = TypeVar("_T")

ProgressCallback = Callable[[float, str], None]
"""A function called with the finished fraction (0 to 1) of the work and the step's name."""

FIRST_IMAGE = 0.6
"""Share of the first image, with tracing the light, in the time of all rendering; measured on
GelSight Mini with five million photons and nine presses.
"""

Reads = Callable[[Press], NDArray[np.float64]]
"""A function that returns for an unexposed press the importance (h, w) of each pixel to objectives:
1 for pixels that are read one by one, less where a share of the camera samples suffices, and 0 for
others."""


class Evaluation:
    """One sensor, prepared for scoring by several objectives.

    Attributes:
        model: the sensor's optical model; it must not change during scoring.
        settings: settings of images and rays.
        seconds: wall time (s) of each shared value so far, without that of nested values.
    """

    def __init__(
        self,
        model: OpticalModel,
        settings: Settings | None = None,
        progress: ProgressCallback | None = None,
        reads: Reads | None = None,
    ) -> None:
        """Create the evaluation of a model; nothing is rendered yet.

        Args:
            model: the sensor's optical model.
            settings: settings of images and rays.
            progress: function that is called while images are rendered.
            reads: function that gives the pixels of a press that the objectives read, if not all
                one by one. Other pixels affect the exposure only, and are rendered with few samples
                (`registry.pixels_read`).
        """
        self.model = model
        self.seconds: dict[str, float] = {}
        self._made: dict[str, Any] = {}
        self._reads = reads
        self.settings = settings or Settings()
        self._progress = progress or (lambda fraction, text: None)
        self._untouched_responses: dict[tuple[float, bool], NDArray[np.float32]] = {}

    def take(self, other: Evaluation, names: Iterable[str]) -> None:
        """Take those of the named values that another evaluation has computed."""
        self._made |= {name: other._made[name] for name in names if name in other._made}

    def shared(self, name: str, make: Callable[[], _T]) -> _T:
        """Return a value that is computed on first use; an error is kept as well, and raised again.

        Args:
            name: name of the value, with the settings that it depends on.
        """
        if name not in self._made:
            began = time.perf_counter()
            inner = sum(self.seconds.values())
            try:
                self._made[name] = make()
            except OptiSenseError as error:
                self._made[name] = error
            spent_inside = sum(self.seconds.values()) - inner
            self.seconds[name] = round(time.perf_counter() - began - spent_inside, 4)
        made = self._made[name]
        if isinstance(made, OptiSenseError):
            raise made
        return cast("_T", made)

    @cached_property
    def design(self) -> SensorDesign:
        """The sensor design, copied once from the model."""
        return self.model.design

    @property
    def resolution(self) -> tuple[int, int]:
        """Size (width, height) of the images, pixels."""
        return self.settings.resolution or self.design.camera.size_at(ACROSS)

    @property
    def ray_resolution(self) -> tuple[int, int]:
        """Size (width, height) of the grid of chief rays."""
        return self.settings.ray_resolution or self.design.camera.size_at(ACROSS)

    @property
    def notes(self) -> list[str]:
        """Notes on the shapes of the images and rays; see `Camera.shape_notes`."""
        settings = self.settings
        return self.design.camera.shape_notes(settings.resolution, settings.ray_resolution)

    @property
    def sensing_faces(self) -> int:
        """Number of triangles of the sensing surface; `ChiefRays.face` counts them."""
        return len(self.model.sensing.faces)

    @property
    def chief_rays(self) -> ChiefRays:
        """The chief rays of the untouched sensor, one per pixel of `ray_resolution`."""
        return self.shared("chief rays", lambda: self.model.chief_rays(self.ray_resolution))

    def check_possible(self) -> None:
        """Check that the camera and the materials are physically possible.

        Raises:
            ObjectiveError: the camera is inside a part, no lens has its field of view, or no
                material has the refractive index of a part.
        """
        fault = self.shared("faults", self._fault)
        if fault is not None:
            raise ObjectiveError(fault.message, hint=fault.hint)

    def _fault(self) -> Diagnostic | None:
        materials = index_problems(self.design)
        if materials:
            return materials[0]
        return camera_fault(self.design, self.design.deformed_meshes())

    @property
    def view(self) -> View:
        """The share of the surface that the camera sees, by separate rays (`VIEW_ACROSS`)."""
        size = self.design.camera.size_at(VIEW_ACROSS)
        return self.shared("view", lambda: view_of(self.model.chief_rays(size), self.model.sensing))

    @property
    def checked_rays(self) -> ChiefRays:
        """The chief rays, after a check that the camera sees enough for a score.

        Raises:
            ObjectiveError: the camera sees less than `least_skin` or `least_picture` of `Settings`.
        """
        self.view.refuse_less(self.settings)
        return self.chief_rays

    @property
    def untouched(self) -> TactileImage:
        """The image of the untouched sensor."""
        return self.shared("untouched image", lambda: self._render((), 0.0, FIRST_IMAGE))

    @property
    def exposure(self) -> float:
        """The exposure: the factor from radiance to the camera's response, where 1 is a full well.

        See `exposure_for` for the automatic exposure.
        """
        if self.settings.exposure == "auto":
            return self.shared("exposure", self._auto_exposure)
        return float(self.settings.exposure)

    @property
    def untouched_exposure(self) -> float:
        """The automatic exposure of the untouched sensor, regardless of contacts."""
        if self.settings.exposure == "auto":
            chain = self.model.picture_chain
            return self.shared(
                "untouched exposure", lambda: chain.auto_exposure(self._untouched_radiance)
            )
        return float(self.settings.exposure)

    @property
    def contacts(self) -> list[Contact]:
        """The contact of the ball at each place."""
        return self.shared("contacts", self._contacts)

    @property
    def presses(self) -> list[Press]:
        """One checked press per place.

        Raises:
            ObjectiveError: a place is not seen, overexposed or black.
        """
        return self.shared("presses", self._presses)

    @property
    def calibration_presses(self) -> list[Press]:
        """One press per place, with the exposure of the untouched sensor, as in the calibration of
        a real sensor; presses may be overexposed or black.

        Raises:
            ObjectiveError: a place is not seen.
        """
        exposure = self.untouched_exposure
        if exposure == self.exposure:
            return self.shared("exposed presses", lambda: self._exposed(exposure))
        return self.shared("calibration presses", lambda: self._exposed(exposure))

    def _contacts(self) -> list[Contact]:
        """Return contacts at the places that the user named, or at nine that cover the view."""
        ball = Sphere(self.settings.radius)
        if self.settings.places is None:
            self.view.refuse_less(self.settings)
            return self.model.nine_contacts(ball, self.settings.depth, self.resolution)
        return [Contact(ball, at=at, depth=self.settings.depth) for at in self.settings.places]

    def each_press(self) -> Iterator[tuple[Press, TactileImage]]:
        """Yield each press, not yet exposed (its response is 0) and not checked, with its image.

        The images are rendered one by one and not kept; they are for callers that need their
        layers.

        Raises:
            ObjectiveError: the camera does not see a place.
        """
        contacts, surface = self.contacts, self.model.surface
        before = self.model.chief_rays(self.resolution).normals
        dark = np.broadcast_to(np.float32(0.0), before.shape)
        frames = [press_frame(contact, surface) for contact in contacts]
        centres = [frame.centre for frame in frames]
        together = self.settings.together and are_apart(
            [each.place for each in frames], self.settings.radius, self.settings.depth
        )
        groups = [contacts] if together else [[contact] for contact in contacts]
        part = (1.0 - FIRST_IMAGE) / len(groups)

        def press_of(number: int, seen: ChiefRays | TactileImage) -> Press:
            mask = seen.contact_mask
            if together:
                mask = mask & (nearest_press(seen.points, mask, centres) == number)
            return Press(
                number=number + 1,
                mask=mask,
                response=dark,
                normals=seen.normals,
                points=seen.points,
                before=before,
                camera=self.model.picture_chain,
                **frames[number]._asdict(),
            )

        image: TactileImage | None = None
        for number in range(len(frames)):
            if image is None or not together:
                numbers = range(len(frames)) if together else (number,)
                pixel_importance = (
                    None
                    if self._reads is None
                    else partial(self._pixel_importance, press_of, numbers)
                )
                image = self._render(
                    [contacts[each] for each in numbers],
                    FIRST_IMAGE + (not together) * number * part,
                    part,
                    pixel_importance,
                    "pressing" if together else f"press {number + 1} of {len(frames)}",
                )
            press = press_of(number, image)
            press.check_seen()
            yield press, image

    def _pixel_importance(
        self, press_of: Callable[[int, ChiefRays], Press], numbers: Iterable[int], rays: ChiefRays
    ) -> NDArray[np.float64]:
        """Return the importance (h, w) of the pixels of an image's presses (see `Reads`).

        It is 1 for all pixels if an objective cannot judge the press; the objective reports the
        reason later.
        """
        assert self._reads is not None
        found = []
        for number in numbers:
            press = press_of(number, rays)
            try:
                press.check_seen()
                found.append(self._reads(press))
            except ObjectiveError:
                return np.ones(press.mask.shape)
        return np.maximum.reduce(found)

    def _unexposed(self) -> list[UnexposedPress]:
        self.untouched  # noqa: B018  first, as it includes tracing the light
        return [
            UnexposedPress(press, image.contact_mask, radiance_in(image, image.contact_mask))
            for press, image in self.each_press()
        ]

    @property
    def _untouched_radiance(self) -> NDArray[np.float32]:
        return self.shared("untouched radiance", lambda: self.untouched.radiance)

    def _auto_exposure(self) -> float:
        seen = self.shared("pressed images", self._unexposed)
        camera = self.model.picture_chain
        pressed = [
            camera.metered(each.radiance[each.press.mask[each.touched]], each.press.mask)
            for each in seen
        ]
        return exposure_for(self._untouched_radiance, pressed, camera)

    def _presses(self) -> list[Press]:
        presses = self.shared("exposed presses", lambda: self._exposed(self.exposure))
        for press in presses:
            press.check()
        return presses

    def _exposed(self, exposure: float) -> list[Press]:
        return [
            replace(
                each.press,
                response=self._response(each.touched, each.radiance, exposure),
                respond_untouched=partial(self._untouched_response, exposure),
            )
            for each in self.shared("pressed images", self._unexposed)
        ]

    def _untouched_response(self, exposure: float, noisy: bool = False) -> NDArray[np.float32]:
        """Return the response (h, w, 3) of the untouched sensor, computed once per exposure."""
        if (exposure, noisy) not in self._untouched_responses:
            chain = self.model.picture_chain
            camera = chain if noisy else chain.without_noise()
            self._untouched_responses[exposure, noisy] = camera.respond(
                self._untouched_radiance * np.float32(exposure), seed=self.settings.seed
            )
        return self._untouched_responses[exposure, noisy]

    def _response(
        self, touched: NDArray[np.bool_], radiance: NDArray[np.float32], factor: float
    ) -> NDArray[np.float32]:
        """Return the camera sensor's response (h, w, 3), 0 to 1.

        Contacts have the radiance (n, 3) in the n pixels that they touch. The response of other
        pixels is that of the untouched sensor, except within the reach of the blur of overexposed
        contact pixels.
        """
        exposure, untouched = np.float32(factor), self._untouched_radiance
        camera, seed = self.model.picture_chain, self.settings.seed
        response = self._untouched_response(factor, noisy=True).copy()
        if touched.any():
            reach = camera.reach(touched.shape[1])
            changed, needed = box_around(touched, reach), box_around(touched, 2 * reach)
            part = untouched[needed].copy()
            part[touched[needed]] = radiance
            inner = tuple(
                slice(small.start - large.start, small.stop - large.start)
                for small, large in zip(changed, needed, strict=True)
            )
            window = PictureWindow.part(touched.shape, needed)
            response[changed] = camera.respond(part * exposure, window, seed)[inner]
        return response

    def _render(
        self,
        contacts: Sequence[Contact],
        done: float,
        part: float,
        pixel_importance: Callable[[ChiefRays], NDArray[np.float64]] | None = None,
        what: str = "",
    ) -> TactileImage:
        """Render one image, which advances the progress from `done` by `part`.

        `what` is reported with the progress; if it is empty, the stage of the render is.
        """

        def report(progress: RenderProgress) -> None:
            text = what or progress.stage.value
            if progress.fraction == 1.0:  # the objective's own work follows
                text = "judging the images"
            self._progress(done + part * progress.fraction, text)

        image = self.model.render(
            contacts,
            resolution=self.resolution,
            photons=SCORE_PHOTONS if self.settings.photons is None else self.settings.photons,
            seed=self.settings.seed,
            progress=report,
            only_contacts=bool(contacts),
            pixel_importance=pixel_importance,
            skin=self.settings.skin,
        )
        return image

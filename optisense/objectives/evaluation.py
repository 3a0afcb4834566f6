"""Images and rays that the objectives of one sensor share, made once, on first use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.design.camera_checks import camera_fault
from optisense.design.lenses.film import PictureWindow
from optisense.design.material_checks import index_problems
from optisense.design.problems import Diagnostic
from optisense.errors import ObjectiveError
from optisense.geometry import Contact, Sphere
from optisense.objectives.exposure import exposure_for
from optisense.objectives.frames import frame_of, nearest_press
from optisense.objectives.made_once import MadeOnce
from optisense.objectives.press import Press
from optisense.objectives.settings import VIEW_ACROSS, Settings, size_for
from optisense.objectives.unexposed import (
    UnexposedPress,
    are_apart,
    box_around,
    radiance_in,
)
from optisense.objectives.view import View, view_of
from optisense.quality import SCORE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, OpticalModel, RenderProgress, TactileImage

ProgressCallback = Callable[[float, str], None]
"""Called with the finished fraction (0 to 1) of the work and a few words on what is being done."""

Reads = Callable[[Press], NDArray[np.float64]]
"""The pixels (h, w) of a press, not exposed, that objectives read: 1 one by one, less where a part
of the camera samples will do."""


class Evaluation(MadeOnce):
    """One sensor, ready to be judged by several objectives.

    Attributes:
        model: the sensor's optical model; must not change while it is judged.
        settings: which images and rays.
        seconds: wall time of each shared step so far.
    """

    def __init__(
        self,
        model: OpticalModel,
        settings: Settings | None = None,
        progress: ProgressCallback | None = None,
        reads: Reads | None = None,
    ) -> None:
        """Judge a model; nothing is rendered yet.

        Args:
            model: the sensor's.
            settings: of images and rays.
            progress: called while images are rendered.
            reads: which pixels of a press the objectives read, if not all one by one. The others
                decide about the exposure only, and are rendered roughly (`registry.pixels_read`).
        """
        super().__init__()
        self.model = model
        self._reads = reads
        self.settings = settings or Settings()
        self._progress = progress or (lambda fraction, text: None)
        self._untouched_responses: dict[tuple[float, bool], NDArray[np.float32]] = {}

    @property
    def design(self) -> SensorDesign:
        """The sensor design."""
        return self.model.design

    @property
    def resolution(self) -> tuple[int, int]:
        """(width, height) of the images."""
        return self.settings.resolution or size_for(self.design.camera.resolution)

    @property
    def ray_resolution(self) -> tuple[int, int]:
        """(width, height) of the chief rays."""
        return self.settings.ray_resolution or size_for(self.design.camera.resolution)

    @property
    def sensing_faces(self) -> int:
        """Number of triangles of the sensing surface; `ChiefRays.face` counts them."""
        return len(self.model.sensing.faces)

    @property
    def chief_rays(self) -> ChiefRays:
        """One chief ray a pixel of `ray_resolution`, of the untouched sensor."""
        return self.shared("chief rays", lambda: self.model.chief_rays(self.ray_resolution))

    def check_possible(self) -> None:
        """Make sure that there can be such a camera and such materials.

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
        """How much the camera sees, by rays of its own (see `settings.VIEW_ACROSS`)."""
        size = size_for(self.design.camera.resolution, VIEW_ACROSS)
        return self.shared(
            "view", lambda: view_of(self.model.chief_rays(size), self.model.sensing.face_areas)
        )

    @property
    def judged_rays(self) -> ChiefRays:
        """The chief rays of a camera that sees enough to be scored by them.

        Raises:
            ObjectiveError: it sees less than `Settings.least_skin` or `Settings.least_picture`.
        """
        self.view.refuse_less(self.settings)
        return self.chief_rays

    @property
    def untouched(self) -> TactileImage:
        """The image of the untouched sensor."""
        return self.shared("untouched image", lambda: self._render((), 0.0, self._first_image))

    @property
    def exposure(self) -> float:
        """The factor from radiance to what the camera reads; 1 fills its wells.

        Automatic: see `exposure_for`.
        """
        if self.settings.exposure == "auto":
            return self.shared("exposure", self._auto_exposure)
        return float(self.settings.exposure)

    @property
    def untouched_exposure(self) -> float:
        """The factor that suits the untouched sensor, whatever contacts look like."""
        if self.settings.exposure == "auto":
            chain = self.model.picture_chain
            return self.shared(
                "untouched exposure", lambda: chain.auto_exposure(self._untouched_radiance)
            )
        return float(self.settings.exposure)

    @property
    def contacts(self) -> list[Contact]:
        """The ball at each place."""
        return self.shared("contacts", self._contacts)

    @property
    def presses(self) -> list[Press]:
        """One press a place, each checked.

        Raises:
            ObjectiveError: a place is not seen, overexposed or black.
        """
        return self.shared("presses", self._presses)

    @property
    def calibration_presses(self) -> list[Press]:
        """One press a place, under the exposure that suits the untouched sensor, as users set the
        camera before they calibrate a sensor; they may be overexposed or black.

        Raises:
            ObjectiveError: a place is not seen.
        """
        exposure = self.untouched_exposure
        if exposure == self.exposure:
            return self.shared("exposed presses", lambda: self._exposed(exposure))
        return self.shared("calibration presses", lambda: self._exposed(exposure))

    def _contacts(self) -> list[Contact]:
        """Presses at the places that the user named, or at nine that cover what is seen.

        Raises:
            ObjectiveError: nine places would crowd on the little that the camera sees.
        """
        ball = Sphere(self.settings.radius)
        if self.settings.places is None:
            self.view.refuse_less(self.settings)
            return self.model.nine_contacts(ball, self.settings.depth)
        return [Contact(ball, at=at, depth=self.settings.depth) for at in self.settings.places]

    def each_press(self) -> Iterator[tuple[Press, TactileImage]]:
        """Each press, neither exposed (its response is 0) nor checked yet, with the image that it
        is seen in; rendered one by one.

        For those who need an image's layers; they are not kept here.

        Raises:
            ObjectiveError: the camera does not see a place.
        """
        contacts, surface = self.contacts, self.model.surface
        before = self.model.chief_rays(self.resolution).normals
        dark = np.broadcast_to(np.float32(0.0), before.shape)
        frames = [frame_of(contact, surface) for contact in contacts]
        together = self.settings.together and are_apart(
            [each["place"] for each in frames], self.settings.radius, self.settings.depth
        )
        groups = [contacts] if together else [[contact] for contact in contacts]
        part = (1.0 - self._first_image) / len(groups)

        def press_of(number: int, seen: ChiefRays | TactileImage) -> Press:
            mask = seen.contact_mask
            if together:
                mask = mask & (nearest_press(seen.points, mask, frames) == number)
            return Press(
                number=number + 1,
                mask=mask,
                response=dark,
                normals=seen.normals,
                points=seen.points,
                before=before,
                camera=self.model.picture_chain,
                **frames[number],
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
                    self._first_image + (not together) * number * part,
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
        """(h, w): which pixels of an image's presses objectives read (see `Reads`).

        All, one by one, where an objective can't say, since it can't judge the press: it will tell
        why.
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

    @property
    def _first_image(self) -> float:
        """The share of the first image in the time of all rendering: light is traced for it."""
        from optisense.objectives.registry import BUILT_IN
        from optisense.objectives.usual_score import usual_score

        usual = usual_score(self.design, BUILT_IN[:1], self.settings)
        return self.shared("first image", lambda: usual.share_of_first_image)

    def _unexposed(self) -> list[UnexposedPress]:
        self.untouched  # noqa: B018  light is traced for it, which progress counts first
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
        """(h, w, 3), made once for each exposure."""
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
        """(h, w, 3): the camera sensor's response, 0 to 1; the untouched one outside contacts,
        which have a radiance (n, 3) in the n pixels that they touch.

        Overexposure spreads as far as its blur reaches, so only what lies that near to a contact
        is worked out anew.
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
        """One image, which takes the progress from `done` by `part`.

        `what` is told with the progress; the stage of the render where it is empty.

        Raises:
            KeyboardInterrupt: Ctrl-C ended it early; a score of half the light would mislead.
        """

        def report(progress: RenderProgress) -> None:
            text = what or progress.stage.value
            if progress.fraction == 1.0:  # what comes now is the objective's own work
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
            partial=False,
            skin=self.settings.skin,
        )
        return image

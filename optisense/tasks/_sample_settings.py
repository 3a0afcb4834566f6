"""Settings of samples: those that all kinds of samples share, and those of datasets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from optisense.errors import TaskError
from optisense.geometry import Contact
from optisense.keyword_types import set_plain_numbers
from optisense.mechanics import ELASTIC
from optisense.optics.estimators import RADIANCE_CACHE
from optisense.quality import MOST_SEED, SAMPLE_PHOTONS
from optisense.reading.camera_noise import MEASURED_NOISE
from optisense.tasks._draws import ContactDraw

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage


@dataclass(frozen=True, kw_only=True)
class SampleRendering:
    """Settings of the pictures of samples.

    Attributes:
        resolution: (width, height) pixels; None for that of the kind of samples.
        photons: number of photons of the light that all samples share.
        seed: seed of all random numbers; sample i depends on it and on i only.
        camera_noise: standard deviation in levels of 255 (see `camera_noise`).
        skin: "elastic" or "conforming"; see docs/mechanics.md.
    """

    resolution: tuple[int, int] | None = None
    photons: int = SAMPLE_PHOTONS
    seed: int = 0
    camera_noise: float = MEASURED_NOISE
    skin: str = ELASTIC

    def __post_init__(self) -> None:
        set_plain_numbers(self)
        if not 0 <= self.camera_noise < 256:
            raise TaskError(f"the camera noise is {self.camera_noise:g}", hint="Give 0 to 255")
        if not 0 <= self.seed <= MOST_SEED:
            raise TaskError(f"the seed is {self.seed}", hint=f"Give a number from 0 to {MOST_SEED}")

    def render(
        self,
        model: OpticalModel,
        contacts: Sequence[Contact],
        resolution: tuple[int, int],
        *,
        estimator: str = RADIANCE_CACHE,
        only_contacts: bool = False,
    ) -> TactileImage:
        """Return the image of contacts.

        Args:
            resolution: (width, height) pixels.
            estimator, only_contacts: see `OpticalModel.render`.
        """
        return model.render(
            contacts,
            resolution=resolution,
            photons=self.photons,
            seed=self.seed,
            estimator=estimator,
            skin=self.skin,
            only_contacts=only_contacts,
        )


@dataclass(frozen=True)
class DatasetSettings(SampleRendering):
    """Settings of the samples. The number of samples does not affect the first ones.

    Attributes:
        contacts: ranges that contacts are drawn from.
        resolution: (width, height) pixels; None for the camera's own.
        photons: number of photons of the radiance cache that all samples share.
        seed: seed of all random numbers; sample i depends on it and on i only.
        exposure: a factor on the radiance, or "auto" for that of the untouched sensor. It is the
            same for all samples, as for a camera with a fixed exposure.
        camera_noise: standard deviation in levels of 255 (see `camera_noise`); with 0 pictures have
            no noise, so that it can be added when they are used.
        radiance: whether linear radiance is written as EXR as well.
        estimator: "radiance-cache" or "sppm"; see docs/simulation.md.
        hold_out: texts of indenters that are in the test split only.
        skin: "elastic" or "conforming"; see docs/mechanics.md.
    """

    contacts: ContactDraw = field(default_factory=ContactDraw)
    exposure: float | str = "auto"
    camera_noise: float = field(default=0.0, kw_only=True)
    radiance: bool = False
    estimator: str = RADIANCE_CACHE
    hold_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        for text in self.hold_out:
            if text not in self.contacts.indenters:
                raise TaskError(
                    f"'{text}' is held out, but it is not one of the indenters",
                    hint="Indenters: " + ", ".join(self.contacts.indenters),
                )

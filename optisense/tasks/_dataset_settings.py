"""Settings of the samples of a dataset."""

from __future__ import annotations

from dataclasses import dataclass, field

from optisense.errors import TaskError
from optisense.optics.estimators import RADIANCE_CACHE
from optisense.tasks._draws import ContactDraw
from optisense.tasks._sample_rendering import SampleRendering


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

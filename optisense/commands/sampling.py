"""Options of commands that press objects into a sensor at random places."""

from __future__ import annotations

from typing import Annotated, Any

from annotated_types import Ge, Le
from pydantic import Field

from optisense.commands.options import (
    MOST_ITEMS,
    SKIN_HELP,
    CommandOptions,
    Exposure,
    OptionNotation,
    Photons,
    Range,
    Resolution,
    Seed,
    Skin,
)
from optisense.mechanics.skins import ELASTIC
from optisense.optics.estimators import ESTIMATORS, RADIANCE_CACHE
from optisense.quality import QUICK_PHOTONS, SAMPLE_PHOTONS

NOISE = 1.5
"""Noise of the pictures that tasks are read from, standard deviation in levels of 255, as of a real
GelSight Mini.
"""

CameraNoise = Annotated[float, Ge(0.0), Le(255.0), OptionNotation("LEVELS")]
NOISE_HELP = (
    "Camera noise to add to the pictures: its standard deviation in levels of 255; a real GelSight "
    "Mini has 1.1 to 1.9."
)


ReaderMethod = Annotated[str, OptionNotation("network|table")]
READER_HELP = "What estimates normals from colours: a neural network or a lookup table."


class PictureOptions(CommandOptions):
    """Options of the pictures of a task."""

    seed: Seed = Field(
        0, description="Seed of the random numbers; the same seed gives the same contacts."
    )
    camera_noise: CameraNoise = Field(NOISE, description=NOISE_HELP)
    resolution: Resolution | None = Field(
        None,
        description="Width and height of the pictures in pixels; if left out, those of the "
        "camera, or those that the task needs.",
    )
    photons: Photons = Field(
        SAMPLE_PHOTONS, description="Photons of the light that all pictures share."
    )
    skin: Skin = Field(ELASTIC, description=SKIN_HELP)


class EstimatorOptions(PictureOptions):
    """Options of pictures that either estimator can render."""

    estimator: Annotated[str, OptionNotation("|".join(ESTIMATORS))] = Field(
        RADIANCE_CACHE,
        description="How the light is computed: from a radiance cache, or by progressive photon "
        "mapping (sppm), which is slow, and exact also where plates cover the gel.",
    )


class SampleOptions(EstimatorOptions):
    """Options of the samples of a perception task."""

    samples: Annotated[int, Ge(10), Le(MOST_ITEMS), OptionNotation("N", ("--samples", "-n"))] = (
        Field(200, description="Number of random contacts.")
    )
    neighbours: Annotated[int, Ge(2), Le(MOST_ITEMS), OptionNotation("K")] = Field(
        5,
        description="Number of nearest neighbours from which the signal-to-noise ratio is "
        "computed.",
    )

    def settings(self) -> dict[str, Any]:
        """Return the arguments of `optisense.tasks.SampleSettings`, which is slow to load."""
        made = self.model_dump(include=set(EstimatorOptions.model_fields))
        return made | {"count": self.samples}


class CylinderOptions(SampleOptions):
    """Options of the samples of the task that reads the radius of a cylinder."""

    radius: Range = Field(
        "1:6", validate_default=True, description="Range of the cylinder's radius, mm."
    )


class DatasetOptions(EstimatorOptions):
    """Options of the samples of a dataset."""

    indenter: Annotated[list[str], OptionNotation("KIND:SIZE")] = Field(
        ["sphere:1.5"],
        description="An indenter (sizes in mm): sphere:1.5, cylinder:2,6, plane or mesh:FILE. "
        "May be given several times; all are equally likely.",
    )
    depth: Range = Field(
        "0.3:1",
        validate_default=True,
        description="Range of the depth of presses, mm; depths are uniformly distributed.",
    )
    rotation: Range = Field(
        "0:360",
        validate_default=True,
        description="Range of the rotation about the surface normal, degrees.",
    )
    tilt: Annotated[float, Ge(0.0), Le(89.0), OptionNotation("DEGREES")] = Field(
        0.0, description="Largest tilt about each of two axes, degrees."
    )
    margin: Annotated[float, Ge(0.0), Le(49.0), OptionNotation("PERCENT")] = Field(
        2.0,
        description="Distance between a contact and the edge of the picture, per cent of the "
        "picture's width; with 0 the edge may cut contacts.",
    )
    seed: Seed = Field(0, description="Seed of the random places, depths and noise.")
    camera_noise: CameraNoise = Field(0.0, description=NOISE_HELP)
    exposure: Exposure = Field(
        "auto",
        description="Exposure of all pictures: a factor on the radiance; auto suits the untouched "
        "sensor.",
    )
    hold_out: Annotated[list[str], OptionNotation("KIND:SIZE")] = Field(
        default_factory=list,
        description="An --indenter that only the test split contains. May be given several times.",
    )
    radiance: bool = Field(False, description="Also write linear radiance as EXR files.")

    def settings(self) -> dict[str, Any]:
        """Return the arguments of `optisense.tasks.DatasetSettings`, which is slow to load."""
        from optisense.tasks import ContactDraw

        drawn = {"indenter", "depth", "rotation", "tilt", "margin"}
        contacts = ContactDraw(
            tuple(self.indenter), self.depth, self.rotation, self.tilt, self.margin / 100
        )
        made = self.model_dump(exclude=drawn)
        return made | {"contacts": contacts, "hold_out": tuple(self.hold_out)}


class ReconstructionOptions(PictureOptions):
    """Options of reconstructions, which read the shape of an object from colours."""

    method: ReaderMethod = Field("network", description=READER_HELP)
    presses: Annotated[int, Ge(1), Le(MOST_ITEMS), OptionNotation("N")] = Field(
        40, description="Number of ball presses that calibrate the reader of normals."
    )
    radius: Annotated[float, Ge(0.01), OptionNotation("MM")] = Field(
        1.5, description="Radius of these balls, mm."
    )
    depth: Range = Field(
        "0.2:0.6", validate_default=True, description="Range of the depth of these presses, mm."
    )


ALL_OBJECTS = 12
"""Number of objects in `optisense.geometry.objects`, which is too slow to be imported here."""

QUICK_OBJECTS = ("screw-head", "coin", "cable", "wedge", "nut", "bean")
"""Objects of a quick verification: the fewest that show a difference, of different shapes."""

QUICK_WIDTH = 160
"""Width of the pictures of a quick verification, pixels; objects of 5 mm cover 1000 or more."""

PLACES, QUICK_PLACES = 3, 2
"""Presses of each object, usual and quick: the fewest whose spread is informative, and the fewest
that have one.
"""

PRESSES, QUICK_PRESSES = 40, 20
"""Balls that readers are fitted to, usual and quick: as for a reconstruction, and half of them."""


class VerifyOptions(CommandOptions):
    """Options of a comparison of two sensors on objects that no score has used."""

    quick: bool = Field(
        False,
        description="Use six objects, small pictures and few photons; faster and less certain.",
    )
    objects: Annotated[list[str], OptionNotation("NAME", ("--object",), "all twelve")] = Field(
        [],
        description="An object to press: screw-head, coin, nut, ... May be given several times.",
    )
    places: (
        Annotated[int, Ge(1), Le(MOST_ITEMS), OptionNotation("N", usual="3, quick 2")] | None
    ) = Field(None, description="Number of presses of each object.")
    presses: (
        Annotated[int, Ge(1), Le(MOST_ITEMS), OptionNotation("N", usual="40, quick 20")] | None
    ) = Field(None, description="Number of ball presses that calibrate the reader of each sensor.")
    seed: Seed = Field(0, description="Seed of the random places, presses and noise.")
    camera_noise: CameraNoise = Field(NOISE, description=NOISE_HELP)
    resolution: Resolution | None = Field(
        None,
        description="Width and height of the pictures in pixels; if left out, 320 wide, or 160 "
        "with --quick.",
    )
    photons: (
        Annotated[Photons, OptionNotation("N", usual="fine, quick 500,000", is_text=True)] | None
    ) = Field(None, description="Photons of the light that all pictures of a sensor share.")
    skin: Skin = Field(ELASTIC, description=SKIN_HELP)
    method: ReaderMethod = Field("network", description=READER_HELP)

    def wanted_photons(self) -> int:
        """Return the number of photons of the light of each sensor."""
        return self.photons or (QUICK_PHOTONS if self.quick else SAMPLE_PHOTONS)

    def pictures(self) -> int:
        """Return the number of pictures of each sensor."""
        objects = len(self.objects) or (len(QUICK_OBJECTS) if self.quick else ALL_OBJECTS)
        return self._presses() + objects * self._places()

    def settings(self) -> Any:
        """Return the settings of `optisense.tasks.verify`, which takes a second to load."""
        from optisense.tasks import ReconstructionSettings, VerificationSettings

        reading = ReconstructionSettings(
            method=self.method,
            presses=self._presses(),
            seed=self.seed,
            camera_noise=self.camera_noise,
            resolution=self.resolution,
            width=QUICK_WIDTH if self.quick else ReconstructionSettings.width,
            photons=self.wanted_photons(),
            skin=self.skin,
        )
        chosen = self.objects or (QUICK_OBJECTS if self.quick else VerificationSettings.objects)
        return VerificationSettings(tuple(chosen), self._places(), reading=reading)

    def _presses(self) -> int:
        return self.presses or (QUICK_PRESSES if self.quick else PRESSES)

    def _places(self) -> int:
        return self.places or (QUICK_PLACES if self.quick else PLACES)

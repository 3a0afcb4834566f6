"""A dataset of labelled contacts on disk, and functions to read it."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import TaskError
from optisense.picture_files import read_picture
from optisense.tasks._splits import SPLITS
from optisense.tasks.dataset_tables import INFO, LABELS, read_failures, read_info, read_labels
from optisense.text import brief
from optisense.untrusted_arrays import check_arrays, read_arrays
from optisense.untrusted_files import COPY_AGAIN, inside, is_file

BACKGROUND = "background.npz"
CAMERA = "camera.npz"
DESIGN = "design"

MAKE_AGAIN = "Copy the file again, or make it again: optisense dataset with --mend"

ArrayKinds = Mapping[str, tuple[str, int | None]]

SAMPLE_ARRAYS: ArrayKinds = {"depth": ("f", None), "mask": ("b", None), "normals": ("f", 3)}
"""Kind of the numbers (as of `numpy.dtype.kind`) and number of channels, None for (h, w), of each
array that all samples have."""

LATER_ARRAYS: ArrayKinds = {
    "points": ("f", 3),
    "pressure": ("f", None),
    "penetration": ("f", None),
    "displacement": ("f", 3),
}
"""Kinds and channels of arrays that may be missing: release 0.1 wrote none of them, and only an
elastic skin has pressure, penetration and displacement."""

BACKGROUND_ARRAYS: ArrayKinds = {"image": ("u", 3), "points": ("f", 3), "normals": ("f", 3)}
"""Kinds and channels of the arrays of `BACKGROUND`."""

CAMERA_ARRAYS: ArrayKinds = {"points": ("f", 3), "directions": ("f", 3)}
"""Kinds and channels of the arrays of `CAMERA`."""


@dataclass(frozen=True, eq=False)
class Sample:
    """One labelled contact; row 0 of arrays is the top of the image.

    Attributes:
        image: (h, w, 3) uint8, sRGB.
        depth: (h, w) float32, displacement of the skin along the inward normal, mm.
        normals: (h, w, 3) float32, unit normals into the gel, in the design's frame.
        mask: (h, w) bool, the pixels that see the indenter.
        labels: the sample's row of `LABELS`, with converted numbers.
        points: (h, w, 3) float32, points (mm) of the pressed surface in the design's frame, NaN
            where the camera sees none; None in samples of release 0.1.
        pressure: (h, w) float32, MPa; NaN where no skin is seen. This and the next two are None if
            the skin is not elastic.
        penetration: (h, w) float32, depth (mm) of the undeformed skin inside the indenter, 0
            outside; NaN where no skin is seen.
        displacement: (h, w, 3) float32, displacement (mm) of the skin in the design's frame; NaN
            where no skin is seen.
        markers: (n, 4) float32, column and row (pixels) of each marker in the untouched sensor, and
            in this sample; NaN where it is not seen. None if the design has no markers.
    """

    image: NDArray[np.uint8]
    depth: NDArray[np.float32]
    normals: NDArray[np.float32]
    mask: NDArray[np.bool_]
    labels: dict[str, Any]
    points: NDArray[np.float32] | None = None
    pressure: NDArray[np.float32] | None = None
    penetration: NDArray[np.float32] | None = None
    displacement: NDArray[np.float32] | None = None
    markers: NDArray[np.float32] | None = None


@dataclass(frozen=True)
class Dataset:
    """A folder of samples, opened for reading; each sample is read on access.

    Attributes:
        folder: the folder.
        info: the content of `dataset.json`.
        labels: one row per sample, in the order of the samples.
        failures: rows of contacts that could not be made.
    """

    folder: Path
    info: dict[str, Any]
    labels: list[dict[str, Any]]
    failures: list[dict[str, str]]

    @classmethod
    def load(cls, folder: str | Path) -> Dataset:
        """Open a dataset, finished or not.

        Raises:
            TaskError: the folder holds no dataset of this release, or its tables cannot be read.
        """
        folder = Path(folder)
        if not is_file(folder / INFO):
            raise TaskError(
                "there is no dataset in this folder",
                where=str(folder),
                hint=f"Name a folder that holds a {INFO}",
            )
        return cls(folder, read_info(folder), read_labels(folder), read_failures(folder))

    def __len__(self) -> int:
        return len(self.labels)

    def lacking(self) -> list[dict[str, Any]]:
        """Return the labels of the samples that lack a file in the folder: the picture, the arrays
        or, in a dataset with radiance, the radiance. Damaged files are found when they are read.
        """

        def has(name: str) -> bool:
            path = inside(self.folder, name)
            return path is not None and is_file(path)

        def names(row: dict[str, Any]) -> list[str]:
            radiance = [row["radiance"]] if row["radiance"] else []
            return [row["file_name"], row["arrays"], *radiance]

        return [row for row in self.labels if not all(map(has, names(row)))]

    def __getitem__(self, number: int) -> Sample:
        """Read a sample.

        Raises:
            TaskError: one of its files is missing or damaged; the message names sample and file.
            TypeError: the number is a slice, or no whole number.
        """
        labels = self.labels[operator.index(number)]
        try:
            arrays = self._arrays(labels["arrays"], SAMPLE_ARRAYS)
            picture = self._existing(labels["file_name"])
            image = read_picture(picture, TaskError)
            height, width = arrays["mask"].shape
            if image.shape != (height, width, 3):
                raise TaskError(
                    f"the picture has {image.shape[1]} x {image.shape[0]} pixels, not "
                    f"{width} x {height}",
                    where=str(picture),
                )
        except TaskError as error:
            message = f"sample {labels['index']}: {error.message}"
            hint = error.hint if error.hint not in (None, COPY_AGAIN) else MAKE_AGAIN
            raise TaskError(message, where=error.where, hint=hint) from error
        known: dict[str, Any] = {name: arrays.get(name) for name in (*SAMPLE_ARRAYS, *LATER_ARRAYS)}
        markers = self._markers(arrays, labels["arrays"])
        return Sample(image=image, labels=labels, markers=markers, **known)

    def __iter__(self) -> Iterator[Sample]:
        return (self[number] for number in range(len(self)))

    def background(self) -> dict[str, NDArray[Any]]:
        """Return arrays of the untouched sensor: image (uint8, without camera noise), points (mm),
        normals.

        Raises:
            TaskError: its file is missing or damaged.
        """
        return self._arrays(BACKGROUND, BACKGROUND_ARRAYS)

    def camera_rays(self) -> dict[str, NDArray[Any]]:
        """Return the ray of each pixel inside the gel, in the frame of the design: "points" (h, w,
        3), mm, on the skin at rest, and "directions" (h, w, 3), unit vectors away from the skin;
        NaN where the camera sees none.

        Raises:
            TaskError: its file is missing, as in datasets of release 0.1, or damaged.
        """
        return self._arrays(CAMERA, CAMERA_ARRAYS)

    @property
    def empty_splits(self) -> list[str]:
        """Names of the splits without samples; none for a dataset of release 0.1, which has no
        splits.
        """
        used = {row["split"] for row in self.labels}
        return [] if "" in used else [name for name in SPLITS if name not in used]

    def split(self, name: str) -> list[int]:
        """Return the indices of the samples of a split, for use in `dataset[number]`.

        Args:
            name: "train", "validation" or "test".

        Raises:
            TaskError: there is no such split, or the dataset is of release 0.1, without splits.
        """
        if name not in SPLITS:
            raise TaskError(f"there is no split '{name}'", hint="Name one: " + ", ".join(SPLITS))
        if any(row["split"] == "" for row in self.labels):
            raise TaskError(
                "the dataset has no splits",
                where=str(self.folder / LABELS),
                hint="An earlier release made it; make it again in another folder",
            )
        return [number for number, row in enumerate(self.labels) if row["split"] == name]

    def _existing(self, name: str) -> Path:
        path = inside(self.folder, name)
        if path is None:
            raise TaskError(
                f"'{brief(name)}' leads out of the dataset's folder",
                where=str(self.folder / LABELS),
                hint="The dataset may be manipulated: use only files that you trust",
            )
        if not is_file(path):
            raise TaskError(
                f"the dataset lacks the file '{brief(name)}'",
                where=str(self.folder),
                hint=MAKE_AGAIN,
            )
        return path

    def _markers(self, arrays: Mapping[str, NDArray[Any]], name: str) -> NDArray[np.float32] | None:
        markers = arrays.get("markers")
        if markers is not None and (
            markers.dtype.kind != "f" or markers.ndim != 2 or markers.shape[1] != 4
        ):
            raise TaskError(
                f"the array 'markers' has the shape {markers.shape}, not (n, 4)",
                where=str(self.folder / name),
                hint=COPY_AGAIN,
            )
        return markers

    def _arrays(self, name: str, kinds: ArrayKinds) -> dict[str, NDArray[Any]]:
        path = self._existing(name)
        arrays = read_arrays(path, TaskError)
        width, height = self.info["settings"]["resolution"]
        later = {each: LATER_ARRAYS[each] for each in LATER_ARRAYS if each in arrays}
        check_arrays(arrays, {**kinds, **later}, (height, width), path, TaskError)
        return arrays

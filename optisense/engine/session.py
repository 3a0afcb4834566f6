"""State that the engine keeps between requests, and the files that a request writes."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.design.limits import unit_slips
from optisense.design.problems import raise_problems
from optisense.engine.designs import Designs
from optisense.engine.failures import ProtocolError
from optisense.engine.jobs import PriorityGate
from optisense.engine.protocol import Fields
from optisense.errors import OutputError
from optisense.geometry import Contact, TriangleMesh
from optisense.text import brief
from optisense.untrusted_files import is_folder
from optisense.writing import written_whole

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage
    from optisense.optics.drafts import DraftModel
    from optisense.report.camera_rays import CameraRays

LONGEST_NAME = 150
"""Largest length of the common prefix of a request's files, bytes; file systems allow names of 255
bytes, and endings follow.
"""


class Files:
    """Files of one request: in its folder, with its name as prefix."""

    def __init__(self, folder: Path, name: str) -> None:
        """Prepare files `NAME.*` in a folder.

        Raises:
            OutputError: there is no such folder, or the name can't be part of a file name.
        """
        if not is_folder(folder):
            raise OutputError(
                "there is no such folder", where=str(folder), hint="Make it before it is named"
            )
        if name != Path(name).name or name in ("", ".", "..") or not name.isprintable():
            raise OutputError(
                f"'{brief(name)}' can't be the beginning of a file's name",
                hint="Use letters, digits, '-' and '_'",
            )
        if len(name.encode("utf-8", "replace")) > LONGEST_NAME:
            raise OutputError(
                f"'{brief(name)}' is too long for the name of a file",
                hint=f"Use at most {LONGEST_NAME} bytes",
            )
        self.folder = folder
        self.name = name

    def path(self, rest: str) -> Path:
        """Return the path of the file with an ending."""
        return self.folder / f"{self.name}.{rest}"

    def picture(self, rest: str, picture: NDArray[np.uint8]) -> str:
        """Write a picture (h, w, 3) uint8 as a PNG file, and return its path."""
        from optisense.picture_files import write_picture

        return self._write(rest, lambda path: write_picture(path, picture))

    def array(self, rest: str, values: NDArray[Any]) -> str:
        """Write an array of any shape as a NumPy file, and return its path."""
        whole = np.ascontiguousarray(values)

        def write(path: Path) -> None:
            with path.open("wb") as file:
                np.save(file, whole)

        return self._write(rest, write)

    def mesh(self, rest: str, mesh: TriangleMesh) -> dict[str, str]:
        """Write a mesh as float32 vertices and int32 faces, and return their paths."""
        return {
            "vertices": self.array(f"{rest}.vertices.npy", mesh.vertices.astype(np.float32)),
            "faces": self.array(f"{rest}.faces.npy", mesh.faces.astype(np.int32)),
        }

    def meshes(
        self, meshes: Mapping[str, TriangleMesh], before: str = ""
    ) -> dict[str, dict[str, str]]:
        """Write several meshes, and return their paths by name."""
        return {name: self.mesh(f"{before}{name}", mesh) for name, mesh in meshes.items()}

    def _write(self, rest: str, write: Callable[[Path], object]) -> str:
        path = self.path(rest)
        with written_whole(path) as temporary:
            write(temporary)
        return str(path)


MOST_IMAGES = 6
"""Number of images that are kept for one design, to compare with and to relight; one of 640x480
with three light groups takes some 30 MB.
"""
DRAFTS = 1
"""Number of drafts that are kept for one design: one, as only the last one is shown."""


@dataclass(frozen=True)
class KeptImage:
    """Image with the data that it was made from.

    Attributes:
        image: layers of the image.
        design: design of the sensor.
        contacts: contacts in the image.
        exposure: factor on the radiance in the picture.
        draft: whether it is a draft.
        rays: chief rays to draw in the report; None for a draft.
    """

    image: TactileImage
    design: SensorDesign
    contacts: Sequence[Contact]
    exposure: float
    draft: bool
    rays: CameraRays | None = None


class Images:
    """Cache of the last images, by the names of their requests."""

    def __init__(self) -> None:
        """Start with an empty cache."""
        self._kept: OrderedDict[str, KeptImage] = OrderedDict()
        self._lock = threading.Lock()

    def keep(self, name: str, image: KeptImage) -> None:
        """Keep an image, and drop the oldest of its kind."""
        with self._lock:
            self._kept.pop(name, None)
            self._kept[name] = image
            same = [key for key, each in self._kept.items() if each.draft == image.draft]
            for key in same[: len(same) - (DRAFTS if image.draft else MOST_IMAGES)]:
                del self._kept[key]

    def find(self, name: str) -> KeptImage:
        """Return an image from the cache.

        Raises:
            ProtocolError: there is no image of this name any more.
        """
        with self._lock:
            if name not in self._kept:
                raise ProtocolError(
                    f"there is no image '{name}'",
                    where="image",
                    hint=f"The last {MOST_IMAGES} images and the last draft are kept; simulate "
                    "again",
                )
            return self._kept[name]


class Renderer:
    """Optical models, which are changed to each design that comes; for one thread only."""

    def __init__(self) -> None:
        """Start without a model; nothing is loaded yet."""
        self.variant = "auto"
        self._model: OpticalModel | None = None
        self._drafts: DraftModel | None = None

    def model(self, design: SensorDesign) -> OpticalModel:
        """Return the model of a design; parts that did not change since the last one are reused.

        Raises:
            SetupError: the renderer can't run on this machine.
            OptiSenseError: the design can't be built, or its sizes are those of another unit.
        """
        from optisense.optics import OpticalModel

        raise_problems(unit_slips(design, design.meshes), f"design '{design.name}'")
        if self._model is None:
            self._model = OpticalModel(design, self.variant, self._drafts)
        elif _is_another(self._model.design, design):
            self._model.set_design(design)
            self._leave(design)
        else:
            self._model.set_design(design)
        return self._model

    def draft_model(self, design: SensorDesign) -> OpticalModel:
        """Return a separate model for drafts, so that the light of whole pictures is kept
        meanwhile.

        Raises:
            SetupError, OptiSenseError: see `model`.
        """
        from optisense.optics import OpticalModel as Usual  # first: it checks libLLVM
        from optisense.optics.drafts import DraftModel

        raise_problems(unit_slips(design, design.meshes), f"design '{design.name}'")
        if self._drafts is None:
            self._drafts = DraftModel(design, self.variant, self._model)
        else:
            self._drafts.set_design(design)
        made: Usual = self._drafts
        return made

    def _leave(self, design: SensorDesign) -> None:
        """Drop the drafts of the sensor before, if the design is another sensor."""
        from optisense.optics.backend.memory import release_memory

        if self._drafts is not None and _is_another(self._drafts.design, design):
            self._drafts = None
        release_memory()

    def forget(self) -> None:
        """Drop the models after an unexpected error, which may have left them incomplete."""
        self._model = self._drafts = None


def _is_another(before: SensorDesign, after: SensorDesign) -> bool:
    """Return whether a design is another sensor, and not the same one after an edit."""
    return before.parts.keys() != after.parts.keys()


class Session:
    """Work of one front end.

    Attributes:
        folder: folder of the files that no request puts elsewhere.
        designs: cache of designs.
        renderer: optical models.
        images: cache of images.
        priority_gate: gate that lets short work go first.
    """

    def __init__(self) -> None:
        """Start in the state before `hello`."""
        self.folder: Path | None = None
        self.designs = Designs()
        self.renderer = Renderer()
        self.images = Images()
        self.priority_gate = PriorityGate()

    def files(self, fields: Fields, number: int | str) -> Files:
        """Return the files of a request.

        Raises:
            OutputError: there is no such folder, or the name can't be part of a file name.
        """
        assert self.folder is not None  # `hello` comes first
        folder = self.folder if fields.to is None else Path(fields.to)
        return Files(folder, name_of(fields, number))


def name_of(fields: Fields, number: int | str) -> str:
    """Return the name of a request's files and image."""
    return fields.name if fields.name is not None else str(number)

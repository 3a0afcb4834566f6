"""Generation of datasets: random contacts, rendered and labelled one by one."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import load_design
from optisense.design.difference import design_values, mesh_digests
from optisense.design.sensor_design import refuse_design
from optisense.design.storage import files_of
from optisense.errors import ContactError, TaskError
from optisense.folders import LOCK_FILE, FolderLock, held
from optisense.geometry import Contact, Indenter
from optisense.geometry.indenter_kinds import mesh_of
from optisense.library import with_own_lights
from optisense.picture_files import write_picture
from optisense.reading.camera_noise import add_camera_noise
from optisense.reading.untouched import UntouchedSurface
from optisense.sensors import save_design
from optisense.tasks._camera_model import camera_model, ray_arrays
from optisense.tasks._draws import DrawnContact, Places, is_cut, keeps_margin
from optisense.tasks._records import CsvTable, refuse_differences, write_whole
from optisense.tasks._sample_settings import DatasetSettings
from optisense.tasks._splits import cell_of, split_of
from optisense.tasks.dataset import BACKGROUND, CAMERA, DESIGN, Dataset
from optisense.tasks.dataset_tables import (
    COLUMNS,
    FAILURES,
    INFO,
    LABELS,
    NUMBER_COLUMNS,
    SCHEMA_VERSION,
    read_failures,
    read_info,
    read_labels,
)
from optisense.text import one_line
from optisense.untrusted_files import MOST_MESH, MOST_PICTURE, MOST_STEP, damaged, read_bytes
from optisense.writing import inside, write_json, written_whole

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

ATTEMPTS = 100
"""Number of places drawn for one sample before it is recorded as failed: with a plate of 8 mm on a
GelSight Mini, one sample in 30,000 fails. A rejected place takes chief rays but no rendering."""

DRAWING = 2
"""Version of how samples and their splits follow from the seed. Datasets of another version, or of
releases without this number, are not continued, since some of their samples would differ."""

LEAST_PIXELS = 4
"""Number of pixels below which a contact counts as unseen: two by two show if it slopes."""

_CONTACT, _CAMERA, _SENSOR = 1, 2, 8
"""Numbers that are hashed with the seed, one for each kind of random draw, so that the draws are
independent. They are unique among the modules of this package."""


def generate(
    model: OpticalModel,
    folder: str | Path,
    count: int,
    settings: DatasetSettings | None = None,
    progress: Callable[[int, int], None] | None = None,
    *,
    mend: bool = False,
) -> Dataset:
    """Generate a dataset of `count` samples, or continue one until it has that many.

    Args:
        model: the sensor.
        folder: folder of the dataset, created if needed; nothing is written outside it.
        count: total number of samples.
        settings: settings of the samples; the defaults if None.
        progress: function that is called with the number of finished samples and `count`, first
            with the existing samples.
        mend: whether all existing samples are read, and those with missing or damaged files are
            generated again with the same content.

    Returns:
        The dataset. Contacts that could not be made are among its failures.

    Raises:
        DesignError: there is a design instead of a model.
        TaskError: the folder holds a dataset with other settings, or of another release.
        FolderInUseError: another process is writing to the folder.
        ContactError, MeshError: an indenter cannot be read.
        OutputError: the folder holds something else, or a file cannot be written.
        KeyboardInterrupt: Ctrl-C was pressed; finished samples are kept for a further call.
    """
    refuse_design(model)
    if count < 1:
        raise TaskError(f"{count} samples are asked for", hint="Ask for 1 or more")
    chosen = settings or DatasetSettings()
    with held(folder) as lock, closing(_Maker(model, Path(folder), chosen, lock)) as maker:
        whole = maker.undamaged() if mend else maker.done()
        missing = [index for index in range(count) if index not in whole]
        for number, index in enumerate(missing):
            if progress is not None:
                progress(count - len(missing) + number, count)
            maker.make(index)
        if progress is not None:
            progress(count, count)
    return Dataset.load(folder)


def _too_small(resolution: tuple[int, int]) -> str:
    """Return the reason to record for a contact of fewer pixels than a sample needs."""
    width, height = resolution
    return (
        f"fewer than {LEAST_PIXELS} pixels of {width}x{height} show the contact: raise the "
        "resolution, or press deeper or with something larger"
    )


class _Maker:
    """The generation of one dataset."""

    def __init__(
        self, model: OpticalModel, folder: Path, settings: DatasetSettings, lock: FolderLock
    ) -> None:
        self._model = model
        self._folder = folder
        self._settings = settings
        self._indenters = settings.contacts.parsed()
        for indenter in self._indenters.values():
            mesh_of(indenter, 1.0)  # reads mesh files, so that errors are reported before any work
        width, height = settings.resolution or model.design.camera.resolution
        self._resolution = int(width), int(height)
        self._exposure = self._exposure_of_all(lock)
        rays = model.chief_rays(self._resolution)
        self._untouched = UntouchedSurface.of(rays)
        self._places = Places.of(model, self._resolution)
        self._cells = self._places.cells(self._resolution[1] / self._resolution[0])
        self._larger_than_view = {
            text for text, each in self._indenters.items() if not self._fits(each)
        }
        self._labels = CsvTable(folder / LABELS, COLUMNS)
        self._failures = CsvTable(folder / FAILURES, ("index", "reason"))
        self._labelled = {row["index"] for row in read_labels(folder)}
        self._failed = {int(row["index"]) for row in read_failures(folder)}

    def done(self) -> set[int]:
        """Return the indices of finished and of failed samples, without those that lack a file."""
        lacking = {labels["index"] for labels in Dataset.load(self._folder).lacking()}
        return (self._labelled | self._failed) - lacking

    def undamaged(self) -> set[int]:
        """Return the indices of `done` except those with damage; restore a damaged background."""
        dataset = Dataset.load(self._folder)
        try:
            dataset.background()
        except TaskError:
            self._write_background(self._image(), self._exposure)
        try:
            dataset.camera_rays()
        except TaskError:
            self._write_arrays(CAMERA, ray_arrays(self._model.chief_rays(self._resolution)))
        whole = self.done()
        for number, labels in enumerate(dataset.labels):
            try:
                dataset[number]
                if labels["radiance"] and labels["index"] in whole:
                    _check_radiance(self._folder / labels["radiance"], self._resolution)
            except TaskError:
                whole.discard(labels["index"])
        return whole

    def close(self) -> None:
        """Close the tables."""
        self._labels.close()
        self._failures.close()

    def make(self, index: int) -> None:
        """Generate one sample, or record why it cannot be generated."""
        reason = ""
        rng = np.random.default_rng([self._settings.seed, index, _CONTACT])
        drawn = self._settings.contacts.draw(self._indenters, self._places, rng)
        for attempt in range(ATTEMPTS):
            if attempt:
                drawn = drawn.elsewhere(self._places, rng)
            reason = self._why_not(drawn)
            if reason:
                continue
            image = self._image(drawn.contact)
            if image.contact_mask.sum() >= LEAST_PIXELS:
                self._write(index, attempt, drawn, image)
                return
            reason = _too_small(self._resolution)
        self._failures.add({"index": index, "reason": one_line(reason)})

    def _why_not(self, drawn: DrawnContact) -> str:
        """Return the reason why a contact makes no sample, by its chief rays, or an empty text."""
        try:
            mask = self._touched(drawn.contact)
        except ContactError as error:
            return error.message
        if mask.sum() < LEAST_PIXELS:
            return _too_small(self._resolution)
        margin = self._settings.contacts.margin
        if drawn.indenter not in self._larger_than_view and not keeps_margin(mask, margin):
            return "the picture's edge cuts the contact, or is too near to it"
        return ""

    def _touched(self, contact: Contact) -> NDArray[np.bool_]:
        """Return the mask (h, w) of the pixels that see a contact."""
        rays = self._model.chief_rays(self._resolution, [contact], self._settings.skin)
        return rays.contact_mask

    def _fits(self, indenter: Indenter) -> bool:
        """Return whether the view contains an indenter with its margin, pressed upright in the
        middle; the picture's edge cuts a larger one at every place.
        """
        draw = self._settings.contacts
        x, y, z = self._places.middle.tolist()
        contact = Contact(indenter, point=(x, y, z), depth=draw.depth[1], rotation=draw.rotation[0])
        try:
            mask = self._touched(contact)
        except ContactError:
            return True  # each draw reports the reason
        return keeps_margin(mask, draw.margin)

    def _exposure_of_all(self, lock: FolderLock) -> float:
        """Check or write the data common to all samples; return the exposure."""
        info_file = self._folder / INFO
        common = self._common()
        if info_file.exists():
            before = read_info(self._folder)
            if before.get("drawing") != DRAWING:
                raise TaskError(
                    "the dataset was made by another release, which drew contacts and splits in "
                    "another way",
                    where=str(self._folder),
                    hint="Start a new folder; this dataset can be read, but not be continued",
                )
            known = {key: before.get(key) for key in common}
            known["design"] = design_values(load_design(self._folder / DESIGN))
            now = common | {"design": design_values(with_own_lights(self._model.design))}
            refuse_differences("a dataset", self._folder, known, now)
            return float(before["exposure"])
        lock.check_empty()
        design = with_own_lights(self._model.design)
        inner = [f"{DESIGN}/{file}" for file in (*files_of(design), LOCK_FILE)]
        lock.will_make([*inner, BACKGROUND, CAMERA, INFO])
        try:
            exposure = self._begin(common)
        except BaseException:
            lock.undo()
            raise
        lock.is_whole()
        return exposure

    def _begin(self, common: dict[str, Any]) -> float:
        """Write the data common to all samples; return the exposure."""
        image = self._image()
        asked = self._settings.exposure
        exposure = float(image.auto_exposure() if asked == "auto" else asked)
        save_design(self._model.design, self._folder / DESIGN)
        self._write_background(image, exposure)
        rays = self._model.chief_rays(self._resolution)
        self._write_arrays(CAMERA, ray_arrays(rays))
        info = {
            "schema_version": SCHEMA_VERSION,
            **common,
            "exposure": exposure,
            "versions": image.settings["versions"],
            "units": {"length": "mm", "angle": "degrees", "radiance": "mW/(mm^2 sr)"},
            "columns": NUMBER_COLUMNS,
            "notes": [
                *self._model.design.camera.shape_notes(self._resolution),
                *self._model.marker_notes(),
            ],
            "camera": camera_model(self._model.design.camera, rays),
        }
        write_json(self._folder / INFO, info, "the dataset")  # last: makes the folder a dataset
        return exposure

    def _image(self, *contacts: Contact) -> TactileImage:
        settings = self._settings
        return settings.render(
            self._model, contacts, self._resolution, estimator=settings.estimator
        )

    def _write_background(self, image: TactileImage, exposure: float) -> None:
        arrays = {
            "image": image.without_noise().picture(exposure),
            "points": image.points,
            "normals": image.normals,
        }
        self._write_arrays(BACKGROUND, arrays)

    def _write_arrays(self, name: str, arrays: dict[str, Any]) -> None:
        with written_whole(self._folder / name, "the dataset") as temporary:
            _save_arrays(arrays, temporary)

    def _common(self) -> dict[str, Any]:
        """Return the values of all samples, which must not change when a dataset is continued."""
        from optisense.optics.backend.variant import versions

        values = asdict(self._settings)
        values["resolution"] = self._resolution
        made_with = versions(self._model.variant)
        return {
            "design_name": self._model.design.name,
            "drawing": DRAWING,
            "made_with": {name: made_with[name] for name in ("optisense", "mitsuba")},
            "settings": values,
            "mesh_files": {
                text: _file_digest(Path(str(indenter.source)))
                for text, indenter in self._indenters.items()
                if hasattr(indenter, "source")
            },
            "meshes": mesh_digests(self._model.design),
        }

    def _write(self, index: int, attempt: int, drawn: DrawnContact, image: TactileImage) -> None:
        settings = self._settings
        name = f"{index:06d}"
        picture = add_camera_noise(
            image.picture(self._exposure, (settings.seed, index, _SENSOR)),
            settings.camera_noise,
            [settings.seed, index, _CAMERA],
        )
        depth = self._untouched.image_depth(image)
        arrays = {
            "depth": depth,
            "normals": image.normals,
            "mask": image.contact_mask,
            "points": np.where(np.isnan(depth)[..., None], np.nan, image.points),
        }
        force = {"force": "", "area": "", "pressure": ""}
        maps = image.skin_maps()
        if maps is not None:
            named = {name: values.astype(np.float32) for name, values in maps._asdict().items()}
            arrays |= named
            press = image.settings["presses"][0]
            of_press = press["force_n"], press["area_mm2"], press["greatest_pressure_mpa"]
            force = dict(zip(force, of_press, strict=True))
        if image.markers is not None:
            arrays["markers"] = image.markers.rows()
        picture_file = inside(self._folder, f"images/{name}.png")
        write_whole(picture_file, lambda path: write_picture(path, picture))
        write_whole(inside(self._folder, f"arrays/{name}.npz"), partial(_save_arrays, arrays))
        if settings.radiance:
            write_whole(inside(self._folder, f"radiance/{name}.exr"), image.save_radiance)
        if index in self._labelled:  # an existing sample is restored
            return
        width, height = self._resolution
        contact = drawn.contact
        assert contact.point is not None
        x, y, z = contact.point
        radius = getattr(self._indenters[drawn.indenter], "radius", None)
        self._labels.add(
            {
                "file_name": f"images/{name}.png",
                "index": index,
                "indenter": drawn.indenter,
                "radius": "" if radius is None else float(radius),
                "x": x,
                "y": y,
                "z": z,
                "column": drawn.spot[0] * width,
                "row": drawn.spot[1] * height,
                "depth": contact.depth,
                "rotation": contact.rotation,
                "tilt_x": drawn.tilt_x,
                "tilt_y": drawn.tilt_y,
                "deepest": float(np.nanmax(depth)),
                **force,
                "contact_pixels": int(image.contact_mask.sum()),
                "attempt": attempt,
                "arrays": f"arrays/{name}.npz",
                "radiance": f"radiance/{name}.exr" if settings.radiance else "",
                "cut": int(is_cut(image.contact_mask)),
                "split": split_of(
                    settings.seed,
                    drawn.indenter,
                    cell_of(drawn.spot, height / width),
                    self._cells,
                    settings.hold_out,
                ),
            }
        )


def _file_digest(path: Path) -> str:
    """Return the SHA-256 of a file, which identifies an indenter when a dataset is continued."""
    content = read_bytes(path, max(MOST_MESH, MOST_STEP), TaskError, "the mesh")
    return hashlib.sha256(content).hexdigest()


def _check_radiance(path: Path, resolution: tuple[int, int]) -> None:
    """Raise TaskError if a file has no radiance of this size in pixels."""
    from optisense.optics.imaging.radiance_files import decode_radiance

    width, height = resolution
    try:
        data = read_bytes(path, MOST_PICTURE, TaskError, "the radiance")
        radiance = decode_radiance(data, resolution)
        if radiance.shape != (height, width, 3):
            raise ValueError(f"its shape is {radiance.shape}")
    except ValueError as found:
        raise damaged(path, TaskError, "the radiance", found) from None


def _save_arrays(arrays: dict[str, Any], path: Path) -> None:
    np.savez_compressed(path, **arrays)

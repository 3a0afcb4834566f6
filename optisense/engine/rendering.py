"""Requests that render: images, drafts, relit images, rays."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.commands.rendering import LedgerOptions, RenderOptions
from optisense.design import LightGroup, SensorDesign, set_value
from optisense.engine.contacts import AnyContact, contacts_of, errors_naming_contact, unseen
from optisense.engine.designs import AnyDesign, AnyMesh
from optisense.engine.failures import ProtocolError
from optisense.engine.jobs import Job
from optisense.engine.protocol import Fields
from optisense.engine.requests import Lane, handles
from optisense.engine.session import Files, KeptImage, Session, name_of
from optisense.errors import RenderError
from optisense.near import suggestion
from optisense.quality import MOST_PIXELS

if TYPE_CHECKING:
    from optisense.optics import RenderProgress, TactileImage

DRAFT_WIDTH = 160
"""Width of a draft, in pixels; it has a quarter of the pixels of an image 320 pixels wide."""

RAYS_ACROSS = 16
"""Default number of columns of the grid of chief rays that are drawn; more would hide the
sensor."""

NUDGE = 1e-3
"""Distance (mm) by which a light is moved to prepare drafts of moved lights. Any distance above 0
compiles the same kernels."""

MOST_PLACES = 100
"""Largest number of places of one ledger; each takes as long as the ledger, a second and more, so
that a hundred take minutes."""

LEVELS = (np.arange(256) / 255.0).astype(np.float32)
"""Levels of a picture, 256 numbers on a scale from 0 to 1."""

ImageFile = Literal["picture", "pixels", "radiance", "layers", "normals", "points", "mask"]


class DesignFields(Fields):
    """Fields of a request about a design."""

    design: AnyDesign
    meshes: dict[str, AnyMesh] = Field(default_factory=dict)


class Warm(DesignFields):
    """Fields of the request "warm"; see docs/engine.md."""

    contacts: bool = False
    drafts: bool = False


class Simulate(DesignFields, RenderOptions):
    """Fields of the request "simulate"; see docs/engine.md."""

    contacts: list[AnyContact] = Field(default_factory=list)
    draft: bool = False
    files: list[ImageFile] = Field(default=["picture"])


class LightChange(Fields):
    """Change of the light of a group."""

    flux: float | None = Field(default=None, ge=0.0)
    colour: tuple[float, float, float] | None = None


class Relight(Fields):
    """Fields of the request "relight"; see docs/engine.md."""

    image: str
    lights: dict[str, LightChange] = Field(default_factory=dict)
    exposure: float | Literal["auto", "same"] = "same"
    files: list[ImageFile] = Field(default=["picture"])


class Report(Fields):
    """Fields of the request "report"; see docs/engine.md."""

    image: str
    file: str


class Ledger(DesignFields, LedgerOptions):
    """Fields of the request "ledger"; see docs/engine.md."""

    at: list[tuple[float, float] | tuple[float, float, float]] = Field(
        default_factory=list, max_length=MOST_PLACES
    )


class ChiefRayGrid(DesignFields):
    """Fields of the request "chief_rays"; see docs/engine.md."""

    contacts: list[AnyContact] = Field(default_factory=list)
    resolution: tuple[int, int] | None = None


def design_of(session: Session, fields: DesignFields, job: Job) -> SensorDesign:
    """Return the design of a request."""
    job.design = session.designs.read(fields.design, fields.meshes)
    return job.design


@handles("warm", Warm, Lane.RENDER)
def warm(session: Session, fields: Warm, job: Job) -> dict[str, Any]:
    """Build the sensor and compile the kernels for an image."""
    began = time.perf_counter()
    design = design_of(session, fields, job)
    job.progress(0.0, "loading the renderer")
    model = session.renderer.model(design)
    job.progress(0.2, "building the sensor")
    size = design.camera.size_at(DRAFT_WIDTH)
    model.render((), size, photons="draft", progress=_progress_of(job))
    if fields.contacts:
        job.progress(0.7, "preparing contacts")
        model.render(contacts_of(["sphere:1.5@0,0:0.2"]), size, photons="draft")
    if fields.drafts:
        job.progress(0.8, "preparing drafts")
        drafts = session.renderer.draft_model(design)
        drafts.render((), size, photons="draft")
        job.progress(0.9, "preparing drafts of moved lights")
        name, group = next(iter(design.lights.items()))
        x = group.lights[0].position[0] + NUDGE
        drafts.set_design(set_value(design, f"lights.{name}.lights[0].position.x", x))
        drafts.render((), size, photons="draft")
    return {"seconds": round(time.perf_counter() - began, 3)}


@handles("simulate", Simulate, Lane.RENDER)
def simulate(session: Session, fields: Simulate, job: Job) -> dict[str, Any]:
    """Render a tactile image, or a draft of one."""
    from optisense.report.camera_rays import CameraRays

    files = session.files(fields, job.id)
    design = design_of(session, fields, job)
    contacts = contacts_of(fields.contacts)
    size = _checked_size(fields.resolution, design)
    if fields.draft:
        size = fields.resolution or design.camera.size_at(DRAFT_WIDTH)
    else:
        session.designs.require_valid(design)
        job.progress(0.0, "building the sensor")
    renderer = session.renderer
    model = renderer.draft_model(design) if fields.draft else renderer.model(design)
    with errors_naming_contact(contacts, model.place):
        image = model.render(
            contacts,
            resolution=size,
            photons=fields.photons_to_trace("draft" if fields.draft else "normal"),
            noise=fields.noise,
            seconds=fields.seconds,
            seed=fields.seed,
            skin=fields.skin,
            progress=_progress_of(job),
        )
    image.settings["contacts"] = [
        each if isinstance(each, str) else each.model_dump(exclude_none=True)
        for each in fields.contacts
    ]
    exposure = _exposure(image, fields.exposure)
    name = name_of(fields, job.id)
    placed = () if fields.draft else image.indenters.values()
    hidden = unseen(placed, image.points, image.contact_mask)
    kept = KeptImage(
        image=image,
        design=design,
        contacts=contacts,
        exposure=exposure,
        draft=fields.draft,
        rays=None if fields.draft else CameraRays.of(model),
    )
    written = write_image(image, exposure, fields.files, files)
    session.images.keep(name, kept)
    return {
        "image": name,
        "draft": fields.draft,
        "size": _size(image),
        "exposure": exposure,
        "lights": {
            group: {"flux": each.flux, "colour": list(each.colour)}
            for group, each in design.lights.items()
        },
        "unseen": hidden,
        "files": written,
        "settings": image.settings,
    }


@handles("relight", Relight, Lane.QUICK)
def relight(session: Session, fields: Relight, job: Job) -> dict[str, Any]:
    """Write an image that was rendered before under other lights."""
    files = session.files(fields, job.id)
    kept = session.images.find(fields.image)
    lights = kept.design.lights
    flux = {
        name: _changed(name, lights, change).channel_flux()
        for name, change in fields.lights.items()
    }
    image = kept.image.relight(flux)
    exposure = kept.exposure if fields.exposure == "same" else _exposure(image, fields.exposure)
    return {
        "image": fields.image,
        "size": _size(image),
        "exposure": exposure,
        "files": write_image(image, exposure, fields.files, files),
    }


@handles("report", Report, Lane.RENDER)
def report(session: Session, fields: Report, job: Job) -> dict[str, Any]:
    """Write the HTML report of an image."""
    from optisense.report import write_report
    from optisense.report.light_section import LightSection

    kept = session.images.find(fields.image)
    light = None
    if not kept.draft:
        job.progress(0.0, "following light")
        light = LightSection.of(session.renderer.model(kept.design))
    path = write_report(
        Path(fields.file),
        kept.design,
        kept.image,
        kept.contacts,
        exposure=kept.exposure,
        rays=kept.rays,
        light=light,
    )
    return {"file": str(path)}


@handles("ledger", Ledger, Lane.RENDER)
def ledger(session: Session, fields: Ledger, job: Job) -> dict[str, Any]:
    """Return the ledger of each group's light, and the causes of brightness at places."""
    from optisense.optics import camera_light, light_at, light_ledger
    from optisense.optics.ledger import cells_in_view

    design = design_of(session, fields, job)
    session.designs.require_valid(design)
    job.progress(0.0, "building the sensor")
    model = session.renderer.model(design)
    job.progress(0.2, "following light")
    seen = cells_in_view(model)
    found = light_ledger(model, fields.photons, fields.seed, seen).as_data()
    found["camera"] = camera_light(model, fields.photons, fields.seed).as_data()
    places = []
    for number, place in enumerate(fields.at):
        job.progress(0.3 + 0.7 * number / len(fields.at), "following light to places")
        places.append(light_at(model, place, fields.photons, fields.seed, seen).as_data())
    return {"ledger": found, "places": places}


@handles("chief_rays", ChiefRayGrid, Lane.RENDER)
def chief_rays(session: Session, fields: ChiefRayGrid, job: Job) -> dict[str, Any]:
    """Write the paths of chief rays, for drawing."""
    from optisense.optics import RayOutcome
    from optisense.optics.ray_paths import trace_paths

    files = session.files(fields, job.id)
    design = design_of(session, fields, job)
    size = _checked_size(fields.resolution, design) or design.camera.size_at(RAYS_ACROSS)
    model = session.renderer.model(design)
    contacts = contacts_of(fields.contacts)
    with errors_naming_contact(contacts, model.place):
        paths = trace_paths(model, size, contacts)
    return {
        "files": {
            "vertices": files.array("rays.vertices.npy", paths.vertices),
            "counts": files.array("rays.counts.npy", paths.counts),
            "outcomes": files.array("rays.outcomes.npy", paths.outcomes),
        },
        "rays": len(paths.counts),
        "outcome_names": [each.name.lower() for each in RayOutcome],
        "hit": float((paths.outcomes == RayOutcome.HIT).mean()),
    }


def write_image(
    image: TactileImage, exposure: float, wanted: list[ImageFile], files: Files
) -> dict[str, Any]:
    """Write the requested files of an image, and return their paths by kind."""
    written: dict[str, Any] = {}
    picture: NDArray[np.uint8] | None = None
    if "picture" in wanted or "pixels" in wanted:
        picture = image.picture(exposure)
    if picture is not None and "picture" in wanted:
        written["picture"] = files.picture("picture.png", picture)
    if picture is not None and "pixels" in wanted:
        written["pixels"] = files.array("pixels.npy", blender_pixels(picture))
    arrays: dict[str, Callable[[], NDArray[Any]]] = {
        "radiance": lambda: image.radiance,
        "normals": lambda: image.normals.astype(np.float32),
        "points": lambda: image.points.astype(np.float32),
        "mask": lambda: image.contact_mask.astype(np.uint8),
    }
    for name, values in arrays.items():
        if name in wanted:
            written[name] = files.array(f"{name}.npy", values())
    if "layers" in wanted:
        written["layers"] = {
            name: files.array(f"layer.{name}.npy", layer) for name, layer in image.layers.items()
        }
    return written


def blender_pixels(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return Blender's pixels (h, w, 4) of a picture (h, w, 3): 0 to 1, opaque, from the bottom."""
    height, width = picture.shape[:2]
    opaque = np.full((height, width, 4), 255, dtype=np.uint8)
    opaque[..., :3] = picture[::-1]
    return LEVELS[opaque]


def _progress_of(job: Job) -> Callable[[RenderProgress], None]:
    def report(progress: RenderProgress) -> None:
        text = f"{progress.photons / 1e6:.1f} million photons"
        if progress.noise is not None:
            text += f", noise {progress.noise:.1f} %"
        job.progress(
            progress.fraction,
            text,
            photons=progress.photons,
            noise=progress.noise,
            seconds=round(progress.seconds, 3),
        )

    return report


def _exposure(image: TactileImage, given: float | Literal["auto", "same"]) -> float:
    if isinstance(given, str):
        return image.auto_exposure()
    if not given > 0.0:
        raise RenderError(f"the exposure is {given:g}", hint='Give "auto" or a factor above 0')
    return given


def _changed(name: str, lights: Mapping[str, LightGroup], change: LightChange) -> LightGroup:
    """Return a light group with another flux or colour."""
    if name not in lights:
        hint = suggestion(name, lights, limit=20)
        raise ProtocolError(f"the image has no light group '{name}'", where="lights", hint=hint)
    group = lights[name]
    colour = group.colour if change.colour is None else change.colour
    if min(colour) < 0.0 or sum(colour) <= 0.0:
        raise ProtocolError(
            f"the colour of '{name}' is {list(colour)}",
            where="lights",
            hint="Give R, G and B from 0 with one above 0; for darkness set flux to 0",
        )
    flux = group.flux if change.flux is None else change.flux
    return group.model_copy(update={"colour": colour, "flux": flux})


def _checked_size(
    resolution: tuple[int, int] | None, design: SensorDesign
) -> tuple[int, int] | None:
    width, height = resolution or design.camera.resolution
    if width * height > MOST_PIXELS:
        raise RenderError(
            f"a picture of {width} x {height} pixels is too large",
            hint=f"Ask for at most {MOST_PIXELS:,} pixels",
        )
    return resolution


def _size(image: TactileImage) -> list[int]:
    height, width = image.contact_mask.shape
    return [width, height]

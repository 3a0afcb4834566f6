"""Placement of the lights and the camera of a recipe."""

from __future__ import annotations

import numpy as np
from pydantic import ValidationError

from optisense import library
from optisense.array_types import FloatArray
from optisense.design import Camera, LightGroup, Provenance, Role, SensorDesign, Status
from optisense.design.camera_checks import LEAST_PICTURE, view_shares
from optisense.design.colour import NAMED_COLOURS
from optisense.design.limits import refuse_far
from optisense.design.posing import triple
from optisense.design.problems import design_error
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.containment import inside
from optisense.geometry.patches import mean_normal, middle
from optisense.sensors.from_meshes import _lights as light_placement
from optisense.sensors.from_meshes import _strips
from optisense.sensors.from_meshes._pick_and_place import read_pick_and_place
from optisense.sensors.from_meshes._recipe_state import RecipeState
from optisense.sensors.from_meshes._touching import refuse_contact_with_lamps
from optisense.sensors.from_meshes.directions import vector
from optisense.sensors.from_meshes.recipe import CameraChoice
from optisense.sensors.from_meshes.recipe_lights import USUAL_FLUX, LightChoice, LightRow
from optisense.sensors.from_meshes.recipe_parts import ShapeReference
from optisense.sensors.from_meshes.surfaces import chosen, pick

WIDTH = 320
"""Width of a picture if the recipe gives no resolution, pixels; the height follows the camera."""

WIDEST_FIT = 100.0
"""Largest field of view that is used to place a camera, degrees: a wider camera is placed as if it
saw this much, so that its rim is not needed."""

CLEARANCE = 1.0
"""Distance that an automatically placed camera keeps from the parts in front of it, mm."""

LARGEST_STEP_BACK = 200.0
"""Largest distance that an automatically placed camera steps back in search of a view, mm; no
tactile sensor is longer."""

LITTLE_SEEN = 0.5
"""Share of the area of the sensing surface that the camera sees below which `new` notes it. The
built-in sensors have 0.51 (GelBelt) and more by this estimate, which neglects refraction. It is
larger than `LEAST_SKIN` (0.25), below which `check` warns: a new camera is easily moved."""


def place_lights(state: RecipeState, name: str, choice: LightChoice) -> LightGroup:
    """Return a light group with the positions of its lights; notes and sources are added to the
    state.

    Raises:
        DesignError: a light falls off its surface, or a row or ring is impossible.
        LibraryError: the library lacks its model.
    """
    where = state.recipe.where("lights", name)
    state.check_known("light", choice.model, "lights", name, "model")
    try:
        if choice.row is not None:
            lights = light_placement.row(choice.row, state.meshes[choice.row.part].bounds)
        elif choice.ring is not None:
            lights = light_placement.ring(choice.ring, state.meshes[choice.ring.part].bounds)
        elif choice.over is not None:
            mesh = state.reference(choice.over, f"lights {name}")
            found = pick(mesh, choice.over, f"lights {name}")
            lights = light_placement.over(choice.over, mesh, found, f"lights {name}")
        elif choice.along is not None:
            lights = _strips.along(choice.along, state.meshes[choice.along.edge_of])
        elif choice.table is not None:
            file = state.recipe.folder / choice.table.file
            table, missing = read_pick_and_place(file, choice.table.units)
            state.notes += [f"lights {name}: {note}" for note in missing]
            lights = _strips.from_table(choice.table, table)
            state.provenance[f"lights.{name}.lights"] = Provenance(
                status=Status.SOURCED, source=f"pick-and-place file {choice.table.file}"
            )
        else:
            lights = choice.at or []
    except DesignError as error:
        if error.where is None or error.where == f"lights {name}":
            raise DesignError(error.message, where=where, hint=error.hint) from None
        raise
    colour = choice.colour
    shares = NAMED_COLOURS[colour] if isinstance(colour, str) else colour
    flux, state.provenance[f"lights.{name}.flux"] = _flux(choice, shares)
    try:
        group = LightGroup(model=choice.model, colour=shares, flux=flux, lights=lights)
    except ValidationError as error:
        raise design_error(error, {}, where=where, model=LightGroup) from None
    if choice.row is not None:
        _note_beyond(state, name, group, choice.row)
    return group


def _flux(choice: LightChoice, colour: tuple[float, float, float]) -> tuple[float, Provenance]:
    """Return the flux of each light of a group, mW, and its source."""
    if choice.flux is not None:
        source = "from the recipe; see the LED's datasheet and current"
        return choice.flux, Provenance(status=Status.ASSUMED, source=source)
    nominal = library.nominal_flux(choice.model, colour)
    if nominal is None:
        source = "a bright LED; neither the recipe nor the library states a flux"
        return USUAL_FLUX, Provenance(status=Status.ASSUMED, source=source)
    found = library.entry("light", choice.model).source(f"flux.{nominal.colour}")
    status = Status.ASSUMED if found is None else found.status
    source = f"nominal flux of a {nominal.light} in the library, {nominal.words}"
    if found is not None:
        source += f": {found.source}"
    return nominal.flux, Provenance(status=status, source=source)


def _note_beyond(state: RecipeState, name: str, group: LightGroup, row: LightRow) -> None:
    """Note if a row is longer than the side at which it stands."""
    part = row.part
    low, high = state.meshes[part].bounds
    places = np.array([light.position for light in group.lights])
    along = light_placement.axis_along(row, state.meshes[part].bounds)
    beyond = int(((places[:, along] < low[along]) | (places[:, along] > high[along])).sum())
    if beyond:
        state.notes.append(
            f"lights {name}: {beyond} of {len(places)} are beyond the ends of {part}, which is "
            f"{high[along] - low[along]:.4g} mm long along {'xyz'[along]}"
        )


def place_camera(state: RecipeState) -> Camera:
    """Return the camera.

    Raises:
        DesignError: the camera can't be placed or aimed like this.
        LibraryError: the library lacks its model.
    """
    choice = state.recipe.camera
    where = state.recipe.where("camera")
    state.check_known("camera", choice.model, "camera", "model")
    skins = [state.meshes[name] for name in state.of(Role.SENSING_SURFACE)]
    skin = TriangleMesh.joined([TriangleMesh(m.vertices, m.faces) for m in skins])
    target = middle(skin)
    if isinstance(choice.look_at, str):
        target = middle(state.meshes[choice.look_at])
    elif choice.look_at is not None:
        target = np.array(choice.look_at)
    place = None
    if isinstance(choice.at, ShapeReference):
        shape = choice.at
        mesh, _ = chosen(state.reference(shape, "camera"), shape, "camera")
        place = middle(mesh)
        state.provenance["camera.position"] = Provenance(
            status=Status.DERIVED, source=f"middle of {shape.file or shape.faces_of}"
        )
    elif choice.at is not None:
        place = np.array(choice.at)
    else:
        state.provenance["camera.position"] = Provenance(
            status=Status.ASSUMED, source="where the sensing surface fills the picture"
        )
    try:
        return make_camera(choice, skin, place, target, state.meshes)
    except DesignError as error:
        raise DesignError(error.message, where=where, hint=error.hint) from None
    except ValidationError as error:
        raise design_error(error, {}, where=where, model=Camera) from None


def make_camera(
    choice: CameraChoice,
    skin: TriangleMesh,
    place: FloatArray | None,
    target: FloatArray,
    parts: dict[str, TriangleMesh],
) -> Camera:
    """Return the camera of a design with its pupil at a place (3,), mm, or outside of all parts
    where the skin fills the picture; unless its choice has a direction, it looks at a target (3,),
    mm.

    Raises:
        LibraryError: there is no such camera.
        DesignError: the camera looks at its own position, `up` is the viewing direction, or the
            camera is more than a metre from the origin.
    """
    model = library.camera(choice.model)
    width, height = choice.resolution or model.size_at(WIDTH)
    fov = model.fov if choice.fov is None else choice.fov
    if place is None:
        way = mean_normal(skin)
        if choice.direction is not None:
            way = -vector(choice.direction)
        if np.linalg.norm(way) < 1e-3:
            raise DesignError(
                "the sensing surface faces all sides, so a place for the camera can't be derived",
                where="camera",
                hint="Give the position of the camera: at: [x, y, z]",
            )
        way = way / np.linalg.norm(way)
        up = upward(choice, -way)
        place = _behind(skin, target, way, up, fov, width / height, parts)
    look = vector(choice.direction) if choice.direction is not None else target - place
    distance = float(np.linalg.norm(look))
    if distance < 1e-6:
        raise DesignError(
            "the camera is at the point that it looks at",
            where="camera",
            hint="Change at, the position, or look_at, the target",
        )
    look = look / distance
    up = upward(choice, look)
    if np.linalg.norm(np.cross(look, up)) < 1e-3:
        raise DesignError(
            "the viewing direction of the camera is parallel to up",
            where="camera.up",
            hint="Choose an up that points to the top of the picture",
        )
    refuse_far("the camera", place)
    return Camera(
        model=choice.model,
        projection=choice.projection or model.projection,
        fov=fov,
        resolution=(width, height),
        position=triple(np.round(place, 6) + 0.0),
        direction=triple(np.round(look, 9) + 0.0),
        up=triple(up + 0.0),
    )


def upward(choice: CameraChoice, look: FloatArray) -> FloatArray:
    """Return the direction to the picture's top: as chosen, else +y, or +z when looking along y."""
    if choice.up is not None:
        return vector(choice.up)
    y, z = np.eye(3)[1], np.eye(3)[2]
    return y if abs(look @ y) < 0.7 else z


def _behind(
    skin: TriangleMesh,
    target: FloatArray,
    way: FloatArray,
    up: FloatArray,
    fov: float,
    aspect: float,
    parts: dict[str, TriangleMesh],
) -> FloatArray:
    """Return the nearest position along `way` from the target from which all of the skin is in the
    picture, outside of all parts.
    """
    right = np.cross(-way, up)
    right /= np.linalg.norm(right)
    top = np.cross(right, -way)
    wide = np.tan(np.radians(min(fov, WIDEST_FIT)) / 2.0)
    points = skin.vertices - target
    ahead = -points @ way
    needed = np.maximum(np.abs(points @ right) / wide, np.abs(points @ top) * aspect / wide)
    distance = float((needed - ahead).max())
    for step in np.arange(0.0, LARGEST_STEP_BACK, 0.5):
        place = target + (distance + step) * way
        probes = np.array([place, place + CLEARANCE * way, place - CLEARANCE * way])
        if not any(m.is_closed and inside(probes, m).any() for m in parts.values()):
            return place
    return np.asarray(target + distance * way)


def view_note(design: SensorDesign) -> str | None:
    """Return a note if the camera of a finished design sees little of the sensing surface, or from
    afar; refraction is ignored, and designs with mirrors are not judged.
    """
    shares = view_shares(design, design.meshes)
    if shares is None:
        return None
    if shares.skin < LITTLE_SEEN:
        return (
            f"the camera sees about {100 * shares.skin:.0f} % of the area of the sensing surface, "
            "if refraction is neglected: check its place (at), what it looks at (look_at) and its "
            "field of view"
        )
    if shares.picture < LEAST_PICTURE:
        return (
            f"the sensing surface fills only about {100 * shares.picture:.0f} % of the area of the "
            "picture, if refraction is neglected: the camera is far away, or its field of view is "
            "wide"
        )
    return None


def check_places(state: RecipeState, camera: Camera, groups: dict[str, LightGroup]) -> None:
    """Raise DesignError if the camera or a light lies in a face, and note those inside solids."""
    places = [("the camera", np.array(camera.position))]
    for name, group in groups.items():
        for number, light in enumerate(group.lights):
            places.append((f"light {number} of '{name}'", np.array(light.position)))
    refuse_contact_with_lamps(places, state.meshes)
    for name in state.solids():
        buried = [
            group
            for group, lights in groups.items()
            if inside(np.array([li.position for li in lights.lights]), state.meshes[name]).any()
        ]
        if buried:
            state.notes.append(f"lights {', '.join(buried)} are inside {name}")
        if inside(np.array([camera.position]), state.meshes[name]).any():
            state.notes.append(f"the camera is inside {name}")

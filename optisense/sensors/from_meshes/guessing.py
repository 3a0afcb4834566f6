"""First recipe for a folder of CAD files: roles by the names of files, and default lights and
camera.

The guesses are meant to be confirmed or reviewed by the user; nothing is measured.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np

from optisense.design import Role
from optisense.errors import DesignError, MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry.joining import touching_area
from optisense.geometry.patches import faces_towards
from optisense.length_units import Units
from optisense.sensors._sources import balanced_flux
from optisense.sensors.from_meshes.directions import SIDES, nearest_side, vector
from optisense.sensors.from_meshes.files import (
    ALL_FORMATS,
    CadBody,
    CadFiles,
    Use,
    carrier_of,
    largest_dimension,
    likely_units,
    obj_objects,
    unread_files,
    with_copies,
)
from optisense.sensors.from_meshes.fingertips import LED_PITCH, is_round, lights_and_camera, tip_of
from optisense.sensors.from_meshes.recipe import CameraChoice, Recipe
from optisense.sensors.from_meshes.recipe_lights import (
    USUAL_FLUX,
    LightChoice,
    LightRow,
    LightsOver,
)
from optisense.sensors.from_meshes.recipe_parts import PartChoice
from optisense.sensors.from_meshes.surfaces import WITHIN
from optisense.text import brief

WORDS: tuple[tuple[Use, tuple[str, ...]], ...] = (
    ("lights", ("led", "leds", "light", "lights", "lamp", "lamps", "diode")),
    ("camera", ("camera", "cam", "lens", "pupil", "imager")),
    (Role.SENSING_SURFACE, ("skin", "coating", "coat", "membrane", "sensing", "paint")),
    (Role.ELASTOMER, ("gel", "elastomer", "silicone", "pdms", "pad", "rubber")),
    (Role.MIRROR, ("mirror", "reflector")),
    (Role.INTERFACE, ("interface", "film", "foil", "tape")),
    (Role.INDENTER, ("indenter", "probe", "object")),
    (
        Role.SUPPORT,
        ("support", "window", "acrylic", "pmma", "glass", "epoxy", "resin", "guide", "lightguide",
         "waveguide", "clear", "transparent", "plate"),
    ),
    (
        Role.BLOCKER,
        ("blocker", "housing", "case", "body", "enclosure", "board", "pcb", "cover", "frame",
         "wall", "shell", "base", "mount", "holder", "barrel", "black", "shade", "cap"),
    ),
)  # fmt: skip
"""Words in the names of parts by use; those listed first take precedence."""

KINDS = {
    "guide", "lightguide", "waveguide", "window",
    "barrel", "case", "cover", "enclosure", "frame", "holder", "housing", "mount",
}  # fmt: skip
"""Words for kinds of bodies: words before them say what they are for, as in lens holder. Boards and
plates are not among them: lights are placed on a board of LEDs, and a plate may be of anything."""

CLEAR = {"acrylic", "clear", "glass", "pmma", "transparent"}
"""Words that tell a clear body also before a word for its kind, as in clear cover."""

CARRIED = 0.2
"""Share of a gel's surface that a body touches if it carries the gel, where the body's name doesn't
tell its use. The inner side of a flat gel or of a shell is a third to a half of its surface, the
sides are less."""

NEAR = 0.003
"""Distance at which bodies touch, as a share of the gel's length: 0.1 mm on a gel of 36 mm, as
coarse meshes of one curved face differ by that."""

LIGHT, CAMERA = "smd-3528", "pi-v2"
"""Default light and camera of the library."""


def find_bodies(source: Path, chosen: Sequence[str] = ()) -> list[CadBody]:
    """Return all bodies of a CAD file, or of some or all CAD files in a folder; copies of one light
    on one side of the gel are one body.

    Raises:
        SetupError: a file is a STEP file, but the extra for it is missing.
        MeshError: there is no CAD file, or one can't be read.
    """
    return with_copies(_each_body(source, chosen))


def _each_body(source: Path, chosen: Sequence[str]) -> list[CadBody]:
    """Return each body by itself; see `find_bodies`."""
    folder = source if source.is_dir() else source.parent
    files = sorted(source.iterdir()) if source.is_dir() else [source]
    files = [file for file in files if file.suffix.lower() in ALL_FORMATS or file == source]
    if chosen:
        files = [folder / name for name in chosen]
    if not files:
        raise MeshError(
            "; ".join(["there are no CAD files here", *unread_files(source)]),
            where=str(source),
            hint="In the CAD tool: export each part as STL, OBJ or PLY, or all as one STEP file",
        )
    reader, found, taken = CadFiles(folder), list[CadBody](), set[str]()
    doubtful = set[str]()
    for file in files:
        bodies = reader.bodies(file.name)
        for body in bodies:
            name, use = body.name or file.stem, guess_use(body.name or file.stem)
            if use is None and len(bodies) == 1:  # "Part-1" in "Gel.step"
                name, use = file.stem, guess_use(file.stem)
            name = _fresh(_as_name(name), taken)
            taken.add(name)
            if use is None or use == "camera":  # a lens may be the camera's or carry the gel
                doubtful.add(name)
            found.append(CadBody(name, file.name, body, use or Role.BLOCKER))
    gels = [_outward(each.body.mesh) for each in found if each.use is Role.ELASTOMER]
    return [
        replace(each, use=Role.SUPPORT)
        if each.name in doubtful and _carries(_outward(each.body.mesh), gels)
        else each
        for each in found
    ]


def _outward(mesh: TriangleMesh) -> TriangleMesh:
    """Return a solid with its faces turned outward, or any other mesh as it is."""
    try:
        return mesh.validate("body", closed=True)
    except MeshError:
        return mesh


def _carries(mesh: TriangleMesh, gels: Iterable[TriangleMesh]) -> bool:
    """Return whether a body touches so much of a gel that light must come through it."""
    return any(
        touching_area(mesh, gel, NEAR * float(np.ptp(gel.bounds, axis=0).max()))
        > CARRIED * gel.area
        for gel in gels
    )


def guess_use(name: str) -> Use | None:
    """Return the probable use of a body by the words in its name, or None if they don't tell."""
    words = re.split(r"[^a-z]+", re.sub(r"([a-z])([A-Z])", r"\1 \2", name).lower())
    start = max((place for place, word in enumerate(words) if word in KINDS), default=0)
    telling = CLEAR.intersection(words).union(words[start:])
    for use, signs in WORDS:
        if telling.intersection(signs):
            return use
    return None


def guess_units(found: Iterable[CadBody]) -> Units | None:
    """Return the only unit that gives the files a plausible size, if that is not mm; else None."""
    meshes = [each.body.mesh for each in found if not each.body.own_units]
    if not meshes:
        return None
    size = largest_dimension(meshes)
    fitting = likely_units(size)
    return cast("Units", fitting[0]) if len(fitting) == 1 and fitting != ["mm"] else None


def guess_outward(meshes: dict[str, TriangleMesh], carrier: str) -> str:
    """Return the side on which the sensor is touched, such as +z: that of the body that carries the
    coating which is away from the other bodies, or that of its tip if it is a hollow dome and the
    only body.
    """
    own = meshes[carrier]
    others = [mesh.bounds.mean(axis=0) for name, mesh in meshes.items() if name != carrier]
    if others:
        way = own.bounds.mean(axis=0) - np.mean(others, axis=0)
    elif tip := tip_of(own):
        return tip
    else:
        way = np.eye(3)[int(np.argmin(np.ptp(own.bounds, axis=0)))]
    sides = sorted(SIDES, key=lambda side: -float(vector(side) @ way))
    return next((side for side in sides if len(faces_towards(own, vector(side), WITHIN))), sides[0])


def guess_recipe(source: str | Path, units: Units | None = None) -> Recipe:
    """Return a recipe for a CAD file, or the CAD files in a folder, for the user to review and
    change.

    Args:
        source: file or folder; the recipe names files relative to the folder.
        units: unit of the files that don't state theirs; None means mm, or the only plausible unit.

    Raises:
        SetupError, MeshError: see `find_bodies`; or no body can carry the coating.
    """
    source = Path(source)
    return recipe_of(find_bodies(source), source, units)


def recipe_of(
    bodies: Sequence[CadBody],
    source: Path,
    units: Units | None = None,
    uses: Mapping[str, Use] | None = None,
) -> Recipe:
    """Return a recipe for bodies from `find_bodies` with default lights and a default camera; see
    `guess_recipe`.

    Uses are those of bodies by their names, where they are known better than by guessing.

    Raises:
        MeshError: no body can carry the coating.
    """
    known = uses or {}
    found = [replace(each, use=known.get(each.name, each.use)) for each in bodies]
    units = units or guess_units(found)
    folder = source if source.is_dir() else source.parent
    parts = {each.name: part_of(each, each.use) for each in found if isinstance(each.use, Role)}
    meshes = {each.name: each.mesh(units) for each in found}
    skin = next((n for n, part in parts.items() if part.role is Role.SENSING_SURFACE), None)
    carrier = carrier_of({name: part.role for name, part in parts.items()})
    if carrier is None:
        told = ", ".join(f"{each.name}: {each.use}" for each in found)
        problem = f"no body is recognised as the gel or the sensing surface: {told}"
        raise MeshError(
            "; ".join([problem, *unread_files(source)]),
            where=str(source),
            hint=_naming_hint(found, folder),
        )
    outward = guess_outward(meshes, carrier)
    dome = is_round(meshes[carrier], outward)
    if skin is None:
        name = _fresh("skin", set(parts))
        parts = insert_skin(parts, name, carrier, outward, dome)
    lights: dict[str, LightChoice] = {}
    references = [each for each in found if each.use == "lights"]
    for each in references:
        lights[each.name] = lights_over(each, meshes[each.name], meshes[carrier])
    lens = next((each for each in found if each.use == "camera"), None)
    usual_lights, camera = usual_lights_and_camera(parts, meshes, carrier, outward, dome)
    if lens is not None:
        camera = CameraChoice(model=CAMERA, at=lens.shape)
    recipe = Recipe(
        name=usual_name(source),
        units=units,
        parts=parts,
        lights=lights or usual_lights,
        camera=camera,
    )
    return recipe.relative_to(folder)


def _naming_hint(found: Iterable[CadBody], folder: Path) -> str:
    """Return how to name bodies so that their roles are recognised; `folder` has the files."""
    for each in found:
        objects = obj_objects(folder / each.file)
        if len(objects) > 1:
            listed = brief(", ".join(objects))
            return (
                f"{each.file} holds {len(objects)} objects ({listed}), which are read as one "
                "body: export each into a file of its own, named after its role"
            )
    ways = "Name the files after their roles (gel.stl, window.stl, housing.stl, ...)"
    if any(each.body.own_units for each in found):
        ways = "In the CAD tool: name the bodies or components after their roles (gel, window, ...)"
    return ways + ", or give the role of each body in a recipe"


def usual_name(source: Path) -> str:
    """Return the name of a sensor after its file or folder."""
    path = source.resolve()
    return (path.name if source.is_dir() else path.stem)[:200] or "sensor"


def part_of(found: CadBody, role: Role, material: str | None = None) -> PartChoice:
    """Return a body as a part of the recipe."""
    return PartChoice(file=found.file, solid=found.solid, role=role, material=material)


def insert_skin(
    parts: dict[str, PartChoice], name: str, carrier: str, outward: str, tangent: bool = False
) -> dict[str, PartChoice]:
    """Return the parts with a sensing surface on the outer faces of one, inserted behind it."""
    skin = PartChoice(
        faces_of=carrier,
        towards=outward,
        tangent=True if tangent else None,
        role=Role.SENSING_SURFACE,
    )
    result: dict[str, PartChoice] = {}
    for each, part in parts.items():
        result[each] = part
        if each == carrier:
            result[name] = skin
    return result


def lights_over(found: CadBody, mesh: TriangleMesh, gel: TriangleMesh) -> LightChoice:
    """Return a light on each face of a reference towards the gel, of the colour in its name."""
    side = nearest_side(gel.bounds.mean(axis=0) - mesh.bounds.mean(axis=0))
    colour = next(
        (c for c in ("red", "green", "blue", "white") if c in found.name.lower()), "white"
    )
    return LightChoice(
        model=LIGHT,
        colour=colour,
        flux=usual_flux(LIGHT),
        over=LightsOver(file=found.file, solid=found.solid, towards=side, patches="all"),
    )


def usual_lights_and_camera(
    parts: Mapping[str, PartChoice],
    meshes: Mapping[str, TriangleMesh],
    carrier: str,
    outward: str,
    dome: bool,
) -> tuple[dict[str, LightChoice], CameraChoice]:
    """Return lights and a camera for a sensor whose files contain none.

    A hollow dome, whose part that carries the coating is round, gets a ring of lights and a fisheye
    inside; other sensors get rows of lights along three sides of the first support, or else of the
    gel, and a camera behind the sensing surface.
    """
    supports = [name for name, part in parts.items() if part.role is Role.SUPPORT]
    if dome:
        solid = {name: meshes[name] for name, part in parts.items() if part.faces_of is None}
        inside = lights_and_camera(solid, carrier, outward, LIGHT, usual_flux(LIGHT))
        if inside is not None:
            return inside
    window = supports[0] if supports else carrier
    return lights_around(window, meshes[window], outward), CameraChoice(model=CAMERA)


def lights_around(part: str, mesh: TriangleMesh, outward: str) -> dict[str, LightChoice]:
    """Return rows of red, green and blue lights along three sides of a part's box."""
    across = [axis for axis in "xyz" if axis != outward[-1]]
    size = dict(zip("xyz", np.ptp(mesh.bounds, axis=0), strict=True))
    across.sort(key=lambda axis: -size[axis])
    sides = {"red": "+" + across[1], "green": "-" + across[1], "blue": "+" + across[0]}
    lights = {}
    for colour, side in sides.items():
        along = across[0] if side[-1] == across[1] else across[1]
        count = max(1, int(size[along] / LED_PITCH))
        row = {"part": part, "side": side, "along": along, "count": count}
        lights[colour] = LightChoice(
            model=LIGHT, colour=colour, flux=usual_flux(LIGHT), row=LightRow.model_validate(row)
        )
    return lights


def usual_flux(model: str) -> float:
    """Return the flux that a light has in each of its colours, mW, so that they are balanced: the
    nominal one of its weakest colour, or `USUAL_FLUX` if the library states none.
    """
    try:
        return balanced_flux(model)
    except DesignError:
        return USUAL_FLUX


def _as_name(text: str) -> str:
    """Return a text with letters, digits, - and _ only, as names of parts require."""
    name = re.sub(r"[^A-Za-z0-9_-]+", "-", text).strip("-_")[:64]
    return name or "part"


def _fresh(name: str, taken: Iterable[str]) -> str:
    """Return the name, with a number if it is taken (file systems may not distinguish A from a)."""
    known = {each.casefold() for each in taken}
    result, number = name, 2
    while result.casefold() in known:
        result, number = f"{name[:60]}-{number}", number + 1
    return result

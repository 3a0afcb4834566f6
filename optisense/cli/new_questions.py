"""Questions of ``optisense new --from-meshes`` on the use of each CAD file, the lights and the
camera.

This module is imported only when the questions are asked, so that other commands start fast.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np

from optisense import library
from optisense.cli.asking import (
    ask,
    ask_count,
    ask_name,
    ask_number,
    ask_number_or_none,
    ask_word,
    ask_yes,
    three_numbers,
)
from optisense.cli.console import messages, print_notes
from optisense.design import Role
from optisense.design.colour import NAMED_COLOURS
from optisense.design.materials import kinds_for
from optisense.design.sensor_design import MATERIAL_REQUIRED
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.length_units import MM_PER, Units
from optisense.sensors.from_meshes import guessing
from optisense.sensors.from_meshes.building import USUAL_MATERIAL
from optisense.sensors.from_meshes.directions import SIDES
from optisense.sensors.from_meshes.files import (
    CadBody,
    Use,
    largest_dimension,
    likely_units,
    unread_files,
)
from optisense.sensors.from_meshes.fingertips import is_round
from optisense.sensors.from_meshes.recipe import CameraChoice, Recipe
from optisense.sensors.from_meshes.recipe_lights import LightChoice
from optisense.sensors.from_meshes.recipe_parts import PartChoice, ShapeReference
from optisense.sensors.from_meshes.surfaces import chosen as chosen_faces

Parts = dict[str, PartChoice]
Meshes = dict[str, TriangleMesh]

USES = {
    "sensing_surface": "the coated side of the gel, as a surface of its own",
    "elastomer": "the clear gel, a solid",
    "support": "rigid and clear, a solid: a window, a plate, a lens",
    "mirror": "reflects",
    "blocker": "opaque: a housing, a circuit board",
    "interface": "a thin refracting sheet",
    "indenter": "touches the sensor",
    "lights": "not a part: marks where LEDs are",
    "camera": "not a part: marks where the camera is",
    "nothing": "is left out",
}


def ask_recipe(source: Path, units: Units | None) -> Recipe:
    """Ask for all fields of a recipe, with guesses from the files as defaults.

    Args:
        source: CAD file, or folder of CAD files.
        units: unit of the files that do not state theirs; None asks.

    Raises:
        SetupError, MeshError: the files can't be read.
        KeyboardInterrupt: the user has pressed Ctrl-C.
    """
    found = guessing.find_bodies(source)
    folder = source if source.is_dir() else source.parent
    say(f"{len(found)} bodies in {source}. Enter accepts the answer in brackets.")
    print_notes(unread_files(source))
    name = ask("Name of the sensor", _not_empty, guessing.usual_name(source))
    units = units or _ask_units(found)
    meshes = {each.name: each.mesh(units) for each in found}
    uses = _ask_uses(found, meshes)
    parts = _ask_materials(found, uses)
    carriers = [each.name for each in found if uses[each.name] != "nothing"]
    gel = next((n for n, part in parts.items() if part.role is Role.ELASTOMER), carriers[0])
    outward = guessing.guess_outward({n: meshes[n] for n in carriers}, gel)
    if not any(part.role is Role.SENSING_SURFACE for part in parts.values()):
        parts, outward = _ask_skin(parts, meshes, gel, outward)
    coating = _ask_known("coating", "Coating", "diffuse-grey")
    dome = is_round(meshes[gel], outward)
    usual = guessing.usual_lights_and_camera(parts, meshes, gel, outward, dome)
    lights = _ask_lights(found, uses, parts, meshes, gel, outward, usual[0])
    camera = _ask_camera(found, uses, parts, usual[1])
    recipe = Recipe.model_validate(
        {
            "name": name,
            "units": units,
            "coating": coating,
            "parts": {key: part.model_dump(exclude_none=True) for key, part in parts.items()},
            "lights": lights,
            "camera": camera,
        }
    )
    return recipe.relative_to(folder)


def say(text: str) -> None:
    """Print a text between questions."""
    messages.print(text)


def _ask_units(found: list[CadBody]) -> Units | None:
    without = [each.body.mesh for each in found if not each.body.own_units]
    if not without:
        return None
    size = largest_dimension(without)
    likely = likely_units(size)
    said = " or ".join(f"{size * MM_PER[unit]:.3g} mm if they are in {unit}" for unit in likely)
    say(f"The files' largest dimension is the number {size:.4g}" + (f": {said}" if said else ""))
    return cast("Units", ask_word("Unit of the files", MM_PER, likely[0] if likely else "mm"))


def _ask_uses(found: list[CadBody], meshes: Meshes) -> dict[str, Use]:

    say("\nWhat is each body? The first letters of a word are enough:")
    for word, meaning in USES.items():
        say(f"  {word:16} {meaning}")
    uses: dict[str, Use] = {}
    for each in found:
        size = " x ".join(f"{side:.3g}" for side in np.ptp(meshes[each.name].bounds, axis=0))
        guess = each.use.value if isinstance(each.use, Role) else each.use
        word = ask_word(f"{each.name} ({size} mm)", USES, guess)
        uses[each.name] = Role(word) if word in [role.value for role in Role] else cast("Any", word)
    return uses


def _ask_materials(found: list[CadBody], uses: dict[str, Use]) -> Parts:
    say("\nMaterials (`optisense library list material` shows them):")
    parts: Parts = {}
    for each in found:
        use = uses[each.name]
        if not isinstance(use, Role):
            continue
        material: str | None = None
        if use in MATERIAL_REQUIRED or use is Role.BLOCKER:
            usual = USUAL_MATERIAL.get(use, "black-absorber")

            def fits(answer: str, role: Role = use) -> str:
                material = library.material(answer)
                if role not in material.roles:
                    wanted = " or ".join(kinds_for(role))
                    raise ValueError(f"that is a {material.kind}; a {role.value} is a {wanted}")
                return answer

            material = ask(f"{each.name} ({use.value}) is made of", fits, usual)
        parts[each.name] = guessing.part_of(each, use, material)
    return parts


def _ask_skin(parts: Parts, meshes: Meshes, gel: str, outward: str) -> tuple[Parts, str]:
    """Ask which faces of which part are coated."""
    say("\nThe sensing surface is the coated side of the gel.")
    carrier = ask_word("Coated faces belong to", parts, gel)
    mesh = meshes[carrier].welded()

    def faces(side: str, tangent: bool) -> float:
        choice = guessing.insert_skin({carrier: parts[carrier]}, "skin", carrier, side, tangent)
        return chosen_faces(mesh, choice["skin"], carrier)[0].area

    def side(answer: str) -> str:
        if answer not in SIDES:
            raise ValueError("one of: " + ", ".join(SIDES))
        try:
            faces(answer, False)
        except DesignError as error:
            raise ValueError(error.message) from None
        return answer

    towards = ask("They face", side, outward)
    few, many = faces(towards, False), faces(towards, True)
    tangent = False
    if many > 1.01 * few:
        say(f"{few:.4g} mm2 face it within 30 degrees; with the faces that continue them without "
            f"a sharp edge it is {many:.4g} mm2.")  # fmt: skip
        tangent = ask_yes("Are those coated too", True)
    else:
        say(f"These are {few:.4g} mm2.")
    name = "skin"
    while name in parts:
        name += "-2"
    return guessing.insert_skin(parts, name, carrier, towards, tangent), towards


def _ask_lights(
    found: list[CadBody],
    uses: dict[str, Use],
    parts: Parts,
    meshes: Meshes,
    gel: str,
    outward: str,
    usual: dict[str, LightChoice],
) -> dict[str, dict[str, Any]]:
    say("\nLights (`optisense library list light` shows models):")
    groups: dict[str, dict[str, Any]] = {}
    for each in (each for each in found if uses[each.name] == "lights"):
        guess = guessing.lights_over(each, meshes[each.name], meshes[gel])
        assert guess.over is not None
        group = _ask_group(each.name, str(guess.colour))
        over = guess.over.model_dump(exclude_none=True)
        over["towards"] = ask_word(
            f"{each.name}: on the faces towards", SIDES, str(guess.over.towards)
        )
        count = ask_number_or_none(
            "  number of lights in a row there (- puts one on each face)", 1, whole=True
        )
        if count is not None:
            over |= {"count": int(count), "patches": "largest"}
            pitch = ask_number_or_none("  mm from one to the next (- is even)", 1e-6)
            over |= {} if pitch is None else {"pitch": pitch}
        groups[each.name] = {**group, "over": over | _ask_way("square to the surface")}
    window = next((n for n, part in parts.items() if part.role is Role.SUPPORT), gel)
    if any(group.ring is not None for group in usual.values()) and not groups:
        say("The gel is a hollow dome.")
        if ask_yes("Put a ring of red, green and blue lights into it", True):
            return {
                name: group.model_dump(exclude_none=True, by_alias=True)
                for name, group in usual.items()
            }
        usual = guessing.lights_around(window, meshes[window], outward)
    if groups:
        usual = {}
    while True:
        default = next((name for name in usual if name not in groups), "-")
        name = ask_name("Name of a light group (- for no more)", default, groups)
        if not name:
            return groups
        guess_row = usual[name].row if name in usual else None
        group = _ask_group(name, name if name in ("red", "green", "blue") else "white")
        way = ask_word(f"{name}: in a row, a ring, or one at a place", ("row", "ring", "at"), "row")
        if way == "at":
            place = ask("  position x, y, z (mm)", three_numbers)
            aim = ask("  direction x, y, z", three_numbers)
            groups[name] = {**group, "at": [{"position": place, "direction": aim}]}
            continue
        part = ask_word(f"  {way} beside the part", parts, window)
        count = ask_count("  number of lights", guess_row.count if guess_row else 8)
        chosen: dict[str, Any] = {"part": part, "count": count}
        if way == "row":
            chosen["side"] = ask_word("  at its side", SIDES, guess_row.side if guess_row else "+x")
            chosen["pitch"] = ask_number_or_none("  mm from one to the next (- is even)", 1e-6)
        else:
            chosen["axis"] = ask_word("  axis of the ring", SIDES, outward)
        chosen |= _ask_way("into the side" if way == "row" else "inward")
        chosen["gap"] = ask_number("  mm from the part to the lights", 0.2)
        chosen["height"] = ask_number_or_none(
            "  mm, where on the third axis (- for the part's middle)"
            if way == "row"
            else "  mm, where on the axis (- for the part's middle)"
        )
        groups[name] = {**group, way: {k: v for k, v in chosen.items() if v is not None}}


def _ask_way(usual: str) -> dict[str, Any]:
    way = ask_word(f"  direction of the light (- is {usual})", (*SIDES, "-"), "-")
    return {} if way == "-" else {"direction": way}


def _ask_group(name: str, colour: str) -> dict[str, Any]:
    model = _ask_known("light", f"{name}: model", guessing.LIGHT)
    flux = guessing.usual_flux(model)
    return {
        "model": model,
        "colour": ask_word(f"{name}: colour", NAMED_COLOURS, colour),
        "flux": ask_number(f"{name}: flux of each light, mW", flux, least=0.0),
    }


def _ask_camera(
    found: list[CadBody], uses: dict[str, Use], parts: Parts, usual: CameraChoice
) -> dict[str, Any]:
    say("\nCamera (`optisense library list camera` shows models):")
    references = {each.name: each.shape for each in found if uses[each.name] == "camera"}
    words = ["behind", *references]
    model = guessing.CAMERA if references else usual.model
    camera: dict[str, Any] = {"model": _ask_known("camera", "Model", model)}
    inside = ", ".join(f"{x:g}" for x in usual.at) if isinstance(usual.at, tuple) else "behind"

    def place(answer: str) -> ShapeReference | str | tuple[float, float, float]:
        if answer in references:
            return references[answer]
        if answer == "behind":
            return answer
        try:
            return three_numbers(answer)
        except ValueError:
            raise ValueError("x, y, z in mm, or one of: " + ", ".join(words)) from None

    say("Its pupil is in the middle of a body, at x, y, z, or behind the sensing surface, where "
        "the surface fills the picture.")  # fmt: skip
    at = ask("Pupil", place, next(iter(references), inside))
    if not isinstance(at, str):
        camera["at"] = at if isinstance(at, tuple) else at.model_dump(exclude_none=True)

    def target(answer: str) -> str | tuple[float, float, float]:
        return answer if answer in parts else three_numbers(answer)

    skin = next(name for name, part in parts.items() if part.role is Role.SENSING_SURFACE)
    aim = ask("It looks at (a part, or x, y, z)", target, skin)
    if aim != skin:
        camera["look_at"] = aim
    up = ask_word("Up in the picture (- for +y, or +z if it looks along y)", (*SIDES, "-"), "-")
    if up != "-":
        camera["up"] = up
    if library.camera(camera["model"]).imaging():
        say("The library knows its noise, colours or tone curve; without them it is ideal.")
        camera["imaging"] = ask_yes("Use them", False)
    return camera


def _ask_known(kind: str, question: str, default: str) -> str:
    def read(answer: str) -> str:
        library.entry(kind, answer)
        return answer

    return ask(question, read, default)


def _not_empty(answer: str) -> str:
    if not answer or len(answer) > 200:
        raise ValueError("1 to 200 letters")
    return answer

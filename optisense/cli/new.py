"""``optisense new``: make a design folder from a built-in sensor or from CAD files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from optisense.cli.console import handles_errors, messages, output, print_notes
from optisense.cli.output_folder import take_folder
from optisense.errors import DesignError, OptiSenseError, OutputError
from optisense.folders import is_empty
from optisense.length_units import MM_PER, Units
from optisense.text import argument

if TYPE_CHECKING:
    from optisense.sensors.from_meshes import Recipe
    from optisense.sensors.from_meshes.recipe import CameraChoice
    from optisense.sensors.from_meshes.recipe_lights import LightChoice


@handles_errors
def new(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="A built-in sensor, such as gelsight-mini. Leave it out with --from-meshes.",
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Argument(
            metavar="DIR",
            help="The folder to write; it must be new or empty.",
        ),
    ] = None,
    from_meshes: Annotated[
        Path | None,
        typer.Option(
            "--from-meshes",
            metavar="RECIPE|FOLDER|FILE",
            help="Make the sensor of CAD files (STL, OBJ, PLY; STEP with the extra 'step'): a "
            "recipe that says which file is what (.yaml), or the files themselves, about which "
            "questions are asked.",
        ),
    ] = None,
    units: Annotated[
        str | None,
        typer.Option(
            metavar="|".join(MM_PER),
            help="With --from-meshes: unit of the files that do not contain one (STL, OBJ, "
            "PLY). If left out, the recipe states it or a question asks for it; with --yes it is "
            "the only unit that gives a plausible size, or else mm.",
        ),
    ] = None,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes",
            "-y",
            help="With --from-meshes: ask nothing, and guess from the names and sizes of the "
            "files; check the recipe afterwards.",
        ),
    ] = False,
    overwrite: Annotated[
        bool,
        typer.Option(
            "--overwrite",
            help="Overwrite the design in DIR: design.yaml, its meshes and its recipe.",
        ),
    ] = False,
    discard_changes: Annotated[
        bool,
        typer.Option(
            "--discard-changes",
            help="With --from-meshes and --overwrite: also discard what was changed in the design "
            "since a recipe made it, such as its cages.",
        ),
    ] = False,
) -> None:
    """Make a design of your own from a built-in sensor, or from CAD files."""
    if from_meshes is None:
        if units is not None or yes or discard_changes:
            raise typer.BadParameter(
                "they need --from-meshes", param_hint="--units, --yes, --discard-changes"
            )
        if name is None or folder is None:
            raise typer.BadParameter(
                "name a built-in sensor and the folder to write, or use --from-meshes",
                param_hint="NAME DIR",
            )
        _from_built_in(name, folder, overwrite)
        return
    if name is None:
        raise typer.BadParameter("name the folder to write", param_hint="DIR")
    if folder is not None:
        raise typer.BadParameter(
            "with --from-meshes, name only the folder to write", param_hint="DIR"
        )
    if units is not None and units not in MM_PER:
        raise typer.BadParameter(f"'{units}' is none of {', '.join(MM_PER)}", param_hint="--units")
    is_new = _take_folder(Path(name), overwrite)
    if not is_new and not discard_changes:
        _refuse_changed(Path(name))
    _from_cad(from_meshes, Path(name), units, yes, is_new)


def _from_built_in(name: str, folder: Path, overwrite: bool) -> None:
    from optisense.sensors import build, save_design

    design = build(name)
    is_new = _take_folder(folder, overwrite)
    save_design(design, folder, new=is_new)
    _print_next_steps(folder)


def _from_cad(source: Path, folder: Path, units: str | None, yes: bool, is_new: bool) -> None:
    from optisense.library import unused_imaging, unusual_fluxes
    from optisense.sensors import check, save_design
    from optisense.sensors.from_meshes import (
        RECIPE_FILE,
        design_from_meshes,
        guess_recipe,
        read_recipe,
        save_made,
        save_recipe,
    )
    from optisense.sensors.from_meshes.files import unread_files

    if not source.exists():
        raise DesignError(
            "there is no such recipe, folder or CAD file",
            where=str(source),
            hint="Name a recipe (.yaml), a CAD file, or a folder of CAD files",
        )
    asked = guessed = False
    if source.suffix.lower() in (".yaml", ".yml"):
        recipe = read_recipe(source)
    elif yes:
        recipe, guessed = guess_recipe(source, _units(units)), True
        print_notes(unread_files(source))
    elif _at_terminal():
        from optisense.cli.new_questions import ask_recipe

        recipe, asked = ask_recipe(source, _units(units)), True
    else:
        raise typer.BadParameter(
            f"the questions about '{source}' need a terminal: name a recipe (.yaml), or accept all "
            "suggestions with --yes",
            param_hint="--from-meshes",
        )
    if units is not None:
        recipe.units = _units(units)
    try:
        with messages.status("fitting the parts together"):  # half a minute for 100,000 faces
            made = design_from_meshes(recipe)
            problems = check(made.design)
    except OptiSenseError:
        if asked or guessed:  # answers need not be given again; wrong guesses can be corrected
            save_recipe(recipe, folder / RECIPE_FILE)
            _print_guesses(recipe, guessed, units is None)
            what = "Your answers are" if asked else "The guessed recipe is"
            named = f"{argument(folder / RECIPE_FILE)} {argument(folder)}"
            messages.print(
                f"{what} saved in {folder / RECIPE_FILE}. Correct it or the CAD files, then:\n"
                f"  optisense new --from-meshes {named} --overwrite"
            )
        raise
    save_design(made.design, folder, new=is_new)
    save_made(folder)
    save_recipe(recipe, folder / RECIPE_FILE)
    print_notes(made.notes)
    unused = unused_imaging(made.design.camera)
    if unused is not None:
        print_notes([f"{unused}; set imaging: true in the recipe's camera to use them"])
    for problem in problems:
        messages.print(f"warning: {problem}", style="yellow")
    for sentence in unusual_fluxes(made.design):
        messages.print(f"warning: {sentence}", style="yellow")
    _print_guesses(recipe, guessed, units is None)
    _print_next_steps(folder, folder / RECIPE_FILE)


def _at_terminal() -> bool:
    return sys.stdin.isatty()


def _units(text: str | None) -> Units | None:
    """Cast a text that was checked before to its type."""
    return cast("Units | None", text)


def _take_folder(folder: Path, overwrite: bool) -> bool:
    """Take the lock of the folder for this command, and return whether it is empty."""
    take_folder(folder)
    if is_empty(folder):
        return True
    if not overwrite:
        raise OutputError(
            "the folder is not empty",
            where=str(folder),
            hint="Name a folder that doesn't exist, or overwrite the design in it with --overwrite",
        )
    if not any((folder / name).is_file() for name in ("design.yaml", "recipe.yaml")):
        raise OutputError(
            "there is no design in this folder, and it is not empty",
            where=str(folder),
            hint="Name a folder that doesn't exist, or empty this one",
        )
    return False


def _refuse_changed(folder: Path) -> None:
    """Refuse to overwrite a design that was changed since a recipe made it.

    Raises:
        OutputError: it was changed, or it can't be known whether it was.
    """
    from optisense.design.problems import listed
    from optisense.sensors import load
    from optisense.sensors.from_meshes import MADE_FILE, changes_since_made

    if not (folder / "design.yaml").is_file():
        return
    try:
        changed = changes_since_made(folder)
        cages = ", ".join(load(folder).cages)
    except OptiSenseError as error:
        message = f"the design in it can't be compared with what its recipe made: {error}"
    else:
        if changed == []:
            return
        if changed:
            changed.sort(key=lambda line: not line.startswith("cages."))  # they are the most work
            message = f"the design in it was changed since its recipe made it:\n{listed(changed)}"
        else:
            message = "it is not known what was changed in its design since a recipe made it, as "
            message += f"there is no {MADE_FILE}" + (f"; it has the cages {cages}" if cages else "")
    raise OutputError(
        message,
        where=str(folder),
        hint="To keep the changes, write the new design into another folder and make them there; "
        "to lose them, add --discard-changes",
    )


def _print_guesses(recipe: Recipe, guessed: bool, unit_too: bool) -> None:
    """Print the guesses that were made without a question; `unit_too` if the unit is one."""
    if not guessed:
        return
    if unit_too and recipe.units is not None:
        messages.print(f"guessed: unit {recipe.units}")
    for name, part in recipe.parts.items():
        messages.print(f"guessed: {name} is {part.role.value} ({part.source})")
    for name, group in recipe.lights.items():
        messages.print(f"guessed: lights {name}, {_place_of_lights(group)}")
    messages.print(f"guessed: camera {recipe.camera.model}, {_place_of_camera(recipe.camera)}")
    if all(group.colour == "white" for group in recipe.lights.values()):
        messages.print("guessed: all lights are white, as no name says red, green or blue")


def _place_of_lights(group: LightChoice) -> str:
    """Return in words where guessed lights are."""
    if group.over is not None:
        return f"on the faces of {group.over.source} towards {group.over.towards}"
    if group.ring is not None:
        return f"in a ring inside {group.ring.part}"
    assert group.row is not None
    return f"in a row at the side {group.row.side} of {group.row.part}"


def _place_of_camera(camera: CameraChoice) -> str:
    """Return in words where the guessed camera is."""
    if camera.at is None:
        return "behind the sensing surface"
    if isinstance(camera.at, tuple):
        return "at ({:g}, {:g}, {:g}) mm".format(*camera.at)
    return f"in the middle of {camera.at.source}"


def _print_next_steps(folder: Path, recipe: Path | None = None) -> None:
    output.print(f"{folder / 'design.yaml'}")
    named = argument(folder)
    if recipe is not None:
        output.print(f"{recipe}")
        messages.print(
            "Change it:   edit the recipe, then optisense new --from-meshes "
            f"{argument(recipe)} {named} --overwrite",
            style="dim",
        )
    messages.print(f"Look at it:  optisense check {named}", style="dim")
    messages.print(f"Render it:   optisense render {named} --out picture", style="dim")

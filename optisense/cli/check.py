"""``optisense check``: check a design, and print its contents."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from optisense.cli.console import handles_errors, output
from optisense.cli.options import (
    ContactOption,
    DesignArgument,
    parse_contacts,
    print_small_indenters,
)
from optisense.errors import SetupError

if TYPE_CHECKING:
    from optisense.design import SensorDesign

MOST_WARNINGS = 40
"""Largest number of lines about problems of a design, to see the end; others are counted."""


@handles_errors
def check(design: DesignArgument, contact: ContactOption = None) -> None:
    """Check a design, and whether contacts can be pressed into its skin, without rendering."""
    contacts = parse_contacts(contact)

    from optisense import sensors
    from optisense.library import unusual_fluxes

    sensor = sensors.load(design)
    problems = sensors.check(sensor)
    warnings = len(problems) + _describe(sensor)
    for problem in problems[:MOST_WARNINGS]:
        output.print(f"warning: {problem}", style="yellow")
    if len(problems) > MOST_WARNINGS:
        output.print(f"warning: {len(problems) - MOST_WARNINGS:,} more like these", style="yellow")
    for sentence in unusual_fluxes(sensor):
        output.print(f"note: {sentence}")
    warnings += _print_optics(sensor)
    if contacts:
        from optisense.optics import OpticalModel

        model = OpticalModel(sensor)
        pressed = model.pressed(contacts, [model.place(each) for each in contacts])
        for warning in pressed.warnings:
            output.print(f"warning: {warning}", style="yellow")
        warnings += len(pressed.warnings) + print_small_indenters(contacts)
        word = "contact fits" if len(contacts) == 1 else "contacts fit"
        output.print(f"{len(contacts)} {word} on the sensing surface.")
    if warnings:
        number = "1 warning" if warnings == 1 else f"{warnings:,} warnings"
        output.print(f"No errors, {number}.", style="yellow")
    else:
        output.print("The design is in order.", style="green")


def _print_optics(design: SensorDesign) -> int:
    """Trace chief rays, and print by which mirrors they go, which mirrors are not used, and how
    many markers lie off the skin.

    Returns:
        The number of warnings.
    """
    has_mirrors = any(part.role == "mirror" for part in design.parts.values())
    if not has_mirrors and design.markers is None:
        return 0
    try:
        from optisense.optics import OpticalModel
        from optisense.optics.mirror_checks import (
            CHECK_RAYS,
            mirror_problems,
            polished,
            rough_mirror_problems,
            views_in_words,
        )

        model = OpticalModel(design)
        problems: list[object] = []
        if has_mirrors:
            size = design.camera.size_at(CHECK_RAYS)
            views = model.views_by_mirrors(size)
            problems += mirror_problems(design, views)
            smooth = polished(design)
            if smooth is not None:
                views_if_smooth = OpticalModel(smooth).views_by_mirrors(size)
                problems += rough_mirror_problems(design, views_if_smooth)
            if views:
                words = views_in_words(views)
                output.print(f"Views of the sensing surface, by their mirrors: {words}.")
        problems += model.marker_notes()
    except SetupError as error:  # the rest of the check needs no renderer
        parts = [*(["mirrors"] if has_mirrors else []), *(["markers"] if design.markers else [])]
        what = " and ".join(parts)
        output.print(f"note: its {what} are not checked: {error}", style="yellow")
        return 0
    for problem in problems:
        output.print(f"warning: {problem}", style="yellow")
    return len(problems)


def _describe(design: SensorDesign) -> int:
    """Print the contents of the design, and the share of the skin that the camera sees.

    Returns:
        The number of warnings.
    """
    from optisense.design.camera_checks import view_shares
    from optisense.design.parts import Role
    from optisense.library import unused_imaging
    from optisense.mechanics import elasticity_in_words, is_attached, is_hollow, rims_in_words

    output.print(design.name, style="bold")
    if design.description:
        output.print(design.description)

    parts = Table("part", "role", "material", "size (mm)", "triangles", box=None, pad_edge=False)
    for name, mesh in design.deformed_meshes().items():
        part = design.parts[name]
        size = mesh.bounds[1] - mesh.bounds[0]
        parts.add_row(
            name,
            part.role.value,
            part.material or ("(coating)" if part.role == "sensing_surface" else "-"),
            " x ".join(f"{length:.4g}" for length in size),
            f"{len(mesh.faces)}",
        )
    lights = Table("lights", "model", "number", "flux each (mW)", box=None, pad_edge=False)
    for name, group in design.lights.items():
        model = group.model if group.emitter is None else f"{group.model} (own emitter)"
        lights.add_row(name, model, f"{len(group.lights)}", f"{group.flux:g}")
    camera = design.camera
    for table in (parts, lights):
        output.print()
        output.print(table)
    output.print()
    output.print(
        f"camera  {camera.model}, {camera.projection}, {camera.fov:g} degrees across, "
        f"{camera.resolution[0]} x {camera.resolution[1]} pixels"
    )
    unused = unused_imaging(camera)
    if unused is not None:
        output.print(f"        {unused}")
    shares = view_shares(design, design.deformed_meshes())
    if shares is not None:
        output.print(
            f"        without refraction, {100 * shares.skin:.0f} % of the sensing surface is in "
            f"the picture, and fills {100 * shares.picture:.0f} % of it"
        )
    loose = False
    if design.parts_of(Role.ELASTOMER):
        output.print(f"elasticity  {elasticity_in_words(design)}")
        loose = not is_attached(design)
        if loose:
            output.print(
                "warning: the gel touches no rigid part; its elastic skin can't be pressed. Add a "
                "support on its far side, or take the conforming skin (--skin conforming)",
                style="yellow",
            )
        else:
            if is_hollow(design):
                output.print(
                    "            most of the gel has air behind it; forces are computed as if its "
                    "whole back were fixed, and are too large"
                )
            if limits := rims_in_words(design):
                output.print(f"            {limits}")
    assumed = sum(entry.status == "assumed" for entry in design.provenance.values())
    if assumed:
        output.print(f"{assumed} of its values are marked as assumed.", style="yellow")
    return int(loose)

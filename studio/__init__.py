"""OptiSense Studio in Blender: the sensor bench.

The extension holds no optics. It shows a sensor design as objects, lets the user edit it, and asks
the engine, a child process, for everything that takes light: pictures, scores, searches. It
imports bpy, numpy and the standard library only.
"""

from __future__ import annotations

from . import registration
from .calibrate import operator as calibrate_operator
from .calibrate import ui as calibrate_ui
from .engine import catalogue, guide, preferences, session
from .evaluate import ledger
from .evaluate import live as evaluate_live
from .evaluate import operator as evaluate_operator
from .evaluate import prop as evaluate_prop
from .evaluate import ui as evaluate_ui
from .export import operator as export_operator
from .export import ui as export_ui
from .lights import group_selection, row_gizmo, snapping, windows
from .lights import operator as light_operator
from .lights import rows as light_rows
from .lights import ui as light_ui
from .looks import drawing, footprint, glass, markers, section
from .materials import gallery
from .materials import operator as material_operator
from .materials import ui as material_ui
from .optimise import operator as optimise_operator
from .optimise import prop as optimise_prop
from .optimise import search_progress, unfinished_studies
from .optimise import ui as optimise_ui
from .scene import cages, copies, fields, object_properties, old_files, properties
from .sensor import cad, opening, starting, tour, workspace
from .sensor import operator as sensor_operator
from .sensor import ui as sensor_ui
from .shapes import cage_operator, cage_selection, cage_warnings, reference_operator, skin_operator
from .shapes import ui as shape_ui
from .simulate import drafts, editors, indenters, picture, relight, viewing
from .simulate import operator as simulate_operator
from .simulate import prop as simulate_prop
from .simulate import ui as simulate_ui

MODULES = (
    preferences,
    session,
    guide,
    catalogue,
    fields,
    properties,
    old_files,
    object_properties,
    cages,
    copies,
    picture,
    editors,
    simulate_prop,
    viewing,
    relight,
    drafts,
    indenters,
    evaluate_prop,
    optimise_prop,
    search_progress,
    cad,
    opening,
    sensor_operator,
    workspace,
    tour,
    reference_operator,
    skin_operator,
    cage_selection,
    cage_operator,
    cage_warnings,
    gallery,
    material_operator,
    group_selection,
    section,
    drawing,
    glass,
    footprint,
    markers,
    light_operator,
    light_rows,
    row_gizmo,
    snapping,
    windows,
    simulate_operator,
    evaluate_operator,
    evaluate_live,
    ledger,
    calibrate_operator,
    optimise_operator,
    unfinished_studies,
    export_operator,
    sensor_ui,
    shape_ui,
    material_ui,
    light_ui,
    simulate_ui,
    evaluate_ui,
    optimise_ui,
    export_ui,
    calibrate_ui,
    starting,
)


def register() -> None:
    """Add everything to Blender."""
    for each in MODULES:
        registration.add(each)


def unregister() -> None:
    """Take everything out of Blender again, and end the engine."""
    for each in reversed(MODULES):
        registration.remove(each)

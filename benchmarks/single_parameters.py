"""A search over each single parameter of each built-in sensor, as widely as the design file allows.

A search can reach a high score with a design that nobody would build: a camera that sees nothing,
stands inside the gel, looks past its mirrors or has a field of view that no lens has, a material
that does not exist, or parts that have left their supports. This script looks for such designs with
AOAP and 2to3PW, and draws the view of the best camera of each search, so that a person can judge
all of them at a glance::

    python -m benchmarks.single_parameters FOLDER [--sensor NAME]

The 43 searches of a GelSight Mini take up to ten minutes on two busy cores, and those of all six
sensors about an hour. Finished searches are kept in FOLDER/searches.json, and a second run
continues with the others. FOLDER/SENSOR-OBJECTIVE.png are the contact sheets: on each picture the
sensing surface has a checkerboard of 2 mm, darker where it is seen askance; what is not the sensing
surface is blue. A red frame marks a best design that differs from the built-in one.

One parameter of each kind represents the others: of the points of a cage one at a corner, one in
the middle of a side and one in the middle of the face that is sensed are searched, of the lights
and of the coating one number each, since rays see neither.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw
from rich.console import Console

from optisense.design import SensorDesign, get_value, set_value
from optisense.design.limits import LARGEST
from optisense.errors import OptiSenseError
from optisense.optics import OpticalModel
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.space.search_space import SearchSpace
from optisense.search.study.best import best_of, tied
from optisense.search.study.trial import Trial
from optisense.sensors import SENSORS, load
from optisense.writing import write_text

OBJECTIVES = ("aoap", "2to3pw")

RAYS = (160, 120)
"""Number of chief rays across and down, of a trial and of a picture."""

CHECK = 2.0
"""Side (mm) of a square of the checkerboard."""

COLUMNS = 6
"""Number of pictures in a row of a contact sheet, which is then some 1,000 pixels wide."""

ANGLES = (0.01, 0.1, 1, 3, 10, 20, 30, 40, 50, 60, 80, 100, 120, 125, 140, 160, 179, 179.9)
"""Fields of view (degrees) of perspective lenses, up to the limits of the design file."""

FISHEYE_ANGLES = (*ANGLES[:-1], 200, 240, 280, 320, 360)
"""Fields of view (degrees) of fisheye lenses; `check` refuses such values for perspective lenses
before anything is traced."""

STEPS = (0.1, 0.3, 1, 3, 10, 30, 100, 300, LARGEST)
"""Distances (mm) by which a position is changed to either side, up to the largest coordinate of a
design file."""

TURNS = (0.3, 1, 3, 10, 30, 60, 90, 120, 150, 180)
"""Angles (degrees) by which a rotation is changed to either side."""

INDICES = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.7, 2.0, 2.5, 3.0, 4.0)
"""Refractive indices of transparent materials, from vacuum to germanium."""

CAGE_POINTS = (0, 14, 17, 26)
"""Indices of the searched points of a cage of 3 x 3 x 3: a corner, the middles of the upper face
and of one of its sides, and the opposite corner."""


def values_of(design: SensorDesign) -> dict[str, list[Any]]:
    """Return the values to try, by path, that a design file may have."""
    camera = design.camera
    angles = FISHEYE_ANGLES if camera.projection == "equidistant" else ANGLES
    wanted: dict[str, list[Any]] = {
        "camera.fov": [*angles],
        "camera.projection": ["perspective", "equidistant"],
        "camera.resolution[0]": [1, 8, 64, 320, 2000, 60_000],
        "coating.specularity": [0.0, 0.5, 1.0],
    }
    for axis in "xyz":
        wanted[f"camera.position.{axis}"] = _around(design, f"camera.position.{axis}", STEPS)
        wanted[f"camera.direction.{axis}"] = _around(design, f"camera.direction.{axis}", STEPS[:6])
        wanted[f"camera.up.{axis}"] = _around(design, f"camera.up.{axis}", STEPS[:6])
    for name, material in design.materials.items():
        if "ior" in type(material).model_fields:
            wanted[f"materials.{name}.ior"] = [*INDICES]
    group = next(iter(design.lights))
    wanted[f"lights.{group}.flux"] = [0.0, 1.0, 1000.0]
    for name, cage in design.cages.items():
        for point in CAGE_POINTS:
            for axis in "xyz":
                if cage.blend is None:
                    path = f"cages.{name}.points[{point}].{axis}"
                    wanted[path] = _around(design, path, STEPS[:6])
                else:
                    wanted[f"cages.{name}.blend[{point}].{axis}"] = [0.0, 0.25, 0.5, 0.75, 1.0]
    return {path: _allowed(design, path, values) for path, values in wanted.items()}


def moves_of(design: SensorDesign) -> dict[str, list[float]]:
    """Return moves (mm) and turns (degrees) of the camera and of uncaged parts, by path."""
    caged = {part for cage in design.cages.values() for part in cage.parts}
    found: dict[str, list[float]] = {}
    for axis in "xyz":
        found[f"camera.turn.{axis}"] = _either_side(0.0, TURNS)
    for name in design.parts:
        if name not in caged:
            for axis in "xyz":
                found[f"parts.{name}.shift.{axis}"] = _either_side(0.0, STEPS[2:7])
                found[f"parts.{name}.turn.{axis}"] = _either_side(0.0, TURNS[1::2])
    return found


def _either_side(now: float, steps: tuple[float, ...]) -> list[float]:
    return sorted({now, *(now + step for step in steps), *(now - step for step in steps)})


def _around(design: SensorDesign, path: str, steps: tuple[float, ...]) -> list[float]:
    return _either_side(float(get_value(design, path)), steps)


def _allowed(design: SensorDesign, path: str, values: list[Any]) -> list[Any]:
    """Return the values that a design file may have, and the current one."""
    found = []
    for value in dict.fromkeys([get_value(design, path), *values]):
        try:
            set_value(design, path, value)
        except OptiSenseError:
            continue
        found.append(value)
    return found


def search_each(name: str, kept: dict[str, Any], folder: Path, console: Console) -> None:
    """Search every parameter of a sensor; finished searches are written to the folder."""
    design = load(name)
    wanted = {**values_of(design), **moves_of(design)}
    for path, values in wanted.items():
        key = f"{name}: {path}"
        if key in kept or len(values) < 2:
            continue
        kept[key] = _search(design, path, values)
        write_text(folder / "searches.json", json.dumps(kept, indent=1))
        best = {each: kept[key][each] for each in OBJECTIVES if each in kept[key]}
        told = ", ".join(
            f"{each} {found['value']} {found['score']}" for each, found in best.items()
        )
        console.print(f"{key}: {told or kept[key]}", markup=False)


def _search(design: SensorDesign, path: str, values: list[Any]) -> dict[str, Any]:
    """Return the best value of one parameter by each objective, and the score of the start.

    Values are scored like the trials of a search; their steps grow with the distance from the
    start.
    """
    numbers = all(isinstance(value, int | float) for value in values)
    range_ = (min(values), max(values)) if numbers else values
    space = SearchSpace({path: range_}).bind(design, tried=False)
    evaluator = DesignEvaluator(space, list(OBJECTIVES), {"ray_resolution": list(RAYS)})
    places = [float(v) for v in values] if numbers else [*map(float, range(len(values)))]
    start = float(space.start[0])
    trials = []
    for number, place in enumerate([start, *(each for each in places if each != start)]):
        outcome = evaluator(np.array([place]), 0)
        trials.append(Trial(number, number - 1, np.array([place]), outcome, space, OBJECTIVES[0]))
    found: dict[str, Any] = {
        "tried": len(trials),
        "failed": sum(trial.failure is not None for trial in trials),
        "reasons": sorted({trial.failure for trial in trials if trial.failure is not None}),
    }
    for objective in OBJECTIVES:
        judged = [replace(trial, objective=objective) for trial in trials]
        best = best_of(judged)
        if best is None:
            continue
        found[objective] = {
            "place": best.vector.tolist(),
            "value": next(iter(best.values.values())),
            "score": best.score,
            "start": judged[0].score if math.isfinite(judged[0].score) else None,
            "is_start": best.is_start,
            "tied": len(tied(judged)),
        }
    return found


def draw_sheets(name: str, kept: dict[str, Any], folder: Path) -> None:
    """Draw a contact sheet for each objective with the view of the best camera of each search."""
    design = load(name)
    model = OpticalModel(design)
    for objective in OBJECTIVES:
        tiles = []
        for path in {**values_of(design), **moves_of(design)}:
            found = kept.get(f"{name}: {path}", {})
            if objective in found:
                won = _design_of(design, path, found[objective]["place"])
                model.set_design(won)
                tiles.append(_tile(model, path, found[objective]))
        _sheet(tiles).save(folder / f"{name}-{objective}.png")


def _design_of(design: SensorDesign, path: str, place: list[float]) -> SensorDesign:
    values = {**values_of(design), **moves_of(design)}[path]
    numbers = all(isinstance(value, int | float) for value in values)
    range_ = (min(values), max(values)) if numbers else values
    return SearchSpace({path: range_}).bind(design, tried=False).apply(np.array(place))


def _tile(model: OpticalModel, path: str, found: dict[str, Any]) -> Image.Image:
    """Draw the camera's view, with the parameter, its value and the score."""
    rays = model.chief_rays(RAYS)
    u, v = model.surface.u_axis, model.surface.v_axis
    points = rays.points.astype(np.float64)
    fields = np.floor(points @ u / CHECK) + np.floor(points @ v / CHECK)
    light = np.where(fields % 2 == 0, 1.0, 0.6) * np.clip(rays.incidence, 0.15, 1.0)
    grey = np.where(rays.hit, 255.0 * light, 0.0)
    pixels = np.stack([grey, grey, np.where(rays.hit, grey, 120.0)], axis=-1)
    picture = Image.fromarray(pixels.astype(np.uint8))
    tile = Image.new("RGB", (RAYS[0] + 8, RAYS[1] + 46), "white")
    draw = ImageDraw.Draw(tile)
    if not found["is_start"]:
        draw.rectangle((0, 0, RAYS[0] + 7, RAYS[1] + 7), fill=(210, 30, 30))
    tile.paste(picture, (4, 4))
    start = found["start"]
    lines = [
        path,
        f"= {_short(found['value'])}" + (" (the start)" if found["is_start"] else ""),
        f"{found['score']:.4g}" + (f" (start {start:.4g})" if start is not None else ""),
    ]
    for row, line in enumerate(lines):
        draw.text((4, RAYS[1] + 9 + 12 * row), line, fill="black")
    return tile


def _short(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _sheet(tiles: list[Image.Image]) -> Image.Image:
    width, height = tiles[0].size
    rows = math.ceil(len(tiles) / COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * width, rows * height), "white")
    for number, tile in enumerate(tiles):
        sheet.paste(tile, (number % COLUMNS * width, number // COLUMNS * height))
    return sheet


def main() -> None:
    """Run the searches, store their results and draw the contact sheets."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.single_parameters")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--sensor", choices=SENSORS.names(), action="append")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    file = options.folder / "searches.json"
    kept: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    console = Console()
    for name in options.sensor or SENSORS.names():
        search_each(name, kept, options.folder, console)
        draw_sheets(name, kept, options.folder)


if __name__ == "__main__":
    main()

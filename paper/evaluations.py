"""Functions that compute the units of experiments: scores, pictures, tasks and searches.

Each function is the work of units (see `paper.unit`). It takes plain values, `inputs`, and the
unit's own folder, and returns plain values. The optical model is kept for the next unit of the same
sensor, such that results do not depend on the units before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign, set_value
from optisense.geometry import Contact, parse_contact
from optisense.mechanics import CONFORMING
from optisense.objectives import Evaluation, Score, Settings, evaluate
from optisense.search.evaluation.models import ModelCache
from optisense.sensors import SENSORS
from paper.unit import Found, Unit

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, OpticalModel

Plain = Mapping[str, Any]

NINE = "nine balls"
"""Value of `contacts` that stands for the nine balls which the objectives press."""

SAME_IMAGES = ("contacts", "untouched image", "untouched radiance", "pressed images")
"""Values of an evaluation that do not depend on the exposure."""

_keepers: dict[tuple[Any, ...], tuple[SensorDesign, ModelCache]] = {}
_current: dict[tuple[Any, ...], tuple[str, OpticalModel]] = {}
"""The model that a models gave last, with its change as text."""


def sensor(name: str, change: Plain | None = None, **dimensions: Any) -> dict[str, Any]:
    """Return a design as plain values: a built-in sensor, its dimensions, and values set in it.

    Args:
        name: name of the built-in sensor.
        change: values by dotted path (see `optisense.set_value`). A dict stands for the values of
            a trial of a search that varied this path from 0 to 1.
        dimensions: arguments of the sensor's builder.
    """
    return {"sensor": name, "dimensions": dimensions, "change": dict(change or {})}


def score_unit(design: Plain, objectives: Iterable[str], settings: Plain, label: str) -> Unit:
    """Return the unit of scores of a design."""
    inputs = {"design": design, "objectives": list(objectives), "settings": settings}
    return Unit(scores, inputs, label)


def design_of(plain: Plain) -> SensorDesign:
    """Return the design that plain values describe (see `sensor`).

    Raises:
        OptiSenseError: the design can't be built.
    """
    return _changed(_base(plain), plain)


def scores(inputs: Plain, folder: Path) -> Found:
    """Return scores of a design.

    The inputs are `design`, `objectives` and their `settings`. An objective that fails has the
    score None in `scores` and its reason in `failures`.
    """
    model = _model(inputs["design"])
    found = evaluate(model, list(inputs["objectives"]), **tuples(inputs["settings"]))
    return Found(_scores(found))


def relit_scores(inputs: Plain, folder: Path) -> Found:
    """Return scores under several colourings of light groups, from one rendering of each group.

    The inputs are `design`, `groups` (the light groups), `colourings` (a letter of R, G, B for each
    group), `objectives`, `settings` of the images, `own` settings of the objectives, and optionally
    `normdiff_variants`, settings with each of which NormDiff is computed.
    """
    from optisense.objectives.combined import resolve
    from optisense.objectives.registry import pixels_read
    from optisense.objectives.relighting import Relighting
    from optisense.objectives.run import split_settings

    model, own = _model(inputs["design"]), inputs["own"]
    variants = inputs.get("normdiff_variants", {})
    names = dict.fromkeys([*inputs["objectives"], *(["normdiff"] if variants else [])])
    wanted = resolve(list(names))
    reads = pixels_read(wanted, split_settings(own, wanted)[1])
    relighting = Relighting(Evaluation(model, Settings(**tuples(inputs["settings"])), reads=reads))
    found = {}
    for letters in inputs["colourings"]:
        design = coloured(model.design, inputs["groups"], letters)
        evaluation = relighting.relit(design, whole=False)
        found[letters] = _scores(evaluate(evaluation, list(inputs["objectives"]), **own))
        found[letters]["normdiff_variants"] = {
            name: _scores({"": evaluate(evaluation, "normdiff", **variant)})["scores"][""]
            for name, variant in variants.items()
        }
    failures = {
        f"{letters} {name}": reason
        for letters, each in found.items()
        for name, reason in each["failures"].items()
    }
    return Found({"colourings": found, "failures": failures})


def variants_of_score(inputs: Plain, folder: Path) -> Found:
    """Return the scores of one objective with several settings of its own, from the same images.

    The inputs are `design`, `objective`, `variants` (settings by name) and `settings` of the
    images.
    """
    model = _model(inputs["design"])
    evaluation = Evaluation(model, Settings(**tuples(inputs["settings"])))
    found = {
        name: evaluate(evaluation, inputs["objective"], **own)
        for name, own in inputs["variants"].items()
    }
    scored = any(score.failure is None for score in found.values())
    pixels = [int(press.mask.sum()) for press in evaluation.presses] if scored else []
    return Found({**_scores(found), "pixels": pixels})


def scores_by_readings(inputs: Plain, folder: Path) -> Found:
    """Return RGB2Normal and NormDiff with several settings and two exposures.

    The inputs are `design`, `settings` of the images, `variants` (settings by objective and name)
    and `exposures` (names of the automatic exposure and of that of the untouched skin). A score
    that fails is None; its reason is not kept, since many settings fail for the same reason.
    """
    model, settings = _model(inputs["design"]), Settings(**tuples(inputs["settings"]))
    automatic = Evaluation(model, settings)
    fixed = Evaluation(model, replace(settings, exposure=automatic.untouched_exposure))
    found = {}
    for exposure, evaluation in zip(inputs["exposures"], (automatic, fixed), strict=True):
        evaluation.take(automatic, SAME_IMAGES)  # the second one renders nothing
        found[exposure] = {
            objective: {
                name: _scores({"": evaluate(evaluation, objective, **own)})["scores"][""]
                for name, own in variants.items()
            }
            for objective, variants in inputs["variants"].items()
        }
    return Found({"scores": found})


def stretch(inputs: Plain, folder: Path) -> Found:
    """Return by how much the camera stretches small shapes: the ratio of length to width of a
    circle.

    The inputs are `design` and `ray_resolution`. Neighbouring pixels span a parallelogram on the
    surface; the ratio of the semi-axes of its ellipse is 1 where shapes are preserved. The results
    are the median over pixels and the ratio that a tenth of them exceeds.
    """
    ratios = _stretches(_model(inputs["design"]).chief_rays(tuple(inputs["ray_resolution"])))
    return Found(
        {"median": float(np.median(ratios)), "tenth": float(np.percentile(ratios, 90))}
        if len(ratios)
        else {"median": None, "tenth": None}
    )


def median_stretch(rays: ChiefRays) -> float | None:
    """Return the median over pixels of the ratio of length to width of small circles
    (`stretch`)."""
    ratios = _stretches(rays)
    return float(np.median(ratios)) if len(ratios) else None


def _stretches(rays: ChiefRays) -> NDArray[np.float64]:
    """Return the ratio of semi-axes (n,) at each pixel whose neighbours hit the surface, too."""
    points = rays.points.astype(np.float64)
    right = (points[:, 1:] - points[:, :-1])[:-1]
    down = (points[1:] - points[:-1])[:, :-1]
    whole = rays.hit[:-1, :-1] & rays.hit[:-1, 1:] & rays.hit[1:, :-1]
    return axes_ratio(right[whole], down[whole])


def axes_ratio(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ratio of the singular values (n,), larger over smaller, of 3 x 2 matrices.

    Args:
        first: first columns (n, 3).
        second: second columns (n, 3).
    """
    a, b = (first**2).sum(axis=1), (second**2).sum(axis=1)
    c = (first * second).sum(axis=1)
    root = np.sqrt((0.5 * (a - b)) ** 2 + c**2)
    middle = 0.5 * (a + b)
    small = np.maximum(middle - root, 1e-12 * middle)
    ratio: NDArray[np.float64] = np.sqrt((middle + root) / small)
    return ratio


def picture(inputs: Plain, folder: Path) -> Found:
    """Return the picture of a design, its mean radiance, and its number of pixels in contact.

    The inputs are `design`, `contacts`, `resolution`, `photons` and `seed`. Contacts are texts as
    on the command line, or `NINE` with `depth`; an indenter named ``object:NAME`` is one of
    `paper.objects`. The result `radiance` is the mean before exposure over the sensing surface and
    the channels.
    """
    model = _model(inputs["design"])
    contacts: list[Contact]
    if inputs["contacts"] == NINE:
        contacts = model.nine_contacts(depth=inputs.get("depth", 0.3))
    else:
        contacts = [_contact(text) for text in inputs["contacts"]]
    image = model.render(
        contacts,
        tuple(inputs["resolution"]),
        inputs["photons"],
        seed=inputs["seed"],
        skin=CONFORMING,
    )
    if image.interrupted:
        raise KeyboardInterrupt
    lit = image.radiance[np.isfinite(image.radiance)]
    values = {
        "radiance": float(lit.mean()) if lit.size else 0.0,
        "pixels_in_contact": int(image.contact_mask.sum()),
    }
    return Found(values, {"picture": image.picture()})


def perception(inputs: Plain, folder: Path) -> Found:
    """Return how exactly the quantities of tasks are read from images.

    The inputs are `design`, `tasks` (a resolution for each name), `samples`, `seed` and `photons`.
    Samples are kept in the folder, one by one.
    """
    from optisense.tasks import CylinderRadius, Misalignment, SampleSettings, perceive

    known = {"misalignment": Misalignment, "cylinder-radius": CylinderRadius}
    model = _model(inputs["design"])
    found = {}
    for name, resolution in inputs["tasks"].items():
        settings = SampleSettings(
            count=inputs["samples"],
            seed=inputs["seed"],
            resolution=tuple(resolution),
            photons=inputs["photons"],
            skin=CONFORMING,
        )
        result = perceive(known[name](), model, settings, folder=folder / name)
        found[name] = {
            "error": result.reading.error,
            "guess": result.reading.guess,
            "snr": result.snr if math.isfinite(result.snr) else None,
        }
    return Found(found)


def searched(inputs: Plain, folder: Path) -> Found:
    """Run a search, kept as a study in the folder, and return its course.

    The inputs are `design`, `space`, `objectives`, `method`, `budget`, `seed`, `options` and
    `settings`. The results are the start, the best trial with its values, the best score after each
    trial, and, with `all` set, the scores of every trial.
    """
    from optisense.search import search

    study = folder / "study"
    result = search(
        design_of(inputs["design"]),
        _space(inputs["space"]),
        list(inputs["objectives"]),
        method=inputs["method"],
        budget=inputs.get("budget"),
        seed=inputs["seed"],
        options=inputs.get("options"),
        settings=tuples(inputs["settings"]),
        out=study,
        resume=(study / "study.json").is_file(),
    )
    if result.interrupted:
        raise KeyboardInterrupt
    trials = [trial for trial in result.trials if not trial.is_start]
    scored = [trial.score if trial.failure is None else math.nan for trial in trials]
    first = result.start.score
    course = np.fmax.accumulate([first, *scored]).tolist()
    found: dict[str, Any] = {
        "start": {**result.start.scores, "parts": _small(result.start.parts)},
        "best": {**result.best.scores, "parts": _small(result.best.parts)},
        "values": result.best.values,
        "course": course,
        "failed": sum(trial.failure is not None for trial in trials),
    }
    if inputs.get("all"):
        found["trials"] = [[list(trial.values.values()), dict(trial.scores)] for trial in trials]
    result.study.close()
    return Found(found)


def coloured(design: SensorDesign, groups: Sequence[str], letters: str) -> SensorDesign:
    """Return a design whose light groups are red, green or blue, by one letter for each group."""
    shares = {"R": (1.0, 0.0, 0.0), "G": (0.0, 1.0, 0.0), "B": (0.0, 0.0, 1.0)}
    for name, letter in zip(groups, letters, strict=True):
        design = set_value(design, f"lights.{name}.colour", shares[letter])
    return design


def _base(plain: Plain) -> SensorDesign:
    """Return the built-in sensor with its dimensions, before the changes."""
    builder: Callable[..., SensorDesign] = SENSORS.find(plain["sensor"])
    return builder(**tuples(plain["dimensions"]))


def _changed(design: SensorDesign, plain: Plain) -> SensorDesign:
    """Return a design with the values of `change` set."""
    from optisense.search import SearchSpace

    for path, value in plain["change"].items():
        if isinstance(value, Mapping):  # the values of a search's trial
            space = SearchSpace({path: (0.0, 1.0)}).bind(design, tried=False)
            design = space.apply(np.array([value[name] for name in space.names]))
        else:
            design = set_value(design, path, tuple(value) if isinstance(value, list) else value)
    return design


def _model(plain: Plain) -> OpticalModel:
    """Return the model of a design; the model returned before must not be used any more.

    The model of the same design as before keeps the light that was traced for it.
    """
    from optisense.json_values import json_ready

    key = (plain["sensor"], repr(json_ready(plain["dimensions"])))
    if key not in _keepers:
        _keepers.clear()  # many machines do not have the memory for two models
        _current.clear()
        _keepers[key] = _base(plain), ModelCache()
    (base, models), change = _keepers[key], repr(json_ready(plain["change"]))
    if key not in _current or _current[key][0] != change:
        _current.pop(key, None)
        _current[key] = (change, models.model(_changed(base, plain)))
    return _current[key][1]


def _contact(text: str) -> Contact:
    """Return the contact that a text describes, with an object of `paper.objects` if it names
    one."""
    from paper.objects import OBJECTS

    kind, _, place = text.partition("@")
    if not kind.startswith("object:"):
        return parse_contact(text)
    usual = parse_contact(f"sphere:1@{place}")
    return Contact(
        OBJECTS[kind.removeprefix("object:")](),
        at=usual.at,
        depth=usual.depth,
        rotation=usual.rotation,
    )


def _scores(found: Mapping[str, Score]) -> dict[str, Any]:
    """Return scores by name, reasons of those that failed, and single numbers among their parts."""
    return {
        "scores": {n: None if s.failure is not None else s.value for n, s in found.items()},
        "failures": {n: s.failure for n, s in found.items() if s.failure is not None},
        "parts": {n: _small({n: s.parts}).get(n, {}) for n, s in found.items()},
    }


def _small(parts: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Return the single numbers among the parts of scores, by score and part."""
    return {
        name: {
            key: value
            for key, value in own.items()
            if isinstance(value, int | float) and not isinstance(value, bool)
        }
        for name, own in parts.items()
    }


def _space(plain: Plain) -> dict[str, Any]:
    """Return a search space with bounds as pairs of numbers and options as lists."""
    return {
        path: tuple(spec) if not isinstance(spec[0], str) else list(spec)
        for path, spec in plain.items()
    }


def tuples(values: Plain) -> dict[str, Any]:
    """Return values with lists as tuples, which builders and settings take."""
    return {
        name: tuple(tuple(v) if isinstance(v, list) else v for v in value)
        if isinstance(value, list)
        else value
        for name, value in values.items()
    }

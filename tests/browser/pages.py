"""One page of each kind, of a sensor whose names and texts contain HTML."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from optisense.calibration.comparing import Comparison
from optisense.calibration.model_pictures import ModelPictures
from optisense.calibration.photographs import PhotographedPress, Photographs
from optisense.calibration.realism import realism
from optisense.calibration.result import Calibration, FittedNumber
from optisense.calibration.seen_contacts import SeenContact
from optisense.design import Provenance, SensorDesign
from optisense.geometry import Contact, Sphere
from optisense.geometry.objects import OBJECTS, ObjectIndenter
from optisense.objectives import Evaluation, Objective, Score, Settings
from optisense.objectives.score import Scored
from optisense.optics import OpticalModel, TactileImage
from optisense.report import write_report
from optisense.report.calibration import render_calibration
from optisense.report.camera_rays import CameraRays
from optisense.report.comparison import write_comparison
from optisense.report.light_section import LightSection, ledger_page
from optisense.report.scores import write_score_report
from optisense.report.study import write_study_report
from optisense.report.tolerance import render_tolerance
from optisense.report.verification import render_verification
from optisense.search import ToleranceDistribution, search
from optisense.search.tolerance.analysis import tolerance
from optisense.sensors import gelsight_mini_ideal
from optisense.tasks import Verification, VerificationSettings
from optisense.tasks.press_readings import PressPictures
from optisense.tasks.verification import SensorView

BALL = Contact(Sphere(radius=1.5), at=(0.0, 0.0), depth=0.8)
EVIL = "</script></table><script>window.ran = 1</script><img src=x onerror='window.ran = 1'> \"'"


def evil_design() -> SensorDesign:
    design = gelsight_mini_ideal().copy()
    design.name = design.description = EVIL
    design.provenance["camera.fov"] = Provenance(status="assumed", source=EVIL)
    return design


def red(design: SensorDesign) -> float:
    """A score that fails for the brightest coatings."""
    if design.coating.reflectance[0] > 0.9:
        raise ValueError(EVIL)
    return design.coating.reflectance[0] + 0.1 * design.coating.reflectance[1]


def blue(design: SensorDesign) -> float:
    return -(design.coating.reflectance[0] ** 2)


def write_pages(folder: Path) -> dict[str, Path]:
    """Files of the pages, by what they show."""
    design = evil_design()
    model = OpticalModel(design)
    image: TactileImage = model.render([BALL], resolution=(64, 48), photons=40_000)
    light = LightSection.of(model, 20_000, at=[(0.0, 0.0)])
    rays = CameraRays.of(model)
    pages = {
        name: folder / f"{name}.html"
        for name in ("render", "ledger", "scores", "study", "errors", "verify")
    }
    write_report(pages["render"], design, image, [BALL], light=light, rays=rays)
    pages["ledger"].write_text(ledger_page(design, light), encoding="utf-8")

    scored = Scored(design)
    evaluation = Evaluation(model, Settings(ray_resolution=(20, 16)))
    score = Score(EVIL, 0.5, parts={EVIL: EVIL, "places": [{"place": [1.0, 2.0], "score": 0.75}]})
    scored.add(evaluation).update({EVIL: score})
    write_score_report(pages["scores"], scored, [Objective(EVIL, red, EVIL)])

    space: dict[str, object] = {
        "coating.reflectance.r": (0.2, 1.0),
        "coating.reflectance.g": (0.2, 1.0),
        "lights.*.colour": ["R", "G"],
    }
    found = search(design, space, [red, blue], method="pareto", budget=40, seed=2)
    write_study_report(pages["study"], found.study)

    errors = {"coating.reflectance.r": ToleranceDistribution(0.3, "uniform")}
    page = render_tolerance(tolerance(design, red, errors, sensors=60))
    pages["errors"].write_text(page, encoding="utf-8")
    page = render_verification(verified(), (np.eye(3), np.eye(3)))
    pages["verify"].write_text(page, encoding="utf-8")
    return {**pages, **write_photograph_pages(folder, design)}


def write_photograph_pages(folder: Path, design: SensorDesign) -> dict[str, Path]:
    """The pages of `compare` and `calibrate`, of pictures that were made up."""
    before, after = compared(1.5), compared(1.1)
    number = FittedNumber("lights.red.flux", EVIL, "mW", 1.0, 1.2, 0.05, True)
    found = Calibration(
        design=design,
        exposure=1.0,
        numbers=(number, replace(number, determined=False)),
        alike=((EVIL, EVIL, 0.97),),
        before=before,
        after=after,
        held_out=(f"1 {EVIL}",),
        notes=(EVIL,),
    )
    pages = {name: folder / f"{name}.html" for name in ("comparison", "calibration")}
    write_comparison(pages["comparison"], design, after)
    pages["calibration"].write_text(render_calibration(found), encoding="utf-8")
    return pages


def compared(gain: float) -> Comparison:
    """Two photographs of balls, and a model that brightens more than they do."""
    rows, columns = np.mgrid[:60, :80]
    away = np.hypot(columns - 40.0, rows - 30.0)
    slope = np.where(away < 10.0, columns - 40.0, 0.0)[..., None] * (4.0, -3.0, 2.0)
    noise = np.random.default_rng(0).normal(0.0, 1.0, (60, 80, 3))
    ground = np.full((60, 80, 3), 90, np.uint8)
    picture = np.clip(np.round(90.0 + slope + noise), 0, 255).astype(np.uint8)
    presses = tuple(PhotographedPress(f"{k} {EVIL}", picture, 6.35) for k in range(2))
    photographs = Photographs(ground, presses)
    seen = [SeenContact((40.0, 30.0), 10.0)] * 2
    model = 90.0 + gain * slope
    pictures = ModelPictures(1.0, np.full((60, 80, 3), 92.0), (model, model), (BALL, BALL))
    figures = realism(photographs, seen, pictures)
    return Comparison(photographs, tuple(seen), pictures, figures, (EVIL,))


def verified() -> Verification:
    """A verification of two small objects by numbers that were made up."""
    names = tuple(OBJECTS)[:2]
    before = np.random.default_rng(0).uniform(8.0, 16.0, (len(names), 2, 1))
    normals = np.zeros((60, 80, 3), np.float32)
    normals[..., 2] = -1.0
    angles = np.full((60, 80), np.nan, np.float32)
    angles[20:30, 30:45] = 12.0
    seen = PressPictures(np.full((60, 80, 3), 90, np.uint8), normals, normals, angles)
    view = SensorView(coverage=0.5, area=200.0, detail=0.06, stretching=1.02)
    return Verification(
        names=(EVIL, EVIL),
        settings=VerificationSettings(names, places=2, readers=1),
        scale=1.0,
        same_places=True,
        normals=(before, before - 4.0),
        depths=(before / 100, before / 100),
        flat=(20.0, 0.4),
        views=(view, view),
        pictures=dict.fromkeys(names, (seen, seen)),
        contacts={name: [Contact(ObjectIndenter(name), point=(0.0, 0.0, 0.0))] for name in names},
    )

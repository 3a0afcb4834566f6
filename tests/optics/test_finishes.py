"""Frosted and painted faces of a sensor: which surfaces light meets, and what it does there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import optisense as ots
from optisense.design import Part, Role, SensorDesign
from optisense.design.materials import Absorber, Conductor, Dielectric, Material
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.optics import OpticalModel
from optisense.optics.drafts import DraftModel
from optisense.optics.scene.assembly import assemble
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.surfaces import SurfaceKind

ACRYLIC, GEL = 1.491, 1.41
SIZE = (64, 48)


def mini(part: str, faces: dict[str, Any], **materials: Material) -> SensorDesign:
    """GelSight Mini with finished faces; its guide is a block from z = -9.25 to -5.25."""
    design = ots.load("gelsight-mini-ideal")
    for name, material in materials.items():
        design.materials[name] = material
    return ots.set_value(design, f"parts.{part}.faces", faces)


def area(piece: Piece) -> float:
    a, b, c = (np.asarray(piece.vertices)[piece.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def named(design: SensorDesign, name: str) -> list[Piece]:
    return [piece for piece in assemble(design).pieces if piece.name.endswith(name)]


BLACK = Absorber()
RIGHT = {"direction": (1, 0, 0), "within": 10}
SIDE = 20.75 * 4.0
"""Area (mm^2) of the guide's right side."""


def test_frost_divides_an_interface_and_nothing_else() -> None:
    plain = assemble(ots.load("gelsight-mini-ideal")).pieces
    pieces = assemble(mini("guide", {"edge": {**RIGHT, "roughness": 0.3}})).pieces
    (rough,) = [piece for piece in pieces if piece.name.endswith(":guide.edge")]
    assert area(rough) == pytest.approx(SIDE, rel=1e-6)
    assert (rough.surface.alpha, rough.surface.eta) == (0.3, pytest.approx(ACRYLIC))
    others = [piece for piece in pieces if piece is not rough]
    assert [(p.name, p.surface) for p in others] == [(p.name, p.surface) for p in plain]
    assert sum(map(area, pieces)) == pytest.approx(sum(map(area, plain)), rel=1e-6)


def test_a_frosted_face_against_another_solid_is_rough_between_the_two() -> None:
    """The gel of the Mini stands on the tray, which is wider."""
    frost = {"top": {"direction": (0, 0, 1), "within": 10, "roughness": 0.2}}
    gel, air = sorted(named(mini("tray", frost), ":tray.top"), key=area, reverse=True)
    assert gel.surface.alpha == air.surface.alpha == 0.2
    assert area(gel) == pytest.approx(25.25 * 20.75, rel=0.01)
    assert area(gel) + area(air) == pytest.approx(28.25 * 23.72, rel=0.01)
    assert {round(s.surface.eta, 4) for s in (gel, air)} <= {
        round(value, 4) for value in (GEL / ACRYLIC, ACRYLIC / GEL, ACRYLIC)
    }


def test_a_frosted_face_between_media_of_one_index_scatters_nothing() -> None:
    """The gel has the tray's index, and absorbs."""
    frost = {"top": {"direction": (0, 0, 1), "within": 10, "roughness": 0.2}}
    gel = Dielectric(ior=ACRYLIC, absorption=(0.01, 0.01, 0.01))
    design = mini("tray", frost, acrylic=Dielectric(ior=ACRYLIC), gel=gel)
    design.parts["gel"].material = "gel"
    beside, air = sorted(named(design, ":tray.top"), key=area, reverse=True)
    assert (beside.surface.eta, beside.surface.alpha, air.surface.alpha) == (1.0, 0.0, 0.2)


def test_paint_takes_the_place_of_an_interface() -> None:
    design = mini("guide", {"edge": {**RIGHT, "paint": "black"}}, black=BLACK)
    pieces = assemble(design).pieces
    (paint,) = [piece for piece in pieces if piece.name == "guide.edge"]
    assert paint.surface.kind is SurfaceKind.ABSORBER
    assert area(paint) == pytest.approx(SIDE, rel=1e-6)
    bare = [p for p in pieces if p.surface.kind is SurfaceKind.DIELECTRIC]
    plain = [
        p
        for p in assemble(ots.load("gelsight-mini-ideal")).pieces
        if p.surface.kind is SurfaceKind.DIELECTRIC
    ]
    assert sum(map(area, plain)) - sum(map(area, bare)) == pytest.approx(SIDE, rel=1e-6)


def test_metal_paint_is_seen_from_within_the_solid() -> None:
    silver = Conductor(eta=(0.05,) * 3, k=(4.0,) * 3)
    design = mini("guide", {"edge": {**RIGHT, "paint": "silver"}}, silver=silver)
    (paint,) = named(design, "guide.edge")
    assert paint.surface.kind is SurfaceKind.MIRROR
    assert paint.surface.metal_k == pytest.approx((4.0 / ACRYLIC,) * 3)


def test_metal_reflects_as_in_the_media_on_its_sides() -> None:
    """A slab below the guide, and its upper face alone, whose normal points away from the guide."""
    design = mini("guide", {}, silver=Conductor(eta=(0.05,) * 3, k=(4.0,) * 3))
    low, high = design.meshes["guide"].bounds
    slab = TriangleMesh.box((low[0], low[1], low[2] - 1.0), (high[0], high[1], low[2]))
    top = slab.with_faces(slab.faces[slab.face_normals[:, 2] > 0.5]).compacted()
    found = {}
    for name, mesh in (("slab", slab), ("sheet", top.flipped())):
        part = Part(role=Role.MIRROR, mesh=f"meshes/{name}.obj", material="silver")
        placed = design.model_copy(update={"parts": {**design.parts, name: part}})
        placed.meshes[name] = mesh
        found[name] = [
            (area(piece), piece.surface.metal_k[0], piece.surface.eta)
            for piece in sorted(named(placed, name), key=area)
        ]
    (alone,) = found["sheet"]
    assert alone == pytest.approx((top.area, 4.0, ACRYLIC))
    touching, bare = found["slab"]
    assert touching == pytest.approx((top.area, 4.0 / ACRYLIC, 1 / ACRYLIC))
    assert bare == pytest.approx((slab.area - top.area, 4.0, 1.0))


def test_the_coating_wins_over_paint_and_what_it_covers_wholly_is_an_error() -> None:
    top = {"direction": (0, 0, 1), "within": 20, "paint": "black"}
    with pytest.raises(DesignError, match="covers all of the faces 'top' of part 'gel'"):
        assemble(mini("gel", {"top": top}, black=BLACK))


def test_a_model_takes_on_another_roughness_and_paint() -> None:
    design = mini("guide", {"edge": {**RIGHT, "roughness": 0.3}}, black=BLACK)
    model = OpticalModel(design)
    model.update("parts.guide.faces.edge.roughness", 0.1)
    assert [p.surface.alpha for p in model.scenes.pieces if p.name.endswith(":guide.edge")] == [0.1]
    model.update("parts.guide.faces", {"edge": {**RIGHT, "paint": "black"}})
    assert [p.name for p in model.scenes.pieces if "guide.edge" in p.name] == ["guide.edge"]
    model.update("parts.guide.faces", None)
    assert not [p.name for p in model.scenes.pieces if "guide.edge" in p.name]


def test_frost_spreads_light_and_black_paint_takes_it() -> None:
    """Where the red LEDs shine into the guide."""
    far = {"direction": (0, 1, 0), "within": 10}
    images = [
        OpticalModel(design).render(resolution=SIZE, photons=400_000).layers["red"][..., 0]
        for design in (
            ots.load("gelsight-mini-ideal"),
            mini("guide", {"edge": {**far, "roughness": 0.4}}),
            mini("guide", {"edge": {**far, "paint": "black"}}, black=BLACK),
        )
    ]
    plain, frost, black = images
    assert frost.std() / frost.mean() < 0.8 * plain.std() / plain.mean()
    assert black.mean() < 0.05 * plain.mean()


def test_drafts_have_the_same_faces() -> None:
    design = mini("guide", {"edge": {**RIGHT, "roughness": 0.3}})
    draft = DraftModel(design)
    draft.render(resolution=SIZE, photons=100_000)
    moved = ots.set_value(design, "parts.guide.faces.edge.roughness", 0.2)
    draft.set_design(moved)
    draft.render(resolution=SIZE, photons=100_000)
    assert [p.surface.alpha for p in draft.scenes.pieces if p.name.endswith(":guide.edge")] == [0.2]

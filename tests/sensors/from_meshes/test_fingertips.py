"""Guesses for round fingertips: the coated faces, and lights and camera in the hollow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from optisense import OpticalModel, check
from optisense.geometry import TriangleMesh
from optisense.sensors.from_meshes import design_from_meshes, guess_recipe
from optisense.sensors.from_meshes.directions import vector
from optisense.sensors.from_meshes.fingertips import is_round

DOMES = {"gel": (12.0, 10.0), "window": (10.0, 8.5)}
"""Outer and inner radius (mm) of the shells of a fingertip."""


def shell(outer: float, inner: float) -> trimesh.Trimesh:
    """A hollow half ball, open to -z."""
    angle = np.linspace(0.0, np.pi / 2.0, 30)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring[-1, 0] = 0.0
    profile = np.concatenate([outer * ring, inner * ring[::-1], outer * ring[:1]])
    return trimesh.creation.revolve(profile, sections=64)


def write(folder: Path, turn: tuple[float, ...] | None = None, **more: trimesh.Trimesh) -> Path:
    """Write the shells and a base with a hole, and the shapes of other files."""
    base = trimesh.creation.annulus(3.0, 12.0, 1.0).apply_translation((0, 0, -0.6))
    shapes = {name: shell(*radii) for name, radii in DOMES.items()} | {"housing": base} | more
    for name, mesh in shapes.items():
        if turn is not None:
            mesh = mesh.copy().apply_transform(trimesh.geometry.align_vectors((0, 0, 1), turn))
        mesh.export(folder / f"{name}.stl")
    return folder


@pytest.mark.parametrize("tip", [None, (-1, 0, 0)], ids=["+z", "-x"])
def test_a_fingertip_is_seen_and_lit_from_inside(tmp_path: Path, tip: Any) -> None:
    recipe = guess_recipe(write(tmp_path, tip))
    design = design_from_meshes(recipe).design
    assert check(design) == []
    assert design.meshes["skin"].area == pytest.approx(2.0 * np.pi * 12.0**2, rel=0.01)
    lamps = [light for group in design.lights.values() for light in group.lights]
    assert len(lamps) == 9
    way = np.array(tip or (0, 0, 1), dtype=float)
    for lamp in lamps:
        along = np.array(lamp.position) @ way
        across = np.linalg.norm(np.array(lamp.position) - along * way)
        assert 4.0 < across < 8.5 - 2.2 and 0.0 < along < 2.0
    rays = OpticalModel(design).chief_rays((64, 48))
    assert np.isfinite(rays.points).all(axis=2).mean() > 0.95  # the skin fills the picture


def test_a_lens_and_leds_that_were_drawn_come_first(tmp_path: Path) -> None:
    lens = trimesh.creation.cylinder(radius=1.0, height=1.0).apply_translation((0, 0, 0.5))
    led = trimesh.creation.box(bounds=[(5, -1, 0), (6, 1, 0.5)])
    recipe = guess_recipe(write(tmp_path, lens=lens, leds=led))
    assert recipe.camera.model == "pi-v2" and list(recipe.lights) == ["leds"]


def test_a_dome_without_room_gets_rows_of_lights(tmp_path: Path) -> None:
    recipe = guess_recipe(write(tmp_path, gel=shell(6.0, 5.0), window=shell(5.0, 4.0)))
    assert recipe.parts["skin"].tangent
    assert all(group.row is not None for group in recipe.lights.values())


@pytest.mark.parametrize("hole", [5.0, 8.0])
@pytest.mark.parametrize("name", ["base", "base_plate"])
def test_lights_go_into_the_dome_and_not_into_the_hole_of_its_base(
    tmp_path: Path, name: str, hole: float
) -> None:
    """The hole reaches from 3 mm below the dome to its open end at z = 0."""
    shell(24.0, 18.0).export(tmp_path / "gel.stl")
    base = trimesh.creation.annulus(hole, 26.0, 3.0).apply_translation((0, 0, -1.5))
    base.export(tmp_path / f"{name}.stl")
    recipe = guess_recipe(tmp_path)
    rings = [group.ring for group in recipe.lights.values()]
    assert [ring and ring.height for ring in rings] == [0.5] * 3
    assert [ring and ring.radius for ring in rings] == pytest.approx([15.5] * 3, abs=0.1)
    assert recipe.camera.at == pytest.approx((0, 0, 0), abs=1e-3)


def test_a_single_long_fingertip_is_touched_at_its_tip(tmp_path: Path) -> None:
    """A tube with a dome, 30 x 30 x 33 mm, is smallest across."""
    angle = np.linspace(0.0, np.pi / 2.0, 30)
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    arc[-1, 0] = 0.0
    outer, inner = 15.0 * arc + (0.0, 18.0), 9.0 * arc[::-1] + (0.0, 18.0)
    profile = np.concatenate([[(15.0, 0.0)], outer, inner, [(9.0, 0.0), (15.0, 0.0)]])
    tube = trimesh.creation.revolve(profile, sections=64)
    for tip in ("+z", "-x"):
        turned = tube.copy().apply_transform(trimesh.geometry.align_vectors((0, 0, 1), vector(tip)))
        turned.export(tmp_path / "gel.stl")
        recipe = guess_recipe(tmp_path)
        assert recipe.parts["skin"].towards == tip
        assert all(group.ring is not None for group in recipe.lights.values())


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (shell(12.0, 10.0), True),
        (trimesh.creation.icosphere(subdivisions=3, radius=5.0), True),
        (trimesh.creation.box((20.0, 16.0, 4.0)), False),
        (trimesh.creation.cylinder(radius=8.0, height=6.0, sections=64), False),
    ],
    ids=["dome", "ball", "pad", "disc"],
)
def test_domes_are_told_from_pads(mesh: trimesh.Trimesh, expected: bool) -> None:
    assert is_round(TriangleMesh(mesh.vertices, mesh.faces), "+z") is expected

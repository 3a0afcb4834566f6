"""A small sensor drawn here: a gel block on a plate, with LEDs and a lens beside it."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

RECIPE = """\
name: block
parts:
  gel: {file: gel.stl, role: elastomer}
  skin: {faces_of: gel, towards: +z, role: sensing_surface}
  plate: {file: plate.stl, role: support}
lights:
  red: {model: smd-3528, colour: red, row: {part: plate, side: +y, count: 4, pitch: 4.5}}
camera: {model: pi-v2}
"""


class Cad:
    """A folder of CAD files and a recipe."""

    recipe = RECIPE

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @staticmethod
    def block(low: tuple[float, ...], high: tuple[float, ...]) -> trimesh.Trimesh:
        return trimesh.creation.box(bounds=[low, high])

    def shapes(self) -> dict[str, trimesh.Trimesh]:
        """The parts, mm; the gel is 20 x 16 x 4."""
        leds = [self.block((12.2, y - 1, -2.5), (14, y + 1, -0.5)) for y in (-6, 0, 6)]
        return {
            "gel": self.block((-10, -8, 0), (10, 8, 4)),
            "plate": self.block((-12, -10, -3), (12, 10, 0)),
            "leds": trimesh.util.concatenate(leds),
            "lens": trimesh.creation.cylinder(radius=2, height=1).apply_translation((0, 0, -20)),
        }

    def write(
        self,
        recipe: str = RECIPE,
        scale: float = 1.0,
        suffix: str = "stl",
        **changed: trimesh.Trimesh,
    ) -> Path:
        """Write the files, some of them changed, and return the path of the recipe."""
        self.folder.mkdir(exist_ok=True)
        for name, mesh in (self.shapes() | changed).items():
            mesh.copy().apply_scale(scale).export(self.folder / f"{name}.{suffix}")
        file = self.folder / "sensor.yaml"
        file.write_text(recipe.replace(".stl", f".{suffix}"), encoding="utf-8")
        return file


@pytest.fixture
def cad(tmp_path: Path) -> Cad:
    return Cad(tmp_path / "cad")

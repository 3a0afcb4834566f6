"""`optisense new --from-meshes`: recipes, questions at a terminal, guesses, and what is refused."""

from __future__ import annotations

import re
import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

import optisense
from optisense import library
from optisense.cli import app
from optisense.cli import new as new_module
from optisense.design import SensorDesign, add_cage
from optisense.design.camera import ImagingModel
from optisense.geometry import TriangleMesh
from optisense.sensors.from_meshes import read_recipe
from tests.helpers.mesh_files import triangle_ply

CAD = Path(__file__).parents[2] / "docs" / "examples" / "pad-sensor"

runner = CliRunner()


def new(*words: object, answers: str | None = None) -> tuple[int, str]:
    result = runner.invoke(app, ["new", *map(str, words)], input=answers)
    assert "Traceback" not in result.output
    return result.exit_code, result.output


def places(design: SensorDesign, group: str) -> np.ndarray:
    return np.array([light.position for light in design.lights[group].lights])


@pytest.fixture
def at_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(new_module, "_at_terminal", lambda: True)


def test_a_recipe_makes_a_design_that_passes_the_check(tmp_path: Path) -> None:
    code, text = new("--from-meshes", CAD / "sensor.yaml", tmp_path / "pad")
    assert code == 0, text
    design = optisense.load(tmp_path / "pad")
    result = runner.invoke(app, ["check", str(tmp_path / "pad")])
    assert result.exit_code == 0 and "in order" in result.output
    # The gel is a block of 20 x 2 x 16 mm with a circular segment on top.
    angle = np.arcsin(10.0 / 40.0)
    segment = 40.0**2 * (angle - np.sin(angle) * np.cos(angle))
    assert design.meshes["gel"].volume == pytest.approx(16 * (40 + segment), rel=1e-3)
    assert design.meshes["skin"].area == pytest.approx(2 * angle * 40.0 * 16.0, rel=1e-3)
    np.testing.assert_allclose(places(design, "red")[:, 1], 10.2)
    np.testing.assert_allclose(places(design, "blue")[:, 0], 12.15, atol=1e-5)
    assert design.camera.position == pytest.approx((0, 0, -22), abs=1e-5)
    assert "# mm" in (tmp_path / "pad" / "design.yaml").read_text()


def test_an_ideal_camera_is_told_until_the_recipe_takes_its_imaging(tmp_path: Path) -> None:
    folder = tmp_path / "pad"
    recipe = folder / "recipe.yaml"
    told = "the camera is ideal: shading, crosstalk, noise"
    text = new("--from-meshes", CAD / "sensor.yaml", folder)[1]
    assert told in text and "imaging: true" in text
    assert told in runner.invoke(app, ["check", str(folder)]).output
    recipe.write_text(recipe.read_text().replace("imaging: false", "imaging: true"))
    code, text = new("--from-meshes", recipe, folder, "--overwrite")
    assert code == 0 and told not in text
    assert told not in runner.invoke(app, ["check", str(folder)]).output
    design, known = optisense.load(folder), library.camera("pi-v2")
    for field in ImagingModel.model_fields:
        assert getattr(design.camera, field) == getattr(known, field)
    assert design.camera.resolution == (320, 240)
    assert design.provenance["camera.noise"].source.startswith("rpi.noise")


@pytest.mark.parametrize(
    ("flux", "told"),
    [
        (4.2, "lights red: 4.2 mW each is 2 times the nominal flux of a red smd-3528"),
        (0.0021, "lights red: 0.0021 mW each is 0.001 times the median of the groups, 2.1 mW"),
    ],
)
def test_an_unusual_flux_is_told(tmp_path: Path, flux: float, told: str) -> None:
    cad = tmp_path / "cad"
    shutil.copytree(CAD, cad)
    recipe = cad / "sensor.yaml"
    text = recipe.read_text()
    recipe.write_text(text.replace("flux: 2.1", "flux: 0", 1))  # switched off
    assert "mW each" not in new("--from-meshes", recipe, tmp_path / "pad")[1]
    recipe.write_text(text.replace("flux: 2.1", f"flux: {flux}", 1))
    assert f"warning: {told}" in new("--from-meshes", recipe, tmp_path / "odd")[1]
    assert f"note: {told}" in runner.invoke(app, ["check", str(tmp_path / "odd")]).output


def test_the_recipe_beside_the_design_makes_it_again(tmp_path: Path) -> None:
    folder = tmp_path / "pad"
    assert new("--from-meshes", CAD / "sensor.yaml", folder)[0] == 0
    first = (folder / "design.yaml").read_bytes()
    recipe = folder / "recipe.yaml"
    recipe.write_text(recipe.read_text().replace("pitch: 4.5", "pitch: 5.0"))
    code, text = new("--from-meshes", recipe, folder)
    assert code == 1 and "--overwrite" in text
    assert (folder / "design.yaml").read_bytes() == first
    assert new("--from-meshes", recipe, folder, "--overwrite")[0] == 0
    assert np.diff(places(optisense.load(folder), "red")[:, 0]) == pytest.approx([5.0] * 3)


class TestChangesSinceTheRecipe:
    """A design that was changed after its recipe made it is not overwritten by the way."""

    @pytest.fixture
    def caged(self, tmp_path: Path) -> Path:
        folder = tmp_path / "pad"
        assert new("--from-meshes", CAD / "sensor.yaml", folder)[0] == 0
        made = optisense.load(folder)
        changed = add_cage(optisense.set_value(made, "name", "mine"), "bump", ["gel", "skin"])
        optisense.save_design(changed, folder)
        return folder

    def again(self, folder: Path, *more: str) -> tuple[int, str]:
        return new("--from-meshes", folder / "recipe.yaml", folder, "--overwrite", *more)

    def test_they_are_listed_and_kept(self, caged: Path) -> None:
        code, text = self.again(caged)
        assert code == 1 and "cages.bump: added" in text and "name: pad sensor -> mine" in text
        assert list(optisense.load(caged).cages) == ["bump"]

    def test_they_are_discarded_on_demand(self, caged: Path) -> None:
        assert self.again(caged, "--discard-changes")[0] == 0
        assert not optisense.load(caged).cages
        assert self.again(caged)[0] == 0

    def test_a_mesh_counts(self, caged: Path) -> None:
        assert self.again(caged, "--discard-changes")[0] == 0
        mesh = caged / "meshes" / "housing.obj"
        moved = TriangleMesh.load(mesh)
        moved.with_vertices(moved.vertices * 1.001).save_obj(mesh)
        code, text = self.again(caged)
        assert code == 1 and "mesh of part 'housing': vertices moved" in text

    def test_a_design_that_no_recipe_made_is_kept(self, caged: Path) -> None:
        (caged / "recipe-made.json").unlink()
        code, text = self.again(caged)
        assert code == 1 and "the cages bump" in text

    @pytest.mark.parametrize("text", ["{}", "[1]", "not JSON"])
    def test_a_damaged_summary(self, caged: Path, text: str) -> None:
        (caged / "recipe-made.json").write_text(text)
        code, said = self.again(caged)
        assert code == 1 and "recipe-made.json" in said and "--discard-changes" in said


def test_guesses_that_do_not_fit_are_kept_to_be_mended(tmp_path: Path) -> None:
    cad = tmp_path / "cad"
    shutil.copytree(CAD, cad, ignore=shutil.ignore_patterns("*.yaml", "*.py"))
    gel = TriangleMesh.load(cad / "gel.stl")
    gel.with_faces(gel.faces[1:]).save_obj(cad / "gel.obj")  # not closed
    (cad / "gel.stl").unlink()
    folder = tmp_path / "pad"
    code, text = new("--from-meshes", cad, folder, "--yes")
    assert code == 2 and "not closed" in text
    assert "guessed: housing is blocker" in text and "recipe is saved" in text
    assert not (folder / "design.yaml").exists()
    gel.save_obj(cad / "gel.obj")
    assert new("--from-meshes", folder / "recipe.yaml", folder, "--overwrite")[0] == 0


def test_a_mesh_file_with_unknown_vertices_is_named(tmp_path: Path) -> None:
    (tmp_path / "gel.ply").write_text(triangle_ply("0 1 7"))
    code, text = new("--from-meshes", tmp_path, tmp_path / "pad", "--yes")
    assert code == 2
    assert "names vertex 8, but there are 3" in text and "gel.ply" in text


def test_guesses_are_told(tmp_path: Path) -> None:
    code, text = new("--from-meshes", CAD, tmp_path / "pad", "--yes")
    assert code == 0, text
    assert "guessed: housing is blocker (housing.stl)" in text
    assert "guessed: lights leds, on the faces of leds.stl towards -x" in text
    assert "guessed: camera pi-v2, in the middle of lens.stl" in text
    assert "guessed: all lights are white" in text
    assert set(read_recipe(tmp_path / "pad" / "recipe.yaml").parts) == {
        "gel", "skin", "window", "housing",
    }  # fmt: skip


def test_a_guessed_unit_is_told(tmp_path: Path) -> None:
    gel = TriangleMesh.load(CAD / "gel.stl")
    gel.with_vertices(gel.vertices / 1000.0).save_obj(tmp_path / "gel.obj")
    source = tmp_path / "gel.obj"
    code, text = new("--from-meshes", source, tmp_path / "pad", "--yes")
    assert code == 0 and "guessed: unit m\n" in text
    _, text = new("--from-meshes", source, tmp_path / "given", "--yes", "--units", "m")
    assert "guessed: gel is" in text and "guessed: unit" not in text


@pytest.mark.usefixtures("at_terminal")
class TestQuestions:
    def test_enter_takes_what_is_suggested(self, tmp_path: Path) -> None:
        asked, guessed = tmp_path / "asked", tmp_path / "guessed"
        code, text = new("--from-meshes", CAD, asked, answers="\n" * 40)
        assert code == 0, text
        assert new("--from-meshes", CAD, guessed, "--yes")[0] == 0
        one, other = optisense.load(asked), optisense.load(guessed)
        assert one.lights == other.lights and one.camera == other.camera
        assert list(one.parts) == list(other.parts)

    def test_answers_count_and_bad_ones_are_asked_again(self, tmp_path: Path) -> None:
        answers = [
            "My pad", "feet", "mm",
            "elas", "blocker", "noth", "c", "sup",  # gel, housing, leds, lens, window
            "glass", "pdms", "black-plastic", "acrylic",
            "gel", "-x-", "+z", "diffuse-grey",
            "side", "nope", "smd-0805", "b", "-3", "2.5",
            "ring", "window", "6", "+z", "-", "0.4", "-1",
            "-",
            "pi-v1", "0,0,-30", "skin", "-y", "yes",
        ]  # fmt: skip
        folder = tmp_path / "pad"
        code, text = new("--from-meshes", CAD, folder, answers="\n".join(answers) + "\n")
        assert code == 0, text
        for complaint in ("one of: mm, cm", "'glass'", "one of: +x, -x", "'nope'", "at least 0"):
            assert complaint in text
        design = optisense.load(folder)
        assert design.name == "My pad"
        assert design.parts["gel"].material == "pdms"
        group = design.lights["side"]
        assert (group.model, group.flux, group.colour) == ("smd-0805", 2.5, (0.0, 0.0, 1.0))
        around = places(design, "side")
        np.testing.assert_allclose(np.hypot(around[:, 0], around[:, 1]), 12.4, atol=1e-5)
        np.testing.assert_allclose(around[:, 2], -1.0)
        assert design.camera.model == "pi-v1"
        assert design.camera.noise is not None
        assert design.camera.position == (0, 0, -30) and design.camera.up == (0, -1, 0)

    def test_lights_over_a_surface_and_along_an_edge(self, tmp_path: Path) -> None:
        answers = [
            "", "", "", "lights", "nothing", "", "",  # lights go over the floor of the housing
            "", "", "", "", "",
            "", "red", "", "+z", "3", "4.5", "+x",
            "edge", "", "", "", "row", "window", "2", "-y", "6", "+z", "", "-1",
            "-",
        ]  # fmt: skip
        folder = tmp_path / "pad"
        code, text = new("--from-meshes", CAD, folder, answers="\n".join(answers) + "\n" * 9)
        assert code == 0, text
        design = optisense.load(folder)
        over = places(design, "housing")
        np.testing.assert_allclose(over, [[x, 0, -23.95] for x in (-4.5, 0, 4.5)], atol=1e-5)
        assert {light.direction for light in design.lights["housing"].lights} == {(1.0, 0.0, 0.0)}
        row = places(design, "edge")
        np.testing.assert_allclose(row, [[-3, -10.2, -1], [3, -10.2, -1]], atol=1e-6)
        assert {light.direction for light in design.lights["edge"].lights} == {(0.0, 0.0, 1.0)}

    def test_answers_are_kept_when_the_files_are_unfit(self, tmp_path: Path) -> None:
        cad = tmp_path / "cad"
        cad.mkdir()
        optisense.load("gelsight-mini-ideal").meshes["skin"].save_obj(cad / "gel.obj")  # not closed
        code, text = new("--from-meshes", cad, tmp_path / "pad", answers="\n" * 60)
        assert code == 2 and "not closed" in text and "part gel" in text
        assert "Your answers are saved" in text
        assert read_recipe(tmp_path / "pad" / "recipe.yaml").parts["gel"].file
        assert not (tmp_path / "pad" / "design.yaml").exists()

    def test_the_end_of_input_is_the_end(self, tmp_path: Path) -> None:
        code, _ = new("--from-meshes", CAD, tmp_path / "pad", answers="x\n")
        assert code == 130
        assert not (tmp_path / "pad").exists()


class TestRefused:
    def test_nobody_to_ask(self, tmp_path: Path) -> None:
        code, text = new("--from-meshes", CAD, tmp_path / "pad")
        assert code == 2 and "--yes" in text

    def test_nothing_there(self, tmp_path: Path) -> None:
        code, text = new("--from-meshes", tmp_path / "none", tmp_path / "pad")
        assert code == 2 and "no such recipe" in text

    def test_a_folder_of_something_else_is_never_overwritten(self, tmp_path: Path) -> None:
        (tmp_path / "notes.txt").write_text("mine")
        recipe = CAD / "sensor.yaml"
        code, text = new("--from-meshes", recipe, tmp_path, "--overwrite")
        assert code == 1 and "no design in this folder" in text
        assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]

    def test_units_that_cannot_be(self, tmp_path: Path) -> None:
        recipe = CAD / "sensor.yaml"
        code, text = new("--from-meshes", recipe, tmp_path / "pad", "--units", "m")
        assert code == 2 and "32 m large if its files are in m" in text
        assert not (tmp_path / "pad").exists()

    def test_mils_are_taken_as_in_a_recipe(self, tmp_path: Path) -> None:
        """The camera, 22 mils from the skin, is then too near to the parts."""
        _, text = new("--from-meshes", CAD / "sensor.yaml", tmp_path / "pad", "--units", "mil")
        assert f"at (0, 0, {-22 * 0.0254:.4f})" in text

    @pytest.mark.parametrize(
        ("words", "told"),
        [
            (("--from-meshes", CAD), "Invalid value for DIR: name the folder"),
            ((), "name a built-in sensor and the folder"),
        ],
    )
    def test_a_missing_name(self, words: tuple[object, ...], told: str) -> None:
        code, text = new(*words)
        assert code == 2 and told in text

    @pytest.mark.parametrize(
        "words",
        [
            ("gelsight-mini-ideal",),
            ("gelsight-mini-ideal", "a", "--yes"),
            ("gelsight-mini-ideal", "a", "--units", "m"),
            ("gelsight-mini-ideal", "a", "--discard-changes"),
            ("a", "b", "--from-meshes", CAD),
            ("a", "--from-meshes", CAD, "--units", "feet"),
        ],
    )
    def test_options_that_do_not_fit(self, words: tuple[object, ...]) -> None:
        assert new(*words)[0] == 2


class TestTheExample:
    """The guide to one's own CAD files tells what its example holds."""

    def test_the_guide_shows_its_recipe(self) -> None:
        page = (CAD.parents[1] / "your-sensor.md").read_text(encoding="utf-8")
        shown = re.search(r"^```yaml\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
        assert shown is not None
        assert yaml.safe_load(shown[1]) == yaml.safe_load((CAD / "sensor.yaml").read_text())

    def test_its_files_are_what_its_script_draws(self, tmp_path: Path) -> None:
        script = tmp_path / "make_meshes.py"
        shutil.copy(CAD / script.name, script)
        runpy.run_path(str(script), run_name="__main__")
        drawn = {file.name for file in tmp_path.glob("*.stl")}
        assert drawn == {file.name for file in CAD.glob("*.stl")} and len(drawn) == 5
        for name in drawn:
            one, other = (TriangleMesh.load(folder / name) for folder in (tmp_path, CAD))
            assert one.volume == pytest.approx(other.volume, rel=1e-6)
            np.testing.assert_allclose(one.bounds, other.bounds, atol=1e-6)

"""The light ledger: it closes, and its lines are those that can be calculated."""

from __future__ import annotations

import json

import numpy as np
import pytest
from test_housing import SHARE, sphere
from typer.testing import CliRunner

import optisense as ots
from optisense.cli import app
from optisense.design.materials import Absorber, Dielectric
from optisense.errors import DesignError, RenderError
from optisense.optics import OpticalModel, camera_light
from optisense.optics.camera.projection import RayCamera
from optisense.optics.ledger import (
    FACETS,
    GIVEN_UP,
    SEEN,
    UNSEEN,
    LightLedger,
    light_ledger,
)
from optisense.optics.light_at_camera import projected_solid_angles
from optisense.sensors import SENSORS as BUILT_IN

PHOTONS = 60_000

CLOSES = 1e-5
"""The sum of a group is 1 up to the rounding of single precision."""

SENSORS = tuple(BUILT_IN.names())


def ledger_of(design: ots.SensorDesign, photons: int = PHOTONS) -> LightLedger:
    return light_ledger(OpticalModel(design), photons)


@pytest.mark.parametrize("name", SENSORS)
def test_it_closes_on_every_sensor(name: str) -> None:
    design = ots.load(name)
    found = ledger_of(design)
    assert list(found.emitted) == list(design.lights)
    for group, light in design.lights.items():
        assert found.emitted[group] == pytest.approx(light.flux * len(light.lights))
        assert found.closing_sum(group) == pytest.approx(1.0, abs=CLOSES)
        assert all(entry.power >= -CLOSES for entry in found.entries)
        assert found.share(group, SEEN) + found.share(group, UNSEEN) > 0.05
        assert found.share(group, GIVEN_UP) < 0.001


def test_what_escapes_is_divided_by_the_faces_of_each_part() -> None:
    """Most of the light of a row of lamps leaves the guide by the face that they shine at."""
    design = ots.load("gelsight-mini-ideal")
    found = ledger_of(design)
    for group in found.emitted:
        for part in ("guide", "tray", "gel"):
            shares = [e.share for e in found.exits if (e.group, e.part) == (group, part)]
            assert len(shares) == len(set(shares)) <= 6
            assert sum(shares) == pytest.approx(found.share(group, f"escaped from {part}"))
    faces = found.faces(0.05)
    assert all(max(shares) >= 0.05 for shares in faces.values()) and len(faces) < 15
    mean_way = {
        name: np.mean([light.direction for light in group.lights], axis=0)
        for name, group in design.lights.items()
    }
    for number, (group, way) in enumerate(mean_way.items()):
        most = max(faces, key=lambda face: faces[face][number])
        axis = int(np.abs(way).argmax())
        assert most == f"guide, {'+' if way[axis] > 0 else '-'}{'xyz'[axis]}", group


def test_frosted_faces_tell_what_escapes_through_them() -> None:
    faces = {"edge": {"direction": (1, 0, 0), "within": 10, "roughness": 0.3}}
    found = ledger_of(ots.set_value(ots.load("gelsight-mini-ideal"), "parts.guide.faces", faces))
    assert found.faces()["guide.edge, +x"][1] > 0.2
    assert "guide, +x" not in found.faces()


def test_a_white_sphere_shares_its_light_as_the_formula_says() -> None:
    """The port takes r f / (1 - r (1 - f)), and the wall the rest."""
    reflectance = 0.9
    found = ledger_of(sphere(reflectance), 60_000)
    port = reflectance * SHARE / (1 - reflectance * (1 - SHARE))
    taken = found.share("white", SEEN) + found.share("white", UNSEEN)
    assert taken == pytest.approx(port, rel=0.01)
    assert found.share("white", "absorbed by housing") == pytest.approx(1 - port, rel=0.01)


def test_noise_is_the_spread_of_other_seeds() -> None:
    model, where = OpticalModel(sphere(0.8)), "absorbed by housing"
    runs = [light_ledger(model, 5_000, seed) for seed in range(10)]
    shares = np.array([run.share("white", where) for run in runs])
    stated = np.mean([e.noise for run in runs for e in run.entries if e.where == where])
    assert 0.6 * stated < shares.std(ddof=1) < 1.6 * stated


def test_each_medium_has_its_line() -> None:
    design = ots.load("gelsight-mini-ideal")
    design.materials["acrylic"] = Dielectric(ior=1.491, absorption=(0.02, 0.02, 0.02))
    design.materials["silicone-xp565"] = Dielectric(ior=1.41, absorption=(0.05, 0.05, 0.05))
    found, clear = ledger_of(design), ledger_of(ots.load("gelsight-mini-ideal"))
    for group in found.emitted:
        lines = {w: found.share(group, w) for w in found.places() if w.startswith("absorbed in")}
        assert set(lines) == {"absorbed in gel", "absorbed in guide and tray"}
        assert lines["absorbed in gel"] > 0.01 and max(lines.values()) < 0.5
        assert found.share(group, SEEN) < clear.share(group, SEEN)
        assert found.closing_sum(group) == pytest.approx(1.0, abs=CLOSES)


def test_parts_without_a_border_between_them_have_one_line() -> None:
    """Guide and tray touch. The sum of their lines is the same if their media differ slightly."""

    def absorbed(tray: tuple[float, float, float]) -> LightLedger:
        design = ots.load("gelsight-mini-ideal")
        design.materials["acrylic"] = Dielectric(ior=1.491, absorption=(0.03, 0.03, 0.03))
        design.materials["other"] = Dielectric(ior=1.491, absorption=tray)
        design.parts["tray"].material = "other"
        return ledger_of(design)

    alike, apart = absorbed((0.03, 0.03, 0.03)), absorbed((0.0301, 0.0301, 0.0301))
    for group in alike.emitted:
        shares = [apart.share(group, f"absorbed in {part}") for part in ("guide", "tray")]
        assert min(shares) > 0.02
        together = alike.share(group, "absorbed in guide and tray")
        assert together == pytest.approx(sum(shares), rel=0.02)
        assert alike.share(group, "absorbed in guide") == 0.0


def test_a_beam_through_an_absorbing_block_is_booked_by_beer_lambert() -> None:
    """A lamp in air, a gel on a black skin: what the gel takes, and what its face sends back. Then
    the gel surrounds the lamp and reaches through the black wall, 10 mm below.
    """
    design = sphere(None)
    data = design.model_dump(mode="json")
    data["materials"]["gel"] = {"kind": "dielectric", "ior": 1.5, "absorption": [0.1] * 3}
    data["parts"]["gel"] = {"role": "elastomer", "mesh": "meshes/gel.obj", "material": "gel"}
    data["lights"]["white"]["emitter"] = {"kind": "spot", "beam": 0.1, "cutoff": 0.2}
    made = ots.SensorDesign.model_validate(data)
    made.meshes.update(design.meshes)
    made.meshes["gel"] = ots.geometry.TriangleMesh.box((-3, -3, -6), (3, 3, -2))
    found = ledger_of(made)
    reflected, left = 0.04, np.exp(-0.1 * 4.0)
    once = (1 - reflected) * (1 - left) / (1 - reflected * left)
    assert found.share("white", "absorbed in gel") == pytest.approx(once, rel=0.01)
    made.meshes["gel"] = ots.geometry.TriangleMesh.box((-3, -3, -12), (3, 3, 2))
    cast = ledger_of(made)
    assert cast.share("white", "absorbed in gel") == pytest.approx(1 - np.exp(-0.1 * 10), rel=0.01)
    assert cast.share("white", "absorbed by housing") == pytest.approx(np.exp(-0.1 * 10), rel=0.01)


def test_rough_faces_and_paint_have_their_lines() -> None:
    right, far = ({"direction": way, "within": 10} for way in ((1, 0, 0), (0, 1, 0)))
    design = ots.load("gelsight-mini-ideal")
    design.materials["black"] = Absorber()
    faces = {"edge": {**right, "paint": "black"}, "end": {**far, "roughness": 0.4}}
    found = ledger_of(ots.set_value(design, "parts.guide.faces", faces))
    assert found.share("blue", "absorbed by guide.edge") > 0.02
    assert 0.0 < found.share("red", FACETS) < 0.2


def test_the_command_prints_a_table_that_closes_and_writes_json(tmp_path) -> None:  # type: ignore[no-untyped-def]
    out = tmp_path / "ledger"
    done = CliRunner().invoke(
        app, ["ledger", "gelsight-mini-ideal", "--photons", "20000", "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    sums = next(line for line in done.output.splitlines() if line.startswith("sum"))
    assert sums.split()[1:] == ["100.00"] * 3
    data = json.loads((out / "ledger.json").read_text())
    assert sum(e["share"] for e in data["entries"]) == pytest.approx(3.0, abs=1e-4)


def test_too_few_photons_are_refused() -> None:
    with pytest.raises(RenderError, match="too few"):
        ledger_of(ots.load("gelsight-mini-ideal"), 10)


def test_a_ledger_takes_levels_of_photons_and_no_design() -> None:
    design = ots.load("gelsight-mini-ideal")
    model = OpticalModel(design)
    assert light_ledger(model, "draft").photons == 60_000
    assert type(light_ledger(model, np.int64(PHOTONS)).photons) is int
    with pytest.raises(RenderError, match="quick"):
        light_ledger(model, "quick")
    for wrong in (light_ledger, camera_light):
        with pytest.raises(DesignError, match="an optical model is needed"):
            wrong(design)  # type: ignore[arg-type]


def test_a_design_whose_lights_are_off_has_an_empty_ledger(tmp_path) -> None:  # type: ignore[no-untyped-def]
    design = ots.load("gelsight-mini-ideal")
    for group in design.lights:
        design = ots.set_value(design, f"lights.{group}.flux", 0.0)
    ots.save_design(design, tmp_path / "dark")
    out = tmp_path / "out"
    few = ["--photons", "3000", "--out", str(out)]
    done = CliRunner().invoke(app, ["ledger", str(tmp_path / "dark"), *few])
    assert done.exit_code == 0, done.output
    assert json.loads((out / "ledger.json").read_text())["entries"] == []
    assert "<rect" not in (out / "ledger.html").read_text(encoding="utf-8")


def test_the_lens_gets_the_light_of_the_picture() -> None:
    """A square view of 90 degrees has the form factor of a plate over its middle, times pi."""
    square = RayCamera((0, 0, 0), (0, 0, 1), (0, 1, 0), 90.0, 40, 40)
    angles = projected_solid_angles(square)
    closed = 4 / np.pi * np.sqrt(0.5) * np.arctan(np.sqrt(0.5)) * np.pi
    assert angles.sum() == pytest.approx(closed, rel=3e-4)
    middle = projected_solid_angles(RayCamera((0, 0, 0), (0, 0, 1), (0, 1, 0), 90.0, 41, 41))
    assert middle[20, 20] == pytest.approx((2 / 41) ** 2, rel=2e-3)

    design = ots.load("gelsight-mini-ideal")
    design = ots.set_value(
        design,
        "camera.blur",
        {"kind": "defocus", "focal_length": 3.0, "f_number": 2.0, "focus_distance": 20.0},
    )
    found = camera_light(OpticalModel(design), 100_000)
    image = OpticalModel(design).render((), (64, 48), 100_000)
    view = projected_solid_angles(OpticalModel(design).camera((64, 48)))
    assert found.pupil == pytest.approx(np.pi / 4 * 1.5**2)
    for group, layer in image.layers.items():
        mean = (layer.mean(axis=(0, 1)) * view.sum()).sum()
        assert found.irradiance[group] == pytest.approx(mean, rel=0.15)
        assert found.power(group) == pytest.approx(found.irradiance[group] * found.pupil)

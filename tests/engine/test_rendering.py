"""Images by the real renderer: drafts, other lights, cancelling, contacts and rays."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparing import TURNED_BESIDE_CONTACT, same_light

from optisense import sensors
from optisense.optics import OpticalModel
from optisense.report.camera_rays import CameraRays

PHOTONS = 200_000
PRESS = ["sphere:1.5@0,0:0.6"]
SMALL = {"contacts": PRESS, "resolution": [80, 60], "photons": PHOTONS}
FILES = ["picture", "pixels", "radiance", "layers", "normals", "points", "mask"]


@pytest.fixture(scope="module")
def first(engine: Any) -> dict[str, Any]:
    """A Mini pressed by a ball, with all its files."""
    return engine.ask("simulate", design="gelsight-mini-ideal", name="first", files=FILES, **SMALL)


def load(path: str) -> Any:
    return np.load(path)


def test_an_image_with_all_its_files(engine: Any, first: dict[str, Any]) -> None:
    assert first["size"] == [80, 60]
    files = first["files"]
    assert set(files) == set(FILES)
    assert Path(files["picture"]).read_bytes().startswith(b"\x89PNG")
    radiance = load(files["radiance"])
    layers = [load(path) for path in files["layers"].values()]
    assert set(files["layers"]) == {"red", "green", "blue"}
    np.testing.assert_allclose(radiance, np.sum(layers, axis=0), rtol=1e-5)
    mask = load(files["mask"])
    assert 0 < mask.sum() < mask.size / 4
    # The ball's lowest point lies as deep as it was pressed; the gel's surface is at z = 0.
    assert load(files["points"])[mask.astype(bool)][:, 2].min() == pytest.approx(-0.6, abs=0.03)


def test_pixels_are_the_picture_as_blender_takes_it(first: dict[str, Any]) -> None:
    from PIL import Image

    picture = np.asarray(Image.open(first["files"]["picture"]).convert("RGB"))
    pixels = load(first["files"]["pixels"])
    assert pixels.shape == (60, 80, 4) and pixels.dtype == np.float32
    np.testing.assert_allclose(pixels[::-1, :, :3] * 255.0, picture, atol=1e-3)
    assert (pixels[..., 3] == 1.0).all()


def test_relighting_equals_rendering_anew(engine: Any, first: dict[str, Any]) -> None:
    lights = {"red": {"flux": 0.0}, "blue": {"flux": 4.0, "colour": [1.0, 0.5, 0.0]}}
    relit = engine.ask("relight", image="first", lights=lights, files=["radiance"])
    values = {"lights.red.flux": 0.0, "lights.blue.flux": 4.0, "lights.blue.colour": [1, 0.5, 0]}
    design = {"from": "gelsight-mini-ideal", "set": values}
    again = engine.ask("simulate", design=design, files=["radiance"], **SMALL)
    one, other = load(relit["files"]["radiance"]), load(again["files"]["radiance"])
    assert same_light(one, other, TURNED_BESIDE_CONTACT)
    assert relit["exposure"] == first["exposure"]
    assert engine.refused("relight", image="first", lights={"rde": {}})["hint"]
    assert engine.refused("relight", image="never")["where"] == "image"


def test_a_page_of_an_image(engine: Any, first: dict[str, Any], tmp_path: Path) -> None:
    page = engine.ask("report", image=first["image"], file=str(tmp_path / "page.html"))["file"]
    text = Path(page).read_text(encoding="utf-8")
    assert "gelsight-mini-ideal" in text and "Where the light goes" in text
    # Its 3-D view shows the same chief rays as a page that `optisense render` writes.
    scene = re.search(r'id="scene-data">(.*?)</script>', text, re.DOTALL)
    assert scene is not None
    drawn = json.loads(scene[1])["rays"]
    rays = CameraRays.of(OpticalModel(sensors.load("gelsight-mini-ideal"))).segments()
    assert len(rays["seen"])
    for name, ends in rays.items():
        shown = np.frombuffer(base64.b64decode(drawn[name]), dtype="<f4").reshape(-1, 3)
        np.testing.assert_allclose(shown, ends, atol=1e-4)


def test_where_light_goes_and_why_it_is_dark_somewhere(engine: Any) -> None:
    few = {"design": "gelsight-mini-ideal", "photons": 30_000}
    found = engine.ask("ledger", at=[[-6, 4], [0, 0, 0]], **few)
    shares = [e["share"] for e in found["ledger"]["entries"] if e["group"] == "green"]
    assert sum(shares) == pytest.approx(1.0, abs=1e-5)
    corner, middle = found["places"]
    assert middle["point"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    brought = [place["groups"]["red"]["of_mean_in_view"] for place in (corner, middle)]
    assert brought[0] < brought[1]
    assert all(value > 0.0 for value in found["ledger"]["camera"]["irradiance"].values())
    assert "off the sensing surface" in engine.refused("ledger", at=[[60, 0]], **few)["message"]


def test_a_moved_light_changes_the_picture(engine: Any, first: dict[str, Any]) -> None:
    moved = {"from": "gelsight-mini-ideal", "set": {"lights.red.lights[0].position.x": -6.0}}
    again = engine.ask("simulate", design=moved, files=["radiance"], **SMALL)
    before, after = (load(each["files"]["radiance"]) for each in (first, again))
    assert np.abs(after - before).max() > 0.01 * before.max()


def test_the_same_request_gives_the_same_image(engine: Any, first: dict[str, Any]) -> None:
    again = engine.ask("simulate", design="gelsight-mini-ideal", files=["radiance"], **SMALL)
    one, other = (load(each["files"]["radiance"]) for each in (first, again))
    assert same_light(one, other, TURNED_BESIDE_CONTACT)


def test_a_long_render_tells_how_far_it_is_and_is_cancelled(engine: Any) -> None:
    endless = {"design": "gelsight-mini-ideal", "photons": 2_000_000_000, "resolution": [80, 60]}
    number = engine.send("simulate", **endless)
    engine.until(lambda m: m["id"] == number and m.get("photons", 0) > 0)
    quick = engine.send("methods")
    assert engine.wait(quick)["ok"], "a quick request overtakes a render"
    waiting = engine.send("simulate", **endless)
    assert engine.ask("cancel", of=waiting) == {"cancelled": True}
    assert engine.error(waiting)["kind"] == "Cancelled"
    assert engine.ask("cancel", of=number) == {"cancelled": True}
    assert engine.error(number)["kind"] == "Cancelled"
    assert engine.ask("cancel", of=number) == {"cancelled": False}
    fractions = [each["fraction"] for each in engine.events(number, "progress")]
    assert fractions == sorted(fractions) and len(fractions) > 1


def test_of_many_drafts_the_newest_is_made(engine: Any) -> None:
    path = "lights.red.lights[0].position.x"
    draft = {"draft": True, "name": "draft", "resolution": [40, 30], "photons": 30_000}
    designs = [
        {"from": "gelsight-mini-ideal", "set": {path: -8 + 0.1 * step}} for step in range(12)
    ]
    numbers = engine.send_together(
        [{"do": "simulate", "design": design, **draft} for design in designs]
    )
    answers = [engine.wait(number) for number in numbers]
    assert answers[-1]["ok"] and answers[-1]["result"]["draft"]
    replaced = [each for each in answers if not each["ok"]]
    assert replaced and {each["error"]["kind"] for each in replaced} == {"Replaced"}
    assert engine.ask("relight", image="draft", lights={"red": {"flux": 1.0}})


def test_a_draft_is_small_by_itself(engine: Any) -> None:
    draft = engine.ask("simulate", design="gelsight-mini-ideal", draft=True)
    assert draft["size"] == [160, 120]
    assert draft["settings"]["photons"] < 100_000


def test_a_contact_that_is_clicked_is_placed(engine: Any) -> None:
    clicked = {
        "indenter": {"kind": "sphere", "radius": 1.5},
        "point": [1.2, 0.4, 0.1],
        "depth": 0.6,
    }
    (placed,) = engine.ask("place", design="gelsight-mini-ideal", contacts=[clicked])["contacts"]
    np.testing.assert_allclose(placed["point"], [1.2, 0.4, 0.0], atol=1e-6)
    np.testing.assert_allclose(placed["inward"], [0.0, 0.0, -1.0], atol=1e-6)
    vertices = load(placed["mesh"]["vertices"])
    middle = np.array([1.2, 0.4, 1.5 - 0.6])
    np.testing.assert_allclose(np.linalg.norm(vertices - middle, axis=1), 1.5, atol=1e-4)
    deep = engine.refused(
        "place", design="gelsight-mini-ideal", contacts=[clicked | {"depth": 40.0}]
    )
    assert deep["kind"] == "ContactError"
    far = engine.refused("place", design="gelsight-mini-ideal", contacts=["sphere:1.5@99,0:0.5"])
    assert far["kind"] == "ContactError" and far["hint"]


def test_nine_places_can_be_given_back(engine: Any) -> None:
    ball = {"kind": "sphere", "radius": 1.0}
    nine = engine.ask("nine_places", design="gelsight-mini-ideal", indenter=ball, depth=0.3)[
        "contacts"
    ]
    assert len({tuple(np.round(each["point"], 2)) for each in nine}) == 9
    assert len(engine.ask("place", design="gelsight-mini-ideal", contacts=nine)["contacts"]) == 9


def test_chief_rays_obey_snells_law_and_end_on_the_skin(engine: Any) -> None:
    opened = engine.ask("open", design="gelsight-mini-ideal")["data"]
    rays = engine.ask("chief_rays", design="gelsight-mini-ideal", resolution=[8, 6])
    vertices, counts = load(rays["files"]["vertices"]), load(rays["files"]["counts"])
    outcomes = load(rays["files"]["outcomes"])
    assert engine.ask("chief_rays", design="digit")["rays"] == 16 * 21  # its picture is 3:4
    assert rays["rays"] == 48 == len(counts) == len(outcomes)
    assert counts.sum() == len(vertices) and rays["hit"] == 1.0
    acrylic = opened["materials"]["acrylic"]["ior"]
    for line in np.split(vertices, np.cumsum(counts)[:-1]):
        np.testing.assert_allclose(line[0], opened["camera"]["position"], atol=1e-5)
        assert line[-1][2] == pytest.approx(0.0, abs=1e-4)
        before, after = line[1] - line[0], line[2] - line[1]
        sine = [np.linalg.norm(each[:2]) / np.linalg.norm(each) for each in (before, after)]
        assert sine[0] == pytest.approx(acrylic * sine[1], abs=2e-3)


def test_the_footprint_is_where_the_camera_looks(engine: Any) -> None:
    found = engine.ask("footprint", design="gelsight-mini-ideal", columns=40)
    points, hit = load(found["files"]["points"]), load(found["files"]["hit"]) > 0
    assert points.shape == (30, 40, 3) and found["size"] == [40, 30]
    assert hit.mean() == pytest.approx(found["picture"])
    np.testing.assert_allclose(points[hit][:, 2], 0.0, atol=1e-4)
    # The skin is flat and its middle is the origin: the area within the outermost rays, of all.
    low, high = points[hit].min(axis=0), points[hit].max(axis=0)
    assert (high[:2] > 1.0).all() and (low[:2] < -1.0).all()
    opened = engine.ask("open", design="gelsight-mini-ideal")
    skin = np.ptp(load(opened["meshes"]["skin"]["vertices"]), axis=0)
    seen = (high - low)[:2].prod() / skin[:2].prod()
    assert found["skin"] == pytest.approx(seen, rel=0.1)
    near = {"from": "gelsight-mini-ideal", "set": {"camera.fov": 20.0}}
    assert engine.ask("footprint", design=near)["skin"] < 0.5 * found["skin"]
    refused = engine.refused("footprint", design="gelsight-mini-ideal", columns=1)
    assert "columns" in refused["message"]


def test_scores_share_the_warm_model(engine: Any) -> None:
    number = engine.send(
        "evaluate",
        design="gelsight-mini-ideal",
        objectives=["aoap"],
        settings={"ray_resolution": [80, 60]},
        figures=True,
    )
    (score,) = engine.result(number)["scores"]
    assert 0.0 < score["value"] <= 1.0 and score["failure"] is None
    assert Path(score["figure"]).read_bytes().startswith(b"\x89PNG")
    assert engine.events(number, "score")[0]["score"] == score
    assert {"rgb2normal", "normdiff", "aoap", "2to3pw"} <= {
        row["name"] for row in engine.ask("objectives")["objectives"]
    }
    assert engine.refused("evaluate", design="gelsight-mini-ideal", objectives=["aopa"])["hint"]


def test_an_engine_that_dies_in_the_middle_is_seen(start: Callable[..., Any]) -> None:
    client = start()
    client.send("simulate", design="gelsight-mini-ideal", photons=2_000_000_000)
    client.next()
    client.process.kill()
    with pytest.raises(EOFError):
        while True:
            client.next()


def test_an_error_names_the_contact_that_it_is_about(engine: Any) -> None:
    good, deep = "sphere:1.5@0,0:0.5", "sphere:1.5@1,1:40"
    for what in ("simulate", "place", "chief_rays"):
        refused = engine.refused(what, design="gelsight-mini-ideal", contacts=[good, good, deep])
        assert refused["kind"] == "ContactError" and refused["contact"] == 2, what
        assert "mm thick" in refused["message"]
    file = {"indenter": {"kind": "mesh", "file": "/nowhere/wedge.obj"}, "depth": 0.3}
    refused = engine.refused("simulate", design="gelsight-mini-ideal", contacts=[good, file])
    assert refused["kind"] == "MeshError" and refused["contact"] == 1
    refused = engine.refused(
        "simulate", design="gelsight-mini-ideal", contacts=["sphere:0@0,0:0.5"]
    )
    assert refused["kind"] == "ContactError" and refused["contact"] == 0
    assert engine.refused("open", design="no-such-sensor")["contact"] is None


def test_a_design_with_sizes_of_another_unit_is_refused(engine: Any) -> None:
    far = {"from": "gelsight-mini-ideal", "set": {"cages.skin.points[14].x": -8471.0}}
    for what in ("warm", "simulate"):
        refused = engine.refused(what, design=far)
        assert "control point 8471" in refused["message"]
        assert refused["path"] == "cages.skin.points"


def test_contacts_that_no_pixel_sees_are_told(engine: Any) -> None:
    corner, middle = "sphere:0.5@8.3,10:0.3", "sphere:1.5@0,0:0.5"
    request = {"design": "gelsight-mini-ideal", "resolution": [80, 60], "photons": PHOTONS}
    result = engine.ask("simulate", **request, contacts=[corner, middle], files=["mask", "points"])
    mask = np.load(result["files"]["mask"]).astype(bool)
    distance = np.linalg.norm(np.load(result["files"]["points"])[mask], axis=1)
    assert mask.any() and distance.max() < 3.0  # all that is touched lies in the middle
    assert result["unseen"] == [0]


def test_markers_lie_on_the_skin(engine: Any) -> None:
    dots = {"radius": 0.4, "grid": [3, 2], "pitch": 2.0}
    marked = {"from": "gelsight-mini-ideal", "set": {"markers": dots}}
    found = engine.ask("markers", design=marked)
    points = np.load(found["files"]["points"])
    assert found["count"] == len(points) == 6 and found["radius"] == 0.4
    np.testing.assert_allclose(points[:, 2], 0.0, atol=1e-5)
    assert engine.ask("markers", design="gelsight-mini-ideal")["count"] == 0

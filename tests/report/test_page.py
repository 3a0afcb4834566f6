"""The page shows the render, and no text of a design is interpreted as HTML."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from optisense.design import Provenance
from optisense.design.responses.chain import SoftFocus
from optisense.errors import OutputError
from optisense.geometry import Contact, Sphere
from optisense.optics import OpticalModel, TactileImage
from optisense.report import write_report
from optisense.report._page import contact_rows, render_page
from optisense.report._pictures import data_uri
from optisense.sensors import gelsight_mini_ideal

BALL = Contact(Sphere(radius=1.5), at=(0.0, 0.0), depth=0.8)
EVIL = "</script><img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def image() -> TactileImage:
    model = OpticalModel(gelsight_mini_ideal())
    return model.render([BALL], resolution=(32, 24), photons=20_000)


def test_settings_lights_contacts_and_sources_are_on_the_page(image: TactileImage) -> None:
    design = gelsight_mini_ideal()
    page = render_page(design, image, [BALL])
    for words in (
        "32 × 24",
        f"{image.settings['photons']:,}",
        "sphere, radius 1.5 mm",
        "0, 0 mm on the surface",
        "0.8 mm",
        f"{image.settings['presses'][0]['greatest_pressure_mpa']:.3f} MPa",
        f"white is {image.skin_maps().pressure.max():.3f} MPa",
        *(f"{name} lights alone" for name in design.lights),
        *(path for path, entry in design.provenance.items() if entry.status == "assumed"),
    ):
        assert words in page, words


def test_the_scene_data_is_json(image: TactileImage) -> None:
    page = render_page(gelsight_mini_ideal(), image, [BALL])
    found = re.search(r'<script type="application/json" id="scene-data">(.*?)</script>', page)
    assert found
    drawn = [part["name"] for part in json.loads(found[1])["parts"]]
    assert drawn == [*gelsight_mini_ideal().parts, "sphere 1"]


def test_single_lights_are_as_soft_as_the_picture(image: TactileImage) -> None:
    """With one group of lights, its picture is that of all lights, sharp or not."""
    soft = replace(image.chain, focus=SoftFocus(np.full((1, 1), 0.1)))
    counts = []
    for chain in (image.chain, soft):
        alone = replace(image, layers={"red": image.layers["red"]}, chain=chain)
        page = render_page(gelsight_mini_ideal(), alone)
        counts.append(page.count(data_uri(alone.picture())))
    assert counts[0] == counts[1] >= 2


def test_texts_of_a_design_stay_texts(image: TactileImage) -> None:
    design = gelsight_mini_ideal().copy()
    design.name = design.description = EVIL
    design.provenance["camera.fov"] = Provenance(status="assumed", source=EVIL)
    design.camera.model = "pi-v2"
    page = render_page(design, image, [BALL])
    assert "<img src=x" not in page
    assert page.count("</script>") == 4  # the page's own: data of two kinds and two scripts


def test_an_interrupted_render_is_told(image: TactileImage) -> None:
    assert "was interrupted" not in render_page(gelsight_mini_ideal(), image)
    stopped = TactileImage(
        image.layers, image.normals, image.contact_mask, image.points, dict(image.settings), True
    )
    assert "was interrupted" in render_page(gelsight_mini_ideal(), stopped)


def test_a_render_without_contacts_says_so(image: TactileImage) -> None:
    assert "Nothing touches the sensor" in render_page(gelsight_mini_ideal(), image)


def test_the_file_is_written_whole_or_not_at_all(image: TactileImage, tmp_path: Path) -> None:
    path = write_report(tmp_path / "report.html", gelsight_mini_ideal(), image, [BALL])
    assert path.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(OutputError, match="can't be written"):
        write_report(path / "report.html", gelsight_mini_ideal(), image, [BALL])


def test_contacts_tell_depth_force_and_area() -> None:
    pushed = Contact(Sphere(radius=3.0), at=(0.0, 0.0), force=2.0)
    (alone,) = contact_rows([pushed])
    assert (alone["depth"], alone["force"], alone["area"]) == ("", "2 N", "")
    known = {"depth_mm": 0.9467, "force_n": 2.0004, "area_mm2": 10.74}
    known |= {"greatest_pressure_mpa": 0.2714}
    (row,) = contact_rows([pushed], [known])
    assert row["pressure"] == "0.271 MPa"
    assert (row["depth"], row["force"], row["area"]) == ("0.95 mm", "2.00 N", "10.7 mm²")
    (flat,) = contact_rows([BALL])
    assert (flat["depth"], flat["force"]) == ("0.8 mm", "")

"""Where the light goes, as a page shows it: the bars are the ledger's, and so are the ways."""

from __future__ import annotations

import base64
import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.cli import app
from optisense.optics import OpticalModel, light_at
from optisense.report._page import render_page
from optisense.report.light_section import LEAST_DRAWN, OTHER, LightSection, ledger_page

EVIL = "</script><img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def section() -> LightSection:
    return LightSection.of(OpticalModel(ots.load("gelsight-mini-ideal")), 20_000)


def scene_of(page: str) -> dict[str, object]:
    found = re.search(r'<script type="application/json" id="scene-data">(.*?)</script>', page)
    assert found
    data: dict[str, object] = json.loads(found[1])
    return data


def test_each_bar_is_full_and_has_the_shares_of_the_ledger(section: LightSection) -> None:
    bars = section.values(ots.load("gelsight-mini-ideal"))["bars"]
    assert [bar["name"] for bar in bars] == list(section.ledger.emitted)
    for bar in bars:
        ends = 0.0
        for piece in bar["pieces"]:
            assert float(piece["x"].rstrip("%")) == pytest.approx(ends, abs=2e-3)
            width = float(piece["width"].rstrip("%"))
            if piece["where"] != OTHER:
                share = section.ledger.share(bar["name"], piece["where"])
                assert width == pytest.approx(100 * share, abs=1e-3)
            ends += width
        assert ends == pytest.approx(100.0, abs=0.02)


def test_places_have_colours_of_their_own_and_small_ones_share_one(section: LightSection) -> None:
    colours = section.colours
    assert len(set(colours.values())) == len(colours) >= 6
    for where in section.ledger.places():
        most = max(section.ledger.share(group, where) for group in section.ledger.emitted)
        assert (where in colours) == (most >= LEAST_DRAWN)


def test_ways_are_the_segments_of_all_photons_by_place_and_group(section: LightSection) -> None:
    ways = {way["label"]: way for way in section.ways()}
    for group, paths in section.paths.items():
        assert len(paths) == 100
        counted = Counter(path.where if path.where in section.colours else OTHER for path in paths)
        assert {where for where, way in ways.items() if group in way["groups"]} == set(counted)
        for where in counted:
            assert ways[where]["photons"][group] == counted[where]
            ends = np.frombuffer(base64.b64decode(ways[where]["groups"][group]), "<f4")
            own = [p for p in paths if (p.where if p.where in section.colours else OTHER) == where]
            assert len(ends) == 6 * sum(len(path.points) - 1 for path in own)
            assert ends[:3] == pytest.approx(own[0].points[0])


def test_the_report_of_a_render_has_the_section_if_it_is_given(section: LightSection) -> None:
    design = ots.load("gelsight-mini-ideal")
    image = OpticalModel(design).render((), resolution=(32, 24), photons=20_000)
    page = render_page(design, image, light=section)
    for words in ("Where the light goes", *section.colours, *design.lights, "data-ways"):
        assert words in page, words
    assert page.count('<svg class="shares"') == len(design.lights)
    assert len(scene_of(page)["ways"]) == len(section.ways())  # type: ignore[arg-type]
    without = render_page(design, image)
    assert "Where the light goes" not in without and scene_of(without)["ways"] == []


def test_texts_of_a_design_stay_texts(section: LightSection) -> None:
    design = ots.load("gelsight-mini-ideal").copy()
    design.name = design.description = EVIL
    page = ledger_page(design, section)
    assert "<img src=x" not in page
    assert page.count("</script>") == 2  # the page's own: data and one script


def test_the_page_asks_the_network_for_nothing(section: LightSection) -> None:
    page = ledger_page(ots.load("gelsight-mini-ideal"), section)
    assert not re.search(r'(src|href)\s*=\s*"(?!data:)', page)
    assert "default-src 'none'" in page


def test_directions_are_told_for_light_and_dark_pages(section: LightSection) -> None:
    """Sectors have the colour of the text, which is bright in dark mode."""
    design = ots.load("gelsight-mini-ideal")
    place = light_at(OpticalModel(design), (0.0, 0.0), 20_000)
    page = ledger_page(design, replace(section, places=(place,)))
    assert "the more a sector stands out from the background" in page
    assert "dark sectors" not in page


def test_the_command_writes_the_section(tmp_path: Path) -> None:
    few = ["--photons", "20000", "--at", "-1,2", "--out", str(tmp_path)]
    done = CliRunner().invoke(app, ["ledger", "gelsight-svelte", *few])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "ledger.html").read_text(encoding="utf-8")
    data = json.loads((tmp_path / "ledger.json").read_text())
    assert "absorbed by body" in page
    assert {"absorbed by a part"} == {
        entry["kind"] for entry in data["entries"] if entry["where"] == "absorbed by body"
    }
    assert "light at (-1, 2) mm" in done.output

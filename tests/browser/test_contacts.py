"""The page of contacts: circles are dragged, and the saved table is read again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from optisense.calibration import PhotographedPress, Photographs, read_photographs, save_photographs
from optisense.calibration.seen_contacts import SeenContact
from optisense.report.comparison import write_contacts

from .conftest import Open


@pytest.fixture
def photographs() -> Photographs:
    """Two presses, of 640 x 480 pixels."""
    grey = np.full((480, 640, 3), 128, dtype=np.uint8)
    presses = [PhotographedPress(name, grey, 6.0) for name in ("a.png", 'b", c.png')]
    return Photographs(grey, tuple(presses))


def test_a_circle_is_dragged_and_its_edge_too(
    visit: Open, photographs: Photographs, tmp_path: Path
) -> None:
    small = photographs.scaled(320)
    page = tmp_path / "contacts.html"
    found = [SeenContact((100.0, 80.0), 20.0), None]
    write_contacts(page, "photos", small, found, ["</script>doubtful"])
    window = visit(page)
    card = window.page.locator(".press").first
    box = card.locator("svg").bounding_box()
    assert box is not None
    pixel = box["width"] / 640.0  # on the screen, for one of the photograph

    def drag(one: tuple[float, float], other: tuple[float, float]) -> None:
        mouse = window.page.mouse
        mouse.move(box["x"] + pixel * one[0], box["y"] + pixel * one[1])
        mouse.down()
        mouse.move(box["x"] + pixel * other[0], box["y"] + pixel * other[1], steps=3)
        mouse.up()

    drag((195.0, 165.0), (295.0, 265.0))  # inside the circle: it moves along, by 100 pixels each
    drag((340.0, 260.0), (360.0, 260.0))  # its grip, at the right
    second = window.page.locator(".press").nth(1)
    assert not second.locator(".used").is_checked()
    with window.page.expect_download() as download:
        window.page.click("#save")
    named = [replace(p, name=name) for p, name in zip(photographs.presses, "ab", strict=True)]
    named = [replace(p, name=f"{p.name}.png") for p in named]
    save_photographs(tmp_path / "photos", replace(photographs, presses=tuple(named)))
    download.value.save_as(tmp_path / "photos" / "presses.csv")
    press, *others = read_photographs(tmp_path / "photos").presses
    assert others == []
    assert press.centre == pytest.approx((300.0, 260.0), abs=1.5)
    assert press.radius == pytest.approx(60.0, abs=1.5)
    second.locator(".used").check()
    second.locator("input[name=radius]").fill("33")
    with window.page.expect_download() as download:
        window.page.click("#save")
    text = Path(download.value.path()).read_text("utf-8")
    assert text.splitlines()[2] == '"b"", c.png",6,320.00,240.00,33.00'

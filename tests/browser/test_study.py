"""The page of a study is interactive: it shows the numbers of the trial under the pointer."""

from __future__ import annotations

import http.client
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from warm_python import programs

import optisense as ots
from optisense.design import SensorDesign
from optisense.report.study import write_study_report
from optisense.search import SearchResult, search

from .conftest import Open
from .visit import TELEPHONE, Visit

SPACE: dict[str, object] = {
    "coating.reflectance.r": (0.2, 1.0),
    "coating.reflectance.g": (0.2, 0.9),
}
EVIL = "</script><img src=x onerror='window.ran = 1'>"


def red(design: SensorDesign) -> float:
    if design.coating.reflectance[0] > 0.9:
        raise ValueError(EVIL)
    return design.coating.reflectance[0] + 0.1 * design.coating.reflectance[1]


@pytest.fixture(scope="module")
def result() -> SearchResult:
    return search(ots.load("gelsight-mini-ideal"), SPACE, [red], method="random", budget=25, seed=2)


@pytest.fixture(scope="module")
def page(result: SearchResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    pictures = {result.best.number: np.full((6, 8, 3), (10, 200, 30), dtype=np.uint8)}
    path = tmp_path_factory.mktemp("study") / "study.html"
    return write_study_report(path, result.study, pictures=pictures, named="my study")


def point_at(window: Visit, figure: str, number: int) -> tuple[float, float]:
    """Where a figure shows a trial, in pixels of the window; the mouse goes there."""
    shown = window.page.locator(f'[data-figure="{figure}"]').first
    shown.scroll_into_view_if_needed()
    data = window.page.evaluate(
        "() => JSON.parse(document.getElementById('study-data').textContent)"
    )
    x, y = next((x, y) for trial, x, y in data["figures"][figure] if trial == number)
    box = shown.bounding_box()
    assert box
    place = box["x"] + x * box["width"], box["y"] + y * box["height"]
    window.page.mouse.move(*place)
    return place


def test_a_trial_tells_its_numbers_under_the_pointer(
    visit: Open, result: SearchResult, page: Path
) -> None:
    window = visit(page)
    for trial in result.trials[1:8]:
        point_at(window, "convergence", trial.number)
        told = window.page.locator("#tip").inner_text()
        score = f"{trial.scores['red']:.4g}" if trial.failure is None else "failed"
        assert told.splitlines()[:2] == [f"trial {trial.number}", f"red: {score}"]
        assert f"coating.reflectance.r = {trial.values['coating.reflectance.r']:.5g}" in told
    window.page.mouse.move(2, 2)
    assert window.page.locator("#tip").is_hidden()


def test_the_ring_is_where_the_figure_has_a_dot(
    visit: Open, result: SearchResult, page: Path
) -> None:
    """The places that the page knows are those of the picture: there is ink under each of them."""
    window = visit(page, (1400, 900))
    for figure in ("convergence", "parameters red"):
        shown = window.page.locator(f'[data-figure="{figure}"]').first
        picture = window.pixels(shown)
        data = window.page.evaluate(
            "() => JSON.parse(document.getElementById('study-data').textContent)"
        )
        places = data["figures"][figure]
        assert len(places) >= len(result.trials) - 1
        for number, x, y in places:
            row, column = round(y * picture.shape[0]), round(x * picture.shape[1])
            spot = picture[row - 2 : row + 3, column - 2 : column + 3]
            assert np.ptp(spot, axis=2).max() > 40, (figure, number)  # a colour, on white


def test_a_click_shows_the_picture_and_the_command(
    visit: Open, result: SearchResult, page: Path
) -> None:
    window = visit(page)
    best, other = result.best.number, next(t.number for t in result.trials[1:] if t.failure)
    window.page.mouse.click(*point_at(window, "convergence", best))
    panel = window.page.locator("#trial")
    assert panel.locator("h2").inner_text() == f"trial {best}"
    command = panel.locator("code").inner_text()
    assert command == f"optisense apply 'my study' --trial {best} --out trial-{best}"
    assert panel.locator("img").evaluate("(image) => image.decode().then(() => image.naturalWidth)")
    window.page.keyboard.press("Escape")
    assert panel.is_hidden()
    window.page.mouse.click(*point_at(window, "convergence", other))
    assert EVIL in panel.inner_text()
    assert panel.locator("img").count() == 0
    assert window.page.evaluate("() => window.ran") is None
    panel.get_by_role("button", name="Close").click()
    assert panel.is_hidden()


def test_trials_are_chosen_by_keys(visit: Open, result: SearchResult, page: Path) -> None:
    window = visit(page)
    figure = window.page.locator('[data-figure="convergence"]')
    figure.focus()
    for _ in range(3):
        window.page.keyboard.press("ArrowRight")
    assert window.page.locator("#tip").inner_text().startswith("trial 3\n")
    window.page.keyboard.press("ArrowLeft")
    window.page.keyboard.press("Enter")
    assert window.page.locator("#trial h2").inner_text() == "trial 2"
    window.page.keyboard.press("Escape")
    assert figure.evaluate("(each) => each === document.activeElement")


def test_the_panel_fits_a_telephone(visit: Open, result: SearchResult, page: Path) -> None:
    window = visit(page, TELEPHONE, has_touch=True)
    place = point_at(window, "convergence", 1)
    window.page.touchscreen.tap(*place)
    box = window.page.locator("#trial").bounding_box()
    assert box and box["x"] >= 0 and box["x"] + box["width"] <= TELEPHONE[0]
    assert not window.is_scrolled_sideways()


class Running:
    """Search that continues when the test allows it."""

    def __init__(self, folder: Path) -> None:
        self.may = threading.Semaphore(0)
        self.stop = False
        mini = ots.load("gelsight-mini-ideal")
        self._thread = threading.Thread(
            target=lambda: search(
                mini, SPACE, [self.waiting], method="random", budget=40, seed=1, out=folder
            )
        )
        self._thread.start()

    def waiting(self, design: SensorDesign) -> float:
        if not self.stop:
            self.may.acquire()
        return design.coating.reflectance[0]

    def end(self) -> None:
        self.stop = True
        for _ in range(50):
            self.may.release()
        self._thread.join()


@pytest.fixture(scope="module")
def running(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[Running, str, Path]]:
    """A search, the address at which the command shows it, and its folder.

    It goes on until a test ends it; it is watched for all tests.
    """
    folder = tmp_path_factory.mktemp("watched") / "study"
    begun = Running(folder)
    try:
        for _ in range(4):
            begun.may.release()
        while not (folder / "study.json").is_file():
            threading.Event().wait(0.05)
        command = [programs() / "optisense", "report", folder, "--watch"]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as process:
            assert process.stdout
            try:
                yield begun, process.stdout.readline().removeprefix("watching: ").strip(), folder
            finally:
                process.terminate()
    finally:
        begun.end()


def test_a_watched_study_refreshes_itself_and_shows_any_trial(
    visit: Open, running: tuple[Running, str, Path]
) -> None:
    begun, address, folder = running
    own = ("version", "trial/2.png", "")
    window = visit(address, allowed=[address + each for each in own])
    header = window.page.locator(".facts")
    before = {path.name for path in folder.iterdir()}
    for _ in range(7):
        begun.may.release()
    header.get_by_text("10 of 40").wait_for()
    figure = window.page.locator('[data-figure="convergence"]')
    figure.focus()
    for _ in range(2):
        window.page.keyboard.press("ArrowRight")
    window.page.keyboard.press("Enter")
    picture = window.page.locator("#trial img")
    assert picture.evaluate("(image) => image.decode().then(() => image.naturalWidth)") == 240
    begun.end()
    header.get_by_text("40 of 40").wait_for()
    assert window.page.locator("#trial h2").inner_text() == "trial 2"  # it stays open
    assert {path.name for path in folder.iterdir()} <= before  # the page is written nowhere
    window.close()


def test_only_this_machine_is_answered(running: tuple[Running, str, Path]) -> None:
    address = urlsplit(running[1])
    assert address.hostname == "127.0.0.1" and address.port

    def status(path: str, host: str) -> int:
        asking = http.client.HTTPConnection("127.0.0.1", address.port)
        try:
            asking.request("GET", path, headers={"Host": host})
            return asking.getresponse().status
        finally:
            asking.close()

    own = f"127.0.0.1:{address.port}"
    assert status("/", own) == 200
    assert status("/", f"localhost:{address.port}") == 200
    assert status("/", f"evil.example:{address.port}") == 403  # a name that leads here
    assert status("/study.json", own) == status("/../study.json", own) == 404
    assert status("/trial/999999.png", own) == 404

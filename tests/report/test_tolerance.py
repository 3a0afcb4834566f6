"""The page and the command of a tolerance say what the numbers say."""

from __future__ import annotations

import csv
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.cli import app
from optisense.cli.tolerance import print_tolerance
from optisense.design import SensorDesign, set_value
from optisense.report.tolerance import P10_INTERVAL, render_tolerance, shown_size, spread_figure
from optisense.search import ToleranceDistribution
from optisense.search.tolerance.analysis import Tolerance, tolerance
from optisense.search.tolerance.sensitivity import Estimate

EVIL = "</table><img src=x onerror=alert(1)>"
QUICK = ["--objective", "aoap", "--resolution", "40x30"]


def score(design: SensorDesign) -> float:
    red, green, _ = design.coating.reflectance
    if red > 0.59:
        raise ValueError(EVIL)
    return red + 0.1 * green


@pytest.fixture(scope="module")
def found() -> Tolerance:
    grey = set_value(ots.load("gelsight-mini-ideal"), "coating.reflectance", (0.5, 0.5, 0.5))
    errors = {
        "coating.reflectance.r": ToleranceDistribution(0.1, "uniform"),
        "coating.reflectance.g": ToleranceDistribution(0.02),
    }
    return tolerance(grey, score, errors, sensors=150)


def test_percentiles_and_shares_are_on_the_page(found: Tolerance) -> None:
    page = render_tolerance(found)
    spread = found.results["score"]
    for key in ("p50", "p90"):
        assert f"<b>{spread.percentiles[key].value:.4g}</b>" in page
    for source, share in spread.shares.items():
        assert share is not None
        assert (
            f'<code>{source}</code></td><td class="tight"><b>{share.value:.2f}</b></td>'
            f'<td class="tight">{share.error:.2f}</td>' in page
        )
    assert "limit of a uniform distribution" in page
    assert '<span class="soft">seed</span> <b>0</b>' in page
    assert len(re.findall(r'<img [^>]*src="data:image/png', page)) == 1


def test_failures_are_told_as_text(found: Tolerance) -> None:
    page = render_tolerance(found)
    assert sum(found.failures.values()) > 0
    assert "onerror=alert(…)" in page  # a cause is told without its numbers
    assert "<img src=x" not in page


def test_an_interval_that_reaches_to_failed_sensors_says_so(found: Tolerance) -> None:
    spread = found.results["score"]
    p10 = Estimate(0.509, math.nan, 0.541, math.nan)
    reaching = replace(spread, percentiles={**spread.percentiles, "p10": p10})
    assert "fails to 0.541" in render_tolerance(replace(found, results={"score": reaching}))
    axes = spread_figure("score", reaching).axes[0]
    (shaded,) = [each for each in axes.patches if each.get_label() == P10_INTERVAL]
    assert shaded.get_x() == axes.get_xlim()[0]
    assert shaded.get_x() + shaded.get_width() == pytest.approx(0.541)


def test_without_noise_none_is_spoken_of(found: Tolerance) -> None:
    """A function of the design gives the same for all seeds."""
    assert found.results["score"].noise == 0.0
    assert found.results["score"].noise_share == 0.0
    assert found.results["score"].caveat == ""
    assert "noise" not in render_tolerance(found)


def test_the_command(tmp_path: Path) -> None:
    errors = ["--error", "camera.fov=0.5", "--error", "camera.position.z=+-0.2"]
    out = tmp_path / "out"
    done = CliRunner().invoke(
        app,
        ["tolerance", "gelsight-mini-ideal", *QUICK, *errors, "--sensors", "24", "--out", str(out),
         "--report", "--json"],
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told == json.loads((out / "tolerance.json").read_text(encoding="utf-8"))
    head, *rows = csv.reader((out / "tolerance.csv").read_text(encoding="utf-8").splitlines())
    assert head == ["camera.fov", "camera.position.z"]
    values = np.array(rows, dtype=float)
    assert values.shape == (24, 2) and (np.ptp(values, axis=0) > 0.0).all()
    assert not {"names", "values"} & set(told)
    assert told["errors"] == {"camera.fov": ["normal", 0.5], "camera.position.z": ["uniform", 0.2]}
    result = told["objectives"]["aoap"]
    assert told["sensors"] == len(result["scores"]) == 24
    order = [result["percentiles"][key]["value"] for key in ("p10", "p50", "p90")]
    assert order == sorted(order)
    assert set(result["shares"]) == {"camera.fov", "camera.position.z"}
    assert (out / "tolerance.html").read_text(encoding="utf-8").rstrip().endswith("</html>")


@pytest.mark.parametrize("usual", [True, False])
def test_an_exact_camera_is_told(
    found: Tolerance, usual: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    print_tolerance(found, usual)
    told = " ".join(capsys.readouterr().out.split())
    assert ("--error replaces the usual errors: give all" in told) is usual


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--error", "coating.specularty=0.1"], "specularity"),
        (["--error", "coating.specularity=much"], "'much' is not a number"),
        (["--report"], "needs a folder"),
        (["--sensors", "2"], "greater than or equal to 8"),
        (["--objective", "rgb2norma"], "rgb2normal"),
    ],
)
def test_bad_input_is_told(options: list[str], message: str) -> None:
    done = CliRunner().invoke(app, ["tolerance", "gelsight-mini-ideal", *options])
    assert done.exit_code == 2
    assert message in " ".join(done.output.split())


def test_sizes_of_errors_have_their_unit() -> None:
    for path, text in {
        "lights.position": "0.05 mm",
        "lights.red.lights[0].position.x": "0.05 mm",
        "cages.M1.points": "0.05 mm",
        "cages.M1.points[3].z": "0.05 mm",
        "lights.angle": "0.05°",
        "camera.turn.x": "0.05°",
        "camera.fov": "0.05°",
        "lights.red.flux": "0.05 mW",
        "coating.specularity": "0.05",
        "coating.reflectance.g": "0.05",
        "materials.gel.ior": "0.05",
    }.items():
        assert shown_size(path, 0.05) == text


def test_legends_stand_above_their_plots(found: Tolerance) -> None:
    noisy = replace(found.results["score"], noise=0.5 * found.results["score"].deviation)
    figure = spread_figure("score", noisy)
    figure.draw_without_rendering()
    for axes in figure.axes:
        assert axes.get_legend().get_window_extent().y0 >= axes.get_window_extent().y1 - 1.0


def test_every_line_of_the_scores_has_its_own_look_and_entry(found: Tolerance) -> None:
    axes = spread_figure("score", found.results["score"]).axes[0]
    looks = {(line.get_color(), line.get_linestyle()) for line in axes.lines}
    assert len(looks) == len(axes.lines) == 4
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert [label.split()[0] for label in labels] == ["nominal", "P10", "90", "P50", "P90"]

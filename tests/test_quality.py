"""The levels of quality: one table, read alike by Python, settings, commands and the engine."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.cli.app import app
from optisense.errors import ObjectiveError, RenderError
from optisense.objectives import Settings
from optisense.quality import PHOTONS, photons_of


@pytest.mark.parametrize(
    ("given", "photons"),
    [
        ("draft", 60_000),
        ("Normal", 1_000_000),
        ("fine", 5_000_000),
        ("2000", 2000),
        (2e6, 2_000_000),
    ],
)
def test_levels_and_numbers(given: str | float, photons: int) -> None:
    assert photons_of(given) == photons


@pytest.mark.parametrize(
    "given", ["great", "", 0, -1, 1.5, True, float("inf"), float("nan"), "1e999"]
)
def test_all_else_is_refused(given: str | float) -> None:
    with pytest.raises(ValueError, match=r"draft\|normal\|fine"):
        photons_of(given)


def test_an_image_takes_a_level() -> None:
    model = ots.OpticalModel(ots.load("gelsight-mini-ideal"))
    image = model.render(resolution=(40, 30), photons="draft")
    assert image.settings["photons_asked"] == PHOTONS["draft"]
    with pytest.raises(RenderError, match="'great'"):
        model.render(photons="great")


def test_settings_take_a_level() -> None:
    assert Settings(photons="fine") == Settings(photons=5_000_000)
    with pytest.raises(ObjectiveError, match="'great'"):
        Settings(photons="great")


def test_commands_take_a_level(tmp_path: Path) -> None:
    out = tmp_path / "touch"
    size = ("--resolution", "40x30", "--out", str(out))
    done = CliRunner().invoke(app, ["render", "gelsight-mini-ideal", "--photons", "draft", *size])
    assert done.exit_code == 0, done.output
    wrong = CliRunner().invoke(app, ["render", "gelsight-mini-ideal", "--photons", "great", *size])
    assert wrong.exit_code == 2
    assert "draft|normal|fine" in wrong.output.replace("\n", "")

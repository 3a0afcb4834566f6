"""Messages of `optisense check` on cameras that see the skin in mirrors, or miss them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense import optics, sensors
from optisense.cli import app
from optisense.errors import RenderError, SetupError
from optisense.search import SearchSpace


def checked(design: str) -> tuple[str, list[str]]:
    """Return the printed text, and its warnings, one per line."""
    result = CliRunner().invoke(app, ["check", design])
    assert result.exit_code == 0, result.output
    text = " ".join(result.output.split())
    return text, text.split("warning: ")[1:]


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("camera.turn.y", -40.0, ["'M1' shows the camera 0 %", "'M2' shows the camera 0 %"]),
        ("camera.direction.z", 1.1832, ["'M1' shows the camera 1 %", "'M2' shows the camera 1 %"]),
        ("camera.turn.y", 170.0, ["sees nothing of the sensing surface"]),
    ],
)
def test_mirrors_that_the_camera_looks_past_are_told(
    path: str, value: float, said: list[str], tmp_path: Path
) -> None:
    space = SearchSpace({path: (-200.0, 200.0)})
    moved = space.bind(sensors.load("gelsight-svelte"), tried=False).apply(np.array([value]))
    ots.save_design(moved, tmp_path / "design")
    text, odd = checked(str(tmp_path / "design"))
    assert len(odd) == len(said)
    assert all(each in told for each, told in zip(said, odd, strict=True))
    assert text.endswith(f"No errors, {len(said)} warning{'s' if len(said) > 1 else ''}.")


def test_a_mirror_that_is_too_rough_to_show_an_image_is_told(tmp_path: Path) -> None:
    """Both mirrors of GelSight Svelte are of one material."""
    for roughness, count in ((0.009, 0), (0.02, 2)):
        svelte = sensors.load("gelsight-svelte")
        rough = ots.set_value(svelte, "materials.mirror-silver.roughness", roughness)
        ots.save_design(rough, tmp_path / f"{count}")
        text, odd = checked(str(tmp_path / f"{count}"))
        assert len(odd) == text.count(f"of roughness {roughness:g}; by a smooth one") == count
    with pytest.raises(RenderError, match=r"roughness is below 0\.01"):
        optics.OpticalModel(rough).render((), (32, 24), photons=1000)


def test_mirrors_that_are_used_are_told_with_their_shares() -> None:
    text, odd = checked("gelsight-svelte")
    assert "100 % by 'M1' and 'M2'" in text and odd == []
    assert text.endswith("The design is in order.")
    assert " by " not in checked("gelsight-mini-ideal")[0].split("camera")[-1]


def test_a_machine_that_can_not_trace_rays_checks_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> None:
        raise SetupError("libLLVM is missing")

    monkeypatch.setattr(optics, "OpticalModel", missing, raising=False)
    text, odd = checked("gelsight-svelte")
    assert "mirrors are not checked: libLLVM is missing" in text and odd == []

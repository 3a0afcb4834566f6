"""Tuning files of libcamera: what is read of them, what is refused, and what the library has."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense import library
from optisense.cli import app
from optisense.design import Status, load_design, save_design
from optisense.design.lenses.film import film_places
from optisense.errors import LibraryError
from optisense.library.tuning import read_tuning

MATRIX = [1.8, -0.5, -0.3, -0.4, 1.7, -0.3, -0.1, -0.6, 1.7]
WARM = [2.0, -0.7, -0.3, -0.4, 1.7, -0.3, -0.1, -0.6, 1.7]


def sections() -> dict[str, Any]:
    """A small tuning file in format 1."""
    gain = np.linspace(1.0, 2.0, 192).tolist()
    return {
        "rpi.black_level": {"black_level": 2048},
        "rpi.noise": {"reference_constant": 10, "reference_slope": 4.0},
        "rpi.awb": {"ct_curve": [3000.0, 0.8, 0.4, 6000.0, 0.5, 0.7]},
        "rpi.alsc": {
            "luminance_strength": 0.6,
            "luminance_lut": gain,
            "calibrations_Cr": [
                {"ct": 3000, "table": [9.0] * 192},
                {"ct": 5500, "table": [2.0 * each for each in gain]},
            ],
        },
        "rpi.contrast": {"gamma_curve": [0, 0, 6144, 20790, 32768, 54876, 65535, 65535]},
        "rpi.ccm": {"ccms": [{"ct": 6000, "ccm": MATRIX}, {"ct": 4000, "ccm": WARM}]},
    }


def write(folder: Path, content: Any) -> Path:
    file = folder / "our-camera.json"
    file.write_text(content if isinstance(content, str) else json.dumps(content))
    return file


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty library folder of the user."""
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(tmp_path / "own"))
    return tmp_path / "own"


@pytest.mark.parametrize("version", [1, 2])
def test_a_tuning_file_is_read(tmp_path: Path, version: int) -> None:
    content: Any = sections()
    if version == 2:
        content = {"version": 2.0, "algorithms": [{k: v} for k, v in content.items()]}
    values = read_tuning(write(tmp_path, content)).values
    assert values["black_level"] == {"level": 0.03125}
    # The variance at the full level is 16 * (65536 - 2048), as black does not count.
    assert values["noise"] == {"full_well": 3968.0, "read_noise": 0.62}
    assert values["white_balance"] == [pytest.approx(1.0 / 0.6, abs=1e-5), 1.0, 1.66667]
    assert values["colour_matrix"][0] == pytest.approx([1.9, -0.6, -0.3])
    assert values["tone_curve"]["points"][1] == pytest.approx([0.09375, 0.31724], abs=1e-5)
    shading = values["shading"]
    assert np.shape(shading["gain"]) == (12, 16) and shading["corrected"] == 0.6
    assert np.array(shading["red"]) == pytest.approx(np.array(shading["gain"]), abs=1e-4)
    assert "blue" not in shading
    mixed = np.array(values["colour_matrix"]) * values["white_balance"] @ values["crosstalk"]
    assert mixed == pytest.approx(np.eye(3), abs=1e-4)


@pytest.mark.parametrize("missing", ["rpi.awb", "rpi.ccm"])
def test_colours_agree_if_a_file_has_only_some(own: Path, tmp_path: Path, missing: str) -> None:
    content = sections()
    del content[missing]
    entry = library.add_tuning(write(tmp_path, content), like="pi-v2", name="ours").entry
    value: Any = entry.value
    mixed = np.array(value.colour_matrix) * value.white_balance @ value.crosstalk
    assert mixed == pytest.approx(np.eye(3), abs=1e-4)
    neutral = {"rpi.awb": "white_balance", "rpi.ccm": "colour_matrix"}[missing]
    source = entry.source(neutral)
    assert source is not None and source.source == "neutral, as the tuning file has none"


def test_colours_are_those_of_the_temperature(tmp_path: Path) -> None:
    file = write(tmp_path, sections())
    warm = read_tuning(file, 3000.0).values
    assert warm["white_balance"] == pytest.approx([1.25, 1.0, 2.5])
    assert np.ravel(warm["colour_matrix"]) == pytest.approx(WARM)
    assert np.ptp(warm["shading"]["red"]) == 0.0


def without(key: str, **changes: Any) -> dict[str, Any]:
    """The sections with one of them changed."""
    content = sections()
    content[key] |= changes
    return content


def test_the_luminance_is_that_of_libcamera_whatever_the_file_has_of_it(tmp_path: Path) -> None:
    """A corner strength of 4 makes the table (1 + r²)² and precedes `luminance_lut`."""

    def shading(content: dict[str, Any]) -> Any:
        return read_tuning(write(tmp_path, content)).values.get("shading")

    made = shading(without("rpi.alsc", corner_strength=4.0))
    assert made["gain"][0][0] == pytest.approx((1.0 + (5.5**2 + 7.5**2) / 96.0) ** 2, abs=1e-5)
    content = without("rpi.alsc", corner_strength=4.0, asymmetry=0.5)
    del content["rpi.alsc"]["luminance_lut"]
    narrow = shading(content)
    assert narrow["gain"][-1][-1] == pytest.approx((1.0 + (5.5**2 + 3.75**2) / 60.0) ** 2, abs=1e-5)
    del content["rpi.alsc"]["corner_strength"]
    even = shading(content)
    assert np.array(even["gain"]) == pytest.approx(np.ones((12, 16)))
    assert even["red"] == narrow["red"] == made["red"] and made["colour_corrected"] == 1.0
    del content["rpi.alsc"]["calibrations_Cr"]
    assert shading(content) is None


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "not JSON"),
        ("{", "not JSON"),
        ("[" * 100_000, "nested too deeply"),
        ("[1, 2]", "no section whose name begins with 'rpi.'"),
        ('{"black_level": 3}', "no section"),
        ('{"rpi.black_level": {"black_level": NaN}}', "NaN is no number"),
        ('{"rpi.agc": {}}', "has no data on"),
        ({"rpi.noise": {"reference_slope": 3}}, "'rpi.noise' is not as in a tuning file"),
        ({"rpi.noise": {"reference_slope": 0, "reference_constant": 0}}, "slope of 0"),
        ({"rpi.black_level": []}, "'rpi.black_level' is not as in"),
        ({"rpi.black_level": {"black_level": "dark"}}, "'dark' is no number"),
        (without("rpi.alsc", luminance_lut=[1.0] * 190), "a shading table has 190 numbers"),
        (without("rpi.alsc", luminance_lut=[-1.0] * 192), "the gain -1"),
        (without("rpi.alsc", corner_strength=1.0), "the corner strength is 1, and not above 1"),
        (without("rpi.alsc", corner_strength=2.0, asymmetry=-1.0), "the asymmetry is -1"),
        (without("rpi.contrast", gamma_curve=[0, 0, 1]), "'rpi.contrast' is not as in"),
        (without("rpi.awb", ct_curve=[5000, 1, 1, 3000, 1, 1]), "does not rise"),
        (without("rpi.ccm", ccms=[]), "'rpi.ccm' is not as in"),
        (without("rpi.ccm", ccms=[{"ct": 1, "ccm": [1.0] * 9}]), "can't be inverted"),
    ],
)
def test_what_is_no_tuning_file_is_refused(tmp_path: Path, content: Any, says: str) -> None:
    file = write(tmp_path, content)
    with pytest.raises(LibraryError, match=says) as caught:
        read_tuning(file)
    assert str(file) in str(caught.value.where)
    assert "imx219.json" in str(caught.value.hint)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LibraryError, match="can't read the tuning file"):
        read_tuning(tmp_path / "none.json")


def test_a_camera_of_ones_own_is_added_and_used(own: Path, tmp_path: Path) -> None:
    added = library.add_tuning(write(tmp_path, sections()), like="pi-v2", name="ours")
    assert added.file == own / "cameras" / "ours.yaml" and added.entry.unsourced() == []
    entry = library.entry("camera", "ours")
    assert entry.value.noise.full_well == 3968.0
    assert entry.value.fov == 62.2
    crosstalk = entry.source("crosstalk")
    assert crosstalk is not None and crosstalk.status == "derived"
    with pytest.raises(LibraryError, match="already has a camera 'ours'"):
        library.add_tuning(write(tmp_path, sections()), like="pi-v2", name="ours")
    with pytest.raises(LibraryError, match="no camera 'pi-v9'"):
        library.add_tuning(write(tmp_path, sections()), like="pi-v9", name="other")
    design = library.with_imaging(ots.load("builtin:gelsight-mini-ideal"), "ours")
    assert design.camera.noise is not None and design.camera.noise.full_well == 3968.0
    assert design.camera.fov == 52.157
    save_design(design, tmp_path / "design")
    assert load_design(tmp_path / "design").camera == design.camera
    assert not [each for each in ots.check(design) if "provenance" in each.message]


def test_only_the_lens_and_the_pixels_are_those_of_another_camera(
    own: Path, tmp_path: Path
) -> None:
    file = write(tmp_path, {"rpi.black_level": {"black_level": 4096}})
    command = ["library", "add", "camera", "--tuning", str(file), "--like", "pi-v2"]
    run = CliRunner().invoke(app, command)
    assert run.exit_code == 0, run.output
    taken = "projection, fov, resolution, pixel size, focal length, f number"
    assert f"as pi-v2: {taken}\n" in run.output
    camera = library.camera("our-camera")
    assert list(camera.imaging()) == ["black_level"]
    assert (camera.fov, camera.f_number) == (62.2, 2.0)
    assert library.entry("camera", "our-camera").unsourced() == []


@pytest.mark.parametrize("name", ["pi-v1", "pi-v2", "pi-v3", "pi-hq-6mm"])
def test_cameras_of_the_library_come_with_what_their_makers_measured(name: str) -> None:
    known = library.camera(name)
    assert known.tone_curve is not None and known.shading is not None
    # Not sRGB, which gives 0.339 and 0.735.
    stored = known.tone_curve.curve(np.array([0.09375, 0.5]))
    assert stored == pytest.approx([0.317, 0.837], abs=1e-3)
    share = known.shading.transmission(film_places(240, 320))[..., 1]
    corners = share[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert share[120, 160] > 0.97 and share.min() > 0.9 * corners.max()
    imaging = known.imaging()
    rows = np.array(imaging["colour_matrix"]).sum(axis=1)
    assert rows == pytest.approx(1.0, abs=2e-5)  # a matrix keeps white
    assert library.entry("camera", name).unsourced() == []
    grey = np.full((60, 80, 3), 0.4, dtype=np.float32)
    design = library.with_imaging(ots.load("builtin:gelsight-mini-ideal"), name)
    shown = design.camera.picture_chain().without_noise().respond(grey)
    assert shown[30, 40] == pytest.approx([0.4] * 3, rel=0.02)


def test_noise_slopes_of_the_library_are_those_of_the_files() -> None:
    slopes = {"pi-v1": 4.25, "pi-v2": 3.67, "pi-v3": 2.5, "pi-hq-6mm": 2.767}
    for name, slope in slopes.items():
        camera = library.camera(name)
        assert camera.noise is not None and camera.black_level is not None
        deviation = camera.noise.deviation(np.array([0.25]))
        full = 65536 * (1.0 - camera.black_level.level)  # counts above black
        assert full * deviation == pytest.approx(slope * np.sqrt(0.25 * full), rel=1e-4)


def test_a_focus_distance_gives_the_depth_of_field_of_the_lens() -> None:
    mini = ots.load("builtin:gelsight-mini-ideal")
    design = library.with_imaging(mini, "pi-v2", focus_distance=19.4)
    blur: Any = design.camera.blur
    assert (blur.focal_length, blur.f_number, blur.focus_distance) == (3.04, 2.0, 19.4)
    assert design.provenance["camera.noise"].source.startswith("rpi.noise")
    with pytest.raises(LibraryError, match="the f-number of camera 'pi-hq-6mm' is not known"):
        library.with_imaging(mini, "pi-hq-6mm", focus_distance=20.0)
    with pytest.raises(LibraryError, match="no data on distortion, shading"):
        library.with_imaging(mini, "ovm7692")


def test_the_camera_of_the_mini_has_the_processing_of_the_fitted_sensor() -> None:
    ideal, fitted = ots.load("gelsight-mini-ideal"), ots.load("gelsight-mini")
    design = library.with_imaging(ideal, "gelsight-mini")
    for name in ("shading", "stray_light", "colour_matrix", "tone_curve"):
        assert getattr(design.camera, name) == getattr(fitted.camera, name)
        assert fitted.provenance[f"camera.{name}"].status is Status.CALIBRATED
    assert design.camera.fov == ideal.camera.fov

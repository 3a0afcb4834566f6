"""IES files are read correctly, and damaged ones are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from optisense.design.ies import IesProfile, parse_ies, read_ies
from optisense.errors import LibraryError

FLUX_TOLERANCE = 1e-4


def ies(
    vertical: str = "0 45 90",
    horizontal: str = "0",
    candela: str = "100 70.7107 0",
    head: str = "IESNA:LM-63-2002\n[TEST] none\n",
    tilt: str = "TILT=NONE\n",
    lamps: str = "1 -1 1",
    tail: str = "1 2 0 0 0\n1 1 5\n",
) -> str:
    counts = f"{len(vertical.split())} {len(horizontal.split())}"
    return f"{head}{tilt}{lamps} {counts} {tail}{vertical}\n{horizontal}\n{candela}\n"


def read(**changes: str) -> IesProfile:
    return parse_ies(ies(**changes), "lamp.ies")


def test_a_lambertian_lamp_has_pi_times_its_peak() -> None:
    angles = np.arange(0, 91)
    candela = 100 * np.cos(np.radians(angles))
    profile = read(
        vertical=" ".join(map(str, angles)), candela=" ".join(f"{c:.9f}" for c in abs(candela))
    )
    assert profile.lumens == pytest.approx(100 * np.pi, rel=FLUX_TOLERANCE)


def test_an_even_lamp_has_four_pi() -> None:
    profile = read(vertical="0 90 180", candela="2 2 2")
    assert profile.lumens == pytest.approx(8 * np.pi, rel=1e-12)


def test_upward_lamp_keeps_its_true_angles() -> None:
    profile = read(vertical="90 135 180", candela="3 3 3")
    assert profile.vertical_angles.tolist() == [90, 135, 180]
    assert profile.lumens == pytest.approx(6 * np.pi, rel=1e-12)


@pytest.mark.parametrize("head", ["IESNA:LM-63-1995\n[X] y\n", "IESNA91\n", "", "Maker's own\n"])
def test_headers_of_all_years(head: str) -> None:
    assert read(head=head).candela[0].tolist() == [100.0, 70.7107, 0.0]


def test_values_may_wrap_anywhere() -> None:
    words = ies().split("TILT=NONE\n")[1].split()
    text = "IESNA91\nTILT=NONE\n" + "\r\n".join(words)
    np.testing.assert_array_equal(parse_ies(text, "x").candela, read().candela)


def test_multiplier_and_ballast_factor() -> None:
    profile = read(lamps="2 300 3", tail="1 2 0 0 0\n0.5 1 5\n")
    assert profile.candela[0, 0] == 150.0


def test_included_tilt_applies_the_factor_of_the_untilted_lamp() -> None:
    profile = read(tilt="TILT=INCLUDE\n1\n3\n0 45 90\n0.5 0.8 0.9\n")
    assert profile.candela[0, 0] == 50.0


SYMMETRIES = {
    "0": ("5 4 3", {0: 5, 90: 5, 200: 5, 360: 5}),
    "0 90": ("5 4 3  6 4 3", {0: 5, 90: 6, 180: 5, 270: 6, 360: 5}),
    "0 45 90": ("5 4 3  7 4 3  6 4 3", {45: 7, 135: 7, 225: 7, 315: 7, 90: 6, 180: 5}),
    "0 90 180": ("5 4 3  6 4 3  9 4 3", {0: 5, 90: 6, 180: 9, 270: 6, 360: 5}),
    "90 180 270": ("5 4 3  6 4 3  9 4 3", {90: 5, 180: 6, 270: 9, 0: 6, 360: 6}),
    "90 270": ("5 4 3  9 4 3", {90: 5, 270: 9, 0: 7, 180: 7, 360: 7}),
    "0 90 180 270": ("5 4 3  6 4 3  7 4 3  8 4 3", {0: 5, 90: 6, 180: 7, 270: 8, 360: 5}),
    "0 180 360": ("5 4 3  6 4 3  5 4 3", {0: 5, 90: 5.5, 180: 6, 270: 5.5, 360: 5}),
}


@pytest.mark.parametrize("horizontal", SYMMETRIES)
def test_symmetries_are_written_out(horizontal: str) -> None:
    candela, expected = SYMMETRIES[horizontal]
    profile = read(horizontal=horizontal, candela=candela)
    assert (profile.horizontal_angles[0], profile.horizontal_angles[-1]) == (0.0, 360.0)
    assert (np.diff(profile.horizontal_angles) > 0).all()
    assert profile.candela.shape == (len(profile.horizontal_angles), 3)
    for angle, value in expected.items():
        found = np.interp(angle, profile.horizontal_angles, profile.candela[:, 0])
        assert found == pytest.approx(value), angle


def test_every_truncation_is_refused_with_its_line() -> None:
    text = ies(horizontal="0 90", candela="100 70 0\n90 60 1").rstrip("\n")
    words = text.split(" ")
    for count in range(1, len(words)):
        cut = " ".join(words[:count])
        with pytest.raises(LibraryError, match=r"lamp\.ies:\d+"):
            parse_ies(cut, "lamp.ies")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"candela": "100 70"}, "cut off.* 2 of 3 intensities"),
        ({"candela": "100 70 0 0"}, "1 values too many"),
        ({"candela": "100 x 0"}, "'x' is not a number"),
        ({"candela": "100 nan 0"}, "finite"),
        ({"candela": "100 1e160 0"}, "'1e160' is too large"),
        ({"candela": "100 -1 0"}, "negative"),
        ({"candela": "0 0 0"}, "not all 0"),
        ({"vertical": "0 45 80"}, "0-90, 90-180 or 0-180"),
        ({"vertical": "0 90 45"}, "ascend"),
        ({"horizontal": "0 100", "candela": "1 1 1 1 1 1"}, "horizontal"),
        ({"horizontal": "10"}, "horizontal"),
        ({"tail": "2 2 0 0 0\n1 1 5\n"}, "type C"),
        ({"tail": "1 2 0 0 0\n0 1 5\n"}, "ballast"),
        ({"tilt": "TILT=other.tlt\n"}, "another file"),
        ({"tilt": ""}, "no TILT="),
        ({"lamps": "1 -1 1 1000000000"}, "vertical angles"),
    ],
)
def test_damaged_files_are_refused(changes: dict[str, str], message: str) -> None:
    with pytest.raises(LibraryError, match=message):
        read(**changes)


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(LibraryError, match=r"can't read.*none\.ies"):
        read_ies(tmp_path / "none.ies")

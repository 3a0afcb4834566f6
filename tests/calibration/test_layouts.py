"""Folders of photographs are read as they are, and refused with what to do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from optisense.calibration import (
    PhotographedPress,
    Photographs,
    read_photographs,
    save_photographs,
)
from optisense.errors import CalibrationError

WIDTH, HEIGHT = 64, 48


def picture(seed: int, size: tuple[int, int] = (WIDTH, HEIGHT)) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.integers(40, 200, (size[1], size[0], 3), dtype=np.uint8)


def own_folder(folder: Path, table: str = "file,diameter\na.png,6\n") -> Path:
    folder.mkdir(exist_ok=True)
    Image.fromarray(picture(0)).save(folder / "background.png")
    Image.fromarray(picture(1)).save(folder / "a.png")
    (folder / "presses.csv").write_text(table, encoding="utf-8")
    return folder


def test_what_is_saved_is_read_again(tmp_path: Path) -> None:
    presses = (
        PhotographedPress("one.png", picture(1), 6.0, (20.5, 30.25), 8.0),
        PhotographedPress("two.png", picture(2), 9.5),
    )
    save_photographs(tmp_path / "new", Photographs(picture(0), presses))
    found = read_photographs(tmp_path / "new")
    assert (found.background == picture(0)).all()
    assert [(p.name, p.diameter, p.centre, p.radius) for p in found.presses] == [
        ("one.png", 6.0, (20.5, 30.25), 8.0),
        ("two.png", 9.5, None, None),
    ]
    assert (found.presses[1].picture == picture(2)).all()
    assert len({found.fingerprint, *(press.fingerprint for press in found.presses)}) == 3


def test_a_ball_is_given_as_diameter_or_indenter_or_for_all(tmp_path: Path) -> None:
    indenter = own_folder(tmp_path / "i", "file,indenter\na.png,sphere:3\n")
    assert read_photographs(indenter).presses[0].diameter == 6.0
    both = own_folder(tmp_path / "b", "file,diameter,indenter\na.png,6,sphere:3\n")
    assert read_photographs(both).presses[0].diameter == 6.0
    nothing = own_folder(tmp_path / "n", "file\na.png\n")
    assert read_photographs(nothing, 4.0).presses[0].diameter == 4.0


@pytest.mark.parametrize("separator", [";", "\t"])
def test_tables_of_spreadsheet_programs_are_read(tmp_path: Path, separator: str) -> None:
    table = "file,diameter,column,row\na.png,6.31,3,4\n".replace(",", separator)
    press = read_photographs(own_folder(tmp_path / "f", table)).presses[0]
    assert (press.diameter, press.centre) == (6.31, (3.0, 4.0))


def test_a_folder_of_gs_sdk(tmp_path: Path) -> None:
    Image.fromarray(picture(0)).save(tmp_path / "background.png")
    place = tmp_path / "6.000mm" / "0"
    place.mkdir(parents=True)
    Image.fromarray(picture(1)).save(place / "gelsight.png")
    np.savez(place / "label.npz", center=np.array([20, 30]), radius=8)
    (tmp_path / "catalog.csv").write_text(
        "experiment_reldir,diameter(mm)\n6.000mm/0,6.0\n", encoding="utf-8"
    )
    press = read_photographs(tmp_path).presses[0]
    assert (press.diameter, press.centre, press.radius) == (6.0, (20.5, 30.5), 8.0)
    assert (press.picture == picture(1)).all()


def test_taxims_data_pack_is_stored_blue_first(tmp_path: Path) -> None:
    np.savez(
        tmp_path / "dataPack.npz",
        f0=picture(0)[..., ::-1],
        imgs=np.stack([picture(1), picture(2)])[..., ::-1],
        touch_center=np.array([[20, 30], [25, 22]], dtype=np.uint16),
        touch_radius=np.array([8, 9], dtype=np.uint16),
    )
    found = read_photographs(tmp_path, 4.0)
    assert (found.background == picture(0)).all()
    assert (found.presses[1].picture == picture(2)).all()
    assert found.presses[1].centre == (25.5, 22.5)
    assert read_photographs(tmp_path / "dataPack.npz", 4.0).presses[0].radius == 8.0
    with pytest.raises(CalibrationError, match="does not state the diameter") as raised:
        read_photographs(tmp_path)
    assert "--ball" in (raised.value.hint or "")


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("file,diameter\nb.png,6\n", "no photograph 'b.png'"),
        ("file,diameter\n../a.png,6\n", "not inside the folder"),
        ("file\na.png\n", "diameter is missing"),
        ("file,diameter\na.png,six\n", "'six' under 'diameter' is no number"),
        ("file,diameter\na.png,-6\n", "diameter is -6"),
        ("file,diameter\na.png,nan\n", "diameter is nan"),
        ("name,diameter\na.png,6\n", "column 'file' is missing"),
        ("file,diameter\n", "no presses"),
        ("file,indenter\na.png,cylinder:3\n", "no ball"),
        ("file,diameter,indenter\na.png,6,sphere:5\n", "is 6 mm, but 'sphere:5' has one of 10 mm"),
        ("file,diameter,column\na.png,6,3\n", "but not both"),
        ("file;diameter\na.png;6,31\n", "'6,31' under 'diameter' has a decimal comma"),
    ],
)
def test_a_table_that_makes_no_sense_is_refused(tmp_path: Path, table: str, words: str) -> None:
    with pytest.raises(CalibrationError, match=words) as raised:
        read_photographs(own_folder(tmp_path / "f", table))
    assert raised.value.where
    assert raised.value.hint


def test_a_folder_needs_a_background_of_the_same_size(tmp_path: Path) -> None:
    folder = own_folder(tmp_path / "f")
    (folder / "background.png").unlink()
    with pytest.raises(CalibrationError, match=r"no background\.png"):
        read_photographs(folder)
    Image.fromarray(picture(0, (WIDTH, HEIGHT + 2))).save(folder / "background.png")
    with pytest.raises(CalibrationError, match="64 x 48 pixels and the background 64 x 50"):
        read_photographs(folder)
    with pytest.raises(CalibrationError, match="has no table of presses"):
        read_photographs(tmp_path)


def test_a_label_outside_the_picture_is_refused(tmp_path: Path) -> None:
    table = "file,diameter,column,row,radius\na.png,6,640,20,9\n"
    with pytest.raises(CalibrationError, match="outside the picture of 64 x 48 pixels") as raised:
        read_photographs(own_folder(tmp_path / "f", table))
    assert raised.value.where == "a.png"


def test_a_file_that_is_no_picture_is_told_without_its_inner_names(tmp_path: Path) -> None:
    folder = own_folder(tmp_path / "f")
    (folder / "background.png").write_text("no picture")
    with pytest.raises(CalibrationError, match="neither a PNG nor a JPEG file") as raised:
        read_photographs(folder)
    assert "BytesIO" not in str(raised.value)


def test_grey_of_16_bits_is_that_of_8_bits(tmp_path: Path) -> None:
    folder = own_folder(tmp_path / "f")
    grey = picture(1)[..., 0]
    Image.fromarray(257 * grey.astype(np.uint16)).save(folder / "a.png")
    found = read_photographs(folder).presses[0].picture
    assert (found == grey[..., None]).all()


def test_pictures_that_are_stored_turned_are_turned_upright(tmp_path: Path) -> None:
    folder = own_folder(tmp_path / "f")
    upright = Image.fromarray(picture(1))
    exif = upright.getexif()
    exif[0x112] = 6  # the first row is the right side
    upright.transpose(Image.Transpose.ROTATE_90).save(folder / "a.png", exif=exif)
    assert (read_photographs(folder).presses[0].picture == picture(1)).all()
    upright.save(folder / "a.png", exif=b"Exif\0\0II*\0\x08\0\0\0\xff\xff")  # damaged
    assert (read_photographs(folder).presses[0].picture == picture(1)).all()


def test_pictures_that_occur_twice_are_told() -> None:
    one, two = (PhotographedPress(name, picture(1), 6.0) for name in ("one", "two"))
    words = Photographs(picture(0), (one, two, one)).warnings()
    assert words == [
        "two: it is the same picture as one; leave one of them out",
        "one: it is listed twice; leave one of them out",
    ]


def test_photographs_without_colour_are_told() -> None:
    def grey(seed: int) -> np.ndarray:
        return np.repeat(picture(seed)[..., :1], 3, axis=2)

    presses = (PhotographedPress("one", grey(1), 6.0),)
    assert "no colour" in Photographs(grey(0), presses).warnings()[0]
    assert Photographs(picture(0), presses).warnings() == []


def test_exposure_is_judged() -> None:
    dark = PhotographedPress("dark", picture(1) // 20, 6.0)
    bright = PhotographedPress("bright", np.full((HEIGHT, WIDTH, 3), 255, np.uint8), 6.0)
    words = Photographs(picture(0), (dark, bright)).warnings()
    assert ["dark: it is underexposed" in words[0], "bright: 100.0 %" in words[1]] == [True, True]
    assert len(words) == 2


def test_smaller_photographs_keep_their_light_and_labels() -> None:
    press = PhotographedPress("one", picture(1, (640, 480)), 6.0, (200.0, 100.0), 50.0)
    small = Photographs(picture(0, (640, 480)), (press,)).scaled(320)
    assert small.size == (320, 240)
    assert small.presses[0].centre == (100.0, 50.0)
    assert small.presses[0].radius == 25.0
    assert small.background.mean() == pytest.approx(picture(0, (640, 480)).mean(), abs=0.6)

"""A user's own parts: stored whole, found beside the built-in ones, and carried by designs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from optisense import library, sensors
from optisense.design import IesEmitter, LightGroup, SensorDesign, load_design
from optisense.design.yaml_writer import to_yaml
from optisense.errors import DesignError, LibraryError, OutputError
from optisense.library.loader import FOLDER
from optisense.library.storage import HEADS

GEL = """\
description: Our gel
value: {kind: dielectric, ior: 1.43, dispersion: [1.42, 1.43, 1.44], roughness: 0.1}
sources:
  ior: {status: measured, source: our refractometer, date: "2026-03"}
"""
LAMP = "IESNA:LM-63-2002\n[MANUFAC] us\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 5\n0 45 90\n0\n9 5 0\n"


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty library folder of the user."""
    folder = tmp_path / "own"
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(folder))
    return folder


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    file = tmp_path / "our-lamp.ies"
    file.write_text(LAMP)
    return file


def write(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.write_text(text)
    return file


def add_lamp(
    file: Path, wavelength: float | None = None, window: tuple[float, float] | None = None
) -> library.Added:
    light = library.TypicalLight(colour=(1.0, 0.0, 0.0), flux=4.0, wavelength=wavelength)
    return library.add_ies(file, light, colour_name="red", window=window)


class TestFolder:
    def test_the_variable_names_it(self, own: Path) -> None:
        assert library.own_folder() == own

    def test_else_it_is_in_the_configuration_folder(
        self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        monkeypatch.delenv("OPTISENSE_LIBRARY")
        monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
        assert library.own_folder() == tmp_path / "optisense" / "library"
        monkeypatch.delenv("XDG_CONFIG_HOME")
        monkeypatch.setenv("HOME", str(tmp_path / "home"))
        assert library.own_folder() == tmp_path / "home" / ".config" / "optisense" / "library"


class TestAdding:
    def test_a_material_reads_back_with_every_number(self, own: Path, tmp_path: Path) -> None:
        added = library.add_file(write(tmp_path, "our-gel.yaml", GEL))
        assert (added.kind, added.name) == ("material", "our-gel")
        assert added.file == own / "materials" / "our-gel.yaml"
        assert library.entry("material", "our-gel") == added.entry
        assert library.material("our-gel") == added.entry.value
        assert "our-gel" in library.names("material") and library.is_own("material", "our-gel")
        assert not library.is_own("material", "acrylic")
        assert added.entry.unsourced() == ["dispersion", "roughness"]

    def test_without_sources_all_numbers_are_unsourced(self, own: Path, tmp_path: Path) -> None:
        text = GEL[: GEL.index("sources:")]
        added = library.add_file(write(tmp_path, "our-gel.yaml", text))
        assert added.entry.unsourced() == added.entry.numbers() != []

    @pytest.mark.parametrize(
        ("kind", "name"),
        [
            ("material", "mirror-silver"),
            ("coating", "semi-specular"),
            ("light", "ws2812b"),
            ("light", "round-5mm-30"),
            ("camera", "pi-v3-wide"),
        ],
    )
    def test_every_kind_of_entry_survives_being_written_and_added(
        self, own: Path, tmp_path: Path, kind: str, name: str
    ) -> None:
        original = library.entry(kind, name)
        if isinstance(original.value, IesEmitter):
            (tmp_path / original.value.file).write_bytes(original.value.path("file").read_bytes())
        file = write(tmp_path, "copy.yaml", to_yaml(original, "mine"))
        added = library.add_file(file, name="copy")
        copied = library.entry(kind, "copy")
        assert added.kind == kind
        if isinstance(copied.value, IesEmitter) and isinstance(original.value, IesEmitter):
            assert copied.value.file == "copy.ies"
            table, before = copied.value.intensity_table(), original.value.intensity_table()
            np.testing.assert_array_equal(table.candela, before.candela)
            copied.value.file = original.value.file
        assert copied.model_dump() == original.model_dump()

    def test_an_ies_file_with_what_it_does_not_tell(self, own: Path, lamp: Path) -> None:
        added = add_lamp(lamp, wavelength=624.0, window=(2.0, 2.0))
        assert isinstance(added.entry.value, IesEmitter)
        assert sorted(each.name for each in (own / "lights").iterdir()) == [
            "our-lamp.ies", "our-lamp.yaml",
        ]  # fmt: skip
        assert (own / "lights" / "our-lamp.ies").read_text() == LAMP
        light = library.light("our-lamp")
        assert isinstance(light, IesEmitter)
        assert light.relative_intensity(45.0) == pytest.approx(5 / 9)
        assert added.entry.unsourced() == []
        assert added.entry.sources["file"].source == "us"


class TestRefusals:
    @pytest.mark.parametrize(
        ("old", "new", "message"),
        [
            ("wavelength: 625.0", "wavelength: 0.625", "'typical.red.wavelength' = 0.625"),
            ("colour: [1.0, 0.0, 0.0]", "colour: [0, 0, 0]", "the light has no colour"),
            ('date: "2026"', "date: 3.2026", "valid string"),
            ('date: "2026"', 'date: "3.2026"', "a year, year-month or day, such as 2026-03"),
        ],
    )
    def test_slips_in_data_of_an_led_are_told(
        self, own: Path, tmp_path: Path, old: str, new: str, message: str
    ) -> None:
        text = to_yaml(library.entry("light", "smd-3528"), HEADS["light"])
        assert old in text
        file = tmp_path / "my-led.yaml"
        file.write_text(text.replace(old, new, 1))
        with pytest.raises(LibraryError, match=re.escape(message)) as caught:
            library.add_file(file)
        assert str(caught.value.where).startswith(f"{file}:")

    def test_a_year_may_be_written_as_a_number(self, own: Path, tmp_path: Path) -> None:
        text = to_yaml(library.entry("light", "smd-3528"), HEADS["light"])
        file = tmp_path / "my-led.yaml"
        file.write_text(text.replace('date: "2026"', "date: 2026"))
        assert library.add_file(file).entry.sources["size"].date == "2026"

    @pytest.mark.parametrize(
        ("old", "new", "line", "message"),
        [
            ("ior: 1.43,", "ior: 0.9,", 2, "1"),
            ("ior: 1.43, ", "", 2, "'value.ior' is missing"),
            ("ior: 1.43,", "iro: 1.43,", 2, "Did you mean 'ior'"),
            ("  ior: {status: measured", "  ior: {status: mesured", 4, "measured"),
            ("  ior: {", "  iro: {", 4, "Did you mean 'ior'"),
            ("kind: dielectric", "kind: dielectrik", 2, "dielectric"),
            ("description: Our gel", "descripton: Our gel", 1, "Did you mean 'description'"),
        ],
    )
    def test_what_is_wrong_is_told_with_its_line(
        self, own: Path, tmp_path: Path, old: str, new: str, line: int, message: str
    ) -> None:
        assert old in GEL
        file = write(tmp_path, "our-gel.yaml", GEL.replace(old, new))
        with pytest.raises(LibraryError, match=message) as caught:
            library.add_file(file, kind="material")
        assert f"our-gel.yaml:{line}" in str(caught.value)
        assert not own.exists()

    @pytest.mark.parametrize(
        ("value", "gives", "advice"),
        [
            ("perspective, fov: 73.8", "62.3", "diagonal"),
            ("perspective, fov: 48.8", "62.3", "height"),
            ("equidistant, fov: 62.2", "69.2", "'projection: perspective'"),
            ("perspective, fov: 120.0", "62.3", "leave out focal_length"),
        ],
    )
    def test_a_field_of_view_that_does_not_fit_the_lens(
        self, own: Path, tmp_path: Path, value: str, gives: str, advice: str
    ) -> None:
        # The maker of this camera tells 62.2 x 48.8 degrees; over the diagonal these are 74.
        lens = "resolution: [3280, 2464], pixel_size: 1.12, focal_length: 3.04"
        text = "description: A camera\nvalue: {{projection: {}{}}}\nsources:\n  fov: {}\n"
        source = "{status: assumed, source: a guess}"
        wrong = write(tmp_path, "lens.yaml", text.format(value, f", {lens}", source))
        with pytest.raises(LibraryError, match=f"they give {gives} degrees") as caught:
            library.add_file(wrong)
        assert advice in str(caught.value) and "lens.yaml:2" in str(caught.value)
        assert not own.exists()

        right = value.split(",")[0] + (", fov: 62.2, " if "persp" in value else ", fov: 69.2, ")
        library.add_file(write(tmp_path, "right.yaml", text.format(right, lens, source)))
        untold = text.format(value, ", resolution: [3280, 2464]", source)
        library.add_file(write(tmp_path, "untold.yaml", untold))

    def test_names_are_taken_once_over_all_kinds(self, own: Path, tmp_path: Path) -> None:
        file = write(tmp_path, "our-gel.yaml", GEL)
        with pytest.raises(LibraryError, match=r"already has a light 'smd-3528' \(built in\)"):
            library.add_file(file, name="smd-3528")
        library.add_file(file)
        with pytest.raises(LibraryError, match="one of your own parts"):
            library.add_file(file)
        with pytest.raises(LibraryError, match="can't be the name of a part"):
            library.add_file(file, name="our gel")

    def test_an_own_file_with_a_built_in_name_is_told_not_chosen(self, own: Path) -> None:
        (own / "materials").mkdir(parents=True)
        write(own / "materials", "acrylic.yaml", GEL)
        with pytest.raises(LibraryError, match=r"built in, and also.*acrylic\.yaml"):
            library.material("acrylic")
        assert library.material("pdms").kind == "dielectric"

    def test_an_entry_is_found_without_a_list_of_its_folder(
        self, own: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Else, reading all entries would take a time that grows with their number squared."""
        (own / "materials").mkdir(parents=True)
        write(own / "materials", "our-gel.yaml", GEL)
        write(own / "materials", ".hidden.yaml", GEL)
        assert library.names("material").count("our-gel") == 1
        assert ".hidden" not in library.names("material")
        monkeypatch.setattr(Path, "glob", None)
        assert library.entry("material", "our-gel").description == "Our gel"
        assert library.is_own("material", "our-gel")
        for other in ("../materials/our-gel", ".hidden", "", "our-gel/", "our-gel\0", "n" * 999):
            assert not library.is_own("material", other)

    def test_a_broken_own_file_harms_only_its_own_name(self, own: Path) -> None:
        (own / "lights").mkdir(parents=True)
        write(own / "lights", "broken.yaml", "value: {")
        assert "broken" in library.names("light")
        assert library.light("smd-3528").kind == "area"
        with pytest.raises(LibraryError, match=r"broken\.yaml"):
            library.light("broken")

    def test_a_damaged_ies_file_is_told_with_its_line(self, own: Path, lamp: Path) -> None:
        lamp.write_text(LAMP.replace("9 5 0", "9 5"))
        with pytest.raises(LibraryError, match=r"our-lamp\.ies:8.*"):
            add_lamp(lamp)
        assert not own.exists()

    def test_an_entry_whose_ies_file_is_not_beside_it(self, own: Path, tmp_path: Path) -> None:
        text = (FOLDER / "lights" / "round-5mm-30.yaml").read_text()
        with pytest.raises(LibraryError, match=r"round-5mm-30\.ies"):
            library.add_file(write(tmp_path, "ours.yaml", text))
        assert not own.exists()

    def test_what_kind_it_is_must_be_plain(self, own: Path, tmp_path: Path) -> None:
        file = write(tmp_path, "ours.yaml", "description: x\nvalue: {colour: 1}\n")
        with pytest.raises(LibraryError, match=r"ours\.yaml:2.*--kind"):
            library.add_file(file)

    def test_a_folder_that_can_not_be_written(self, own: Path, tmp_path: Path) -> None:
        own.write_text("a file")
        with pytest.raises(OutputError, match="OPTISENSE_LIBRARY"):
            library.add_file(write(tmp_path, "our-gel.yaml", GEL))

    @pytest.mark.parametrize("text", ["purple", "1,2", "1,1,2", "0,0,0", "red,green,blue"])
    def test_colours_that_are_none(self, text: str) -> None:
        with pytest.raises(LibraryError, match="no colour"):
            library.parse_colour(text)
        with pytest.raises(LibraryError, match="Did you mean 'green'"):
            library.parse_colour("gren")


class TestDesignsOnOtherMachines:
    @pytest.fixture
    def design(self, own: Path, lamp: Path) -> SensorDesign:
        add_lamp(lamp)
        design = sensors.build("gelsight-mini-ideal")
        red = design.lights["red"].model_dump()
        design.lights["red"] = LightGroup.model_validate({**red, "model": "our-lamp"})
        return design

    def test_a_saved_design_carries_its_own_lights(
        self, design: SensorDesign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        sensors.save_design(design, tmp_path / "sensor")
        monkeypatch.setenv("OPTISENSE_LIBRARY", str(tmp_path / "elsewhere"))
        opened = load_design(tmp_path / "sensor")
        emitter = library.emitter(opened.lights["red"])
        assert isinstance(emitter, IesEmitter) and emitter.file == "lights/our-lamp.ies"
        assert emitter.intensity_table().candela[0].tolist() == [9.0, 5.0, 0.0]
        assert opened.lights["green"].emitter is None
        assert sensors.check(opened) == sensors.check(sensors.build("gelsight-mini-ideal"))

    def test_the_design_in_memory_is_left_as_it_was(
        self, design: SensorDesign, tmp_path: Path
    ) -> None:
        sensors.save_design(design, tmp_path / "sensor")
        assert design.lights["red"].emitter is None
        plain = sensors.build("gelsight-mini-ideal")
        assert library.with_own_lights(plain) is plain

    def test_saving_the_opened_design_again_keeps_it_whole(
        self, design: SensorDesign, tmp_path: Path
    ) -> None:
        sensors.save_design(design, tmp_path / "sensor")
        sensors.save_design(load_design(tmp_path / "sensor"), tmp_path / "copy")
        assert (tmp_path / "copy" / "lights" / "our-lamp.ies").read_text() == LAMP

    def test_two_lights_that_claim_one_file(
        self, design: SensorDesign, own: Path, tmp_path: Path
    ) -> None:
        """Saved once, then the library's lamp changed and named by another group."""
        sensors.save_design(design, tmp_path / "sensor")
        opened = load_design(tmp_path / "sensor")
        (own / "lights" / "our-lamp.ies").write_text(LAMP.replace("9 5 0", "9 8 0"))
        green = opened.lights["green"].model_dump()
        opened.lights["green"] = LightGroup.model_validate({**green, "model": "our-lamp"})
        with pytest.raises(
            DesignError, match=r"red\.emitter' and .*green\.emitter'.*our-lamp\.ies"
        ):
            sensors.save_design(opened, tmp_path / "copy")

    def test_a_bare_name_from_another_machine_is_told(
        self, design: SensorDesign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("OPTISENSE_LIBRARY", str(tmp_path / "elsewhere"))
        with pytest.raises(DesignError, match=r"our-lamp.*library add"):
            sensors.check(design)
        with pytest.raises(LibraryError, match=r"our-lamp.*library add"):
            library.emitter(design.lights["red"])

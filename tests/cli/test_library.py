"""`optisense library`: what it prints, draws and stores."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner

from optisense import library
from optisense.cli import app
from optisense.library.loader import FOLDER

runner = CliRunner()

IES = FOLDER / "lights" / "round-5mm-30.ies"


def run(*arguments: str, answers: str | None = None) -> tuple[int, str]:
    """Exit code and everything that was printed."""
    result = runner.invoke(app, ["library", *arguments], input=answers)
    assert "Traceback" not in result.output
    return result.exit_code, result.output


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "own"
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(folder))
    return folder


def test_the_list_has_every_entry_and_marks_the_users_own(own: Path, tmp_path: Path) -> None:
    (tmp_path / "our-gel.yaml").write_text(run("show", "acrylic", "--yaml")[1])
    code, text = run("add", str(tmp_path / "our-gel.yaml"))
    assert code == 0, text
    assert str(own / "materials" / "our-gel.yaml") in text
    code, text = run("list")
    assert code == 0
    for kind in ("material", "coating", "light", "camera"):
        for name in library.names(kind):
            assert name in text
    assert [line.split()[1] for line in text.splitlines() if "yours" in line] == ["our-gel"]


def test_a_broken_part_is_told_and_the_rest_listed(own: Path) -> None:
    (own / "lights").mkdir(parents=True)
    (own / "lights" / "broken.yaml").write_text("value: {")
    code, text = run("list", "light")
    assert code == 0
    assert "broken.yaml" in text and "smd-3528" in text


@pytest.mark.parametrize("name", ["acrylic", "semi-specular", "chanzon-5730", "pi-v3-wide"])
def test_showing_tells_each_number_its_status_and_source(name: str) -> None:
    code, text = run("show", name)
    assert code == 0
    kind = next(k for k in ("material", "coating", "light", "camera") if name in library.names(k))
    entry = library.entry(kind, name)
    for field in entry.numbers():
        source = entry.source(field)
        assert source is not None
        line = next(line for line in text.splitlines() if line.startswith(field))
        assert source.status.value in line


def test_showing_computes_what_follows(own: Path) -> None:
    assert "beyond 42.1 degrees" in run("show", "acrylic")[1]
    assert "24.1 x 18.1 mm" in run("show", "pi-v2")[1]
    assert "half of the intensity at 15 degrees" in run("show", "osram-topled-black-30")[1]


def test_showing_draws_where_asked_and_nowhere_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run("show", "pi-v3")
    assert list(tmp_path.iterdir()) == []
    code, text = run("show", "pi-v3", "--out", "new/camera.png")
    assert code == 0, text
    assert Image.open(tmp_path / "new" / "camera.png").size[0] == 990
    code, _ = run("show", "pi-v3", "--out", "camera.jpg")
    assert code == 2


def test_an_ies_file_with_flags(own: Path) -> None:
    code, text = run(
        "add", str(IES), "--name", "ours", "--colour", "0,0.5,1", "--flux", "3.5",
        "--window", "5x5", "--package", "5x5x8.6", "--source", "our sphere",
        "--status", "measured",
    )  # fmt: skip
    assert code == 0, text
    entry = library.entry("light", "ours")
    assert isinstance(entry, library.LightEntry)
    assert entry.typical["own"].colour == (0.0, 0.5, 1.0)
    assert entry.typical["own"].flux == 3.5
    assert entry.window == (5.0, 5.0) and entry.package == (5.0, 5.0, 8.6)
    assert entry.sources["flux"].status == "measured"
    assert "ours" in run("list", "light")[1]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--flux", "3"), "--colour"),
        (("--colour", "red"), "--flux"),
        (("--colour", "rad", "--flux", "3"), "Did you mean 'red'"),
        (("--colour", "red", "--flux", "-3"), "above 0"),
        (("--colour", "red", "--flux", "3", "--window", "5"), "2 lengths"),
        (("--colour", "red", "--flux", "3", "--status", "guessed"), "measured"),
        (("--kind", "camera"), "light"),
    ],
)
def test_what_an_ies_file_lacks_is_asked_for(
    own: Path, arguments: tuple[str, ...], complaint: str
) -> None:
    code, text = run("add", str(IES), "--name", "ours", *arguments)
    assert code == 2
    assert complaint in text
    assert not own.exists()


def test_flags_of_ies_files_are_for_ies_files(own: Path, tmp_path: Path) -> None:
    (tmp_path / "gel.yaml").write_text(run("show", "acrylic", "--yaml")[1])
    code, text = run("add", str(tmp_path / "gel.yaml"), "--flux", "3")
    assert code == 2 and "--flux" in text


def test_a_name_that_is_taken(own: Path) -> None:
    code, text = run("add", str(IES), "--colour", "red", "--flux", "3")
    assert code == 2
    assert "round-5mm-30" in text and "--name" in text


def test_a_folder_that_can_not_be_written_is_a_failure(own: Path) -> None:
    own.write_text("a file")
    code, text = run("add", str(IES), "--name", "ours", "--colour", "red", "--flux", "3")
    assert code == 1
    assert "OPTISENSE_LIBRARY" in text


class TestTuning:
    @pytest.fixture
    def file(self, tmp_path: Path) -> Path:
        path = tmp_path / "cam.json"
        path.write_text('{"rpi.noise": {"reference_constant": 0, "reference_slope": 3.67}}')
        return path

    def test_a_tuning_file_becomes_a_camera(self, own: Path, file: Path) -> None:
        code, _ = run("add", "camera", "--tuning", str(file), "--like", "pi-v2", "--name", "us")
        assert code == 0 and (own / "cameras" / "us.yaml").is_file()
        assert "full_well 4865.7" in run("show", "us")[1]

    @pytest.mark.parametrize(
        ("arguments", "says"),
        [
            (["camera", "--tuning", "FILE"], "name a camera of the library"),
            (["lamp", "--tuning", "FILE", "--like", "pi-v2"], "a tuning file describes a camera"),
            (
                ["camera", "--tuning", "FILE", "--like", "pi-v2", "--flux", "3"],
                "combined with --tuning",
            ),
            (["camera", "--tuning", "FILE", "--like", "pi-v2", "--temperature", "5"], "5 K is no"),
            (["a.yaml", "--like", "pi-v2"], "it needs --tuning"),
            (["camera", "--tuning", "no.json", "--like", "pi-v2"], "can't read the tuning file"),
        ],
    )
    def test_what_makes_no_sense_is_told(
        self, own: Path, file: Path, arguments: list[str], says: str
    ) -> None:
        given = [str(file) if each == "FILE" else each for each in arguments]
        code, text = run("add", *given)
        assert code == 2 and says in " ".join(text.replace("│", " ").split())
        assert not (own / "cameras").exists()

"""Things of other packages by entry points: found, named, refused and explained."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warm_python

import optisense.design.lenses  # noqa: F401  defines further kinds
from optisense import sensors
from optisense.design.kinds import KindModel
from optisense.engine.failures import as_data
from optisense.engine.requests import listed
from optisense.errors import ContactError, DesignError, SearchError
from optisense.geometry import IndenterKind, Sphere, TriangleMesh, quantity, register_indenter
from optisense.geometry.indenter_kinds import INDENTERS, indenter_from_plain
from optisense.registry import Registry
from optisense.search.methods import METHODS
from optisense.sensors.registry import SENSORS

MODULE = """
import dataclasses

import optisense as ots
from optisense.geometry import IndenterKind, Sphere, quantity
from optisense.search.methods import Method
from optisense.workshop import ShapeFormat


@dataclasses.dataclass(frozen=True)
class Pea(IndenterKind):
    kind, title, help = "pea", "Pea", "A small ball."
    size: float = quantity("mm", "The diameter.", 1.0, low=0.1)

    def mesh(self, reach, facet_error=4e-4):
        return Sphere(self.size / 2).mesh(reach, facet_error)


@dataclasses.dataclass(frozen=True)
class Dent(Pea):
    kind = "dent"

    def mesh(self, reach, facet_error=4e-4):
        raise ValueError("my mesh bug")


def wide_mini():
    return ots.set_value(ots.load("gelsight-mini-ideal"), "camera.fov", 55.0)


class Middle(Method):
    name, summary = "middle", "the middle of the space"

    def __init__(self, problem):
        super().__init__(problem)
        self._asked = False

    def ask(self):
        return self.space.from_unit([[0.5] * self.space.size] * (not self._asked))

    def tell(self, vectors, outcomes):
        self._asked = True


def write(path, title, shapes):
    path.write_text(str([shape.name for shape in shapes]))


NAMES = ShapeFormat(".txt", write, holds_all=True)
"""

ENTRY_POINTS = """
[optisense.indenters]
pea = my_parts:Pea
dent = my_parts:Dent
[optisense.sensors]
wide-mini = my_parts:wide_mini
broken-mini = my_parts:no_such_thing
malformed-mini = no module
[optisense.methods]
middle = my_parts:Middle
[optisense.formats]
names = my_parts:NAMES
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of installed packages with one that brings something to each registry."""
    folder = tmp_path_factory.mktemp("environment") / "site-packages"
    folder.mkdir()
    (folder / "my_parts.py").write_text(MODULE)
    info = folder / "my_parts-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-parts\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    return folder


def command(site: Path, *arguments: str) -> list[str]:
    """An `optisense` command in a process that has the package."""
    start = f"import sys; sys.path.insert(0, {str(site)!r}); from optisense.cli import main; main()"
    return [str(warm_python.programs() / "python"), "-c", start, *arguments]


def run(site: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(site, *arguments), cwd=folder, capture_output=True, text=True)


def test_a_package_brings_a_sensor_an_indenter_and_a_picture_of_both(
    site: Path, tmp_path: Path
) -> None:
    done = run(
        site, tmp_path, "render", "wide-mini", "--contact", "pea:2@0,0:0.5", "--photons", "20000",
        "--resolution", "40x30", "--out", "touch",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "touch" / "image.png").is_file()


def test_a_package_brings_a_method(site: Path, tmp_path: Path) -> None:
    done = run(
        site, tmp_path, "search", "wide-mini", "--vary", "camera.fov=50:60", "--method", "middle",
        "--objective", "aoap", "--out", "study",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "55" in done.stdout


def test_a_package_brings_a_format(site: Path, tmp_path: Path) -> None:
    done = run(site, tmp_path, "export", "wide-mini", "--format", "names", "--out", "parts")
    assert done.returncode == 0, done.stderr
    assert "gel" in next((tmp_path / "parts").glob("*.txt")).read_text()


def test_a_package_that_does_not_fit_is_named(site: Path, tmp_path: Path) -> None:
    done = run(site, tmp_path, "check", "broken-mini")
    assert done.returncode == 2
    assert "my-parts" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_package_that_cannot_be_loaded_leaves_the_others_in_all_lists(tmp_path: Path) -> None:
    groups = ("emitters", "materials", "sensors", "objectives", "methods")
    info = tmp_path / "old-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: old\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "".join(f"[optisense.{group}]\nold-{group} = no_such_module:Old\n" for group in groups)
    )
    lists = ("kinds", "sensors", "objectives", "methods")
    with subprocess.Popen(
        command(tmp_path, "engine"), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as engine:
        assert engine.stdin is not None and engine.stdout is not None
        answers = {}
        hello = {"protocol": 1, "client": "a test", "folder": str(tmp_path)}
        for do, fields in [("hello", hello), *((each, {}) for each in lists)]:
            engine.stdin.write(json.dumps({"id": do, "do": do, **fields}) + "\n")
            engine.stdin.flush()
            answers[do] = json.loads(engine.stdout.readline())
            assert answers[do]["ok"], answers[do]
        engine.stdin.close()
    unavailable = [row for each in lists for row in answers[each]["result"]["unavailable"]]
    assert sorted(row["name"] for row in unavailable) == sorted(f"old-{each}" for each in groups)
    assert all("no_such_module" in row["message"] for row in unavailable)
    assert "dielectric" in answers["kinds"]["result"]["materials_of_role"]["support"]

    methods = run(tmp_path, tmp_path, "search", "--methods")
    assert methods.returncode == 0
    assert [line.split()[0] for line in methods.stdout.splitlines()] == list(METHODS.built_in)
    assert "old-methods    unavailable: " in methods.stderr and "of old" in methods.stderr

    schema = "from optisense.design import SensorDesign; print(SensorDesign.model_json_schema())"
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {schema}"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def installed(
    folder: Path, monkeypatch: pytest.MonkeyPatch, points: Mapping[str, str]
) -> Registry[object]:
    """A registry of `things` with packages that add one thing each: entry points by package."""
    for package, point in points.items():
        info = folder / f"{package.replace('-', '_')}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[optisense.no-such-group]\n{point}\n")
    monkeypatch.syspath_prepend(folder)
    return things()


def test_a_name_of_two_packages_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = {"lab-a": "line = os:getcwd", "lab-b": "line = os:getpid"}
    registry = installed(tmp_path, monkeypatch, points)
    with pytest.raises(SearchError, match="the thing 'line' is in several packages: lab-a, lab-b"):
        registry.find("line")


def test_a_package_with_a_built_in_name_is_in_the_list_of_what_is_not_available(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    registry = installed(tmp_path, monkeypatch, {"lab-a": "home = os:getcwd"})
    assert registry.find("home") is Path
    rows, unavailable = listed(registry, lambda name, thing: {"name": name})
    assert rows == [{"name": "home"}]
    message = "the built-in thing 'home' is used, and not that of lab-a"
    assert unavailable[0]["message"].startswith(message)


def test_a_package_with_a_name_in_upper_case_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    registry = installed(tmp_path, monkeypatch, {"lab-a": "Fancy = os:getcwd"})
    with pytest.raises(SearchError, match="'Fancy' can't be the name of a thing") as found:
        registry.find("Fancy")
    assert found.value.where == "os:getcwd, of lab-a"


def test_a_name_in_upper_case_is_in_a_registry_as_it_is_found() -> None:
    registry = things()
    registry.register("line", run)
    for name in ("HOME", " Line "):
        assert registry.find(name)
        assert name in registry
    assert "moon" not in registry and 3 not in registry


def test_what_cannot_be_described_is_unavailable_unless_it_is_built_in() -> None:
    registry = things()
    registry.register("line", run)

    def row(name: str, thing: object) -> dict[str, object]:
        return {"name": name, "size": 1 / (name != bad)}

    bad = "line"
    rows, unavailable = listed(registry, row)
    assert rows == [{"name": "home", "size": 1.0}]
    assert unavailable[0]["name"] == "line"
    assert unavailable[0]["message"].startswith("ZeroDivisionError: division by zero")
    bad = "home"
    with pytest.raises(ZeroDivisionError):
        listed(registry, row)


def test_a_failure_in_a_package_is_not_called_a_defect_of_this_one(
    site: Path, tmp_path: Path
) -> None:
    done = run(
        site, tmp_path, "render", "gelsight-mini-ideal", "--contact", "dent:2@0,0:0.5", "--out", "t"
    )
    assert done.returncode == 1
    line = MODULE[: MODULE.index("my mesh bug")].count("\n") + 1
    assert "error: mesh() of the indenter 'dent' fails: ValueError: my mesh bug" in done.stderr
    assert f"where: {site / 'my_parts.py'}:{line}\n" in done.stderr
    assert "Repair this file or the package that contains it" in done.stderr
    assert "defect" not in done.stderr


def test_a_failure_in_a_file_of_a_user_names_its_line_in_the_engine() -> None:
    with pytest.raises(ZeroDivisionError) as own:
        _ = 1 / 0
    told = as_data(own.value)
    assert (told["kind"], told["message"]) == (
        "OwnCodeError",
        "ZeroDivisionError: division by zero",
    )
    assert told["where"].startswith(f"{__file__}:")


def test_a_failure_in_this_package_or_one_that_it_needs_is_a_defect_of_it() -> None:
    with pytest.raises(AttributeError) as ours:
        things().register(None, things)  # type: ignore[arg-type]
    with pytest.raises(np.linalg.LinAlgError) as installed:
        np.linalg.inv(np.zeros((2, 2)))
    for found in (ours, installed):
        error = found.value.with_traceback(found.tb.tb_next)  # without the frame of this test
        told = as_data(error)
        assert told["kind"] == "InternalError"
        assert "defect of OptiSense" in told["hint"]


def things() -> Registry[object]:
    return Registry("thing", "optisense.no-such-group", SearchError, {"home": "pathlib:Path"})


def test_the_same_name_is_taken_once() -> None:
    registry = things()
    registry.register("line", run)
    registry.register("line", run)  # a file that was run once more
    with pytest.raises(SearchError, match="already a thing 'line'"):
        registry.register("line", things)
    with pytest.raises(SearchError, match="already a thing 'home'"):
        registry.register("home", things)


@pytest.mark.parametrize("name", ["", "Line", " line", "a:b", "a@b", "a/b"])
def test_names_that_text_could_not_hold_are_refused(name: str) -> None:
    with pytest.raises(SearchError, match="can't be the name"):
        things().register(name, run)


def test_a_misspelt_name_gets_the_near_match() -> None:
    assert things().find("home") is Path
    with pytest.raises(SearchError, match="Did you mean 'home'"):
        things().find("hoem")


def no_design() -> None:
    """A function of a sensor that has no result."""


@dataclasses.dataclass(frozen=True)
class Unnamed(IndenterKind):
    """An indenter that works, but has no name."""

    def mesh(self, reach: float, facet_error: float = 4e-4) -> TriangleMesh:
        return Sphere(1.0).mesh(reach, facet_error)


class Undecorated(Unnamed):
    kind = "undecorated"
    size: float = quantity("mm", "The diameter.")


@dataclasses.dataclass(frozen=True)
class Plain(Unnamed):
    kind = "plain"
    size: float = quantity("mm", "The diameter.")
    colour: str = "red"


@dataclasses.dataclass(frozen=True)
class Reading(Plain):
    kind = "reading"

    @classmethod
    def from_text(cls, text: str) -> Reading:
        return cls(1.0, text)

    @classmethod
    def from_plain(cls, values: Mapping[str, Any]) -> Reading:
        return cls(1.0, values["colour"])


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (no_design, "not a subclass of IndenterKind"),
        (Unnamed, "no attribute 'kind'"),
        (Undecorated, "no dataclass"),
        (Plain, "fields without a quantity: colour"),
    ],
)
def test_an_indenter_that_could_not_be_read_is_refused(kind: Any, words: str) -> None:
    with INDENTERS.forgetting(), pytest.raises(ContactError, match=words):
        register_indenter(kind)
    with INDENTERS.forgetting(), pytest.raises(ContactError, match=words):
        INDENTERS.register("name", kind)


def test_an_indenter_may_read_itself() -> None:
    with INDENTERS.forgetting():
        register_indenter(Reading)
        assert indenter_from_plain({"kind": "reading", "colour": "blue"}) == Reading(1.0, "blue")


def test_a_sensor_that_is_no_design_is_refused() -> None:
    with SENSORS.forgetting():
        with pytest.raises(DesignError, match="'odd' is no function"):
            SENSORS.register("odd", "a text")  # type: ignore[arg-type]
        SENSORS.register("odd", no_design)  # type: ignore[arg-type]
        with pytest.raises(DesignError, match="returned None, which is no SensorDesign") as found:
            sensors.load("odd")
        assert found.value.where == f"{__file__}: no_design"


def test_every_interface_refuses_what_is_no_kind_of_it() -> None:
    interfaces = [each for each in KindModel.__subclasses__() if "kinds" in vars(each)]
    assert len(interfaces) == 8
    for interface in interfaces:
        for given in (no_design, KindModel, Registry):
            with pytest.raises(DesignError, match=f"not a subclass of {interface.__name__}"):
                interface.kinds.register("odd", given)


def built_in_registries() -> list[Registry]:
    """All registries of this package."""
    from optisense.objectives.registry import OBJECTIVES
    from optisense.robots.formats import ROBOT_FORMATS
    from optisense.workshop.formats import FORMATS

    kinds = [kind.kinds for kind in KindModel.__subclasses__()]
    return [INDENTERS, OBJECTIVES, ROBOT_FORMATS, METHODS, SENSORS, FORMATS, *kinds]


def test_every_built_in_name_can_be_loaded() -> None:
    """A registry knows its modules by name only, so that a renamed module would go unnoticed."""
    registries = built_in_registries()
    assert len(registries) == 14
    for registry in registries:
        assert registry.names()
        for name in registry.names():
            registry.find(name)

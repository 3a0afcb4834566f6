"""Kinds of other packages are found by their entry points and used through their methods."""

import json
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike
from pydantic import Field

from optisense import OpticalModel, sensors
from optisense.array_types import FloatArray
from optisense.design import (
    LightGroup,
    LightModel,
    check_design,
    load_design,
    save_design,
    set_value,
)
from optisense.design.emitters import SpotEmitter, Window
from optisense.design.fields import Positive
from optisense.design.materials import CoatingModel, Dielectric, Material, Medium, Reflection
from optisense.design.parts import Role
from optisense.errors import DesignError, LibraryError
from optisense.workshop.shapes import shapes

COSINE_POWER = '''"""A lamp of another package."""

from typing import Literal

import numpy as np

from optisense.design import LightModel
from optisense.design.fields import Positive


class CosinePower(LightModel):
    """A point whose intensity falls with a power of the cosine."""

    kind: Literal["cosine-power"] = "cosine-power"
    power: Positive

    def relative_intensity(self, polar, azimuth=0.0):
        cosine = np.cos(np.radians(np.minimum(polar, 90.0)))
        return np.maximum(cosine, 0.0) ** self.power + 0.0 * np.asarray(azimuth)
'''


def test_a_kind_of_an_installed_package_is_in_files_and_its_table_has_its_closed_form(
    tmp_path: Path,
) -> None:
    packages = tmp_path / "packages"
    info = packages / "our_lamps-1.0.dist-info"
    info.mkdir(parents=True)
    (packages / "our_lamps.py").write_text(COSINE_POWER)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: our_lamps\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[optisense.emitters]\ncosine-power = our_lamps:CosinePower\n"
    )
    code = f"""
import json
from optisense import OpticalModel, sensors
from optisense.design import load_design, save_design
design = sensors.load("builtin:gelsight-mini-ideal")
group = next(iter(design.lights.values()))
group.emitter = {{"kind": "cosine-power", "power": 4.0}}
save_design(design, {str(tmp_path / "sensor")!r})
lamp = next(iter(load_design({str(tmp_path / "sensor")!r}).lights.values())).emitter
print(json.dumps([type(lamp).__module__, lamp.power, lamp.half_angle(), lamp.in_words()]))
"""
    environment = {**os.environ, "PYTHONPATH": str(packages)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    module, power, half, words = json.loads(done.stdout)
    assert (module, power) == ("our_lamps", 4.0)
    assert half == pytest.approx(np.degrees(np.arccos(0.5**0.25)), abs=0.01)
    assert words == f"cosine-power, half at {half:.3g} degrees"


def test_without_the_package_the_design_is_refused_with_the_kinds_that_are_known(
    tmp_path: Path,
) -> None:
    design = sensors.load("builtin:gelsight-mini-ideal")
    next(iter(design.lights.values())).emitter = SpotEmitter(beam=10.0, cutoff=20.0)
    save_design(design, tmp_path / "sensor")
    file = tmp_path / "sensor" / "design.yaml"
    file.write_text(file.read_text().replace("kind: spot", "kind: spott"))
    with pytest.raises(DesignError, match="unknown kind 'spott' at 'lights") as caught:
        load_design(tmp_path / "sensor")
    assert "spot" in str(caught.value.hint)
    with pytest.raises(DesignError, match="no kind of emitter 'spott'"):
        LightModel.kinds.find("spott")


def test_two_kinds_of_one_name_are_refused() -> None:
    with pytest.raises(DesignError, match="already a kind of emitter 'spot'"):

        class Other(LightModel):
            kind: Literal["spot"] = "spot"

    assert LightModel.kinds.find("spot") is SpotEmitter


class Ring(LightModel):
    """A lamp that shines to a cone's surface, more to one side; its sum may be wrong."""

    kind: Literal["test-ring"] = "test-ring"
    angle: Positive = Field(default=50.0, le=80.0)
    sign: float = 1.0

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        ring = np.exp(-(((np.asarray(polar, float) - self.angle) / 5.0) ** 2))
        side = 1.0 + 0.5 * np.cos(np.radians(np.asarray(azimuth, float)))
        return np.asarray(self.sign * ring * side / 1.5)


@pytest.mark.parametrize("angle", [10.0, 50.0, 75.0])
def test_the_table_of_any_kind_is_its_intensity(angle: float) -> None:
    ring = Ring(angle=angle)
    random = np.random.default_rng(1)
    polar, azimuth = random.uniform(0.0, 180.0, 2000), random.uniform(0.0, 360.0, 2000)
    table = ring.intensity()
    wanted = ring.relative_intensity(polar, azimuth)
    np.testing.assert_allclose(table.at(polar, azimuth), wanted, atol=1e-3)
    assert len(table.azimuth) > 1


def test_a_narrow_beam_is_not_lost_between_angles() -> None:
    class Pencil(LightModel):
        kind: Literal["test-pencil"] = "test-pencil"

        def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
            return np.asarray((np.asarray(polar) < 0.02) + 0.0 * np.asarray(azimuth))

    table = Pencil().intensity()
    assert table.at(np.array([0.015]), np.zeros(1)) == 1.0
    assert table.at(np.array([0.025]), np.zeros(1)) == 0.0
    assert len(table.azimuth) == 1  # symmetric about its axis


def test_an_intensity_below_zero_is_a_problem_of_the_design() -> None:
    design = sensors.load("builtin:gelsight-mini-ideal")
    name = next(iter(design.lights))
    group = LightGroup.model_validate(
        {**design.lights[name].model_dump(), "emitter": Ring(sign=-1.0)}
    )
    design.lights[name] = group
    found = [problem for problem in check_design(design) if "test-ring" in problem.message]
    assert [problem.severity for problem in found] == ["error"]


class Flawed(LightModel):
    """A lamp whose methods return what a test wants."""

    kind: Literal["test-flawed"] = "test-flawed"
    face: Any = None
    power: Any = None
    behind: float = 0.0

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        light = np.where(np.asarray(polar) <= 90.0, 1.0, self.behind)
        return np.asarray(light + 0.0 * np.asarray(azimuth))

    def window(self) -> Any:
        return self.face

    def cosine_power(self) -> Any:
        return self.power


class Wrong(CoatingModel):
    """A coating whose reflection is what a test wants."""

    kind: Literal["test-wrong"] = "test-wrong"
    result: Any = None

    def reflection(self) -> Any:
        return self.result if self.result is not None else int("no reflection")


class Fog(Material):
    """A material of no part, whose medium is what a test wants."""

    roles: ClassVar[tuple[Role, ...]] = ()

    kind: Literal["test-fog"] = "test-fog"
    result: Any = None

    def medium(self) -> Any:
        return self.result

    def check(self) -> None:
        if self.result is None:
            raise KeyError("my table")


def problems(**changes: Any) -> list[tuple[str, str, str | None]]:
    """Message, place and hint of the problems of a design with a lamp, coating or material."""
    design = sensors.load("builtin:gelsight-mini-ideal")
    if "emitter" in changes:
        group = next(iter(design.lights.values()))
        group.emitter = changes["emitter"]
    if "coating" in changes:
        design.coating = changes["coating"]
    if "material" in changes:
        design.materials["fog"] = changes["material"]
    found = [problem for problem in check_design(design) if problem.severity == "error"]
    return [(problem.message, problem.where, problem.hint) for problem in found]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"face": ("disc", (1.0, 1.0))}, "the window of an emitter"),
        ({"face": Window("oval", (1.0, 1.0))}, "oval"),  # type: ignore[arg-type]
        ({"face": Window("disc", (1.0, 0.0))}, "the window of an emitter"),
        ({"power": "2"}, "the cosine power of an emitter"),
        ({"behind": -0.1}, "not negative from 0 to 180 degrees"),
        ({"behind": np.nan}, "must be finite"),
    ],
)
def test_a_lamp_that_returns_what_cannot_be_simulated_is_refused(
    fields: dict[str, Any], words: str
) -> None:
    ((message, where, _),) = problems(emitter=Flawed(**fields))
    assert words in message and "test-flawed" in message
    assert where.startswith("lights.") and where.endswith(".emitter")


@pytest.mark.parametrize("result", [1.0, [1.0, 0.5], np.ones(3), None])
def test_an_intensity_that_is_no_array_over_the_angles_is_refused(
    result: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Flawed, "relative_intensity", lambda *given: result)
    with pytest.raises(LibraryError, match="the intensity of an emitter") as found:
        Flawed().verify()
    assert found.value.hint == "Return an array in the shape of the angles"


def test_reflections_and_media_of_arrays_are_those_of_tuples() -> None:
    half = Reflection(np.full(3, 0.5), eta=[1.5, 1.5, 1.5])  # type: ignore[arg-type]
    assert half == Reflection((0.5, 0.5, 0.5), eta=(1.5, 1.5, 1.5)) and hash(half)
    absorbing = Medium(1.4, absorption=np.full(3, 0.1))  # type: ignore[arg-type]
    assert absorbing == Medium(1.4, absorption=(0.1, 0.1, 0.1))


def test_a_dict_in_place_of_a_material_a_part_or_a_light_is_what_it_says(tmp_path: Path) -> None:
    design = sensors.load("builtin:gelsight-mini-ideal")
    before = design.copy()
    gel = str(design.parts["gel"].material)
    design.materials[gel] = {"kind": "dielectric", "ior": 1.4}  # type: ignore[assignment]
    design.parts |= {"gel": design.parts["gel"].model_dump()}  # type: ignore[dict-item]
    design.lights.update(red=design.lights["red"].model_dump())
    design.lights.setdefault("blue", {})  # type: ignore[arg-type]
    assert design.materials[gel] == Dielectric(ior=1.4)
    assert (design.parts, design.lights) == (before.parts, before.lights)
    copied = pickle.loads(pickle.dumps(design))
    copied.parts["gel"] = copied.parts["gel"].model_dump()
    for each in (design, copied):
        sensors.check(each)
        assert "red lights" in each._repr_html_()
        assert {shape.name for shape in shapes(each)} >= {"gel"}
    save_design(copied, tmp_path)
    assert load_design(tmp_path) == design
    for bad in ({"kind": "dielectric", "ior": -1.0}, "acrylic"):
        with pytest.raises(DesignError, match=rf"'materials\.{gel}"):
            design.materials[gel] = bad  # type: ignore[assignment]
    assert design.materials[gel] == Dielectric(ior=1.4)


def test_an_unknown_kind_may_be_of_a_package_that_is_not_installed() -> None:
    with pytest.raises(DesignError, match="unknown kind 'powder' at 'coating") as found:
        sensors.load("builtin:gelsight-mini-ideal").coating = {"kind": "powder"}  # type: ignore[assignment]
    hint = str(found.value.hint)
    assert hint.startswith("Known: flake, ") and hint.endswith("package that is not installed here")


def test_a_lamp_that_returns_what_can_be_simulated_is_not_refused() -> None:
    assert not problems(emitter=Flawed(face=Window("rectangle", (1.0, 2.0)), behind=0.1, power=1))


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (0.5, "returned 0.5, which is no Reflection"),
        (Reflection((1.0, 1.0, 1.2)), "reflectance"),
        (Reflection(0.5), "reflectance"),  # type: ignore[arg-type]
        (Reflection(specularity=-0.1), "specularity"),
        (Reflection(roughness=1.5), "roughness"),
        (Reflection(eta=(1.0, 0.0, 1.0)), "eta"),
        (Reflection(k=(0.0, np.inf, 0.0)), " k "),
    ],
)
def test_a_coating_that_returns_what_cannot_be_simulated_is_refused(
    result: object, words: str
) -> None:
    ((message, where, _),) = problems(coating=Wrong(result=result))
    assert words in message and "the kind of coating 'test-wrong'" in message
    assert where == "coating"


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (1.5, "no Medium"),
        (Medium(0.0), "ior"),
        (Medium(1.5, 2.0), "roughness"),
        (Medium(1.5, absorption=(0.1, 0.1)), "absorption"),  # type: ignore[arg-type]
        (Medium(1.5, indices=(1.5, 1.5, np.nan)), "indices"),
    ],
)
def test_a_medium_that_cannot_be_simulated_is_refused(result: object, words: str) -> None:
    ((message, where, _),) = problems(material=Fog(result=result))
    assert words in message and where == "materials.fog"


class Bright(CoatingModel):
    """A coating whose class allows any reflectance."""

    kind: Literal["test-bright"] = "test-bright"
    white: float

    def reflection(self) -> Reflection:
        return Reflection((self.white, self.white, self.white))


def test_a_coating_that_returns_more_light_than_it_gets_is_not_rendered() -> None:
    possible = set_value(sensors.build("gelsight-mini-ideal"), "coating", Bright(white=0.5))
    impossible = set_value(possible, "coating.white", 1.5)
    used = OpticalModel(possible, "llvm")
    with pytest.raises(DesignError, match=r"reflectance is \(1\.5"):
        used.set_design(impossible)
    assert used.design == possible
    with pytest.raises(DesignError, match=r"reflectance is \(1\.5"):
        OpticalModel(impossible, "llvm")


def test_an_exception_in_a_kind_is_a_problem_at_its_value_with_the_line_of_the_class() -> None:
    ((message, where, hint),) = problems(coating=Wrong())
    assert message.startswith("the kind of coating 'test-wrong' fails: ValueError: invalid literal")
    assert where == "coating"
    assert hint is not None and hint.startswith(f"Repair {__file__}:")
    ((message, where, hint),) = problems(material=Fog())
    assert "KeyError: 'my table'" in message and where == "materials.fog"

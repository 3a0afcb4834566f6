"""Texts that people write on the command line: contacts, search spaces, options of commands."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import typer
from hypothesis import strategies as st

import optisense as ots
import optisense.commands.comparing
import optisense.commands.rendering
import optisense.commands.sampling
import optisense.commands.scoring
from optisense.cli.from_options import options_of
from optisense.commands.options import CommandOptions
from optisense.geometry import parse_contact
from optisense.search import SearchSpace
from optisense.search.space.text import parse_errors, parse_vary

from .cases import Case
from .kinds import ASSETS, RefusedError, kind
from .strategies import strange_numbers, strange_texts

CONTACTS = (
    "sphere:1.5@0,0:0.8", "cylinder:2@1,-3:0.5:90", "plane:0,5@0,0:0.3", "sphere:3@0,0:2N",
    "mesh:screw.stl,1000@2,2:0.4", "sphere:1@0,0,5:0.5", "cylinder:2,10,3@0,0:0.2",
)  # fmt: skip
VARIED = (
    "coating.specularity=0:1", "camera.position.x=+-2:5", "camera.fov=40,45,50",
    "cages.bend.points=+-1/symmetry=x/axes=xz/points=0,2,6-8", "parts.gel.material=[gel, white]",
    "camera.position.z=+-0.2", "parts.gel.role=[elastomer, support]",
    "camera.noise=[null, {gain: 1}]",
    "coating=[{library: a}, {library: b, reflectance: [1, 1, 1], eta: [1, 1, 1], k: [1, 1, 1]}]",
    "parts.gel.material=[[gel, 1], [white, {a: 2}]]",
)  # fmt: skip


@st.composite
def _spoilt_texts(draw: st.DrawFn, texts: tuple[str, ...]) -> Case:
    """A text with numbers, words or letters changed."""
    text = draw(st.sampled_from(texts))
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(text)))
        end = at + draw(st.integers(0, 4))
        text = text[:at] + str(draw(strange_texts | strange_numbers)) + text[end:]
    return {"text": text.encode("utf-8", "replace")}


def _text(folder: Path) -> str:
    return (folder / "text").read_bytes().decode("utf-8", "replace")


@kind("contact", _spoilt_texts(CONTACTS))
def read_contact(folder: Path) -> None:
    """Read what presses, and where."""
    parse_contact(_text(folder))


@cache
def _sensor() -> Any:
    from optisense.optics._ray_model import RayModel

    return RayModel(ots.load("gelsight-mini-ideal"), "llvm")


@st.composite
def _presses(draw: st.DrawFn) -> Case:
    """A contact whose text is right, with numbers of any size."""
    size = st.floats(1e-6, 1e3) | strange_numbers
    near = st.floats(-12.0, 12.0) | strange_numbers
    shape = draw(st.sampled_from(["sphere:{}", "cylinder:{}", "cylinder:{},{}", "plane:{},{}",
                                  "cylinder:{},{},{}", "plane:{},{},{}"]))  # fmt: skip
    shape = shape.format(*(draw(size) for _ in range(3)))
    depth = draw(st.floats(1e-6, 4.0) | size)
    unit = draw(st.sampled_from(["", "", "N"]))
    return {"text": f"{shape}@{draw(near)},{draw(near)}:{depth}{unit}".encode()}


@kind("press", _presses())
def press(folder: Path) -> None:
    """Press it into the elastic skin of a GelSight Mini."""
    contact = parse_contact(_text(folder))
    mesh = _sensor().place(contact)
    assert np.isfinite(mesh.vertices).all()
    pressed = _sensor().pressed([contact])
    assert np.isfinite(pressed.contacts[0].force).all()


@kind("search-space", _spoilt_texts(VARIED))
def read_space(folder: Path) -> None:
    """Read what a search varies, and bind it to a design."""
    text = _text(folder)
    path, specification = parse_vary(text)
    SearchSpace({path: specification}).bind(ots.load(ASSETS / "design-v1"))
    parse_errors([text])


MODELS: dict[str, type[CommandOptions]] = {}


def _collect(model: type[CommandOptions]) -> None:
    for each in model.__subclasses__():
        MODELS[each.__name__] = each
        _collect(each)


_collect(CommandOptions)

USUAL_TEXTS = (
    "24x18", "auto", "0.3:1", "3000", "fine", "5s", "ray_resolution=[16,12]", "a=1e-3", "0.01",
    "coating.specularity=0:1", "sphere:1@0,0:0.3", "llvm", "red=2", "aoap", "8", "cma-es",
)  # fmt: skip


@st.composite
def _options(draw: st.DrawFn) -> Case:
    """Options of a command, as texts."""
    name = draw(st.sampled_from(sorted(MODELS)))
    fields = sorted(MODELS[name].model_fields)
    usual = st.sampled_from(USUAL_TEXTS)
    word = usual | (strange_texts | strange_numbers).map(str)
    joined = st.tuples(usual, word).map(lambda both: both[0].partition("=")[0] + "=" + both[1])
    one = word | joined
    values = draw(st.dictionaries(st.sampled_from(fields), one | st.lists(one, max_size=3),
                                  min_size=1, max_size=3))  # fmt: skip
    return {"text": json.dumps([name, values]).encode()}


@kind("options", _options())
def read_options(folder: Path) -> None:
    """Read the options of a command."""
    name, values = json.loads(_text(folder))
    try:
        options_of(MODELS[name], values)
    except typer.BadParameter as error:
        raise RefusedError(error.format_message()) from None

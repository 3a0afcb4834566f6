"""Files that are too large, too many or not regular are refused before they are processed."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from optisense.design import load_design
from optisense.design import storage as design_files
from optisense.design.ies import read_ies
from optisense.errors import OptiSenseError

GIBIBYTE = 2**30
"""Number of bytes of a gibibyte, in which sizes of files are given here."""


def more(section: str, entry: str, count: int) -> Callable[[Path], None]:
    """Adds entries to a section of the design file; ``@`` in an entry is its number."""

    def spoil(folder: Path) -> None:
        file = folder / "design.yaml"
        entries = "".join(f"  {entry.replace('@', str(n))}\n" for n in range(count))
        text = re.sub(rf"(?m)^{section}:.*\n", lambda found: found[0] + entries, file.read_text())
        file.write_text(text)

    return spoil


def appended(text: str) -> Callable[[Path], None]:
    """Adds a text to the end of the design file."""

    def spoil(folder: Path) -> None:
        with (folder / "design.yaml").open("a") as file:
            file.write(text)

    return spoil


def replaced(name: str, make: Callable[[Path], object]) -> Callable[[Path], None]:
    """Replacement of a file by something else."""

    def spoil(folder: Path) -> None:
        path = folder / name
        path.unlink()
        make(path)

    return spoil


def named(value: str) -> Callable[[Path], None]:
    """Gives the mesh of the sensing surface another name."""

    def spoil(folder: Path) -> None:
        file = folder / "design.yaml"
        file.write_text(file.read_text().replace("mesh: meshes/skin.obj", f"mesh: {value}", 1))

    return spoil


def sparse(path: Path) -> None:
    """A file of 8 GiB that takes no room on the disk."""
    with path.open("wb") as file:
        file.truncate(8 * GIBIBYTE)


def many_triangles(path: Path) -> None:
    """An STL file whose header promises two million triangles, of this size but without any."""
    path.write_bytes(bytes(80) + struct.pack("<I", 2_000_000))
    os.truncate(path, 84 + 50 * 2_000_000)


MESH = "meshes/gel.obj"
LAMP = "lamps/lamp.ies"
MILLION = 1_000_000

SPOILT = {
    "list": (appended("extra: [" + "1," * MILLION + "1]\n"), "more than 300,000 values"),
    "keys": (more("parts", "k@: 1", 400_000), "more than 300,000 values"),
    "text": (appended("extra: '" + "x" * 10 * MILLION + "'\n"), "unknown field 'extra'"),
    "brackets": (appended("extra: " + "[" * MILLION), "nested deeper than"),
    "too long": (appended("#" * 17 * 2**20), "at most 16 MiB are read"),
    "materials": (
        more("materials", "m@: {kind: absorber}", 1001),
        "'materials': should have at most 1000 items",
    ),
    "parts": (
        more("parts", "p@: {role: support, mesh: meshes/gel.obj, material: gel}", 1001),
        "'parts': should have at most 1000 items",
    ),
    "notes": (
        more("provenance", "a@: {status: assumed, source: a guess}", 20_001),
        "'provenance': should have at most 20000 items",
    ),
    "large mesh": (replaced(MESH, sparse), "has 8,192 MiB; at most 128 MiB"),
    "large lamp": (replaced(LAMP, sparse), "has 8,192 MiB; at most 16 MiB"),
    "no file": (replaced(MESH, lambda path: path.symlink_to(path.name)), "there is no file"),
    "a folder": (replaced(MESH, Path.mkdir), "A folder or another special file has this name"),
    "a pipe": (replaced(MESH, os.mkfifo), "there is no file"),
    "a device": (replaced(MESH, lambda path: path.symlink_to("/dev/zero")), "leads out of"),
    "design loop": (
        replaced("design.yaml", lambda path: path.symlink_to(path.name)),
        "no sensor design is at this place",
    ),
    "name of a number": (named("1" * 60), "should be a valid string"),
    "long name": (named("m" * 100_000), "there is no file 'mmm"),
    "number for a name": (named("1e60"), "should be a valid string"),
}  # fmt: skip


@pytest.mark.parametrize("case", SPOILT)
def test_it_is_refused_in_words(case: str, folder: Path) -> None:
    spoil, words = SPOILT[case]
    spoil(folder)
    with pytest.raises(OptiSenseError) as told:
        for value in load_design(folder).values_of_kinds().values():
            value.contents()
    assert words in str(told.value)
    assert len(str(told.value)) < 2000
    assert str(folder) in str(told.value)


def test_a_mesh_of_too_many_triangles(folder: Path) -> None:
    many_triangles(folder / "meshes" / "gel.stl")
    file = folder / "design.yaml"
    file.write_text(file.read_text().replace(MESH, "meshes/gel.stl", 1))
    with pytest.raises(OptiSenseError, match="has 2,000,000 triangles; at most 1,000,000 are"):
        load_design(folder)


def test_a_mesh_whose_faces_are_there_a_million_times(folder: Path) -> None:
    mesh = folder / MESH
    face = next(line for line in mesh.read_text().splitlines() if line.startswith("f "))
    with mesh.open("a") as file:
        file.write(f"{face}\n" * 900_000)
    with pytest.raises(OptiSenseError, match="900,000 faces of the mesh occur more than once"):
        load_design(folder)


def test_the_triangles_of_all_parts_are_bounded(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    together = sum(len(mesh.faces) for mesh in load_design(folder).meshes.values())
    monkeypatch.setattr(design_files, "MOST_TRIANGLES", together - 1)
    with pytest.raises(OptiSenseError, match=f"more than {together - 1:,} triangles together"):
        load_design(folder)


@pytest.mark.parametrize("count", [2000, 1000])
def test_a_lamp_of_four_million_values(count: int, folder: Path) -> None:
    """Once its header says so, once it says less."""
    head = f"IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 {count} {count} 1 2 0 0 0\n1 1 10\n"
    (folder / LAMP).write_text(head + "1 " * 4_000_000)
    with pytest.raises(OptiSenseError, match=r"too many|more than 1,200,000"):
        read_ies(folder / LAMP)

"""Formats of robot simulators, and the export of a design to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from optisense.design import SensorDesign
from optisense.errors import OutputError, OwnCodeError
from optisense.own_code import failures_named
from optisense.registry import Registry, must_be, place_of_definition
from optisense.robots._body import SensorBody, sensor_body
from optisense.robots._mjcf import mjcf
from optisense.robots._urdf import urdf, without_friction
from optisense.workshop.export import bytes_writer, twin_of, twins, write_all
from optisense.workshop.formats import stl_bytes_of

MESHES = "meshes"
"""Folder of the mesh files, beside the files that name them."""

MARK = (f"{MESHES}/*.stl", ", metres")
"""Files of each export, and a text in them, by which the folder of an earlier one is recognised."""


@dataclass(frozen=True)
class RobotFormat:
    """File format of a robot simulator.

    Attributes:
        suffix: suffix of the file name, with its dot.
        text: function that returns the content of the file, called with the sensor's body and the
            folder of the mesh files (NAME.stl, binary, m).
        note: function that returns a sentence about what the file lacks; None if it lacks nothing.
    """

    suffix: str
    text: Callable[[SensorBody, str], str]
    note: Callable[[SensorBody], str] | None = None


MJCF = RobotFormat(".xml", mjcf)
URDF = RobotFormat(".urdf", urdf, without_friction)


ROBOT_FORMATS: Registry[RobotFormat] = Registry(
    "robot format",
    "optisense.robot_formats",
    OutputError,
    {"mujoco": "optisense.robots.formats:MJCF", "urdf": "optisense.robots.formats:URDF"},
    must_be(RobotFormat, OutputError, "robot format"),
)
"""Registry of all formats; other packages add entry points `optisense.robot_formats`."""


def export_robot(
    design: SensorDesign,
    folder: str | Path,
    formats: str | Sequence[str] = ("mujoco",),
    notes: list[str] | None = None,
    *,
    mass: float | None = None,
    densities: Mapping[str, float] | None = None,
) -> list[Path]:
    """Write a sensor for robot simulators: a file for each format, and its meshes in metres.

    No file appears under its own name before all are written.

    Args:
        formats: one name in `ROBOT_FORMATS`, or several.
        notes: list to which notes about the files are added, one sentence each.
        mass: mass of the whole sensor, g; see `sensor_body`.
        densities: densities (g/cm^3) of parts by name; see `sensor_body`.

    Returns:
        The paths of the files; those of the formats first.

    Raises:
        DesignError: see `sensor_body`; or two parts differ in upper and lower case only.
        OutputError: there is no such format, the folder can't be written, or it holds a design or
            files of the user with such names.
        OwnCodeError: the function of a format failed, or returned something other than text.
    """
    wanted = [formats] if isinstance(formats, str) else formats
    kinds = [ROBOT_FORMATS.find(name) for name in dict.fromkeys(wanted)]
    body = sensor_body(design, mass=mass, densities=densities)
    files = {
        f"{body.name}{kind.suffix}": bytes_writer(_text_of(kind, body).encode()) for kind in kinds
    }
    for each in (*body.looks, *body.hulls):
        file = f"{MESHES}/{each.name}.stl"
        twin = twin_of(file, files)
        if twin is not None:
            raise twins(file, twin, Path(twin).stem)
        files[file] = bytes_writer(stl_bytes_of(f"{each.name}, metres", each.mesh))
    told = body.notes + [kind.note(body) for kind in kinds if kind.note is not None]
    finals = write_all(Path(folder), files, MARK, "the files for a robot simulator", told)
    if notes is not None:
        notes += told
    return finals


def _text_of(kind: RobotFormat, body: SensorBody) -> str:
    name = getattr(kind.text, "__qualname__", str(kind.text))
    what = f"the function '{name}' of the format '{kind.suffix}'"
    with failures_named(what, place_of_definition(kind.text)):
        text: object = kind.text(body, MESHES)
    if not isinstance(text, str):
        raise OwnCodeError(
            f"{what} returned {type(text).__name__} instead of text",
            where=place_of_definition(kind.text),
            hint="Let it return the content of the file as one string",
        )
    return text

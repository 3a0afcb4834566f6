"""The user's own parts: a folder with a file for each entry, read together with the built-in ones.

`materials/NAME.yaml`, `coatings/`, `lights/` (with their .ies files) and `cameras/` are in the
folder that the environment variable OPTISENSE_LIBRARY names, or else in `optisense/library` of the
user's configuration folder ($XDG_CONFIG_HOME, or ~/.config).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from optisense.design.yaml_writer import to_yaml
from optisense.library._entries import AnyEntry
from optisense.library.reading import Kind
from optisense.writing import written_together

HEADS: dict[Kind, str] = {
    "material": "Optical material. Indices at 630, 528 and 465 nm for R, G, B.",
    "coating": "Coating. eta and k are those of the metal flake at 630, 528, 465 nm.",
    "light": "Light. Lengths in mm, angles in degrees, flux in mW, current in mA.",
    "camera": "Camera. fov in degrees across the width, pixel_size in micrometres, focal_length "
    "in mm.",
}


WHERE_TO_STORE = "Name a folder that you may write to in the environment variable OPTISENSE_LIBRARY"


def own_folder() -> Path:
    """Return the folder of the user's own parts, which need not exist."""
    named = os.environ.get("OPTISENSE_LIBRARY")
    if named:
        return Path(named).expanduser()
    config = os.environ.get("XDG_CONFIG_HOME")
    base = Path(config) if config else Path.home() / ".config"
    return base / "optisense" / "library"


def own_files(kind: Kind) -> dict[str, Path]:
    """Return the files of the user's own entries of a kind, by name."""
    folder = own_folder() / f"{kind}s"
    files = sorted(folder.glob("*.yaml")) if folder.is_dir() else []
    return {file.stem: file for file in files if not file.name.startswith(".")}


def write_own(
    kind: Kind, name: str, entry: AnyEntry, files: Mapping[str, bytes] = MappingProxyType({})
) -> Path:
    """Write an entry into the user's folder, whose lock is held, whole or not at all.

    Args:
        files: contents of the files that the entry names; they are written beside it first.

    Returns:
        The path of the entry's file.

    Raises:
        OutputError: the folder can't be written.
    """
    file = own_folder() / f"{kind}s" / f"{name}.yaml"
    with written_together("your library", WHERE_TO_STORE) as stage:
        for own, data in files.items():
            stage(file.parent / own).write_bytes(data)
        stage(file).write_text(to_yaml(entry, HEADS[kind]), encoding="utf-8")
    return file

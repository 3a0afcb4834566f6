"""The Blender extension as a zip file, and its installation in Blender."""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path
from shutil import which

from optisense.errors import SetupError
from optisense.writing import written_whole

MANIFEST = "blender_manifest.toml"
OLDEST = (4, 2)
"""Oldest version of Blender that the studio runs in: the first one that has extensions."""

HELP = (
    "studio", "cages", "library", "simulation", "objectives", "search", "workshop", "calibration",
)  # fmt: skip
"""Pages of the documentation that are part of the extension; its buttons *Help* show them."""

NOT_THERE = "should have been installed but not found"
"""Message of Blender when it has installed nothing, although it reports success."""

HOW_TO_GET = (
    "Get Blender 4.2 or newer from https://www.blender.org/download, then name it: "
    "optisense studio --blender /path/to/blender"
)

PLACES = {
    "linux": (
        "/usr/bin/blender",
        "/usr/local/bin/blender",
        "/snap/bin/blender",
        "/opt/blender*/blender",
        "~/blender*/blender",
        "~/Downloads/blender-*/blender",
        "~/.local/share/Steam/steamapps/common/Blender/blender",
    ),
    "darwin": (
        "/Applications/Blender*.app/Contents/MacOS/Blender",
        "~/Applications/Blender*.app/Contents/MacOS/Blender",
    ),
    "win32": (
        "C:/Program Files/Blender Foundation/Blender*/blender.exe",
        "C:/Program Files (x86)/Steam/steamapps/common/Blender/blender.exe",
    ),
}
"""Usual places of Blender's executable, by `sys.platform`."""


def source_folder() -> Path:
    """Return the folder of the extension's files.

    Raises:
        SetupError: the files are not installed.
    """
    return _installed("studio", MANIFEST, "the Blender extension").parent


def help_pages() -> Iterator[tuple[str, bytes]]:
    """Yield the pages of the documentation that the extension shows, with their names in the zip.

    Raises:
        SetupError: a page is not installed.
    """
    for name in HELP:
        file = f"{name}.md"
        page = _installed("docs", file, f"the page '{file}' of the help")
        yield f"help/{file}", page.read_bytes()


def _installed(folder: str, name: str, what: str) -> Path:
    """Return a file beside the package in a checkout, or else where the wheel has installed it."""
    installed = Path(sysconfig.get_path("data")) / "share" / "optisense" / folder
    for each in (Path(__file__).parents[2] / folder, installed):
        if (each / name).is_file():
            return each / name
    raise SetupError(
        f"{what} is not part of this installation",
        where=str(installed),
        hint="Install OptiSense Studio again",
    )


def version_of(folder: Path) -> str:
    """Return the extension's version, from its manifest."""
    with (folder / MANIFEST).open("rb") as file:
        return str(tomllib.load(file)["version"])


def write_zip(path: Path) -> None:
    """Write the extension as the zip that Blender installs; the same files give the same bytes.

    Raises:
        OutputError: the file can't be written.
        SetupError: parts of the extension are not installed.
    """
    folder = source_folder()
    with (
        written_whole(path, "the extension", "Name another file") as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        content = [(f.relative_to(folder).as_posix(), f.read_bytes()) for f in _files(folder)]
        for name, data in [*content, *help_pages()]:
            entry = zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data)


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        hidden = any(part.startswith(".") or part == "__pycache__" for part in parts)
        ours = path.suffix == ".py" or path.name == MANIFEST
        if path.is_file() and ours and not hidden:
            yield path


def find_blender(named: Path | None = None) -> tuple[Path, str]:
    """Return the Blender to use and its version.

    Args:
        named: path given by the user; without it, the search path and usual places are searched.

    Raises:
        SetupError: there is none, it does not start, or it is too old.
    """
    if named is not None:
        found = which(str(named.expanduser())) or which(named.expanduser() / "blender")
        if found is None:
            raise SetupError(f"'{named}' is no program", hint="Name Blender's executable file")
        return Path(found), _fitting(Path(found))
    problem: SetupError | None = None
    for candidate in _candidates():
        try:
            return candidate, _fitting(candidate)
        except SetupError as error:
            problem = problem or error
    raise problem or SetupError("no Blender was found", hint=HOW_TO_GET)


def _candidates() -> Iterator[Path]:
    on_path = which("blender")
    if on_path:
        yield Path(on_path)
    for pattern in PLACES.get(sys.platform, ()):
        path = Path(pattern).expanduser()
        yield from sorted(Path(path.anchor).glob(str(path.relative_to(path.anchor))), reverse=True)


def _fitting(blender: Path) -> str:
    """Return the version of a Blender that is new enough."""
    try:
        text = subprocess.run(
            [str(blender), "--version"], capture_output=True, text=True, timeout=60, check=False
        ).stdout
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SetupError(f"Blender does not start: {error}", where=str(blender)) from error
    match = re.search(r"Blender (\d+)\.(\d+)(?:\.(\d+))?", text)
    if match is None:
        raise SetupError("this program is no Blender", where=str(blender), hint=HOW_TO_GET)
    if (int(match[1]), int(match[2])) < OLDEST:
        raise SetupError(
            f"Blender {match[1]}.{match[2]} is too old", where=str(blender), hint=HOW_TO_GET
        )
    return match[0].removeprefix("Blender ")


def install(blender: Path, archive: Path, environment: dict[str, str]) -> None:
    """Install the extension for the user and enable it, in place of an older one.

    Args:
        archive: zip of the extension.
        environment: environment for Blender; the extension stores the engine's command from it.

    Raises:
        SetupError: Blender refuses the extension.
    """
    command = ["--command", "extension", "install-file", "-r", "user_default", "--enable"]
    done = subprocess.run(
        [str(blender), *command, str(archive)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env=environment,
    )
    # Blender ends with 0 even if its own Python could not unpack the extension.
    if done.returncode != 0 or NOT_THERE in done.stdout + done.stderr:
        lines = (done.stderr + done.stdout).strip().splitlines()
        raise SetupError(
            "Blender could not install the extension",
            where=lines[-1] if lines else str(blender),
            hint=f"Install it by hand: in Blender, Edit > Preferences > Get Extensions > "
            f"Install from Disk, with {archive}",
        )

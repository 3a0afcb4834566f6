"""Options that several commands share, and how their values are read."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from optisense.optics.estimators import ESTIMATORS
from optisense.quality import LEVELS, photons_of

if TYPE_CHECKING:
    from optisense.geometry import Contact

DesignArgument = Annotated[
    str,
    typer.Argument(
        metavar="DESIGN",
        help="A built-in sensor's name (gelsight-mini, ...) or the folder of a design.",
        show_default=False,
    ),
]

ContactOption = Annotated[
    list[str] | None,
    typer.Option(
        "--contact",
        "-c",
        metavar="KIND:SIZE@U,V:DEPTH",
        help="What presses on the sensor, for example sphere:1.5@0,0:0.8 (a ball of 1.5 mm "
        "radius, at the middle, 0.8 mm deep). May be given several times.",
        show_default=False,
    ),
]

MAX_PIXELS = 100_000_000


def parse_variant(text: str) -> str:
    """Read ``auto``, ``llvm`` or ``cuda``.

    Raises:
        typer.BadParameter: anything else.
    """
    if text not in ("auto", "llvm", "cuda"):
        raise typer.BadParameter(f"'{text}' is none of auto, llvm, cuda", param_hint="--variant")
    return text


VariantOption = Annotated[
    str,
    typer.Option(
        metavar="auto|llvm|cuda",
        help="Render on the processor (llvm) or a GPU (cuda).",
        callback=parse_variant,
    ),
]

WorkersOption = Annotated[int, typer.Option(min=1, metavar="N", help="Processes on this machine.")]

MOST_SEED = 2**32 - 1


def seed_option(text: str, **more: Any) -> Any:
    """``--seed N``; ``text`` says what is the same with the same seed."""
    return typer.Option("--seed", min=0, max=MOST_SEED, metavar="N", help=text, **more)


def out_option(text: str, metavar: str = "DIR") -> Any:
    """``--out DIR``, of commands that may also do without; ``text`` says what goes there."""
    return typer.Option("--out", "-o", metavar=metavar, help=text, show_default=False)


NoiseOption = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=255.0,
        metavar="LEVELS",
        help="Noise of the camera to add, of 255; a real GelSight Mini shows 1.1 to 1.9.",
    ),
]

SampleResolutionOption = Annotated[
    str | None,
    typer.Option(
        "--resolution",
        metavar="WIDTHxHEIGHT",
        help="Pixels of the pictures; those of the camera, or what the task needs, when left out.",
        show_default=False,
    ),
]

SettingOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="A setting of the objectives, such as depth=0.5, noise=0.2 or photons=1000000. "
        "May be given several times.",
        show_default=False,
    ),
]

ScoreResolutionOption = Annotated[
    str | None,
    typer.Option(
        "--resolution",
        metavar="WIDTHxHEIGHT",
        help="Pixels of images and rays. 640 across, in the camera's shape, when left out.",
        show_default=False,
    ),
]


def photons_option(help: str, **more: Any) -> Any:
    """An option `--photons` that takes a number or a level of quality."""
    return typer.Option("--photons", parser=_photons, metavar=f"N|{LEVELS}", help=help, **more)


def _photons(text: str) -> int:
    try:
        return photons_of(text)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


SamplePhotonsOption = Annotated[
    int, photons_option("Photons of the light that all pictures share.")
]

EstimatorOption = Annotated[
    str,
    typer.Option(
        metavar="|".join(ESTIMATORS), help="sppm is slow, and exact where plates cover the gel."
    ),
]

ScorePhotonsOption = Annotated[
    int | None, photons_option("Photons to trace.", show_default="fine, 5 million")
]


def parse_resolution(text: str) -> tuple[int, int]:
    """Read ``WIDTHxHEIGHT`` in pixels.

    Raises:
        typer.BadParameter: anything else.
    """
    match = re.fullmatch(r"\s*(\d{1,6})\s*[xX×]\s*(\d{1,6})\s*", text)
    if match is None:
        raise typer.BadParameter(
            f"'{text}' is not WIDTHxHEIGHT, such as 320x240", param_hint="--resolution"
        )
    width, height = int(match[1]), int(match[2])
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise typer.BadParameter(
            f"'{text}' is not between 1x1 and {MAX_PIXELS:,} pixels", param_hint="--resolution"
        )
    return width, height


def parse_exposure(text: str) -> float | Literal["auto"]:
    """Read ``auto`` or a positive factor.

    Raises:
        typer.BadParameter: anything else.
    """
    if text.strip().lower() == "auto":
        return "auto"
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 < value < float("inf"):
        raise typer.BadParameter(
            f"'{text}' is neither 'auto' nor a number above 0", param_hint="--exposure"
        )
    return value


def parse_contacts(texts: list[str] | None) -> list[Contact]:
    """Read the values of ``--contact``.

    Raises:
        ContactError: one of them can't be read.
    """
    from optisense.geometry import parse_contact

    return [parse_contact(text) for text in texts or []]


def parse_settings(texts: list[str] | None) -> dict[str, Any]:
    """Read the values of ``--set``, as those of a design file are read: 1e-3 is a number.

    Raises:
        typer.BadParameter: one of them is not NAME=VALUE.
    """
    from optisense.design.yaml_reader import parse_yaml
    from optisense.errors import OptiSenseError

    settings = {}
    for text in texts or []:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise typer.BadParameter(f"'{text}' is not NAME=VALUE", param_hint="--set")
        try:
            read, _ = parse_yaml(f"value: {value}", "--set")
            settings[name.strip().replace("-", "_")] = read["value"]
        except OptiSenseError:
            raise typer.BadParameter(
                f"the value in '{text}' can't be read", param_hint="--set"
            ) from None
    return settings


def score_settings(
    setting: list[str] | None, photons: int | None, resolution: str | None
) -> dict[str, Any]:
    """The settings of objectives that `--set`, `--photons` and `--resolution` name.

    Raises:
        typer.BadParameter: one of them can't be read.
    """
    settings = parse_settings(setting)
    if photons is not None:
        settings["photons"] = photons
    if resolution is not None:
        settings["resolution"] = settings["ray_resolution"] = parse_resolution(resolution)
    return settings

"""Options of commands are made from models, which the engine's requests share."""

from __future__ import annotations

from typing import Annotated, Any

import pytest
import typer
from annotated_types import Ge, Le
from pydantic import Field
from typer.testing import CliRunner

from optisense.cli import app
from optisense.cli.from_options import with_options
from optisense.commands.options import (
    CommandOptions,
    Exposure,
    NamedValues,
    OptionNotation,
    Photons,
    Range,
    Resolution,
)
from optisense.commands.rendering import RenderOptions
from optisense.commands.scoring import SearchOptions
from optisense.engine.requests import find
from optisense.quality import PHOTONS


class _Common(CommandOptions):
    photons: Photons | None = Field(None, description="How many.")


class _Options(_Common):
    resolution: Resolution = Field("8x6", validate_default=True, description="Pixels.")
    share: Annotated[float, Ge(0.0), Le(1.0), OptionNotation("PART")] = Field(
        0.5, description="Of all."
    )
    exposure: Exposure = Field("auto", description="Factor.")
    depth: Range | None = Field(None, description="How deep.")
    names: Annotated[list[str], OptionNotation("NAME", ("--name", "-n"))] = Field(
        [], description="Whose."
    )
    settings: Annotated[NamedValues, OptionNotation("NAME=VALUE", ("--set",))] = Field(
        {}, description="More."
    )
    quick: bool = Field(False, description="Or slow.")


def run(*arguments: str) -> tuple[int, str, Any]:
    """The exit code, what was printed, and the options that the command got."""
    got: list[_Options] = []

    def command(design: str, *, options: _Options, last: int = 3) -> None:
        got.append(options)
        assert (design, last) == ("mini", 3)

    one = typer.Typer()
    one.command()(with_options(command))
    result = CliRunner().invoke(one, ["mini", *arguments], env={"COLUMNS": "120"})
    return result.exit_code, result.output, got[0] if got else None


def test_what_is_left_out_keeps_the_models_defaults() -> None:
    code, _, options = run()
    assert code == 0
    assert options == _Options(resolution=(8, 6))


def test_every_kind_of_value_is_read() -> None:
    code, text, options = run(
        "--resolution", "320x240", "--share", "0.25", "--exposure", "2", "--depth", "0.3:1",
        "-n", "a", "--name", "b", "--set", "half-lines=1e-3", "--quick", "--photons", "draft",
    )  # fmt: skip
    assert code == 0, text
    assert options.resolution == (320, 240)
    assert (options.share, options.exposure, options.depth) == (0.25, 2.0, (0.3, 1.0))
    assert (options.names, options.settings) == (["a", "b"], {"half_lines": 1e-3})
    assert options.quick and options.photons == PHOTONS["draft"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--resolution", "wide"), ("--resolution", "WIDTHxHEIGHT")),
        (("--resolution", "0x4"), ("--resolution", "1x1")),
        (("--share", "2"), ("--share", "1")),
        (("--exposure", "-1"), ("--exposure", "auto")),
        (("--depth", "deep"), ("--depth", "LOW:HIGH")),
        (("--set", "depth"), ("--set", "NAME=VALUE")),
        (("--photons", "many"), ("--photons", "many")),
        (("--fast",), ("--fast",)),
    ],
    ids=lambda value: value[0],
)
def test_bad_values_name_their_option(arguments: tuple[str, ...], words: tuple[str, ...]) -> None:
    code, text, options = run(*arguments)
    assert code == 2 and options is None
    for word in words:
        assert word in text


def test_help_tells_forms_bounds_and_defaults_own_options_first() -> None:
    _, text, _ = run("--help")
    for words in ("WIDTHxHEIGHT", "default: 8x6", "PART", "0.0<=x<=1.0", "NAME=VALUE", "Or slow."):
        assert words in text
    assert text.index("--resolution") < text.index("--photons")


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("evaluate", ("if left out, 640 wide", "default: (fine, 5 million)")),
        ("search", ("640 wide and rays 320 across", "default: (normal, 1 million)")),
    ],
)
def test_each_command_tells_its_own_defaults(command: str, words: tuple[str, ...]) -> None:
    text = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "400"}).output
    for each in words:
        assert each in text


@pytest.mark.parametrize(
    ("command", "request_name", "model"),
    [("render", "simulate", RenderOptions), ("search", "search", SearchOptions)],
)
def test_the_command_line_and_the_engine_have_the_same_options(
    command: str, request_name: str, model: type[CommandOptions]
) -> None:
    text = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"}).output
    fields = find(request_name).fields.model_fields
    for name, field in model.model_fields.items():
        assert (field.description or "")[:40] in text
        assert name in fields

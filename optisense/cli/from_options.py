"""Options of the command line, made from the models in `optisense.commands`."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import typer
from annotated_types import Ge, Le
from pydantic import ValidationError
from pydantic.fields import FieldInfo

from optisense.commands.options import CommandOptions, OptionNotation
from optisense.text import lone_surrogate


def with_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Return a command that has an option for each field of its parameters `CommandOptions`."""
    hints = get_type_hints(command, include_extras=True)
    models = {
        name: kind
        for name, kind in hints.items()
        if isinstance(kind, type) and issubclass(kind, CommandOptions)
    }
    if not models:
        return command
    parameters = []
    for each in inspect.signature(command).parameters.values():
        if each.name in models:
            parameters += [_parameter(*field) for field in _fields(models[each.name])]
        else:
            parameters.append(each.replace(annotation=hints[each.name]))

    def run(**given: Any) -> Any:
        for name, model in models.items():
            values = {field: given.pop(field) for field in model.model_fields}
            given[name] = options_of(model, values)
        return command(**given)

    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.__doc__, run.__name__ = command.__doc__, command.__name__
    return run


def _fields(model: type[CommandOptions]) -> list[tuple[str, FieldInfo]]:
    """Return the fields of a model by name, its own before those of its base models."""
    names = dict.fromkeys(name for kind in model.__mro__ for name in inspect.get_annotations(kind))
    return [(name, model.model_fields[name]) for name in names if name in model.model_fields]


def _parameter(name: str, field: FieldInfo) -> inspect.Parameter:
    """Return the parameter from which Typer makes the option of a field."""
    kind, notes = _plain(field.annotation)
    notes += field.metadata
    written = _written(notes)
    bounds: dict[str, Any] = {}
    for note in notes:
        bounds |= {"min": note.ge} if isinstance(note, Ge) else {}
        bounds |= {"max": note.le} if isinstance(note, Le) else {}
    usual = field.get_default(call_default_factory=True) or None
    if get_origin(kind) in (list, dict):
        kind = list[str] | None
    elif kind is bool:
        usual = False
    else:
        usual = field.default
        kind = str if written.is_text else kind
        usual = str(usual) if written.is_text and usual is not None else usual
        kind = kind | None if usual is None else kind
    option = typer.Option(
        *_flags(name, written),
        metavar=written.form,
        help=field.description,
        show_default=usual is not None if written.usual is None else written.usual,
        **bounds,
    )
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=usual,
        annotation=Annotated[kind, option],
    )


def _plain(annotation: Any) -> tuple[Any, list[Any]]:
    """Return the type of a field without None, and the annotations beside it."""
    if get_origin(annotation) in (Union, UnionType):
        annotation = next(each for each in get_args(annotation) if each is not type(None))
    if get_origin(annotation) is Annotated:
        kind, *notes = get_args(annotation)
        return kind, notes
    return annotation, []


def _written(notes: list[Any]) -> OptionNotation:
    return next(
        (note for note in reversed(notes) if isinstance(note, OptionNotation)), OptionNotation()
    )


def _flags(name: str, written: OptionNotation) -> tuple[str, ...]:
    return written.flags or ("--" + name.replace("_", "-"),)


def options_of(model: type[CommandOptions], values: dict[str, Any]) -> CommandOptions:
    """Return the options as given; omitted ones keep the model's defaults.

    Raises:
        typer.BadParameter: an option is invalid.
    """
    given = {name: value for name, value in values.items() if value is not None and value != []}
    try:
        return model.model_validate(given)
    except UnicodeEncodeError:  # such as bytes that are not UTF-8 on the command line
        odd = next((name for name, value in given.items() if lone_surrogate(value)), "")
        raise typer.BadParameter("the text is not UTF-8", param_hint=_hint(model, odd)) from None
    except ValidationError as error:
        found = error.errors()[0]
        cause = found.get("ctx", {}).get("error")
        name = str(found["loc"][0]) if found["loc"] else ""
        raise typer.BadParameter(
            str(cause or found["msg"]), param_hint=_hint(model, name)
        ) from None


def _hint(model: type[CommandOptions], name: str) -> str | None:
    """Return the option of a field, or None for a name that is no field's."""
    field = model.model_fields.get(name)
    if field is None:
        return None
    _, notes = _plain(field.annotation)
    return _flags(name, _written([*notes, *field.metadata]))[0]

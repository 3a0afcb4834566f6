"""The classes that the word under `kind` in a file chooses, of this package and of others."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, PrivateAttr
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from optisense.design.fields import IN_FOLDER, Model
from optisense.errors import LibraryError, SetupError
from optisense.near import suggestion


class Kinds:
    """The kinds of one noun, by their names in files.

    A kind is registered when its class is made. Installed packages name theirs under an entry
    point group: `name = "module:Class"`; they are imported when the kinds are first asked for.
    """

    def __init__(self, noun: str, group: str) -> None:
        """A registry without kinds.

        Args:
            noun: what a kind is one of, for messages: 'emitter'.
            group: the entry point group of other packages' kinds.
        """
        self.noun = noun
        self.group = group
        self._classes: dict[str, Any] = {}
        self._loaded = False

    def add(self, kind: type[KindModel]) -> None:
        """Register a class under the default of its field `kind`.

        A class may be registered again by the same module, so that it can be reloaded.

        Raises:
            SetupError: another class has this name.
        """
        name = kind.model_fields["kind"].default
        known = self._classes.get(name)
        if known is not None and _identity(known) != _identity(kind):
            raise SetupError(
                f"there are two kinds of {self.noun} called '{name}': "
                f"{'.'.join(_identity(known))} and {'.'.join(_identity(kind))}",
                hint="Give one of them another name",
            )
        self._classes[name] = kind

    def names(self) -> list[str]:
        """The names of all kinds, the package's own first.

        Raises:
            SetupError: an installed package's kind can't be imported.
        """
        if not self._loaded:
            self._loaded = True
            for point in entry_points(group=self.group):
                try:
                    point.load()
                except Exception as error:
                    self._loaded = False
                    raise SetupError(
                        f"the {self.noun} '{point.name}' of an installed package can't be "
                        f"imported: {type(error).__name__}: {error}",
                        where=point.value,
                        hint="Repair or uninstall that package",
                    ) from error
        return list(self._classes)

    def find(self, name: str) -> Any:
        """The class of a kind.

        Raises:
            LibraryError: there is no such kind; names the near match.
            SetupError: an installed package's kind can't be imported.
        """
        if name not in self:
            raise LibraryError(
                f"there is no {self.noun} of kind '{name}'",
                hint=suggestion(name, self.names(), limit=20),
            )
        return self._classes[name]

    def __contains__(self, name: object) -> bool:
        """Whether there is a kind of this name."""
        return name in self.names()


def _identity(kind: type) -> tuple[str, str]:
    return kind.__module__, kind.__qualname__


class KindModel(Model):
    """Base of what comes in several kinds, each a class with its own fields.

    A direct subclass with a `kinds` of its own stands for the noun: as the type of a field, it
    takes any kind of it and finds the class by `kind`. A subclass of that one whose `kind` has a
    default is a kind.

    Attributes:
        kinds: all kinds of the noun.
        title: what a menu calls the kind; its name if left out.
    """

    kinds: ClassVar[Kinds]
    title: ClassVar[str] = ""

    kind: str
    _folder: Path | None = PrivateAttr(default=None)

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Register a kind when its class is made."""
        super().__pydantic_init_subclass__(**kwargs)
        if "kinds" not in cls.__dict__ and not cls.model_fields["kind"].is_required():
            cls.kinds.add(cls)

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: Any, handler: GetCoreSchemaHandler, /
    ) -> CoreSchema:
        """Of a noun: any of its kinds, those included that are registered later."""
        if "kinds" not in cls.__dict__:
            return handler(source)
        return core_schema.no_info_plain_validator_function(
            cls._of_a_kind, serialization=core_schema.simple_ser_schema("any")
        )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /
    ) -> dict[str, Any]:
        """Of a noun: one of the schemas of its kinds."""
        if "kinds" not in cls.__dict__:
            return handler(schema)
        kinds = [cls.kinds.find(name) for name in cls.kinds.names()]
        return {"oneOf": [handler(kind.__pydantic_core_schema__) for kind in kinds]}

    @classmethod
    def _of_a_kind(cls, value: Any) -> Any:
        if isinstance(value, cls):
            return value
        if not isinstance(value, Mapping):
            raise PydanticKnownError("model_attributes_type")
        name = value.get("kind")
        if name is None:
            raise PydanticKnownError("union_tag_not_found", {"discriminator": "'kind'"})
        if name not in cls.kinds:
            known = ", ".join(repr(each) for each in cls.kinds.names())
            raise PydanticKnownError(
                "union_tag_invalid",
                {"discriminator": "'kind'", "tag": str(name), "expected_tags": known},
            )
        return cls.kinds.find(name).model_validate(value)

    @classmethod
    def summary(cls) -> str:
        """The first sentence of the class's description."""
        return " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split())

    def check(self) -> None:
        """Find out what the fields alone don't tell, such as whether its files can be read.

        Raises:
            OptiSenseError: something is wrong.
        """

    def files(self) -> dict[str, str]:
        """The files that it names, relative to its folder: by field."""
        return {
            name: getattr(self, name)
            for name, field in type(self).model_fields.items()
            if IN_FOLDER in field.metadata
        }

    def path(self, field: str) -> Path:
        """The file on disk that a field names.

        Raises:
            LibraryError: it is not known which folder the file is in, or it is not in it.
        """
        file = self.files()[field]
        if self._folder is None:
            raise LibraryError(
                f"the file '{file}' of {self.kinds.noun} '{self.kind}' has no folder",
                hint="Load the design or the library entry that names it from its folder",
            )
        folder = Path(os.path.realpath(self._folder))
        path = Path(os.path.realpath(folder / file))
        if not path.is_relative_to(folder):
            raise LibraryError(f"the file '{file}' lies outside its folder", where=str(folder))
        return path

    def contents(self) -> dict[str, bytes]:
        """What is in its files, by their names relative to the folder.

        Raises:
            LibraryError: one can't be read.
        """
        found = {}
        for field, file in self.files().items():
            path = self.path(field)
            try:
                found[file] = path.read_bytes()
            except OSError as error:
                raise LibraryError(
                    f"can't read the file: {error.strerror or error}",
                    where=str(path),
                    hint="Check the path",
                ) from error
        return found

    @property
    def folder(self) -> Path | None:
        """Where its files are; None where that is not known."""
        return self._folder

    def located(self, folder: Path | None) -> Self:
        """The same object, now that it is known which folder its files are in."""
        self._folder = folder
        return self

    def renamed(self, name: Callable[[str], str], folder: Path | None = None) -> Self:
        """The same object with other names of its files, in another folder."""
        for field, file in self.files().items():
            setattr(self, field, name(file))
        return self.located(folder)

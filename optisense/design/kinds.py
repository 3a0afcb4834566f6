"""Classes that the field `kind` in a file chooses, of this package and of others."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, PrivateAttr
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from optisense.design.fields import IN_FOLDER, Model
from optisense.errors import DesignError, LibraryError, OptiSenseError
from optisense.own_code import error_of_own_code
from optisense.registry import Registry, must_derive
from optisense.text import brief
from optisense.untrusted_files import MOST_DATA, inside, read_bytes

OWN_PACKAGE = __name__.partition(".")[0]
"""Name of the package whose kinds return what the limits of their fields allow."""

ROUNDING = 1e-6
"""Largest excess of a level over 1 that is rounding; single precision has steps of 6e-8 there."""


class Limits(NamedTuple):
    """Limits of a number, or of all numbers of an array.

    Attributes:
        words: the limits as text.
        shape: shape of the array; () for a single number.
        low, high: smallest and largest allowed number.
        above: number that all must exceed.
    """

    words: str
    shape: tuple[int, ...] = ()
    low: float = -math.inf
    high: float = math.inf
    above: float = -math.inf

    def allow(self, value: object) -> bool:
        """Return whether a value is an array of finite numbers, or can become one, within them."""
        try:
            array = np.asarray(value)
        except ValueError:  # rows of different lengths
            return False
        if array.shape != self.shape or array.dtype.kind not in "iuf":
            return False
        within = (array >= self.low) & (array <= self.high) & (array > self.above)
        return bool((np.isfinite(array) & within).all())


class KindModel(Model):
    """Base class of models that come in several kinds, each a class with its own fields.

    A direct subclass with a registry `kinds` of its own is an interface (emitter, material, ...).
    As the type of a field, it accepts any of its kinds and finds the class by the field `kind`. A
    subclass of an interface whose `kind` has a default is a kind.

    Attributes:
        kinds: registry of all kinds of the interface.
        usual_kind: kind of values that name none; if it is None, values must name one.
        title: name of the kind in menus; the kind's name if empty.
    """

    kinds: ClassVar[Registry[Any]]
    usual_kind: ClassVar[str | None] = None
    title: ClassVar[str] = ""

    kind: str
    _folder: Path | None = PrivateAttr(default=None)

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Register a kind when its class is created; only such classes are an interface's kinds."""
        super().__pydantic_init_subclass__(**kwargs)
        if "kinds" in cls.__dict__:
            cls.kinds.check = must_derive(cls, DesignError, cls.kinds.noun)
        elif not cls.model_fields["kind"].is_required():
            cls.kinds.register(cls.model_fields["kind"].default, cls)

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: Any, handler: GetCoreSchemaHandler, /
    ) -> CoreSchema:
        """Return the schema of an interface, which accepts any kind, also those registered
        later."""
        if "kinds" not in cls.__dict__:
            return handler(source)
        return core_schema.no_info_plain_validator_function(
            cls._of_a_kind, serialization=core_schema.simple_ser_schema("any")
        )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /
    ) -> dict[str, Any]:
        """Return the JSON schema of an interface: one of the schemas of its kinds, without those
        that can't be loaded."""
        if "kinds" not in cls.__dict__:
            return handler(schema)
        return {
            "oneOf": [handler(kind.__pydantic_core_schema__) for _, kind in cls.kinds.loadable()]
        }

    @classmethod
    def _of_a_kind(cls, value: Any) -> Any:
        if isinstance(value, cls):
            return value
        if not isinstance(value, Mapping):
            raise PydanticKnownError("model_attributes_type")
        name = value.get("kind", cls.usual_kind)
        if name is None:
            raise PydanticKnownError("union_tag_not_found", {"discriminator": "'kind'"})
        try:
            kind = cls.kinds.find(str(name))
        except DesignError as error:
            known = cls.kinds.names()
            if name in known:  # a package names it, but can't be loaded
                raise ValueError(str(error)) from error
            raise PydanticKnownError(
                "union_tag_invalid",
                {
                    "discriminator": "'kind'",
                    "tag": str(name),
                    "expected_tags": ", ".join(repr(each) for each in known),
                },
            ) from error
        return kind.model_validate(value)

    @classmethod
    def summary(cls) -> str:
        """Return the first sentence of the class's description."""
        return " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split())

    def check(self) -> None:
        """Check what the fields alone don't show, such as whether its files can be read.

        Raises:
            OptiSenseError: there is a problem.
        """

    def _check_results(self) -> None:
        """Raise OptiSenseError if its methods return what can't be used; interfaces override it."""

    def _check_own_kind(self) -> None:
        """Do as `_check_results` for kinds of other packages, where those of this one need no
        check.
        """

    def _require(self, method: str, result: object, limits: Limits) -> None:
        """Raise LibraryError unless a method has returned numbers within limits.

        Arrays must be NumPy's.
        """
        if limits.allow(result) and (isinstance(result, np.ndarray) or not limits.shape):
            return
        found = brief(repr(result))
        if isinstance(result, np.ndarray) and result.dtype.kind in "iuf" and result.size:
            span = f"from {result.min():g} to {result.max():g}"
            numbers = span if np.isfinite(result).all() else "that are not finite"
            found = f"an array of shape {result.shape} with numbers {numbers}"
        raise LibraryError(
            f"{method}() of the {self.kinds.noun} '{self.kind}' returned {found}",
            hint=f"It must return {limits.words}: change the numbers of the kind, or repair its "
            "class",
        )

    def verify(self) -> None:
        """Check whether it can be used: by `check`, and by what its methods return.

        Raises:
            OptiSenseError: there is a problem, or the class of the kind fails.
        """
        try:
            self.check()
            self._check_results()
            if type(self).__module__.partition(".")[0] != OWN_PACKAGE:
                self._check_own_kind()
        except OptiSenseError:
            raise
        except Exception as error:
            own = error_of_own_code(error)
            raise LibraryError(
                f"the {self.kinds.noun} '{self.kind}' fails: {type(error).__name__}: {error}",
                hint=f"Repair {'the class of this kind' if own is None else own.where}",
            ) from error

    def files(self) -> dict[str, str]:
        """Return the files that it names, relative to its folder, by field."""
        return {
            name: getattr(self, name)
            for name, field in type(self).model_fields.items()
            if IN_FOLDER in field.metadata
        }

    def path(self, field: str) -> Path:
        """Return the path on disk of the file that a field names.

        Raises:
            LibraryError: the folder of the file is not known, or the file is not in it.
        """
        file = self.files()[field]
        if self._folder is None:
            raise LibraryError(
                f"the file '{file}' of the {self.kinds.noun} '{self.kind}' has no folder",
                hint="Load the design or the library entry that names it from its folder",
            )
        path = inside(self._folder, file)
        if path is None:
            raise LibraryError(
                f"the file '{brief(file)}' lies outside its folder",
                where=str(self._folder),
                hint="Copy the file into the folder and name it there",
            )
        return path

    def contents(self) -> dict[str, bytes]:
        """Return the contents of its files, by their names relative to the folder.

        Raises:
            LibraryError: a file can't be read.
        """
        return {
            file: read_bytes(self.path(field), MOST_DATA, LibraryError)
            for field, file in self.files().items()
        }

    @property
    def folder(self) -> Path | None:
        """Folder of its files; None if unknown."""
        return self._folder

    def located(self, folder: Path | None) -> Self:
        """Set the folder of its files, if it names any, and return the object."""
        self._folder = folder if self.files() else None
        return self

    def renamed(self, name: Callable[[str], str], folder: Path | None = None) -> Self:
        """Rename its files, set their folder, and return the object."""
        for field, file in self.files().items():
            setattr(self, field, name(file))
        return self.located(folder)


def fills(value: object, shape: tuple[int, ...]) -> bool:
    """Return whether a value is an array that NumPy can broadcast to a shape."""
    if not isinstance(value, np.ndarray):
        return False
    try:
        return np.broadcast_shapes(value.shape, shape) == shape
    except ValueError:
        return False

"""Registries: named things of this package, of other installed packages and of a user's own code.

Indenters, sensors, search methods and file formats each have one. Other packages add to a registry
by an entry point of its group, so that installing them is all that a user has to do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

from optisense.errors import OptiSenseError
from optisense.near import suggestion

T = TypeVar("T")

MOST_SUGGESTED = 20
"""Names that an error lists when none is near to a misspelt one: about two lines of a terminal."""


class Registry(Generic[T]):
    """Things of one kind by their names.

    Attributes:
        noun: what one of them is, for messages.
        group: entry-point group under which installed packages add one: name = "module:attribute".
        built_in: names of the things that this package has.
    """

    def __init__(
        self,
        noun: str,
        group: str,
        error: type[OptiSenseError],
        built_in: Mapping[str, str],
        check: Callable[[str, Any], None] = lambda name, thing: None,
    ) -> None:
        """Name the built-in things; nothing is loaded before it is asked for.

        Args:
            noun: such as "search method".
            group: of the entry points.
            error: the error of this noun.
            built_in: where each thing of this package is defined ("module:attribute"), by name.
            check: raises `error` where a thing does not fit; called with its name and itself.
        """
        self.noun, self.group = noun, group
        self.built_in = tuple(built_in)
        self._error, self._homes, self._check = error, built_in, check
        self._registered: dict[str, T] = {}

    def register(self, name: str, thing: T) -> T:
        """Add a thing; the same one again (a file that was run once more) replaces itself.

        Raises:
            OptiSenseError: the name is malformed or belongs to another one, or the thing does not
                fit.
        """
        if name != name.strip().lower() or not name or set(name) & set(":,@/"):
            raise self._error(
                f"'{name}' can't be the name of a {self.noun}",
                hint="Use lower case, without spaces at the ends and without : , @ /",
            )
        self._check(name, thing)
        home, old = _home(thing), self._registered.get(name)
        if self._homes.get(name, home) != home or (old is not None and _home(old) != home):
            raise self._error(
                f"there is already a {self.noun} '{name}'", where=home, hint="Give it another name"
            )
        self._registered[name] = thing
        return thing

    def find(self, name: str) -> T:
        """The thing of a name.

        Raises:
            OptiSenseError: there is none (the near match is named), or it can't be loaded.
        """
        key = name.strip().lower()
        if key in self._registered:
            return self._registered[key]
        if key in self._homes:
            module, _, attribute = self._homes[key].partition(":")
            found: T = getattr(import_module(module), attribute)
            return found
        for point in entry_points(group=self.group):
            if point.name == key:
                return self._loaded(point)
        raise self._error(
            f"there is no {self.noun} '{name}'",
            hint=suggestion(key, self.names(), limit=MOST_SUGGESTED),
        )

    def __contains__(self, name: object) -> bool:
        """Whether there is a thing of this name; installed packages are asked last."""
        if not isinstance(name, str):  # of a file from a stranger
            return False
        known = name in self._registered or name in self._homes
        return known or any(point.name == name for point in entry_points(group=self.group))

    def names(self) -> list[str]:
        """All names: first the built-in ones in their order, then all others by the alphabet."""
        offered = {point.name for point in entry_points(group=self.group)}
        return [*self.built_in, *sorted((offered | set(self._registered)) - set(self.built_in))]

    def _loaded(self, point: EntryPoint) -> T:
        try:
            thing = point.load()
        except Exception as error:
            package = point.dist.name if point.dist else "an installed package"
            raise self._error(
                f"the {self.noun} '{point.name}' can't be loaded: {type(error).__name__}: {error}",
                where=f"{point.value}, of {package}",
                hint="Repair or remove the package that brings it",
            ) from error
        if point.name in self._registered:  # importing its module has registered it
            return self._registered[point.name]
        return self.register(point.name, thing)


def _home(thing: object) -> str:
    """Where a function or class is defined: "module:name"."""
    name = getattr(thing, "__qualname__", type(thing).__qualname__)
    return f"{getattr(thing, '__module__', '')}:{name}"

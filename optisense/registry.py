"""Registries: named objects of this package, of other installed packages and of a user's own code.

Indenters, sensors, search methods and file formats each have one. Other packages add to a registry
by an entry point of its group, so that a user only has to install them.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from optisense.errors import OptiSenseError
from optisense.near import suggestion

T = TypeVar("T")

MOST_SUGGESTED = 20
"""Number of names that an error lists if none is similar: about two lines of a terminal."""


class Origin(NamedTuple):
    """Installed package that an object comes from.

    Attributes:
        package, version: name and version of the package.
        sha256: SHA-256 of the file of the module that defines the object; empty without a file.
    """

    package: str
    version: str
    sha256: str


class Registry(Generic[T]):
    """Objects of one kind by their names.

    Attributes:
        noun: word for one of them, for messages.
        group: entry-point group under which installed packages add one: name = "module:attribute".
        built_in: names of the objects that this package has.
        check: function that is called with name and object before it is registered, and raises an
            error if the object does not fit.
    """

    def __init__(
        self,
        noun: str,
        group: str,
        error: type[OptiSenseError],
        built_in: Mapping[str, str],
        check: Callable[[str, Any], None] = lambda name, thing: None,
        adapt: Callable[[str, Any], T] = lambda name, thing: thing,
    ) -> None:
        """Store the names of the built-in objects; each is loaded when it is first requested.

        Args:
            noun: word for one of the objects, such as "search method".
            group: group of the entry points.
            error: class of errors about these objects.
            built_in: place of definition of each object of this package ("module:attribute").
            check: the attribute `check`; it raises `error`.
            adapt: function that is called with name and object of an entry point, and returns the
                object to register.
        """
        self.noun, self.group = noun, group
        self.built_in = tuple(built_in)
        self.check = check
        self._error, self._homes = error, built_in
        self._adapt = adapt
        self._registered: dict[str, T] = {}

    def register(self, name: str, thing: T) -> T:
        """Add an object; the same one again (from a file that is run once more) replaces itself.

        Raises:
            OptiSenseError: the name is malformed or taken, or the object does not fit.
        """
        if name != _key(name) or not name or set(name) & set(":,@/"):
            raise self._error(
                f"'{name}' can't be the name of {with_article(self.noun)}",
                hint="Use lower case, without spaces at the ends and without : , @ /",
            )
        self.check(name, thing)
        home, old = _home(thing), self._registered.get(name)
        if self._homes.get(name, home) != home or (old is not None and _home(old) != home):
            raise self._error(
                f"there is already {with_article(self.noun)} '{name}'",
                where=place_of_definition(thing),
                hint="Give it another name",
            )
        self._registered[name] = thing
        return thing

    def find(self, name: str) -> T:
        """Return the object of a name.

        Raises:
            OptiSenseError: there is none (a similar name is suggested), or it can't be loaded.
        """
        key = _key(name)
        if key in self._registered:
            return self._registered[key]
        if key in self._homes:
            module, _, attribute = self._homes[key].partition(":")
            found: T = getattr(import_module(module), attribute)
            return self._registered.get(key, found)  # the import may have registered it
        offered = self._offered().get(key)
        if offered is not None:
            return self._loaded(key, offered)
        raise self._error(
            f"there is no {self.noun} '{name}'",
            hint=suggestion(key, self.names(), limit=MOST_SUGGESTED),
        )

    def origin(self, name: str) -> Origin | None:
        """Return the installed package of an object that comes from an entry point.

        Returns:
            The package; None for objects of this package, of a user's program or file, and for
            those defined outside of the package of their entry point.

        Raises:
            OptiSenseError: the object can't be loaded.
        """
        key = name.strip().lower()
        points = [] if key in self._homes else self._offered().get(key, [])
        if not points:
            return None
        module = _home(self.find(key)).partition(":")[0]
        if module.partition(".")[0] != re.split("[.:]", points[0].value)[0].strip():
            return None
        file = getattr(sys.modules.get(module), "__file__", None)
        try:
            digest = hashlib.sha256(Path(file).read_bytes()).hexdigest() if file else ""
        except OSError:  # such as a module in an archive
            digest = ""
        version = points[0].dist.version if points[0].dist else ""
        return Origin(_package(points[0]), version, digest)

    def __contains__(self, name: object) -> bool:
        """Return whether `names` has a name, in lower or upper case.

        Installed packages are searched last. `find` may still raise an error for their objects.
        """
        if not isinstance(name, str):  # a value from an untrusted file
            return False
        key = _key(name)
        return key in self._registered or key in self._homes or key in self._offered()

    def names(self) -> list[str]:
        """Return all names: the built-in ones in their order, then all others by the alphabet."""
        further = set(self._offered()) | set(self._registered)
        return [*self.built_in, *sorted(further - set(self.built_in))]

    def _offered(self) -> dict[str, list[EntryPoint]]:
        """Return the entry points of the group by their names in lower case."""
        found: dict[str, list[EntryPoint]] = {}
        for point in entry_points(group=self.group):
            found.setdefault(_key(point.name), []).append(point)
        return found

    def loadable(
        self, failures: dict[str, OptiSenseError] | None = None
    ) -> Iterator[tuple[str, T]]:
        """Yield name and object of all that can be loaded, in the order of `names`.

        Args:
            failures: dictionary that receives the error of each other object, by its name, and
                those of packages whose object is not used, as a built-in one has its name.
        """
        if failures is not None:
            offered = self._offered()
            failures |= {
                name: self._unused(name, offered[name]) for name in self.built_in if name in offered
            }
        for name in self.names():
            try:
                yield name, self.find(name)
            except OptiSenseError as error:
                if failures is not None:
                    failures[name] = error

    def registered(self) -> dict[str, T]:
        """Return the objects that were registered so far, by name."""
        return dict(self._registered)

    @contextmanager
    def forgetting(self) -> Iterator[None]:
        """Restore the registry on exit to its state on entry, except for this package's objects.

        This is for long-running processes that run users' files: a changed file can then register
        its name again, from another place.
        """
        before = dict(self._registered)
        try:
            yield
        finally:
            for name in set(self._registered) - set(before) - set(self._homes):
                del self._registered[name]
            self._registered.update(before)

    def _loaded(self, name: str, points: list[EntryPoint]) -> T:
        """Return the object of the only entry point of a name, and register it."""
        if len({(point.value, _package(point)) for point in points}) > 1:
            raise self._taken(name, points)
        point = points[0]
        where = f"{point.value}, of {_package(point)}"
        if point.name != name:
            raise self._error(
                f"'{point.name}' can't be the name of {with_article(self.noun)}",
                where=where,
                hint="The package must give its entry point a name in lower case",
            )
        try:
            thing = point.load()
        except Exception as error:
            raise self._error(
                f"the {self.noun} '{name}' can't be loaded: {type(error).__name__}: {error}",
                where=where,
                hint="Repair or remove the package that contains it",
            ) from error
        if name in self._registered:  # the import of its module has registered it
            return self._registered[name]
        return self.register(name, self._adapt(name, thing))

    def _taken(self, name: str, points: list[EntryPoint]) -> OptiSenseError:
        """Return the error about several packages with one name."""
        return self._error(
            f"the {self.noun} '{name}' is in several packages: {_packages(points)}",
            where=_places(points),
            hint="Remove a package, or give its entry point another name",
        )

    def _unused(self, name: str, points: list[EntryPoint]) -> OptiSenseError:
        """Return the error about packages that use the name of a built-in object."""
        return self._error(
            f"the built-in {self.noun} '{name}' is used, and not that of {_packages(points)}",
            where=_places(points),
            hint="Give the entry point of the package another name",
        )


def _key(name: str) -> str:
    """Return a name as registries hold it: in lower case, without spaces at the ends."""
    return name.strip().lower()


def _package(point: EntryPoint) -> str:
    """Return the name of the package of an entry point."""
    return point.dist.name if point.dist else "an installed package"


def _packages(points: list[EntryPoint]) -> str:
    """Return the names of the packages of entry points, for messages."""
    return ", ".join(sorted({_package(point) for point in points}))


def _places(points: list[EntryPoint]) -> str:
    """Return the objects that entry points name, for messages."""
    return ", ".join(sorted(point.value for point in points))


def _home(thing: object) -> str:
    """Return the place of a function, class or objective's function, as "module:name"."""
    thing = getattr(thing, "function", thing)
    name = getattr(thing, "__qualname__", type(thing).__qualname__)
    return f"{getattr(thing, '__module__', '')}:{name}"


def place_of_definition(thing: object) -> str:
    """Return the file and name of a function or class, for messages."""
    function = getattr(thing, "function", thing)
    code = getattr(function, "__code__", None)
    if code is None:
        return _home(thing)
    return f"{code.co_filename}: {getattr(function, '__qualname__', repr(function))}"


def with_article(noun: str) -> str:
    """Return a noun with "a" or "an"."""
    return f"{'an' if noun[0] in 'aeio' else 'a'} {noun}"


def must_be(kind: type, error: type[OptiSenseError], noun: str) -> Callable[[str, object], None]:
    """Return a check for a `Registry` that refuses objects of other classes.

    Args:
        noun: what the registry holds, as messages call it.
    """

    def check(name: str, given: object) -> None:
        if not isinstance(given, kind):
            raise error(f"the {noun} '{name}' is no {kind.__name__}")

    return check


def must_derive(
    base: type, error: type[OptiSenseError], noun: str
) -> Callable[[str, object], None]:
    """Return a check for a `Registry` that refuses all but subclasses of a class.

    Args:
        noun: what the registry holds, as messages call it.
    """

    def check(name: str, given: object) -> None:
        if not (isinstance(given, type) and issubclass(given, base)):
            raise error(
                f"the {noun} '{name}' is not a subclass of {base.__name__}",
                where=place_of_definition(given),
                hint=f"Derive its class from {base.__module__}.{base.__name__}",
            )

    return check

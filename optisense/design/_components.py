"""Dictionaries of a design's materials, parts, light groups and cages."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from optisense.design.fields import Model, Name


class Components(dict[str, Any]):
    """Components of a design by name.

    A value that is set becomes an object of its class, as in a design file, unless it is one; a
    DesignError is raised if it does not describe one.
    """

    def __init__(self, section: str, model: type[Model], given: Mapping[str, Any]) -> None:
        """Store the first components, of a class, for the design's field `section`."""
        self._section, self._model = section, model
        super().__init__(given)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._section, self._model, dict(self))

    def __setitem__(self, name: str, value: Any) -> None:
        """Set a component."""
        super().__setitem__(name, self._component(name, value))

    def setdefault(self, name: str, default: Any = None) -> Any:
        """Set a component if there is none of its name, and return that of this name."""
        if name not in self:
            self[name] = default
        return self[name]

    def update(self, *given: Any, **named: Any) -> None:
        """Set several components, or none."""
        values = dict(*given, **named)
        super().update({name: self._component(name, value) for name, value in values.items()})

    def __ior__(self, given: Any) -> Components:  # type: ignore[override,misc]
        """Set several components, or none; see `update`."""
        self.update(given)
        return self

    def _component(self, name: str, value: Any) -> Any:
        """Return an object of the class of the components."""
        if isinstance(value, self._model):
            return value
        data = {self._section: {name: value}}  # a design's values, so that errors have their paths
        try:
            return _section_of(self._model).validate_python(data)[self._section][name]
        except ValidationError as error:
            raise Model.error_in_words(error, data) from None


@lru_cache
def _section_of(model: type[Model]) -> TypeAdapter[dict[str, dict[str, Any]]]:
    """Return the validator of sections whose components are of one class, by name."""
    return TypeAdapter(dict[str, dict[Name, model]])  # type: ignore[valid-type]

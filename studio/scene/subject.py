"""Sensor that a request to the engine is about, which may have changed when the answer comes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import bpy

from .collections import objects_of
from .contacts import pressing
from .gather import part_names

T = TypeVar("T")


def scene_of(number: int) -> bpy.types.Scene | None:
    """Return the scene with a session id, also if it was renamed; None if it is gone."""
    return next((each for each in bpy.data.scenes if each.session_uid == number), None)


class Subject:
    """Sensor and contacts of a scene as they are sent to the engine.

    The engine refers to contacts and lights by their number and to parts by their name. Objects
    that are added, removed, hidden or renamed meanwhile do not change what these refer to.
    """

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene.session_uid
        self._opening = scene.optisense.opening
        self._contacts = [each.session_uid for each in pressing(scene)]
        self._lights: dict[str, list[int]] = {}
        for light in objects_of(scene, "LIGHT"):
            self._lights.setdefault(light.optisense.group, []).append(light.session_uid)
        self._parts = {name: part.session_uid for name, part in part_names(scene).items()}

    @property
    def scene(self) -> bpy.types.Scene | None:
        """Scene of the sensor; None if it is gone or has another sensor by now."""
        scene = scene_of(self._scene)
        return scene if scene is not None and scene.optisense.opening == self._opening else None

    def taking(self, take: Callable[[T, bpy.types.Scene], None]) -> Callable[[T], None]:
        """Return the callback for an answer or an error about the sensor.

        Args:
            take: function that is called with the answer or error and the scene, unless that is
                gone or has another sensor by then.
        """

        def taken(answer: T) -> None:
            scene = self.scene
            if scene is not None:
                take(answer, scene)

        return taken

    def contacts(self) -> list[bpy.types.Object | None]:
        """Return the contacts in the order of the request; None in place of those that are gone."""
        scene = self.scene
        there = [] if scene is None else objects_of(scene, "CONTACT")
        present = {each.session_uid: each for each in there}
        return [present.get(each) for each in self._contacts]

    def lights(self, group: str) -> list[bpy.types.Object]:
        """Return the lights of a group."""
        return self._there("LIGHT", self._lights.get(group, []))

    def light(self, group: str, number: int) -> list[bpy.types.Object]:
        """Return the light with a number in its group, from 0; empty if it is gone."""
        return self._there("LIGHT", self._lights.get(group, [])[number:][:1])

    def part(self, name: str) -> list[bpy.types.Object]:
        """Return the part with a name in the request; empty if it is gone."""
        return self._there("PART", [self._parts[name]] if name in self._parts else [])

    def _there(self, kind: str, numbers: list[int]) -> list[bpy.types.Object]:
        """Return the objects with some session ids that are still in the scene."""
        scene = self.scene
        present = [] if scene is None else objects_of(scene, kind)
        return [each for each in present if each.session_uid in numbers]

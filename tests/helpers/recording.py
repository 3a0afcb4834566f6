"""A layout that records what panels draw, and refuses unknown properties and operators."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import bpy

ICONS = set(bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys())


@dataclass
class Recording:
    """Stands in for `UILayout`: every sub-layout is the same recording."""

    texts: list[str] = field(default_factory=list)
    operators: list[str] = field(default_factory=list)
    properties: list[str] = field(default_factory=list)

    def _sub(self, **_: Any) -> Recording:
        return self

    row = column = box = split = grid_flow = column_flow = _sub

    def separator(self, **_: Any) -> None:
        """A separator records nothing."""

    def label(self, text: str = "", icon: str = "NONE", **_: Any) -> None:
        assert icon in ICONS, icon
        self.texts.append(text)

    def operator(self, name: str, text: str | None = None, icon: str = "NONE", **_: Any) -> Any:
        assert icon in ICONS, icon
        package, _, action = name.partition(".")
        kind = getattr(getattr(bpy.ops, package), action).get_rna_type()  # raises if unknown
        self.operators.append(name)
        allowed = set(kind.properties.keys())

        class Values(SimpleNamespace):
            def __setattr__(self, key: str, value: Any) -> None:
                assert key in allowed, f"{name} has no {key}"

        return Values()

    def prop(self, data: Any, name: str, text: str = "", icon: str = "NONE", **_: Any) -> None:
        assert icon in ICONS, icon
        assert name in data.bl_rna.properties, f"{data} has no {name}"
        self.properties.append(name)
        self.texts += [text] if text else []

    def prop_search(self, data: Any, name: str, where: Any, items: str, **_: Any) -> None:
        self.prop(data, name)
        assert items in where.bl_rna.properties

    def menu(self, name: str, icon: str = "NONE", **_: Any) -> None:
        assert icon in ICONS, icon
        assert hasattr(bpy.types, name), name

    def template_list(
        self, kind: str, _: str, data: Any, items: str, active: Any, index: str, **__: Any
    ) -> None:
        drawer = getattr(bpy.types, kind)
        assert index in active.bl_rna.properties
        for each in getattr(data, items):
            stand_in = SimpleNamespace()
            drawer.draw_item(stand_in, bpy.context, self, data, each, 0, active, index)

    def template_icon(self, icon_value: int, scale: float = 1.0) -> None:
        assert icon_value > 0
        self.texts.append("<picture>")

    def template_icon_view(self, data: Any, name: str, **_: Any) -> None:
        self.prop(data, name)
        self.texts.append("<pictures>")


def draw(panel: type) -> Recording | None:
    """A panel as it is drawn now; None where it is not shown."""
    if not panel.poll(bpy.context):
        return None
    layout = Recording()
    panel.draw(SimpleNamespace(layout=layout), bpy.context)
    return layout


def panels() -> list[type]:
    """The extension's panels, in the order of the sidebar."""
    found = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("OPTISENSE_PT")]
    return sorted(found, key=lambda panel: panel.bl_order)


def menus() -> list[type]:
    """The extension's menus."""
    return [getattr(bpy.types, n) for n in dir(bpy.types) if n.startswith("OPTISENSE_MT")]

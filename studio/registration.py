"""Registration of the extension's modules with Blender, according to the names that they define.

A module may define classes whose names begin with ``OPTISENSE_``; ``PROPERTIES``, property groups
by the Blender type that holds them and the name of the property; ``HOOKS``, pairs of a list of
callbacks and a function of the module; and functions ``register`` and ``unregister`` for everything
else.
"""

from __future__ import annotations

from types import ModuleType

import bpy


def add(module: ModuleType) -> None:
    """Register a module, its classes in the order of their definition."""
    for each in _classes(module):
        bpy.utils.register_class(each)
    for owner, groups in getattr(module, "PROPERTIES", {}).items():
        # Properties of the window manager hold the state of the session, and belong in no file.
        options = {"SKIP_SAVE"} if owner == "WindowManager" else set()
        for name, group in groups.items():
            held = bpy.props.PointerProperty(type=group, options=options)
            setattr(getattr(bpy.types, owner), name, held)
    for called, function in getattr(module, "HOOKS", ()):
        called.append(function)
    if hasattr(module, "register"):
        module.register()


def remove(module: ModuleType) -> None:
    """Unregister a module."""
    if hasattr(module, "unregister"):
        module.unregister()
    for called, function in getattr(module, "HOOKS", ()):
        called.remove(function)
    for owner, groups in getattr(module, "PROPERTIES", {}).items():
        for name in groups:
            delattr(getattr(bpy.types, owner), name)
    for each in reversed(_classes(module)):
        bpy.utils.unregister_class(each)


def _classes(module: ModuleType) -> list[type]:
    return [
        each
        for name, each in vars(module).items()
        if name.startswith("OPTISENSE_") and each.__module__ == module.__name__
    ]

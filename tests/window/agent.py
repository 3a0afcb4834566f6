"""Runs inside Blender, told by `blender -P`: reports what Blender holds. All that it does is to
move the mouse where it looks for a button.

Each line on a local socket is a Python expression, or `scan X TOP END STEP` and a name: the mouse
goes down the sidebar until it is over a button of that name (see `is_named`), and the answer is how
far down that is, or null, and the names of all buttons that it came over. `along KIND PART Y LEFT
END STEP` and a name is the same for the mouse that goes to the right in a part of an editor.
Answers are lines of JSON.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import socket
from collections.abc import Generator
from typing import Any

import bpy
from bpy_extras import view3d_utils
from mathutils import Vector

SOON = 0.005
MOST_TURNS = 200
"""Largest number of calls of the timer until the mouse is in its place."""


def window() -> bpy.types.Window:
    """The main window."""
    return bpy.context.window_manager.windows[0]


def area(kind: str) -> bpy.types.Area:
    """The first editor of a kind, whichever window it is in."""
    return next(
        each
        for one in bpy.context.window_manager.windows
        for each in one.screen.areas
        if each.type == kind
    )


def region(kind: str, part: str) -> bpy.types.Region:
    """A part of the first editor of a kind."""
    return next(each for each in area(kind).regions if each.type == part)


def place(kind: str, part: str) -> list[int]:
    """Left, top, width and height of a part of an editor, in pixels from the screen's top left."""
    found, first = region(kind, part), window()
    own = next(
        each
        for each in bpy.context.window_manager.windows
        if area(kind) in each.screen.areas.values()
    )
    left, bottom = own.x + found.x, own.y + found.y
    return [left, first.y + first.height - bottom - found.height, found.width, found.height]


def close_area(kind: str) -> None:
    """Give an editor's place back to its neighbours."""
    found = area(kind)
    own = next(
        each for each in bpy.context.window_manager.windows if found in each.screen.areas.values()
    )
    with bpy.context.temp_override(window=own, area=found):
        bpy.ops.screen.area_close()


def chosen_file() -> str:
    """What is chosen where a file is asked for."""
    browser = area("FILE_BROWSER")
    own = next(
        each for each in bpy.context.window_manager.windows if browser in each.screen.areas.values()
    )
    with bpy.context.temp_override(window=own, area=browser):
        found = bpy.context.active_file
    return found.name if found else ""


def on_screen(point: Any) -> list[float]:
    """Where a point of the scene is drawn, in pixels from the window's top left."""
    view = region("VIEW_3D", "WINDOW")
    space = area("VIEW_3D").spaces.active.region_3d
    spot = view3d_utils.location_3d_to_region_2d(view, space, Vector(point))
    return [view.x + spot.x, window().height - view.y - spot.y]


def under(kind: str = "VIEW_3D", part: str = "UI") -> str:
    """The button under the pointer in a part of an editor: `optisense.open()`, with all its
    arguments, a property as `optisense_search.budget`, or nothing.
    """
    found = region(kind, part)
    with bpy.context.temp_override(window=window(), area=area(kind), region=found):
        found = getattr(bpy.context, "property", None)
        if found is not None:
            return found[1]
        if not bpy.ops.ui.copy_python_command_button.poll():
            return ""
        bpy.context.window_manager.clipboard = ""
        bpy.ops.ui.copy_python_command_button()
        return bpy.context.window_manager.clipboard.removeprefix("bpy.ops.")


tips: dict[str, str] = {}
"""Descriptions, as tooltips show them, of the buttons that the mouse came over, by their names."""


def description(button: str) -> str:
    """The description that the tooltip of a button of ours shows; nothing for others.

    Args:
        button: as `under` tells it.
    """
    operator, is_operator, _ = button.partition("(")
    if is_operator:
        module, _, name = operator.partition(".")
        return str(getattr(getattr(bpy.ops, module), name).get_rna_type().description)
    owner, _, name = button.rpartition(".")
    for group in _groups(owner.rpartition(".")[2]):
        if name in group.properties:
            return str(group.properties[name].description)
    return ""


def _groups(owner: str) -> list[Any]:
    """The types of ours that a button's property may belong to: that of its owner's name first."""
    places = (bpy.types.WindowManager, bpy.types.Scene, bpy.types.Object)
    named = [getattr(place.bl_rna.properties.get(owner), "fixed_type", None) for place in places]
    types = bpy.types.PropertyGroup.__subclasses__()
    every = [each.bl_rna for each in types if "optisense" in each.__name__.lower()]
    return [each for each in named if each is not None] + every


def is_named(button: str, what: str) -> bool:
    """Whether a button is meant by a name.

    Args:
        button: as `under` tells it.
        what: an operator (`optisense.open`), one with its arguments
            (`wm.call_menu(name="OPTISENSE_MT_vary")`), or a property (`budget`). `optisense.*` is
            any operator of ours.
    """
    operator, is_operator, _ = button.partition("(")
    if what.endswith(".*"):
        return bool(is_operator) and operator.startswith(what[:-1])
    if "(" in what:
        return button == what
    return what == (operator if is_operator else button.rpartition(".")[2])


def part(name: str) -> Any:
    """A module of the extension, as Blender has loaded it."""
    return importlib.import_module(f"bl_ext.user_default.optisense_studio.{name}")


frames = [0]
"""How often the 3D view was drawn."""


def _count() -> None:
    frames[0] += 1


def scene() -> bpy.types.Scene:
    """The scene that is shown."""
    return window().scene


def kinds(kind: str) -> list[Any]:
    """The sensor's objects of a kind."""
    return [each for each in scene().objects if each.optisense.kind == kind]


def state() -> Any:
    """What the extension's panels show."""
    return bpy.context.window_manager.optisense


def _poll() -> float:
    """Answer what was asked; without a thread, which Blender's context does not bear."""
    with contextlib.suppress(BlockingIOError):
        _listener.connection = _listener.server.accept()[0]
        _listener.connection.setblocking(False)
    with contextlib.suppress(BlockingIOError, AttributeError):
        _listener.rest += _listener.connection.recv(65536)
    while _listener.scan is None and b"\n" in _listener.rest:
        line, _, _listener.rest = _listener.rest.partition(b"\n")
        text = line.decode()
        if text.startswith("scan "):
            _, x, top, end, step, what = text.split(" ", 5)
            points = [(int(x), y) for y in range(int(top), int(end), int(step))]
            _listener.scan = _scan(points, what, 1)
        elif text.startswith("along "):
            _, kind, part_, y, left, end, step, what = text.split(" ", 7)
            points = [(x, int(y)) for x in range(int(left), int(end), int(step))]
            _listener.scan = _scan(points, what, 0, kind, part_)
        else:
            _say(_answer(text))
    if _listener.scan is not None:
        try:
            next(_listener.scan)
        except StopIteration as found:
            _listener.scan = None
            _say(json.dumps({"value": found.value}))
        except Exception as error:
            _listener.scan = None
            _say(json.dumps({"error": f"{type(error).__name__}: {error}"}))
    return SOON


def _scan(
    points: list[tuple[int, int]],
    what: str,
    axis: int,
    kind: str = "VIEW_3D",
    part: str = "UI",
) -> Generator[None, None, tuple[int | None, list[str]]]:
    """The coordinate along an axis of the first point where a button is, and the buttons seen; goes
    on at each turn of the timer.
    """
    seen: list[str] = []
    for x, y in points:
        window().cursor_warp(x, window().height - y)
        for _ in range(MOST_TURNS):
            yield
            if _has_come(x, y):
                break
        yield  # timers come before what the mouse touches is told
        found = under(kind, part)
        if found and found not in seen:
            seen.append(found)
            tips[found] = description(found)
        if is_named(found, what):
            return (x, y)[axis], seen
    return None, seen


def _say(line: str) -> None:
    _listener.connection.setblocking(True)  # a long answer does not fit into the socket at once
    _listener.connection.sendall(line.encode() + b"\n")
    _listener.connection.setblocking(False)


def _answer(text: str) -> str:
    known = {**globals(), "manager": bpy.context.window_manager}
    try:
        return json.dumps({"value": eval(text, known)})
    except Exception as error:
        return json.dumps({"error": f"{type(error).__name__}: {error}"})


class OPTISENSE_TEST_OT_pointer(bpy.types.Operator):  # noqa: N801
    """Finds out where Blender believes the mouse to be"""

    bl_idname = "optisense_test.pointer"
    bl_label = "Pointer"
    seen = (0, 0)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        type(self).seen = (event.mouse_x, context.window.height - event.mouse_y)
        return {"CANCELLED"}


def _has_come(x: int, y: int) -> bool:
    with bpy.context.temp_override(window=window()):
        bpy.ops.optisense_test.pointer("INVOKE_DEFAULT")
    seen = OPTISENSE_TEST_OT_pointer.seen
    return abs(seen[0] - x) <= 1 and abs(seen[1] - y) <= 1


class Listener:
    """The socket that questions come by."""

    connection: socket.socket
    rest = b""
    scan: Generator[None, None, tuple[int | None, list[str]]] | None = None

    def __init__(self) -> None:
        self.server = socket.socket(socket.AF_UNIX)
        self.server.bind(os.environ["OPTISENSE_AGENT"])
        self.server.listen()
        self.server.setblocking(False)


_listener = Listener()
bpy.types.SpaceView3D.draw_handler_add(_count, (), "WINDOW", "POST_PIXEL")
bpy.utils.register_class(OPTISENSE_TEST_OT_pointer)
bpy.context.preferences.system.viewport_aa = "OFF"  # there is only a processor to draw with
bpy.app.timers.register(_poll, first_interval=SOON, persistent=True)

"""Gloss on parts: bright rims and highlights on gel and acrylic, reflections on mirrors, and the
tint of ghosts.

Blender's solid mode draws the colours and opacities; the gloss is drawn over them and, like all of
that mode, works with software OpenGL.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..scene import kinds
from ..scene.collections import objects_of
from ..scene.meshes import shown_vertices
from ..scene.world import world_matrix
from . import drawing, section
from .drawing import MOST_FACES, in_world

GLOSS = {
    "elastomer": (1.0, 0.93, 0.85, 0.55),
    "support": (0.85, 0.95, 1.0, 0.5),
    "interface": (0.9, 0.85, 1.0, 0.4),
    "sensing_surface": (0.8, 0.85, 0.9, 0.2),
    "blocker": (0.55, 0.6, 0.7, 0.3),
    "mirror": (1.0, 1.0, 1.0, 0.8),
}
"""Colour of the rim and its opacity by role, each 0 to 1; the rim of a mirror takes the colour of
what it reflects.
"""

METAL = ("mirror",)
"""Roles of parts that reflect."""

GLASS, REFLECTING, TINTED = 0.0, 1.0, 2.0
"""Surfaces that the shader knows. A tinted one is a ghost: it has its own colour, and its opacity
is the same all over.
"""

KEY = (-0.4, 0.7, 0.6)
"""Direction to the light that makes the highlights: to the right, up and towards the viewer."""

VERTEX = """
void main() {
  place = pos;
  way = normal;
  gl_Position = projected * vec4(pos, 1.0);
  gl_Position.z -= 0.0002 * gl_Position.w;  // before the faces that Blender draws
}
"""

FRAGMENT = """
void main() {
  if (dot(place, cut.xyz) + cut.w < 0.0) discard;
  vec3 to_eye = normalize(eye.w > 0.5 ? eye.xyz - place : eye.xyz);
  vec3 n = normalize(way);
  if (dot(n, to_eye) < 0.0) n = -n;
  float facing = dot(n, to_eye);
  float gloss = pow(max(dot(n, normalize(key.xyz + to_eye)), 0.0), 60.0);
  if (key.w > 1.5) {
    shown = vec4(colour.rgb * (0.5 + 0.5 * facing) + 0.3 * gloss, colour.a);
  } else if (key.w > 0.5) {
    float up = dot(reflect(-to_eye, n), key.xyz);
    float sky = smoothstep(-0.1, 0.25, up) * (0.55 + 0.45 * up);
    shown = vec4(mix(vec3(0.12, 0.14, 0.17), colour.rgb, clamp(sky + gloss, 0.0, 1.0)), colour.a);
  } else {
    float rim = pow(1.0 - facing, 3.0);
    shown = vec4(mix(colour.rgb, vec3(1.0), gloss), clamp(colour.a * (rim + gloss), 0.0, 1.0));
  }
}
"""

_shader: Any = None
_batches: dict[str, tuple[tuple[Any, ...], Any]] = {}
"""State of each present part's mesh, and its triangles on the graphics card, by part."""


def draw(scene: bpy.types.Scene) -> None:
    """Draw the gloss of all visible parts of a scene; called while a 3D view is drawn."""
    import gpu

    view = bpy.context.region_data
    if view is None:
        return
    turn = view.view_matrix.inverted()
    is_perspective = view.is_perspective
    eye = turn.translation if is_perspective else turn.col[2].to_3d()
    key = (turn.to_3x3() @ Vector(KEY)).normalized()
    shader = _made()
    shader.bind()
    shader.uniform_float("projected", view.perspective_matrix)
    shader.uniform_float("eye", (*eye, float(is_perspective)))
    shader.uniform_float("cut", section.plane(scene) or section.NOWHERE)
    gpu.state.face_culling_set("NONE")
    for part in objects_of(scene, "PART"):
        role = part.optisense.role
        if role not in GLOSS or not part.visible_get() or part.mode == "EDIT":
            continue
        batch = _batch(part)
        if batch is not None:
            shader.uniform_float("key", (*key, REFLECTING if role in METAL else GLASS))
            shader.uniform_float("colour", GLOSS[role])
            batch.draw(shader)
    _draw_ghosts(scene, shader, key)


def _draw_ghosts(scene: bpy.types.Scene, shader: Any, key: Vector) -> None:
    """Tint the best parts of a search, also where parts of the sensor are in front of them."""
    import gpu

    ghosts = [e for e in objects_of(scene, "SHOWN") if e.optisense.key.startswith(kinds.GHOST)]
    gpu.state.depth_test_set("NONE")
    for ghost in ghosts:
        batch = _batch(ghost) if ghost.visible_get() else None
        if batch is not None:
            shader.uniform_float("key", (*key, TINTED))
            shader.uniform_float("colour", tuple(ghost.color))
            batch.draw(shader)
    gpu.state.depth_test_set("LESS_EQUAL")


def _made() -> Any:
    """Return the shader, which is compiled once."""
    global _shader
    if _shader is None:
        import gpu

        between = gpu.types.GPUStageInterfaceInfo("optisense_gloss")
        between.smooth("VEC3", "place")
        between.smooth("VEC3", "way")
        info = gpu.types.GPUShaderCreateInfo()
        info.vertex_in(0, "VEC3", "pos")
        info.vertex_in(1, "VEC3", "normal")
        info.vertex_out(between)
        info.push_constant("MAT4", "projected")
        for name in ("eye", "key", "cut", "colour"):
            info.push_constant("VEC4", name)
        info.fragment_out(0, "VEC4", "shown")
        info.vertex_source(VERTEX)
        info.fragment_source(FRAGMENT)
        _shader = gpu.shader.create_from_info(info)
    return _shader


def _batch(part: bpy.types.Object) -> Any:
    mesh = part.data
    if not 0 < len(mesh.polygons) <= MOST_FACES:
        return None
    places = shown_vertices(mesh).ravel()
    weights = np.arange(1, len(places) + 1, dtype=np.float32)
    state = (world_matrix(part).freeze(), len(mesh.polygons), float(places @ weights))
    kept = _batches.get(part.name)
    if kept is None or kept[0] != state:
        from gpu_extras.batch import batch_for_shader

        corners, normals = triangles(mesh)
        turn = np.array(world_matrix(part).to_3x3().inverted_safe().transposed(), dtype=np.float32)
        content = {"pos": in_world(corners, world_matrix(part)), "normal": normals @ turn.T}
        for gone in [name for name in _batches if name not in bpy.data.objects]:
            del _batches[gone]
        kept = _batches[part.name] = (state, batch_for_shader(_made(), "TRIS", content))
    return kept[1]


def triangles(mesh: bpy.types.Mesh) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the corners of a mesh's triangles, (3 n, 3) mm, and unit normals there, (3 n, 3),
    smooth except across sharp edges.
    """
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    loops = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    vertices = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    normals = np.empty(3 * len(mesh.loops), dtype=np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    return shown_vertices(mesh)[vertices], normals.reshape(-1, 3)[loops]


@bpy.app.handlers.persistent
def _forget(*_: Any) -> None:
    _batches.clear()


HOOKS = (
    (drawing.when_drawing, draw),
    (bpy.app.handlers.load_post, _forget),
)


def unregister() -> None:
    global _shader
    _batches.clear()
    _shader = None

"""Functions that put cages around parts, and move and refine them; each returns a new design."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.design.cage import MAX_POINTS, MOST_ALONG, Cage, Share, as_array
from optisense.design.limits import LARGEST
from optisense.design.sensor_design import SensorDesign
from optisense.errors import DesignError
from optisense.geometry.cage import Resolution, refined_points
from optisense.keyword_types import is_real
from optisense.near import suggestion

Shape = Literal["points", "c_min", "c_max"]
"""Kind of a cage's control points: those of the present shape, or of an end of its range."""

THINNEST = 0.5
"""Smallest thickness of a box, mm; boxes over flat parts are made this thick."""

SAME_SHARE = 1e-9
"""Length of a box along an axis, relative to its largest length, below which it counts as flat
along this axis; a margin for rounding."""


def add_cage(
    design: SensorDesign,
    name: str,
    parts: Iterable[str],
    resolution: Resolution = (3, 3, 3),
    margin: float = 0.0,
) -> SensorDesign:
    """Return a design with a cage at rest over the bounding box of some parts; no shape changes.

    Args:
        design: design, which is not changed.
        name: name of the new cage.
        parts: parts that it deforms; parts that touch should move together.
        resolution: control points along x, y, z.
        margin: distance, mm, by which the box is larger than the parts on all sides. Along an axis
            in which the parts are flat it is made `THINNEST` thick.

    Raises:
        DesignError: there is a cage of that name, a part is unknown, has no mesh or is in a cage
            already, or the resolution or the margin is out of range.
    """
    if isinstance(parts, str):
        raise DesignError(
            f"the parts of a cage are a list of names, not '{parts}'",
            hint=f"Write ['{parts}'], also for a single one",
        )
    chosen = list(parts)
    resolution = _counts(resolution)
    if not (is_real(margin) and 0.0 <= margin <= LARGEST):
        raise DesignError(f"the margin of a cage is {margin}", hint=f"Give 0 to {LARGEST:g}, in mm")
    if name in design.cages:
        raise DesignError(
            f"there is a cage '{name}' already", where=design.where("cages", name),
            hint="Choose another name",
        )  # fmt: skip
    if not chosen:
        raise DesignError("a cage needs a part to deform", hint=_known(design.parts))
    for part in chosen:
        if part not in design.meshes:
            raise DesignError(
                f"there is no part '{part}'" if part not in design.parts else
                f"part '{part}' has no mesh",
                hint=suggestion(part, design.meshes, limit=20),
            )  # fmt: skip
    corners = np.array([design.meshes[part].bounds for part in chosen])
    lower, upper = corners[:, 0].min(axis=0) - margin, corners[:, 1].max(axis=0) + margin
    thin = np.maximum(0.0, THINNEST - (upper - lower)) / 2.0
    cage = Cage.around(chosen, [lower - thin, upper + thin], resolution)
    return _with_cage(design, name, cage.model_dump(mode="json"))


def remove_cage(design: SensorDesign, name: str) -> SensorDesign:
    """Return the design without a cage: its parts are at rest again.

    Raises:
        DesignError: there is no such cage.
    """
    _cage(design, name)
    data = design.model_dump(mode="json")
    del data["cages"][name]
    return design._replaced(data)


def refine_cage(design: SensorDesign, name: str, resolution: Resolution) -> SensorDesign:
    """Return a design whose cage has more control points, with exactly the same shape and range of
    shapes.

    Raises:
        DesignError: there is no such cage, or `resolution` is out of range or has fewer points
            along an axis.
    """
    cage = _cage(design, name)
    resolution = _counts(resolution)
    if any(new < old for new, old in zip(resolution, cage.resolution, strict=True)):
        raise DesignError(
            f"cage '{name}' has {_times(cage.resolution)} control points; "
            f"{_times(resolution)} are fewer",
            where=design.where("cages", name, "resolution"),
            hint="A coarser cage can't keep the shape; remove the cage and add a new one",
        )

    def finer(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return refined_points(points, cage.resolution, resolution)

    data = cage.model_dump(mode="json") | {"resolution": list(resolution)}
    for field in ("points", "c_min", "c_max"):
        if data[field]:
            data[field] = _plain(finer(as_array(getattr(cage, field))))
    if isinstance(cage.blend, list):
        data["blend"] = _shares(
            finer(cage.current_points()),
            finer(as_array(cage.c_min or [])),
            finer(as_array(cage.c_max or [])),
            finer(as_array(cage.blend)),
            design.where("cages", name, "blend"),
        )
    return _with_cage(design, name, data)


def move_points(
    design: SensorDesign,
    name: str,
    moves: Mapping[str, Sequence[float]],
    of: Shape = "points",
) -> SensorDesign:
    """Return a design with some control points of a cage moved.

    Args:
        design: design, which is not changed.
        name: name of the cage.
        moves: displacement along x, y, z, mm, by the points: "13", "1,1,2" or "1,*,2" (a row).
        of: points to move: those of the shape, or of an end of its range.

    Raises:
        DesignError: there is no such cage or point, or the shape is set by a blend.
    """
    cage = _cage(design, name)
    if of not in get_args(Shape):
        raise DesignError(f"a cage has no '{of}'", hint=f"Give {', '.join(get_args(Shape))}")
    if of == "points" and cage.blend is not None:
        raise DesignError(
            f"the shape of cage '{name}' is a blend of c_min and c_max",
            where=design.where("cages", name, "blend"),
            hint="Change the blend, move the points of c_min or c_max, or settle the shape first",
        )
    current = getattr(cage, of)
    if not current:
        raise DesignError(
            f"cage '{name}' has no {of}",
            where=design.where("cages", name),
            hint="Set the ends of its range first",
        )
    points = as_array(current)
    for which, way in moves.items():
        step = _array(way)
        if step is None or step.shape != (3,) or not np.isfinite(step).all():
            raise DesignError(
                f"points '{which}' of cage '{name}' can't be moved by {way}",
                hint="Give three numbers: mm along x, y and z",
            )
        points[select_points(cage.resolution, which)] += step
    return _with_cage(design, name, cage.model_dump(mode="json") | {of: _plain(points)})


def set_range(
    design: SensorDesign,
    name: str,
    c_min: ArrayLike | None = None,
    c_max: ArrayLike | None = None,
    blend: float | None = 0.0,
) -> SensorDesign:
    """Return a design whose cage has a range of shapes for a search, given by its two ends.

    Args:
        design: design, which is not changed.
        name: name of the cage.
        c_min, c_max: control points (N, 3) of the ends, mm; None takes the present shape.
        blend: share of c_max in the shape, for all points; None keeps the present points.

    Raises:
        DesignError: there is no such cage, or the numbers do not fit.
    """
    cage = _cage(design, name)
    now = cage.current_points()
    data = cage.model_dump(mode="json")
    for field, given in (("c_min", c_min), ("c_max", c_max)):
        points = now if given is None else _array(given)
        if points is None or points.shape[1:] != (3,) or not np.isfinite(points).all():
            raise DesignError(
                f"{field} of cage '{name}' is no array of finite control points",
                where=design.where("cages", name, field),
                hint=f"Give {len(now)} rows of x, y, z, in mm",
            )
        data[field] = _plain(points)
    if not (blend is None or is_real(blend)):
        raise DesignError(
            f"the blend of cage '{name}' is no number",
            where=design.where("cages", name, "blend"),
            hint="Give 0 (c_min) to 1 (c_max), or None",
        )
    data["blend"] = None if blend is None else float(blend)
    data["points"] = _plain(now) if blend is None else []
    return _with_cage(design, name, data)


def settle_cage(design: SensorDesign, name: str) -> SensorDesign:
    """Return a design whose cage has the points of the present blend as its own; the range stays.

    Raises:
        DesignError: there is no such cage.
    """
    cage = _cage(design, name)
    data = cage.model_dump(mode="json")
    return _with_cage(design, name, data | {"points": _plain(cage.current_points()), "blend": None})


def select_points(resolution: Resolution, which: str) -> list[int]:
    """Return the indices of the points "13", "1,1,2" or, with a star for a whole axis, "1,*,2".

    Raises:
        DesignError: the text can't be read, or there is no such point.
    """
    count = int(np.prod(resolution))
    hint = (
        f"Write a number below {count}, or i,j,k below {','.join(map(str, resolution))}, with * "
        "for all of an axis"
    )
    text = which.replace(" ", "") if isinstance(which, str) else ""
    if re.fullmatch(r"\d+", text) and int(text) < count:
        return [int(text)]
    if re.fullmatch(r"(\d+|\*),(\d+|\*),(\d+|\*)", text):
        axes = [
            range(size) if step == "*" else [int(step)]
            for step, size in zip(text.split(","), resolution, strict=True)
        ]
        if all(max(axis) < size for axis, size in zip(axes, resolution, strict=True)):
            _, ny, nz = resolution
            return [(i * ny + j) * nz + k for i in axes[0] for j in axes[1] for k in axes[2]]
    raise DesignError(f"there is no control point {which!r}", hint=hint)


def _counts(resolution: Iterable[int]) -> Resolution:
    """Return the numbers of control points along x, y, z; refuse what is no three integers in
    range.
    """
    hint = f"Give 2 to {MOST_ALONG} along each axis, {MAX_POINTS} in all at most"
    try:
        nx, ny, nz = (operator.index(count) for count in resolution)
    except (TypeError, ValueError):
        raise DesignError(
            f"the resolution of a cage is {resolution!r}, not three integers such as (5, 5, 3)",
            hint=hint,
        ) from None
    counts = nx, ny, nz
    if min(counts) < 2 or max(counts) > MOST_ALONG or math.prod(counts) > MAX_POINTS:
        raise DesignError(f"a cage can't have {_times(counts)} control points", hint=hint)
    return counts


def _array(values: object) -> NDArray[np.float64] | None:
    """Return numbers as an array; None if they are something else."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        return None


def _shares(
    now: NDArray[np.float64],
    c_min: NDArray[np.float64],
    c_max: NDArray[np.float64],
    elsewhere: NDArray[np.float64],
    where: str,
) -> list[dict[str, float]]:
    """Return the blend of a refined cage; `elsewhere` is used where both ends are equal."""
    span = c_max - c_min
    wide = np.abs(span) > SAME_SHARE
    share = np.where(wide, (now - c_min) / np.where(wide, span, 1.0), elsewhere)
    if (share < -1e-6).any() or (share > 1.0 + 1e-6).any():
        raise DesignError(
            "a finer cage can't hold this shape between its c_min and c_max",
            where=where,
            hint="Settle the shape first, or set the range anew",
        )
    return [Share(x=x, y=y, z=z).model_dump() for x, y, z in share.clip(0.0, 1.0).tolist()]


def _cage(design: SensorDesign, name: str) -> Cage:
    if name not in design.cages:
        raise DesignError(f"there is no cage '{name}'", hint=_known(design.cages, name))
    return design.cages[name]


def _known(names: Iterable[str], wanted: str = "") -> str:
    known = list(names)
    return suggestion(wanted, known, limit=20) or "The design has none"


def _with_cage(design: SensorDesign, name: str, cage: dict[str, Any]) -> SensorDesign:
    data = design.model_dump(mode="json")
    data["cages"][name] = cage
    return design._replaced(data, where=f"cage '{name}'")


def _plain(points: NDArray[np.float64]) -> list[dict[str, float]]:
    return [{"x": x, "y": y, "z": z} for x, y, z in points.tolist()]


def _times(resolution: Resolution) -> str:
    return " x ".join(map(str, resolution))

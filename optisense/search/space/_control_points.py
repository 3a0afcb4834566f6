"""Parameters for the control points of cages."""

from __future__ import annotations

import numpy as np

from optisense.design import Cage, SensorDesign, set_value
from optisense.design.cage import as_array
from optisense.errors import SearchError
from optisense.search.space.parameters import (
    Around,
    CagePoints,
    Choice,
    Continuous,
    Integer,
    Parameter,
    Specification,
    Target,
    Together,
    within,
)

SYMMETRY_TOLERANCE = 1e-4
"""Largest difference between mirror images in a symmetric cage, as a share of its box or as a blend
share; it allows for rounded numbers in files.
"""


def as_points(spec: Specification) -> CagePoints:
    """Return bounds or a reach for all control points, unless single points are given already."""
    if isinstance(spec, CagePoints):
        return spec
    if isinstance(spec, Choice | Integer | Together):
        raise SearchError("control points take a range of numbers", hint="Give two bounds")
    return CagePoints(spec)


def point_parameters(
    cage: Cage,
    path: str,
    now: np.ndarray,
    spec: CagePoints,
    mirror: np.ndarray | None = None,
    free: np.ndarray | None = None,
) -> list[Parameter]:
    """Return parameters for the coordinates of control points (N, 3), of those that have an effect
    (`free`, (N, 3) bool). Coordinates are mirrored across the middle of the box `mirror` (2, 3),
    mm; it is None for blend shares, which are not mirrored.
    """
    count = len(now)
    chosen = range(count) if spec.points is None else spec.points
    for index in chosen:
        if not 0 <= index < count:
            raise SearchError(
                f"there is no control point {index}", hint=f"The cage has points 0 to {count - 1}"
            )
    free = np.ones((count, 3), dtype=bool) if free is None else free
    images = _images(cage, spec.symmetry)
    plane = "xyz".index(spec.symmetry) if spec.symmetry else -1
    if spec.symmetry:
        _check_symmetric(cage, now, images, plane, mirror, spec.symmetry)
    found = []
    for index in dict.fromkeys(min(index, int(images[index])) for index in chosen):
        image = int(images[index])
        for axis in (k for k in range(3) if "xyz"[k] in spec.axes):
            mirrored = axis == plane and mirror is not None
            if not free[index, axis] or (axis == plane and image == index):
                continue  # a point in the plane of symmetry stays in it
            target = f"{path}[{index}].{'xyz'[axis]}"
            targets = [Target(target)]
            if image != index:
                offset = float(mirror[:, axis].sum()) if mirrored and mirror is not None else 0.0
                other = f"{path}[{image}].{'xyz'[axis]}"
                targets.append(Target(other, -1.0 if mirrored else 1.0, offset))
            value = float(now[index, axis])
            bounds = spec.range.about(value) if isinstance(spec.range, Around) else spec.range
            if isinstance(spec.range, Around) and mirror is None:
                bounds = Continuous(max(0.0, bounds.low), min(1.0, bounds.high), bounds.steps)
            start = within(value, bounds)
            found.append(Parameter(target, bounds, start, tuple(targets), asked=path))
    if not found:
        raise SearchError(
            "none of these coordinates has an effect", hint="Name other points or axes"
        )
    return found


def _images(cage: Cage, symmetry: str | None) -> np.ndarray:
    """Return the index of each control point's mirror image, (N,); its own without symmetry."""
    lattice = np.arange(int(np.prod(cage.resolution))).reshape(cage.resolution)
    return (np.flip(lattice, "xyz".index(symmetry)) if symmetry else lattice).reshape(-1)


def _check_symmetric(
    cage: Cage,
    now: np.ndarray,
    images: np.ndarray,
    plane: int,
    mirror: np.ndarray | None,
    name: str,
) -> None:
    box = np.array(cage.box)
    checked = [("points", now, float(np.ptp(box, axis=0).max()))]
    if mirror is None:  # then the ends of the blend must be mirror images too
        assert cage.c_min is not None and cage.c_max is not None
        size = checked.pop()[2]
        checked = [("c_min", as_array(cage.c_min), size), ("c_max", as_array(cage.c_max), size)]
    for label, points, size in checked:
        image = points[images].copy()
        image[:, plane] = box[:, plane].sum() - image[:, plane]
        apart = np.abs(image - points).max(axis=1)
        if apart.max() > SYMMETRY_TOLERANCE * size:
            worst = int(apart.argmax())
            raise SearchError(
                f"the cage's {label} are not symmetric along {name}: points {worst} and "
                f"{images[worst]} are {apart.max():.3g} mm from being mirror images",
                hint="Search without symmetry, or make the shape symmetric first",
            )


def shares_of(cage: Cage) -> np.ndarray:
    """Return each coordinate's blend between c_min and c_max, (N, 3); 0 where they agree."""
    if isinstance(cage.blend, list):
        return as_array(cage.blend)
    if cage.blend is not None:
        return np.full((len(cage.c_min or []), 3), float(cage.blend))
    span = span_of(cage)
    way = as_array(cage.points) - as_array(cage.c_min or [])
    shares = np.divide(way, span, out=np.zeros_like(way), where=span != 0.0)
    return np.asarray(np.clip(shares, 0.0, 1.0))


def mean_share(cage: Cage) -> float:
    """Return the mean blend share of the coordinates that differ between c_min and c_max."""
    moving = span_of(cage) != 0.0
    return float(shares_of(cage)[moving].mean()) if moving.any() else 0.0


def span_of(cage: Cage) -> np.ndarray:
    """Return c_max minus c_min, (N, 3) mm."""
    return as_array(cage.c_max or []) - as_array(cage.c_min or [])


def with_form(design: SensorDesign, name: str, **form: object) -> SensorDesign:
    """Return the design with other values of `points` and `blend` of a cage."""
    cage = design.cages[name].model_dump(mode="json")
    return set_value(design, f"cages.{name}", {**cage, **form})


def as_dicts(points: np.ndarray) -> list[dict[str, float]]:
    """Return points (N, 3) as a design file has them."""
    return [{"x": x, "y": y, "z": z} for x, y, z in points.tolist()]

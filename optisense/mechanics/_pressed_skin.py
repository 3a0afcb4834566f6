"""The skin of a gel under contacts: its shape, and the pressures and forces on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.errors import ContactError
from optisense.mechanics._displacement_field import DisplacementField, grid_response
from optisense.mechanics._elasticity import Elasticity
from optisense.mechanics._footprint import Footprint
from optisense.mechanics._gel_patch import GelPatch
from optisense.mechanics._grid_spline import GridSpline, binned
from optisense.mechanics._neighbours import OUTWARD, Neighbours
from optisense.mechanics._normal_contact import TOLERANCE, contact_area, solve_normal_contact
from optisense.mechanics._relaxation import Relaxation

SETTLED = 1e-4
"""Change (mm) of the displacements that contacts cause at each other at which the iteration over
contacts has converged: below the tolerance of the pressure of a press of 0.8 mm."""
UNSETTLED = 1e-3
"""Change (mm) of the displacements in the last iteration from which on the result is refused: a
sixtieth of a pixel of GelSight Mini. Below it, an iteration may stall at its tolerance."""
FIRST_TOLERANCE = 0.01
"""Tolerance of the first pressure, solved before the correction for the gel's shape and the
displacements due to other contacts are known; see `normal_contact.TOLERANCE`."""
ROUGH_SHARE = 0.02
"""Ratio of a pressure's tolerance to the last change (mm) of what it is corrected by, so that each
iteration is solved somewhat better than the next one changes it."""
MAX_TURNS = 40
"""Number of iterations of the pressure, or the shear, and the correction for the gel's shape after
which the solver fails. Most contacts take 2 to 5, a plate over a whole gel 8."""
MAX_SWEEPS = 20
"""Number of sweeps over contacts after which the solver fails; distant contacts take one or two,
contacts that nearly touch seven."""


@dataclass(frozen=True, eq=False)
class Pressed:
    """One contact of a pressed skin.

    Attributes:
        place: its grid and overlap.
        pressure: (rows, columns) pressure (MPa) on this grid.
        field: the displacement that it causes.
        shear: (2, rows, columns) shear (MPa) along x and y, if the indenter was dragged.
        beyond: (rows, columns) normal displacement (mm) of the gel in addition to that of a flat
            layer, on the grid of the gel's patch, if it has one.
        warning: a sentence about the error of the force, if it is large.
    """

    place: Footprint
    pressure: FloatArray
    field: DisplacementField
    shear: FloatArray | None = None
    beyond: FloatArray | None = None
    warning: str = ""

    @property
    def force(self) -> float:
        """Force (N) along the contact's outward normal."""
        return float(self.pressure.sum()) * self.place.pitch**2

    @property
    def area(self) -> float:
        """Area (mm^2) of the contact."""
        return contact_area(self.pressure, self.place.pitch)

    @property
    def shear_force(self) -> FloatArray:
        """Force (3,), N, with which the indenter drags the skin, in the design's frame."""
        if self.shear is None:
            return np.zeros(3)
        along = self.shear.sum(axis=(1, 2)) * self.place.pitch**2
        return np.asarray(self.place.axes[:, :2] @ along)

    @property
    def torque(self) -> float:
        """Torque (N mm) by which the indenter turns the skin, counter-clockwise from outside."""
        if self.shear is None:
            return 0.0
        x, y = np.meshgrid(self.place.x, self.place.y)
        return float((x * self.shear[1] - y * self.shear[0]).sum()) * self.place.pitch**2


class SkinDisplacement(NamedTuple):
    """The displacement of points of a skin.

    Attributes:
        displacement: (n, 3) displacement, mm.
        tilt: (n, 3) change of the unit normals into the gel, before they are normalised again.
        touching: (n,) mask of the points that touch an indenter.
    """

    displacement: FloatArray
    tilt: FloatArray
    touching: NDArray[np.bool_]


class SkinMaps(NamedTuple):
    """Pressure, penetration and displacement at points of a skin under contacts.

    Attributes:
        pressure: (...) pressure, MPa.
        penetration: (...) depth (mm) of the undeformed skin inside an indenter, 0 outside.
        displacement: (..., 3) displacement in the design's frame, mm.
    """

    pressure: FloatArray
    penetration: FloatArray
    displacement: FloatArray


@dataclass(frozen=True, eq=False)
class PressedSkin:
    """A skin under all its contacts.

    Attributes:
        contacts: the solved contacts, one for each indenter.
        elasticity: elastic constants of the gel.
    """

    contacts: tuple[Pressed, ...]
    elasticity: Elasticity

    @property
    def warnings(self) -> list[str]:
        """Sentences about the errors of forces that are inaccurate."""
        return [contact.warning for contact in self.contacts if contact.warning]

    def in_numbers(self) -> list[dict[str, float | str]]:
        """Return depth (mm), force (N), area (mm^2) and greatest pressure (MPa) of each contact,
        for JSON.

        For an indenter that was dragged or turned, shear force (N) and torque (N mm) are included;
        a warning is, if there is one.
        """
        found: list[dict[str, float | str]] = []
        for contact in self.contacts:
            found.append(
                {
                    "depth_mm": round(contact.place.depth, 6),
                    "force_n": round(contact.force, 6),
                    "area_mm2": round(contact.area, 6),
                    "greatest_pressure_mpa": round(float(contact.pressure.max()), 6),
                }
            )
            if contact.shear is not None:
                shear_force = float(np.linalg.norm(contact.shear_force))
                found[-1]["shear_force_n"] = round(shear_force, 6)
                found[-1]["torque_nmm"] = round(contact.torque, 6)
            if contact.warning:
                found[-1]["warning"] = contact.warning
        return found

    def maps(self, points: NDArray[np.floating], inward: NDArray[np.floating]) -> SkinMaps:
        """Return pressure, penetration and displacement at points of the deformed skin.

        The skin is assumed to slide freely along the indenter while it is pressed in, and then to
        stick to it as far as friction allows.

        Args:
            points: (..., 3) points (mm) of the deformed skin; NaN gives NaN.
            inward: (..., 3) unit normals of the skin, into the gel.
        """
        shape = points.shape[:-1]
        flat = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        normals = np.asarray(inward, dtype=np.float64).reshape(-1, 3)
        known = np.isfinite(np.hstack([flat, normals])).all(axis=1)
        found = np.full((len(flat), 5), np.nan)
        found[known] = 0.0
        for contact in self.contacts:
            place, field = contact.place, contact.field
            facing = np.zeros(len(flat), dtype=bool)
            facing[known] = normals[known] @ place.axes[:, 2] < 0.0
            local = place.local(flat[facing])
            x, y = local[:, 0].copy(), local[:, 1].copy()
            found[facing, 0] += field.pressure(x, y)
            found[facing, 1] = np.maximum(found[facing, 1], field.penetration(x, y))
            moved = np.stack([*field.tangential(x, y), -field.depth(x, y)], axis=1)
            found[facing, 2:] += moved @ place.axes.T
        return SkinMaps(
            found[:, 0].reshape(shape), found[:, 1].reshape(shape), found[:, 2:].reshape(*shape, 3)
        )

    def displaced(self, points: FloatArray, inward: FloatArray) -> SkinDisplacement:
        """Return the displacement of the skin at points (n, 3), mm, with normals (n, 3) inward."""
        moved, tilt = np.zeros_like(points), np.zeros_like(points)
        touching = np.zeros(len(points), dtype=bool)
        for contact in self.contacts:
            place = contact.place
            local = place.local(points)
            upright = -(inward @ place.axes[:, 2])
            facing = upright > 0.0
            x, y = local[facing, 0], local[facing, 1]
            depth, slope_x, slope_y = contact.field.at(x, y)
            moved[facing] -= depth[:, None] * place.axes[:, 2]
            turn = slope_x[:, None] * place.axes[:, 0] + slope_y[:, None] * place.axes[:, 1]
            tilt[facing] -= upright[facing, None] * turn
            touching[facing] |= contact.field.touching(x, y)
        return SkinDisplacement(moved, tilt, touching)


def press(
    places: Sequence[Footprint],
    elasticity: Elasticity,
    patches: Sequence[GelPatch | None] | None = None,
) -> PressedSkin:
    """Press indenters, whose footprints on the undeformed skin are known, into a gel without
    friction.

    Around each contact the gel is a flat layer of the local thickness, bonded to a rigid base,
    corrected for its shape by a patch if it has one. Contacts change each other's overlap, so they
    are solved in turn until the displacements converge.

    Raises:
        ContactError: a pressure does not converge; the error tells the residual.
    """
    contacts: list[Pressed | None] = [None] * len(places)
    overlaps = [place.overlap for place in places]
    tolerances = [FIRST_TOLERANCE if len(places) > 1 else TOLERANCE] * len(places)
    neighbours = Neighbours(places)
    for _ in range(MAX_SWEEPS):
        change = 0.0
        for i, place in enumerate(places):
            overlap = place.overlap + neighbours.at(i, OUTWARD)
            before = contacts[i]
            if before is not None:
                moved = float(np.abs(overlap - overlaps[i]).max())
                change = max(change, moved)
                if moved < SETTLED and tolerances[i] == TOLERANCE:
                    continue
                tolerances[i] = _tolerance(moved, overlap)
            else:
                change = max(change, SETTLED)
            overlaps[i] = overlap
            patch = None if patches is None else patches[i]
            solved = _pressed(place, overlap, elasticity, patch, before, tolerances[i])
            contacts[i] = solved
            neighbours.set_displacement(i, solved.field.normal)
        if change < SETTLED or len(places) == 1:
            break
    else:
        refuse_unsettled("the pressures under several indenters", MAX_SWEEPS, change)
    done = [each for each in contacts if each is not None]
    return PressedSkin(tuple(done), elasticity)


def refuse_unsettled(what: str, turns: int, change: float) -> None:
    """Raise ContactError if the last change (mm) of an iteration is `UNSETTLED` or more."""
    if change < UNSETTLED:
        return
    raise ContactError(
        f"{what}, in a gel of this shape, does not settle in {turns} iterations; the last one "
        f"moved the skin by {change:.2g} mm, where {UNSETTLED:g} mm would do",
        hint="Press less deep, move contacts apart, or away from the sides of the gel",
    )


def _pressed(
    place: Footprint,
    overlap: FloatArray,
    elasticity: Elasticity,
    patch: GelPatch | None,
    before: Pressed | None,
    tolerance: float,
) -> Pressed:
    """Solve one contact; pressure and the correction for the gel's shape are iterated in turn."""
    pressure = None if before is None else before.pressure
    if patch is None:
        pressure = _solve(place, overlap, elasticity, pressure, tolerance)
        return Pressed(place, pressure, DisplacementField(place, overlap, pressure, elasticity))
    x, y = (each.ravel() for each in np.meshgrid(place.x, place.y))
    pitch = patch.columns.pitch
    start = patch.x[0], patch.y[0]
    near = np.ix_(
        *(np.abs(g) <= np.abs(h).max() for g, h in ((patch.y, place.y), (patch.x, place.x)))
    )
    known = None if before is None else before.beyond
    values = np.zeros(patch.shape) if known is None else known
    beyond = GridSpline(values, *start, pitch).value(x, y).reshape(overlap.shape)
    pressure = _solve(place, overlap - beyond, elasticity, pressure, FIRST_TOLERANCE)
    relaxation = Relaxation(values)
    change = np.inf
    for _ in range(MAX_TURNS):
        last = change
        coarse = binned(pressure, place, start, pitch, patch.shape)
        found = patch.correction(coarse * pitch**2 / elasticity.shear_modulus)
        change = float(np.abs(found - values)[near].max())
        values = relaxation.next(found)
        spline = GridSpline(values, *start, pitch)
        beyond = spline.value(x, y).reshape(overlap.shape)
        rough = max(tolerance, _tolerance(change, overlap))
        pressure = _solve(place, overlap - beyond, elasticity, pressure, rough)
        stalled = last <= change < UNSETTLED
        if change < SETTLED or stalled:
            break
    else:
        refuse_unsettled("the pressure under an indenter", MAX_TURNS, change)
    field = DisplacementField(place, overlap - beyond, pressure, elasticity, spline, patch)
    return Pressed(place, pressure, field, beyond=values)


def _tolerance(change: float, overlap: FloatArray) -> float:
    """Return the tolerance of a pressure while its overlap still changes by some mm."""
    deepest = max(float(overlap.max()), SETTLED)  # others may move the skin out of reach
    return max(TOLERANCE, min(FIRST_TOLERANCE, ROUGH_SHARE * change / deepest))


def _solve(
    place: Footprint,
    overlap: FloatArray,
    elasticity: Elasticity,
    start: FloatArray | None,
    tolerance: float,
) -> FloatArray:
    response = grid_response(overlap.shape, place.pitch, place.thickness, elasticity)
    return solve_normal_contact(response, overlap, start, tolerance)

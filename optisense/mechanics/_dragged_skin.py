"""The skin of a gel under indenters that were dragged or turned after they were pressed in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from optisense.array_types import FloatArray
from optisense.mechanics._displacement_field import grid_response, tangential_beyond
from optisense.mechanics._elasticity import Elasticity
from optisense.mechanics._gel_patch import GelPatch
from optisense.mechanics._neighbours import ALONG, Neighbours
from optisense.mechanics._pressed_skin import (
    MAX_SWEEPS,
    MAX_TURNS,
    SETTLED,
    Pressed,
    PressedSkin,
    refuse_unsettled,
)
from optisense.mechanics._relaxation import Relaxation
from optisense.mechanics._tangential_contact import Drag, solve_shear


def dragged(
    skin: PressedSkin,
    drags: Sequence[Drag | None],
    patches: Sequence[GelPatch | None],
) -> PressedSkin:
    """Return a pressed skin whose indenters were then dragged with friction, if they have a motion.

    Contacts drag each other's skin along, so they are solved in turn until the displacements
    converge. Indenters that are not dragged do not hold the skin. A patch is the gel's shape around
    a contact; None where it is a flat layer.

    Raises:
        ContactError: a shear does not converge; the error tells the residual.
    """
    contacts = list(skin.contacts)
    moving = {i: drag for i, drag in enumerate(drags) if drag is not None}
    if not moving:
        return skin
    neighbours = Neighbours([contact.place for contact in contacts])
    before: dict[int, FloatArray] = {}
    for _ in range(MAX_SWEEPS):
        change = 0.0
        for i, drag in moving.items():
            others = np.stack([neighbours.at(i, axis) for axis in ALONG])
            moved = float(np.abs(others - before[i]).max()) if i in before else SETTLED
            change = max(change, moved)
            if moved < SETTLED:
                continue
            before[i] = others
            place, field = contacts[i].place, contacts[i].field
            wanted = drag.displacement(place.x, place.y) - others
            shear = _shear(contacts[i], wanted, skin.elasticity, patches[i])
            contacts[i], field.shear = replace(contacts[i], shear=shear), shear
            if len(moving) > 1:
                neighbours.set_displacement(i, partial(field.sheared, shear))
        if change < SETTLED or len(moving) == 1:
            break
    else:
        refuse_unsettled("the shear under several indenters", MAX_SWEEPS, change)
    return replace(skin, contacts=tuple(contacts))


def _shear(
    contact: Pressed, wanted: FloatArray, elasticity: Elasticity, patch: GelPatch | None
) -> FloatArray:
    """Return the shear (2, rows, columns), MPa, under one indenter; it and the correction for the
    gel's shape are iterated until skin that sticks moves as ``wanted`` (2, rows, columns), mm.
    """
    place, pressure, friction = contact.place, contact.pressure, elasticity.friction
    response = grid_response(pressure.shape, place.pitch, place.thickness, elasticity)
    shear = solve_shear(response, pressure, friction, wanted, contact.shear)
    x, y = (each.ravel() for each in np.meshgrid(place.x, place.y))
    beyond = np.zeros_like(wanted)
    relaxation = Relaxation(beyond)
    for _ in range(MAX_TURNS):
        if patch is None or not shear.any():
            break
        loads = np.concatenate([shear, np.zeros((1, *place.overlap.shape))])
        splines = tangential_beyond(patch, loads, place, elasticity.shear_modulus)
        found = np.stack([each.value(x, y) for each in splines]).reshape(wanted.shape)
        change = float(np.abs(found - beyond).max())
        beyond = relaxation.next(found)
        shear = solve_shear(response, pressure, friction, wanted - beyond, shear)
        if change < SETTLED:
            break
    else:
        refuse_unsettled("the shear under an indenter", MAX_TURNS, change)
    return shear

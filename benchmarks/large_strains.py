"""Error of the linear layer at large strains, from a neo-Hookean layer under a ball.

``python -m benchmarks.large_strains`` writes large_strains.md beside this file. The reference is an
axisymmetric finite element model of its own: a compressible neo-Hookean layer bonded to a rigid
base, bilinear elements whose change of volume is the element's mean, Newton's method, and a rigid
ball without friction that a penalty keeps out of the skin. At 1 % indentation it agrees with the
linear layer, which checks the model.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from benchmarks.results import page_head
from optisense.mechanics import Elasticity
from optisense.mechanics._convolution import GridResponse
from optisense.mechanics._normal_contact import contact_area, solve_normal_contact

FloatArray = NDArray[np.float64]

FILE = Path(__file__).with_suffix(".md")
THICKNESS, RADIUS = 4.25, 1.5
"""Thickness of GelSight Mini's gel and radius of the ball, mm."""
GEL = Elasticity(youngs_modulus=0.435, poisson_ratio=0.49)
"""Elasticity (MPa) of XP-565, the first gel of the library; a Poisson ratio of 0.49 is nearly
incompressible."""
INDENTATIONS = (0.01, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
"""Depths of the ball over the thickness of the layer, from small strains, where the linear
layer is accurate, to a third of it."""
WIDTH = 25.0
"""Distance (mm) from the axis to the free side, six thicknesses."""
ACROSS, DOWN = 64, 28
"""Number of elements along the radius and through the thickness; the finest are 0.05 mm wide at the
contact."""
STEP = 0.01
"""Indentation, over the thickness, between two solutions of Newton's method."""
STIFFNESS = 400.0
"""Stiffness of the penalty, MPa/mm: the ball enters the skin by 0.001 mm under the greatest
pressures."""
MOST_ITERATIONS = 100
"""Largest number of Newton steps for one depth; a solution that needs more counts as divergent."""
ENOUGH = 1e-8
"""Residual force (N) over the force on the ball at which Newton's method ends."""
SMALLEST_PART = 0.01
"""Share of Newton's step below which the step is taken even if residuals grow, as they do when
nodes come into contact."""
LINE_POINTS = 130
"""Number of grid points across the linear solution; the contact covers more than half of them."""

POINTS = np.array([(x, y) for y in (-1, 1) for x in (-1, 1)]) / math.sqrt(3.0)
"""Local coordinates (4, 2) of an element's Gauss points, for 2 x 2 Gauss-Legendre quadrature."""
CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=np.float64)
"""Local coordinates (4, 2) of an element's corners."""


class Press(NamedTuple):
    """Force on the ball (N) and radius of the contact (mm)."""

    force: float
    radius: float


class State(NamedTuple):
    """Equilibrium of the layer for given displacements.

    Attributes:
        residual: residual force (2 n,) of each degree of freedom, N.
        matrix: sparse stiffness matrix (2 n, 2 n), N/mm.
        entered: depth (skin nodes,) of each node of the skin inside the ball, mm.
        on_ball: force on the ball, N.
    """

    residual: FloatArray
    matrix: Any
    entered: FloatArray
    on_ball: float


class Layer:
    """Axisymmetric finite element model; nodes have displacements along r and z, z upward."""

    def __init__(self) -> None:
        share = np.linspace(0.0, 1.0, ACROSS + 1)
        r = 0.05 * ACROSS * share + (WIDTH - 0.05 * ACROSS) * share**4
        depth = np.linspace(0.0, 1.0, DOWN + 1)
        z = -(0.4 * depth + 0.6 * depth**2) * THICKNESS
        self.nodes = np.stack(np.meshgrid(r, z), axis=2).reshape(-1, 2)
        row, column = np.indices((DOWN, ACROSS))
        first = (row * (ACROSS + 1) + column).ravel()
        below = first + ACROSS + 1
        self.elements = np.column_stack([below, below + 1, first + 1, first])
        self.skin = np.arange(ACROSS + 1)
        on_axis = self.nodes[:, 0] == 0.0
        at_base = self.nodes[:, 1] < -THICKNESS + 1e-9
        held = np.column_stack([on_axis | at_base, at_base]).ravel()
        self.free = np.flatnonzero(~held)
        edges = np.concatenate([[r[0]], 0.5 * (r[1:] + r[:-1]), [r[-1]]])
        self.areas = math.pi * np.diff(edges**2)  # area of the skin around each of its nodes
        self.moved = np.zeros_like(self.nodes)
        self._shape()

    def _shape(self) -> None:
        x, y = POINTS[:, None, 0], POINTS[:, None, 1]
        self.values = 0.25 * (1 + x * CORNERS[:, 0]) * (1 + y * CORNERS[:, 1])
        by = np.stack(
            [
                0.25 * CORNERS[:, 0] * (1 + y * CORNERS[:, 1]),
                0.25 * CORNERS[:, 1] * (1 + x * CORNERS[:, 0]),
            ],
            axis=2,
        )
        corners = self.nodes[self.elements]
        jacobian = np.einsum("gak,eai->egik", by, corners)
        self.slopes = np.einsum("gak,egki->egai", by, np.linalg.inv(jacobian))
        self.radii = np.einsum("ga,ea->eg", self.values, corners[:, :, 0])
        self.weights = 2.0 * math.pi * self.radii * np.linalg.det(jacobian)
        # (e, g, 5, 8): change of the deformation gradient rr, rz, zr, zz, hoop with the freedoms.
        count = len(self.elements)
        matrix = np.zeros((count, 4, 5, 4, 2))
        matrix[:, :, 0, :, 0], matrix[:, :, 1, :, 0] = self.slopes[..., 0], self.slopes[..., 1]
        matrix[:, :, 2, :, 1], matrix[:, :, 3, :, 1] = self.slopes[..., 0], self.slopes[..., 1]
        matrix[:, :, 4, :, 0] = self.values / self.radii[:, :, None]
        self.gradient = matrix.reshape(count, 4, 5, 8)
        self.freedoms = (2 * self.elements[:, :, None] + np.arange(2)).reshape(count, 8)

    def forces(self) -> tuple[FloatArray, FloatArray]:
        """Return inner forces (e, 8) and stiffness (e, 8, 8) of the deformed elements, in N and mm.

        The energy density is mu / 2 (J^(-2/3) I1 - 3) + K / 2 (J_e - 1)^2, where J_e is the mean of
        J over the element (mean dilatation, Nagtegaal, Parks and Rice 1974).

        Raises:
            FloatingPointError: an element is turned inside out.
        """
        mu = GEL.shear_modulus
        bulk = GEL.youngs_modulus / (3.0 * (1.0 - 2.0 * GEL.poisson_ratio))
        u = self.moved[self.elements].reshape(-1, 8)
        f = np.einsum("egkp,ep->egk", self.gradient, u) + np.array([1.0, 0.0, 0.0, 1.0, 1.0])
        plane = f[..., 0] * f[..., 3] - f[..., 1] * f[..., 2]
        hoop = f[..., 4]
        volume = plane * hoop
        if (volume <= 0.0).any():
            raise FloatingPointError
        square = (f**2).sum(axis=2)
        # Derivatives of the change of volume by the five components.
        d = np.stack(
            [f[..., 3] * hoop, -f[..., 2] * hoop, -f[..., 1] * hoop, f[..., 0] * hoop, plane], 2
        )
        dd = np.zeros((*volume.shape, 5, 5))
        for i, j, value in (
            (0, 3, hoop), (1, 2, -hoop), (0, 4, f[..., 3]), (1, 4, -f[..., 2]),
            (2, 4, -f[..., 1]), (3, 4, f[..., 0]),
        ):  # fmt: skip
            dd[..., i, j] = dd[..., j, i] = value
        power = volume ** (-2.0 / 3.0)
        stress = mu * power[..., None] * (f - (square / (3.0 * volume))[..., None] * d)
        outer = d[..., :, None] * d[..., None, :]
        cross = f[..., :, None] * d[..., None, :]
        tangent = np.eye(5) + (5.0 / 9.0 * square / volume**2)[..., None, None] * outer
        tangent -= (2.0 / 3.0 / volume)[..., None, None] * (cross + np.swapaxes(cross, 2, 3))
        tangent -= (square / (3.0 * volume))[..., None, None] * dd
        tangent *= (mu * power)[..., None, None]
        total = self.weights.sum(axis=1)
        mean = (self.weights * volume).sum(axis=1) / total
        pressure = bulk * (mean - 1.0)
        stress += pressure[:, None, None] * d
        tangent += pressure[:, None, None, None] * dd
        force = np.einsum("eg,egkp,egk->ep", self.weights, self.gradient, stress)
        stiff = np.einsum(
            "egkp,egkl,eglq->epq",
            self.gradient,
            self.weights[..., None, None] * tangent,
            self.gradient,
            optimize=True,
        )
        spread = np.einsum("eg,egkp,egk->ep", self.weights, self.gradient, d)
        return force, stiff + (bulk / total)[:, None, None] * spread[:, :, None] * spread[:, None]

    def press(self, depth: float) -> Press:
        """Push the ball to a depth (mm) by damped Newton steps, or raise RuntimeError."""
        state = self._state(depth)
        for _ in range(MOST_ITERATIONS):
            off = state.residual[self.free]
            if state.on_ball > 0.0 and np.abs(off).max() < ENOUGH * state.on_ball:
                return Press(state.on_ball, self._rim(state.entered))
            step = np.zeros(self.moved.size)
            step[self.free] = splu(state.matrix[self.free][:, self.free].tocsc()).solve(-off)
            before, part = self.moved.copy(), min(1.0, 0.3 / max(np.abs(step).max(), 1e-12))
            while True:
                self.moved = before + part * step.reshape(-1, 2)
                try:
                    ahead = self._state(depth)
                    smaller = np.linalg.norm(ahead.residual[self.free]) < np.linalg.norm(off)
                    if smaller or part < SMALLEST_PART:
                        break
                except FloatingPointError:
                    pass
                part *= 0.5
            state = ahead
        raise RuntimeError(f"no equilibrium at {depth:g} mm: {np.abs(off).max():.2g} N remain")

    def _state(self, depth: float) -> State:
        """Return the forces at the current positions of the nodes."""
        size = self.moved.size
        force, stiff = self.forces()
        residual = np.zeros(size)
        np.add.at(residual, self.freedoms, force)
        rows, columns = np.repeat(self.freedoms, 8, axis=1), np.tile(self.freedoms, (1, 8))
        # Out of the ball: the way from its centre, less its radius.
        at = (self.nodes + self.moved)[self.skin]
        way = at - [0.0, RADIUS - depth]
        far = np.linalg.norm(way, axis=1)
        out = way / far[:, None]
        entered = np.maximum(RADIUS - far, 0.0)
        push = STIFFNESS * self.areas * entered
        freedoms = 2 * self.skin[:, None] + np.arange(2)
        residual[freedoms.ravel()] -= (push[:, None] * out).ravel()
        outer = out[:, :, None] * out[:, None, :]
        block = (
            STIFFNESS
            * self.areas[:, None, None]
            * (outer - (entered / far)[:, None, None] * (np.eye(2) - outer))
        )
        block = np.where((entered > 0.0)[:, None, None], block, 0.0)
        matrix = coo_matrix(
            (
                np.concatenate([stiff.ravel(), block.ravel()]),
                (
                    np.concatenate([rows.ravel(), np.repeat(freedoms, 2, axis=1).ravel()]),
                    np.concatenate([columns.ravel(), np.tile(freedoms, (1, 2)).ravel()]),
                ),
            ),
            shape=(size, size),
        ).tocsc()
        return State(residual, matrix, entered, float((push * -out[:, 1]).sum()))

    def _rim(self, entered: FloatArray) -> float:
        """Return the radius (mm) of the contact, where the squared pressure extrapolates to 0."""
        at = (self.nodes + self.moved)[self.skin, 0]
        last = int(np.flatnonzero(entered > 0.0).max())
        square = entered**2
        fall = square[last - 1] - square[last]
        share = 0.5 if fall <= 0.0 else min(square[last] / fall, 1.0)
        return float(at[last] + share * (at[last + 1] - at[last]))


def linear(depth: float) -> Press:
    """Return the press to a depth (mm) into the linear layer that the simulator uses."""
    width = 2.4 * math.sqrt(max(RADIUS**2 - (RADIUS - depth) ** 2, 0.0))
    pitch = width / LINE_POINTS
    x = (np.arange(LINE_POINTS) - (LINE_POINTS - 1) / 2) * pitch
    square = np.minimum(x[:, None] ** 2 + x**2, RADIUS**2)
    response = GridResponse((LINE_POINTS, LINE_POINTS), pitch, THICKNESS, GEL)
    pressure = solve_normal_contact(response, depth - RADIUS + np.sqrt(RADIUS**2 - square))
    area = contact_area(pressure, pitch)
    return Press(float(pressure.sum()) * pitch**2, math.sqrt(area / math.pi))


def main() -> None:
    """Press the ball, compare the results and write them."""
    layer, reached = Layer(), 0.0
    rows = []
    for wanted in INDENTATIONS:
        while reached < wanted - 1e-9:
            reached = min(reached + STEP, wanted)
            found = layer.press(reached * THICKNESS)
        line = linear(wanted * THICKNESS)
        rows.append(
            f"| {100 * wanted:.0f} % | {wanted * THICKNESS:.3f} | {found.force:.4f} | "
            f"{line.force:.4f} | {100 * (line.force / found.force - 1):+.1f} % | "
            f"{found.radius:.4f} | {line.radius:.4f} | "
            f"{100 * (line.radius / found.radius - 1):+.1f} % |"
        )
        print(rows[-1], flush=True)
    heads = (
        "indentation | depth (mm) | force, neo-Hookean (N) | linear (N) | difference | "
        "contact radius, neo-Hookean (mm) | linear (mm) | difference"
    )
    text = [
        *page_head(
            "Large indentations: the linear elastic layer compared with a neo-Hookean one",
            "benchmarks.large_strains",
        ),
        f"A ball of radius {RADIUS:g} mm is pressed without friction into a bonded layer with a "
        f"thickness of {THICKNESS:g} mm, E = {GEL.youngs_modulus:g} MPa and a Poisson ratio of "
        f"{GEL.poisson_ratio:g}. The neo-Hookean model has {ACROSS} x {DOWN} elements.",
        "",
        f"| {heads} |",
        "|" + "---|" * 8,
        *rows,
    ]
    FILE.write_text("\n".join(text) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

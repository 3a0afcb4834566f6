"""Draw the parts of the pad sensor and write them as STL files: python make_meshes.py

This stands in for a CAD tool. Lengths are in mm; z points out of the sensor.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from manifold3d import CrossSection, Manifold, OpType

HERE = Path(__file__).parent

BULGE = 40.0
"""Radius of the gel's outer face, which is curved across x."""


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Manifold:
    """A box from its lower to its upper corner."""
    size = np.subtract(high, low)
    return Manifold.cube(size.tolist()).translate(low)


def gel() -> Manifold:
    """A pad of 20 x 16 mm, 2 mm thick at its edges and 3.27 mm in the middle."""
    x = np.linspace(-10.0, 10.0, 41)
    z = 2.0 + np.sqrt(BULGE**2 - x**2) - np.sqrt(BULGE**2 - 100.0)
    outline = [(-10.0, 0.0), (10.0, 0.0), *zip(x[::-1].tolist(), z[::-1].tolist(), strict=True)]
    upright = CrossSection([outline]).extrude(16.0)  # along z; its y is the height
    return upright.rotate([90.0, 0.0, 0.0]).translate([0.0, 8.0, 0.0])


def window() -> Manifold:
    """The plate of acrylic that carries the gel."""
    return block((-12.0, -10.0, -3.0), (12.0, 10.0, 0.0))


def housing() -> Manifold:
    """A black tub, open to the gel; its floor is 24 mm below the window's top."""
    return block((-16.0, -14.0, -26.0), (16.0, 14.0, 0.0)) - block(
        (-14.5, -12.5, -24.0), (14.5, 12.5, 1.0)
    )


def leds() -> Manifold:
    """Three LEDs that stand beside the window, at x > 12, and shine into its edge."""
    bodies = [block((12.2, y - 1.75, -2.9), (14.1, y + 1.75, -0.1)) for y in (-5.5, 0.0, 5.5)]
    return Manifold.batch_boolean(bodies, OpType.Add)


def lens() -> Manifold:
    """The front of the lens; the pupil is taken to be in its middle."""
    return Manifold.cylinder(1.0, 3.0, 3.0, 48).translate([0.0, 0.0, -22.5])


def main() -> None:
    """Write one binary STL file for each part."""
    for draw in (gel, window, housing, leds, lens):
        solid = draw().to_mesh()
        mesh = trimesh.Trimesh(solid.vert_properties[:, :3], solid.tri_verts, process=False)
        mesh.export(HERE / f"{draw.__name__}.stl")
        print(f"{draw.__name__}.stl: {len(mesh.faces)} triangles, {mesh.volume:.1f} mm^3")


if __name__ == "__main__":
    main()

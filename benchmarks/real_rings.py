"""Signal in the ring around a contact, in photographs and in pictures of both skins.

``python -m benchmarks.real_rings PHOTOS [DIAMETER] [--width MM]`` prints a table. PHOTOS is a
folder of photographs as `optisense compare` reads them (of gs_sdk, or Taxim's dataPack.npz, which
the PyPI package taxim 1.4.1 has). Each ball is pressed into GelSight Mini as deep as gives the
contact radius that is found in the photograph, into an elastic skin and into a conforming one;
nothing is fitted. The same finder then looks for the contact in the simulated picture.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

import optisense as ots
from optisense.calibration.contact_finding import difference, find_contact
from optisense.calibration.layouts import read_photographs
from optisense.errors import OptiSenseError
from optisense.geometry import Contact, Sphere
from optisense.mechanics import CONFORMING, ELASTIC

WIDTH = 320
"""Width (pixels) of the pictures; photographs are scaled to it."""
INSIDE, RING = 0.9, (1.1, 1.6)
"""Radius of the disc, and radii of the ring, in which signals are averaged, in contact radii; the
rim between both is left out."""
DEEPEST = 2.5
"""Largest depth (mm), 60 % of the gel, at which linear elasticity is no longer accurate."""
PHOTONS = 1_000_000
"""Number of photons of each picture, whose noise is then below that of the photographs."""

Picture = NDArray[np.uint8]


def ring_share(picture: Picture, background: Picture) -> tuple[float, float]:
    """Return the mean difference in the ring over that in the contact, and its radius (pixels), of
    pictures (h, w, 3) of 8 bits.

    Raises:
        ValueError: no contact is found.
    """
    found = find_contact(picture, background)
    if found is None:
        raise ValueError("no contact is found")
    strength = np.abs(difference(picture, background)).mean(axis=2)
    rows, columns = np.indices(strength.shape) + 0.5
    away = np.hypot(columns - found.centre[0], rows - found.centre[1]) / found.radius
    inside = strength[away < INSIDE].mean()
    ring = strength[(away > RING[0]) & (away < RING[1])].mean()
    return float(ring / inside), found.radius


def depth_of(model: ots.OpticalModel, ball: float, radius: float, skin: str) -> float:
    """Return the depth (mm) at which a ball touches a disc of a given radius (mm).

    Raises:
        ValueError: no depth up to `DEEPEST` gives that radius.
    """
    if skin == CONFORMING and radius < ball:
        return ball - math.sqrt(ball**2 - radius**2)

    def excess(depth: float) -> float:
        pressed = model.pressed([Contact(Sphere(ball), at=(0.0, 0.0), depth=depth)])
        return math.sqrt(pressed.contacts[0].area / math.pi) - radius

    if radius >= ball or excess(DEEPEST) < 0.0:
        raise ValueError(
            f"a ball of radius {ball:g} mm, {DEEPEST:g} mm deep in the elastic skin, touches no "
            f"disc of radius {radius:.2f} mm"
        )
    return float(brentq(excess, 0.02, DEEPEST, xtol=2e-3))


def main() -> None:
    """Read the photographs, simulate the presses and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("photos", type=Path)
    parser.add_argument("diameter", type=float, nargs="?", help="of the ball, mm")
    parser.add_argument("--width", type=float, default=20.0, help="mm of skin across a photograph")
    parser.add_argument("--most", type=int, default=8, help="photographs that are looked at")
    options = parser.parse_args()
    photos = read_photographs(options.photos, options.diameter).scaled(WIDTH)
    model = ots.OpticalModel(ots.load("gelsight-mini-ideal"))
    height, width = photos.background.shape[:2]
    rest = model.render((), (width, height), photons=PHOTONS)
    exposure = rest.auto_exposure()
    rays = model.chief_rays((width, height))
    own_width = float(np.nanmax(rays.points[..., 0]) - np.nanmin(rays.points[..., 0]))
    print(f"a pixel is {options.width / width:.4f} mm, of the model {own_width / width:.4f} mm")
    print("| ball (mm) | contact radius (mm) | depth, elastic (mm) | ring, photograph | elastic | "
          "conforming | radius found, elastic | conforming |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    step = max(1, len(photos.presses) // options.most)
    for press in photos.presses[::step]:
        try:
            share, pixels = ring_share(press.picture, photos.background)
            radius = pixels * options.width / width
            cells, depths = [], []
            for skin in (ELASTIC, CONFORMING):
                depth = depth_of(model, press.diameter / 2.0, radius, skin)
                depths.append(depth)
                contact = Contact(Sphere(press.diameter / 2.0), at=(0.0, 0.0), depth=depth)
                image = model.render([contact], (width, height), photons=PHOTONS, skin=skin)
                cells.append(ring_share(image.picture(exposure), rest.picture(exposure)))
        except (OptiSenseError, ValueError) as error:
            print(f"left out: {error}")
            continue
        scale = own_width / width
        print(
            f"| {press.diameter:g} | {radius:.2f} | {depths[0]:.2f} | {share:.2f} | "
            f"{cells[0][0]:.2f} | {cells[1][0]:.2f} | {cells[0][1] * scale:.2f} | "
            f"{cells[1][1] * scale:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()

"""Preview of a material or coating: a ball of it, and its reflectance or scattering by angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.materials import CoatingModel, Material, Medium, Reflection
from optisense.design.materials.base import GEL_INDEX
from optisense.design.materials.dielectric import critical_angle
from optisense.design.reflectance import (
    fresnel_dielectric,
    fresnel_metal,
    ggx_density,
    smith_shadowing,
)
from optisense.library.previews._ball import medium_of, picture_of_ball

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RGB = (("red", "#d62728"), ("green", "#2ca02c"), ("blue", "#1f5fd0"))
INCIDENCE = 45.0
"""Angle of incidence in the picture of a lobe, degrees from the normal: at 45 the mirror direction
is at a right angle to the light, so that both are easy to tell apart."""


def draw_material(figure: Figure, material: Material | CoatingModel) -> None:
    """Draw both pictures into a figure."""
    left = figure.add_axes((0.03, 0.06, 0.36, 0.77))
    left.imshow(picture_of_ball(material), interpolation="none")
    left.set_axis_off()
    place = (0.49, 0.15, 0.47, 0.62)
    medium = medium_of(material)
    if medium is not None:
        _reflectance_of_glass(figure.add_axes(place), medium)
    elif material.reflection().is_metal and isinstance(material, Material):
        _reflectance_of_metal(figure.add_axes(place), material.reflection())
    else:
        axes: Any = figure.add_axes((0.43, -0.17, 0.54, 1.08), projection="polar")
        figure.text(0.70, 0.85, _lobes(axes, material), fontsize=9, ha="center", va="top")


def _reflectance_of_glass(axes: Axes, glass: Medium) -> None:
    angle = np.linspace(0.0, 90.0, 361)
    cosine = np.cos(np.radians(angle))
    axes.plot(angle, 100 * fresnel_dielectric(cosine, glass.ior), color="0.15", label="from air")
    inside = 100 * fresnel_dielectric(cosine, 1.0 / glass.ior)
    axes.plot(angle, inside, color="#1f5fd0", ls="--", label="from inside")
    limit = critical_angle(glass.ior)
    if limit is not None:
        axes.annotate(
            f"total beyond {limit:.1f}°",
            (limit, 100.0),
            (limit + 5.0, 72.0),
            fontsize=9,
            arrowprops={"arrowstyle": "-", "color": "0.5"},
        )
    facts = f"index {glass.ior:g}"
    if glass.indices is not None:
        facts += "  (R, G, B: " + ", ".join(f"{n:.3f}" for n in glass.indices) + ")"
    if max(glass.absorption) > 0.0:
        facts += "\nabsorbs " + ", ".join(f"{a:.2g}" for a in glass.absorption) + " /mm of R, G, B"
    facts += f"\nroughness {glass.roughness:g}" + (" (smooth)" if glass.roughness == 0 else "")
    axes.set_title(facts, fontsize=9, loc="left")
    axes.set(xlim=(0, 90), ylim=(0, 103), ylabel="reflected by a smooth face (%)")
    axes.set_xlabel("angle of incidence (degrees)")
    axes.legend(frameon=False, fontsize=9, loc="center left")
    _tidy(axes)


def _reflectance_of_metal(axes: Axes, metal: Reflection) -> None:
    angle = np.linspace(0.0, 90.0, 361)
    share = 100 * fresnel_metal(np.cos(np.radians(angle)), metal.eta, metal.k)
    for channel, (colour, shade) in enumerate(RGB):
        label = f"{colour}: {share[0, channel]:.1f} % head on"
        axes.plot(angle, share[:, channel], color=shade, label=label)
    axes.set_title(f"roughness {metal.roughness:g}", fontsize=9, loc="left")
    axes.set(xlim=(0, 90), ylim=(min(60.0, share.min() - 5.0), 100.5))
    axes.set(xlabel="angle of incidence (degrees)", ylabel="reflected, in air (%)")
    axes.legend(frameon=False, fontsize=9, loc="lower left")
    _tidy(axes)


def lobes(surface: Reflection, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the light scattered in the plane of incidence, per steradian: the BRDF times the
    cosine.

    Args:
        surface: reflection in the medium before the surface.
        angle: angles (n,) from the normal, degrees, positive away from the incident light.

    Returns:
        The diffuse part and the metallic part, (n, 3) each, for R, G, B.
    """
    cosine = np.cos(np.radians(angle))
    diffuse = cosine[:, None] / np.pi * np.array(surface.reflectance)
    if surface.specularity == 0.0:
        return diffuse, np.zeros_like(diffuse)
    share, alpha = surface.specularity, surface.roughness
    half = np.radians(0.5 * (angle - INCIDENCE))
    at_facet = np.cos(np.radians(0.5 * (angle + INCIDENCE)))
    incoming = np.cos(np.radians(INCIDENCE))
    strength = ggx_density(np.cos(half), alpha) / (4.0 * incoming)
    strength *= smith_shadowing(incoming, alpha) * smith_shadowing(cosine, alpha)
    metal = fresnel_metal(at_facet, surface.eta, surface.k) * strength[:, None]
    return (1.0 - share) * diffuse, share * metal


def _lobes(axes: Any, material: Material | CoatingModel) -> str:
    """Draw the scattering lobes, and return the text above them."""
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set(thetamin=-90, thetamax=90)
    axes.tick_params(labelsize=8)
    axes.set_yticklabels([])
    surface, coated = material.reflection(), isinstance(material, CoatingModel)
    if surface.is_black:
        return "absorbs all light"
    angle = np.linspace(-90.0, 90.0, 721)
    parts = lobes(surface.in_medium(GEL_INDEX) if coated else surface, angle)
    names = ("diffuse paint", "metal flake") if coated else ("diffuse lobe", "metallic lobe")
    total = np.zeros(len(angle))
    for part, name, shade in zip(parts, names, ("0.75", "#e0a030"), strict=True):
        if part.max() > 0.0:
            above = total + part.mean(axis=1)
            axes.fill_between(np.radians(angle), total, above, color=shade, label=name, lw=0)
            total = above
    axes.plot(np.radians(angle), total, color="0.15", lw=1.2)
    axes.set_rmax(1.15 * total.max())
    axes.annotate(
        "",
        (np.radians(-INCIDENCE), 0.45 * total.max()),
        (np.radians(-INCIDENCE), 1.1 * total.max()),
        arrowprops={"arrowstyle": "-|>", "color": "#d62728", "lw": 1.6},
    )
    axes.legend(frameon=False, fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 0.155), ncols=2)
    facts = "scattered light for one ray at 45°"
    if coated:
        facts += f", seen in silicone\n{material.in_words()}"
        if surface.specularity > 0.0:
            facts += f", roughness of the flake {surface.roughness:.2g}"
    return facts


def _tidy(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, color="0.9", lw=0.6)
    axes.set_axisbelow(True)

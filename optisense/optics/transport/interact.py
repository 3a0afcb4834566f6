"""The interaction of a ray with a surface, the same for all kinds of rays.

Photons, paths from the camera, chief rays, drawn rays and their derivatives differ in the quantity
that they carry and in the lobe that they follow. The direction of refraction, reflection or
scattering, its weight and the end of a path are computed here for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import drjit as dr
import mitsuba as mi

from optisense.optics.scene.coating_bsdf import coating_of, fresnel_metal, sample_coating
from optisense.optics.scene.interfaces import (
    SMOOTH_ALPHA,
    refract,
    rough_lobes,
    sample_rough_interface,
)
from optisense.optics.scene.ray_scene import Ray, RayScene, SurfaceHit, leave
from optisense.optics.scene.surface_table import (
    channel_eta,
    media_absorption,
    surface_kind,
    surface_region,
)
from optisense.optics.scene.surfaces import Region, SurfaceKind

MAX_DEPTH = 64
"""Largest number of surfaces that any ray but a photon meets. In GelSight-like sensors, less than
0.1 % of the photons' light remains after so many."""
PHOTON_DEPTH = 1024
"""Largest number of surfaces that a photon meets. Between white walls, light is scattered many
times: in a closed box of reflectance 0.99, half of the light is left after 64 surfaces, and 0.003 %
after 1,024."""
LEAST_COMPONENT = 1e-12
"""Magnitude below which a component of a camera ray's direction becomes 0. Refraction in a plane of
symmetry leaves components of 1e-16 and less, with which Embree misses triangles: in DIGIT, six rays
of 160 in the middle row. A ray of 1 m length moves by 1e-9 mm."""


class RayKind(Enum):
    """The kind of a ray, which decides the quantity it carries and the lobe it follows."""

    PHOTON = 0  # carries power; a lobe is drawn, and opaque surfaces scatter
    CAMERA = 1  # carries radiance; goes through all interfaces and facets that do not reflect all
    REFLECTION = 2  # carries radiance; at interfaces a lobe is drawn
    CHIEF = 3  # carries nothing; as from the camera, and every interface is smooth to it

    @property
    def draws(self) -> bool:
        """Whether the lobe of a smooth interface is drawn in proportion to its reflectance."""
        return self in (RayKind.PHOTON, RayKind.REFLECTION)

    @property
    def scatters(self) -> bool:
        """Whether rays continue from opaque surfaces; others end there."""
        return self is RayKind.PHOTON

    @property
    def carries_radiance(self) -> bool:
        """Whether weights count radiance, which changes with the square of the index."""
        return self in (RayKind.CAMERA, RayKind.REFLECTION)

    @property
    def is_from_camera(self) -> bool:
        """Whether rays go straight through smooth interfaces, as from the camera."""
        return self in (RayKind.CAMERA, RayKind.CHIEF)


@dataclass
class LobeSample:
    """Random numbers from 0 to 1: ``pick`` chooses the lobe, ``place`` the direction in it."""

    pick: mi.Float = field(default_factory=lambda: mi.Float(0))
    place: mi.Point2f = field(default_factory=lambda: mi.Point2f(0))

    @classmethod
    def drawn(cls, rng: mi.PCG32) -> LobeSample:
        """Draw the numbers."""
        return cls(rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))


@dataclass
class Lobe:
    """A unit direction in which light leaves a surface, and its weight there."""

    direction: mi.Vector3f
    weight: mi.Color3f


@dataclass
class Interaction:
    """The interaction of a ray with the next surface that it meets.

    Attributes:
        hit: the intersection.
        side: 1 where the ray comes from the side that the face normal points to, else -1.
        eta: the index behind the face normal over the index in front of it.
        region: the surface's `Region`.
        opaque: mask of the rays that meet an opaque surface.
        light: mask of the rays that meet the emitting face of a light.
        scattered: mask of the rays that continue from an opaque surface or a mirror.
        sensed: mask of the rays that meet the inside of the sensing surface, or an indenter.
        ended: mask of the rays that end on anything else: a blocker, a light, the outside of the
            sensing surface, another opaque surface.
        goes_on: mask of the rays that neither end nor escape.
        totally: mask of the rays that are totally reflected.
        rough: mask of the rays that meet a rough interface.
        turned: mask of the rays that are reflected, by a mirror or at an interface.
        lobe: the lobe that the ray follows.
        reflection: the reflected lobe of an interface through which a camera ray continues; of
            weight 0 elsewhere.
        absorption: the absorption coefficient (1/mm) of the medium that the ray came through; None
            in a scene without absorption.
        transmittance: the share of the light that the medium leaves on the way to the surface, per
            channel. No weight of a lobe includes it.
        ray: the ray that continues. Where none does, it is unchanged but inactive; it is also
            inactive after `MAX_DEPTH` surfaces, and photons after `PHOTON_DEPTH`.
    """

    hit: SurfaceHit
    side: mi.Float
    eta: mi.Float
    region: mi.UInt32
    opaque: mi.Bool
    light: mi.Bool
    scattered: mi.Bool
    sensed: mi.Bool
    ended: mi.Bool
    goes_on: mi.Bool
    totally: mi.Bool
    rough: mi.Bool
    turned: mi.Bool
    lobe: Lobe
    reflection: Lobe
    absorption: mi.Color3f | None
    transmittance: mi.Color3f
    ray: Ray


@dataclass
class _Media:
    """Absorption coefficients on both sides of a surface that rays meet.

    Attributes:
        known: mask of the rays that meet a surface whose media are known; others stay in their
            medium.
        before, behind: absorption coefficients (1/mm) in front of the face normal and behind it.
        here: absorption coefficient (1/mm) of the medium that the ray comes through.
    """

    known: mi.Bool
    before: mi.Color3f
    behind: mi.Color3f
    here: mi.Color3f


def _media(
    scene: RayScene, ray: Ray, hit: SurfaceHit, side: mi.Float, interface: mi.Bool
) -> _Media:
    has_media, before, behind = media_absorption(scene.table, hit.surface, interface)
    known = interface & has_media
    carried = mi.Color3f(0) if ray.absorption is None else ray.absorption
    here = dr.select(known, dr.select(side > 0, before, behind), carried)
    return _Media(known, before, behind, here)


def _rough(
    ray: Ray,
    ray_kind: RayKind,
    hit: SurfaceHit,
    eta: mi.Float,
    alpha: mi.Float,
    drawn: LobeSample,
) -> tuple[mi.Vector3f, mi.Color3f, mi.Vector3f, mi.Float]:
    """Return the direction in which rays continue from a rough interface and its weight, then those
    of the light that is reflected beside it.
    """
    place = ray.direction, hit.shading_normal, eta, alpha
    if ray_kind.draws:
        outgoing, weight, ratio = sample_rough_interface(*place, drawn.pick, drawn.place)
        if ray_kind.carries_radiance:
            weight /= ratio * ratio
        return outgoing, mi.Color3f(weight), outgoing, mi.Float(0)
    reflectance, reflected, turned, transmitted, passed, ratio = rough_lobes(*place, drawn.place)
    through = reflectance < 1
    weight = dr.select(through, (1 - reflectance) * passed / (ratio * ratio), turned)
    beside = dr.select(through, reflectance * turned, 0)
    return dr.select(through, transmitted, reflected), mi.Color3f(weight), reflected, beside


@dr.syntax
def interact(
    scene: RayScene, ray: Ray, ray_kind: RayKind, sample: LobeSample | None = None
) -> Interaction:
    """Follow rays to the next surface and compute how they continue; symbolic loops may call it.

    Args:
        sample: random numbers; not needed for chief rays, nor for camera rays in smooth scenes.
    """
    drawn = LobeSample() if sample is None else sample
    hit = scene.intersect(ray)
    side = -dr.sign(dr.dot(ray.direction, hit.normal))
    kind, eta, alpha = surface_kind(scene.table, hit.surface, hit.valid)
    region = surface_region(scene.table, hit.surface, hit.valid)
    interface = hit.valid & (kind == int(SurfaceKind.DIELECTRIC))
    mirror = hit.valid & (kind == int(SurfaceKind.MIRROR))
    opaque = hit.valid & (kind == int(SurfaceKind.OPAQUE))
    if dr.hint(ray.channel is not None, mode="scalar"):
        eta = dr.select(
            interface, channel_eta(scene.table, hit.surface, ray.channel, interface), eta
        )
    outside = (region == int(Region.SENSING)) & (side < 0)
    sensed = opaque & (region != int(Region.OTHER)) & ~outside
    scattered = mirror
    goes_on = interface | mirror
    if dr.hint(ray_kind.scatters, mode="scalar"):
        scattered = mirror | opaque
        goes_on = goes_on | opaque

    reflectance, reflected, transmitted, relative = refract(ray.direction, hit.shading_normal, eta)
    totally = interface & (reflectance >= 1)
    if dr.hint(ray_kind.draws, mode="scalar"):
        through = drawn.pick >= reflectance
        passed = mi.Float(1)
        beside = mi.Float(0)
    else:
        through = reflectance < 1
        passed = dr.select(through, 1 - reflectance, 1)
        beside = dr.select(interface & through & (alpha <= SMOOTH_ALPHA), reflectance, 0)
    turned = goes_on & (mirror | ~through)
    outgoing = dr.select(turned, reflected, transmitted)
    weight = mi.Color3f(1)
    if dr.hint(ray_kind.carries_radiance, mode="scalar"):
        weight = mi.Color3f(dr.select(through, passed / (relative * relative), passed))
    if dr.hint(scene.rough and ray_kind is not RayKind.CHIEF, mode="scalar"):  # noqa: SIM102
        if dr.hint(
            interface & (alpha > SMOOTH_ALPHA), exclude=[ray, ray_kind, hit, eta, alpha, drawn]
        ):
            outgoing, weight, reflected, beside = _rough(ray, ray_kind, hit, eta, alpha, drawn)
    if dr.hint(ray_kind is not RayKind.CHIEF, mode="scalar"):  # noqa: SIM102
        if dr.hint(
            scattered, exclude=[scene, ray, ray_kind, hit, side, eta, mirror, drawn, scattered]
        ):
            coating = coating_of(scene.table, hit.surface, scattered)
            behind = dr.select(side > 0, 1, dr.rcp(eta))
            coating.metal_eta *= behind
            coating.metal_k *= behind
            cosine = dr.abs(dr.dot(ray.direction, hit.shading_normal))
            weight = fresnel_metal(cosine, coating.metal_eta, coating.metal_k)
            if dr.hint(ray_kind.scatters, mode="scalar"):
                spread, albedo = sample_coating(
                    coating,
                    hit.shading_normal * side,
                    ray.direction,
                    drawn.pick * 0.999999,
                    drawn.place,
                )
                weight = dr.select(mirror, weight, albedo)
                outgoing = dr.select(mirror, outgoing, spread)

    direction = dr.normalize(outgoing)
    if dr.hint(ray_kind.is_from_camera, mode="scalar"):
        direction = mi.Vector3f(
            *(dr.select(dr.abs(each) < LEAST_COMPONENT, 0, each) for each in direction)
        )
    depth = ray.depth + 1
    transmittance = mi.Color3f(1)
    here = absorption = ray.absorption
    if dr.hint(scene.absorbing and ray_kind is not RayKind.CHIEF, mode="scalar"):
        media = _media(scene, ray, hit, side, interface)
        transmittance = dr.exp(-media.here * dr.select(hit.valid, hit.distance, 0))
        leaving = dr.select(dr.dot(direction, hit.normal) > 0, media.before, media.behind)
        here = media.here
        absorption = dr.select(media.known, leaving, here)
    onward = Ray(
        origin=dr.select(goes_on, leave(hit.point, hit.normal, direction), ray.origin),
        direction=dr.select(goes_on, direction, ray.direction),
        active=goes_on & (depth < (PHOTON_DEPTH if ray_kind is RayKind.PHOTON else MAX_DEPTH)),
        depth=depth,
        absorption=absorption,
        channel=ray.channel,
    )
    return Interaction(
        hit=hit,
        side=side,
        eta=eta,
        region=region,
        opaque=opaque,
        light=hit.valid & (kind == int(SurfaceKind.LIGHT)),
        scattered=scattered,
        sensed=sensed,
        ended=hit.valid & ~sensed & ~goes_on,
        goes_on=goes_on,
        totally=totally,
        rough=interface & (alpha > SMOOTH_ALPHA),
        turned=turned,
        lobe=Lobe(direction, weight),
        reflection=Lobe(reflected, mi.Color3f(beside)),
        absorption=here,
        transmittance=transmittance,
        ray=onward,
    )

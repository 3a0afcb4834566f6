"""The gel of a sensor, with contacts pressed into it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, lru_cache

from threadpoolctl import ThreadpoolController

from optisense.design import SensorDesign
from optisense.design.materials import Dielectric
from optisense.design.parts import Role
from optisense.errors import ContactError
from optisense.geometry import Contact, MeshIndenter, SensingSurface, TriangleMesh
from optisense.geometry.contact import available_depth, locate
from optisense.geometry.surface import SurfacePoint
from optisense.mechanics._contact_checks import refuse_holes, refuse_shared_skin
from optisense.mechanics._deformed_mesh import SkinMesh, skin_mesh
from optisense.mechanics._dragged_skin import dragged
from optisense.mechanics._elasticity import Elasticity
from optisense.mechanics._footprint import POINTS_ACROSS, Footprint, NoFootprintError, footprint
from optisense.mechanics._gel_patches import GelPatches
from optisense.mechanics._pressed_skin import PressedSkin, press
from optisense.mechanics._rims import Rims
from optisense.mechanics._tangential_contact import Drag

USUAL_GEL = Elasticity(youngs_modulus=0.435, poisson_ratio=0.49, friction=1.0)
"""Elastic constants of a gel whose material does not specify them: those of the GelSight Mini. Its
modulus was fitted to measured forces (the FEATS project: Neo-Hooke, C10 = 0.0725 MPa, so E = 6
C10); Poisson ratio and friction are assumptions."""

DEEPEST_SHARE = 0.6
"""Largest depth, as a share of the gel's thickness, of the search for the depth of a given force.
Linear elasticity is inaccurate already at half the thickness."""
LEAST_DEPTH = 1e-4
"""Smallest depth (mm) of the search for the depth of a given force, a fourth of the wavelength of
light in the gel."""
LEAST_FORCE_SHARE = 1e-6
"""Share of the wanted force that replaces a force of 0 before its logarithm is taken."""
FORCE_TOLERANCE = 2e-4
"""Relative error of a force at which the search for its depth ends: a fifth of the error of the
force of a ball."""
DEPTH_TOLERANCE = 1e-6
"""Relative error of the depth at which this search ends if the force jumps there, as it does where
the grid of the contact changes."""
FORCE_ERROR = 0.01
"""Relative error of a force above which it is refused: about that of forces on a thick layer."""

KEPT_DEPTHS = 256
"""Number of contacts whose depth by force a gel keeps; an entry is a few numbers."""

USUAL_THICKNESS = 4.0
"""Thickness (mm) of the gel in designs without an elastomer, about that of a GelSight Mini."""

COARSE_POINTS_ACROSS = 24
"""Number of grid points across the shorter side of a contact in coarse mode. The error of a ball's
contact radius is then about 1 %, a fraction of a pixel of a draft."""
COARSE_THICKNESS = 0.1
"""Step (mm) of the thicknesses of layers in coarse mode, whose kernels take a tenth of a second; a
slightly bent skin keeps its step. Forces change by 1 to 2 % from step to step."""
COARSE_EDGES = 2.0
"""Factor on the edge lengths of the deformed skin in coarse mode. With a fourth of the triangles,
the error of a draft grows by 0.03 % of the mean light, and it takes 7 % less time."""


def _elastomers(design: SensorDesign) -> list[tuple[str, str, Elasticity]]:
    """Return part, material and constants of the elastomers whose material states constants."""
    found = []
    for part in design.parts_of(Role.ELASTOMER):
        name = design.parts[part].material or ""
        material = design.materials.get(name)
        if isinstance(material, Dielectric) and material.elasticity is not None:
            given = material.elasticity
            constants = Elasticity(given.youngs_modulus, given.poisson_ratio, given.friction)
            found.append((part, name, constants))
    return found


def elasticity_of(design: SensorDesign) -> Elasticity:
    """Return the elastic constants of a design's first elastomer; `USUAL_GEL` if it has none."""
    found = _elastomers(design)
    return found[0][2] if found else USUAL_GEL


def elasticity_in_words(design: SensorDesign) -> str:
    """Return a text with the elastic constants used for a design's gel, and their status; it names
    the elastomers that have others.
    """
    used, found = elasticity_of(design), _elastomers(design)
    given = found[0][1] if found else None
    words = []
    for field, text in (
        ("youngs_modulus", f"Young's modulus {used.youngs_modulus:g} MPa"),
        ("poisson_ratio", f"Poisson ratio {used.poisson_ratio:g}"),
        ("friction", f"friction {used.friction:g}"),
    ):
        status = "assumed"
        if given is not None:
            above = f"materials.{given}"
            paths = (f"{above}.elasticity.{field}", f"{above}.elasticity", above)
            known = [design.provenance[path] for path in paths if path in design.provenance]
            status = known[0].status.value if known else "given"
        words.append(f"{text} ({status})")
    text = ", ".join(words)
    others = [part for part, _, constants in found if constants != used]
    if others:
        text += f"; those of '{found[0][0]}' are used for {', '.join(others)}, too"
    return text


@cache
def _linear_algebra() -> ThreadpoolController:
    """Return the control of the threads of NumPy's and of SciPy's linear algebra."""
    import scipy.linalg  # noqa: F401  # loads SciPy's, so that it is found

    return ThreadpoolController().select(user_api="blas")


def _drag(contact: Contact, surface: SensingSurface, place: Footprint) -> Drag | None:
    """Return the drag of a contact in the frame of its footprint; None if it has none."""
    if contact.shift == (0.0, 0.0) and contact.twist == 0.0:
        return None
    u, v = surface.directions(-place.axes[:, 2])
    along = contact.shift[0] * u + contact.shift[1] * v
    return Drag((place.axes.T @ along)[:2], math.radians(contact.twist))


class Gel:
    """The gel of a sensor, into which contacts are pressed.

    The last press and the depths found for forces are kept.
    """

    def __init__(
        self,
        surface: SensingSurface,
        skin: TriangleMesh,
        elastomers: Sequence[TriangleMesh],
        elasticity: Elasticity,
        place: Callable[[Contact], TriangleMesh],
        check: Callable[[], None] | None = None,
        coarse: bool = False,
    ) -> None:
        """Create the gel of a sensor.

        Args:
            surface: the undeformed sensing surface.
            skin: its mesh, with all its triangles.
            elastomers: the gels under it, as in `available_depth`; without any the gel is
                `USUAL_THICKNESS` thick.
            elasticity: elastic constants of the gel.
            place: function that returns a contact's placed indenter in the design's frame (mm).
            check: function that is called before the first press and raises if the gel cannot be
                pressed at all.
            coarse: whether contacts are solved on coarser grids, and in a flat layer as thick as
                the gel under the contact; a press then takes a third of the time, for drafts.
        """
        self._check, self._coarse = check, coarse
        self._surface, self._skin, self._elastomers = surface, skin, elastomers
        self._elasticity, self._place = elasticity, place
        self._last: tuple[tuple[Contact, ...], PressedSkin] | None = None
        self._mesh: tuple[PressedSkin, SkinMesh] | None = None
        self._depths = lru_cache(maxsize=KEPT_DEPTHS)(self._depth_found)
        self._rims = Rims(surface.mesh)
        self._patches = GelPatches(skin, () if coarse else elastomers, elasticity.poisson_ratio)

    def pressed(
        self, contacts: Sequence[Contact], placed: Sequence[TriangleMesh] | None = None
    ) -> PressedSkin:
        """Solve for the skin under contacts.

        Args:
            placed: their placed meshes, if they are known.

        Raises:
            ContactError: an indenter does not reach the surface, is too small for the model of the
                gel, or has a hole where it touches, two indenters overlap on the skin, no depth
                gives a force, a pressure does not converge, or nothing holds the gel.
        """
        # Matrices are small: threads would only wait for each other.
        with _linear_algebra().limit(limits=1):
            return self._pressed(contacts, placed)

    def _pressed(
        self, contacts: Sequence[Contact], placed: Sequence[TriangleMesh] | None
    ) -> PressedSkin:
        if self._check is not None:
            self._check()
            self._check = None
        asked = tuple(contacts)
        if self._last is None or self._last[0] != asked:
            if placed is None:
                placed = [self._place(contact) for contact in contacts]
            spots = [locate(contact, self._surface) for contact in contacts]
            places = [
                footprint(
                    mesh,
                    self._surface.mesh,
                    spot,
                    self.at_depth(contact).depth,
                    self._layer(spot),
                    COARSE_POINTS_ACROSS if self._coarse else POINTS_ACROSS,
                )
                for contact, spot, mesh in zip(contacts, spots, placed, strict=True)
            ]
            for number, (place, mesh) in enumerate(zip(places, placed, strict=True)):
                if isinstance(contacts[number].indenter, MeshIndenter):
                    refuse_holes(place, mesh)
                for other in places[:number]:
                    refuse_shared_skin(place, other)
            patches = [self._patches.around(place) for place in places]
            places = [
                place if patch is None else replace(place, thickness=patch.thickness)
                for place, patch in zip(places, patches, strict=True)
            ]
            drags = [
                _drag(contact, self._surface, place)
                for contact, place in zip(contacts, places, strict=True)
            ]
            pressed = dragged(press(places, self._elasticity, patches), drags, patches)
            warned = tuple(
                replace(each, warning=self._rims.warning(each.place, patch))
                for each, patch in zip(pressed.contacts, patches, strict=True)
            )
            self._last = asked, replace(pressed, contacts=warned)
        return self._last[1]

    def mesh(self, contacts: Sequence[Contact]) -> SkinMesh:
        """Return the deformed sensing surface.

        Raises:
            ContactError: as in `pressed`.
        """
        pressed = self.pressed(contacts)
        if self._mesh is None or self._mesh[0] is not pressed:
            scale = COARSE_EDGES if self._coarse else 1.0
            self._mesh = pressed, skin_mesh(self._skin, pressed, scale)
        return self._mesh[1]

    def at_depth(self, contact: Contact) -> Contact:
        """Return a contact with the depth that gives its force when it is pressed in alone.

        Contacts without a force are returned unchanged.

        Raises:
            ContactError: the gel is too thin for the force, the indenter too small for its model,
                or no depth from `LEAST_DEPTH` on gives the force.
        """
        if contact.force is None:
            return contact
        return self._depths(contact)

    def _depth_found(self, contact: Contact) -> Contact:
        wanted = contact.force
        assert wanted is not None
        limit = DEEPEST_SHARE * self._thickness(locate(contact, self._surface))

        def at(depth: float) -> Contact:
            return replace(contact, force=None, depth=depth)

        def force(depth: float) -> float:
            try:
                return self.pressed([at(depth)]).contacts[0].force
            except NoFootprintError:
                return 0.0

        if (greatest := self.pressed([at(limit)]).contacts[0].force) < wanted:
            raise ContactError(
                f"a force of {wanted:g} N would press an indenter deeper than "
                f"{100 * DEEPEST_SHARE:.0f} % of the gel, which is {limit:.2f} mm and takes "
                f"{greatest:.3g} N there",
                hint=f"Give a force up to {greatest:.3g} N",
            )

        if (least := force(LEAST_DEPTH)) > wanted * (1.0 + FORCE_ERROR):
            raise ContactError(
                f"a force of {wanted:g} N is less than an indenter takes at the least depth of "
                f"the model of the gel, {LEAST_DEPTH:g} mm, where it takes {least:.3g} N",
                hint=f"Give a force from {least:.3g} N on",
            )

        # Forces of smooth indenters grow about as depth^1.5; the root is found in logarithms.
        def excess(log_depth: float) -> float:
            found = max(force(math.exp(log_depth)), LEAST_FORCE_SHARE * wanted)
            ratio = math.log(found / wanted)
            return 0.0 if abs(ratio) < FORCE_TOLERANCE else ratio

        from scipy.optimize import brentq  # takes a quarter of a second to load

        low, high = math.log(LEAST_DEPTH), math.log(limit)
        if excess(low) >= 0.0:
            return at(LEAST_DEPTH)
        depth = math.exp(float(brentq(excess, low, high, xtol=DEPTH_TOLERANCE)))
        if abs((found := force(depth)) / wanted - 1.0) > FORCE_ERROR:
            raise ContactError(
                f"no depth gives a force of {wanted:g} N: the force of the indenter jumps there, "
                f"at {depth:.4g} mm, to or from {found:.4g} N",
                hint=f"Give a force of {found:.4g} N",
            )
        return at(depth)

    def _layer(self, spot: SurfacePoint) -> float:
        """Return the thickness (mm) of the layer that a contact at a point is pressed into."""
        thickness = self._thickness(spot)
        if not self._coarse:
            return thickness
        return COARSE_THICKNESS * max(1, round(thickness / COARSE_THICKNESS))

    def _thickness(self, spot: SurfacePoint) -> float:
        """Return the thickness (mm) of the gel under a point of the skin."""
        if not self._elastomers:
            return USUAL_THICKNESS
        try:
            return available_depth(spot.point, spot.inward, self._elastomers)
        except ContactError:
            return USUAL_THICKNESS

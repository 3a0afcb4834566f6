"""A gel without support is an error before a contact is computed."""

import pytest

from optisense.design import Part
from optisense.design.parts import Role
from optisense.errors import ContactError
from optisense.geometry import Contact, Sphere, TriangleMesh
from optisense.mechanics import is_attached, is_hollow, refuse_loose_gel
from optisense.optics._ray_model import RayModel
from optisense.sensors import load

SENSORS = (
    "gelsight-mini-ideal",
    "gelsight-mini-ideal-cylindrical",
    "gelsight-mini-ideal-spherical",
    "gelbelt",
    "gelsight360",
    "gelsight-svelte",
    "digit",
)


@pytest.mark.parametrize("name", SENSORS)
def test_gels_of_real_sensors_are_held(name):
    assert is_attached(load(name))


def loose(gap):
    """The Mini with nothing but a plate behind its gel, at a distance in mm."""
    design = load("gelsight-mini-ideal")
    for name in design.parts_of(Role.SUPPORT):
        del design.parts[name], design.meshes[name]
    low, high = design.meshes["gel"].bounds
    plate = TriangleMesh.box((low[0], low[1], low[2] - gap - 1.0), (high[0], high[1], low[2] - gap))
    design.parts["plate"] = Part(role=Role.SUPPORT, material="acrylic", mesh="meshes/plate.obj")
    design.meshes["plate"] = plate
    return design


def test_a_plate_holds_a_gel_only_where_it_touches_it():
    assert is_attached(loose(0.0))
    assert not is_attached(loose(1.0))
    with pytest.raises(ContactError, match=r"'gel'.* is attached to nothing"):
        refuse_loose_gel(loose(1.0))


@pytest.mark.parametrize("name", SENSORS)
def test_only_the_gel_of_svelte_has_air_behind_it(name):
    assert is_hollow(load(name)) is (name == "gelsight-svelte")


@pytest.mark.parametrize(("width", "free"), [(1.0, False), (0.6, False), (0.4, True)])
def test_a_gel_is_hollow_where_its_support_leaves_most_of_its_back_free(width, free):
    design = loose(0.0)
    plate = design.meshes["plate"]
    design.meshes["plate"] = plate.with_vertices(plate.vertices * (width, 1.0, 1.0))
    assert is_attached(design)
    assert is_hollow(design) is free


@pytest.mark.parametrize("hollow", [True, False])
def test_a_skin_of_two_triangles_is_judged_by_all_of_it(hollow):
    """Two strips under the middles of the triangles hold a quarter, or all but these strips."""
    design = loose(0.0)
    (x0, y0, z0), (x1, y1, z1) = design.meshes["plate"].bounds
    design.meshes["skin"] = TriangleMesh.grid((x1 - x0, y1 - y0)).flipped()
    left, right = sorted(design.meshes["skin"].triangles.mean(axis=1)[:, 0])
    held = [(left - 1.5, left + 1.5), (right - 1.5, right + 1.5)]
    if not hollow:
        held = [(x0, left - 1.5), (left + 1.5, right - 1.5), (right + 1.5, x1)]
    strips = [TriangleMesh.box((low, y0, z0), (high, y1, z1)) for low, high in held]
    design.meshes["plate"] = TriangleMesh.joined(strips)
    assert is_hollow(design) is hollow


def test_a_loose_gel_takes_a_conforming_contact_only():
    model = RayModel(loose(1.0))
    ball = Contact(Sphere(1.5), at=(0.0, 0.0), depth=0.5)
    assert model.chief_rays((32, 24), [ball], "conforming").contact_mask.any()
    with pytest.raises(ContactError, match="attached to nothing"):
        model.pressed([ball])

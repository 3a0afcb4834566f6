"""Media of touching, nested and overlapping solids (see `media_chain`)."""

import numpy as np
import pytest
from media_chain import ACRYLIC, GEL, area, ball, box, check_chain, first_of, in_box, pairs

from optisense.errors import DesignError, MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry.rays import ray_hits
from optisense.optics.scene.media import Media, Solid


def test_a_single_solid_lies_in_air() -> None:
    interfaces = Media([Solid("gel", ball(3), "silicone", GEL)]).interfaces
    assert pairs(interfaces) == {("silicone", "air")}
    facets = ball(3)
    check_chain(
        interfaces,
        lambda p: GEL if ray_hits(facets, p, [0.3, 0.2, 0.9]).ray.size % 2 else 1.0,
        count=200,
    )


@pytest.mark.parametrize("divisions", [(1, 1, 1), (7, 5, 2)])
def test_gel_on_acrylic_with_other_triangles_on_their_common_face(
    divisions: tuple[int, int, int],
) -> None:
    gel = Solid("gel", box((-3, -2, 0), (3, 2, 2), divisions), "silicone", GEL, roughness=0.1)
    guide = Solid("guide", box((-3, -2, -2), (3, 2, 0), (4, 3, 1)), "acrylic", ACRYLIC)
    interfaces = Media([gel, guide]).interfaces
    assert pairs(interfaces) == {("silicone", "acrylic"), ("silicone", "air"), ("acrylic", "air")}
    assert area(interfaces, "gel", "guide") == pytest.approx(24)
    assert area(interfaces, "gel") == pytest.approx(24 + 40)
    shared = next(face for face in interfaces if face.names == ("gel", "guide"))
    np.testing.assert_allclose(shared.mesh.face_normals @ [0, 0, 1], -1.0)
    assert shared.roughness == 0.1
    boxes = ((-3, -2, 0), (3, 2, 2), GEL), ((-3, -2, -2), (3, 2, 0), ACRYLIC)
    check_chain(interfaces, first_of(*boxes))


def test_faces_that_overlap_in_part_are_cut_at_the_rim() -> None:
    gel = Solid("gel", box((-1, -3, 0), (4, 1.5, 2), (9, 8, 2)), "silicone", GEL)
    guide = Solid("guide", box((-3, -2, -2), (3, 2, 0), (4, 3, 2)), "acrylic", ACRYLIC)
    interfaces = Media([gel, guide]).interfaces
    common = 4 * 3.5
    assert area(interfaces, "gel", "guide") == pytest.approx(common)
    assert area(interfaces, "guide") == pytest.approx(2 * (24 + 12 + 8) - common)
    assert area(interfaces, "gel") == pytest.approx(2 * (22.5 + 10 + 9) - common)
    boxes = ((-1, -3, 0), (4, 1.5, 2), GEL), ((-3, -2, -2), (3, 2, 0), ACRYLIC)
    check_chain(interfaces, first_of(*boxes))


def test_turned_faces_and_a_corner_that_touches_two_parts() -> None:
    """A block turned by 30 degrees across the joint of two others."""
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(0.5236), -np.sin(0.5236)], [np.sin(0.5236), np.cos(0.5236)]]
    block = box((-2, -1.5, 0), (2, 1.5, 1.5), (5, 4, 1)).transformed(turn)
    left, right = box((-4, -3, -1), (0, 3, 0), (3, 3, 1)), box((0, -3, -1), (4, 3, 0))
    interfaces = Media(
        [
            Solid("left", left, "acrylic", ACRYLIC),
            Solid("right", right, "epoxy", 1.54),
            Solid("block", block, "silicone", GEL),
        ]
    ).interfaces
    assert area(interfaces, "left", "block") + area(interfaces, "right", "block") == (
        pytest.approx(12)
    )
    assert area(interfaces, "left", "right") == pytest.approx(6)
    beside = first_of(((-4, -3, -1), (0, 3, 0), ACRYLIC), ((0, -3, -1), (4, 3, 0), 1.54))

    def truth(p: np.ndarray) -> float:
        return GEL if in_box(turn.T @ p, (-2, -1.5, 0), (2, 1.5, 1.5)) else beside(p)

    check_chain(interfaces, truth)


def test_inner_faces_of_three_blocks_of_equal_index_vanish() -> None:
    blocks = [
        Solid(f"block {k}", box((-3 + 2 * k, -2, -2), (-1 + 2 * k, 2, 2), (2, k + 1, 3)), m, 1.5)
        for k, m in enumerate(["acrylic", "acrylic", "glue"])
    ]
    interfaces = Media(blocks).interfaces
    assert sum(face.mesh.area for face in interfaces) == pytest.approx(2 * (24 + 24 + 16))
    check_chain(interfaces, first_of(((-3, -2, -2), (3, 2, 2), 1.5)))


def test_nested_solids_go_by_priority() -> None:
    outer = Solid("gel", ball(4), "silicone", GEL, priority=0)
    inner = Solid("bead", box((-1, -1, -1), (1, 1, 1)), "glass", 1.52, priority=1)
    hidden = Solid("lost", box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)), "acrylic", ACRYLIC)
    interfaces = Media([outer, inner, hidden]).interfaces
    assert area(interfaces, "bead", "gel") == pytest.approx(24)
    assert all("lost" not in face.names for face in interfaces)
    shell = ball(4)

    def truth(p: np.ndarray) -> float:
        if in_box(p, (-1, -1, -1), (1, 1, 1)):
            return 1.52
        return GEL if ray_hits(shell, p, [0.3, 0.2, 0.9]).ray.size % 2 else 1.0

    check_chain(interfaces, truth, count=300)


@pytest.mark.parametrize("priorities", [(1, 0), (0, 1)])
def test_where_solids_overlap_the_larger_priority_keeps_the_place(
    priorities: tuple[int, int],
) -> None:
    first = Solid("a", box((-3, -2, -2), (1, 2, 2), (3, 2, 2)), "silicone", GEL, 0.0, priorities[0])
    second = Solid("b", box((-1, -1, -2), (3, 3, 1)), "acrylic", ACRYLIC, 0.0, priorities[1])
    boxes = [((-3, -2, -2), (1, 2, 2), GEL), ((-1, -1, -2), (3, 3, 1), ACRYLIC)]
    truth = first_of(*(boxes if priorities[0] > priorities[1] else boxes[::-1]))
    check_chain(Media([first, second]).interfaces, truth)


def test_overlap_without_priority_names_both_parts_and_the_place() -> None:
    first = Solid("gel", box((-3, -2, -2), (1, 2, 2)), "silicone", GEL)
    second = Solid("guide", box((-1, -1, -2), (3, 3, 1)), "acrylic", ACRYLIC)
    with pytest.raises(DesignError) as caught:
        Media([first, second])
    for word in ("'gel'", "'guide'", "(0.000, 0.500, -0.500) mm"):
        assert word in str(caught.value)


def test_overlap_of_equal_media_needs_no_priority() -> None:
    first = Solid("a", box((-3, -2, -2), (1, 2, 2)), "acrylic", ACRYLIC)
    second = Solid("b", box((-1, -1, -2), (3, 3, 1)), "acrylic", ACRYLIC)
    boxes = ((-3, -2, -2), (1, 2, 2), ACRYLIC), ((-1, -1, -2), (3, 3, 1), ACRYLIC)
    check_chain(Media([first, second]).interfaces, first_of(*boxes))


@pytest.mark.parametrize("as_solid", [False, True])
def test_a_thin_film_of_air_is_kept(as_solid: bool) -> None:
    film = 0.02
    solids = [
        Solid("belt", box((-3, -3, film), (3, 3, 2), (5, 5, 1)), "silicone", GEL),
        Solid("plate", box((-3, -3, -2), (3, 3, 0), (2, 3, 1)), "acrylic", ACRYLIC),
    ]
    if as_solid:
        solids.append(Solid("film", box((-3, -3, 0), (3, 3, film)), "air", 1.0))
    interfaces = Media(solids).interfaces
    assert {(f.ior_inside, f.ior_outside) for f in interfaces} == {(GEL, 1.0), (ACRYLIC, 1.0)}
    assert sum(f.mesh.area for f in interfaces) == pytest.approx(4 * 36 + 24 * (4 - film))
    boxes = ((-3, -3, film), (3, 3, 2), GEL), ((-3, -3, -2), (3, 3, 0), ACRYLIC)
    check_chain(interfaces, first_of(*boxes))


@pytest.mark.parametrize("gap", [-0.001, 0.0015])
def test_a_gap_or_overlap_within_the_tolerance_is_a_contact(gap: float) -> None:
    gel = Solid("gel", box((-3, -3, gap), (3, 3, 2), (4, 4, 1)), "silicone", GEL)
    guide = Solid("guide", box((-4, -4, -2), (4, 4, 0), (3, 3, 1)), "acrylic", ACRYLIC)
    interfaces = Media([gel, guide]).interfaces
    assert area(interfaces, "gel", "guide") == pytest.approx(36)
    assert area(interfaces, "guide") == pytest.approx(2 * 64 + 64 - 36)


def test_a_leaky_solid_is_refused_by_name() -> None:
    mesh = box((-1, -1, -1), (1, 1, 1))
    with pytest.raises(MeshError, match="part gel"):
        Media([Solid("gel", TriangleMesh(mesh.vertices, mesh.faces[1:]), "m", GEL)])


@pytest.mark.parametrize("seed", [9, 17, 28, 33, 39])
@pytest.mark.parametrize("turned", [False, True])
def test_random_blocks_on_a_lattice(seed: int, turned: bool) -> None:
    """Many faces share planes and edges; turned as a whole, they do so only up to rounding."""
    rng = np.random.default_rng(seed)
    turn = np.eye(3)
    if turned:
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn[:, 0] *= np.linalg.det(turn)
    blocks = []
    for priority in range(6):
        lower = rng.integers(-4, 3, 3)
        upper = lower + rng.integers(1, 4, 3)
        ior = float(rng.choice([1.0, 1.41, 1.49, 1.54]))
        mesh = box(lower, upper, tuple(rng.integers(1, 4, 3).tolist())).transformed(turn)
        solid = Solid(f"block {priority}", mesh, f"medium {ior}", ior, 0.0, priority)
        blocks.append((lower, upper, solid))

    def truth(p: np.ndarray) -> float:
        here = [s.ior for lower, upper, s in blocks if in_box(turn.T @ p, lower, upper)]
        return here[-1] if here else 1.0

    solids = [blocks[k][2] for k in rng.permutation(6)]
    check_chain(Media(solids).interfaces, truth, count=300)

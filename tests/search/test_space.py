"""Search spaces: what they may hold, and that a point becomes the design that it means."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from optisense import library, sensors
from optisense.design import (
    Role,
    SensorDesign,
    add_cage,
    get_value,
    load_design,
    save_design,
    set_value,
)
from optisense.design.cage import as_array
from optisense.errors import DesignError, OptiSenseError, SearchError
from optisense.search import (
    Around,
    CagePoints,
    Choice,
    Continuous,
    Integer,
    SearchSpace,
    Together,
)
from optisense.search.space._expansion import expand
from optisense.search.space.search_space import BoundSpace, checked


class TestNumbers:
    def test_set_what_they_name(self, two_numbers: BoundSpace) -> None:
        design = two_numbers.apply([0.25, 1.5])
        assert design.coating.specularity == 0.25
        assert design.camera.position == (1.5, 0.0, two_numbers.design.camera.position[2])
        assert two_numbers.design.camera.position[0] == 0.0

    def test_start_is_the_design(self, two_numbers: BoundSpace) -> None:
        assert two_numbers.apply(two_numbers.start) == two_numbers.design
        far = SearchSpace({"camera.position.x": (2.0, 3.0)}).bind(two_numbers.design)
        assert far.start == [2.0]  # the nearest to it

    def test_a_vector_is_its_numbers(self, mini: SensorDesign) -> None:
        space = SearchSpace({"camera.position": Around(0.5)}).bind(mini)
        assert space.names == [f"camera.position.{axis}" for axis in "xyz"]
        assert np.allclose(space.lower, np.array(mini.camera.position) - 0.5)
        assert np.allclose(space.upper, np.array(mini.camera.position) + 0.5)

    def test_unit_cube_and_back(self, mixed: BoundSpace) -> None:
        rng = np.random.default_rng(3)
        points = mixed.from_unit(rng.random((200, mixed.size)))
        for point in points:
            mixed.check(point)
        assert np.array_equal(mixed.from_unit(mixed.unit_of(points)), points)

    def test_whole_numbers_share_the_unit_interval(self, mini: SensorDesign) -> None:
        space = SearchSpace({"camera.resolution[0]": Integer(100, 103)}).bind(mini)
        points = space.from_unit(np.linspace(0, 1, 4000)[:, None])[:, 0]
        assert [int((points == value).sum()) for value in range(100, 104)] == [1000] * 4

    def test_outside_is_refused(self, mixed: BoundSpace) -> None:
        good = mixed.start
        for index, value in ((0, 1.5), (2, 100.5), (1, 7.0)):
            bad = good.copy()
            bad[index] = value
            with pytest.raises(SearchError) as told:
                mixed.check(bad)
            assert told.value.where == mixed.names[index]


class TestCages:
    def test_all_81_numbers_of_a_cage(self, svelte: SensorDesign) -> None:
        space = SearchSpace({"cages.M1.points": Around(2.0)}).bind(svelte)
        assert space.size == 81
        before = space.prepared.cages["M1"].current_points()
        moved = space.apply(space.start + 0.5)
        assert np.allclose(as_array(moved.cages["M1"].points), before + 0.5)
        shift = moved.deformed_meshes()["M1"].vertices - svelte.deformed_meshes()["M1"].vertices
        assert np.allclose(shift, 0.5, atol=1e-9)

    def test_the_shape_stays_when_a_cage_changes_its_form(self, svelte: SensorDesign) -> None:
        for path, spec in (("points", Around(1.0)), ("blend", (0.0, 1.0))):
            space = SearchSpace({f"cages.M1.{path}": spec}).bind(svelte)
            ours = space.apply(space.start).deformed_meshes()["M1"].vertices
            assert np.allclose(ours, svelte.deformed_meshes()["M1"].vertices, atol=1e-9)

    def test_a_subset_of_points_and_axes(self, svelte: SensorDesign) -> None:
        spec = CagePoints(Around(1.0), points=(4, 13), axes="xz")
        space = SearchSpace({"cages.M1.points": spec}).bind(svelte)
        assert space.names == [f"cages.M1.points[{k}].{axis}" for k in (4, 13) for axis in "xz"]
        with pytest.raises(SearchError, match="no control point 27"):
            SearchSpace({"cages.M1.points": CagePoints(Around(1.0), points=(27,))}).bind(svelte)

    def test_each_axis_may_have_a_reach_of_its_own(self, svelte: SensorDesign) -> None:
        reaches = {"x": 8.0, "y": 1.0, "z": 2.0}
        space = SearchSpace(
            {f"cages.M1.points.{axis}": Around(reach) for axis, reach in reaches.items()}
        ).bind(svelte)
        assert space.size == 81
        ends = [
            as_array(space.apply(bound).cages["M1"].points) for bound in (space.lower, space.upper)
        ]
        assert np.allclose(ends[1] - ends[0], 2.0 * np.array(list(reaches.values())))
        blend = SearchSpace({"cages.M1.blend.x": (0.0, 1.0)}).bind(svelte)
        assert blend.names == [f"cages.M1.blend[{k}].x" for k in range(27)]
        with pytest.raises(SearchError, match="range of numbers"):
            SearchSpace({"cages.M1.points.x": ["a", "b"]}).bind(svelte)

    def test_mirrored_points_move_as_mirror_images(self, svelte: SensorDesign) -> None:
        """Half the parameters; every shape in the space is symmetric."""
        spec = CagePoints(Around(2.0), symmetry="y")
        space = SearchSpace({"cages.M1.points": spec}).bind(svelte)
        assert space.size == 9 * 3 + 9 * 2  # one side free, the middle in its plane
        shape = space.apply(space.from_unit(np.random.default_rng(1).random(space.size)))
        points = as_array(shape.cages["M1"].points)
        low, high = np.array(shape.cages["M1"].box)[:, 1]
        image = points * [1, -1, 1] + [0, low + high, 0]
        for point in image:
            assert np.linalg.norm(points - point, axis=1).min() < 1e-9

    def test_symmetry_of_a_lopsided_shape_is_refused(self, mini: SensorDesign) -> None:
        design = add_cage(mini, "one", ["gel", "skin"]) if not mini.cages else mini
        name = next(iter(design.cages))
        pushed = SearchSpace({f"cages.{name}.points[0].x": Around(1.0)}).bind(design)
        lopsided = pushed.apply(pushed.upper)
        with pytest.raises(SearchError, match="not symmetric along x"):
            SearchSpace({f"cages.{name}.points": CagePoints(Around(1.0), symmetry="x")}).bind(
                lopsided
            )


class TestPoses:
    def test_groups_shift_and_turn_as_one(self, mini: SensorDesign) -> None:
        space = SearchSpace(
            {"lights.red.shift": Around(1.0), "lights.red.turn": Around(90.0)}
        ).bind(mini)
        before = np.array([light.position for light in mini.lights["red"].lights])
        design = space.apply([0.5, 0.0, 0.0, 0.0, 0.0, 90.0])
        after = np.array([light.position for light in design.lights["red"].lights])
        assert np.allclose(after.mean(axis=0), before.mean(axis=0) + [0.5, 0.0, 0.0])

        def between(places: np.ndarray) -> np.ndarray:
            return np.linalg.norm(places[:, None] - places, axis=2)

        assert np.allclose(between(after), between(before))
        quarter = (before - before.mean(axis=0)) @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
        assert np.allclose(after - after.mean(axis=0), quarter)
        first, same = mini.lights["red"].lights[0], design.lights["red"].lights[0]
        assert np.allclose(
            same.direction, [-first.direction[1], first.direction[0], first.direction[2]]
        )
        assert design.lights["green"] == mini.lights["green"]

    def test_lights_of_a_group_are_aimed_each_where_it_is(self, mini: SensorDesign) -> None:
        space = SearchSpace({"lights.red.aim.z": (-90.0, 90.0)}).bind(mini)
        aimed = space.apply([30.0])
        for before, after in zip(
            mini.lights["red"].lights, aimed.lights["red"].lights, strict=True
        ):
            assert after.position == pytest.approx(before.position)
            assert np.dot(after.direction, before.direction) == pytest.approx(np.cos(np.pi / 6))
        with pytest.raises(DesignError, match="aim"):
            SearchSpace({"parts.guide.aim.z": (-1.0, 1.0)}).bind(mini)

    def test_single_lights_and_the_camera(self, mini: SensorDesign) -> None:
        space = SearchSpace(
            {
                "lights.red.lights[1].shift.z": (-1.0, 1.0),
                "lights.red.lights[2].turn.x": (-10.0, 10.0),
                "camera.turn.y": (-5.0, 5.0),
            }
        ).bind(mini)
        design = space.apply([0.7, 10.0, 5.0])
        old, new = mini.lights["red"].lights, design.lights["red"].lights
        assert np.allclose(np.subtract(new[1].position, old[1].position), [0, 0, 0.7])
        assert new[2].position == pytest.approx(old[2].position)
        assert np.dot(new[2].direction, old[2].direction) <= 1.0
        turned = np.degrees(np.arccos(np.dot(design.camera.direction, mini.camera.direction)))
        assert turned == pytest.approx(5.0)
        assert new[0] == old[0]

    def test_parts_move_unless_a_cage_moves_them(self, svelte: SensorDesign) -> None:
        space = SearchSpace({"parts.M2.shift.x": (-1.0, 1.0)}).bind(svelte)
        assert space.reshapes
        moved = space.apply([0.25]).deformed_meshes()["M2"].vertices
        assert np.allclose(moved - svelte.deformed_meshes()["M2"].vertices, [0.25, 0, 0])
        with pytest.raises(SearchError, match="moved by the cage 'M1'") as told:
            SearchSpace({"parts.M1.shift.x": (-1.0, 1.0)}).bind(svelte)
        assert told.value.hint == "Vary cages.M1.points"


class TestTogether:
    def test_one_number_sets_or_moves_all_groups(self, mini: SensorDesign) -> None:
        space = SearchSpace(
            {
                "lights.*.flux": Together(Continuous(1.0, 9.0)),
                "lights.*.shift.z": Together(Around(0.2)),
                "lights.*.colour": Together(Choice(["R", "G"])),
            }
        ).bind(mini)
        assert space.names == ["lights.*.flux", "lights.*.shift.z", "lights.*.colour"]
        assert space.start[0] == next(iter(mini.lights.values())).flux
        design = space.apply([5.0, -0.1, 1.0])
        assert {group.flux for group in design.lights.values()} == {5.0}
        assert {tuple(group.colour) for group in design.lights.values()} == {(0.0, 1.0, 0.0)}
        for name, group in mini.lights.items():
            for before, after in zip(group.lights, design.lights[name].lights, strict=True):
                moved = np.subtract(after.position, before.position)
                np.testing.assert_allclose(moved, [0.0, 0.0, -0.1], atol=1e-9)

    def test_ranges_have_short_forms(self) -> None:
        assert Together((1.0, 5.0, 4)) == Together(Continuous(1.0, 5.0, 4))
        assert Together(["R", "G"]) == Together(Choice(["R", "G"]))
        assert CagePoints((-1.0, 1.0), axes="x") == CagePoints(Continuous(-1.0, 1.0), axes="x")
        with pytest.raises(SearchError, match="cage points need bounds or a reach"):
            CagePoints(Choice(["R", "G"]))  # type: ignore[arg-type]

    @pytest.mark.parametrize(
        ("path", "spec", "said"),
        [
            ("lights.red.flux", Continuous(1.0, 2.0), "path with a"),
            ("cages.*.points", Around(1.0), "one by one|no name like"),
            ("lights.*.model", Choice(["smd-3528", "ws2812b"]), "can't be varied together"),
        ],
    )
    def test_what_can_not_vary_together(
        self, mini: SensorDesign, path: str, spec: Continuous | Around | Choice, said: str
    ) -> None:
        with pytest.raises(SearchError, match=said):
            SearchSpace({path: Together(spec)}).bind(mini)


class TestChoices:
    def test_colours_of_groups(self, mini: SensorDesign) -> None:
        space = SearchSpace(
            {"lights.red.colour": ["R", "green", (0.2, 0.3, 0.4)], "lights.red.flux": (1.0, 9.0)}
        ).bind(mini)
        assert space.apply([1, 2.0]).lights["red"].colour == (0.0, 1.0, 0.0)
        design = space.apply([2, 2.0])
        assert design.lights["red"].colour == (0.2, 0.3, 0.4)
        assert design.lights["red"].flux == 2.0
        assert space.start[0] == 0.0

    def test_light_types_of_all_of_a_group_of_one(self, mini: SensorDesign) -> None:
        kinds = ["smd-3528", "chanzon-5730"]
        every = SearchSpace({"lights.model": kinds}).bind(mini)
        assert {g.model for g in every.apply([1]).lights.values()} == {"chanzon-5730"}
        group = SearchSpace({"lights.red.model": kinds}).bind(mini)
        assert [g.model for g in group.apply([1]).lights.values()] == [
            "chanzon-5730",
            "smd-3528",
            "smd-3528",
        ]
        single = SearchSpace({"lights.types": kinds}).bind(mini)
        assert single.size == sum(len(group.lights) for group in mini.lights.values())
        point = np.zeros(single.size)
        point[3] = 1
        lights = single.apply(point).lights
        assert sorted((g.model, len(g.lights)) for g in lights.values()) == [
            ("chanzon-5730", 1),
            ("smd-3528", 4),
            ("smd-3528", 5),
            ("smd-3528", 5),
        ]
        places = {tuple(light.position) for group in lights.values() for light in group.lights}
        assert places == {tuple(li.position) for g in mini.lights.values() for li in g.lights}

    def test_materials_coatings_and_cameras_of_the_library(self, mini: SensorDesign) -> None:
        import optisense.library as library

        materials = [name for name in library.names("material") if name != "acrylic"][:2]
        gel_material = str(mini.parts["gel"].material)
        other = next(name for name in materials if name != gel_material)
        space = SearchSpace(
            {
                "parts.gel.material": [gel_material, other],
                "coating.library": list(library.names("coating"))[:2],
                "camera.model": ["gelsight-mini", "pi-v1"],
            }
        ).bind(mini)
        design = space.apply([1, 1, 1])
        assert design.parts["gel"].material == other
        assert design.materials[other] == library.material(other)
        assert design.coating.library == list(library.names("coating"))[1]
        assert design.camera.fov == library.camera("pi-v1").fov
        assert design.camera.position == mini.camera.position

    def test_a_word_of_the_design(self, mini: SensorDesign) -> None:
        laws = ["conductor", "blend", "blend-fixed-roughness"]
        space = SearchSpace({"coating.scattering": laws, "coating.specularity": (0.0, 1.0)})
        bound = space.bind(mini)
        assert bound.start[0] == 1.0  # the design's own, which its file leaves out
        surface = bound.apply([0, 0.25]).coating.reflection()
        assert (surface.specularity, surface.roughness) == (1.0, 0.75)
        with pytest.raises(OptiSenseError, match="mirror"):
            SearchSpace({"coating.scattering": ["blend", "mirror"]}).bind(mini)

    def test_a_number_may_be_one_of_several(self, mini: SensorDesign) -> None:
        space = SearchSpace({"coating.specularity": Choice([0.1, 0.7])}).bind(mini)
        assert space.apply([1]).coating.specularity == 0.7
        assert space.values([1]) == {"coating.specularity": "0.7"}

    @pytest.mark.filterwarnings("error::UserWarning")
    def test_options_become_what_their_field_holds(self, mini: SensorDesign) -> None:
        """Also where nothing but the coating is varied, whose numbers need no check."""
        space = SearchSpace({"parts.gel.role": ["elastomer", "support"]}).bind(mini)
        assert space.apply([1]).parts["gel"].role is Role.SUPPORT
        own = mini.coating.model_dump(mode="json")
        coatings = Choice([own, {**own, "library": "mine"}], labels=["own", "mine"])
        assert SearchSpace({"coating": coatings}).bind(mini).apply([1]).coating.library == "mine"
        with pytest.raises(DesignError, match="should be a valid number"):
            SearchSpace({"camera.fov": Choice(["wide", 40])}).bind(mini)


class TestBadInput:
    @pytest.mark.parametrize(
        ("path", "near"),
        [
            ("coating.specularty", "specularity"),
            ("lights.rad.flux", "red"),
            ("lights.rad.shift.x", "red"),
            ("parts.gell.shift.x", "gel"),
        ],
    )
    def test_a_wrong_path_names_the_near_match(
        self, mini: SensorDesign, path: str, near: str
    ) -> None:
        with pytest.raises(DesignError) as told:
            SearchSpace({path: (0.0, 1.0)}).bind(mini)
        assert path in told.value.message
        assert near in str(told.value.hint)

    @pytest.mark.parametrize(
        "bounds",
        [
            (np.float32(0.0), np.int64(1)),
            np.array([0.0, 1.0]),
            np.array([0, 1]),
        ],
        ids=repr,
    )
    def test_bounds_may_be_of_numpy(self, bounds: object) -> None:
        space = SearchSpace({"coating.specularity": bounds})
        assert space.parameters == {"coating.specularity": Continuous(0.0, 1.0)}

    @pytest.mark.parametrize(
        ("bounds", "said"),
        [
            ((1.0, 0.0), "reversed.* Give 0 first and 1 second"),
            ((1.0, 1.0), "empty"),
            ((0.0, float("inf")), "not finite"),
            ((float("nan"), 1.0), "not finite"),
            ((0.0, 1.0, 1), "steps from 0 to 1 is 1"),
            (["diffuse-grey"], "two options"),
            ("0:1", "is not a specification of a parameter"),
        ],
    )
    def test_bad_bounds_name_the_path(self, bounds: object, said: str) -> None:
        with pytest.raises(SearchError, match=said) as told:
            SearchSpace({"coating.specularity": bounds})
        assert told.value.where == "coating.specularity"

    def test_bounds_that_the_design_refuses(self, mini: SensorDesign) -> None:
        with pytest.raises(OptiSenseError) as told:
            SearchSpace({"coating.specularity": (0.0, 2.0)}).bind(mini)
        assert told.value.where == "coating.specularity"

    @pytest.mark.parametrize(
        ("space", "said"),
        [
            ({"camera.position": (0.0, 1.0), "camera.position.x": (0.0, 1.0)}, "varied twice"),
            ({"lights.red.colour": ["R", "G"], "lights.red.colour.r": (0.0, 1.0)}, "both varied"),
            (
                {"lights.*.shift.z": Together(Around(1)), "lights.red.shift.z": Around(1)},
                "varied twice",
            ),
            ({"lights.x*.flux": (1.0, 2.0)}, "no name like 'x\\*'"),
            ({"coating.*": (0.0, 1.0)}, r"a \* stands for names"),
            ({"camera.model": (0.0, 1.0)}, "names to choose from"),
            ({"lights.red.shift.x": ["a", "b"]}, "range of numbers"),
            ({"camera": (0.0, 1.0)}, "a section"),
            ({"camera.projection": (0.0, 1.0)}, "not a number"),
            ({"camera.shift.x": (0.0, 1.0)}, "the camera has no shift"),
            ({"lights.red.colour": ["R", "mauve"]}, "no colour 'mauve'"),
            ({}, "the space has no parameter"),
        ],
    )
    def test_what_can_not_be_varied(
        self, mini: SensorDesign, space: dict[str, object], said: str
    ) -> None:
        with pytest.raises(SearchError, match=said):
            SearchSpace(space).bind(mini)


def test_plain_values_are_the_same_space(mini: SensorDesign, svelte: SensorDesign) -> None:
    for design, asked in (
        (mini, {"coating.specularity": (0.0, 1.0, 11), "lights.red.colour": ["R", "G"]}),
        (mini, {"camera.resolution[0]": Integer(100, 200), "camera.position": Around(0.5)}),
        (mini, {"lights.*.flux": Together(Continuous(1.0, 9.0, 3))}),
        (svelte, {"cages.M1.points": CagePoints(Around(2.0), (0, 1, 5), "xz", "y")}),
    ):
        space = SearchSpace(asked)
        again = SearchSpace.from_plain(space.to_plain())
        assert again.parameters == space.parameters
        assert again.bind(design).names == space.bind(design).names
    with pytest.raises(SearchError, match="can't be read"):
        SearchSpace.from_plain({"a": {"kind": "dice"}})


def test_setting_81_numbers_at_once_is_quick(svelte: SensorDesign) -> None:
    """The same design as by `set_value` for each, and what did not change is shared."""
    space = SearchSpace({"cages.M1.points": Around(2.0)}).bind(svelte)
    point = space.from_unit(np.random.default_rng(0).random(81))
    design = space.apply(point)
    assert [get_value(design, path) for path in space.names] == pytest.approx(point.tolist())
    assert design.lights is space.prepared.lights
    assert design.meshes["skin"] is svelte.meshes["skin"]


def test_expand_tells_what_was_asked(mini: SensorDesign) -> None:
    _, found = expand(mini, "camera.position", Around(1.0))
    assert {parameter.asked for parameter in found} == {"camera.position"}


def test_a_camera_from_the_library_brings_its_sensor_where_there_is_one() -> None:
    """An ideal camera stays ideal; one with a sensor and a lens gets those of the other camera."""
    space = SearchSpace({"camera.model": ["gelsight-mini", "pi-v1"]})
    plain = sensors.gelsight_mini_ideal()
    real = library.with_imaging(plain, "pi-v2", focus_distance=19.4)
    changed = [space.bind(design).apply(np.array([1.0])).camera for design in (plain, real)]
    assert [camera.model for camera in changed] == ["pi-v1", "pi-v1"]
    assert changed[0].is_ideal
    assert changed[1].noise == library.camera("pi-v1").noise
    assert changed[1].blur is None


def test_a_camera_from_the_library_keeps_the_width_of_the_picture() -> None:
    space = SearchSpace({"camera.model": ["gelsight-mini", "pi-v1", "pi-v3"]})
    design = set_value(sensors.gelsight_mini_ideal(), "camera.resolution", [320, 240])
    sizes = [space.bind(design).apply(np.array([i])).camera.resolution for i in (0.0, 1.0, 2.0)]
    assert sizes == [(320, 240), (320, 240), (320, 180)]  # 4608 x 2592 is 16 to 9


def test_a_wrong_varied_value_blames_no_line_of_the_file(
    mini: SensorDesign, tmp_path: Path
) -> None:
    save_design(mini, tmp_path / "mini")
    read = load_design(tmp_path / "mini")
    wide = read.camera.model_copy(update={"fov": 500.0})
    with pytest.raises(DesignError, match=r"'camera\.fov' = 500") as told:
        checked(read.model_copy(update={"camera": wide}))
    assert told.value.where == "the varied design"

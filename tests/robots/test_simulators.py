"""The files of every built-in sensor in MuJoCo: masses, frames, contacts and forces."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from optisense import sensors
from optisense.design import Part, Role, SensorDesign
from optisense.design.lenses.distortion import BrownConrady
from optisense.design.projection import picture_places
from optisense.errors import DesignError, OwnCodeError
from optisense.geometry import TriangleMesh
from optisense.geometry.solids import as_manifold
from optisense.robots import (
    ROBOT_FORMATS,
    Frame,
    RobotFormat,
    SensorBody,
    export_robot,
    sensor_body,
)
from optisense.robots._body import KILOGRAMS, _skin_frame, mass_properties
from optisense.robots._collision import COVERED, depth_in
from optisense.workshop.shapes import shapes

mujoco = pytest.importorskip("mujoco")

BALL = 0.004
"""Radius (m) of the ball that touches the skin."""
BALL_MASS = 0.05
"""Mass of the ball, kg: it presses with half a newton."""
GRAVITY = 9.81
"""Acceleration of free fall, m/s^2."""
SUNK = 2e-4
"""Depth (m) of the ball in the gel when it is looked which bodies it touches."""


SHAPES = (
    "gelsight-mini",
    "gelsight-mini-spherical",
    "gelbelt",
    "digit",
    "gelsight-svelte",
    "gelsight360",
)
"""The sensors; other GelSight Minis differ from these in their lights and in how they are bent."""


class Made(NamedTuple):
    """A sensor, its body and its files."""

    design: SensorDesign
    body: SensorBody
    mjcf: Path
    urdf: Path


def exported(design: SensorDesign, folder: Path, notes: list[str] | None = None) -> Made:
    """Export a sensor once, with the body that its files are made of."""
    bodies: list[SensorBody] = []

    def keep(body: SensorBody, meshes: str) -> str:
        bodies.append(body)
        return ""

    with ROBOT_FORMATS.forgetting():
        ROBOT_FORMATS.register("kept", RobotFormat(".kept", keep))
        mjcf, urdf, *_ = export_robot(design, folder, ["mujoco", "urdf", "kept"], notes)
    return Made(design, bodies[0], mjcf, urdf)


@pytest.fixture(scope="module", params=SHAPES)
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    return exported(sensors.build(request.param), tmp_path_factory.mktemp("robot"))


def with_ball(made: Made, above: float, slides: bool = False, frame: Frame | None = None) -> Any:
    """Return the model with a ball whose lowest point is so far above the middle of the first skin,
    or the origin of a frame; it falls freely towards it, or slides along its normal only.
    """
    skin = made.body.skins[0].frame if frame is None else frame
    x, y, z = skin.origin + (BALL + above) * skin.axes[:, 2]
    normal = " ".join(str(value) for value in skin.axes[:, 2])
    gx, gy, gz = -GRAVITY * skin.axes[:, 2]
    joint = f'<joint type="slide" axis="{normal}" damping="1"/>' if slides else "<freejoint/>"
    ball = (
        f'<body name="ball" pos="{x} {y} {z}">{joint}'
        f'<geom type="sphere" size="{BALL}" mass="{BALL_MASS}"/></body>'
    )
    text = made.mjcf.read_text().replace("</worldbody>", f"{ball}</worldbody>")
    text = text.replace("<asset>", f'<option gravity="{gx} {gy} {gz}"/><asset>')
    return mujoco.MjModel.from_xml_string(text, meshes(made, "meshes/"))


def meshes(made: Made, folder: str = "") -> dict[str, bytes]:
    """Return the mesh files by the names under which MuJoCo asks for them."""
    files = (made.mjcf.parent / "meshes").iterdir()
    return {folder + path.name: path.read_bytes() for path in files}


def test_mass_and_inertia(made: Made) -> None:
    """MuJoCo's body has the mass of the parts and, with trimesh's integrals, their inertia."""
    model = mujoco.MjModel.from_xml_path(str(made.mjcf))
    assert model.body_mass[1] == pytest.approx(made.body.mass, rel=1e-6)
    np.testing.assert_allclose(model.body_ipos[1], made.body.centre, atol=1e-8)
    principal = np.sort(np.linalg.eigvalsh(made.body.inertia))
    np.testing.assert_allclose(np.sort(model.body_inertia[1]), principal, rtol=1e-5)


def test_mass_properties() -> None:
    """Mass, centre and inertia of two plates are those of boxes."""
    made = {each.name: each.mesh for each in shapes(sensors.build("gelsight-mini-ideal"))}
    plates = [made[name] for name in ("tray", "guide")]
    bodies = [as_manifold(mesh) for mesh in plates]
    mass, centre, inertia = mass_properties(bodies, [1.19 * KILOGRAMS] * len(bodies))
    sides = 1e-3 * np.array([np.ptp(mesh.bounds, axis=0) for mesh in plates])
    middles = 1e-3 * np.array([mesh.bounds.mean(axis=0) for mesh in plates])
    masses = 1190.0 * sides.prod(axis=1)
    assert mass == pytest.approx(masses.sum(), rel=1e-9)
    middle = masses @ middles / masses.sum()
    np.testing.assert_allclose(centre, middle, atol=1e-12)
    expected = np.zeros((3, 3))
    for each, side, off in zip(masses, sides, middles - middle, strict=True):
        expected += each / 12.0 * np.diag((side**2).sum() - side**2)
        expected += each * ((off**2).sum() * np.eye(3) - np.outer(off, off))
    np.testing.assert_allclose(inertia, expected, rtol=1e-6, atol=1e-15)


def test_a_format_can_be_given_alone(tmp_path: Path) -> None:
    notes: list[str] = []
    first, *_ = export_robot(sensors.build("gelsight360"), tmp_path, "mujoco", notes)
    assert first.suffix == ".xml"
    # The boards of this sensor are a part, which has a mass.
    assert "boards" in notes[0].split("), without")[0]
    assert "boards" not in notes[0].split("), without")[1]


def test_a_format_without_text_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_text(body: SensorBody, meshes: str) -> str:
        return None  # type: ignore[return-value]

    silent = RobotFormat(".sdf", no_text)
    monkeypatch.setattr("optisense.robots.formats.ROBOT_FORMATS.find", lambda name: silent)
    with pytest.raises(OwnCodeError, match=r"no_text' of the format '\.sdf' returned NoneType"):
        export_robot(sensors.build("gelsight-mini"), tmp_path, "silent")
    failing = RobotFormat(".sdf", lambda body, meshes: str(1 / 0))
    monkeypatch.setattr("optisense.robots.formats.ROBOT_FORMATS.find", lambda name: failing)
    with pytest.raises(OwnCodeError, match=r"of the format '\.sdf' fails: ZeroDivisionError"):
        export_robot(sensors.build("gelsight-mini"), tmp_path, "failing")
    assert not list(tmp_path.iterdir())


def test_the_frame_of_a_tube_does_not_depend_on_rounding() -> None:
    design = sensors.build("gelsight360")
    right, up, _ = design.camera.axes()
    skin = next(each.mesh for each in shapes(design) if each.role == "sensing_surface")
    for number in range(3):
        noise = np.random.default_rng(number).normal(0.0, 1e-7, skin.vertices.shape)
        frame = _skin_frame(skin.with_vertices(skin.vertices + noise), right, up)
        assert frame.axes[:, 2] @ right > 0.99
        assert frame.axes[:, 0] @ up > 0.9


def test_a_weighed_sensor() -> None:
    design = sensors.build("gelsight-mini-ideal")
    one, other = sensor_body(design), sensor_body(design, mass=20.0)
    assert other.mass == pytest.approx(0.020)
    np.testing.assert_allclose(other.inertia, one.inertia * (0.020 / one.mass))
    heavier = sensor_body(design, densities={"gel": 2.06})
    gel = next(each.volume for each in shapes(design) if each.name == "gel")
    assert gel is not None
    assert heavier.mass - one.mass == pytest.approx(1.03e-6 * gel, rel=1e-3)


@pytest.mark.parametrize(("off", "turn"), [(0.0, 0.0), (8.0, 0.3)])
def test_a_solid_inside_another_one_is_left_out(off: float, turn: float) -> None:
    """Nothing remains of it, so that it adds neither mass nor a hull; or slivers on a common side,
    if the coordinates are rounded.
    """
    design = sensors.build("gelsight-mini-ideal")
    for name, middle, half, priority in (("outer", 0.0, 10.0, 1), ("inner", -off, 2.0, 0)):
        design.parts[name] = Part(role=Role.BLOCKER, mesh=f"meshes/{name}.obj", priority=priority)
        box = TriangleMesh.box((middle - half, -half, -half), (middle + half, half, half))
        turned = box.vertices @ Rotation.from_euler("xz", [turn, turn]).as_matrix().T
        design.meshes[name] = box.with_vertices(np.round(turned, 6) - (0.0, 0.0, 50.0))
    both = sensor_body(design)
    assert any(note.startswith("inner has neither mass nor contacts") for note in both.notes)
    assert "inner-hull" not in {each.name for each in both.hulls}
    del design.parts["inner"]
    assert both.mass == pytest.approx(sensor_body(design).mass, rel=1e-12)


def test_mujoco_reads_a_sheet_of_one_triangle_and_a_design_named_world(tmp_path: Path) -> None:
    """Its meshes have four vertices or more, `world` is its own body; a note names the sheet."""
    design = sensors.build("gelsight-mini-ideal").model_copy(update={"name": "world"})
    design.parts["flap"] = Part(role=Role.BLOCKER, mesh="meshes/flap.obj")
    design.meshes["flap"] = TriangleMesh(np.eye(3) - [0.0, 0.0, 50.0], np.array([[0, 1, 2]]))
    notes: list[str] = []
    mjcf, *_ = export_robot(design, tmp_path, notes=notes)
    assert "flap has neither mass nor contacts, as it is a sheet without a thickness" in notes
    assert not any(note.startswith("skin has") for note in notes)
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    assert model.body(1).name == mjcf.stem == "world-sensor"


def test_each_skin_has_a_touch_sensor_of_its_own(tmp_path: Path) -> None:
    """Contacts on the case between skins do not count, and no hull covers the second one."""
    design = sensors.build("gelsight-mini-ideal")
    back = TriangleMesh.grid((4.0, 4.0), (2, 2))
    back = back.with_vertices(back.vertices - (0.0, 0.0, 50.0))
    design.parts |= {"back": design.parts["skin"], "case": Part(role=Role.BLOCKER, mesh="case.obj")}
    design.meshes.update({"back": back, "case": TriangleMesh.box((-9, -9, -52), (9, 9, -48))})
    made = exported(design, tmp_path)
    body = made.body
    assert [each.suffix for each in body.skins] == ["-skin", "-back"]
    assert 'name="gelsight-mini-ideal_skin-back"' in made.urdf.read_text()
    on_case = Frame(1e-3 * np.array([9.0, 0.0, -49.0]), np.eye(3)[:, [1, 2, 0]])
    for frame, weight in ((None, GRAVITY * BALL_MASS), (on_case, 0.0)):
        data = mujoco.MjData(with_ball(made, 0.0, slides=True, frame=frame))
        for _ in range(1000):
            mujoco.mj_step(data.model, data)
        assert len(data.contact)
        assert data.sensor("normal_force-skin").data[0] == pytest.approx(weight, rel=0.01)
        assert data.sensor("normal_force-back").data[0] == 0.0
    hulls = [ConvexHull(1e3 * each.mesh.vertices) for each in body.hulls]
    assert max(depth_in(back.vertices, hull).max() for hull in hulls) < COVERED


def test_wrong_numbers_are_refused() -> None:
    design = sensors.build("gelsight-mini-ideal")
    with pytest.raises(DesignError, match="the mass is 0"):
        sensor_body(design, mass=0.0)
    with pytest.raises(DesignError, match="mass of 1e-09 g, the smallest moment of inertia"):
        sensor_body(design, mass=1e-9)
    with pytest.raises(DesignError, match="no solid part 'skin'"):
        sensor_body(design, densities={"skin": 1.0})


def test_a_ball_touches_the_gel_alone(made: Made) -> None:
    """No hull of a rigid part covers the skin."""
    model = with_ball(made, -SUNK)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ball = model.body("ball").id
    touched = set()
    for contact in data.contact:
        first, second = contact.geom1, contact.geom2
        other = first if model.geom_bodyid[second] == ball else second
        touched.add(model.geom(other).name)
    assert touched
    gels = [each.name for each in made.body.hulls if each.is_gel]
    assert touched <= set(gels)


def test_the_touch_sensor_reads_the_weight_of_a_ball(made: Made) -> None:
    """A ball that comes to rest presses with its weight."""
    # On a curved skin a free ball would roll off.
    model = with_ball(made, 0.0, slides=True)
    data = mujoco.MjData(model)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    read = data.sensor("normal_force").data[0]
    assert read == pytest.approx(GRAVITY * BALL_MASS, rel=0.01)


def test_the_friction_of_the_gel_counts(tmp_path: Path) -> None:
    """MuJoCo's own balls have a friction of 1."""
    design = sensors.build("gelsight-mini")
    material = design.materials[design.parts["gel"].material]
    material.elasticity = material.elasticity.model_copy(update={"friction": 0.3})
    notes: list[str] = []
    model = with_ball(exported(design, tmp_path, notes), -SUNK)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert {contact.friction[0] for contact in data.contact} == {0.3}
    assert "that of the gel, 0.3" in notes[-1]


def test_the_camera_looks_where_the_design_does(made: Made) -> None:
    """Points of the skin appear in MuJoCo's pinhole camera where the design's camera sees them."""
    camera = made.design.camera
    if camera.projection != "perspective":
        pytest.skip("a fisheye")
    model = mujoco.MjModel.from_xml_path(str(made.mjcf))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    skin = next(each.mesh for each in shapes(made.design) if each.role == "sensing_surface")
    points = skin.vertices[::97]
    # MuJoCo's camera looks along its -z, and y is up in its picture.
    local = (1e-3 * points - data.cam_xpos[0]) @ data.cam_xmat[0].reshape(3, 3)
    right, up, back = local.T
    high = np.tan(np.radians(model.cam_fovy[0]) / 2.0)
    wide = high * camera.resolution[0] / camera.resolution[1]
    straight = camera.model_copy(update={"distortion": None})
    across, down = picture_places(straight, points)
    np.testing.assert_allclose(0.5 + 0.5 * right / -back / wide, across, atol=1e-5)
    np.testing.assert_allclose(0.5 - 0.5 * up / -back / high, down, atol=1e-5)


def test_the_axis_of_the_camera_may_be_off_the_middle_of_the_picture(tmp_path: Path) -> None:
    """A design's lens has a centre; the frustum with which MuJoCo draws has the same one."""
    design = sensors.build("gelsight-mini-ideal")
    lens = BrownConrady(kind="brown-conrady", centre=(0.55, 0.42))
    design.camera = design.camera.model_copy(update={"distortion": lens})
    mjcf, *_ = export_robot(design, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene, camera = mujoco.MjvScene(model, 100), mujoco.MjvCamera()
    camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, 0
    every = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, every, scene)
    view = scene.camera[0]
    points = design.meshes["skin"].vertices[::97]
    right, up, back = ((1e-3 * points - data.cam_xpos[0]) @ data.cam_xmat[0].reshape(3, 3)).T
    x, y = (view.frustum_near * each / -back for each in (right, up))
    tall = view.frustum_top - view.frustum_bottom
    wide = tall * design.camera.resolution[0] / design.camera.resolution[1]
    expected = np.array(picture_places(design.camera, points))
    found = np.array([0.5 + (x - view.frustum_center) / wide, (view.frustum_top - y) / tall])
    shown = ((expected > 0.0) & (expected < 1.0)).all(axis=0)
    assert shown.sum() > 5
    np.testing.assert_allclose(found[:, shown], expected[:, shown], atol=1e-5)
    assert "lens distorts" not in " ".join(sensor_body(design).notes)
    bent = BrownConrady(kind="brown-conrady", k1=-0.1)
    design.camera = design.camera.model_copy(update={"distortion": bent})
    assert "lens distorts" in " ".join(sensor_body(design).notes)


def test_urdf_has_the_same_body_and_frames(made: Made) -> None:
    """MuJoCo's own reader of URDF gives the mass, and the poses of camera and skin."""
    text = made.urdf.read_text()
    # It merges links without a body into their parent unless it is told to keep them.
    own = '<mujoco><compiler fusestatic="false" strippath="true"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", own), meshes(made))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    name = made.body.name
    assert sum(model.body_mass) == pytest.approx(made.body.mass, rel=1e-6)
    for end, frame in (
        ("camera_optical_frame", made.body.camera),
        ("skin", made.body.skins[0].frame),
    ):
        body = data.body(f"{name}_{end}")
        np.testing.assert_allclose(body.xpos, frame.origin, atol=1e-8)
        np.testing.assert_allclose(body.xmat.reshape(3, 3), frame.axes, atol=1e-7)

"""A sensor as a robot description (URDF): links for its meshes, its camera and its skins."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from scipy.spatial.transform import Rotation

from optisense.robots._body import SensorBody
from optisense.robots._mjcf import child, numbers, xml_text


def urdf(body: SensorBody, folder: str) -> str:
    """Return the text of a URDF file with its mesh files (binary STL, m) in a folder beside it.

    The link of the camera has the axes that ROS uses for pictures (REP 103): x to the right, y
    down, z where the camera looks.
    """
    robot = Element("robot", name=body.name)
    link = child(robot, "link", name=body.name)
    inertial = child(link, "inertial")
    child(inertial, "origin", xyz=numbers(body.centre), rpy="0 0 0")
    child(inertial, "mass", value=f"{body.mass:.9g}")
    places = {f"i{'xyz'[i]}{'xyz'[j]}": (i, j) for i in range(3) for j in range(i, 3)}
    inertia = {name: f"{body.inertia[place]:.9g}" for name, place in places.items()}
    child(inertial, "inertia", **inertia)
    for kind, meshes in (("visual", body.looks), ("collision", body.hulls)):
        for each in meshes:
            shape = child(link, kind, name=each.name)
            geometry = child(shape, "geometry")
            child(geometry, "mesh", filename=f"{folder}/{each.name}.stl")
            if kind == "visual":
                material = child(shape, "material", name=each.name)
                child(material, "color", rgba=numbers(each.colour))
    skins = [(f"skin{each.suffix}", each.frame) for each in body.skins]
    for end, frame in (("camera_optical_frame", body.camera), *skins):
        # A link without a body, and the joint that fixes it. Roll, pitch and yaw are rotations
        # about the fixed axes x, y and z, in this order.
        name = f"{body.name}_{end}"
        child(robot, "link", name=name)
        joint = child(robot, "joint", name=f"{name}_joint", type="fixed")
        child(joint, "parent", link=body.name)
        child(joint, "child", link=name)
        angles = Rotation.from_matrix(frame.axes).as_euler("xyz")
        child(joint, "origin", xyz=numbers(frame.origin), rpy=numbers(angles))
    return '<?xml version="1.0"?>\n' + xml_text(robot)


def without_friction(body: SensorBody) -> str:
    """Return a sentence about the friction, which has no place in a URDF file."""
    return (
        f"URDF files contain no friction: set that of the gel, {body.friction:g}, in the simulator"
    )

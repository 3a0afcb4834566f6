"""A sensor as a robot description (URDF): links for its meshes, its camera and its skin."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from scipy.spatial.transform import Rotation

from optisense.robots._body import BodyMesh, Frame, SensorBody
from optisense.robots._mjcf import numbers


def urdf(body: SensorBody, folder: str) -> str:
    """Return the text of a URDF file with its mesh files (binary STL, m) in a folder beside it.

    The link of the camera has the axes that ROS uses for pictures (REP 103): x to the right, y
    down, z where the camera looks.
    """
    name = body.name
    lines = ['<?xml version="1.0"?>', f"<robot name={quoteattr(name)}>"]
    lines.append(f"  <link name={quoteattr(name)}>")
    i = body.inertia
    lines += [
        "    <inertial>",
        f'      <origin xyz="{numbers(body.centre)}" rpy="0 0 0"/>',
        f'      <mass value="{body.mass:.9g}"/>',
        f'      <inertia ixx="{i[0, 0]:.9g}" ixy="{i[0, 1]:.9g}" ixz="{i[0, 2]:.9g}" '
        f'iyy="{i[1, 1]:.9g}" iyz="{i[1, 2]:.9g}" izz="{i[2, 2]:.9g}"/>',
        "    </inertial>",
    ]
    for each in body.looks:
        lines += _mesh("visual", each, folder)
    for each in body.hulls:
        lines += _mesh("collision", each, folder)
    lines.append("  </link>")
    lines += _fixed(name, f"{name}_camera_optical_frame", body.camera)
    lines += _fixed(name, f"{name}_skin", body.skin)
    lines.append("</robot>")
    return "\n".join(lines) + "\n"


def without_friction(body: SensorBody) -> str:
    """Return a sentence about the friction, which has no place in a URDF file."""
    return (
        f"URDF files contain no friction: set that of the gel, {body.friction:g}, in the simulator"
    )


def _mesh(kind: str, each: BodyMesh, folder: str) -> list[str]:
    lines = [f"    <{kind} name={quoteattr(each.name)}>"]
    file = quoteattr(f"{folder}/{each.name}.stl")
    lines.append(f"      <geometry><mesh filename={file}/></geometry>")
    if kind == "visual":
        lines.append(f"      <material name={quoteattr(each.name)}>")
        lines.append(f'        <color rgba="{numbers(each.colour)}"/>')
        lines.append("      </material>")
    return [*lines, f"    </{kind}>"]


def _fixed(parent: str, child: str, frame: Frame) -> list[str]:
    """Return a link without a body, and the joint that fixes it."""
    # Roll, pitch and yaw are rotations about the fixed axes x, y and z, in this order.
    angles = Rotation.from_matrix(frame.axes).as_euler("xyz")
    return [
        f"  <link name={quoteattr(child)}/>",
        f'  <joint name={quoteattr(child + "_joint")} type="fixed">',
        f"    <parent link={quoteattr(parent)}/>",
        f"    <child link={quoteattr(child)}/>",
        f'    <origin xyz="{numbers(frame.origin)}" rpy="{numbers(angles)}"/>',
        "  </joint>",
    ]

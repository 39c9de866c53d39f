"""Describes a robot to ROS 2: the names of its joints, and a URDF made from its geometry."""

from collections.abc import Iterable
from math import acos, atan2, dist
from xml.etree.ElementTree import Element, SubElement, tostring

from tvist_protocol.geometry import Capsule, Origin
from tvist_protocol.info import Info

BASE, FLANGE = "base", "tool0"
"""Frames of poses and of the flange, with UR's names."""
_UR = {
    "base": "shoulder_pan_joint", "shoulder": "shoulder_lift_joint", "elbow": "elbow_joint",
    "wrist_1": "wrist_1_joint", "wrist_2": "wrist_2_joint", "wrist_3": "wrist_3_joint",
}  # fmt: skip
"""Names that UR's ROS 2 driver gives to the joints of a UR arm."""


def joint_names(info: Info) -> list[str]:
    """Return the joints' names in ROS 2: those of UR's driver for a UR arm, else the robot's own."""
    return list(_UR.values()) if info.joints == list(_UR) else list(info.joints)


def urdf(info: Info) -> str | None:
    """Return a URDF with the arm's joints, limits and capsules; None if the robot does not tell its geometry.

    Each joint has a link, whose frame turns with it, and an end, a frame at which the next joint stands.
    """
    geometry = info.geometry
    if geometry is None:
        return None
    ends: list[Origin] = geometry.placement or [
        (a, 0.0, d, alpha, 0.0, 0.0)
        for a, d, alpha in zip(geometry.a, geometry.d, geometry.alpha, strict=True)
    ]
    joints, robot = joint_names(info), Element("robot", name=info.name)
    frames = [BASE, *(f"{name}_end" for name in joints[:-1]), FLANGE]
    links = {frame: SubElement(robot, "link", name=frame) for frame in frames}
    for number, name in enumerate(joints):
        link = f"{name}_link"
        SubElement(robot, "link", name=link)
        joint = _joint(robot, name, "revolute", frames[number], link)
        SubElement(joint, "axis", xyz="0 0 1")
        low, high = map(repr, info.limits.position[number])
        speed, effort = repr(info.limits.velocity[number]), repr(info.limits.torque[number])
        SubElement(joint, "limit", lower=low, upper=high, velocity=speed, effort=effort)
        _origin(_joint(robot, f"{name}_to_end", "fixed", link, frames[number + 1]), ends[number])
    for capsule in geometry.capsules:
        _draw(links[frames[capsule.link + 1]], capsule)
    return tostring(robot, encoding="unicode")


def _joint(robot: Element, name: str, kind: str, parent: str, child: str) -> Element:
    joint = SubElement(robot, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    return joint


def _origin(of: Element, place: Iterable[float]) -> None:
    numbers = [repr(float(number)) for number in place]
    SubElement(of, "origin", xyz=" ".join(numbers[:3]), rpy=" ".join(numbers[3:]))


def _draw(link: Element, capsule: Capsule) -> None:
    """Add a capsule to a link, as a cylinder of its length or a sphere."""
    length, radius = dist(capsule.start, capsule.end), repr(capsule.radius)
    x, y, z = (end - start for start, end in zip(capsule.start, capsule.end, strict=True))
    middle = [0.5 * sum(ends) for ends in zip(capsule.start, capsule.end, strict=True)]
    turn = (acos(z / length), atan2(y, x)) if length > 0.0 else (0.0, 0.0)
    for part in ("visual", "collision"):
        shown = SubElement(link, part)
        _origin(shown, (*middle, 0.0, *turn))
        geometry = SubElement(shown, "geometry")
        if length > 0.0:
            SubElement(geometry, "cylinder", radius=radius, length=repr(length + 2.0 * capsule.radius))
        else:
            SubElement(geometry, "sphere", radius=radius)

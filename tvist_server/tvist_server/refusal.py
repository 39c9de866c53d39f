"""Saying no: a refusal raised where it is found, answered where the command came in."""

import math
from collections.abc import Sequence

from tvist_plant.description import RobotDescription
from tvist_protocol.replies import Code, Refused
from tvist_protocol.values import Payload


class RefusalError(Exception):
    """A command is refused; it has changed nothing."""

    def __init__(self, code: Code, where: str, why: str, limit: float | None = None) -> None:
        super().__init__(why)
        self.reply = Refused(code=code, where=where, why=why, limit=limit)


def check_joints(q: Sequence[float], description: RobotDescription, where: str = "q") -> None:
    """Refuse a posture with another number of joints or outside their range."""
    if len(q) != description.joints:
        raise RefusalError(
            "out_of_range", where, f"{where} has {len(q)} angles; the arm has {description.joints}", description.joints
        )
    for number, (angle, limit) in enumerate(zip(q, description.limits.position, strict=True)):
        if not abs(angle) <= limit:
            field = f"{where}[{number}]"
            raise RefusalError("limit_position", field, f"{field} is {angle:g} rad; the joint goes to ±{limit:g}", limit)


def check_motion(velocity: float, acceleration: float, jerk: float, description: RobotDescription) -> None:
    """Refuse limits of a motion above those of the arm."""
    limits = description.limits
    code: Code
    for code, where, value, highest, unit in (
        ("limit_velocity", "velocity", velocity, min(limits.velocity), "rad/s"),
        ("limit_acceleration", "acceleration", acceleration, min(limits.acceleration), "rad/s²"),
        ("out_of_range", "jerk", jerk, min(limits.jerk), "rad/s³"),
    ):
        if value > highest:
            raise RefusalError(code, where, f"{where} is {value:g} {unit}; the arm's limit is {highest:g}", highest)


def check_body(payload: Payload, where: str = "", rated: float = math.inf) -> None:
    """Refuse a payload that is heavier than rated or that no body can be."""
    prefix = f"{where}." if where else ""
    if payload.mass > rated:
        field = f"{prefix}mass"
        raise RefusalError("out_of_range", field, f"{field} is {payload.mass:g} kg; the arm is rated for {rated:g}", rated)
    xx, xy, xz, yy, yz, zz = payload.inertia
    # Leading minors of a moment tensor that a distribution of mass can have, with room for rounding.
    small = -1e-12
    minors = (xx, yy, zz, xx * yy - xy * xy, xx * zz - xz * xz, yy * zz - yz * yz)
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    triangle = (xx + yy - zz, yy + zz - xx, zz + xx - yy)
    if min(*minors, determinant, *triangle) < small:
        field = f"{prefix}inertia"
        raise RefusalError(
            "out_of_range", field, f"{field} is {list(payload.inertia)}: no body has these moments of inertia"
        )

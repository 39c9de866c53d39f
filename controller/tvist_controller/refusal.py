"""Refusals of commands, raised where a problem is found and sent as the reply."""

import math
from collections.abc import Sequence

from tvist_plant.description import RobotDescription, is_real_body
from tvist_protocol.replies import Code, Refused
from tvist_protocol.transitions import Activity
from tvist_protocol.values import Payload

SLOWEST = {"velocity": 1e-3, "acceleration": 1e-2, "jerk": 0.1}
"""Lowest accepted limits of a motion [rad/s, rad/s^2, rad/s^3]."""

_NOTHING_TO = {
    "pause": "no motion that can be paused is running",
    "resume": "no motion is paused: there is nothing to resume",
    "servo_stop": "no stream is running: send servo_start first",
    "unlock_protective_stop": "there is no protective stop to unlock",
    "power_on": "the arm already has power",
    "power": "the arm already has power",
}


class RefusalError(Exception):
    """A command is refused and has changed nothing."""

    def __init__(self, code: Code, where: str, why: str, limit: float | None = None) -> None:
        super().__init__(why)
        self.reply = Refused(code=code, where=where, why=why, limit=limit)


def invalid(
    field: str, value: object, must: str, limit: float | None = None, code: Code = "out_of_range"
) -> RefusalError:
    """Return the refusal of a field's value; `must` says what it must be."""
    return RefusalError(code, field, f"{field} is {value}: must be {must}", limit)


def missing(field: str, why: str) -> RefusalError:
    """Return the refusal of a command without a field that it needs."""
    return RefusalError("missing_field", field, f"{field} is missing: {why}")


def wrong_mode(why: str, field: str = "") -> RefusalError:
    """Return the refusal of a command that is not possible now."""
    return RefusalError("wrong_mode", field, why)


def out_of_turn(command: str, activity: Activity) -> RefusalError:
    """Return the refusal of a command, given by its `type`, that is not allowed in the present activity."""
    code: Code = "wrong_mode"
    if activity is Activity.PROTECTIVE_STOPPING:
        why = "safety_mode is PROTECTIVE_STOP: send unlock_protective_stop once the arm is at rest"
    elif activity is Activity.PROTECTIVE_STOP:
        why = "safety_mode is PROTECTIVE_STOP: send unlock_protective_stop first"
    elif command in _NOTHING_TO:
        why = _NOTHING_TO[command]
    elif activity in {Activity.POWER_OFF, Activity.IDLE}:
        why = f"robot_mode is {activity}: send power_on first"
    else:
        code, why = "busy", "the arm is moving: wait for motion_done or send stop"
    return RefusalError(code, "", why)


def check_joints(q: Sequence[float], description: RobotDescription, where: str = "q") -> None:
    """Refuse a posture with a wrong number of joints or beyond a position limit."""
    _check_each(q, description.limits.position, "limit_position", where, "rad")


def check_speeds(qd: Sequence[float], description: RobotDescription) -> None:
    """Refuse velocities with a wrong number of joints or above a limit."""
    _check_each(qd, description.limits.velocity, "limit_velocity", "qd", "rad/s")


def _check_each(values: Sequence[float], limits: Sequence[float], code: Code, where: str, unit: str) -> None:
    count = len(limits)
    if len(values) != count:
        why = f"{where} has {len(values)} values: must be {count}, one per joint"
        raise RefusalError("out_of_range", where, why, count)
    for number, (value, limit) in enumerate(zip(values, limits, strict=True)):
        if not abs(value) <= limit:
            raise invalid(f"{where}[{number}]", f"{value:g} {unit}", f"within ±{limit:g} {unit}", limit, code)


def check_motion(
    velocity: float, acceleration: float, jerk: float, description: RobotDescription, prefix: str = ""
) -> None:
    """Refuse motion limits above the arm's, or too low to move."""
    limits = description.limits
    _check_limit("limit_velocity", "velocity", velocity, min(limits.velocity), "rad/s", prefix)
    check_acceleration(acceleration, description, prefix)
    _check_limit("out_of_range", "jerk", jerk, min(limits.jerk), "rad/s³", prefix)


def check_acceleration(acceleration: float, description: RobotDescription, prefix: str = "") -> None:
    """Refuse a joint acceleration above the arm's, or too low to move."""
    highest = min(description.limits.acceleration)
    _check_limit("limit_acceleration", "acceleration", acceleration, highest, "rad/s²", prefix)


def _check_limit(code: Code, name: str, value: float, highest: float, unit: str, prefix: str) -> None:
    if value > highest:
        must = f"at most {highest:g} {unit}, the arm's limit"
        raise invalid(f"{prefix}{name}", f"{value:g} {unit}", must, highest, code)
    _check_least(name, value, unit, prefix)


def _check_least(name: str, value: float, unit: str, prefix: str) -> None:
    if value < (lowest := SLOWEST[name]):
        raise invalid(f"{prefix}{name}", f"{value:g} {unit}", f"at least {lowest:g} {unit}", lowest)


def check_body(payload: Payload, where: str = "", rated: float = math.inf) -> None:
    """Refuse a payload that is too heavy or physically impossible."""
    prefix = f"{where}." if where else ""
    if payload.mass > rated:
        must = f"at most {rated:g} kg, the arm's rating"
        raise invalid(f"{prefix}mass", f"{payload.mass:g} kg", must, rated)
    if not is_real_body(payload.inertia):
        raise invalid(f"{prefix}inertia", list(payload.inertia), "the moments of inertia of a real body")


def check_pace(velocity: float, acceleration: float, jerk: float, where: str = "") -> None:
    """Refuse limits of a tool motion that are too low to move."""
    _check_least("velocity", velocity, "m/s", where)
    _check_least("acceleration", acceleration, "m/s²", where)
    _check_least("jerk", jerk, "m/s³", where)

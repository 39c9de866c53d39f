"""Answers to a command. A client must ignore fields that it does not know."""

from typing import Literal

from msgspec import Struct

from tvist_protocol.values import Joints, Pose

Code = Literal[
    "malformed", "unknown_type", "unknown_field", "missing_field", "out_of_range", "no_control",
    "stale_token", "busy", "wrong_mode", "limit_position", "limit_velocity", "limit_acceleration",
    "limit_torque", "limit_force", "no_solution", "singular", "blend_skipped", "collision",
    "unknown_shaper", "unknown_estimator", "unknown_calibration", "unknown_fault", "plant_failure",
    "payload_mismatch", "unsupported_version", "script_error", "starting",
]  # fmt: skip
"""Reason of a refusal or of an event."""

CODE_MEANINGS: dict[Code, str] = {
    "malformed": "the message is not a MessagePack map, is truncated, has trailing bytes or is too large, or a field "
    "has the wrong type",
    "unknown_type": "this key does not accept messages of this `type`",
    "unknown_field": "the message has a field that its type does not have",
    "missing_field": "the message lacks a required field",
    "out_of_range": "a number, a length, a name or a choice is out of range; NaN and infinity always are",
    "no_control": "the sender does not have control, or the clock; `why` names the client that has it",
    "stale_token": "the token is not that of the current lease, or of the clock's current holder",
    "busy": "the arm is moving",
    "wrong_mode": "the robot mode or the safety mode does not allow the command",
    "limit_position": "a position is outside the range of a joint",
    "limit_velocity": "a velocity exceeds the limit of a joint",
    "limit_acceleration": "an acceleration exceeds the limit of a joint",
    "limit_torque": "a torque exceeds the limit of a joint",
    "limit_force": "the force at the tool exceeds its limit, or the tool leaves its way in force mode",
    "no_solution": "no joint positions reach a pose",
    "singular": "the arm passes a singular posture, in which no joint motion moves the tool as required",
    "blend_skipped": "two blends of a path overlap, so the path stops at the point of the second",
    "collision": "arm, payload or surroundings would collide or have collided",
    "unknown_shaper": "there is no shaper of this name; `info` lists them",
    "unknown_estimator": "there is no estimator of this name",
    "unknown_calibration": "there is no calibration of this name; `info` lists them",
    "unknown_fault": "there is no fault of this name, or the plant cannot simulate it; the faults are listed below",
    "plant_failure": "the state of the simulated arm was no longer finite, or the controller has failed",
    "payload_mismatch": "the calibration was made with a payload other than the declared one, or the arm carries "
    "another",
    "unsupported_version": "the server does not speak this version of the protocol",
    "script_error": "the text of a program is not valid; `where` is `text:LINE:COLUMN`",
    "starting": "the robot is not ready yet, as after an installation, when a start compiles; `why` says how far it is",
}


class Accepted(
    Struct, frozen=True, kw_only=True, tag_field="type", tag="accepted", omit_defaults=True, gc=False
):
    """The command has started something that takes time; absent fields do not apply."""

    id: int | None = None
    """Id of the motion; its events have the same id."""
    token: str | None = None
    """Token of the lease or clock just taken; every command that needs it must contain it."""
    lease_s: float | None = None
    """Duration of the granted lease [s]; absent for the clock, which does not expire."""
    limited: str | None = None
    """Why the motion is slower than requested, or which limit it will exceed, for people; absent otherwise."""


class Done(Struct, frozen=True, kw_only=True, tag_field="type", tag="done", omit_defaults=True, gc=False):
    """The command has been carried out."""

    tick: int | None = None
    """Tick at which it was carried out; absent if it does not matter."""


class Refused(Struct, frozen=True, kw_only=True, tag_field="type", tag="refused", gc=False):
    """The command was not carried out and changed nothing."""

    code: Code
    """Reason, for programs."""
    where: str
    """Field at fault, such as `q[3]` or `payload.mass`; empty if no field is at fault."""
    why: str
    """Reason for people, with field, value and limit."""
    limit: float | None = None
    """Limit that was exceeded, in the field's unit; null if there is none."""


class Posture(Struct, frozen=True, kw_only=True, tag_field="type", tag="posture", gc=False):
    """Answer to `inverse_kinematics`."""

    q: Joints
    """Joint positions at which the tool has the pose, the nearest of all [rad]."""


class ToolPose(Struct, frozen=True, kw_only=True, tag_field="type", tag="tool_pose", gc=False):
    """Answer to `forward_kinematics`."""

    pose: Pose
    """Pose of the tool centre point: x y z [m] and rotation vector [rad]."""


Reply = Accepted | Done | Refused | Posture | ToolPose

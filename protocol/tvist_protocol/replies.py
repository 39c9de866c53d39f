"""Answers to a command. Whoever reads one ignores fields it does not know."""

from typing import Literal

from msgspec import Struct

Code = Literal[
    "malformed",
    "unknown_type",
    "unknown_field",
    "missing_field",
    "out_of_range",
    "no_control",
    "stale_token",
    "busy",
    "wrong_mode",
    "limit_position",
    "limit_velocity",
    "limit_acceleration",
    "limit_torque",
    "collision",
    "unknown_shaper",
    "unknown_estimator",
    "unknown_calibration",
    "unknown_fault",
    "plant_failure",
    "payload_mismatch",
    "unsupported_version",
]
"""Why a command was refused, or what an event is about."""

CODE_MEANINGS: dict[Code, str] = {
    "malformed": "no MessagePack map, truncated, with trailing bytes, too large, or a field of another type",
    "unknown_type": "`type` is none that belongs on this key",
    "unknown_field": "a field this message does not have",
    "missing_field": "a field this message must have is absent",
    "out_of_range": "a number, a length, a name or a choice outside its bounds; NaN and infinity always are",
    "no_control": "nobody has control or the clock, or another client: the holder is in `why`",
    "stale_token": "the token is not the one of the present lease, or of the clock's present holder",
    "busy": "the arm is moving: not now",
    "wrong_mode": "the robot's or the safety system's mode does not allow it",
    "limit_position": "outside a joint's range",
    "limit_velocity": "faster than a joint may be",
    "limit_acceleration": "more acceleration than a joint may have",
    "limit_torque": "more torque than a joint may have",
    "collision": "arm, payload or surroundings would meet or have met",
    "unknown_shaper": "there is no shaper of that name: `info` lists them",
    "unknown_estimator": "there is no estimator of that name",
    "unknown_calibration": "there is no calibration of that name: `info` lists them",
    "unknown_fault": "there is no fault of that name, or this robot's plant cannot have it: they are listed below",
    "plant_failure": "the simulated arm's state was no longer finite",
    "payload_mismatch": "the calibration was made with another payload than the one declared",
    "unsupported_version": "the server does not speak this version of the protocol",
}


class Accepted(
    Struct, frozen=True, kw_only=True, tag_field="type", tag="accepted", omit_defaults=True, gc=False
):
    """The command has begun something that lasts; absent fields do not apply."""

    id: int | None = None
    """Names the motion; events that concern it carry the same number."""
    token: str | None = None
    """Names the lease or the hold of the clock just taken; goes with every command that needs it."""
    lease_s: float | None = None
    """Length of the lease as granted [s]; absent for the clock, of which nothing runs out."""


class Done(Struct, frozen=True, kw_only=True, tag_field="type", tag="done", omit_defaults=True, gc=False):
    """The command has been carried out."""

    tick: int | None = None
    """Tick at which it has; only where it matters."""


class Refused(Struct, frozen=True, kw_only=True, tag_field="type", tag="refused", gc=False):
    """The command was not carried out and changed nothing."""

    code: Code
    """What is wrong, for a program."""
    where: str
    """The field at fault, `q[3]` or `payload.mass`; empty where it is none."""
    why: str
    """A sentence with field, value and limit, for a person."""
    limit: float | None = None
    """The bound that was passed, in the field's unit; null where there is none."""


Reply = Accepted | Done | Refused

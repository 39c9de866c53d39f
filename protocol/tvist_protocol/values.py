"""The values messages are made of: SI units, radians, every number bounded.

A bound on the wire keeps out NaN, infinity and typing errors by orders of magnitude, nothing finer: what this
arm can do stands in `info`, and the server checks it. An unbounded float would let NaN in.
"""

from typing import Annotated, Literal

from msgspec import Meta, Struct

PROTOCOL_VERSION = 1
"""Version of the wire: a client says it in `take_control`, the server in `info`."""

ROBOT_NAME_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}$(?!\n)"
"""A robot's name is one chunk of a key. `$` alone would let a final line feed through."""

CLIENT_NAME_PATTERN = r"^(?!@)(?!.*[/*?#$])[ -~]{1,64}$(?!\n)"
"""A client's name too is one chunk of a key, `client/<client>`: printable ASCII without `/ * ? # $`. No
wildcard matches a chunk that begins with `@`: the server would not see such a client leave."""

SESSION_PATTERN = r"^[0-9a-f]{1,32}$(?!\n)"
"""Zenoh's id of a session."""

PATTERN_MEANINGS: dict[str, str] = {
    ROBOT_NAME_PATTERN: "1 to 64 of a-z 0-9 _ -, the first a letter or a digit",
    SESSION_PATTERN: "1 to 32 of 0-9 a-f, Zenoh's id of a session",
    CLIENT_NAME_PATTERN: "1 to 64 printable ASCII characters other than / * ? # $, the first not @",
}
"""What to say to a person whose string does not match."""

Angle = Annotated[float, Meta(ge=-1e3, le=1e3)]
"""[rad]"""
Joints = Annotated[tuple[Angle, ...], Meta(min_length=1, max_length=7)]
"""One angle a joint [rad]; as many as the arm has joints, which only the server knows."""

Velocity = Annotated[float, Meta(gt=0, le=1e3)]
"""[rad/s], one number for every joint"""
Acceleration = Annotated[float, Meta(gt=0, le=1e5)]
"""[rad/s²]"""
Jerk = Annotated[float, Meta(gt=0, le=1e7)]
"""[rad/s³]"""
Period = Annotated[float, Meta(ge=0.002, le=0.1)]
"""[s], between one tick and 10 Hz"""
Fraction = Annotated[float, Meta(ge=0, le=1)]
"""[-]"""
Lease = Annotated[float, Meta(ge=0.1, le=3600)]
"""[s]"""

Frequency = Annotated[float, Meta(ge=0.1, le=200)]
"""[Hz]"""
DampingRatio = Annotated[float, Meta(ge=0, lt=1)]
"""[-]"""
ModeCount = Annotated[int, Meta(ge=1, le=8)]
Frequencies = Annotated[tuple[Frequency, ...], Meta(min_length=1, max_length=8)]
"""One a mode [Hz]"""
DampingRatios = Annotated[tuple[DampingRatio, ...], Meta(min_length=1, max_length=8)]
"""One a mode [-]"""

Mass = Annotated[float, Meta(ge=0, le=100)]
"""[kg]"""
Offset = Annotated[float, Meta(ge=-2, le=2)]
"""[m]"""
Vec3 = tuple[Offset, Offset, Offset]
"""x y z in the flange frame [m]"""
Moment = Annotated[float, Meta(ge=-10, le=10)]
"""[kg m²]"""
Inertia6 = tuple[Moment, Moment, Moment, Moment, Moment, Moment]
"""xx xy xz yy yz zz about the centre of mass, flange axes [kg m²]"""

Sequence = Annotated[int, Meta(ge=0, extra_json_schema={"maximum": 2**64 - 1})]
"""A uint64. MessagePack has no larger integer, and a bound above 2^63 cannot be said to msgspec."""
Ticks = Annotated[int, Meta(ge=1, le=100_000)]
"""Control periods of 0.002 s"""
Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]
Version = Annotated[int, Meta(ge=0, le=65535)]

Token = Annotated[str, Meta(max_length=128)]
"""May be empty on the wire: then it is a stale one, which the server says better than a length does."""
Name = Annotated[str, Meta(min_length=1, max_length=64)]
"""Of a shaper, an estimator, a calibration, a fault; whether there is one of that name the server says."""
RobotName = Annotated[str, Meta(pattern=ROBOT_NAME_PATTERN)]
ClientName = Annotated[str, Meta(pattern=CLIENT_NAME_PATTERN)]

ResetMode = Literal["RUNNING", "IDLE", "POWER_OFF"]
"""Robot modes a simulation can be put into."""


class Payload(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, gc=False):
    """What hangs on the flange."""

    mass: Mass
    """Mass [kg]."""
    com: Vec3
    """Centre of mass in the flange frame [m]."""
    inertia: Inertia6
    """Inertia xx xy xz yy yz zz about the centre of mass, flange axes [kg m²]."""

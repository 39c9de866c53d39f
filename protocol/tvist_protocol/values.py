"""Types of the values in messages: SI units, radians, every number bounded.

The bounds only exclude NaN, infinity and errors by orders of magnitude; the server checks the arm's limits. The text
in an annotation names the entries of a tuple.
"""

from typing import Annotated, Literal

from msgspec import Meta, Struct

PROTOCOL_VERSION = 1
"""Version of the protocol, which a client sends in `take_control` and the server in `info`."""

ROBOT_NAME_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}$(?!\n)"
"""Pattern of a robot's name, which is one chunk of a key. `$` alone would allow a final line feed."""

NAMESPACE_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}(/[a-z0-9][a-z0-9_-]{0,63}){0,7}$(?!\n)"
"""Pattern of a namespace: chunks that precede a robot's keys, such as `hall-3/line-1`."""

CLIENT_NAME_PATTERN = r"^(?!@)(?!.*[/*?#$])[ -~]{1,64}$(?!\n)"
"""Pattern of a client's name, one chunk of the key `client/<client>`: printable ASCII without `/ * ? # $`. No
wildcard matches a chunk that starts with `@`, so the server would not notice when such a client leaves."""

SESSION_PATTERN = r"^[0-9a-f]{1,32}$(?!\n)"  # Zenoh's id of a session

PROGRAM_NAME_PATTERN = r"^[^\x00-\x1f\x7f]{1,256}$(?!\n)"  # pattern of a program's name

PATTERN_MEANINGS: dict[str, str] = {
    PROGRAM_NAME_PATTERN: "1 to 256 characters other than control characters",
    NAMESPACE_PATTERN: "1 to 8 words separated by /, each 1 to 64 of a-z 0-9 _ -, the first a letter or a digit",
    ROBOT_NAME_PATTERN: "1 to 64 of a-z 0-9 _ -, the first a letter or a digit",
    SESSION_PATTERN: "1 to 32 of 0-9 a-f, Zenoh's id of a session",
    CLIENT_NAME_PATTERN: "1 to 64 printable ASCII characters other than / * ? # $, the first not @",
}
"""Description of each pattern, for messages about strings that do not match."""

Angle = Annotated[float, Meta(ge=-1e3, le=1e3)]  # [rad]
Joints = Annotated[tuple[Angle, ...], Meta(min_length=1, max_length=7)]
"""One angle per joint [rad]; only the server knows how many joints the arm has."""

Velocity = Annotated[float, Meta(gt=0, le=1e3)]  # [rad/s], one number for every joint
Acceleration = Annotated[float, Meta(gt=0, le=1e5)]  # [rad/s²]
Jerk = Annotated[float, Meta(gt=0, le=1e7)]  # [rad/s³]
Period = Annotated[float, Meta(ge=0.002, le=0.1)]  # [s], between one tick and 10 Hz
JointSpeed = Annotated[float, Meta(ge=-1e3, le=1e3)]  # [rad/s]
JointSpeeds = Annotated[tuple[JointSpeed, ...], Meta(min_length=1, max_length=7)]
"""One velocity per joint [rad/s]"""
JointAcceleration = Annotated[float, Meta(ge=-1e5, le=1e5)]  # [rad/s²]
JointAccelerations = Annotated[tuple[JointAcceleration, ...], Meta(min_length=1, max_length=7)]
"""One acceleration per joint [rad/s²]"""
Duration = Annotated[float, Meta(gt=0, le=3600)]  # [s]
Transition = Annotated[float, Meta(ge=0, le=3600)]  # [s]
Fraction = Annotated[float, Meta(ge=0, le=1)]  # [-]
Lease = Annotated[float, Meta(ge=0.1, le=3600)]  # [s]

Frequency = Annotated[float, Meta(ge=0.1, le=200)]  # [Hz]
DampingRatio = Annotated[float, Meta(ge=0, lt=1)]  # [-]
ModeCount = Annotated[int, Meta(ge=1, le=8)]
Frequencies = Annotated[tuple[Frequency, ...], Meta(min_length=1, max_length=8)]  # one per mode [Hz]
DampingRatios = Annotated[tuple[DampingRatio, ...], Meta(min_length=1, max_length=8)]  # one per mode [-]

Mass = Annotated[float, Meta(ge=0, le=100)]  # [kg]
Offset = Annotated[float, Meta(ge=-2, le=2)]  # [m]
Vec3 = Annotated[tuple[Offset, Offset, Offset], "x y z"]  # x y z in the flange frame [m]
Coordinate = Annotated[float, Meta(ge=-1e3, le=1e3)]  # [m]
Pose = Annotated[tuple[Coordinate, Coordinate, Coordinate, Angle, Angle, Angle], "x y z rx ry rz"]
"""x y z [m] and rotation vector [rad]"""
ToolSpeed = Annotated[float, Meta(gt=0, le=1e3)]  # [m/s]
ToolAcceleration = Annotated[float, Meta(gt=0, le=1e5)]  # [m/s²]
ToolJerk = Annotated[float, Meta(gt=0, le=1e7)]  # [m/s³]
Component = Annotated[float, Meta(ge=-1e3, le=1e3)]  # [m/s]
Twist = Annotated[
    tuple[Component, Component, Component, JointSpeed, JointSpeed, JointSpeed], "vx vy vz wx wy wz"
]
"""Velocity [m/s] and angular velocity [rad/s]"""
Blend = Annotated[float, Meta(ge=0, le=10)]  # [m]
Moment = Annotated[float, Meta(ge=-10, le=10)]  # [kg m²]
Inertia6 = Annotated[tuple[Moment, Moment, Moment, Moment, Moment, Moment], "xx xy xz yy yz zz"]
"""xx xy xz yy yz zz about the centre of mass, flange axes [kg m²]"""

Sequence = Annotated[int, Meta(ge=0, extra_json_schema={"maximum": 2**64 - 1})]
"""A uint64. MessagePack has no larger integer, and msgspec does not accept a bound above 2^63."""
Ticks = Annotated[int, Meta(ge=1, le=100_000)]  # control periods of 0.002 s
Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]
Version = Annotated[int, Meta(ge=0, le=65535)]

Token = Annotated[str, Meta(max_length=128)]
"""May be empty: the server then reports a stale token, which explains more than an error about the length."""
Name = Annotated[str, Meta(min_length=1, max_length=64)]
"""Name of a shaper, an estimator, a calibration or a fault; the server checks that it exists."""
RobotName = Annotated[str, Meta(pattern=ROBOT_NAME_PATTERN)]
Namespace = Annotated[str, Meta(pattern=NAMESPACE_PATTERN)]
ClientName = Annotated[str, Meta(pattern=CLIENT_NAME_PATTERN)]

ResetMode = Literal["RUNNING", "IDLE", "POWER_OFF"]  # robot modes that a simulation can be set to


class Payload(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, gc=False):
    """Payload on the flange."""

    mass: Mass
    """Mass [kg]."""
    com: Vec3
    """Centre of mass in the flange frame [m]."""
    inertia: Inertia6
    """Inertia xx xy xz yy yz zz about the centre of mass, flange axes [kg m²]."""

"""Commands for motions of the tool and of joints: lines, arcs, paths, speeds, servoing. `move_j` is in `commands`."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from tvist_protocol.client_message import Leased
from tvist_protocol.values import (
    Acceleration,
    Blend,
    Duration,
    JointAccelerations,
    Joints,
    JointSpeeds,
    Pose,
    ToolAcceleration,
    ToolJerk,
    ToolSpeed,
    Twist,
    Velocity,
)

Orientation = Literal["interpolated", "tangent"]  # orientation of the tool on an arc

MAX_SEGMENTS = 500  # largest number of segments of a path
MAX_POINTS = 3000  # largest number of points of a trajectory


class MoveL(Leased, frozen=True, kw_only=True, tag="move_l"):
    """Move the tool centre point on a straight line and rotate it the shortest way; answered as `move_j` is."""

    pose: Pose
    """Target of the tool centre point: x y z [m] and rotation vector [rad]."""
    frame: Pose | None = None
    """Frame in which `pose` is given, as a pose in the base frame; null: the base frame."""
    velocity: ToolSpeed = 0.25
    """Largest speed of the tool [m/s]; a rotation by 1 rad counts as 0.25 m."""
    acceleration: ToolAcceleration = 1.2
    """Largest acceleration of the tool [m/s²]."""
    jerk: ToolJerk = 60.0
    """Largest jerk of the tool [m/s³]."""
    duration: Duration | None = None
    """Duration before shaping [s], in place of `velocity`, `acceleration`, `jerk`; longer if the arm cannot do it."""


class MoveC(Leased, frozen=True, kw_only=True, tag="move_c"):
    """Move the tool centre point on the circular arc through `via` and `pose`; answered as `move_j` is."""

    via: Pose
    """A pose on the arc, of which only the position is used: x y z [m] and rotation vector [rad]."""
    pose: Pose
    """Target of the tool centre point: x y z [m] and rotation vector [rad]."""
    frame: Pose | None = None
    """Frame in which `via` and `pose` are given, as a pose in the base frame; null: the base frame."""
    orientation: Orientation = "interpolated"
    """`interpolated`: rotate to the orientation of `pose` the shortest way; `tangent`: keep the tool's
    orientation relative to the arc's tangent, and ignore that of `pose`."""
    velocity: ToolSpeed = 0.25
    """Largest speed of the tool [m/s]; a rotation by 1 rad counts as 0.25 m."""
    acceleration: ToolAcceleration = 1.2
    """Largest acceleration of the tool along the arc [m/s²]."""
    jerk: ToolJerk = 60.0
    """Largest jerk of the tool [m/s³]."""


class PathSegment(
    Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="type",
    omit_defaults=True,
    gc=False,
):
    """Base of the parts of a path."""


class JointSegment(PathSegment, frozen=True, kw_only=True, tag="joint"):
    """A part of a path on which all joints move in phase, as in `move_j`."""

    q: Joints
    """Posture at its end, one angle per joint [rad]."""
    velocity: Velocity = 1.5
    """Largest velocity of any joint [rad/s]."""
    acceleration: Acceleration = 2.0
    """Largest acceleration of any joint [rad/s²]."""
    duration: Duration | None = None
    """Duration of this part [s], in place of `velocity` and `acceleration`; longer if the arm cannot do it."""
    blend: Blend = 0.0
    """Distance from this part's end within which the path may leave it for the next [m]; unused in the last part."""


class LineSegment(PathSegment, frozen=True, kw_only=True, tag="line"):
    """A part of a path on which the tool moves as in `move_l`."""

    pose: Pose
    """Pose at its end: x y z [m] and rotation vector [rad]."""
    velocity: ToolSpeed = 0.25
    """Largest speed of the tool [m/s]; a rotation by 1 rad counts as 0.25 m."""
    acceleration: ToolAcceleration = 1.2
    """Largest acceleration of the tool, also in the blend at its end [m/s²]."""
    duration: Duration | None = None
    """Duration of this part [s], in place of `velocity` and `acceleration`; longer if the arm cannot do it."""
    blend: Blend = 0.0
    """Distance from this part's end within which the path may leave it for the next [m]; unused in the last part."""


class ProcessSegment(PathSegment, frozen=True, kw_only=True, tag="process"):
    """A part of a path on which the tool moves as in `move_l`, at a constant speed also in the blend at its end."""

    pose: Pose
    """Pose at its end: x y z [m] and rotation vector [rad]."""
    velocity: ToolSpeed = 0.25
    """Speed of the tool [m/s]; a rotation by 1 rad counts as 0.25 m."""
    acceleration: ToolAcceleration = 1.2
    """Largest acceleration of the tool along the path [m/s²]."""
    blend: Blend = 0.0
    """Distance from this part's end within which the path may leave it for the next [m]; unused in the last part."""


class ArcSegment(PathSegment, frozen=True, kw_only=True, tag="arc"):
    """A part of a path on which the tool moves as in `move_c`."""

    via: Pose
    """A pose on the arc, of which only the position is used: x y z [m] and rotation vector [rad]."""
    pose: Pose
    """Pose at its end: x y z [m] and rotation vector [rad]."""
    orientation: Orientation = "interpolated"
    """`interpolated` or `tangent`, as in `move_c`."""
    velocity: ToolSpeed = 0.25
    """Largest speed of the tool [m/s]; a rotation by 1 rad counts as 0.25 m."""
    acceleration: ToolAcceleration = 1.2
    """Largest acceleration of the tool along the path [m/s²]."""
    blend: Blend = 0.0
    """Distance from this part's end within which the path may leave it for the next [m]; unused in the last part."""


Segment = JointSegment | LineSegment | ProcessSegment | ArcSegment


class MovePath(Leased, frozen=True, kw_only=True, tag="move_path", omit_defaults=True):
    """Move along a path of several parts without stopping where they are blended; answered as `move_j` is."""

    segments: Annotated[tuple[Segment, ...], Meta(min_length=1, max_length=MAX_SEGMENTS)]
    """Parts of the path in order; each starts where the previous one ends."""
    frame: Pose | None = None
    """Frame in which all poses are given, as a pose in the base frame; null: the base frame."""
    jerk: ToolJerk = 60.0
    """Largest jerk of the tool [m/s³]; of the joints on joint segments, four times this number [rad/s³]."""


class TrajectoryPoint(
    Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True, gc=False
):
    """A posture that the joints pass at a given time."""

    time: Annotated[float, Meta(ge=0, le=600)]
    """Time since the start, before shaping [s]; 0.1 ms or more after the point before."""
    q: Joints
    """Posture, one angle per joint [rad]."""
    qd: JointSpeeds | None = None
    """Velocities there, one per joint [rad/s]; 0 at the end."""
    qdd: JointAccelerations | None = None
    """Accelerations there, one per joint [rad/s²]; only with `qd`."""


class MoveTrajectory(Leased, frozen=True, kw_only=True, tag="move_trajectory"):
    """Pass postures at given times; answered as `move_j` is.

    The joints move between the points as with ROS 2's `joint_trajectory_controller`: on straight lines if the points
    have positions only, on cubics if they have velocities, on quintics if they have accelerations too. The whole
    trajectory is refused if it breaks a limit in any tick, before or after shaping; `why` names the first point.
    A corner of straight lines changes the velocity within one tick, which the limits hardly allow: without
    velocities, points must be a few milliseconds apart. Each joint is shaped, so the arm cuts bends a little.
    """

    points: Annotated[tuple[TrajectoryPoint, ...], Meta(min_length=1, max_length=MAX_POINTS)]
    """Points in order, all with the same fields; a message has room for 2000 of six joints with velocities, for 1300
    with accelerations. The trajectory starts at rest at the present reference: a first point at time 0 must be within
    0.01 rad of it."""


class ServoJ(Leased, frozen=True, kw_only=True, tag="servo_j"):
    """Follow a posture with a lag, until another command comes; repeat it to follow a moving posture.

    It starts at rest or takes over any motion at once. Answered by `accepted` with the `id` that it shares
    with its successors until the arm rests.
    """

    q: Joints
    """Posture, one angle per joint [rad]."""
    lookahead: Annotated[float, Meta(gt=0, le=10)] = 0.1
    """Lag behind a moving posture, in addition to two steps [s]; clipped to 0.03 to 0.2."""
    gain: Annotated[float, Meta(gt=0, le=1e6)] = 300.0
    """Stiffness with which the arm approaches the posture [1/s²]; clipped to 100 to 2000. It does not change
    the lag, and is raised where the arm would overshoot."""
    shaped: bool = False
    """Whether the shaper is used; only for a motion that starts at rest."""


class SpeedJ(Leased, frozen=True, kw_only=True, tag="speed_j"):
    """Accelerate to velocities of the joints and keep them, until another command comes; see `servo_j`."""

    qd: JointSpeeds
    """Velocities, one per joint [rad/s]."""
    acceleration: Acceleration = 1.4
    """Acceleration of the joint whose velocity changes most [rad/s²]; the others change in phase."""
    shaped: bool = False
    """Whether the shaper is used; only for a motion that starts at rest."""


class SpeedL(Leased, frozen=True, kw_only=True, tag="speed_l"):
    """Accelerate to a velocity of the tool and keep it, until another command comes; see `servo_j`."""

    xd: Twist
    """Velocity [m/s] and angular velocity [rad/s] of the tool centre point in the base frame."""
    acceleration: ToolAcceleration = 1.2
    """Acceleration of the tool [m/s²]."""
    angular_acceleration: Acceleration | None = None
    """Angular acceleration of the tool [rad/s²]; null: the number of `acceleration`."""
    shaped: bool = False
    """Whether the shaper is used; only for a motion that starts at rest."""


class StopJ(Leased, frozen=True, kw_only=True, tag="stop_j"):
    """Come to rest with a deceleration of the joints; a planned motion stays on its path."""

    acceleration: Acceleration = 2.0
    """Deceleration of the fastest joint [rad/s²]."""


class StopL(Leased, frozen=True, kw_only=True, tag="stop_l"):
    """Come to rest with a deceleration of the tool; a planned motion stays on its path."""

    acceleration: ToolAcceleration = 1.2
    """Deceleration of the tool [m/s²]."""
    angular_acceleration: Acceleration | None = None
    """Angular deceleration of the tool [rad/s²]; null: the number of `acceleration`."""

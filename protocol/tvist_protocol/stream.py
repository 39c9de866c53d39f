"""What a robot puts without being asked. Whoever reads ignores fields it does not know.

Arrays are lists, which cost least to make out of numerical arrays five hundred times a second. They are not
bounded: they come from the robot. Names are those of RTDE where it has one.
"""

from typing import Literal

from msgspec import Struct

from tvist_protocol.replies import Code

EventKind = Literal[
    "motion_started",
    "motion_done",
    "motion_stopped",
    "stream_stopped",
    "lease_lost",
    "protective_stop",
    "safety_stop",
    "shaper_changed",
    "warning",
]

EVENT_MEANINGS: dict[EventKind, str] = {
    "motion_started": "the motion `id` begins at this tick",
    "motion_done": "the shaped reference of motion `id` is at rest (to 1e-7 rad); the arm may still ring",
    "motion_stopped": "the motion `id` ended before its target",
    "stream_stopped": "the stream of set-points ended; `why` says how",
    "lease_lost": "nobody has control any longer",
    "protective_stop": "the robot stops to protect itself; `code` says from what",
    "safety_stop": "the safety system stops the robot: `category` says how, `why` for what",
    "shaper_changed": "another shaper or estimator is in use",
    "warning": "something a person should know of; nothing stopped",
}


class State(Struct, frozen=True, kw_only=True, tag_field="type", tag="state", gc=False):
    """One tick of controller and arm."""

    tick: int
    """Number of the control period, never turned back."""
    timestamp: float
    """tick·0.002 s; never the wall clock [s]."""
    robot_mode: int
    """RTDE's number: 3 is POWER_OFF, 5 IDLE, 7 RUNNING."""
    safety_mode: int
    """RTDE's number: 1 is NORMAL, 2 REDUCED, 3 PROTECTIVE_STOP, 5 SAFEGUARD_STOP, 6 and 7 emergency stops."""
    runtime_state: int
    """RTDE's number: 0 is STOPPING, 1 STOPPED, 2 PLAYING, 3 PAUSING, 4 PAUSED."""
    setpoint_sequence: int | None
    """Newest set-point accepted at this tick; null before the first."""
    reference_q: list[float]
    """Reference before shaping, one a joint [rad]."""
    target_q: list[float]
    """Shaped reference q* [rad]."""
    target_qd: list[float]
    """Its velocity [rad/s]."""
    target_qdd: list[float]
    """Its acceleration [rad/s²]."""
    target_moment: list[float]
    """Torque the rigid model asks for it [N m]."""
    actual_q: list[float]
    """Measured angle, on the link's side of the gear [rad]."""
    actual_qd: list[float]
    """Measured velocity [rad/s]."""
    actual_moment: list[float]
    """Measured torque [N m]."""
    actual_TCP_pose: list[float]
    """Kinematics of `actual_q`: x y z [m] and rotation vector [rad]."""
    actual_TCP_speed: list[float]
    """Kinematics of `actual_q` and `actual_qd`: velocity [m/s] and angular velocity [rad/s]."""
    actual_tool_accelerometer: list[float]
    """Specific force in the flange frame [m/s²]; at rest it points up with 9.81."""
    speed_scaling: float
    """Share of the programmed speed [-]."""
    estimated_f_d: list[float]
    """Damped frequency the shaper works with, one a mode [Hz]."""
    estimated_zeta: list[float]
    """Damping ratio the shaper works with, one a mode [-]."""
    shaper_delay: float
    """Latest impulse of the shaper [s]."""
    missed_ticks: int
    """Control periods that began too late, since the start."""
    shaper_clipped: bool = False
    """Whether the shaper cannot do here what it should: a delay is beyond what it holds, or more vibration is left."""


class Event(Struct, frozen=True, kw_only=True, tag_field="type", tag="event", gc=False):
    """Something happened at a tick. Every motion's `id` ends in exactly one of done and stopped."""

    tick: int
    """Tick at which it happened."""
    kind: EventKind
    """What happened."""
    id: int | None = None
    """The motion it concerns."""
    code: Code | None = None
    """The reason, for a program."""
    why: str | None = None
    """The reason, for a person."""
    category: int | None = None
    """Of a stop, as IEC 60204-1 numbers them: 0 the brakes at once, 1 at rest the power is taken, 2 it is not."""
    duration: float | None = None
    """Of a stop: from now until the shaped reference rests; null where that is too far ahead to say [s]."""
    way: float | None = None
    """Of a stop: how far the joint that turns most still turns; null likewise [rad]."""
    line: int | None = None
    """Line of the program that has ended by an error, counted from 1."""


class Truth(Struct, frozen=True, kw_only=True, tag_field="type", tag="truth", gc=False):
    """What no robot can know of itself, and a simulation can, at one tick."""

    tick: int
    """Number of the control period."""
    timestamp: float
    """tick·0.002 s [s]."""
    motor_q: list[float]
    """Motor angle referred to the joint, one a joint [rad]."""
    motor_qd: list[float]
    """Motor velocity referred to the joint [rad/s]."""
    gear_deflection: list[float]
    """Link angle less motor angle, one a joint [rad]."""
    link_deflection: list[float]
    """Angle of each virtual joint by which the links bend [rad]."""
    flange_pose: list[float]
    """Where the flange of the flexible arm is: x y z [m] and rotation vector [rad]."""
    tool_acceleration: list[float]
    """Specific force in the flange frame, free of noise [m/s²]."""
    f_d: list[float]
    """Damped frequency of each true mode, when last computed [Hz]."""
    zeta: list[float]
    """Damping ratio of each true mode, when last computed [-]."""
    participation: list[float]
    """Share of each true mode in the tool's motion, when last computed [-]."""


class Telemetry(Struct, frozen=True, kw_only=True, tag_field="type", tag="telemetry", gc=False):
    """How the server is doing, once a second. Counters run since the start."""

    tick: int
    """Number of the control period."""
    ticks_per_second: float
    """Control periods in the last second, measured [1/s]."""
    late_p50_us: float
    """Lateness of a tick in the last second, median [µs]."""
    late_p99_us: float
    """Lateness of a tick in the last second, 99th percentile [µs]."""
    late_max_us: float
    """Lateness of a tick in the last second, largest [µs]."""
    missed_ticks: int
    """Control periods that began too late."""
    dropped_states: int
    """States the server could not hand to the network in time; what the network drops on its way it does not say."""
    recorder_dropped: int
    """Messages the recorder had no room for."""
    setpoints_received: int
    """Set-points that arrived."""
    setpoints_refused: int
    """Set-points that were not for the running stream, or no posture of the arm."""
    setpoints_late: int
    """Set-points dropped since a newer one had been played."""
    setpoints_lost: int
    """Set-points missing when their turn came."""
    setpoints_limited: int
    """Set-points that passed a limit and were held back."""
    commands: int
    """Commands that arrived."""
    refused: int
    """Commands that were refused."""

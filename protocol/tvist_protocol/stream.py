"""Messages that a robot publishes by itself. A client must ignore fields that it does not know.

Arrays are lists, the cheapest to create 500 times a second. Fields have their RTDE names if RTDE has them.
"""

from typing import Literal

from msgspec import Struct

from tvist_protocol.replies import Code

EventKind = Literal[
    "motion_started", "motion_done", "motion_stopped", "stream_stopped", "lease_lost",
    "protective_stop", "safety_stop", "shaper_changed", "learnt", "warning", "program_started",
    "program_stopped", "text", "popup",
]  # fmt: skip

PopupKind = Literal["message", "warning", "error"]  # how serious a popup is

EVENT_MEANINGS: dict[EventKind, str] = {
    "motion_started": "the motion `id` begins at this tick",
    "motion_done": "the shaped reference of motion `id` is at rest (to 1e-7 rad); the arm may still vibrate",
    "motion_stopped": "the motion `id` ended before its target",
    "stream_stopped": "the stream of set-points ended; `why` gives the reason",
    "lease_lost": "no client has control any longer",
    "protective_stop": "the robot stops to protect itself; `code` gives the reason",
    "safety_stop": "the safety system stops the robot; `category` is the category of the stop, `why` the reason",
    "shaper_changed": "the shaper or the estimator has changed",
    "learnt": "the robot has learnt from its last motions, or forgets that; `why` says what",
    "warning": "a condition that the user should know about; the robot did not stop",
    "program_started": "the program `program` begins",
    "program_stopped": "the program `program` has ended; `why` gives the reason if it was ended, a `warning` with a "
    "`line` came before if an error of its own ended it",
    "text": "a program has written `why` to the log, or the cell says what it did",
    "popup": "a program shows the message `why` with the title `title`, and may wait until it is closed",
}


class State(Struct, frozen=True, kw_only=True, tag_field="type", tag="state", gc=False):
    """One tick of controller and arm."""

    tick: int
    """Number of the control period; it never decreases."""
    timestamp: float
    """Simulation time, tick·0.002 s, not the wall clock [s]."""
    robot_mode: int
    """RTDE's number: 3 is POWER_OFF, 5 IDLE, 7 RUNNING."""
    safety_mode: int
    """RTDE's number: 1 is NORMAL, 2 REDUCED, 3 PROTECTIVE_STOP, 5 SAFEGUARD_STOP, 6 and 7 emergency stops."""
    runtime_state: int
    """RTDE's number: 0 is STOPPING, 1 STOPPED, 2 PLAYING, 3 PAUSING, 4 PAUSED."""
    setpoint_sequence: int | None
    """Sequence number of the newest set-point accepted at this tick; null before the first."""
    reference_q: list[float]
    """Reference before shaping, one angle per joint [rad]."""
    target_q: list[float]
    """Shaped reference q* [rad]."""
    target_qd: list[float]
    """Velocity of the shaped reference [rad/s]."""
    target_qdd: list[float]
    """Acceleration of the shaped reference [rad/s²]."""
    target_moment: list[float]
    """Torque that the rigid model needs for the shaped reference [N m]."""
    actual_q: list[float]
    """Measured angle on the link side of the gear [rad]."""
    actual_qd: list[float]
    """Measured velocity [rad/s]."""
    actual_moment: list[float]
    """Measured torque [N m]."""
    actual_TCP_pose: list[float]
    """Pose of the tool centre point computed from `actual_q`: x y z [m] and rotation vector [rad]."""
    actual_TCP_speed: list[float]
    """Velocity [m/s] and angular velocity [rad/s] of the tool centre point computed from `actual_q` and `actual_qd`."""
    actual_tool_accelerometer: list[float]
    """Specific force in the flange frame [m/s²]; at rest it is 9.81 and points up."""
    speed_scaling: float
    """Share of the programmed speed [-]."""
    estimated_f_d: list[float]
    """Damped frequency that the shaper uses, one per mode [Hz]."""
    estimated_zeta: list[float]
    """Damping ratio that the shaper uses, one per mode [-]."""
    shaper_delay: float
    """Time of the shaper's last impulse [s]."""
    missed_ticks: int
    """Number of control periods since the start that were missed: see `telemetry`."""
    shaper_clipped: bool = False
    """Whether the shaper cannot meet its specification: it would need a longer delay line, or leaves more vibration."""
    unshaped_q: list[float] | None = None
    """Reference before shaping at the tick of `target_q`, a tick before `reference_q`; null: the same [rad]."""
    unshaped_qd: list[float] | None = None
    """Velocity of the reference before shaping; null: the same as `target_qd` [rad/s]."""
    unshaped_qdd: list[float] | None = None
    """Acceleration of the reference before shaping; null: the same as `target_qdd` [rad/s²]."""
    motor_qd: list[float] | None = None
    """Velocity command of the drives, with feed-forward of the arm's elasticity; null without it [rad/s]."""
    motor_qdd: list[float] | None = None
    """Acceleration of that command; null without it [rad/s²]."""
    motor_moment: list[float] | None = None
    """Torque command of the drives, with feed-forward of the arm's elasticity; null without it [N m]."""
    motor_limited: bool = False
    """Whether the torque limits reduce the lead of the motors that the arm's elasticity requires."""
    flange_wrench: list[float] | None = None
    """Force [N] and torque about the origin [N m] measured by the flange sensor, in its frame; null: no sensor."""


class Event(Struct, frozen=True, kw_only=True, tag_field="type", tag="event", gc=False):
    """An event at a tick. Every motion's `id` ends with exactly one of `motion_done` and `motion_stopped`."""

    tick: int
    """Tick at which it happened."""
    kind: EventKind
    """Kind of the event."""
    id: int | None = None
    """Id of the motion that it concerns."""
    code: Code | None = None
    """Reason, for programs."""
    why: str | None = None
    """Reason, for people."""
    category: int | None = None
    """Stop category (IEC 60204-1): 0 closes the brakes at once, 1 removes power at rest, 2 keeps power."""
    duration: float | None = None
    """Time until the shaped reference of a stop is at rest; null if it is too far ahead to predict [s]."""
    way: float | None = None
    """Largest angle that a joint still turns in a stop; null if its end is too far ahead to predict [rad]."""
    line: int | None = None
    """Line of the program that ended with an error, counted from 1."""
    column: int | None = None
    """Column in that line, counted from 1."""
    program: str | None = None
    """Name of the program that it concerns."""
    title: str | None = None
    """Title of a popup."""
    level: PopupKind | None = None
    """How serious a popup is."""
    blocking: bool | None = None
    """Whether the program waits until the popup is closed."""
    secondary: bool | None = None
    """Whether the program runs beside the one that `io` describes; null for the latter."""


class Truth(Struct, frozen=True, kw_only=True, tag_field="type", tag="truth", gc=False):
    """Values at one tick that a simulation knows but a real robot cannot measure."""

    tick: int
    """Number of the control period."""
    timestamp: float
    """Simulation time, tick·0.002 s [s]."""
    motor_q: list[float]
    """Motor angle referred to the joint, one per joint [rad]."""
    motor_qd: list[float]
    """Motor velocity referred to the joint [rad/s]."""
    gear_deflection: list[float]
    """Link angle minus motor angle, one per joint [rad]."""
    link_deflection: list[float]
    """Angle of each virtual joint that models the bending of a link [rad]."""
    flange_pose: list[float]
    """Pose of the flexible arm's flange: x y z [m] and rotation vector [rad]."""
    tool_acceleration: list[float]
    """Specific force in the flange frame without noise [m/s²]."""
    f_d: list[float]
    """Damped frequency of each true mode, when last computed [Hz]."""
    zeta: list[float]
    """Damping ratio of each true mode, when last computed [-]."""
    participation: list[float]
    """Share of each true mode in the tool's motion, when last computed [-]."""
    static_gear_deflection: list[float] = []
    """Part of `gear_deflection` that remains at rest in this pose; empty if unknown [rad]."""
    static_link_deflection: list[float] = []
    """Part of `link_deflection` that remains at rest in this pose; empty if unknown [rad]."""
    body_poses: list[float] = []
    """Base-frame poses of moving bodies, consecutively: x y z [m], rotation vector [rad]; empty without a world."""
    contact_force: list[float] = []
    """Total contact force on the arm, its tool or its fingers, in the base frame; empty without a world [N]."""


class Telemetry(Struct, frozen=True, kw_only=True, tag_field="type", tag="telemetry", gc=False):
    """Timing and counters of the server, once a second. Counters count from the start of the server.

    These definitions hold wherever the words are used. A control period is due at a fixed interval after the
    previous one, on the wall clock. It either starts, or is left out if the robot is more than 50 periods
    behind. The lateness of a period is its start minus its deadline, or 0 if it starts earlier: robots of one
    process take turns, and a robot whose turn comes early does not wait. A period is missed if it starts a
    period late or more, or is left out; so no more are missed than were due. The rate is the number of
    periods started, or of states received, per second of the counting machine's clock. The load is the time
    spent in periods, including the commands carried out between them, per second of the wall clock. The robot
    becomes overloaded when a fifth of the due periods were missed in each of two consecutive seconds, and
    stays so until less than a twentieth were missed in each of five. If a client steps time, nothing is due.
    """

    tick: int
    """Number of the control period."""
    ticks_per_second: float
    """Rate: control periods started in the last second [1/s]."""
    late_p50_us: float
    """Median lateness of a tick in the last second [µs]."""
    late_p99_us: float
    """99th percentile of the lateness of a tick in the last second [µs]."""
    late_max_us: float
    """Largest lateness of a tick in the last second [µs]."""
    missed_ticks: int
    """Number of control periods missed, of `due_ticks`."""
    dropped_states: int
    """Number of states that the server could not pass to the network in time; losses in the network are not counted."""
    recorder_dropped: int
    """Number of messages that the recorder's queue had no room for."""
    setpoints_received: int
    """Number of set-points received."""
    setpoints_refused: int
    """Number of set-points that were not for the running stream, or not a valid configuration of the arm."""
    setpoints_late: int
    """Number of set-points dropped because a newer one had been played."""
    setpoints_lost: int
    """Number of set-points that had not arrived when their turn came."""
    setpoints_limited: int
    """Number of set-points that exceeded a limit and were limited."""
    commands: int
    """Number of commands received."""
    refused: int
    """Number of commands refused."""
    load: float | None = None
    """Load in the last second [-]; null: a client steps time."""
    due_ticks: int | None = None
    """Number of control periods that were due, started or left out; null: a client steps time."""
    due_per_second: float | None = None
    """Control periods due per second of the wall clock [1/s]; null: a client steps time, or an older server."""
    overloaded: bool = False
    """Whether the robot is overloaded; a `warning` reports when this starts and ends."""
    processor_wait_us: float = 0.0
    """Time in the last second for which the tick thread waited for a processor [µs]; 0 if it is unknown."""

"""A robot's description of itself, sent on request. A client must ignore fields that it does not know."""

from typing import Literal

from msgspec import Struct

from tvist_protocol.geometry import Geometry
from tvist_protocol.replies import Code
from tvist_protocol.values import Payload

Clock = Literal["realtime", "lockstep", "free"]


class Limits(Struct, frozen=True, kw_only=True, gc=False):
    """Limits of the arm, one entry per joint."""

    position: list[tuple[float, float]]
    """Smallest and largest angle [rad]."""
    velocity: list[float]
    """Largest velocity [rad/s]."""
    acceleration: list[float]
    """Largest acceleration [rad/s²]."""
    jerk: list[float]
    """Largest jerk [rad/s³]."""
    torque: list[float]
    """Largest torque [N m]."""
    payload: float
    """Rated payload [kg]."""


class Stopping(Struct, frozen=True, kw_only=True, gc=False):
    """Stop of the slowest joint with the arm stretched out, computed for the reference of a rigid arm."""

    payload: float
    """Mass at the flange [kg]."""
    speed: float
    """Velocity of the joint when the stop begins, as a share of its limit [-]."""
    joint: str
    """Joint that takes longest to stop."""
    duration: float
    """Time until the joint is at rest [s]."""
    way: float
    """Angle that the joint turns until it is at rest [rad]."""


class StopReason(Struct, frozen=True, kw_only=True, gc=False):
    """The stop that keeps the robot from moving."""

    tick: int
    """Tick at which it stopped."""
    code: Code | None
    """Reason, for programs; null if no code applies."""
    why: str
    """Reason, for people."""


class CalibrationInfo(Struct, frozen=True, kw_only=True, gc=False):
    """The calibration in use."""

    name: str
    """Name of the calibration."""
    payload_mass: float
    """Mass that the arm carried during the identification [kg]."""
    fits_payload: bool
    """Whether the calibration holds for the declared payload."""
    fits_arm: bool | None = None
    """Whether it was measured on the arm that the robot file describes; null if the calibration names no arm."""
    seed: int | None
    """Seed of the simulation it was made in; null for a real arm or if unknown."""
    f_d_range: tuple[float, float]
    """Smallest and largest damped frequency measured over the workspace [Hz]."""
    zeta_range: tuple[float, float]
    """Smallest and largest damping ratio measured over the workspace [-]."""
    shipped: bool | None = None
    """Whether it came with the server's package, measured on the simulated arm; null from older servers."""


class Info(Struct, frozen=True, kw_only=True, tag_field="type", tag="info", gc=False):
    """The robot, its limits and its current settings."""

    name: str
    """Name of the robot, as in its keys."""
    protocol: int
    """Version of the protocol that the server speaks."""
    version: str
    """Version of the server's package."""
    model: str
    """Model of the arm."""
    joints: list[str]
    """Names of the joints, from the base on."""
    rate_hz: float
    """Control periods per second of simulation time [Hz]."""
    clock: Clock
    """What advances simulation time: the wall clock, the steps of a client, or the program that contains the robot."""
    limits: Limits
    """Limits of the arm."""
    payload: Payload
    """Declared payload."""
    calibration: CalibrationInfo | None
    """Calibration in use; null if the estimator needs none."""
    shaper: str
    """Shaper in use."""
    modes: int
    """Number of modes that the shaper suppresses."""
    estimator: str
    """Estimator in use."""
    calibrations: list[str]
    """Available calibrations."""
    shapers: list[str]
    """Available shapers."""
    control: str | None
    """Client that has control; null if no client has it."""
    tick: int
    """Tick of this description."""
    stopping: list[Stopping] = []
    """Stopping times and angles at 33, 66 and 100 % speed, without payload and with the rated one."""
    robot_mode: int | None = None
    """Robot mode as in `state`, also before the first tick; null from older servers."""
    safety_mode: int | None = None
    """Safety mode as in `state`, also before the first tick; null from older servers."""
    stop: StopReason | None = None
    """Stop that keeps the robot from moving now; null if there is none or its reason is unknown."""
    arm: str | None = None
    """Fingerprint of the parameters of the arm's vibration, as in a calibration's `provenance`; null if unknown."""
    programs: list[str] = []
    """Programs that can be loaded."""
    stepper: str | None = None
    """Client that holds the clock and alone may step time; null: the client that has control may step it."""
    commands: dict[str, list[str]] = {}
    """Fields of each command that the server knows; empty from older servers."""
    poses: dict[str, tuple[float, ...]] = {}
    """Named poses, one angle per joint [rad]; empty from older servers."""
    geometry: Geometry | None = None
    """Kinematics and shape of the arm; null from older servers."""
    watched: str | None = None
    """Address of a robot that is only watched: it refuses commands for the arm; null if this server moves it."""
    moved: str | None = None
    """Address of the robot's own controller, through which this server moves the arm; null if there is none."""

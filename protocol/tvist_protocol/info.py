"""What a robot says of itself when asked. Whoever reads ignores fields it does not know."""

from typing import Literal

from msgspec import Struct

from tvist_protocol.replies import Code
from tvist_protocol.values import Payload

Clock = Literal["realtime", "lockstep", "free"]


class Limits(Struct, frozen=True, kw_only=True, gc=False):
    """What the arm can do, one entry a joint."""

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
    """A stop of the joint that is the slowest to stop, with the arm stretched out, by the rigid arm's reference."""

    payload: float
    """Mass at the flange [kg]."""
    speed: float
    """Velocity of the joint when the stop begins, as a share of its limit [-]."""
    joint: str
    """The joint that is the slowest to stop."""
    duration: float
    """Time until the joint rests [s]."""
    way: float
    """Angle the joint turns until it rests [rad]."""


class StopReason(Struct, frozen=True, kw_only=True, gc=False):
    """Why the robot stands and may not move."""

    tick: int
    """Tick at which it stopped."""
    code: Code | None
    """The reason, for a program; null where there is none of its own."""
    why: str
    """The reason, for a person."""


class CalibrationInfo(Struct, frozen=True, kw_only=True, gc=False):
    """The calibration in use."""

    name: str
    """Its name."""
    payload_mass: float
    """Mass the arm carried when it was made [kg]."""
    fits_payload: bool
    """Whether that is the payload now declared."""
    fits_arm: bool | None = None
    """Whether it was measured on the arm that the robot file describes; null: it does not say on which."""
    seed: int | None
    """Seed of the simulation it was made in; null: a real arm's, or unknown."""
    f_d_range: tuple[float, float]
    """Smallest and largest damped frequency measured over the workspace [Hz]."""
    zeta_range: tuple[float, float]
    """Smallest and largest damping ratio measured over the workspace [-]."""


class Info(Struct, frozen=True, kw_only=True, tag_field="type", tag="info", gc=False):
    """The robot, its limits and how it is set up now."""

    name: str
    """Name of the robot, as in its keys."""
    protocol: int
    """Version of the protocol the server speaks."""
    version: str
    """Version of the server's package."""
    model: str
    """Model of the arm."""
    joints: list[str]
    """Names of its joints, from the base on."""
    rate_hz: float
    """Control periods a second of simulated time [Hz]."""
    clock: Clock
    """Who lets time pass: the wall clock, a client's steps, or a program it runs in."""
    limits: Limits
    """What the arm can do."""
    payload: Payload
    """Payload declared: what the controller believes."""
    calibration: CalibrationInfo | None
    """Calibration in use; null where the estimator needs none."""
    shaper: str
    """Shaper in use."""
    modes: int
    """How many modes it cancels."""
    estimator: str
    """Estimator in use."""
    calibrations: list[str]
    """Calibrations to choose from."""
    shapers: list[str]
    """Shapers to choose from."""
    control: str | None
    """Client that has control; null: nobody."""
    tick: int
    """Tick at which this was said."""
    stopping: list[Stopping] = []
    """How long stops last and how far they go: at 33, 66 and 100 % speed, without payload and with the rated one."""
    robot_mode: int | None = None
    """As `state` has it, and already before the first tick; null: an older server, which does not say."""
    safety_mode: int | None = None
    """Likewise."""
    stop: StopReason | None = None
    """The stop that keeps the robot from moving now; null: there is none, or nothing has told why."""
    arm: str | None = None
    """Fingerprint of what makes the arm vibrate, as a calibration's `provenance` names it; null: not told."""
    programs: list[str] = []
    """Programs that can be loaded."""
    stepper: str | None = None
    """Client that holds the clock and alone lets time pass; null: nobody, so that who has control may."""
    commands: dict[str, list[str]] = {}
    """Fields of each command that the server knows; empty: an older server, which does not say."""

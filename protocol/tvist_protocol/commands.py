"""Messages from clients: commands and set-points. Constructors do not validate; `tvist_protocol.codec.check` does."""

from math import isfinite
from typing import Any, Literal

from tvist_protocol.client_message import ClientMessage, Leased
from tvist_protocol.errors import ProtocolError, short
from tvist_protocol.forces import EndForceMode, ForceMode, Freedrive, SetExternalWrench, ZeroFtsensor
from tvist_protocol.io import SetIo, SetRegisters, SetTcp, SimulationSetInputs
from tvist_protocol.kinematics import ForwardKinematics, InverseKinematics
from tvist_protocol.motions import (
    MoveC,
    MoveL,
    MovePath,
    MoveTrajectory,
    ServoJ,
    SpeedJ,
    SpeedL,
    StopJ,
    StopL,
)
from tvist_protocol.programs import (
    ProgramClosePopup,
    ProgramInterpret,
    ProgramLoad,
    ProgramPause,
    ProgramPlay,
    ProgramRun,
    ProgramSkip,
    ProgramStop,
)
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep
from tvist_protocol.values import (
    PROTOCOL_VERSION,
    Acceleration,
    ClientName,
    DampingRatios,
    Duration,
    Fraction,
    Frequencies,
    Inertia6,
    Jerk,
    Joints,
    Lease,
    Mass,
    ModeCount,
    Name,
    Period,
    Sequence,
    Token,
    Transition,
    Vec3,
    Velocity,
    Version,
)

CALIBRATION_DEPTH = 16
"""Largest depth of maps and lists in a calibration: more than any needs, and safe for recursion."""


class TakeControl(ClientMessage, frozen=True, kw_only=True, tag="take_control"):
    """Take the lease; answered by `accepted` with `token` and `lease_s`."""

    client: ClientName
    """Name of the client, shown to other clients while it has control."""
    lease_s: Lease = 30.0
    """Time without a command after which control ends [s]."""
    protocol: Version = PROTOCOL_VERSION
    """Version of the protocol the client speaks."""


class KeepAlive(Leased, frozen=True, kw_only=True, tag="keep_alive"):
    """Renew the lease; send one every `lease_s`/3."""


class ReleaseControl(Leased, frozen=True, kw_only=True, tag="release_control"):
    """Give the lease back."""


class HandOver(Leased, frozen=True, kw_only=True, tag="hand_over"):
    """Give the lease directly to another client, so that no third client can take it."""

    client: ClientName
    """Name of the client that gets control."""


class TakeClock(ClientMessage, frozen=True, kw_only=True, tag="take_clock"):
    """Take the clock of a robot in lockstep; answered by `accepted` with the `token` for `simulation.step`."""

    client: ClientName
    """Name of the client, shown to other clients while it holds the clock."""
    protocol: Version = PROTOCOL_VERSION
    """Version of the protocol the client speaks."""


class ReleaseClock(ClientMessage, frozen=True, kw_only=True, tag="release_clock"):
    """Give the clock back; the client that has control may then step time again."""

    token: Token
    """Token of the clock."""


class MoveJ(Leased, frozen=True, kw_only=True, tag="move_j"):
    """Move to a joint configuration, all joints in phase; answered by `accepted` with `id`, then events."""

    q: Joints
    """Target, one angle per joint [rad]."""
    velocity: Velocity = 1.5
    """Largest velocity of any joint [rad/s]."""
    acceleration: Acceleration = 2.0
    """Largest acceleration of any joint [rad/s²]."""
    jerk: Jerk = 100.0
    """Largest jerk of any joint [rad/s³]."""
    duration: Duration | None = None
    """Duration before shaping [s], in place of `velocity`, `acceleration`, `jerk`; longer if the arm cannot do it."""


class ServoStart(Leased, frozen=True, kw_only=True, tag="servo_start"):
    """Start to follow a stream of set-points."""

    period: Period = 0.002
    """Time between two set-points [s]."""
    velocity: Velocity = 1.5
    """Velocity to which every joint is limited [rad/s]."""
    acceleration: Acceleration = 2.0
    """Acceleration to which every joint is limited [rad/s²]."""
    jerk: Jerk = 100.0
    """Jerk to which every joint is limited [rad/s³]."""


class ServoStop(Leased, frozen=True, kw_only=True, tag="servo_stop"):
    """End the stream of set-points and come to rest."""


class Stop(ClientMessage, frozen=True, kw_only=True, tag="stop"):
    """Come to rest now, bypassing the shaper; any client may send this."""

    token: Token | None = None
    """Token of the lease, if the client has one."""
    deceleration: Acceleration | None = None
    """Largest deceleration of any joint [rad/s²]; null: as much as the torque limits allow."""


class Pause(Leased, frozen=True, kw_only=True, tag="pause"):
    """Pause the motion, so that it can be resumed."""


class Resume(Leased, frozen=True, kw_only=True, tag="resume"):
    """Continue a paused motion."""


class SetShaper(Leased, frozen=True, kw_only=True, tag="set_shaper"):
    """Choose the input shaper."""

    name: Name
    """Name of the shaper, one of those in `info`; `none` does not shape."""
    modes: ModeCount = 1
    """Number of modes to suppress, the lowest first."""


class SetEstimator(Leased, frozen=True, kw_only=True, tag="set_estimator", gc=True):
    """Choose the estimator that gives the shaper frequency and damping ratio."""

    name: Name
    """`fixed` (with `f_d` and `zeta`), `polynomial` or `modal` (with `calibration`)."""
    f_d: Frequencies | None = None
    """Damped frequency of each mode [Hz]."""
    zeta: DampingRatios | None = None
    """Damping ratio of each mode [-]."""
    calibration: Name | dict[str, Any] | None = None
    """Name of a calibration in `info`, or its content as a map; a path is not accepted."""

    def __post_init__(self) -> None:
        """Refuse with ProtocolError what JSON cannot represent and more than `CALIBRATION_DEPTH` levels."""
        if isinstance(self.calibration, dict):
            _check_plain(self.calibration, "calibration", CALIBRATION_DEPTH)


class SetPayload(Leased, frozen=True, kw_only=True, tag="set_payload", omit_defaults=True):
    """Declare the payload to the controller; this does not change what the simulated arm carries."""

    mass: Mass
    """Mass [kg]."""
    com: Vec3
    """Centre of mass in the flange frame [m]."""
    inertia: Inertia6
    """Inertia xx xy xz yy yz zz about the centre of mass, flange axes [kg m²]."""
    transition_time: Transition = 0.5
    """Time over which the controller changes to the new payload; values below 0.5 s count as 0.5 s [s]."""


class Forget(Leased, frozen=True, kw_only=True, tag="forget"):
    """Undo what the robot has learnt about its payload."""

    what: Literal["payload"]
    """What to forget: the payload that it assumes instead of the declared one."""


class SetSpeed(Leased, frozen=True, kw_only=True, tag="set_speed"):
    """Scale the speed of motions."""

    fraction: Fraction
    """Share of the programmed speed [-]."""


class PowerOn(Leased, frozen=True, kw_only=True, tag="power_on"):
    """Power the arm and release its brakes."""

    release_brakes: bool = True
    """False: only switch the power on, and leave the brakes closed."""


class PowerOff(Leased, frozen=True, kw_only=True, tag="power_off"):
    """Switch the arm's power off; a motion is stopped first."""


class UnlockProtectiveStop(Leased, frozen=True, kw_only=True, tag="unlock_protective_stop"):
    """Leave a protective stop; the arm must be at rest."""


class RestartSafety(Leased, frozen=True, kw_only=True, tag="restart_safety"):
    """Restart the safety system after a violation or a fault; afterwards the arm has no power."""


Command = (
    TakeControl | KeepAlive | ReleaseControl | HandOver | TakeClock | ReleaseClock | MoveJ | MoveL
    | MoveC | MovePath | MoveTrajectory | ServoJ | SpeedJ | SpeedL | StopJ | StopL | ForceMode | Freedrive
    | EndForceMode | ZeroFtsensor | SetExternalWrench | ServoStart | ServoStop | Stop | Pause | Resume | SetShaper
    | SetEstimator | SetPayload | Forget | SetSpeed | SetIo | SetRegisters | SetTcp | InverseKinematics
    | ForwardKinematics | ProgramLoad | ProgramRun | ProgramPlay | ProgramPause | ProgramStop
    | ProgramClosePopup | ProgramInterpret | ProgramSkip | PowerOn | PowerOff | UnlockProtectiveStop
    | RestartSafety | SimulationReset | SimulationStep | SimulationInject | SimulationSetInputs
)  # fmt: skip


class Setpoint(Leased, frozen=True, kw_only=True, tag="setpoint"):
    """One set-point of a stream; it is put and not answered."""

    sequence: Sequence
    """Number of the set-point, from 0 after each `servo_start`; gaps are allowed."""
    q: Joints
    """Set-point, one angle per joint [rad]."""


def _check_plain(value: object, where: str, depth: int) -> None:
    if depth < 0:
        why = f"{where} is nested too deeply: must have at most {CALIBRATION_DEPTH} levels"
        raise ProtocolError("out_of_range", where, why, CALIBRATION_DEPTH)
    if isinstance(value, float):
        if not isfinite(value):
            raise ProtocolError("out_of_range", where, f"{where} is {value}: must be a finite number")
    elif isinstance(value, dict):
        for key, entry in value.items():
            if not isinstance(key, str):
                raise ProtocolError(
                    "malformed", where, f"{where} has a key that is not a string: {key!r:.40}"
                )
            _check_plain(entry, f"{where}.{short(key)}", depth - 1)
    elif isinstance(value, list | tuple):
        for index, entry in enumerate(value):
            _check_plain(entry, f"{where}[{index}]", depth - 1)
    elif value is not None and not isinstance(value, bool | int | str):
        why = f"{where} is a {type(value).__name__}: must be what JSON can express"
        raise ProtocolError("malformed", where, why)

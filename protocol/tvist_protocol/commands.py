"""What a client sends: commands, and set-points.

A constructor does not validate; `tvist_protocol.codec.check` does, and the server does with every message.
"""

from math import isfinite
from typing import Annotated, Any

from msgspec import Meta, Struct

from tvist_protocol.client_message import ClientMessage
from tvist_protocol.errors import ProtocolError, short
from tvist_protocol.io import SetIo, SetRegisters, SetTcp, SimulationSetInputs
from tvist_protocol.programs import ProgramLoad, ProgramPause, ProgramPlay, ProgramStop
from tvist_protocol.values import (
    PROTOCOL_VERSION,
    Acceleration,
    ClientName,
    DampingRatios,
    Fraction,
    Frequencies,
    Inertia6,
    Jerk,
    Joints,
    Lease,
    Mass,
    ModeCount,
    Name,
    Payload,
    Period,
    ResetMode,
    Seed,
    Sequence,
    Ticks,
    Token,
    Vec3,
    Velocity,
    Version,
)

CALIBRATION_DEPTH = 16
"""Levels of maps and lists a calibration may have: more than any needs, few enough to walk without care."""


class TakeControl(ClientMessage, frozen=True, kw_only=True, tag="take_control"):
    """Take the lease; answered by `accepted` with `token` and `lease_s`."""

    client: ClientName
    """Who asks: shown to the others while it holds control."""
    lease_s: Lease = 30.0
    """How long control lasts without a command [s]."""
    protocol: Version = PROTOCOL_VERSION
    """Version of the protocol the client speaks."""


class KeepAlive(ClientMessage, frozen=True, kw_only=True, tag="keep_alive"):
    """Renew the lease; send one every `lease_s`/3."""

    token: Token
    """Names the lease."""


class ReleaseControl(ClientMessage, frozen=True, kw_only=True, tag="release_control"):
    """Give the lease back."""

    token: Token
    """Names the lease."""


class HandOver(ClientMessage, frozen=True, kw_only=True, tag="hand_over"):
    """Give the lease to another client, without a moment in which nobody has it."""

    token: Token
    """Names the lease."""
    client: ClientName
    """Who shall have control."""


class TakeClock(ClientMessage, frozen=True, kw_only=True, tag="take_clock"):
    """Take the clock, where time does not pass by itself; answered by `accepted` with the `token` of its steps."""

    client: ClientName
    """Who asks: shown to the others while it holds the clock."""
    protocol: Version = PROTOCOL_VERSION
    """Version of the protocol the client speaks."""


class ReleaseClock(ClientMessage, frozen=True, kw_only=True, tag="release_clock"):
    """Give the clock back; who has control may let time pass again."""

    token: Token
    """Names the hold of the clock."""


class MoveJ(ClientMessage, frozen=True, kw_only=True, tag="move_j"):
    """Move to a joint configuration, all joints in phase; answered by `accepted` with `id`, then events."""

    token: Token
    """Names the lease."""
    q: Joints
    """Target, one angle a joint [rad]."""
    velocity: Velocity = 1.5
    """Largest velocity of any joint [rad/s]."""
    acceleration: Acceleration = 2.0
    """Largest acceleration of any joint [rad/s²]."""
    jerk: Jerk = 100.0
    """Largest jerk of any joint [rad/s³]."""


class ServoStart(ClientMessage, frozen=True, kw_only=True, tag="servo_start"):
    """Begin to follow a stream of set-points."""

    token: Token
    """Names the lease."""
    period: Period = 0.002
    """Time between two set-points [s]."""
    velocity: Velocity = 1.5
    """Velocity beyond which the stream is limited [rad/s]."""
    acceleration: Acceleration = 2.0
    """Acceleration beyond which the stream is limited [rad/s²]."""
    jerk: Jerk = 100.0
    """Jerk beyond which the stream is limited [rad/s³]."""


class ServoStop(ClientMessage, frozen=True, kw_only=True, tag="servo_stop"):
    """End the stream of set-points and come to rest."""

    token: Token
    """Names the lease."""


class Stop(ClientMessage, frozen=True, kw_only=True, tag="stop"):
    """Come to rest now, past the shaper; anyone may."""

    token: Token | None = None
    """Names the lease, where the client has one."""
    deceleration: Acceleration | None = None
    """Largest deceleration of any joint [rad/s²]; null: what the torque allows."""


class Pause(ClientMessage, frozen=True, kw_only=True, tag="pause"):
    """Hold the motion, to be resumed."""

    token: Token
    """Names the lease."""


class Resume(ClientMessage, frozen=True, kw_only=True, tag="resume"):
    """Go on with a paused motion."""

    token: Token
    """Names the lease."""


class SetShaper(ClientMessage, frozen=True, kw_only=True, tag="set_shaper"):
    """Choose the input shaper."""

    token: Token
    """Names the lease."""
    name: Name
    """Its name, one of those in `info`; `none` does not shape."""
    modes: ModeCount = 1
    """How many modes it shall cancel, the lowest first."""


class SetEstimator(ClientMessage, frozen=True, kw_only=True, tag="set_estimator", gc=True):
    """Choose where the shaper's frequency and damping come from."""

    token: Token
    """Names the lease."""
    name: Name
    """`fixed` (with `f_d` and `zeta`), `polynomial` or `modal` (with `calibration`)."""
    f_d: Frequencies | None = None
    """Damped frequency of each mode [Hz]."""
    zeta: DampingRatios | None = None
    """Damping ratio of each mode [-]."""
    calibration: Name | dict[str, Any] | None = None
    """Name of one of those in `info`, or the content as a map; never a path."""

    def __post_init__(self) -> None:
        """Refuse what a calibration cannot hold; its meaning is the server's to check.

        Raises:
            ProtocolError: A number that is not finite, a key that is no string, a value of a type that JSON
                does not have, or more than `CALIBRATION_DEPTH` levels.
        """
        if isinstance(self.calibration, dict):
            _check_plain(self.calibration, "calibration", CALIBRATION_DEPTH)


class SetPayload(ClientMessage, frozen=True, kw_only=True, tag="set_payload"):
    """Declare what hangs on the flange: what the controller believes, not what the simulated arm carries."""

    token: Token
    """Names the lease."""
    mass: Mass
    """Mass [kg]."""
    com: Vec3
    """Centre of mass in the flange frame [m]."""
    inertia: Inertia6
    """Inertia xx xy xz yy yz zz about the centre of mass, flange axes [kg m²]."""


class SetSpeed(ClientMessage, frozen=True, kw_only=True, tag="set_speed"):
    """Scale the speed of what moves."""

    token: Token
    """Names the lease."""
    fraction: Fraction
    """Share of the programmed speed [-]."""


class PowerOn(ClientMessage, frozen=True, kw_only=True, tag="power_on"):
    """Power the arm and release its brakes."""

    token: Token
    """Names the lease."""
    release_brakes: bool = True
    """False: an arm without power is only powered, and the brakes go on holding it."""


class PowerOff(ClientMessage, frozen=True, kw_only=True, tag="power_off"):
    """Take the arm's power; what moves is stopped before."""

    token: Token
    """Names the lease."""


class UnlockProtectiveStop(ClientMessage, frozen=True, kw_only=True, tag="unlock_protective_stop"):
    """Leave a protective stop, once the arm rests."""

    token: Token
    """Names the lease."""


class RestartSafety(ClientMessage, frozen=True, kw_only=True, tag="restart_safety"):
    """Restart the safety system after a violation or a fault; the arm is without power then."""

    token: Token
    """Names the lease."""


class SimulationReset(ClientMessage, frozen=True, kw_only=True, tag="simulation.reset"):
    """Put the simulated arm somewhere at rest; what is null stays. Stops motion, keeps lease and tick."""

    token: Token
    """Names the lease."""
    q: Joints | None = None
    """Where to put it, one angle a joint [rad]."""
    seed: Seed | None = None
    """Seed of the sensors' noise, which starts anew."""
    payload: Payload | None = None
    """What the arm carries, whatever the controller believes."""
    mode: ResetMode | None = None
    """Robot mode to put it into; any of them ends protective, safeguard and emergency stops, violations and faults."""
    shaper: Name | None = None
    """Shaper to choose, as `set_shaper` does."""


class StepSetpoint(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, gc=False):
    """One set-point inside a `simulation.step`."""

    sequence: Sequence
    """Number from 0 with each `servo_start`; gaps allowed."""
    q: Joints
    """Where to be, one angle a joint [rad]."""


class SimulationStep(ClientMessage, frozen=True, kw_only=True, tag="simulation.step", omit_defaults=True):
    """Let time pass in a simulation that does not tick by itself; `done` has the last `tick` that passed."""

    token: Token
    """Names the hold of the clock; where nobody holds it, the lease."""
    ticks: Ticks
    """How many control periods of 0.002 s."""
    setpoints: Annotated[tuple[StepSetpoint, ...], Meta(max_length=1000)] | None = None
    """Set-points, one a tick in order."""
    motion_token: Token | None = None
    """Names the lease; `setpoints` need it where `token` names the hold of the clock."""


class SimulationInject(ClientMessage, frozen=True, kw_only=True, tag="simulation.inject"):
    """Cause one of the [faults](#faults) on purpose."""

    token: Token
    """Names the lease."""
    fault: Name
    """Its name."""
    joint: Annotated[int, Meta(ge=0, le=6)] | None = None
    """Joint that it concerns, from the base on."""
    seconds: Annotated[float, Meta(ge=0, le=3600)] | None = None
    """How long it lasts [s]."""
    value: Annotated[float, Meta(ge=-1e6, le=1e6)] | None = None
    """How strong it is, in the fault's own unit."""


Command = (
    TakeControl
    | KeepAlive
    | ReleaseControl
    | HandOver
    | TakeClock
    | ReleaseClock
    | MoveJ
    | ServoStart
    | ServoStop
    | Stop
    | Pause
    | Resume
    | SetShaper
    | SetEstimator
    | SetPayload
    | SetSpeed
    | SetIo
    | SetRegisters
    | SetTcp
    | ProgramLoad
    | ProgramPlay
    | ProgramPause
    | ProgramStop
    | PowerOn
    | PowerOff
    | UnlockProtectiveStop
    | RestartSafety
    | SimulationReset
    | SimulationStep
    | SimulationInject
    | SimulationSetInputs
)


class Setpoint(ClientMessage, frozen=True, kw_only=True, tag="setpoint"):
    """One set-point of a stream: put, never answered."""

    token: Token
    """Names the lease."""
    sequence: Sequence
    """Number from 0 with each `servo_start`; gaps allowed."""
    q: Joints
    """Where to be, one angle a joint [rad]."""


def _check_plain(value: object, where: str, depth: int) -> None:
    if depth < 0:
        why = f"{where} is nested more than {CALIBRATION_DEPTH} levels deep"
        raise ProtocolError("out_of_range", where, why, CALIBRATION_DEPTH)
    if isinstance(value, float):
        if not isfinite(value):
            raise ProtocolError("out_of_range", where, f"{where} is {value}, not a finite number")
    elif isinstance(value, dict):
        for key, entry in value.items():
            if not isinstance(key, str):
                raise ProtocolError("malformed", where, f"{where} has a key that is no string: {key!r:.40}")
            _check_plain(entry, f"{where}.{short(key)}", depth - 1)
    elif isinstance(value, list | tuple):
        for index, entry in enumerate(value):
            _check_plain(entry, f"{where}[{index}]", depth - 1)
    elif value is not None and not isinstance(value, bool | int | str):
        why = f"{where} is a {type(value).__name__}, which a calibration cannot hold"
        raise ProtocolError("malformed", where, why)

"""Commands that only a simulated robot carries out: its state, its time and its faults."""

from typing import Annotated

from msgspec import Meta, Struct

from tvist_protocol.client_message import ClientMessage, Leased
from tvist_protocol.values import Joints, Name, Payload, ResetMode, Seed, Sequence, Ticks, Token


class SimulationReset(Leased, frozen=True, kw_only=True, tag="simulation.reset"):
    """Put the simulated arm at rest in a given state; null fields do not change. Stops motion, keeps lease and tick."""

    q: Joints | None = None
    """Configuration to put the arm into, one angle per joint [rad]; refused if bodies would meet there."""
    seed: Seed | None = None
    """New seed of the sensors' noise."""
    payload: Payload | None = None
    """Payload that the arm carries, independent of the declared one; refused if it would meet a body."""
    mode: ResetMode | None = None
    """Robot mode to set; this ends protective, safeguard and emergency stops, violations and faults."""
    shaper: Name | None = None
    """Shaper to select, as `set_shaper` does."""


class StepSetpoint(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, gc=False):
    """One set-point inside a `simulation.step`."""

    sequence: Sequence
    """Number of the set-point, from 0 after each `servo_start`; gaps are allowed."""
    q: Joints
    """Set-point, one angle per joint [rad]."""


class SimulationStep(ClientMessage, frozen=True, kw_only=True, tag="simulation.step", omit_defaults=True):
    """Step the time of a robot in lockstep; `done` has the last `tick` of the step."""

    token: Token
    """Token of the clock; if no client holds the clock, token of the lease."""
    ticks: Ticks
    """Number of control periods of 0.002 s."""
    setpoints: Annotated[tuple[StepSetpoint, ...], Meta(max_length=1000)] | None = None
    """Set-points in order, one per tick."""
    motion_token: Token | None = None
    """Token of the lease; `setpoints` need it if `token` is that of the clock."""


class SimulationInject(Leased, frozen=True, kw_only=True, tag="simulation.inject"):
    """Cause one of the faults on purpose."""

    fault: Name
    """Name of the fault."""
    joint: Annotated[int, Meta(ge=0, le=6)] | None = None
    """Index of the joint that it affects, 0 for the base."""
    seconds: Annotated[float, Meta(ge=0, le=3600)] | None = None
    """Duration of the fault [s]."""
    value: Annotated[float, Meta(ge=-1e6, le=1e6)] | None = None
    """Magnitude of the fault, in the fault's own unit."""

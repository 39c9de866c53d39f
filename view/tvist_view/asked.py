"""Messages that a tab may send."""

from typing import Annotated

import msgspec
from msgspec import Meta, Struct

Mass = Annotated[float, Meta(ge=0.0, le=1e4)]


class Asked(Struct, tag_field="do", frozen=True, forbid_unknown_fields=True):
    """A message of a tab."""


class Seen(Asked, tag="seen", frozen=True):
    """The tab has drawn the last frame and is ready for the next one."""


class Stop(Asked, tag="stop", frozen=True):
    """Stop the arm, no matter which client moves it."""


class Take(Asked, tag="take", frozen=True):
    """Take control for this tab."""


class Give(Asked, tag="give", frozen=True):
    """Give control back."""


class Show(Asked, tag="robot", frozen=True):
    """Show another robot."""

    name: Annotated[str, Meta(min_length=1, max_length=200)]


class Move(Asked, tag="move", frozen=True):
    """Go to the named pose `first`, unless the arm is there, and on to `last`."""

    first: str
    last: str


class Compare(Asked, tag="compare", frozen=True):
    """Run a motion without and with a shaper."""

    first: str
    last: str
    shaper: str


class Jog(Asked, tag="jog", frozen=True):
    """Jog a joint for a moment; the page repeats the message while its button is down."""

    joint: Annotated[int, Meta(ge=0)]
    direction: Annotated[float, Meta(ge=-1.0, le=1.0)]


class Shape(Asked, tag="shape", frozen=True):
    """Choose the shaper and its number of modes, even while the arm moves; None keeps the number."""

    shaper: str
    modes: Annotated[int, Meta(ge=1)] | None = None


class Speed(Asked, tag="speed", frozen=True):
    """Set the speed slider, even while the arm moves."""

    fraction: Annotated[float, Meta(ge=0.0, le=1.0)]


class Declare(Asked, tag="declare", frozen=True):
    """Declare a payload mass [kg], even while the arm moves."""

    mass: Mass


class Carry(Asked, tag="carry", frozen=True):
    """Let the simulated arm, which must be at rest, carry a mass [kg]."""

    mass: Mass


class Fault(Asked, tag="fault", frozen=True):
    """Cause a fault."""

    name: str


class Ready(Asked, tag="ready", frozen=True):
    """Release the stops that a client can release, and switch the power on."""


Message = (
    Seen | Stop | Take | Give | Show | Move | Compare | Jog | Shape | Speed | Declare | Carry | Fault | Ready
)
read = msgspec.json.Decoder(Message).decode
"""Decodes a message; raises `msgspec.ValidationError` or `msgspec.DecodeError`."""

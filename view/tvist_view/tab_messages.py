"""Messages that a tab may send."""

from typing import Annotated

import msgspec
from msgspec import Meta, Struct

Mass = Annotated[float, Meta(ge=0.0, le=1e4)]


class TabMessage(Struct, tag_field="do", frozen=True, forbid_unknown_fields=True):
    """A message of a tab."""


class Seen(TabMessage, tag="seen", frozen=True):
    """The tab has drawn the last frame and is ready for the next one."""


class Stop(TabMessage, tag="stop", frozen=True):
    """Stop the arm, no matter which client moves it."""


class Take(TabMessage, tag="take", frozen=True):
    """Take control for this tab."""


class Give(TabMessage, tag="give", frozen=True):
    """Give control back."""


class Show(TabMessage, tag="robot", frozen=True):
    """Show another robot."""

    name: Annotated[str, Meta(min_length=1, max_length=200)]


class Move(TabMessage, tag="move", frozen=True):
    """Go to the named pose `first`, unless the arm is there, and on to `last`."""

    first: str
    last: str


class Compare(TabMessage, tag="compare", frozen=True):
    """Run a motion without and with a shaper."""

    first: str
    last: str
    shaper: str


class Jog(TabMessage, tag="jog", frozen=True):
    """Jog a joint for a moment; the page repeats the message while its button is down."""

    joint: Annotated[int, Meta(ge=0)]
    direction: Annotated[float, Meta(ge=-1.0, le=1.0)]


class Shape(TabMessage, tag="shape", frozen=True):
    """Choose the shaper and its number of modes, even while the arm moves; None keeps the number."""

    shaper: str
    modes: Annotated[int, Meta(ge=1)] | None = None


class Speed(TabMessage, tag="speed", frozen=True):
    """Set the speed slider, even while the arm moves."""

    fraction: Annotated[float, Meta(ge=0.0, le=1.0)]


class Declare(TabMessage, tag="declare", frozen=True):
    """Declare a payload mass [kg], even while the arm moves."""

    mass: Mass


class Carry(TabMessage, tag="carry", frozen=True):
    """Let the simulated arm, which must be at rest, carry a mass [kg]."""

    mass: Mass


class Fault(TabMessage, tag="fault", frozen=True):
    """Cause a fault."""

    name: str


class Ready(TabMessage, tag="ready", frozen=True):
    """Release the stops that a client can release, and switch the power on."""


Message = (
    Seen | Stop | Take | Give | Show | Move | Compare | Jog | Shape | Speed | Declare | Carry | Fault | Ready
)
read = msgspec.json.Decoder(Message).decode
"""Decodes a message; raises `msgspec.ValidationError` or `msgspec.DecodeError`."""

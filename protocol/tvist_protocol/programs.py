"""Commands of the program that a robot has loaded."""

from typing import Annotated, Literal

from msgspec import Meta

from tvist_protocol.client_message import ClientMessage
from tvist_protocol.values import Token

ProgramState = Literal["STOPPED", "PLAYING", "PAUSED"]
"""State of the loaded program."""
ProgramName = Annotated[str, Meta(min_length=1, max_length=256)]


class ProgramLoad(ClientMessage, frozen=True, kw_only=True, tag="program.load"):
    """Load a program; a running program and the arm are stopped first. Any client may send this."""

    name: ProgramName
    """Name of the program, one of `programs` in `info`."""
    token: Token | None = None
    """Token of the lease, if the client has one."""


class ProgramPlay(ClientMessage, frozen=True, kw_only=True, tag="program.play"):
    """Start the loaded program, or continue it if it is paused. It ends with the lease."""

    token: Token
    """Token of the lease."""


class ProgramPause(ClientMessage, frozen=True, kw_only=True, tag="program.pause"):
    """Pause the program and its motion, so that they can be continued."""

    token: Token
    """Token of the lease."""


class ProgramStop(ClientMessage, frozen=True, kw_only=True, tag="program.stop"):
    """Stop the program and any motion of the arm; any client may send this."""

    token: Token | None = None
    """Token of the lease, if the client has one."""

"""Commands of the program that a robot has loaded."""

from typing import Annotated, Literal

from msgspec import Meta

from tvist_protocol.client_message import ClientMessage
from tvist_protocol.values import Token

ProgramState = Literal["STOPPED", "PLAYING", "PAUSED"]
"""What the loaded program does."""
ProgramName = Annotated[str, Meta(min_length=1, max_length=256)]


class ProgramLoad(ClientMessage, frozen=True, kw_only=True, tag="program.load"):
    """Load a program; the one that runs is stopped, and the arm with it. Anyone may."""

    name: ProgramName
    """One of `programs` in `info`."""
    token: Token | None = None
    """Names the lease, where the client has one."""


class ProgramPlay(ClientMessage, frozen=True, kw_only=True, tag="program.play"):
    """Start the loaded program, or go on with a paused one. It ends with the lease."""

    token: Token
    """Names the lease."""


class ProgramPause(ClientMessage, frozen=True, kw_only=True, tag="program.pause"):
    """Hold the program and its motion, to be played again."""

    token: Token
    """Names the lease."""


class ProgramStop(ClientMessage, frozen=True, kw_only=True, tag="program.stop"):
    """Stop the program, and the arm whatever moves it; anyone may."""

    token: Token | None = None
    """Names the lease, where the client has one."""

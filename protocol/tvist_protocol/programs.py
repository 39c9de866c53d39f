"""Commands of the program that a robot has loaded."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from tvist_protocol.client_message import ClientMessage, Leased
from tvist_protocol.values import PROGRAM_NAME_PATTERN, Token

ProgramState = Literal["STOPPED", "PLAYING", "PAUSED"]  # state of the loaded program
ProgramName = Annotated[str, Meta(pattern=PROGRAM_NAME_PATTERN)]


MAX_SCRIPT = 1 << 20  # longest text of a program [characters]
Script = Annotated[str, Meta(min_length=1, max_length=MAX_SCRIPT)]  # text of a program in URScript


class ProgramLoad(ClientMessage, frozen=True, kw_only=True, tag="program.load", omit_defaults=True):
    """Load a program; a running program and the arm are stopped first. Any client may send this."""

    name: ProgramName
    """Name of the program: one of `programs` in `info`, or any other if `text` is given."""
    text: Script | None = None
    """Text of the program in URScript, which the robot keeps under this name; null: the one that it has."""
    token: Token | None = None
    """Token of the lease, if the client has one."""


class ProgramRun(Leased, frozen=True, kw_only=True, tag="program.run"):
    """Start a program in URScript at once.

    It replaces the running program, or runs beside it if it is secondary (`sec`). It ends with the lease.
    """

    text: Script
    """Text of the program, which contains its name."""


class ProgramInterpret(Leased, frozen=True, kw_only=True, tag="program.interpret"):
    """Add a line of statements to the running program, which must call `interpreter_mode`.

    The reply has its number. The program executes lines in order while it waits in that function.
    """

    text: Script
    """Text of the statements, or of a function for later ones; it can use what the program and earlier lines define."""


class ProgramSkip(Leased, frozen=True, kw_only=True, tag="program.skip"):
    """Skip statements or a motion of a program in `interpreter_mode`."""

    what: Literal["statements", "move"]
    """All statements that have not started, or the rest of the present planned motion."""


class Interpreter(Struct, frozen=True, kw_only=True):
    """Statements that clients have added to a program, by their numbers, which start at 1."""

    interpreted: int = 0
    """Last statement that was accepted."""
    executed: int = 0
    """Last statement that has started."""
    cleared: int = 0
    """Last statement whose variables and functions the program has discarded."""
    waiting: int = 0
    """Number of statements that have not started."""


class ProgramLabel(Struct, frozen=True, kw_only=True):
    """A label of a program, such as `$ 3 "Waypoint_1"`: a line of the program tree that it was generated from."""

    number: int
    """Its number."""
    name: str
    """Its name."""


class ProgramClosePopup(ClientMessage, frozen=True, kw_only=True, tag="program.close_popup"):
    """Close the message that a program shows and may be waiting for. Any client may send this."""


class ProgramPlay(Leased, frozen=True, kw_only=True, tag="program.play"):
    """Start the loaded program, or continue it if it is paused. It ends with the lease."""


class ProgramPause(Leased, frozen=True, kw_only=True, tag="program.pause"):
    """Pause the program and its motion, so that they can be continued."""


class ProgramStop(ClientMessage, frozen=True, kw_only=True, tag="program.stop"):
    """Stop the program and any motion of the arm; any client may send this."""

    token: Token | None = None
    """Token of the lease, if the client has one."""

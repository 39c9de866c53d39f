"""Errors of the protocol.

TvistError
├── ProtocolError   the message is invalid for any robot
└── RefusedError    the message is valid, but the robot refused it
"""

import re
from typing import Final

from tvist_protocol.replies import Code, Refused

SHOWN = 60  # largest number of characters of a sender's text that a message repeats
LONGEST = 900  # largest number of characters of a message about a file
HARMFUL: Final = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters, which can start terminal commands; characters that change text direction; non-characters."""


class TvistError(Exception):
    """Base of the errors that users of these packages may want to catch."""


class ProtocolError(TvistError):
    """An invalid message.

    Not a `ValueError`, because msgspec would replace one that is raised while a message is built.

    Attributes:
        code: Reason, one of the protocol's codes.
        where: Field at fault, such as `q[3]` or `payload.mass`; empty for the whole message.
        why: Message with field, value and limit.
        limit: Limit that was exceeded, in the field's unit; None if there is none.
    """

    def __init__(self, code: Code, where: str, why: str, limit: float | None = None) -> None:
        super().__init__(code, where, why, limit)
        self.code = code
        self.where = where
        self.why = why
        self.limit = limit

    def __str__(self) -> str:
        return f"{self.code}: {self.why}"


class RefusedError(TvistError):
    """A robot refused a command, which changed nothing; `reply` is the refusal."""

    def __init__(self, reply: Refused) -> None:
        super().__init__(reply)
        self.reply = reply

    def __str__(self) -> str:
        return f"{self.reply.code}: {self.reply.why}"


def harmless(text: str) -> str:
    """Make a text of unknown origin safe for a terminal; line feeds and tabs remain."""
    return HARMFUL.sub("\N{REPLACEMENT CHARACTER}", text)


def short(text: str, most: int = SHOWN) -> str:
    """Make a sender's text safe for a message: printable and shortened."""
    shown = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text[:most])
    return shown if len(text) <= most else f"{shown}…"


def one_line(text: str) -> str:
    """Make a message that quotes a file safe to show: one printable line, shortened."""
    return short(re.sub(r"\s", " ", text), LONGEST)


def quoted(value: object) -> str:
    """Make a sender's value safe for a message: its repr, shortened."""
    return short(repr(value))

"""Errors of the protocol, by who is at fault.

TvistError
├── ProtocolError   the message is not one: the sender's fault, seen without knowing the robot
└── RefusedError    the message was understood and declined by the robot
"""

from tvist_protocol.replies import Code, Refused

SHOWN = 60
"""Characters of a sender's text that a sentence repeats."""


class TvistError(Exception):
    """Root of every error a user of these packages may want to catch."""


class ProtocolError(TvistError):
    """Bytes or values that are no valid message.

    Deliberately no `ValueError`: msgspec would rewrite one that is raised while a message is built.

    Attributes:
        code: What is wrong, one of the protocol's codes.
        where: The field at fault in plain form, `q[3]`, `payload.mass`; empty where it is the whole message.
        why: A sentence with field, value and limit.
        limit: The bound that was passed, in the field's unit; None where there is none.
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
    """A robot refused a command, which therefore changed nothing.

    Attributes:
        reply: The refusal as it came.
    """

    def __init__(self, reply: Refused) -> None:
        super().__init__(reply)
        self.reply = reply

    def __str__(self) -> str:
        return f"{self.reply.code}: {self.reply.why}"


def short(text: str) -> str:
    """A sender's text as a sentence repeats it: printable, and cut."""
    shown = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text[:SHOWN])
    return shown if len(text) <= SHOWN else f"{shown}…"


def quoted(value: object) -> str:
    """A sender's value as a sentence repeats it: as Python writes it, and cut."""
    return short(repr(value))

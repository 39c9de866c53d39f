"""Decoding of answers, with an error that says what may be wrong."""

from collections.abc import Callable
from typing import TypeVar

from tvist_client.errors import UnexpectedReplyError
from tvist_protocol.errors import ProtocolError

T = TypeVar("T")


def understood(decode: Callable[[bytes], T], data: bytes) -> T:
    """Decode an answer.

    Raises:
        UnexpectedReplyError: The answer is invalid.
    """
    try:
        return decode(data)
    except ProtocolError as error:
        why = f"the robot's answer is invalid, perhaps because it uses a newer protocol: update the client ({error})"
        raise UnexpectedReplyError(why) from error

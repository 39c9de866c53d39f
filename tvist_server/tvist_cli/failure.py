"""How a command ends badly: one sentence, and an exit code."""

from collections.abc import Iterator
from contextlib import contextmanager

from tvist_client.errors import ClientError
from tvist_protocol.errors import TvistError


class Failure(Exception):  # noqa: N818  what a person calls it
    """A sentence for the person at the terminal; exit code 1 for failure, 2 for misuse."""

    def __init__(self, why: str, *, code: int = 1) -> None:
        super().__init__(why)
        self.code = code


@contextmanager
def told(*errors: type[Exception], code: int = 1) -> Iterator[None]:
    """Errors of these kinds, and those of client and protocol, become a failure with their sentence."""
    kinds: tuple[type[Exception], ...] = (*errors, ClientError, TvistError)
    try:
        yield
    except kinds as error:
        raise Failure(str(error), code=code) from error

"""How a command ends badly: one sentence, and an exit code."""

from collections.abc import Iterator
from contextlib import contextmanager

from tvist_client.errors import ClientError
from tvist_plant.user_file import UserFileError
from tvist_protocol.errors import ProtocolError, TvistError


class Failure(Exception):  # noqa: N818  what a person calls it
    """A sentence for the person at the terminal; exit code 1 for failure, 2 for misuse, 130 for Control+C."""

    def __init__(self, why: str, *, code: int = 1) -> None:
        super().__init__(why)
        self.code = code


def interrupted(what: str) -> Failure:
    """Control+C came: what was done until then, and what was not.

    Args:
        what: Such as "the motion was stopped; the robot is at rest".
    """
    return Failure(f"interrupted: {what}", code=130)


@contextmanager
def told(*errors: type[Exception], code: int = 1) -> Iterator[None]:
    """Errors of these kinds, and those of client and protocol, become a failure with their sentence.

    A file that is there and is not what is asked for is a failure, exit code 1, whatever the others are.
    """
    kinds: tuple[type[Exception], ...] = (*errors, ClientError, TvistError)
    try:
        yield
    except UserFileError as error:
        raise Failure(str(error)) from error
    except kinds as error:
        raise Failure(_sentence(error), code=code) from error


def _sentence(error: Exception) -> str:
    """A refusal keeps its code, which programs look for; a fault found here has nobody to tell it to."""
    if isinstance(error, ProtocolError):
        return error.why
    if type(error).__module__ == "builtins" and isinstance(error, OSError) and error.strerror:
        return error.strerror if error.filename is None else f"{error.filename}: {error.strerror}"
    return str(error)

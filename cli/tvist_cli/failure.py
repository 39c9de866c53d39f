"""How a command reports a failure: a message and an exit code."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from tvist_plant.user_file import UserFileError
from tvist_protocol.errors import ProtocolError, TvistError, one_line
from tvist_server.option_values import StartError


class Failure(Exception):  # noqa: N818  the plain word for it
    """A message for the user and an exit code: 1 for a failure, 2 for misuse, 130 for Control+C."""

    def __init__(self, why: str, *, code: int = 1) -> None:
        super().__init__(why)
        self.code = code


class Misuse(Failure):
    """A wrong command line."""

    def __init__(self, why: str) -> None:
        super().__init__(why, code=2)


def interrupted(what: str) -> Failure:
    """Return the failure for Control+C; `what` is the part of its message on what was done and what not."""
    return Failure(f"interrupted: {what}", code=130)


@contextmanager
def interruptible(what: str) -> Iterator[None]:
    """Within the body, turn Control+C into the failure of `interrupted`."""
    try:
        yield
    except KeyboardInterrupt:
        raise interrupted(what) from None


def check_range(
    name: str, value: float | None, low: float, high: float = math.inf, unit: str = "", *, above: bool = False
) -> None:
    """Refuse an option's value outside `low` to `high`, with `above` also `low`; accept None (not given)."""
    if value is None or (low <= value <= high and not (above and value == low)):
        return
    least = f"{'more than' if above else 'at least'} {low:g}"
    said = f"{value:g}" if isinstance(value, float) else f"{value}"
    raise Misuse(
        f"{name} is {said}{unit}: must be {least if high == math.inf else f'{low:g} to {high:g}'}{unit}"
    )


@contextmanager
def failing_on(*errors: type[Exception], exit_code: int = 1, where: str = "") -> Iterator[None]:
    """Turn these errors, tvist's own and those of robot options into a `Failure` with the same message.

    The exit code is `exit_code`, except: 1 for a file with wrong content; 2 for an invalid option of a
    robot, unless `errors` contains `StartError`. `where` precedes the message. If `where` is given, a
    `Failure` in the body is changed in the same way.
    """
    kinds: tuple[type[Exception], ...] = (*errors, TvistError, StartError)
    kinds += (Failure,) if where else ()
    try:
        yield
    except UserFileError as error:
        raise Failure(f"{where}{one_line(str(error))}") from error
    except kinds as error:
        code = 2 if isinstance(error, StartError) and StartError not in errors else exit_code
        raise Failure(f"{where}{one_line(_message(error))}", code=code) from error


def _message(error: Exception) -> str:
    """Return the message without the code that a protocol error carries for a remote client."""
    if isinstance(error, ProtocolError):
        return error.why
    if isinstance(error, FileExistsError) and error.filename is not None:
        return f"{error.filename} exists already and is no folder: choose another name"
    if type(error).__module__ == "builtins" and isinstance(error, OSError) and error.strerror:
        return error.strerror if error.filename is None else f"{error.filename}: {error.strerror}"
    return str(error)

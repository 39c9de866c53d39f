"""Explain a wrong command line in one message with the next step."""

import math
import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from cyclopts import (
    CoercionError,
    CycloptsError,
    MissingArgumentError,
    UnknownCommandError,
    UnknownOptionError,
)
from cyclopts.exceptions import RepeatArgumentError, UnusedCliTokensError, ValidationError

from tvist_protocol.errors import quoted, short

if TYPE_CHECKING:
    from cyclopts.argument import ArgumentCollection

_ANGLES = re.compile(r"-[\d.][^=/]*,.*")
_WHOLE = re.compile(r"[+-]?\d+")
_KINDS: dict[object, str] = {int: "a whole number", float: "a number", bool: "true or false"}


def readable(arguments: Iterable[str]) -> list[str]:
    """Put a space before non-option arguments that begin with a minus: angles, and `-` for standard input."""
    return [
        f" {argument}" if argument == "-" or _ANGLES.fullmatch(argument) else argument
        for argument in arguments
    ]


def lower(name: str | None) -> str | None:
    """Convert a name to lower case, so that users may type it in any case; FILE.py:NAME stays as it is."""
    return name if name is None or ".py:" in name or name.endswith(".py") else name.lower()


def check_whole(_app: Any, _commands: Any, arguments: "ArgumentCollection") -> None:
    """Refuse fractions where whole numbers are expected, because the parser would round them."""
    for argument in arguments:
        parts = (argument.hint, *get_args(argument.hint))
        if int not in (*parts, *(one for part in parts for one in get_args(part))):
            continue
        for token in argument.tokens:
            if token.value and not _WHOLE.fullmatch(token.value):  # empty: the option needs no value
                raise CoercionError(token=token, argument=argument, target_type=int)


def finite(_: Any, value: Any) -> None:
    """Refuse NaN and infinity, which no option accepts."""
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"is {value}: must be a finite number")


def message_of(error: CycloptsError, commands: Sequence[str]) -> str:
    """Return a message for a parser's error; `commands` are the names of commands possible there."""
    command = " ".join(["tvist", *(error.command_chain or ())])
    seek = f"see {command} --help"
    match error:
        case UnknownCommandError():
            name = (error.unused_tokens or [""])[0]
            said = f"there is no command {quoted(name)}: {_near(name, commands)}{seek}"
        case UnknownOptionError():
            name = error.token.keyword or error.token.value
            known = [known for argument in error.argument_collection for known in argument.names]
            near = _near(name, [known for known in known if known.startswith("--")])
            said = (
                f"{short(name)} comes after --, where nothing counts as an option: give it before --"
                if name in known
                else f"{command} has no option {short(name)}: {near}{seek}"
            )
        case CoercionError():
            given = "" if error.token is None else f" is {quoted(error.token.value)}"
            said = f"{_name(error)}{given}: must be {_wanted(error.target_type)}"
        case RepeatArgumentError():
            said = f"{_name(error)} is given twice: give it once"
        case ValidationError():
            said = f"{_name(error)} {error.exception_message}"
        case MissingArgumentError() if error.keyword:
            said = f"{error.keyword} needs a value: {seek}"
        case MissingArgumentError():
            said = f"{_name(error)} is missing: {seek}"
        case UnusedCliTokensError():
            extra = " ".join(error.unused_tokens or ())
            said = f"{command} does not accept {quoted(extra)}: {seek}"
        case _:
            said = f"{' '.join(str(error).split())}: {seek}"
    return said


def _near(name: str, known: Sequence[str]) -> str:
    found = get_close_matches(name, known, n=1)
    return f"did you mean {found[0]}? " if found else ""


def _name(error: CycloptsError) -> str:
    token = getattr(error, "token", None)
    if token is not None and token.keyword:
        return str(token.keyword)
    if error.argument is None:
        return "a value"
    name = str(error.argument.name)
    return name if error.argument.index is None else name.removeprefix("--")


def _wanted(kind: object) -> str:
    if get_origin(kind) is Literal:
        return f"one of {', '.join(map(str, get_args(kind)))}"
    return _KINDS.get(kind, "something else")

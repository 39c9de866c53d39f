"""Checks the content of files and maps; errors name the key, the value and what is allowed."""

import json
from typing import Any, NoReturn, TypeVar

import msgspec

from tvist_protocol.errors import ProtocolError
from tvist_protocol.explain import explain_content

T = TypeVar("T")


def checked(content: object, kind: type[T]) -> T:
    """Convert decoded content (maps, lists and plain values) to the expected type."""
    try:
        return msgspec.convert(content, kind)
    except msgspec.ValidationError as error:
        raise explain_content(error, content, kind) from error


def parse_json(data: bytes) -> Any:
    """Return the content of JSON text."""
    try:
        return json.loads(data.decode(), parse_constant=_no_number)
    except UnicodeDecodeError as error:
        raise ProtocolError("malformed", "", f"it is not text: byte {error.start} is not UTF-8") from error
    except json.JSONDecodeError as error:
        why = f"it is not valid JSON: line {error.lineno}, column {error.colno}: {error.msg}"
        raise ProtocolError("malformed", "", why) from error
    except ValueError as error:
        raise ProtocolError("malformed", "", "it is not valid JSON: a number has too many digits") from error
    except RecursionError as error:
        raise ProtocolError("malformed", "", "it is nested too deeply") from error


def _no_number(text: str) -> NoReturn:
    raise ProtocolError("out_of_range", "", f"it contains {text}, which is not a number")

"""Messages about errors in a robot file for its author, since msgspec describes them for programmers."""

import re
from collections.abc import Callable
from typing import Any

import msgspec

_KINDS = {
    "float": "a number", "int": "a whole number", "str": "text", "array": "a list", "object": "a table",
    "bool": "true or false", "null": "nothing",
}  # fmt: skip
_RELATIONS = {">=": "at least", "<=": "at most", ">": "more than", "<": "less than", "": "exactly"}


def in_words(error: msgspec.ValidationError, content: Any) -> str:
    """Return a message with the key, the value and the permitted values.

    Args:
        error: Error raised by msgspec.
        content: Content that was checked.
    """
    said, _, path = str(error).partition(" - at `$")
    key = path.rstrip("`").removeprefix(".")
    value = content
    for name, index in re.findall(r"([A-Za-z_][^.\[]*)|\[(\d+)\]", key):
        try:
            value = value[int(index) if index else name]
        except (TypeError, LookupError):
            value = None
    key = key.replace("[...]", ".<one of its keys>")[:200]
    for pattern, words in _RULES:
        if found := re.fullmatch(pattern, said):
            return words(key, value, *found.groups())
    return f"{key or 'the file'}: {said.replace('`', ''):.300}"


def _missing(key: str, _: Any, name: str) -> str:
    return f"{_joined(key, name)} is missing"


def _unknown(key: str, _: Any, name: str) -> str:
    return f"{_joined(key, name):.200} is not a key of a robot file"


def _bound(key: str, value: Any, relation: str, limit: str) -> str:
    return f"{key} is {value!r:.60}: must be {_RELATIONS[relation]} {float(limit):g}"


def _length(key: str, value: Any, relation: str, limit: str) -> str:
    count = len(value) if isinstance(value, list | str) else "another number of"
    return f"{key} has {count} entries: must have {_RELATIONS[relation]} {limit}"


def _kind(key: str, value: Any, wanted: str, got: str) -> str:
    found = f" is {_called(got)}, {value!r:.60}:" if key else ""
    return f"{key or 'the file'}{found} must be {_called(wanted)}"


_RULES: tuple[tuple[str, Callable[..., str]], ...] = (
    (r"Object missing required field `(.*)`", _missing),
    (r"Object contains unknown field `(.*)`", _unknown),
    (r"Expected `(?:float|int)` (>=|<=|>|<) (\S+)", _bound),
    (r"Expected `(?:array|str)` of length (>=|<=|) ?(\d+)(?:, got \d+)?", _length),
    (r"Expected `([^`]*)`, got `([^`]*)`", _kind),
)


def _joined(key: str, name: str) -> str:
    return f"{key}.{name}".removeprefix(".")


def _called(said: str) -> str:
    return " or ".join(_KINDS.get(kind, kind) for kind in said.split(" | "))

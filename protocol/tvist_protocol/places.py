"""Follows the path in an error message of msgspec to the value at its end and the type expected there."""

import re
import types
from collections.abc import Iterator
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin, get_type_hints

import msgspec

ABSENT: Final = object()  # value of a place that is missing in the content
_STEP = re.compile(r"\.([^.\[]+)|\[(\d+)\]|\[(\.\.\.)\]")


class Place:
    """The place that a path leads to in a message's content, which should have the type `kind` (None: unknown).

    msgspec writes paths as `.payload.com[2]`, and `[...]` for an entry of a map; its key is found by checking each
    entry.
    """

    def __init__(self, content: Any, kind: object, path: str) -> None:
        self.where = ""
        """The path as users read it: `payload.com[2]`, with the key in place of `[...]`."""
        self.value: Any = content
        """The value there; `ABSENT` if there is none."""
        self.kind = kind
        """The type expected there; None if it is unknown."""
        self._holder: object = None
        end = 0
        for step in _STEP.finditer(path):
            self._go(*step.groups())
            end = step.end()
        if end != len(path):
            self.where, self.value, self.kind = path.removeprefix("."), ABSENT, None

    def _go(self, name: str | None, index: str | None, any_key: str | None) -> None:
        entry = next(filter(None, (_entry_type(kind, name, index) for kind in _choices(self.kind))), None)
        if any_key is not None:
            name = _culprit(self.value, entry)
        try:
            self.value = self.value[int(index) if index is not None else name]
        except (TypeError, LookupError):
            self.value = ABSENT
        self.where += f"[{index}]" if index is not None else f".{name}"
        self.where, self._holder, self.kind = self.where.removeprefix("."), self.kind, entry

    @property
    def struct(self) -> type[msgspec.Struct] | None:
        """The expected struct, in a union that of the value's `type` or else the first; None: no struct."""
        found = list(_structs(self.kind))
        tag = self.value.get("type") if isinstance(self.value, dict) else None
        return next((kind for kind in found if kind.__struct_config__.tag == tag), next(iter(found), None))

    @property
    def tags(self) -> list[str]:
        """The valid values of `type`, if this place is the `type` of a union of structs."""
        return [str(kind.__struct_config__.tag) for kind in _structs(self._holder)]

    @property
    def literals(self) -> list[str]:
        """The strings that are valid at this place, in quotes."""
        literals = (get_args(kind) for kind in _choices(self.kind) if get_origin(kind) is Literal)
        return [repr(one) for each in literals for one in each]


def _choices(kind: object) -> Iterator[object]:
    """Yield the members of a union without `Annotated`; if the type is no union, yield the type itself."""
    origin = get_origin(kind)
    if origin is Annotated:
        yield from _choices(get_args(kind)[0])
    elif origin in {Union, types.UnionType}:
        for member in get_args(kind):
            yield from _choices(member)
    else:
        yield kind


def _structs(kind: object) -> Iterator[type[msgspec.Struct]]:
    for member in _choices(kind):
        if isinstance(member, type) and issubclass(member, msgspec.Struct):
            yield member


def _entry_type(kind: object, name: str | None, index: str | None) -> object:
    """Return the type of a field of a struct, or of an entry of a map or list; None if it has none."""
    origin, parts = get_origin(kind), get_args(kind)
    if index is not None and origin in {tuple, list}:
        return parts[0] if origin is list or parts[-1] is Ellipsis else parts[min(int(index), len(parts) - 1)]
    if index is None and origin is dict:
        return parts[1]
    if name is not None and isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        return get_type_hints(kind, include_extras=True).get(name)
    return None


def _culprit(content: Any, kind: object) -> str:
    """Return the key of a map's first entry that is not of type `kind`; `...` if all entries are."""
    for key, value in content.items() if isinstance(content, dict) else ():
        try:
            msgspec.convert(value, kind)
        except (msgspec.ValidationError, TypeError):
            return str(key)
    return "..."

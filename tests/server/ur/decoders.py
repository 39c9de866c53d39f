"""Packages taken apart as their descriptions say, by other means than those that make them."""

import struct
from dataclasses import dataclass, field


@dataclass
class Cursor:
    """Reads big-endian values one after the other."""

    data: bytes
    at: int = 0

    def take(self, kind: str):
        (value,) = struct.unpack_from(">" + kind, self.data, self.at)
        self.at += struct.calcsize(kind)
        return value

    def many(self, kind: str, count: int):
        return [self.take(kind) for _ in range(count)]

    def text(self, length: int | None = None):
        end = len(self.data) if length is None else self.at + length
        piece, self.at = self.data[self.at : end], end
        return piece.decode()

    @property
    def done(self):
        return self.at == len(self.data)


def split(stream: bytes) -> list[tuple[int, bytes]]:
    packages, cursor = [], Cursor(stream)
    while not cursor.done:
        begin = cursor.at
        length, kind = cursor.take("i"), cursor.take("B")
        assert length >= 5
        assert begin + length <= len(stream)
        packages.append((kind, stream[begin + 5 : begin + length]))
        cursor.at = begin + length
    return packages


@dataclass
class Message:
    kind: int
    time: int
    source: int
    values: dict = field(default_factory=dict)


def message(package: bytes) -> Message:
    """One robot message, to its last byte."""
    ((kind, body),) = split(package)
    assert kind == 20
    cursor = Cursor(body)
    time, source, kind = cursor.take("Q"), cursor.take("B"), cursor.take("B")
    values = _MESSAGES[kind](cursor)
    assert cursor.done
    return Message(kind, time, source, values)


def _version(c):
    name = c.text(c.take("B"))
    numbers = [c.take("B"), c.take("B"), c.take("i"), c.take("i")]
    return {"name": name, "numbers": numbers, "date": c.text()}


def _key(c):
    code, argument = c.many("i", 2)
    return {"code": code, "argument": argument, "title": c.text(c.take("B")), "text": c.text()}


def _error(c):
    names = ("code", "argument", "level", "data_type", "data")
    return dict(zip(names, [*c.many("i", 3), *c.many("I", 2)], strict=True)) | {"text": c.text()}


def _safety(c):
    return {"code": c.take("i"), "argument": c.take("i"), "mode": c.take("B"), "data": c.many("I", 2)}


def _exception(c):
    return {"line": c.take("i"), "column": c.take("i"), "text": c.text()}


def _popup(c):
    head = {"request": c.take("I"), "type": c.take("B"), "flags": c.many("?", 3)}
    return head | {"title": c.text(c.take("B")), "text": c.text()}


_MESSAGES = {
    0: lambda c: {"text": c.text()},
    1: lambda c: {"number": c.take("i"), "text": c.text()},
    2: _popup,
    3: _version,
    5: _safety,
    6: _error,
    7: _key,
    10: _exception,
}


def parts(body: bytes) -> list[tuple[int, bytes]]:
    found, cursor = [], Cursor(body)
    while not cursor.done:
        begin = cursor.at
        length, number = cursor.take("I"), cursor.take("B")
        found.append((number, body[begin + 5 : begin + length]))
        cursor.at = begin + length
    return found

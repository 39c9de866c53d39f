"""Coroutines without an event loop: each resumes inside the call that brings its value.

An asyncio task would resume a turn of the loop later: in lockstep, answers could follow the states of later ticks.
"""

from collections.abc import Coroutine, Generator
from contextlib import suppress
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Deferred(Generic[T]):
    """A value that is set once. Waiting coroutines resume in the order in which they started to wait."""

    def __init__(self) -> None:
        self._values: list[T] = []
        self._waiting: list[Coroutine[Deferred[Any], None, object]] = []

    def set(self, value: T) -> None:
        if not self._values:
            self._values.append(value)
            for coroutine in self._waiting:
                begin(coroutine)

    def wait(self, coroutine: "Coroutine[Deferred[Any], None, object]") -> None:
        self._waiting.append(coroutine)

    def __await__(self) -> "Generator[Deferred[Any], None, T]":
        if not self._values:
            yield self
        return self._values[0]


def begin(coroutine: Coroutine[Deferred[Any], None, object]) -> None:
    """Run or resume a coroutine until it has to wait."""
    with suppress(StopIteration):
        coroutine.send(None).wait(coroutine)

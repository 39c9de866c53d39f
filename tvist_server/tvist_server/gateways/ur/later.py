"""Coroutines without a loop: each continues inside the call that brings what it waits for.

A task of asyncio would continue a turn of the loop later: in lockstep an answer could come behind the states of later
ticks. Sessions also know no loop, so that their tests need none.
"""

from collections.abc import Coroutine, Generator
from contextlib import suppress
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Later(Generic[T]):
    """A value that comes once. Those who wait for it continue in the order in which they began to wait."""

    def __init__(self) -> None:
        self._values: list[T] = []
        self._waiting: list[Coroutine[Later[Any], None, object]] = []

    def come(self, value: T) -> None:
        """Take the value; a second one changes nothing."""
        if not self._values:
            self._values.append(value)
            for coroutine in self._waiting:
                begin(coroutine)

    def wait(self, coroutine: "Coroutine[Later[Any], None, object]") -> None:
        """Continue a coroutine when the value has come."""
        self._waiting.append(coroutine)

    def __await__(self) -> "Generator[Later[Any], None, T]":
        if not self._values:
            yield self
        return self._values[0]


def begin(coroutine: Coroutine[Later[Any], None, object]) -> None:
    """Run a coroutine, or continue it, until it has to wait."""
    with suppress(StopIteration):
        coroutine.send(None).wait(coroutine)

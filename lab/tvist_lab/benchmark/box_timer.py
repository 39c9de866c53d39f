"""Time in the boxes of a control period, by functions wrapped around theirs.

A wrapper reads the clock before and after its function, which costs about as much as a small box, and more in the
middle of a tick than in a loop of its own. So the program also runs with every function wrapped twice: what the second
wrapper adds to a box and to the one around it is about what the first one has added.
"""

import inspect
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from tvist_controller.api import Box, Place

NOWHERE = -1
"""Number of the box around the first one."""


_WRAPPER = """
def timed({parameters}):
    if present[0] != {around}:
        return function({arguments})
    present[0] = {number}
    began = now()
    try:
        return function({arguments})
    finally:
        nanoseconds[{number}] += now() - began
        present[0] = {around}
        calls[{number}] += 1
"""


class BoxError(RuntimeError):
    """A box cannot be found in the program."""


class BoxTimer:
    """Counts calls of boxes and measures their time.

    Args:
        boxes: The boxes, each after the one that it is a part of.
    """

    def __init__(self, boxes: Sequence[Box]) -> None:
        self.boxes = boxes
        numbers = {box.name: number for number, box in enumerate(boxes)}
        self.within = [NOWHERE if box.within is None else numbers[box.within] for box in boxes]
        """Number of the box that each is a part of."""
        self.nanoseconds = [0] * len(boxes)
        """Time of each with its parts, and with what its own wrapper adds to it [ns]."""
        self.calls = [0] * len(boxes)
        """Number of calls of each."""
        self._present = [NOWHERE]

    def clear(self) -> None:
        """Begin to count anew."""
        self.nanoseconds[:] = [0] * len(self.boxes)
        self.calls[:] = [0] * len(self.boxes)

    @contextmanager
    def attached(self, *, twice: bool = False) -> Iterator[None]:
        """Wrap the functions of all boxes for as long as the block lasts.

        Args:
            twice: Whether to put a second wrapper, whose times are ignored, between each function and the first.

        Raises:
            BoxError: A box has a function that does not exist.
        """
        with ExitStack() as stack:
            if twice:
                stack.enter_context(BoxTimer(self.boxes).attached())
            stack.enter_context(self._attached())
            yield

    @contextmanager
    def _attached(self) -> Iterator[None]:
        wrapped = [(place, number) for number, box in enumerate(self.boxes) for place in found(box)]
        before = [vars(place.owner)[place.name] for place, _ in wrapped]
        try:
            for (place, number), function in zip(wrapped, before, strict=True):
                setattr(place.owner, place.name, self.wrap(function, number, self.within[number]))
            yield
        finally:
            for (place, _), function in zip(wrapped, before, strict=True):
                setattr(place.owner, place.name, function)

    def wrap(self, function: Callable[..., Any], number: int, around: int) -> Callable[..., Any]:
        """Return a function that does the same, and counts as a box where it is called from the box around it.

        It has the same parameters, since Python calls such a function faster than one that takes any.
        """
        parameters, arguments, defaults = _signature(function)
        names: dict[str, Any] = {
            "function": function, "now": time.perf_counter_ns, "present": self._present,
            "nanoseconds": self.nanoseconds, "calls": self.calls, **defaults,
        }  # fmt: skip
        exec(_WRAPPER.format(parameters=parameters, arguments=arguments, number=number, around=around), names)  # noqa: S102
        timed: Callable[..., Any] = names["timed"]
        return timed

    def own_times(self) -> list[float]:
        """Return the time of each box without its parts, but with what the wrappers add [ns]."""
        own = [float(taken) for taken in self.nanoseconds]
        for number, around in enumerate(self.within):
            if around != NOWHERE:
                own[around] -= self.nanoseconds[number]
        return own


def found(box: Box) -> list[Place]:
    """Return all functions of a box, with those of subclasses.

    Raises:
        BoxError: One does not exist.
    """
    places = [place for named in box.places for place in _own_and_inherited(named)]
    for named in box.places:
        if not any(place.name == named.name for place in places):
            owner = getattr(named.owner, "__qualname__", named.owner.__name__)
            raise BoxError(
                f"the box {box.name!r} should be {owner}.{named.name} of {_module(named.owner)}, which does not exist: "
                "name the function that does its work now in tvist_controller/boxes.py"
            )
    return places


def _own_and_inherited(place: Place) -> Iterator[Place]:
    defined = vars(place.owner).get(place.name)
    if defined is not None and not getattr(defined, "__isabstractmethod__", False):
        yield place
    if isinstance(place.owner, type):
        subclass: type
        for subclass in place.owner.__subclasses__():
            yield from _own_and_inherited(Place(subclass, place.name))


def _module(owner: Any) -> str:
    return str(getattr(owner, "__module__", owner.__name__))


def _signature(function: Callable[..., Any]) -> tuple[str, str, dict[str, Any]]:
    """Return the parameters of a function and the arguments that pass them on, as text, and the defaults by name."""
    written, passed = [], []
    defaults: dict[str, Any] = {}
    star = False
    for one in inspect.signature(function).parameters.values():
        if one.kind in {one.VAR_POSITIONAL, one.VAR_KEYWORD}:
            return "*arguments, **named", "*arguments, **named", {}
        if one.kind is one.KEYWORD_ONLY and not star:
            star = True
            written.append("*")
        default = ""
        if one.default is not one.empty:
            default = f"=default_{one.name}"
            defaults[f"default_{one.name}"] = one.default
        written.append(one.name + default)
        passed.append(f"{one.name}={one.name}" if one.kind is one.KEYWORD_ONLY else one.name)
    return ", ".join(written), ", ".join(passed), defaults

"""What the functions of every subject have in common."""

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple, TypeVar

from tvist_controller.programs.access import Access
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.indicators import Popups, RunstateOutputs, Watchdogs
from tvist_controller.programs.interpreter import StatementQueue
from tvist_controller.programs.kinematics import ProgramKinematics
from tvist_controller.programs.sockets import Sockets
from tvist_urscript import costs

F = TypeVar("F", bound=Callable[..., Any])


class Parts(NamedTuple):
    """What the functions work on: one robot, and what its programs share."""

    access: Access
    arm: ProgramArm
    kinematics: ProgramKinematics
    popups: Popups
    watchdogs: Watchdogs
    sockets: Sockets
    statements: StatementQueue
    runstate: RunstateOutputs


class Family:
    """Functions of one subject for the programs of one robot.

    Scripts call the public methods, whose arguments are checked as they are annotated, see `checked`.
    What a function sets after a move that is blended is set where the blend begins, see `ProgramArm.then`.
    """

    title: ClassVar[str]
    """The subject, for the page of reference."""

    def __init__(self, on: Parts) -> None:
        self._access, self._arm, self._kinematics, self._parts = on.access, on.arm, on.kinematics, on
        self._peripherals = on.access.peripherals

    def _warn(self, why: str) -> None:
        self._access.emit("warning", why=why)


def described(function: F, what: str, **kinds: object) -> F:
    """Return a function of several of the same shape, with its description and what its parameters may be."""
    function.__doc__ = what
    function.__annotations__.update(kinds)
    return function


def reads(what: str, read: Callable[[Parts], Any], cost: int = 1) -> Callable[[Family], Any]:
    """Return a function without parameters that only reads something, with its description and its cost."""

    def get(self: Family) -> Any:
        return read(self._parts)

    return costs(cost)(described(get, what))

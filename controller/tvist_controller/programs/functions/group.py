"""Base of the functions of each subject."""

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


class FunctionContext(NamedTuple):
    """Objects that the functions use: one robot, and the state shared by its programs."""

    access: Access
    arm: ProgramArm
    kinematics: ProgramKinematics
    popups: Popups
    watchdogs: Watchdogs
    sockets: Sockets
    statements: StatementQueue
    runstate: RunstateOutputs


class FunctionGroup:
    """Functions of one subject for the programs of one robot.

    Scripts call the public methods; arguments are checked as annotated, see `checked`. What a function sets
    after a blended move takes effect where the blend begins, see `ProgramArm.then`.
    """

    title: ClassVar[str]  # heading in the reference page

    def __init__(self, on: FunctionContext) -> None:
        self._access, self._arm, self._kinematics, self._parts = on.access, on.arm, on.kinematics, on
        self._peripherals = on.access.peripherals

    def _warn(self, why: str) -> None:
        self._access.emit("warning", why=why)


def described(function: F, what: str, **kinds: object) -> F:
    """Return one of several functions of the same form, with its description and parameter types."""
    function.__doc__ = what
    function.__annotations__.update(kinds)
    return function


def reads(what: str, read: Callable[[FunctionContext], Any], cost: int = 1) -> Callable[[FunctionGroup], Any]:
    """Return a parameterless function that reads a value, with its description and cost."""

    def get(self: FunctionGroup) -> Any:
        return read(self._parts)

    return costs(cost)(described(get, what))

"""All functions of the controller for programs."""

from collections.abc import Callable
from functools import cache
from typing import Any

from tvist_controller.programs.arguments import checked
from tvist_controller.programs.functions.force import ForceFunctions
from tvist_controller.programs.functions.gripper import GripperFunctions
from tvist_controller.programs.functions.group import FunctionContext, FunctionGroup
from tvist_controller.programs.functions.motions import MotionFunctions
from tvist_controller.programs.functions.program import MessageFunctions, SafetyFunctions, StatementFunctions
from tvist_controller.programs.functions.settings import SettingFunctions
from tvist_controller.programs.functions.setup import SetupFunctions
from tvist_controller.programs.functions.sockets import SocketFunctions
from tvist_controller.programs.functions.state import PoseFunctions, StateFunctions
from tvist_controller.programs.functions.terminals import RegisterFunctions, TerminalFunctions
from tvist_controller.programs.functions.unsimulated import SUBJECTS
from tvist_urscript import Signature, Signatures, names, signatures

FUNCTION_GROUPS: tuple[type[FunctionGroup], ...] = (
    MotionFunctions,
    ForceFunctions,
    PoseFunctions,
    StateFunctions,
    SettingFunctions,
    RegisterFunctions,
    TerminalFunctions,
    SetupFunctions,
    MessageFunctions,
    SocketFunctions,
    StatementFunctions,
    SafetyFunctions,
    GripperFunctions,
)  # all functions, in the order of the documentation

MOVING = frozenset(names(MotionFunctions)) | {
    "interpreter_mode",
    "force_mode",
    "freedrive_mode",
    "teach_mode",
}  # functions that move the arm, or let clients move it


@cache
def known_signatures() -> Signatures:
    """Return the signature of each function; the language's own are in `tvist_urscript`."""
    return {
        **{name: one for group in FUNCTION_GROUPS for name, one in signatures(group).items()},
        **{
            name: Signature(given, fails=f"this controller does not simulate {subject}")
            for name, (given, subject) in SUBJECTS.items()
        },
    }


def functions(parts: FunctionContext) -> dict[str, Callable[..., Any]]:
    """Return the functions for the programs of one robot, by name."""
    joints = parts.access.description.joints
    found: dict[str, Callable[..., Any]] = {}
    for group in FUNCTION_GROUPS:
        subject = group(parts)
        found |= {name: checked(getattr(subject, name), joints) for name in names(group)}
    return found

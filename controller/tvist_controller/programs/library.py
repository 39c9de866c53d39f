"""All functions of the controller that programs can call."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from tvist_controller.programs.access import Access
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.functions.force import ForceFunctions
from tvist_controller.programs.functions.gripper import GripperFunctions
from tvist_controller.programs.functions.messages import MessageFunctions
from tvist_controller.programs.functions.motions import MotionFunctions
from tvist_controller.programs.functions.poses import PoseFunctions
from tvist_controller.programs.functions.registers import RegisterFunctions
from tvist_controller.programs.functions.safety import SafetyFunctions
from tvist_controller.programs.functions.settings import SettingFunctions
from tvist_controller.programs.functions.setup import SetupFunctions
from tvist_controller.programs.functions.sockets import SocketFunctions
from tvist_controller.programs.functions.state import StateFunctions
from tvist_controller.programs.functions.statements import StatementFunctions
from tvist_controller.programs.functions.terminals import TerminalFunctions
from tvist_controller.programs.functions.unsimulated import MISSING, SUBJECTS
from tvist_controller.programs.interpreter import StatementQueue
from tvist_controller.programs.kinematics import ProgramKinematics
from tvist_controller.programs.popups import Popups
from tvist_controller.programs.runstate import RunstateOutputs
from tvist_controller.programs.sockets import Sockets
from tvist_controller.programs.watchdogs import Watchdogs
from tvist_urscript import Signature, Signatures, names, signatures

FAMILIES: Mapping[type, str] = {
    MotionFunctions: "Motions",
    ForceFunctions: "Force",
    PoseFunctions: "Kinematics and dynamics",
    StateFunctions: "State",
    SettingFunctions: "Settings",
    RegisterFunctions: "Registers and flags",
    TerminalFunctions: "Inputs and outputs",
    SetupFunctions: "Set-up",
    MessageFunctions: "Messages and time",
    SocketFunctions: "Sockets",
    StatementFunctions: "Statements from clients",
    SafetyFunctions: "Safety",
    GripperFunctions: "Gripper",
}
"""What the functions of each class are about, in the order of the documentation."""

MOVING = frozenset(names(MotionFunctions)) | {
    "interpreter_mode",
    "force_mode",
    "freedrive_mode",
    "teach_mode",
}
"""Functions that move the arm, or let clients do so."""


@cache
def known_signatures() -> Signatures:
    """Return how scripts call each function; those of the language itself are in `tvist_urscript`."""
    return {
        **{name: one for family in FAMILIES for name, one in signatures(family).items()},
        **{name: Signature(given) for name, (given, _) in SUBJECTS.items()},
    }


def functions(
    access: Access,
    arm: ProgramArm,
    popups: Popups,
    watchdogs: Watchdogs,
    connections: Sockets,
    queue: StatementQueue,
    runstate: RunstateOutputs,
) -> dict[str, Callable[..., Any]]:
    """Return the functions for the programs of one robot, by name."""
    kinematics = ProgramKinematics(access.description, access.motion, arm.spend)
    families = (
        MotionFunctions(access, arm, kinematics),
        PoseFunctions(access, kinematics),
        StateFunctions(access, arm, kinematics),
        SettingFunctions(access, arm),
        RegisterFunctions(access, arm),
        TerminalFunctions(access, arm),
        SetupFunctions(access, arm, runstate),
        MessageFunctions(access, arm, popups),
        SocketFunctions(connections, arm),
        StatementFunctions(arm, queue),
        SafetyFunctions(access, arm, watchdogs),
        GripperFunctions(access, arm),
        ForceFunctions(access, arm),
    )
    return MISSING | {name: getattr(family, name) for family in families for name in names(type(family))}

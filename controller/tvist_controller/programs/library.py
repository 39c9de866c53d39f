"""All functions of the controller that programs can call."""

from collections.abc import Callable
from typing import Any

from tvist_controller.programs.access import Access
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.functions import (
    messages,
    motions,
    poses,
    registers,
    safety,
    settings,
    sockets,
    state,
    statements,
    terminals,
    unsimulated,
)
from tvist_controller.programs.interpreter import StatementQueue
from tvist_controller.programs.kinematics import ProgramKinematics
from tvist_controller.programs.popups import Popups
from tvist_controller.programs.sockets import Sockets
from tvist_controller.programs.watchdogs import Watchdogs

_MODULES = (
    motions,
    poses,
    state,
    settings,
    registers,
    terminals,
    messages,
    sockets,
    statements,
    safety,
    unsimulated,
)
SIGNATURES = {name: one for module in _MODULES for name, one in module.SIGNATURES.items()}
"""Signature of each function; those of the language itself are in `tvist_urscript`."""

MOVING = frozenset(motions.SIGNATURES) | {"interpreter_mode"}
"""Functions that move the arm, or let clients do so."""


def functions(
    access: Access,
    arm: ProgramArm,
    popups: Popups,
    watchdogs: Watchdogs,
    connections: Sockets,
    queue: StatementQueue,
) -> dict[str, Callable[..., Any]]:
    """Return the functions for the programs of one robot, by name."""
    kinematics = ProgramKinematics(access.description, access.motion, arm.spend)
    classes = {
        motions: motions.MotionFunctions(access, arm, kinematics),
        poses: poses.PoseFunctions(access, kinematics),
        state: state.StateFunctions(access, arm, kinematics),
        settings: settings.SettingFunctions(access, arm),
        registers: registers.RegisterFunctions(access, arm),
        terminals: terminals.TerminalFunctions(access, arm),
        messages: messages.MessageFunctions(access, arm, popups),
        sockets: sockets.SocketFunctions(connections, arm),
        statements: statements.StatementFunctions(arm, queue),
        safety: safety.SafetyFunctions(access, arm, watchdogs),
        unsimulated: unsimulated.UnsimulatedFunctions(),
    }
    return {name: getattr(classes[module], name) for module in _MODULES for name in module.SIGNATURES}

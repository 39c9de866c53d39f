"""Functions that return why a robot must not be moved, or no longer follows, and the remedy; else None."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tvist_controller.kinematics.arm import Arm
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import Floats
from tvist_plant.plant import GRAVITY, Halt, RobotReport
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_server.moving.interfaces import Configuration
from tvist_server.moving.program import ProgramEnded
from tvist_server.ur_model import series

MODEL, REMOTE = "get robot model", "is in remote control"
QUESTIONS = MODEL, REMOTE
LEAST_MINOR = {3: 14, 5: 9}
"""Oldest supported minor version of the robot's software by major version; later major versions are all supported."""
MAX_JOINT_DIFFERENCE = 0.01  # largest deviation of a joint from its expected angle [rad]
SAME_MASS = 0.05  # largest difference of two masses that count as equal [kg]
SAME_PLACE, SAME_TURN = 1e-3, 0.01
"""Largest difference of two tool centre points that count as equal [m, rad]."""
STILL = 1e-3
"""Speed below which a joint is at rest [rad/s]."""
LEANING = 0.15  # largest angle between the measured and the expected direction of gravity [rad]
PLAUSIBLE = 2.0  # largest error of the measured gravity for which the accelerometer is used [m/s²]
_AGAIN = "then power on here"
_SAFETY: dict[int, str] = {
    SafetyMode.PROTECTIVE_STOP: "it has made a protective stop: remove the cause, unlock it at the robot, then here",
    SafetyMode.SAFEGUARD_STOP: f"a safeguard has stopped it: reset it, stop the program at the robot, {_AGAIN}",
    SafetyMode.SYSTEM_EMERGENCY_STOP: "the system's emergency stop was pressed: release it, switch the robot on at its "
    f"teach pendant, {_AGAIN}",
    SafetyMode.ROBOT_EMERGENCY_STOP: "its emergency stop was pressed: release it, switch the robot on at its teach "
    f"pendant, {_AGAIN}",
}
_ENDED: dict[int, str] = {
    ProgramEnded.ORDERED: f"another client has ended its program: find the client that writes its registers, {_AGAIN}",
    ProgramEnded.SILENCE: "no set-point reached it for 40 ms, so it braked: check the network and the load of this "
    f"machine, {_AGAIN}",
    ProgramEnded.AWAY: "it is more than 0.01 rad from the first set-point: power on here to start from its present "
    "position",
    ProgramEnded.TOO_FAST: "a set-point exceeded the speed cap, so it braked: power on here, and report how this "
    "happened",
    ProgramEnded.LOST: f"its program was paused or fell behind, so it braked: find the cause, {_AGAIN}",
    ProgramEnded.STRAYED: "the arm did not follow the set-points, so it braked: look for an obstacle, do not move "
    f"the speed slider during a motion, {_AGAIN}",
}
_MOVABLE = {SafetyMode.NORMAL, SafetyMode.REDUCED}
_PAUSED = {RuntimeState.PAUSING, RuntimeState.PAUSED, RuntimeState.RESUMING}
REPLACED = (
    f"another program has replaced the one that follows set-points: end it, find out who sent it, {_AGAIN}"
)
FELL_SILENT = Halt(
    f"it says nothing any more, so its own program has stopped it: check the network and the robot, {_AGAIN}",
    SafetyMode.UNDEFINED,
)


class Expected(NamedTuple):
    """Properties of the robot according to tvist's options."""

    description: RobotDescription
    payload: Payload  # payload that must be set on the robot
    tool: tuple[float, ...] | None = None  # tool centre point that must be set on the robot; None: any
    q: tuple[float, ...] | None = None  # joint angles at which the robot should be [rad]; None: any


def why_not_by_answers(
    expected: Expected, answers: Mapping[str, str], own: Configuration | None
) -> str | None:
    """Return why the answers of a robot's interfaces forbid moving it; None if they allow it."""
    model = expected.description.robot.model
    told = answers.get(MODEL)
    if told is not None and series(told) != series(model):
        return f"it is a {told}, and the robot file is that of a {model}: give --robot its model"
    if own is not None and (trouble := own.trouble()) is not None:
        return trouble
    if own is not None and not own.is_of(expected.description):
        return (
            f"its dimensions are not those of a {model}: give --robot its model, or a robot file of your own"
        )
    return remote_trouble(answers)


def remote_trouble(answers: Mapping[str, str]) -> str | None:
    """Return why the robot accepts no program; None if it accepts programs."""
    if answers.get(REMOTE) == "false":
        return (
            "it is in local control, or another client controls it: switch it to remote control at its teach pendant, "
            "and end other clients"
        )
    return None


def version_trouble(version: Sequence[int]) -> str | None:
    """Return why software of a version (major, minor, …) does not run `follow.script`; None if it does."""
    major, minor = version[:2]
    least = LEAST_MINOR.get(major, 0 if major > max(LEAST_MINOR) else None)
    if least is not None and minor >= least:
        return None
    return (
        f"its software {major}.{minor} may not run tvist's program: update it to 5.9 or later, on a CB3 robot to 3.14 "
        "or later"
    )


def why_not_by_state(expected: Expected, report: RobotReport, *, may_play: bool = False) -> str | None:
    """Return why a robot must not be moved now, else None. `may_play`: a program on it is tvist's own."""
    mode, safety, runtime = report.modes
    reasons = (
        (mode == RobotMode.DISCONNECTED, "it is not connected: check the network and the robot"),
        (safety != SafetyMode.NORMAL,
         f"its safety mode is {_name(SafetyMode, safety)}: clear that at the robot, until it is NORMAL"),
        (mode != RobotMode.RUNNING,
         f"its mode is {_name(RobotMode, mode)}: switch it on and release its brakes at the robot"),
        (runtime != RuntimeState.STOPPED and not may_play,
         "a program runs on it, or is paused: stop that at the robot or at its client"),
    )  # fmt: skip
    why = next((why for wrong, why in reasons if wrong), None)
    return why or _posture_trouble(expected, report) or _load_trouble(expected, report)


def _posture_trouble(expected: Expected, report: RobotReport) -> str | None:
    target, measured = report.target[0], report.measured.q
    if np.abs(report.target[1]).max() > STILL:
        return "it moves: wait until it is at rest"
    if (joint := _apart(target, measured)) is not None:
        by = abs(target[joint] - measured[joint])
        return (
            f"joint {joint} is {by:.3f} rad from where its controller has it, more than {MAX_JOINT_DIFFERENCE:g}: "
            "remove what holds it, or switch its power off and on"
        )
    if expected.q is not None and (joint := _apart(np.array(expected.q), target)) is not None:
        return (
            f"joint {joint} stands at {target[joint]:.3f} rad, and --start says {expected.q[joint]:.3f}: move the arm "
            "there, or leave --start out"
        )
    most = np.array(expected.description.limits.position)
    beyond = int(np.argmax(np.abs(target) - most))
    if abs(target[beyond]) > most[beyond]:
        return (
            f"joint {beyond} stands at {target[beyond]:.3f} rad, beyond ±{most[beyond]:.3f}, the narrower of its own "
            "limit and that of the robot file: move it back at the robot"
        )
    return None


def _load_trouble(expected: Expected, report: RobotReport) -> str | None:
    told, tool = report.payload, report.tool
    if told is not None and abs(told.mass - expected.payload.mass) > SAME_MASS:
        return (
            f"its payload is set to {told.mass:.3g} kg, and here it is {expected.payload.mass:.3g} kg: give "
            "--payload what the arm carries, and set the same on the robot"
        )
    if tool is not None and expected.tool is not None:
        apart = np.abs(np.array(tool) - np.array(expected.tool))
        if apart[:3].max() > SAME_PLACE or apart[3:].max() > SAME_TURN:
            return (
                f"its tool centre point is {_listed(tool)}, and --tcp says {_listed(expected.tool)}: set the right one "
                "at the robot, or leave --tcp out to take over its own"
            )
    return None


def mounting_trouble(description: RobotDescription, q: Floats, felt: Floats) -> str | None:
    """Return why the robot's mounting seems to differ from its file; None if it agrees.

    `q`: joint angles at rest, shape (6,) [rad]; `felt`: mean specific force in the flange frame, shape (3,) [m/s²].
    """
    up = Arm(description).pose(q)[0] @ felt / np.linalg.norm(felt)
    leans = float(np.arccos(np.clip(up[2], -1.0, 1.0)))
    if leans <= LEANING:
        return None
    return (
        f"its accelerometer measures gravity {np.degrees(leans):.0f}° from its direction for an upright base: the "
        "robot file is for an upright robot, but this one hangs, leans, or is another model"
    )


def tells_gravity(felt: Floats) -> bool:
    """Return whether an accelerometer at rest, shape (3,) [m/s²], plausibly measures gravity."""
    return bool(abs(np.linalg.norm(felt) - GRAVITY) <= PLAUSIBLE)


def halt_by_modes(modes: tuple[int, int, int]) -> Halt | None:
    """Return why the robot's modes prevent it from following any program; None if they do not."""
    mode, safety, _ = modes
    if safety not in _MOVABLE:
        other = f"its safety mode is {_name(SafetyMode, safety)}: clear that at the robot, {_AGAIN}"
        return Halt(_SAFETY.get(safety, other), safety)
    if mode != RobotMode.RUNNING:
        why = f"its mode is {_name(RobotMode, mode)}: switch it on and release its brakes at the robot, {_AGAIN}"
        return Halt(why, safety)
    return None


def halt_by_program(ended: int, modes: tuple[int, int, int]) -> Halt | None:
    """Return why the program no longer follows, else None; `ended` is the content of the register `ENDED`."""
    _, safety, runtime = modes
    if ended in _ENDED:
        return Halt(_ENDED[ended], safety)
    if runtime in _PAUSED:
        return Halt(f"its program was paused: stop it at the robot, {_AGAIN}", safety)
    if runtime != RuntimeState.PLAYING:
        why = "its program was stopped at the robot, or by a change to local control or of its power"
        return Halt(f"{why}: see that it is in remote control, {_AGAIN}", safety)
    return None


def _apart(one: Floats, other: Floats) -> int | None:
    """Return the index of the most different joint; None if it differs by at most `MAX_JOINT_DIFFERENCE`."""
    joint = int(np.argmax(np.abs(one - other)))
    return joint if abs(one[joint] - other[joint]) > MAX_JOINT_DIFFERENCE else None


def _listed(numbers: Sequence[float]) -> str:
    return ",".join(f"{number:.4g}" for number in numbers)


def _name(kind: type[RobotMode | SafetyMode], number: int) -> str:
    return kind(number).name if number in {*kind} else str(number)

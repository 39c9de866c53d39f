"""Judges whether a robot is ready to be moved; if not, gives the reason and the remedy."""

from enum import IntEnum

from msgspec import Struct

from tvist_client.robot import ENDPOINT, NAME, Robot
from tvist_client.transports.certificates import Folder
from tvist_protocol import Info, RobotMode, SafetyMode, State, StopReason

_MAY_MOVE = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED})
"""Safety modes in which a robot with power can move."""
_RELEASE = "release it (in simulation: simulation.inject with the fault normal)"
_NEXT: dict[int, str] = {
    SafetyMode.PROTECTIVE_STOP: "remove its cause, then run {unlock}",
    SafetyMode.SAFEGUARD_STOP: f"{_RELEASE}, and the robot is ready again",
    SafetyMode.SYSTEM_EMERGENCY_STOP: f"{_RELEASE}, then run {{unlock}} --power-on",
    SafetyMode.ROBOT_EMERGENCY_STOP: f"{_RELEASE}, then run {{unlock}} --power-on",
    SafetyMode.VIOLATION: "run {unlock} --power-on, which restarts the safety system",
    SafetyMode.FAULT: "run {unlock} --power-on, which restarts the safety system",
}
RELIEVE = (
    "end other programs, serve fewer robots in its process, or start it with more --workers or with "
    "--realtime-priority"
)
"""Remedies for an overloaded robot."""
_AT_THE_ROBOT = "resolve this at the robot, which is only watched: nothing is sent to it from here"
_LOST = "check that the robot is on and reachable from the server, which tries every second to connect"
_POWER = "run {unlock} --power-on"


class Readiness(Struct, frozen=True):
    """Whether a robot may be moved, and what prevents it."""

    ready: bool  # whether the robot has power and its safety system allows motion
    robot_mode: str | None
    """RTDE name of the robot mode; null before the robot's first tick, when it is unknown."""
    safety_mode: str | None
    """RTDE name of the safety mode; null before the robot's first tick, when it is unknown."""
    stop: StopReason | None
    """The stop that keeps it from moving; null if there is none, or the robot does not report it."""
    why: str  # the reason; empty if the robot is ready
    next: str  # the remedy; empty if the robot is ready

    @property
    def sentence(self) -> str:
        """Reason and next step in one line, for people."""
        return f"{self.why}. Next: {self.next}" if self.next else self.why


async def look(robot: Robot, unlock: str = "tvist unlock") -> Readiness:
    """Ask a robot whether it is ready to move; `unlock` is the command line that unlocks the robot."""
    info, state = await robot.info(), None
    if info.robot_mode is None and (info.clock == "realtime" or info.tick > 0):
        state = await robot.state()
    return readiness(info, state, unlock)


def readiness(info: Info, state: State | None, unlock: str = "tvist unlock") -> Readiness:
    """Judge readiness from messages; `state` is only needed if an old server's `info` lacks the modes."""
    robot = info.robot_mode if info.robot_mode is not None or state is None else state.robot_mode
    safety = info.safety_mode if info.safety_mode is not None or state is None else state.safety_mode
    if robot is None or safety is None:
        return Readiness(True, None, None, None, "", "")
    robot_mode, safety_mode = mode_name(RobotMode, robot), mode_name(SafetyMode, safety)
    if safety not in _MAY_MOVE:
        stands, then = f"safety_mode is {safety_mode}", _NEXT.get(safety, "")
    elif robot != RobotMode.RUNNING:
        stands, then = f"robot_mode is {robot_mode}", _POWER
    else:
        return Readiness(True, robot_mode, safety_mode, None, "", "")
    if info.watched is not None:
        lost = robot == RobotMode.DISCONNECTED
        stands, then = (f"{info.watched} is not connected", _LOST) if lost else (stands, _AT_THE_ROBOT)
    since = f" since tick {info.stop.tick}: {info.stop.why}" if info.stop is not None else ""
    return Readiness(
        False, robot_mode, safety_mode, info.stop, f"{stands}{since}", then.format(unlock=unlock)
    )


def unlock_command(endpoint: str, name: str, security: Folder | None, namespace: str = "") -> str:
    """Return the command line that unlocks a robot, without options that have their default values."""
    words = ["tvist unlock"]
    words += [endpoint] if endpoint != ENDPOINT else []
    words += ["--name", name] if name != NAME else []
    words += ["--namespace", namespace] if namespace else []
    words += ["--security", str(security)] if security is not None else []
    return " ".join(words)


def mode_name(kind: type[IntEnum], number: int) -> str:
    """Return the RTDE name of a mode, or its number if it has none."""
    return kind(number).name if number in {member.value for member in kind} else str(number)

"""Why a robot does not follow any more, and what to do: one sentence each."""

from tvist_plant.plant import Halt
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_server.moving.registers import Ended

_AGAIN = "then power on here"
_SAFETY = {
    SafetyMode.PROTECTIVE_STOP: "it has made a protective stop: see why, and unlock it at the robot, then here",
    SafetyMode.SAFEGUARD_STOP: f"a safeguard has stopped it: release that, stop the program at the robot, {_AGAIN}",
    SafetyMode.SYSTEM_EMERGENCY_STOP: "the system's emergency stop was pressed: release it, switch the robot on at its "
    f"teach pendant, {_AGAIN}",
    SafetyMode.ROBOT_EMERGENCY_STOP: "its emergency stop was pressed: release it, switch the robot on at its teach "
    f"pendant, {_AGAIN}",
}
_ENDED = {
    Ended.ORDERED: f"its program was told to end by somebody else: see who writes its registers, {_AGAIN}",
    Ended.SILENCE: "no set-point reached it for 40 ms, so that it has braked: look at the network and at the load of "
    f"this machine, {_AGAIN}",
    Ended.AWAY: f"it stands more than .01 rad from the first set-point: {_AGAIN}, to begin where it stands",
    Ended.TOO_FAST: f"a set-point was faster than the speed cap, so that it has braked: {_AGAIN}, and tell us how",
    Ended.LOST: f"its program was paused or fell behind, so that it has braked: see why, {_AGAIN}",
    Ended.STRAYED: "the arm did not follow the set-points, so that it has braked: see what held it, and whether the "
    f"speed slider was moved while it was going, {_AGAIN}",
}
_MOVABLE = {SafetyMode.NORMAL, SafetyMode.REDUCED}
_PAUSED = {RuntimeState.PAUSING, RuntimeState.PAUSED, RuntimeState.RESUMING}
REPLACED = f"another program has taken the place of ours: end that, and see who has sent it, {_AGAIN}"
SILENT = Halt(
    "it says nothing any more, so that its own program has stopped it: look at the network and at the robot, "
    f"{_AGAIN}",
    SafetyMode.UNDEFINED,
)


def halt_by_modes(modes: tuple[int, int, int]) -> Halt | None:
    """Return why a robot can follow no program, by its modes; None if it can."""
    mode, safety, _ = modes
    if safety not in _MOVABLE:
        name = SafetyMode(safety).name if safety in {*SafetyMode} else str(safety)
        why = _SAFETY.get(SafetyMode(safety)) if safety in {*SafetyMode} else None
        return Halt(why or f"its safety mode is {name}: clear that at the robot, {_AGAIN}", safety)
    if mode != RobotMode.RUNNING:
        name = RobotMode(mode).name if mode in {*RobotMode} else str(mode)
        return Halt(f"its mode is {name}: switch it on and release its brakes at the robot, {_AGAIN}", safety)
    return None


def halt_by_program(ended: int, modes: tuple[int, int, int]) -> Halt | None:
    """Return why our program, which has begun, does not follow any more; None if it does.

    Args:
        ended: What it says.
        modes: Modes of the robot, by which it can follow.
    """
    _, safety, runtime = modes
    if ended in {*Ended} and ended != Ended.NOT:
        return Halt(_ENDED[Ended(ended)], safety)
    if runtime in _PAUSED:
        return Halt(f"its program was paused: stop it at the robot, {_AGAIN}", safety)
    if runtime != RuntimeState.PLAYING:
        why = "its program was stopped at the robot, or by a change to local control or of its power"
        return Halt(f"{why}: see that it is in remote control, {_AGAIN}", safety)
    return None

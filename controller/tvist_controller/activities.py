"""What an activity looks like from outside, and which one an arm is in that was put somewhere at rest."""

from tvist_protocol.modes import RuntimeState
from tvist_protocol.transitions import Activity
from tvist_protocol.values import ResetMode

PUT: dict[ResetMode, Activity] = {
    "RUNNING": Activity.REST,
    "IDLE": Activity.IDLE,
    "POWER_OFF": Activity.POWER_OFF,
}
"""At rest in a robot mode."""
_RUNTIME = {
    Activity.MOVING: RuntimeState.PLAYING,
    Activity.STREAMING: RuntimeState.PLAYING,
    Activity.ENDING: RuntimeState.PLAYING,
    Activity.PAUSED: RuntimeState.PAUSED,
    Activity.STOPPING: RuntimeState.STOPPING,
    Activity.POWERING_OFF: RuntimeState.STOPPING,
    Activity.BRAKING: RuntimeState.STOPPING,
    Activity.PROTECTIVE_STOPPING: RuntimeState.STOPPING,
}
"""All else is STOPPED."""


def runtime_of(activity: Activity, *, slowing: bool) -> RuntimeState:
    """Whether something moves.

    Args:
        activity: What the robot is doing.
        slowing: Whether a motion that is paused has not come to its standstill.
    """
    state = _RUNTIME.get(activity, RuntimeState.STOPPED)
    return RuntimeState.PAUSING if state is RuntimeState.PAUSED and slowing else state


def at_rest(activity: Activity, *, emergency: bool) -> Activity:
    """Activity of a robot whose arm was put at rest somewhere else.

    Args:
        activity: Previous activity.
        emergency: Whether an emergency stop is pressed.
    """
    if activity.protective:
        return Activity.PROTECTIVE_STOP
    if activity is Activity.BRAKING or (emergency and activity.moving):
        return Activity.POWER_OFF
    return Activity.REST if activity.moving else activity

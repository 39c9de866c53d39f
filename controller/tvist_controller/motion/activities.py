"""Runtime state of an activity, and the activity of an arm that was placed somewhere at rest."""

from tvist_protocol.modes import RuntimeState
from tvist_protocol.transitions import Activity
from tvist_protocol.values import ResetMode

PUT: dict[ResetMode, Activity] = {
    "RUNNING": Activity.REST,
    "IDLE": Activity.IDLE,
    "POWER_OFF": Activity.POWER_OFF,
}
"""Activity at rest in each robot mode."""
_RUNTIME = {
    Activity.MOVING: RuntimeState.PLAYING,
    Activity.STREAMING: RuntimeState.PLAYING,
    Activity.GUIDED: RuntimeState.PLAYING,
    Activity.ENDING: RuntimeState.PLAYING,
    Activity.PAUSED: RuntimeState.PAUSED,
    Activity.STOPPING: RuntimeState.STOPPING,
    Activity.POWERING_OFF: RuntimeState.STOPPING,
    Activity.BRAKING: RuntimeState.STOPPING,
    Activity.PROTECTIVE_STOPPING: RuntimeState.STOPPING,
}
"""Runtime state of each activity; it is STOPPED for all others."""


def runtime_of(activity: Activity, *, slowing: bool) -> RuntimeState:
    """Return the runtime state, which says whether something moves; a paused motion may still be slowing."""
    state = _RUNTIME.get(activity, RuntimeState.STOPPED)
    return RuntimeState.PAUSING if state is RuntimeState.PAUSED and slowing else state


def at_rest(activity: Activity, *, emergency: bool) -> Activity:
    """Return the activity of a robot whose arm was placed at rest, in an emergency stop or not."""
    if activity.protective:
        return Activity.PROTECTIVE_STOP
    if activity is Activity.BRAKING or (emergency and activity.moving):
        return Activity.POWER_OFF
    return Activity.REST if activity.moving else activity

"""State of the safety system."""

from dataclasses import dataclass, field
from typing import Literal

from tvist_controller.refusal import wrong_mode
from tvist_protocol.modes import RuntimeState, SafetyMode
from tvist_protocol.transitions import TRANSITIONS, Activity
from tvist_protocol.values import ResetMode

Emergency = Literal["robot", "system"]
Latched = Literal["violation", "fault"]

_EMERGENCIES = {"robot": SafetyMode.ROBOT_EMERGENCY_STOP, "system": SafetyMode.SYSTEM_EMERGENCY_STOP}
_LATCHED = {"violation": SafetyMode.VIOLATION, "fault": SafetyMode.FAULT}
_MOTION = frozenset(
    row.trigger for row in TRANSITIONS if row.target in {Activity.MOVING, Activity.STREAMING, Activity.GUIDED}
)  # triggers that start motion, from the table of transitions
_LIVE = _MOTION | frozenset(
    row.trigger
    for row in TRANSITIONS
    if row.target in {Activity.IDLE, Activity.REST} and row.trigger != "at_rest"
)  # triggers that power the arm or start motion


@dataclass
class SafetySystem:
    """Safety inputs and latched faults, independent of the robot's activity."""

    reduced: bool = False  # whether the speed is reduced
    safeguard: bool = False  # whether a safeguard requests a stop
    emergencies: set[Emergency] = field(default_factory=set)  # pressed emergency stops
    latched: Latched | None = None  # fault or violation latched until a restart

    def mode(self, activity: Activity) -> SafetyMode:
        """Return RTDE's safety mode of the most severe present condition."""
        if self.latched is not None:
            return _LATCHED[self.latched]
        if self.emergencies:
            return _EMERGENCIES["robot" if "robot" in self.emergencies else "system"]
        if self.safeguard and not activity.protective:
            return SafetyMode.SAFEGUARD_STOP
        return activity.safety_mode(reduced=self.reduced)

    def check(self, trigger: str, activity: Activity) -> None:
        """Raise RefusalError for a command that the safety system does not allow."""
        if trigger in _LIVE and self.latched is not None:
            way_out = "send restart_safety first"
        elif trigger in _LIVE and self.emergencies:
            way_out = "release the emergency stop first"
        elif trigger in _MOTION and self.safeguard:
            way_out = "release the safeguard stop first"
        else:
            return
        raise wrong_mode(f"safety_mode is {self.mode(activity).name}: {way_out}")

    def clear(self) -> None:
        """Release safeguard and emergency stops and clear the latched fault, but keep reduced mode."""
        self.safeguard, self.latched = False, None
        self.emergencies.clear()

    def restart(self) -> None:
        """Clear the latched fault; raise RefusalError without one."""
        if self.latched is None:
            raise wrong_mode(
                "the safety system has found no violation or fault: there is no need to restart it"
            )
        self.latched = None


PUT: dict[ResetMode, Activity] = {
    "RUNNING": Activity.REST,
    "IDLE": Activity.IDLE,
    "POWER_OFF": Activity.POWER_OFF,
}  # activity at rest in each robot mode
RUNTIME = {
    Activity.MOVING: RuntimeState.PLAYING,
    Activity.STREAMING: RuntimeState.PLAYING,
    Activity.GUIDED: RuntimeState.PLAYING,
    Activity.ENDING: RuntimeState.PLAYING,
    Activity.PAUSED: RuntimeState.PAUSED,
    Activity.STOPPING: RuntimeState.STOPPING,
    Activity.POWERING_OFF: RuntimeState.STOPPING,
    Activity.BRAKING: RuntimeState.STOPPING,
    Activity.PROTECTIVE_STOPPING: RuntimeState.STOPPING,
}  # runtime state of each activity; STOPPED for all others


def at_rest(activity: Activity, *, emergency: bool) -> Activity:
    """Return the activity that follows when the arm is placed at rest."""
    if activity.protective:
        return Activity.PROTECTIVE_STOP
    if activity is Activity.BRAKING or (emergency and activity.moving):
        return Activity.POWER_OFF
    return Activity.REST if activity.moving else activity

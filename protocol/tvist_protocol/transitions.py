"""Activities of a robot and a table of transitions between them; commands and other events trigger them."""

from dataclasses import dataclass
from enum import StrEnum

from tvist_protocol.modes import RobotMode, SafetyMode


class Activity(StrEnum):
    """Current activity of the robot."""

    POWER_OFF = "POWER_OFF"
    """The arm has no power; the brakes hold it."""
    IDLE = "IDLE"
    """The arm has power; the brakes still hold it."""
    REST = "REST"
    """The drives hold the arm, which is ready to move."""
    MOVING = "MOVING"
    """The arm makes a point-to-point motion."""
    PAUSED = "PAUSED"
    """A point-to-point motion is paused: the arm slows down or is at rest on its path."""
    STREAMING = "STREAMING"
    """The arm follows a stream of set-points."""
    GUIDED = "GUIDED"
    """The arm follows `servo_j`, `speed_j` or `speed_l`, or is compliant in `force_mode` or `freedrive`."""
    ENDING = "ENDING"
    """A stream has ended, and the arm comes to rest through the filter."""
    STOPPING = "STOPPING"
    """The arm makes a stop that bypasses the filter."""
    POWERING_OFF = "POWERING_OFF"
    """The arm makes a stop, after which its power is switched off."""
    BRAKING = "BRAKING"
    """The arm has no power, and the brakes bring it to rest."""
    PROTECTIVE_STOPPING = "PROTECTIVE_STOPPING"
    """The arm makes a protective stop and is still moving."""
    PROTECTIVE_STOP = "PROTECTIVE_STOP"
    """The arm is at rest in a protective stop until it is unlocked."""

    robot_mode: RobotMode
    """Robot mode as numbered by RTDE."""
    moving: bool
    """Whether the arm moves or may continue to move."""
    protective: bool
    """Whether the activity is a protective stop."""

    def safety_mode(self, *, reduced: bool) -> SafetyMode:
        """Return the safety mode as numbered by RTDE; a more serious mode of the safety system prevails."""
        if self.protective:
            return SafetyMode.PROTECTIVE_STOP
        return SafetyMode.REDUCED if reduced else SafetyMode.NORMAL


@dataclass(frozen=True, slots=True)
class Transition:
    """Rows of the table that have the same trigger and the same target."""

    trigger: str  # `type` of a command, or one of `OTHER_TRIGGERS`
    sources: tuple[StrEnum, ...]
    target: StrEnum


class Control(StrEnum):
    """State of the right to move the robot."""

    FREE = "FREE"
    """No client has control; the next one that asks gets it."""
    HELD = "HELD"
    """The client that holds the lease."""


class Stepping(StrEnum):
    """Client that may step time in lockstep."""

    FREE = "FREE"
    """The client that has control."""
    HELD = "HELD"
    """Only the client that holds the clock."""


OTHER_TRIGGERS: dict[str, str] = {
    "power": "`power_on` with `release_brakes` false",
    "at_rest": "the shaped reference has come to rest",
    "interruption": "the motion must end: the lease ended, no set-point came for 250 ms, or there would be a collision",
    "brakes": "a fault or the safety system removed the power: the brakes close at once",
    "protective_stop": "a drive's torque or the force at the tool exceeded its limit for more than 10 ms, the tool "
    "left its way in force mode, a user's own shaper failed, or the fault was injected",
    "plant_failure": "the state of the simulated arm was no longer finite; the arm was put at rest at its reference",
    "lease_end": "the client did not renew the lease, or its liveliness token disappeared",
    "clock_end": "the liveliness token of the client that held the clock disappeared",
}

_A = Activity
_FREE_TO_END = (_A.MOVING, _A.PAUSED, _A.STREAMING, _A.GUIDED, _A.ENDING, _A.STOPPING)
"""Activities with a motion that a stop can end."""
_DRIVEN_ON = (
    *_FREE_TO_END,
    _A.POWERING_OFF,
    _A.PROTECTIVE_STOPPING,
)  # activities in which the drives move the arm
_ROBOT_MODES = {_A.POWER_OFF: RobotMode.POWER_OFF, _A.BRAKING: RobotMode.POWER_OFF, _A.IDLE: RobotMode.IDLE}
for _activity in Activity:
    # Attributes, because looking up an enumeration's member at every tick would take ten times as long.
    _activity.robot_mode = _ROBOT_MODES.get(_activity, RobotMode.RUNNING)
    _activity.moving = _activity in {*_DRIVEN_ON, _A.BRAKING}
    _activity.protective = _activity in {_A.PROTECTIVE_STOPPING, _A.PROTECTIVE_STOP}
_GUIDABLE = (_A.REST, _A.MOVING, _A.PAUSED, _A.GUIDED, _A.ENDING)
"""Activities that `servo_j`, `speed_j` and `speed_l` take over."""
_STANDING = (_A.POWER_OFF, _A.IDLE, _A.REST, _A.PROTECTIVE_STOP)
_LOSING_POWER = (_A.POWERING_OFF, _A.BRAKING)
_DRIVEN = tuple(a for a in _A if a not in {_A.POWER_OFF, _A.IDLE, *_LOSING_POWER})

TRANSITIONS: tuple[Transition, ...] = (
    Transition("take_control", (Control.FREE, Control.HELD), Control.HELD),
    Transition("hand_over", (Control.HELD,), Control.HELD),
    Transition("release_control", (Control.HELD,), Control.FREE),
    Transition("lease_end", (Control.HELD,), Control.FREE),
    Transition("take_clock", (Stepping.FREE, Stepping.HELD), Stepping.HELD),
    Transition("release_clock", (Stepping.HELD,), Stepping.FREE),
    Transition("clock_end", (Stepping.HELD,), Stepping.FREE),
    Transition("power_on", (_A.POWER_OFF, _A.IDLE, _A.REST), _A.REST),
    Transition("power", (_A.POWER_OFF, _A.IDLE), _A.IDLE),
    Transition("power", (_A.REST,), _A.REST),
    Transition("move_j", (_A.REST,), _A.MOVING),
    Transition("move_l", (_A.REST,), _A.MOVING),
    Transition("move_c", (_A.REST,), _A.MOVING),
    Transition("move_path", (_A.REST,), _A.MOVING),
    Transition("move_trajectory", (_A.REST,), _A.MOVING),
    Transition("servo_j", _GUIDABLE, _A.GUIDED),
    Transition("speed_j", _GUIDABLE, _A.GUIDED),
    Transition("speed_l", _GUIDABLE, _A.GUIDED),
    Transition("force_mode", (_A.REST, _A.GUIDED), _A.GUIDED),
    Transition("freedrive", (_A.REST, _A.GUIDED), _A.GUIDED),
    Transition("end_force_mode", (_A.GUIDED,), _A.STOPPING),
    Transition("pause", (_A.MOVING, _A.PAUSED), _A.PAUSED),
    Transition("resume", (_A.PAUSED,), _A.MOVING),
    Transition("servo_start", (_A.REST,), _A.STREAMING),
    Transition("servo_stop", (_A.STREAMING,), _A.ENDING),
    Transition("at_rest", (_A.MOVING, _A.GUIDED, _A.ENDING, _A.STOPPING), _A.REST),
    Transition("stop", _FREE_TO_END, _A.STOPPING),
    Transition("stop_j", _FREE_TO_END, _A.STOPPING),
    Transition("stop_l", _FREE_TO_END, _A.STOPPING),
    Transition("interruption", _FREE_TO_END, _A.STOPPING),
    Transition("power_off", _STANDING, _A.POWER_OFF),
    Transition("power_off", _DRIVEN_ON, _A.POWERING_OFF),
    Transition("at_rest", (_A.POWERING_OFF,), _A.POWER_OFF),
    Transition("power_off", (_A.BRAKING,), _A.BRAKING),
    Transition("brakes", _STANDING, _A.POWER_OFF),
    Transition("brakes", _DRIVEN_ON, _A.BRAKING),
    Transition("at_rest", (_A.BRAKING,), _A.POWER_OFF),
    Transition("protective_stop", (_A.REST,), _A.PROTECTIVE_STOP),
    Transition("protective_stop", _FREE_TO_END, _A.PROTECTIVE_STOPPING),
    Transition("at_rest", (_A.PROTECTIVE_STOPPING,), _A.PROTECTIVE_STOP),
    Transition("unlock_protective_stop", (_A.PROTECTIVE_STOP,), _A.REST),
    Transition("plant_failure", _DRIVEN, _A.PROTECTIVE_STOP),
    Transition("plant_failure", _LOSING_POWER, _A.POWER_OFF),
)
"""The table. It omits `simulation.reset`, which leads from every activity to REST, IDLE or POWER_OFF."""

_AFTER = {(row.trigger, source): row.target for row in TRANSITIONS for source in row.sources}


def after(activity: Activity, trigger: str) -> Activity | None:
    """Return the activity that a trigger leads to; None if the table has no row."""
    target = _AFTER.get((trigger, activity))
    return target if isinstance(target, Activity) else None


def diagram(states: type[StrEnum]) -> str:
    """Return these states' rows as a Mermaid diagram; one that all moving states share is drawn once."""
    arrows: dict[tuple[str, str], list[str]] = {}
    for row in TRANSITIONS:
        sources = [source for source in row.sources if isinstance(source, states)]
        names = [source.value for source in sources if source is not row.target]
        if states is Activity and set(_FREE_TO_END) <= set(sources):
            names = ["IN_MOTION", *(name for name in names if name not in _FREE_TO_END)]
        for name in names:
            arrows.setdefault((name, row.target.value), []).append(row.trigger)
    lines = [f"    {source} --> {target}: {', '.join(names)}" for (source, target), names in arrows.items()]
    if states is Activity:
        lines = ["    state IN_MOTION {", *(f"        {name}" for name in _FREE_TO_END), "    }", *lines]
    return "\n".join(("```mermaid", "stateDiagram-v2", *lines, "```"))

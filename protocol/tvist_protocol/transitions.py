"""What a robot can be doing, what leads from one to the other, and what is refused: one table.

The server goes by it, the protocol's README draws it. A trigger is a command, or something else: those
are named in `HAPPENINGS`. What a state has no row for is refused, or cannot happen there.
"""

from dataclasses import dataclass
from enum import StrEnum

from tvist_protocol.modes import RobotMode, SafetyMode


class Activity(StrEnum):
    """What the robot is doing."""

    POWER_OFF = "POWER_OFF"
    """No power: the brakes hold the arm."""
    IDLE = "IDLE"
    """Power, and the brakes still hold the arm."""
    REST = "REST"
    """The drives hold the arm: ready to move."""
    MOVING = "MOVING"
    """A point-to-point motion."""
    PAUSED = "PAUSED"
    """The same, coming to a standstill on its way or standing there."""
    STREAMING = "STREAMING"
    """A stream of set-points is followed."""
    ENDING = "ENDING"
    """A stream that has ended comes to rest through the filter."""
    STOPPING = "STOPPING"
    """A stop, past the filter."""
    POWERING_OFF = "POWERING_OFF"
    """The same, with the power to be taken once the arm rests."""
    BRAKING = "BRAKING"
    """The power is gone, and the brakes bring the arm to rest."""
    PROTECTIVE_STOPPING = "PROTECTIVE_STOPPING"
    """The same, as a protective stop."""
    PROTECTIVE_STOP = "PROTECTIVE_STOP"
    """A protective stop, at rest, until it is unlocked."""

    robot_mode: RobotMode
    """As RTDE numbers it."""
    moving: bool
    """Whether something moves, or is about to go on."""
    protective: bool
    """Whether it is a protective stop."""

    def safety_mode(self, *, reduced: bool) -> SafetyMode:
        """As RTDE numbers it, as long as the safety system has nothing graver.

        Args:
            reduced: Whether the speed is reduced.
        """
        if self.protective:
            return SafetyMode.PROTECTIVE_STOP
        return SafetyMode.REDUCED if reduced else SafetyMode.NORMAL


@dataclass(frozen=True, slots=True)
class Transition:
    """Rows of the table that a trigger has in common."""

    trigger: str
    """A command's `type`, or what happens."""
    sources: tuple[StrEnum, ...]
    target: StrEnum


class Control(StrEnum):
    """Who may move the robot."""

    FREE = "FREE"
    """Nobody: whoever asks gets it."""
    HELD = "HELD"
    """The client that holds the lease."""


class Stepping(StrEnum):
    """Who may let time pass, where it does not pass by itself."""

    FREE = "FREE"
    """Who has control."""
    HELD = "HELD"
    """The client that holds the clock, and nobody else."""


HAPPENINGS: dict[str, str] = {
    "power": "`power_on` with `release_brakes` false",
    "at_rest": "the shaped reference has come to rest",
    "interruption": "motion must end: the lease did, a set-point failed to come for 250 ms, something would meet",
    "brakes": "the power is gone, by a fault or the safety system: the brakes close at once",
    "protective_stop": "a drive's torque was beyond its limit for more than 10 ms, a shaper of one's own failed, or "
    "the fault was injected",
    "plant_failure": "the simulated arm's state was no longer finite: it was put at rest where its reference was",
    "lease_end": "nobody renewed the lease, or its client's liveliness token went",
    "clock_end": "the liveliness token of the client that held the clock went",
}

_A = Activity
_MOVING = frozenset(
    {
        _A.MOVING,
        _A.PAUSED,
        _A.STREAMING,
        _A.ENDING,
        _A.STOPPING,
        _A.POWERING_OFF,
        _A.BRAKING,
        _A.PROTECTIVE_STOPPING,
    }
)
_ROBOT_MODES = {
    _A.POWER_OFF: RobotMode.POWER_OFF,
    _A.BRAKING: RobotMode.POWER_OFF,
    _A.IDLE: RobotMode.IDLE,
}
for _activity in Activity:
    # Attributes of the members, since looking up another member costs ten times as much: these are asked every tick.
    _activity.robot_mode = _ROBOT_MODES.get(_activity, RobotMode.RUNNING)
    _activity.moving = _activity in _MOVING
    _activity.protective = _activity in {_A.PROTECTIVE_STOPPING, _A.PROTECTIVE_STOP}
_FREE_TO_END = (_A.MOVING, _A.PAUSED, _A.STREAMING, _A.ENDING, _A.STOPPING)
"""Motion that is not yet ending for good."""
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
    Transition("pause", (_A.MOVING, _A.PAUSED), _A.PAUSED),
    Transition("resume", (_A.PAUSED,), _A.MOVING),
    Transition("servo_start", (_A.REST,), _A.STREAMING),
    Transition("servo_stop", (_A.STREAMING,), _A.ENDING),
    Transition("at_rest", (_A.MOVING, _A.ENDING, _A.STOPPING), _A.REST),
    Transition("stop", _FREE_TO_END, _A.STOPPING),
    Transition("interruption", _FREE_TO_END, _A.STOPPING),
    Transition("power_off", _STANDING, _A.POWER_OFF),
    Transition("power_off", (*_FREE_TO_END, _A.POWERING_OFF, _A.PROTECTIVE_STOPPING), _A.POWERING_OFF),
    Transition("at_rest", (_A.POWERING_OFF,), _A.POWER_OFF),
    Transition("power_off", (_A.BRAKING,), _A.BRAKING),
    Transition("brakes", _STANDING, _A.POWER_OFF),
    Transition("brakes", (*_FREE_TO_END, _A.POWERING_OFF, _A.PROTECTIVE_STOPPING), _A.BRAKING),
    Transition("at_rest", (_A.BRAKING,), _A.POWER_OFF),
    Transition("protective_stop", (_A.REST,), _A.PROTECTIVE_STOP),
    Transition("protective_stop", _FREE_TO_END, _A.PROTECTIVE_STOPPING),
    Transition("at_rest", (_A.PROTECTIVE_STOPPING,), _A.PROTECTIVE_STOP),
    Transition("unlock_protective_stop", (_A.PROTECTIVE_STOP,), _A.REST),
    Transition("plant_failure", _DRIVEN, _A.PROTECTIVE_STOP),
    Transition("plant_failure", _LOSING_POWER, _A.POWER_OFF),
)
"""The table. `simulation.reset` is not in it: it puts the robot at REST, IDLE or POWER_OFF from everywhere."""

_AFTER = {(row.trigger, source): row.target for row in TRANSITIONS for source in row.sources}


def after(activity: Activity, trigger: str) -> Activity | None:
    """What a trigger leads to; None where the table has no row.

    Args:
        activity: What the robot is doing.
        trigger: A command's `type`, or one of `HAPPENINGS`.
    """
    target = _AFTER.get((trigger, activity))
    return target if isinstance(target, Activity) else None


def diagram(states: type[StrEnum]) -> str:
    """The part of the table that is about these states, as a Mermaid state diagram.

    What leads back to where it came from is left out; what all motion that may still be ended has in common is
    drawn once.

    Args:
        states: `Activity`, `Control` or `Stepping`.
    """
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

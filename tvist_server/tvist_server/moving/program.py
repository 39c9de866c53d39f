"""The program `follow.script`, which follows set-points on a robot, and the RTDE registers that it uses."""

from collections import deque
from collections.abc import Sequence
from enum import IntEnum
from importlib import resources
from string import Template

from tvist_server.rtde.wire import Field, WireType

NAME = "tvist_follow"  # name of the program, which robots display
SILENCE = 0.04  # longest time from the last set-point until the arm starts to brake [s]
FIRST = 10.0  # longest wait for the first set-point [s]
AWAY = 0.01  # largest distance of a joint from the first set-point [rad]
AGAIN = 0.016  # longest time without a set-point in which the arm keeps acceleration, then only velocity [s]
CLOSE = 3e-4  # distance from the set-points, and from their path, that is corrected within one period [rad]
AFTER_SHIFT = 1e-5
"""`CLOSE` after the program shifted the motion in time, since that error does not vanish by itself [rad]."""
FADE = 0.05  # time constant of the correction of larger distances [s]
LOOKAHEAD = 0.03
"""`lookahead_time` of `servoj` [s]: the smallest, since a larger lag only increases the lead that is sent."""
GAIN = 2000.0  # `gain` of `servoj` [1/s²]: the largest, for the same reason
MARGIN = 1.05  # largest ratio of the arm's speed to that of the fastest set-points [-]

JOINTS = 6
KEPT = 4  # number of set-points in a package: the newest and its predecessors
MAX_NUMBER = 2**30
"""Largest number of a set-point or run; the next is 1. Differences of numbers fit into a 32-bit register."""

NUMBER = 24
"""Input integer: number n of the newest set-point, increased by 1 in each control period; 0: none yet."""
ORDER = 25
"""Input integer: number of the run that may follow. Others end a run, but only -number ends a waiting one."""
SETPOINTS = 24  # first of the input doubles: joint angles of set-point n, then of n-1, n-2 and n-3 [rad]

STATE = 24  # output integer: a `ProgramState`
PLAYED = 25
"""Output integer: number of the set-point being played; 0 means `MAX_NUMBER`, -1 the one before, etc."""
ENDED = 26  # output integer: a `ProgramEnded`
ALONE = 27  # output integer: number of periods whose set-point was missing, so that the program extrapolated
LEFT_OUT = 28
"""Output integer: number of set-points never played, because they were late or the program fell behind."""
RUN = 29
"""Output integer: number of the run. It is written last, so the others belong to this run once it appears."""


class ProgramState(IntEnum):
    """State of the program."""

    NONE = 0
    WAITING = 1
    FOLLOWING = 2
    BRAKING = 3
    ENDED = 4


class ProgramEnded(IntEnum):
    """Why the program has braked."""

    NOT = 0
    ORDERED = 1
    SILENCE = 2  # no set-point has come for almost 40 ms, or none at all within the wait for the first
    AWAY = 3  # the first set-point is too far from the arm
    TOO_FAST = 4  # a set-point is not a number, or further from the one before than the speed cap permits
    LOST = 5  # the program was paused or fell behind, or the numbers do not continue
    STRAYED = 6  # the arm was too far from the commanded position


INPUTS: dict[str, WireType] = {
    f"input_int_register_{NUMBER}": WireType.INT32,
    f"input_int_register_{ORDER}": WireType.INT32,
    **{f"input_double_register_{SETPOINTS + place}": WireType.DOUBLE for place in range(KEPT * JOINTS)},
}
"""Registers that tvist writes, in the order of a package's values."""
OUTPUTS: dict[str, Field] = dict.fromkeys(
    [f"output_int_register_{place}" for place in (STATE, PLAYED, ENDED, ALONE, LEFT_OUT, RUN)],
    Field(WireType.INT32),
)
"""Registers that tvist reads."""


def program(run: int, *, speed: float, deceleration: float) -> str:
    """Return the text of the program, which only uses functions of e-Series (5.9 or later) and CB3 (3.14 or later).

    Args:
        run: Number of this run, 1 to `MAX_NUMBER`, which the program reports.
        speed: Fastest set-points; faster ones end the program [rad/s].
        deceleration: Deceleration of the fastest joint when it ends [rad/s²].
    """
    for name, value, least, most in (
        ("run", run, 1, MAX_NUMBER),
        ("speed", speed, 0.01, 10.0),
        ("deceleration", deceleration, 0.1, 100.0),
    ):
        if not least <= value <= most:
            raise ValueError(f"{name} is {value:g}: must be {least:g} to {most:g}")
    given = {
        "name": NAME, "run": run, "speed": float(MARGIN * speed), "deceleration": float(deceleration),
        "lookahead": LOOKAHEAD, "gain": GAIN, "silence": SILENCE, "first": FIRST, "away": AWAY,
        "fade": FADE, "again": AGAIN, "close": CLOSE, "after_shift": AFTER_SHIFT, "NUMBER": NUMBER, "ORDER": ORDER,
        "SETPOINTS": SETPOINTS, "STATE": STATE, "PLAYED": PLAYED, "ENDED": ENDED, "ALONE": ALONE,
        "LEFT_OUT": LEFT_OUT, "RUN": RUN, "MOST": MAX_NUMBER,
    }  # fmt: skip
    given |= {f"ended_{one.name.lower()}": int(one) for one in ProgramEnded}
    given |= {f"state_{one.name.lower()}": int(one) for one in ProgramState}
    text = resources.files("tvist_server.moving").joinpath("follow.script").read_text("utf-8")
    return Template(text).substitute(given)


class Window:
    """Numbers set-points from 1, one per control period of the robot, and keeps those of the next package."""

    def __init__(self) -> None:
        self.number = 0  # number of the newest set-point; 0 before the first
        self._kept = deque[Sequence[float]](maxlen=KEPT)

    @property
    def newest(self) -> Sequence[float] | None:
        """The newest set-point, shape (6,) [rad]; None before the first."""
        return self._kept[0] if self._kept else None

    def add(self, setpoint: Sequence[float]) -> None:
        """Add the next set-point, shape (6,) [rad]; the first one also fills the history."""
        self.number = self.number % MAX_NUMBER + 1
        self._kept.extendleft([setpoint] * (1 if self._kept else KEPT))

    def values(self, order: int) -> tuple[float, ...]:
        """Return an input package; `order` is the run that may follow, or its negative to end it."""
        kept = self._kept or [(0.0,) * JOINTS] * KEPT
        return self.number, order, *(angle for one in kept for angle in one)

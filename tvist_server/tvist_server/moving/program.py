"""The program that follows set-points on a robot, and the registers through which it gets them and says what happens.

All registers are of the upper range, which UR leaves to clients of RTDE. `follow.script` is the program, with `$NAME`
for each number that is given here.
"""

from collections import deque
from collections.abc import Sequence
from enum import IntEnum
from importlib import resources
from string import Template

from tvist_server.rtde.wire import Field, Wire

NAME = "tvist_follow"
"""Name of the program, which robots show."""
SILENCE = 0.04
"""Longest time from the arrival of the last set-point until the arm begins to brake [s]."""
FIRST = 10.0
"""Time to wait for the first set-point [s]."""
AWAY = 0.01
"""Largest distance of a joint from the first set-point [rad]."""
AGAIN = 0.016
"""Longest time from the arrival of the last set-point in which the next is expected to be on its way again [s]."""
CLOSE = 3e-4
"""Distance from the set-points, and from their way in a period, that is made up for in a period [rad]."""
AFTER_SHIFT = 1e-5
"""The same after the program has shifted the motion in time, which is no error that is soon over [rad]."""
FADE = 0.05
"""Time constant with which a distance from the set-points fades [s]."""
MARGIN = 1.05
"""Speed of the arm over that of the fastest set-points, at most."""

JOINTS = 6
KEPT = 4
"""Number of set-points in a package: the newest and those before it."""
MOST = 2**30
"""Largest number of a set-point, and of a run; 1 follows it. Differences fit into the 32 bits of a register."""

NUMBER = 24
"""Input integer: number n of the newest set-point, 1 more in each control period of the robot; 0: none yet."""
ORDER = 25
"""Input integer: number of the run whose program is to follow; any other ends it. Its negative also ends the wait."""
SETPOINTS = 24
"""First of the input doubles: joint angles of set-point n, then of n-1, n-2 and n-3 [rad]."""

STATE = 24
"""Output integer: a `State`."""
PLAYED = 25
"""Output integer: number of the set-point whose turn it is; 0 and less stand for `MOST` and those before it."""
ENDED = 26
"""Output integer: an `Ended`."""
ALONE = 27
"""Output integer: number of periods in which the set-point whose turn it was had not come, so the arm went on alone."""
LEFT_OUT = 28
"""Output integer: number of set-points that were never played, since they came too late or the program fell behind."""
RUN = 29
"""Output integer: number of the run. The others are of this run once it is there, since it is written last."""


class State(IntEnum):
    """What the program does."""

    NONE = 0
    WAITING = 1
    """Waits for the first set-point."""
    FOLLOWING = 2
    BRAKING = 3
    ENDED = 4


class Ended(IntEnum):
    """Why the program has braked, from then on."""

    NOT = 0
    ORDERED = 1
    SILENCE = 2
    """No set-point has come for almost 40 ms, or none at all in the time to wait for the first."""
    AWAY = 3
    """The first set-point is too far from the arm."""
    TOO_FAST = 4
    """A set-point is further from the one before than the speed cap permits, or is no number."""
    LOST = 5
    """The program was paused or fell behind, or the numbers do not continue."""
    STRAYED = 6
    """The arm did not follow the program."""


INPUTS: dict[str, Wire] = {
    f"input_int_register_{NUMBER}": Wire.INT32,
    f"input_int_register_{ORDER}": Wire.INT32,
    **{f"input_double_register_{SETPOINTS + place}": Wire.DOUBLE for place in range(KEPT * JOINTS)},
}
"""What is written, in the order of a package's values."""
OUTPUTS: dict[str, Field] = dict.fromkeys(
    [f"output_int_register_{place}" for place in (STATE, PLAYED, ENDED, ALONE, LEFT_OUT, RUN)],
    Field(Wire.INT32),
)
"""What is read."""


def program(run: int, *, speed: float, deceleration: float, lookahead: float, gain: float) -> str:
    """Return the text of the program, which uses only functions of e-Series (5.9 or later) and CB3 (3.14 or later).

    Args:
        run: Number of this run, 1 to `MOST`, which the program says in its registers.
        speed: Fastest set-points; faster ones end the program [rad/s].
        deceleration: Deceleration of the fastest joint when it ends [rad/s^2].
        lookahead: `lookahead_time` of `servoj`, 0.03 to 0.2 [s].
        gain: `gain` of `servoj`, 100 to 2000.

    Raises:
        ValueError: An argument is outside its range.
    """
    for name, value, least, most in (
        ("run", run, 1, MOST),
        ("speed", speed, 0.01, 10.0),
        ("deceleration", deceleration, 0.1, 100.0),
        ("lookahead", lookahead, 0.03, 0.2),
        ("gain", gain, 100.0, 2000.0),
    ):
        if not least <= value <= most:
            raise ValueError(f"{name} is {value:g}: must be {least:g} to {most:g}")
    given = {
        "name": NAME, "run": run, "speed": float(MARGIN * speed), "deceleration": float(deceleration),
        "lookahead": float(lookahead), "gain": float(gain), "silence": SILENCE, "first": FIRST, "away": AWAY,
        "fade": FADE, "again": AGAIN, "close": CLOSE, "after_shift": AFTER_SHIFT, "NUMBER": NUMBER, "ORDER": ORDER,
        "SETPOINTS": SETPOINTS, "STATE": STATE, "PLAYED": PLAYED, "ENDED": ENDED, "ALONE": ALONE,
        "LEFT_OUT": LEFT_OUT, "RUN": RUN, "MOST": MOST,
    }  # fmt: skip
    given |= {f"ended_{one.name.lower()}": int(one) for one in Ended}
    given |= {f"state_{one.name.lower()}": int(one) for one in State}
    text = resources.files("tvist_server.moving").joinpath("follow.script").read_text("utf-8")
    return Template(text).substitute(given)


class Window:
    """Numbers set-points from 1 on, one for each control period of the robot, and keeps those of the next package."""

    def __init__(self) -> None:
        self.number = 0
        """Number of the newest set-point; 0 before the first."""
        self._kept = deque[Sequence[float]](maxlen=KEPT)

    @property
    def newest(self) -> Sequence[float] | None:
        """The newest set-point, shape (6,) [rad]; None before the first."""
        return self._kept[0] if self._kept else None

    def add(self, setpoint: Sequence[float]) -> None:
        """Add the next set-point, joint angles of shape (6,) [rad]. Before the first one, the arm counts as there."""
        self.number = self.number % MOST + 1
        self._kept.extendleft([setpoint] * (1 if self._kept else KEPT))

    def values(self, order: int) -> tuple[float, ...]:
        """Return the values of an input package, in the order of `INPUTS`; zeros before the first set-point.

        Args:
            order: Number of the run that is to follow; its negative to end it.
        """
        kept = self._kept or [(0.0,) * JOINTS] * KEPT
        return self.number, order, *(angle for one in kept for angle in one)

"""The registers through which a robot gets set-points and says what became of them: numbers and meanings.

All are of the upper range, which UR leaves to clients of RTDE.
"""

from enum import IntEnum

from tvist_server.rtde.wire import Field, Wire

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

"""Set-points that a robot behind a bridge did not have in time, as its program counts them and as its rows show."""

import random
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from proof.bridge.course import Watch
from proof.bridge.faults import NEAR, ROBOT, SPEED, SWING
from proof.bridge.link import LinkProcess
from proof.bridge.processes import bridge_to, hidden_robot, until_held
from tvist_client import MotionStoppedError, RefusedError
from tvist_plant.plant import PERIOD
from tvist_server.moving.registers import ALONE, LEFT_OUT, NUMBER, PLAYED, RUN, STATE, State
from tvist_server.rtde.client import Row

EVERY = 10.0
"""Time after which rows are counted [s]."""


@dataclass
class Counted:
    """Counts of one run."""

    periods: int = 0
    """Control periods in which the program followed."""
    alone: int = 0
    """Those in which the set-point whose turn it was had not come."""
    played: set[int] = field(default_factory=set)
    """Numbers of the set-points that were played."""
    late: int = 0
    """Periods in which no newer set-point had come."""
    bunched: int = 0
    """Set-points that came together with a newer one."""
    said: tuple[int, int] = 0, 0
    """What the program has counted since the first of these periods: periods alone, and set-points left out."""
    before: tuple[int, int] = 0, 0
    """What it had counted before."""

    @property
    def left_out(self) -> int:
        """Number of set-points between the first and the last one that were not played."""
        return max(self.played) - min(self.played) + 1 - len(self.played) if self.played else 0

    @property
    def equal(self) -> bool:
        """Whether the program counts the same as its rows show."""
        return self.said == (self.alone, self.left_out)


class Count:
    """Counts a robot's rows, run by run."""

    def __init__(self) -> None:
        self.runs: dict[int, Counted] = {}
        self.missing = 0
        """Number of rows that have not come."""
        self._time, self._number, self._run = 0.0, 0, 0

    def take(self, rows: Iterable[Row]) -> None:
        """Take the next rows."""
        for row in rows:
            time = row["timestamp"][0]
            self.missing += round((time - self._time) / PERIOD) - 1 if self._time else 0
            self._time = time
            state, played, alone, left_out, run = (
                int(row[f"output_int_register_{place}"][0]) for place in (STATE, PLAYED, ALONE, LEFT_OUT, RUN)
            )
            number = int(row[f"input_int_register_{NUMBER}"][0])
            if state == State.FOLLOWING and played:
                own = int(number < played)
                here = self.runs.setdefault(run, Counted(before=(alone - own, left_out)))
                if here.periods:
                    here.late += number == self._number
                    here.bunched += max(number - self._number - 1, 0)
                here.periods += 1
                here.alone += own
                here.played |= set() if own else {played}
                here.said = alone - here.before[0], left_out - here.before[1]
            self._number = number


def report(minutes: float, seed: int, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return the counts of some minutes in which a robot moves behind a bridge."""
    draw, count = random.Random(seed), Count()  # noqa: S311  nothing secret
    with (
        hidden_robot(ROBOT, seed) as arm,
        arm.connect() as there,
        LinkProcess(ROBOT, NEAR, seed),
        Watch(ROBOT) as watch,
        bridge_to(NEAR) as bridge,
        bridge.connect() as robot,
        robot.control("count") as control,
    ):
        centre = list(there.state().target_q)
        until_held(robot, control, SPEED)
        begun = counted = time.monotonic()
        while time.monotonic() - begun < 60.0 * minutes:
            goal = [q + draw.uniform(-SWING, SWING) for q in centre]
            try:
                control.move_j(goal, velocity=SPEED)
            except (MotionStoppedError, RefusedError):
                until_held(robot, control, SPEED)
            if time.monotonic() - counted > EVERY:
                count.take(watch.taken())
                counted = time.monotonic()
                tell(f"{(counted - begun) / 60.0:.1f} of {minutes:g} minutes")
        count.take(watch.taken())
        missed = robot.state().missed_ticks
    rows = [
        {
            "periods": one.periods,
            "alone": one.alone,
            "alone_said": one.said[0],
            "left_out": one.left_out,
            "left_out_said": one.said[1],
            "late": one.late,
            "bunched": one.bunched,
            "equal": one.equal,
        }
        for one in count.runs.values()
    ]
    return {"runs": rows, "rows_missing": count.missing, "missed_ticks": missed}


def tables(result: dict[str, Any]) -> list[tuple[list[str], list[list[str]]]]:
    """Return the counts as tables."""
    columns = list(result["runs"][0])
    rows = [[str(row[name]) for name in columns] for row in result["runs"]]
    other = ["rows_missing", "missed_ticks"]
    return [(columns, rows), (other, [[str(result[name]) for name in other]])]

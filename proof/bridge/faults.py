"""What a robot that is moved through a bridge does at random moments at which something goes wrong."""

import contextlib
import random
import signal
import socket
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from proof.bridge.course import STILL, Course, Watch, wait_for
from proof.bridge.link import LinkProcess
from proof.bridge.processes import Server, bridge_to, hidden_robot, until_done, until_held
from tvist_client import MotionStoppedError
from tvist_client.blocking import Robot
from tvist_client.blocking_classes import Arm
from tvist_server.moving.registers import Ended, State

ROBOT, NEAR = "127.42.7.1", "127.42.7.2"
"""Addresses of the robot and of the link that stands for it."""
SPEED, SWING = 0.4, 0.3
"""Speed of the moves [rad/s], and how far the base turns either way [rad]."""
EXPECTED = {
    "kill": "",
    "freeze": "no set-point reached it",
    "cut": "the robot at",
    "pause": "its program was paused",
    "protective stop": "has made a protective stop",
}
"""Kinds of faults, and what the bridge has to say of each; a bridge that was killed says nothing."""
LIMITS = {"braking_ms": 40.0, "step_mrad": 2.0, "moved_mrad": 0.1}


class Trial(NamedTuple):
    """What one fault has led to."""

    fault: str
    braking: float | None
    """Time from the last set-point's arrival until braking begins, where set-points stop [s]."""
    step: float
    """Largest way of a joint's target in a period, from the fault until the next motion has ended [rad]."""
    acceleration: float
    """Largest acceleration of a joint's target in that time [rad/s^2]."""
    moved: float
    """Largest way of a joint's target from its rest until the bridge was told to go on [rad]."""
    ended: str
    """Why the program says it has ended."""
    told: bool
    """Whether the bridge said why it does not follow any more."""
    missing: int
    """Number of rows of the robot that were not seen."""


class Faults:
    """Lets things go wrong.

    Args:
        seed: Seed of the moments, and of what the hidden robot has.
        tell: Called with what a bridge said instead of why it stopped.
        speed: Speed of the robot's time, for machines on which others compute; all times are by its clock.
    """

    def __init__(self, seed: int, tell: Callable[[str], None], speed: float = 1.0) -> None:
        self._tell = tell
        self._random, self._seed, self._speed = random.Random(seed), seed, speed  # noqa: S311  nothing secret
        self.others = 0
        """Number of stops between the faults, as on a machine that is too busy."""

    def run(self, moments: int, progress: Callable[[str], None]) -> Sequence[Trial]:
        """Return what the faults have led to, which take turns."""
        trials = list[Trial]()
        with hidden_robot(ROBOT, self._seed, self._speed) as arm:
            with arm.connect() as there:
                self._centre = list(there.state().target_q)
            with LinkProcess(ROBOT, NEAR, self._seed, 1.0 / self._speed) as link, Watch(ROBOT) as watch:
                bridge = bridge_to(NEAR)
                try:
                    for number in range(moments):
                        fault = list(EXPECTED)[number % len(EXPECTED)]
                        trial, bridge = self._try(fault, bridge, link, watch)
                        trials.append(trial)
                        progress(fault)
                finally:
                    bridge.__exit__()
        return trials

    def _try(self, fault: str, bridge: Server, link: LinkProcess, watch: Watch) -> tuple[Trial, Server]:
        with bridge.connect() as robot, robot.control("faults") as arm:
            first, said = self._until_moving(bridge, watch, robot, arm)
            going_on = self._break(fault, bridge, link)
            wait_for(lambda: not watch.plays and watch.speed < STILL, 20.0, f"rest after {fault}")
            rested = watch.count
            braking = watch.since(first).silence if fault in {"kill", "freeze", "cut"} else None
            time.sleep(self._random.uniform(0.0, 0.3))
            going_on()
            if fault != "kill":
                with contextlib.suppress(TimeoutError):
                    wait_for(lambda: EXPECTED[fault] in bridge.said[said:], 10.0, f"words on {fault}")
            time.sleep(0.2 / self._speed)
            waited = watch.since(rested)
            told = EXPECTED[fault] in bridge.said[said:]
            if not told:
                self._tell(f"{fault}, of which the bridge said: {bridge.said[said:]}")
            ended = Ended(int(waited.ended[-1])).name
            if fault != "kill":
                until_done(arm.unlock_protective_stop if fault == "protective stop" else arm.power_on)
                self._go_on(robot, arm)
        if fault == "kill":
            bridge.__exit__()
            bridge = bridge_to(NEAR)
            with bridge.connect() as robot, robot.control("faults") as arm:
                self._go_on(robot, arm)
        return self._judged(fault, watch.since(first), waited, braking, ended, told=told), bridge

    def _judged(
        self, fault: str, course: Course, waited: Course, braking: float | None, ended: str, *, told: bool
    ) -> Trial:
        moved = float(abs(waited.q - waited.q[0]).max())
        step, acceleration = course.largest_step, course.largest_acceleration
        return Trial(fault, braking, step, acceleration, moved, ended, told, course.missing)

    def _until_moving(self, bridge: Server, watch: Watch, robot: Robot, arm: Arm) -> tuple[int, int]:
        """Move until a random moment, unless the robot stops before; return numbers of the row and letter before it."""
        while True:
            until_held(robot, arm, SPEED)
            first, said = watch.count, len(bridge.said)
            self._begin_a_move(robot, arm)
            time.sleep(self._random.uniform(0.05, 1.2) / self._speed)
            if watch.state is State.FOLLOWING:
                return first, said
            self.others += 1

    def _begin_a_move(self, robot: Robot, arm: Arm) -> None:
        goal = list(self._centre)
        goal[0] += SWING if robot.state().target_q[0] < self._centre[0] else -SWING
        goal[5] += self._random.uniform(-SWING, SWING)
        arm.move_j(goal, velocity=SPEED, wait=False)

    def _go_on(self, robot: Robot, arm: Arm) -> None:
        while True:
            until_held(robot, arm, SPEED)
            goal = list(robot.state().target_q)
            goal[0] += 0.02 if goal[0] < self._centre[0] else -0.02
            try:
                arm.move_j(goal, velocity=SPEED)
            except MotionStoppedError:
                self.others += 1
            else:
                return

    def _break(self, fault: str, bridge: Server, link: LinkProcess) -> Callable[[], object]:
        """Let something go wrong; return what puts it right."""
        match fault:
            case "kill":
                bridge.signal(signal.SIGKILL)
                return lambda: None
            case "freeze":
                bridge.signal(signal.SIGSTOP)
                time.sleep(self._random.uniform(0.06, 0.5) / self._speed)
                return lambda: bridge.signal(signal.SIGCONT)
            case "cut":
                how, back = self._random.choice((("cut", "restore"), ("hold", "flow")))
                link.do(how)
                return lambda: link.do(back)
            case "pause":
                _dashboard("pause")
                return lambda: _dashboard("play")
            case _:
                _secondary("sec stopping():\n  protective_stop()\nend\n")
                return _unlock


def _dashboard(line: str) -> str:
    with socket.create_connection((ROBOT, 29999), 10.0) as connection, connection.makefile("rw") as spoken:
        spoken.readline()
        print(line, file=spoken, flush=True)
        return spoken.readline().strip()


def _unlock() -> None:
    """Unlock the stop, which takes until it is five seconds old, and let the program go on, as a person may."""
    wait_for(lambda: _dashboard("unlock protective stop") == "Protective stop releasing", 20.0, "unlocking")
    _dashboard("play")


def _secondary(text: str) -> None:
    with socket.create_connection((ROBOT, 30002), 10.0) as connection:
        connection.sendall(text.encode())


def report(trials: Sequence[Trial], others: int) -> dict[str, Any]:
    """Return the largest figures of each fault, and the number of stops beside them."""
    rows = []
    for fault in EXPECTED:
        of_it = [one for one in trials if one.fault == fault]
        if not of_it:
            continue
        braking = [1e3 * one.braking for one in of_it if one.braking is not None]
        rows.append(
            {
                "fault": fault,
                "moments": len(of_it),
                "braking_ms": max(braking, default=None),
                "step_mrad": max(1e3 * one.step for one in of_it),
                "acceleration": max(one.acceleration for one in of_it),
                "moved_mrad": max(1e3 * one.moved for one in of_it),
                "ended": sorted({one.ended for one in of_it}),
                "told": sum(one.told for one in of_it),
                "rows_missing": sum(one.missing for one in of_it),
            }
        )
    return {"faults": rows, "other_stops": others}


def broken(result: dict[str, Any]) -> list[str]:
    """Return the figures beyond their limits, in words."""
    return [
        f"{row['fault']}: {name} is {row[name]:.3g}, and should be at most {limit:g}"
        for row in result["faults"]
        for name, limit in LIMITS.items()
        if row[name] is not None and row[name] > limit
    ] + [
        f"{row['fault']}: the bridge said {row['told']} times why"
        for row in result["faults"]
        if row["told"] < row["moments"]
    ]


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], Sequence[Sequence[str]]]]:
    """Return the figures as tables."""
    columns = list(result["faults"][0])
    rows = [[_shown(row[name]) for name in columns] for row in result["faults"]]
    return [(columns, rows), (["other stops"], [[str(result["other_stops"])]])]


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(value)
    return "–" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)

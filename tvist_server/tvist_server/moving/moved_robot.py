"""A robot that is moved: a plant whose drives are another controller's."""

import math
import time

import numpy as np
from msgspec.structs import replace

from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import Floats
from tvist_plant.plant import PERIOD, Condition, Halt, Measurement, Sight
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_server.moving.commanded_robot import CommandedRobot
from tvist_server.moving.ports import ports_of
from tvist_server.moving.program import program
from tvist_server.moving.registers import ENDED, INPUTS, RUN, STATE, Order, State
from tvist_server.moving.upload import Upload
from tvist_server.moving.window import Window
from tvist_server.watching.place import Place

SILENT = 0.08
"""Time without a row after which the robot is lost, and its program has braked long since [s]."""
MOST = 50
BEGINS = 5.0
"""Longest time in which the program has to begin [s]."""


class MovedRobot:
    """Moves one robot.

    Args:
        place: Where it is.
        description: The robot file.
        payload: Payload that it has to carry.

    Raises:
        PlantError: It may not be moved; the message says why, and what to do.
    """

    def __init__(self, place: Place, description: RobotDescription, payload: Payload, *, cap: float) -> None:
        self._robot = CommandedRobot(place, description, payload)
        self._place, self._ports, self._description, self._cap = place, ports_of(place), description, cap
        self._sight = self._robot.first()
        self._tick, self._owed = self._sight.tick, 0
        self._heard, self._own_due = -math.inf, 0.0
        self._upload: Upload | None = None
        self._window: Window | None = None
        self._run = int(time.time()) % 1_000_000_000
        self._begun_at, self._plays = 0.0, False
        self._ready, self._wanted = False, False
        self._halted: Halt | None = None

    # ------------------------------------------------------------------ what the controller asks of any plant

    @property
    def payload(self) -> Payload:
        """Payload that the robot was told."""
        return self._robot.payload

    def described(self) -> RobotDescription:
        """Return the robot file with narrower limits."""
        limits = self._description.limits
        velocity = tuple(min(most, self._cap) for most in limits.velocity)
        return replace(self._description, limits=replace(limits, velocity=velocity))

    def seen(self) -> Sight:
        """Return what it said last."""
        return self._sight

    def measure(self) -> Measurement:
        """Return where the robot's own target stands."""
        q = np.array(self._robot.said["target_q"])
        return replace_measured(self._sight.measured, q, self._tick)

    def step(self, command: DriveCommand) -> Measurement:
        """Write a set-point; return the latest measurements."""
        if self._ready and self._window is not None:
            self._window.add(command.q.tolist())
        if self._owed == 0:
            self._write()
        return replace_measured(self._sight.measured, self._sight.measured.q, self._tick)

    def wait(self, timeout: float) -> bool:
        """Wait until the next period begins by the robot's clock, or by ours while it is silent."""
        until = time.monotonic() + timeout
        while not self._begins(until):
            if time.monotonic() >= until:
                return False
        self._tick += 1
        return True

    def _begins(self, until: float) -> bool:
        """Wait for a row, or for a period of ours; return whether a period has begun."""
        if self._owed > 0:
            self._owed -= 1
            return True
        now = time.monotonic()
        silent = now - self._heard > SILENT
        until = min(until, self._own_due if silent else self._heard + SILENT)
        if self._robot.wait(max(until - now, 0.0)):
            return self._take(self._robot.sight())
        now = time.monotonic()
        if now - self._heard <= SILENT:
            return False
        if not silent:
            self._own_due = now
            if self._wanted:
                self._let_go("the robot has fallen silent, so that its program has stopped it", 0)
        if now < self._own_due:
            return False
        self._own_due = max(self._own_due + PERIOD, now - PERIOD)
        return True

    def _take(self, sight: Sight) -> bool:
        """Take a row; return whether it begins a period."""
        self._sight = sight
        if sight.modes[0] == RobotMode.DISCONNECTED:
            return False
        self._heard = time.monotonic()
        if self._wanted and self._upload is None and self._halted is None:
            self._begin()
        self._judge(sight)
        passed = sight.tick - self._tick
        if passed <= 0:
            return False
        self._owed = min(passed, MOST) - 1
        self._tick = sight.tick - self._owed - 1
        return True

    # ------------------------------------------------------------------ the program

    def switch(self, *, power: bool, brakes: bool) -> None:
        """Begin to hold the arm by our program, or let it go."""
        self.stop()
        self._wanted, self._halted = power and not brakes, None

    def stop(self) -> None:
        """Let the program brake, and end."""
        self._write(Order.END)
        self._wanted = False
        self._end()

    @property
    def condition(self) -> Condition:
        """Whether the program follows."""
        return Condition(self._ready, halt=self._halted)

    def close(self) -> None:
        """Let the robot go."""
        self.stop()
        self._robot.close()

    def _begin(self) -> None:
        self._run += 1
        self._window = Window()
        self._robot.write((0,) * len(INPUTS))  # what an earlier run has left there is not played
        text = program(self._run, speed=self._cap, deceleration=4.0, lookahead=0.03, gain=2000.0)
        self._upload = Upload(self._ports, text)
        self._begun_at, self._plays = time.monotonic(), False

    def _end(self) -> None:
        if self._upload is not None:
            self._upload.close()
        self._upload = self._window = None
        self._ready = False

    def _write(self, order: Order = Order.FOLLOW) -> None:
        if self._window is not None and self._window.number:
            self._robot.write(self._window.values(order))

    def _let_go(self, why: str, safety: int) -> None:
        self.stop()
        self._halted = Halt(why, safety)

    def _judge(self, sight: Sight) -> None:
        """See what has become of the program."""
        if self._upload is None or self._window is None:
            return
        _, safety, runtime = sight.modes
        state, ended, run = (
            int(self._robot.said[f"output_int_register_{k}"][0]) for k in (STATE, ENDED, RUN)
        )
        ours, playing = run == self._run, runtime == RuntimeState.PLAYING
        self._plays |= playing
        if safety not in {SafetyMode.NORMAL, SafetyMode.REDUCED}:
            self._let_go(f"the robot reports safety_mode {safety}", safety)
        elif self._upload.trouble is not None:
            self._let_go(f"the robot at {self._place} cannot be moved: {self._upload.trouble}", safety)
        elif ours and state == State.FOLLOWING and playing:
            self._ready = True
        elif ours and state == State.WAITING and playing:
            self._window.add(self._robot.said["target_q"])
        elif ours and self._plays:
            self._let_go(f"the program has ended ({state}, {ended}, {runtime})", safety)
        elif time.monotonic() - self._begun_at > BEGINS:
            self._let_go(f"the program has not begun within {BEGINS:g} s", safety)


def replace_measured(measured: Measurement, q: Floats, tick: int) -> Measurement:
    """Return a measurement with other angles, and the time of a tick."""
    return Measurement(q, measured.qd, measured.moment, measured.accelerometer, timestamp=tick * PERIOD)

"""The program which follows set-points: on a whole robot in lockstep, and alone, which is faster."""

import numpy as np
from tests.controller.robots import NoArm, Robot
from tests.controller.scripts import URSIM

from tvist_controller.programs.library import known_signatures
from tvist_controller.programs.player import GUIDED
from tvist_protocol.io import Registers, SetRegisters
from tvist_protocol.programs import ProgramRun
from tvist_server.moving import program as r
from tvist_server.moving.program import MARGIN, Window, program
from tvist_urscript import EVALUATIONS, Array, Machine, compile_script

H, RUN = 0.002, 71
HERE = np.array(URSIM)
PATIENCE = 20
"""Periods of 2 ms within which braking has to begin."""
LAG = 17
"""Periods by which the arm of a program alone follows `servoj`."""


class Followed:
    """What the program has done.

    Attributes:
        told: What `servoj` was told, one posture a call, and the tick of each.
        numbers: The number that the program said in each of these ticks.
        alone: The number of periods without a set-point that it said then.
    """

    def __init__(self, speed, deceleration, step):
        self.speed, self.most, self.tick = speed, MARGIN * speed * step, 0
        self.told, self.at, self.numbers, self.alone = [], [], [], []
        self.text = program(RUN, speed=speed, deceleration=deceleration, lookahead=0.03, gain=2000.0)
        if step != H:
            self.text = self.text.replace("get_steptime()", str(step))

    def steps(self, count=1):
        for _ in range(count):
            before = len(self.told)
            self._step()
            self.tick += 1
            if len(self.told) > before:
                self.numbers.append(self.output(r.PLAYED))
                self.alone.append(self.output(r.ALONE))

    def _tell(self, q):
        self.told.append(np.array(q.items))
        self.at.append(self.tick)

    def play(self, packages, arrivals):
        """Let packages arrive, by their places in a list: those of each tick in turn."""
        for come in arrivals:
            for place in come:
                self.write(*packages[place])
            self.steps()

    def until_ended(self, most=2000):
        for _ in range(most):
            self.steps()
            if self.state is r.State.ENDED:
                return self
        raise AssertionError("it goes on")

    @property
    def state(self):
        return r.State(self.output(r.STATE))

    @property
    def ended(self):
        return r.Ended(self.output(r.ENDED))

    def assert_kept(self, last_came):
        """Check all that holds whatever came; `last_came` is the tick of the last new number."""
        assert (np.diff(self.at) == 1).all(), "a period in which it tells `servoj` nothing holds the arm back"
        told = np.array([HERE, *self.told])
        assert np.abs(np.diff(told, axis=0)).max(initial=0.0) <= self.most * (1 + 1e-9)
        played = np.array(self.numbers)[np.diff([0, *self.alone]) == 0]
        assert set(np.diff([0, *self.alone])) <= {0, 1}
        if len(played):
            assert self.output(r.LEFT_OUT) == played[-1] - played[0] + 1 - len(set(played))
        assert (np.diff(played) >= 0).all()
        if self.state is r.State.ENDED:
            assert self.ended is not r.Ended.NOT
            assert not self.at or self.at[-1] < last_came + PATIENCE


class OnRobot(Followed):
    """The program on a robot without an arm."""

    def __init__(self, *, speed=0.5, deceleration=4.0, step=H):
        super().__init__(speed, deceleration, step)
        self.robot = Robot(plant=NoArm(), q=URSIM, shaper="none")
        functions = self.robot.controller.programs._functions
        servoj = functions["servoj"]

        def listening(q, *others):
            self._tell(q)
            yield from servoj(q, *others)

        functions["servoj"] = listening
        self.reply = self.robot.send(ProgramRun, text=self.text)
        self.steps(2)

    def _step(self):
        self.robot.tick()

    def write(self, n, order, *doubles):
        also = (Registers(bank="input_double", first=r.SETPOINTS, values=tuple(map(float, doubles))),)
        self.robot.send(
            SetRegisters, bank="input_int", first=r.NUMBER, values=(int(n), int(order)), also=also, token=None
        )

    def output(self, place):
        return self.robot.controller.io().output_int_register[place]

    @property
    def targets(self):
        return np.array([state.target_q for state in self.robot.states])

    def assert_kept(self, last_came):
        super().assert_kept(last_came)
        limits = self.robot.controller.cycle.description.limits
        speeds = np.diff(self.targets, axis=0) / H
        assert np.abs(speeds).max() <= MARGIN * self.speed * (1 + 1e-6)
        assert np.abs(np.diff(speeds, axis=0) / H).max() <= min(limits.acceleration) * (1 + 1e-6)
        if self.state is r.State.ENDED:
            assert (speeds[-1] == 0.0).all()
            assert self.robot.controller.programs.state != "PLAYING"


class Alone(Followed):
    """The program with nothing but registers, on an arm that follows some periods later."""

    def __init__(self, *, speed=0.5, deceleration=4.0, before=None, lag=LAG, step=H):
        super().__init__(speed, deceleration, step)
        self._ints, self._doubles, self._outputs = [0] * 48, [0.0] * 48, [0] * 48
        functions = {
            "get_steptime": lambda: H,
            "sync": lambda: iter([None]),
            "read_input_integer_register": lambda place: self._ints[place],
            "read_input_float_register": lambda place: self._doubles[place],
            "write_output_integer_register": self._outputs.__setitem__,
            "get_target_joint_positions": lambda: Array(tuple(([HERE] * lag + self.told)[-lag].tolist())),
            "servoj": self._servoj,
            "stopj": lambda _: iter([None] * 5),
            "textmsg": lambda *_: None,
        }
        self._machine = Machine(compile_script(self.text, known_signatures()), functions)
        if before is not None:
            self.write(*before)
        self.steps(2)

    def _servoj(self, q, *_):
        self._tell(q)
        yield

    def _step(self):
        if self._machine.running:
            self._machine.resume(EVALUATIONS - GUIDED)

    def write(self, n, order, *doubles):
        self._ints[r.NUMBER], self._ints[r.ORDER] = int(n), int(order)
        self._doubles[r.SETPOINTS :] = map(float, doubles)

    def output(self, place):
        return self._outputs[place]

    @property
    def newest(self):
        """The number that has come last."""
        return self._ints[r.NUMBER]


def packages(path, count, order=RUN, before=0):
    """The input packages of set-points: rows of a path, from the first on, with the numbers after `before`."""
    window, made = Window(), []
    window.number = before
    for row in path[:count]:
        window.add(tuple(row))
        made.append(window.values(order))
    return made


def swings(count, speed, *, rest=30, h=H):
    """Postures that rest, and then swing with a largest speed [rad/s], shape (count, 6)."""
    passed = np.maximum(np.arange(count) - rest, 0) * h
    return HERE + np.outer(speed / 4.0 * np.sin(4.0 * passed) ** 2, (1.0, -0.15, 0.1, 0.2, 0.3, -1.0))


def late(random, count, *, base=1.0, jitter=0.6, stalls=0.0, longest=12):
    """Packages by the tick in which they arrive, in order; a stall, of up to `longest` ticks, holds up the rest."""
    arrivals, free = [[] for _ in range(count + int(base + jitter) + longest + 3)], 0.0
    for k in range(count):
        if random.random() < stalls:
            free = max(free, k + base + random.integers(2, longest + 1))
        free = max(free, k + base + jitter * random.uniform(-1.0, 1.0))
        arrivals[int(np.ceil(free))].append(k)
    return arrivals

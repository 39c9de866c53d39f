"""A controller and the robot that it moves through registers and `servoj`, in one process and in lockstep.

The robot is a hidden one without a shaper, which runs the program that a real robot would run. Time is that of its
ticks: the link between them is drawn from a seed, so that equal bridges make equal motions, to the last bit.
"""

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from msgspec import structs

from tvist_controller.api.line import Setup, body, load_calibration
from tvist_controller.api.robot import Controller, Host, Sink
from tvist_plant.plant import PERIOD, Measurement
from tvist_plant.variants import hidden_variant
from tvist_protocol.commands import TakeControl
from tvist_protocol.io import Registers, SetRegisters
from tvist_protocol.programs import ProgramRun
from tvist_protocol.replies import Accepted, Refused
from tvist_protocol.stream import Event
from tvist_server.moving import program as r
from tvist_server.moving.program import MARGIN, Window, program
from tvist_server.moving.servo_lag import ServoLag, ServoSetpoints

TICK = 1e3 * PERIOD  # control period [ms]
COMPUTING = 0.2  # time from a row's arrival until the set-point leaves [ms]
LATEST = 2.0  # time after a tick of the robot at which the controller ticks without its row [ms]
CLIENT = "bridge"
RUN = 1  # number of the run of the program


@dataclass(frozen=True)
class Link:
    """A connection that delays packages; a lost one is sent again and holds up all later ones."""

    delay: float = 1.0  # mean time on the way [ms]
    jitter: float = 0.5  # largest deviation from it [ms]
    loss: float = 0.001  # share of packages that have to be sent again [-]
    again: tuple[float, float] = (6.0, 12.0)  # shortest and longest time that this takes [ms]


IDEAL = Link(delay=0.5, jitter=0.0, loss=0.0)  # a connection on which each package is there in time


class Way:
    """One direction of a link, in which packages keep their order."""

    def __init__(self, link, seed):
        self._link, self._random, self._last = link, np.random.default_rng(seed), 0.0

    def arrival(self, now):
        """Return when a package that leaves now arrives [ms]."""
        link, random = self._link, self._random
        took = link.delay + random.uniform(-link.jitter, link.jitter)
        again = random.uniform(*link.again)  # drawn in any case, so that another loss changes nothing else
        if random.uniform() < link.loss:
            took += again
        self._last = max(self._last, now + took)
        return self._last


class Side:
    """A controller that a client controls, and its events."""

    def __init__(self, setup, plant):
        self.controller, heard, self.events = Controller(setup, plant), Sink(), list[Event]()
        heard.event = self.events.append
        reply = self.controller.receive(TakeControl(client=CLIENT))
        assert isinstance(reply, Accepted), "nobody else has control"
        self._token, self._host = str(reply.token), Host(self.controller, heard)

    def send(self, kind, **fields):
        return self.controller.receive(kind(token=self._token, **fields))

    def tick(self):
        self._host.tick()
        return self.controller.latest


class HiddenRobot(Side):
    """A hidden robot with our controller."""

    late = 0  # ticks by which its target is later than `wanted`

    def __init__(self, description, seed, q, payload, shaper="none"):
        self.plant = hidden_variant(seed).make(description, body(payload), seed)
        super().__init__(setup_of(description, q, payload, shaper, seed), self.plant)

    @property
    def robot(self):
        """The robot whose arm moves."""
        return self

    @property
    def wanted(self):
        """Joint angles to which the line leads the arm, shape (n,) [rad]."""
        return self.controller.cycle.sample.target.q

    def follow(self, speed):
        """Run the program that follows set-points, up to a speed [rad/s]."""
        deceleration = min(self.controller.cycle.description.limits.acceleration)
        text = program(RUN, speed=speed, deceleration=deceleration)
        reply = self.send(ProgramRun, text=text)
        assert not isinstance(reply, Refused), reply


@dataclass
class Counts:
    ticks: int = 0  # ticks since the beginning
    played: dict[int, int] = field(default_factory=dict)
    """Age of the set-points played, in ticks of the robot since the tick in which each was computed."""
    largest_step: float = 0.0  # largest step of a joint's own target between two ticks [rad]

    @property
    def usual(self):
        """Most frequent age."""
        return max(self.played, key=lambda age: self.played[age])


class Port:
    """The plant of the controller in front: its commands become set-points, which the link carries to the robot."""

    def __init__(self, robot, setpoints, link, seed):
        self.robot, self.setpoints = robot, setpoints
        self.payload = robot.controller.cycle.plant.payload
        self.counts = Counts()
        self.wanted = np.array(robot.controller.latest.target_q)
        """Position that the line wanted last, shape (n,) [rad]."""
        self._window = Window()
        self._there, self._back = (Way(link, [seed, 83, way]) for way in (0, 1))
        self._packages = deque[tuple[float, tuple[float, ...]]]()
        self._rows = deque[tuple[float, Measurement]]()
        self._measured = measured(robot.controller.latest)

    def measure(self):
        state = self.robot.controller.latest
        found = measured(state)
        at_rest = np.zeros_like(found.q)
        return Measurement(np.array(state.target_q), at_rest, found.moment, found.accelerometer)

    def step(self, command):
        """Send the set-point and let the robot tick; return the newest row from before the tick."""
        counts, robot = self.counts, self.robot
        now = TICK * counts.ticks
        row = self._back.arrival(now)
        self._rows.append((row, measured(robot.controller.latest)))
        begun = min(row, now + LATEST)
        while self._rows and self._rows[0][0] <= begun:
            self._measured = self._rows.popleft()[1]
        self.wanted = command.q
        self._window.add(self.setpoints.next(command).tolist())
        self._packages.append((self._there.arrival(begun + COMPUTING), self._window.values(RUN)))
        counts.ticks += 1
        self._deliver(now + TICK)
        before = robot.controller.latest.target_q
        state = robot.tick()
        step = float(np.abs(np.subtract(state.target_q, before)).max())
        counts.largest_step = max(counts.largest_step, step)
        age = counts.ticks - self.output(r.PLAYED)
        counts.played[age] = counts.played.get(age, 0) + 1
        return self._measured

    def output(self, place):
        return int(self.robot.controller.io(wrench=False).output_int_register[place])

    def _deliver(self, now):
        """Write the newest package that has arrived; the program cannot see earlier ones."""
        values = None
        while self._packages and self._packages[0][0] <= now:
            values = self._packages.popleft()[1]
        if values is None:
            return
        number, order, *angles = values
        doubles = Registers(bank="input_double", first=r.SETPOINTS, values=tuple(angles))
        ints = {"bank": "input_int", "first": r.NUMBER, "values": (int(number), int(order))}
        self.robot.controller.receive(SetRegisters(**ints, also=(doubles,)))


class Bridge(Side):
    """A controller with a shaper in front of a hidden robot without one."""

    def __init__(self, description, seed, q, payload, shaper, link=IDEAL):
        self.robot = HiddenRobot(description, seed, q, payload)
        speed = min(description.limits.velocity)
        self.robot.follow(speed)
        reach = np.array(description.limits.position)
        setpoints = ServoSetpoints(q, ServoLag.simulated(), fastest=(MARGIN - 0.01) * speed, reach=reach)
        self.port = Port(self.robot, setpoints, link, seed)
        # The robot's own controller lets motors lead by the gears' wind-up: ours must not do so, too.
        drives = structs.replace(description.drives, windup_feedforward=(0.0,) * description.joints)
        plain = structs.replace(description, drives=drives)
        super().__init__(setup_of(plain, q, payload, shaper, seed), self.port)
        while self.port.output(r.STATE) != r.ProgramState.FOLLOWING:
            self.tick()

    @property
    def wanted(self):
        """Joint angles to which the line leads the arm, shape (n,) [rad]."""
        return self.port.wanted

    @property
    def late(self):
        """Ticks by which the robot's target is later than `wanted`."""
        return self.port.counts.usual + 1  # for the robot's own differentiator


def setup_of(description, q, payload, shaper, seed):
    """Return the setup of a robot with its model's calibration and the gear errors of a seed."""
    return Setup(
        description=description, q=tuple(q.tolist()), payload=payload, shaper=shaper, clock="free", seed=seed,
        calibration=load_calibration(f"{description.robot.name}_modal"),
    )  # fmt: skip


def measured(state):
    return Measurement(
        np.array(state.actual_q), np.array(state.actual_qd), np.array(state.actual_moment),
        np.array(state.actual_tool_accelerometer), timestamp=state.timestamp,
    )  # fmt: skip

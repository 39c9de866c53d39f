"""Random sequences of arbitrary commands, and guarantees that must hold throughout."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from tests.search import draws, space
from tests.search.draws import ROUNDING, WITHIN
from tests.search.subject import CLIENT, SESSION, Subject, speeds

from tvist_controller.api.line import CLEARANCE, STILL, CollisionModel, body, paper_payload
from tvist_lab.recordings import Floats
from tvist_protocol import commands as c
from tvist_protocol.faults import FAULTS as FAULT_FIELDS
from tvist_protocol.replies import Accepted, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset
from tvist_protocol.transitions import Activity
from tvist_protocol.values import Payload

COMMANDS = 40  # number of commands in a sequence
PAUSES = (0, 1, 2, 5, 20, 60, 150, 400)  # possible numbers of ticks between two commands
FAULTS = (
    "protective_stop", "safeguard_stop", "emergency_stop", "system_emergency_stop", "power_loss", "violation",
    "fault", "reduced", *("normal",) * 3, "nan",
)  # fmt: skip
STOPS_ON_WAY = frozenset({"protective_stop", "safeguard_stop", "emergency_stop", "system_emergency_stop"})
"""Faults that stop a motion on its path."""
HALTS = frozenset(
    {"stop", "pause", "power_off", "inject", "lose", "release", "program_pause", "program_stop"}
)
"""Commands after which the reference must not get ahead of the uninterrupted motion."""
DIP = 1e-4
"""How much nearer than the clearance two bodies may be [m].

Ways are checked at places up to 4 mm apart, and a curved one may be some 0.03 mm nearer in between. Sequences find such
places, since they often begin where a motion before was stopped at the clearance.
"""


def far_payload(random, rated):
    """Return a payload within the rating, with its centre of mass up to 0.3 m out."""
    mass = float(random.uniform(0.1, rated))
    direction = random.normal(size=3)
    com: Floats = direction / np.linalg.norm(direction) * random.uniform(0.0, 0.3)
    moment = 0.002 * mass
    return Payload(mass=mass, com=(com[0], com[1], com[2]), inertia=(moment, 0.0, 0.0, moment, 0.0, moment))


@dataclass
class Undisturbed:
    """Future references if no command comes, which no stop may get ahead of."""

    references: Floats  # references from that moment on, one per tick, shape (k, n) [rad]
    since: int  # tick of that moment

    def breach(self, tick, q, *, resting):
        """Return in which way a stop is off the line, ahead of the motion, or later at rest; None if it is not."""
        references = self.references
        way = references[-1] - references[0]
        length = float(np.linalg.norm(way))
        if length < ROUNDING:
            return None
        along = way / length
        reached, there = (q - references[0]) @ along, references[min(tick, len(references) - 1)]
        # Changes below 1e-7 rad per tick count as rest, so the filter's tail still creeps.
        creeps = 10.0 * STILL if tick >= len(references) else 0.0
        if reached > (there - references[0]) @ along + ROUNDING + creeps:
            return "a stop is ahead of what the motion would have done"
        if np.abs(q - references[0] - reached * along).max() > ROUNDING:
            return "a stop leaves the line"
        if tick > len(references) + 1 and not resting:
            return "a stop lasts longer than the motion would have"
        return None


class BrokenError(AssertionError):
    """A guarantee was violated; the text names the command and the sequence."""


class Sequence:
    def __init__(self, description, seed):
        self.seed, self.description = seed, description
        self._random = np.random.default_rng([seed, 15])
        self._free = CollisionModel(description, body(paper_payload(description, 0.0)))
        self._declared = body(paper_payload(description, 0.0))
        self._collisions = CollisionModel(description, self._declared)
        """The arm and what is declared, apart from the robot's own model."""
        mass = draws.mass(description, self._random)
        self._free.declare(body(paper_payload(description, mass)))
        self.robot = Subject(
            description, self._posture(), paper_payload(description, mass),
            shaper=draws.shaper(self.description, self._random),
        )  # fmt: skip
        self.done: list[str] = []
        """Commands that were sent, with their replies."""
        self._ahead: Undisturbed | None = None
        self._excused = False
        self._sequence = 0
        self._at = self._towards = self.robot.references[-1]
        self._pace = 0.004
        """Largest step of a stream's set-points [rad]; those of the larger one are limited."""
        self._braked = False
        self._injected = ""

    def run(self, count=COMMANDS):
        """Send the commands, and check that the arm can be moved again afterwards.

        Raises:
            BrokenError: A guarantee was violated.
        """
        sent = self.sent
        weights = np.array([weight for weight, _ in sent.values()], dtype=float)
        for _ in range(count):
            name = str(self._random.choice(list(sent), p=weights / weights.sum()))
            before = self._foresee() if name in HALTS else None
            reply = sent[name][1](self)
            said = reply.code if isinstance(reply, Refused) else type(reply).__name__
            self.done.append(f"tick {self.robot.controller.tick_number} {name}: {said}")
            if name != "wait":
                goes_on = name == "inject" and self._injected not in STOPS_ON_WAY
                self._ahead = None if goes_on else before
            self._tick(int(self._random.choice(PAUSES)))
        self._come_back()

    @property
    def sent(self):
        """Commands and their relative frequencies."""
        return SENT

    def _posture(self):
        while True:
            q: Floats = draws.postures(self.description, self._random, 1)[0]
            if self._free.meeting(q) is None:
                return q

    def _foresee(self):
        """Return the future references if no command comes, provided that the motion follows a line of the joints."""
        motion, cycle = self.robot.controller.motion, self.robot.controller.cycle
        path, forecast = cycle.trajectory.path, cycle.trajectory.forecast
        if cycle.mode.at_rest or path is None or path.posture_of is not None or forecast is None:
            return None
        ahead = motion.stopper.simulate_until_rest()
        return None if ahead is None else Undisturbed(ahead[1:], self.robot.controller.tick_number)

    def _tick(self, count):
        robot = self.robot
        for _ in range(count):
            if robot.controller.motion.streaming:
                self._stream()
            number = robot.controller.tick_number
            robot.tick()
            if robot.controller.tick_number != number + 1:
                raise self._broken("ticks are not consecutive")
            self._watch()

    def _stream(self):
        """Send a set-point on the way to a random target."""
        way = self._towards - self._at
        step = self._pace * np.clip(way, -1.0, 1.0)
        if self._random.random() < 0.005:
            self._towards = self._random.uniform(-3, 3, self.description.joints)
        self._at = self._at + step
        self.robot.setpoint(self._sequence, self._at)
        self._sequence += 1

    def _watch(self):
        robot, limits = self.robot, self.description.limits
        q = np.array(robot.references[-3:])
        activity = robot.controller.motion.activity
        moving = not robot.controller.cycle.mode.at_rest
        self._braked = activity is Activity.BRAKING or (self._braked and moving)
        if self._braked:
            self._ahead, self._excused = None, True  # brakes do not follow a path
        if not np.isfinite(q).all():
            raise self._broken("a reference is not finite")
        if len(q) == 3 and not self._braked:
            if (np.abs(q[-1]) > np.array(limits.position) + ROUNDING).any():
                raise self._broken(f"a reference is at {q[-1].tolist()}, beyond a joint's range")
            shaper = robot.controller.cycle.tvist.name
            for what, share in zip(("velocity", "acceleration"), speeds(self.description, q), strict=True):
                if share > WITHIN:
                    raise self._broken(f"a reference with {shaper} has {share:.4f} of the limit of {what}")
            self._watch_clearance(q)
        if self._ahead is not None:
            tick = robot.controller.tick_number - self._ahead.since
            breach = self._ahead.breach(tick, q[-1], resting=robot.resting)
            if breach is not None:
                raise self._broken(breach)

    def _watch_clearance(self, q):
        declared = body(self.robot.controller.declared)
        if declared != self._declared:
            self._declared = declared
            self._collisions.declare(declared)
        meeting = self._collisions.meeting(q[-1])
        if meeting is None:
            self._excused = False
        elif not self._excused and meeting.distance < CLEARANCE - DIP:
            raise self._broken(f"by the reference {meeting}, nearer than {CLEARANCE} m")

    def _come_back(self):
        """Check that the robot can be moved again from its present state."""
        robot = self.robot
        self._ahead = None
        robot.send(SimulationInject, fault="normal")
        robot.token = robot.take_control()
        robot.send(c.Stop)
        self._tick_until_rest()
        robot.send(c.RestartSafety)
        robot.send(c.UnlockProtectiveStop)
        robot.send(c.PowerOn)
        if robot.controller.motion.activity is not Activity.REST:
            raise self._broken(f"no way back: {robot.controller.motion.activity}")
        robot.send(c.SetSpeed, fraction=1.0)
        if robot.controller.motion.collisions.meeting(robot.references[-1]) is None:
            target = 0.98 * robot.references[-1]
            reply = robot.send(c.MoveJ, q=tuple(target.tolist()))
            collides = isinstance(reply, Refused) and reply.code == "collision"
            if not isinstance(reply, Accepted) and not collides:
                raise self._broken(f"a move is not accepted: {reply}")
            self._tick_until_rest()
        started = Counter(e.id for e in robot.events if e.kind == "motion_started")
        ended = Counter(e.id for e in robot.events if e.kind in {"motion_done", "motion_stopped"})
        if started != ended:
            raise self._broken(f"motions {dict(started)} ended as {dict(ended)}")

    def _tick_until_rest(self):
        for _ in range(200):
            if not self.robot.controller.motion.activity.moving:
                return
            self._tick(100)
        raise self._broken("it does not come to rest")

    def _broken(self, what):
        story = "\n  ".join(self.done[-12:])
        tick = self.robot.controller.tick_number
        return BrokenError(f"sequence {self.seed}, tick {tick}: {what}, after\n  {story}")

    def _limited(self, kind, **fields):
        """Send a command for a motion with random limits, after one with a limit above the arm's own, now and then."""
        if self._random.random() < 0.1:
            name, value = draws.above(self.description, self._random)
            before = self.robot.controller.motion.activity
            reply = self.robot.send(kind, **fields, **{name: value})
            codes = {draws.CODES[name], "wrong_mode", "busy", "limit_position"}
            wanted = isinstance(reply, Refused) and reply.code in codes
            if not wanted or before is not self.robot.controller.motion.activity:
                raise self._broken(f"{kind.__name__} with {name} {value} is not refused: {reply}")
        return self.robot.send(kind, **fields, **draws.limits(self.description, self._random))

    def move(self):
        target, random = self._posture(), self._random
        if random.random() < 0.3:
            here = self.robot.references[-1]
            target = here + 0.1 * (target - here)
        if random.random() < 0.05:
            joint = int(random.integers(len(target)))
            ends = random.choice([-1.0, 1.0]) * random.choice([1.0, 1.0001])
            target[joint] = ends * self.description.limits.position[joint]
        reply = self._limited(c.MoveJ, q=tuple(target.tolist()))
        if (np.abs(target) > self.description.limits.position).any() and not isinstance(reply, Refused):
            raise self._broken(f"a move past the end of a joint's range is not refused: {reply}")
        return reply

    def stream(self):
        self._sequence, self._at = 0, self.robot.controller.cycle.sample.reference
        self._towards = self._random.uniform(-3, 3, self.description.joints)
        self._pace = float(self._random.choice([0.004, 0.02]))
        return self._limited(c.ServoStart)

    def halt(self):
        token = self.robot.token if self._random.random() < 0.5 else None
        wanted = None if self._random.random() < 0.4 else float(10 ** self._random.uniform(-2, 1.6))
        return self.robot.send(c.Stop, token=token, deceleration=wanted)

    def payload(self):
        payload = far_payload(self._random, self.description.limits.payload)
        resting = self.robot.controller.cycle.mode.at_rest
        reply = self.robot.send(c.SetPayload, mass=payload.mass, com=payload.com, inertia=payload.inertia)
        if resting:  # at rest any payload may be declared, even one that leads to a meeting
            collisions = self.robot.controller.motion.collisions
            self._excused = collisions.meeting(self.robot.references[-1]) is not None
        return reply

    def estimator(self):
        if self._random.random() < 0.2:
            return self.robot.send(c.SetEstimator, name="modal")
        f_d, zeta = self._random.uniform(4, 20), self._random.uniform(0.0, 0.3)
        return self.robot.send(c.SetEstimator, name="fixed", f_d=(float(f_d),), zeta=(float(zeta),))

    def reset(self):
        collisions = self.robot.controller.motion.collisions
        for _ in range(100):
            q = self._posture()
            if collisions.meeting(q) is None:
                break
        mode = self._random.choice(["RUNNING", "RUNNING", "IDLE", "POWER_OFF", "none"])
        fields = {} if mode == "none" else {"mode": str(mode)}
        reply = self.robot.send(SimulationReset, q=tuple(q.tolist()), **fields)
        if not isinstance(reply, Refused):
            self.robot.references[-2:] = [q, q]
            self._excused = collisions.meeting(q) is not None
        return reply

    def inject(self):
        fault = str(self._random.choice(FAULTS))
        self.done.append(f"  fault {fault}")
        self._injected = fault
        lasts = self._random.random() < 0.3 and "seconds" in FAULT_FIELDS[fault].may
        fields = {}
        if lasts:  # then the motion that it stopped resumes by itself
            fields, self._injected = {"seconds": float(self._random.uniform(0.0, 1.0))}, "for a while"
        reply = self.robot.send(SimulationInject, fault=fault, **fields)
        system, activity = self.robot.controller.motion.safety, self.robot.controller.motion.activity
        if (system.emergencies or system.latched) and activity in {Activity.REST, Activity.MOVING}:
            raise self._broken(f"{activity} under {system}")
        return reply

    def lose(self):
        self.robot.controller.client_gone(CLIENT, SESSION)
        self.robot.token = self.robot.take_control()
        return "gone"

    def release(self):
        reply = self.robot.send(c.ReleaseControl)
        self.robot.token = self.robot.take_control()
        return reply


def _in_space(send):
    return lambda it: send(it.robot, it._random)


SENT: dict[str, tuple[float, Callable[[Sequence], object]]] = {
    "move": (14.0, Sequence.move),
    "stream": (5.0, Sequence.stream),
    "servo_stop": (2.0, lambda it: it.robot.send(c.ServoStop)),
    "stop": (5.0, Sequence.halt),
    "pause": (2.0, lambda it: it.robot.send(c.Pause)),
    "resume": (3.0, lambda it: it.robot.send(c.Resume)),
    "speed": (2.0, lambda it: it.robot.send(c.SetSpeed, fraction=it._random.uniform(0.05, 1.0))),
    "payload": (3.0, Sequence.payload),
    "shaper": (3.0, lambda it: it.robot.send(c.SetShaper, name=draws.shaper(it.description, it._random))),
    "estimator": (1.0, Sequence.estimator),
    "power_on": (9.0, lambda it: it.robot.send(c.PowerOn)),
    "power_off": (1.0, lambda it: it.robot.send(c.PowerOff)),
    "unlock": (4.0, lambda it: it.robot.send(c.UnlockProtectiveStop)),
    "restart_safety": (3.0, lambda it: it.robot.send(c.RestartSafety)),
    "inject": (3.0, Sequence.inject),
    "lose": (1.0, Sequence.lose),
    "release": (1.0, Sequence.release),
    "reset": (1.0, Sequence.reset),
    "wait": (3.0, lambda it: it.robot.send(c.KeepAlive)),
    **{name: (weight, _in_space(send)) for name, (weight, send) in space.SENT.items()},
}
"""Commands and their relative frequencies."""

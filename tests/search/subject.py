"""The robot under test: a controller in this process, driven tick by tick, with a record of its motion."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np
from tests.controller.robots import NoArm

from tvist_controller.api.line import (
    InverseDynamics,
    Setup,
    body,
    calibrations,
    central_differences,
    drivetrain,
    load_calibration,
    paper_payload,
)
from tvist_controller.api.robot import Controller
from tvist_controller.sources.calibrations import default_for
from tvist_lab.identification.calibrate import mode_range
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription
from tvist_plant.model import flexible_model
from tvist_plant.plant import PERIOD
from tvist_protocol import commands as c
from tvist_protocol.calibration import Calibration, ModalParameter, Quantity
from tvist_protocol.info import Clock
from tvist_protocol.replies import Accepted, Refused
from tvist_protocol.stream import Event
from tvist_protocol.transitions import Activity
from tvist_protocol.values import Payload as Declared

CLIENT, SESSION = "searcher", "5e55"  # name and session of the client in control
_OF_DRIVES: tuple[Quantity, ...] = ("gear_stiffness", "rotor_inertia", "velocity_gain", "position_gain")
_made: dict[str, Calibration] = {}


class RigidArm(NoArm):
    """A plant for tests of references only: it is always exactly at its target, and measures no forces."""

    def __init__(self, payload):
        self.payload = payload

    def reset(self, command, *, payload=None, **_):
        self.payload = self.payload if payload is None else payload
        return self.step(command)


@dataclass
class Subject:
    description: RobotDescription
    q: Floats
    payload: Declared
    shaper: str = "zv"
    clock: Clock = "free"
    lease_s: float = 3600.0
    events: list[Event] = field(default_factory=list)
    references: list[Floats] = field(default_factory=list)
    """Shaped references played, one array per tick; the first is the start [rad]."""
    numbers: set[int] = field(default_factory=set)
    """Numbers of the motions that its client has asked for."""

    def __post_init__(self):
        setup = Setup(
            description=self.description,
            q=tuple(self.q.tolist()),
            payload=self.payload,
            calibration=own_calibration(self.description),
            shaper=self.shaper,
            clock=self.clock,
        )
        plant = RigidArm(body(self.payload))
        try:
            self.controller, undamped = Controller(setup, plant), False
        except ValueError:  # some shapers are for less damping than the arm has in some postures
            self.controller, undamped = Controller(replace(setup, shaper="none"), plant), True
        self.token = self.take_control()
        self.references.append(np.array(self.q))
        if undamped:
            self.send(c.SetEstimator, name="fixed", f_d=(8.0,), zeta=(0.1,))
            reply = self.send(c.SetShaper, name=self.shaper)
            assert not refused(reply), reply

    def take_control(self):
        reply = self.controller.receive(c.TakeControl(client=CLIENT, lease_s=self.lease_s), session=SESSION)
        assert isinstance(reply, Accepted), reply
        return str(reply.token)

    def send(self, kind, **fields):
        """Send a command with the token of the lease, unless another one is given."""
        if "token" in kind.__struct_fields__:
            fields.setdefault("token", self.token)
        reply = self.controller.receive(kind(**fields))
        if isinstance(reply, Accepted) and reply.id is not None:
            self.numbers.add(reply.id)
        return reply

    def setpoint(self, sequence, q):
        self.controller.receive_setpoint(c.Setpoint(token=self.token, sequence=sequence, q=tuple(q.tolist())))

    def tick(self, count=1):
        for _ in range(count):
            _, events = self.controller.tick()
            self.references.append(self.controller.cycle.position)
            self.events += events

    def until_rest(self, most=20_000):
        """Advance time until the shaped reference has rested for a tick; return whether it did."""
        for _ in range(most):
            if self.resting:
                return True
            self.tick()
        return False

    @property
    def resting(self):
        """Whether the shaped reference stands still, at rest or paused, and no part of its motion will follow."""
        cycle, motion = self.controller.cycle, self.controller.motion
        if motion.activity is Activity.MOVING and (move := motion.motions.move) is not None and move.coming:
            return False
        return cycle.mode.at_rest or (not cycle.trajectory.finished and cycle.stands_still)


def torques(description, payload, references):
    """Torques of the rigid arm along references, one per tick, by central differences, shape (k - 2, n) [N m]."""
    dynamics = InverseDynamics(description, body(payload))
    states = zip(*central_differences(references), strict=True)
    return np.array([dynamics.torque(*state) for state in states])


def speeds(description, references):
    """Largest velocity and acceleration of any joint along references, shape (k, n), as shares of its limits [-]."""
    limits = description.limits
    velocity, acceleration = (np.abs(np.diff(references, order, axis=0)) / PERIOD**order for order in (1, 2))
    return float((velocity / limits.velocity).max()), float((acceleration / limits.acceleration).max())


def refused(reply):
    return isinstance(reply, Refused)


def own_calibration(arm):
    """Return the calibration that `tvist serve` uses, or if none is modal what a perfect identification would find."""
    model = arm.robot.model
    if any(one.robot == model and one.modal is not None for one in map(load_calibration, calibrations())):
        return load_calibration(str(default_for(model)))
    if model not in _made:
        _made[model] = _of_its_file(arm)
    return _made[model]


def _of_its_file(arm):
    drives, joints, replace = arm.drives, range(arm.joints), msgspec.structs.replace
    rows: list[tuple[Quantity, Sequence[float], Sequence[int]]] = [
        *((name, getattr(drives, name), joints) for name in _OF_DRIVES),
        ("damping_time", np.divide(drives.gear_damping, drives.gear_stiffness).tolist(), joints),
        ("bending_stiffness", arm.link_flexibility.stiffness, arm.link_flexibility.links),
    ]
    parameters = tuple(
        ModalParameter(
            quantity=name, joints=(at,), value=value, deviation=0.0, interval=(value, value), status="assumed"
        )
        for name, values, places in rows
        for at, value in zip(places, values, strict=True)
    )
    springs = drivetrain(parameters, arm, flexible_model(arm, body(paper_payload(arm))))
    f_d_min, zeta_max = mode_range(arm, springs)
    pattern = load_calibration("ur5e_modal")  # for the rest, such as ring-downs
    assert pattern.modal is not None
    modal = replace(pattern.modal, parameters=parameters, f_d_min=f_d_min, zeta_max=zeta_max)
    own = replace(pattern.provenance, arm=None)
    return replace(pattern, name="assumed", robot=arm.robot.model, modal=modal, provenance=own)

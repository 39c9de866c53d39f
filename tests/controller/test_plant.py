"""A plant that is given to a controller: it is moved, checked at the start, and asked for nothing it cannot do."""

import math

import numpy as np
import pytest

from tvist_controller.controller import Controller
from tvist_controller.setup import body, paper_payload
from tvist_plant.description import Payload
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import Measurement, Plant, PlantError, SimulatedArm
from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import Q2, UR5E, NoArm, Robot, setup

PUSH = {"fault": "torque", "joint": 1, "value": 40.0, "seconds": 0.1}


class Fragile(NoArm):
    """A plant that can fail, and has nothing else to offer."""

    def __init__(self):
        self.fails, self.resets = False, 0

    def make_nan(self):
        self.fails = True

    def step(self, command):
        if self.fails:
            raise PlantError("the glass is broken")
        return super().step(command)

    def reset(self, command, **_):
        self.fails, self.resets = False, self.resets + 1
        return super().reset(command)


def test_a_given_flexible_arm_is_the_default_to_the_last_bit():
    """Whatever it carried before: the setup says what it carries."""
    given = FlexibleArm(UR5E, Payload())
    robots = Robot(seed=3), Robot(seed=3, plant=given)
    for robot in robots:
        assert isinstance(robot.send(c.MoveJ, q=tuple(Q2.tolist())), Accepted)
        robot.tick(200)
        assert robot.send(SimulationInject, **PUSH) == Done()
        robot.until_rest()
    assert robots[0].states == robots[1].states
    assert robots[1].controller.cycle.plant is given
    assert given.payload == body(paper_payload(UR5E))


def test_a_plant_cannot_be_exchanged_from_outside():
    robot = Robot()
    with pytest.raises(AttributeError):
        robot.controller.cycle.plant = NoArm()


class Own(NoArm, Plant):
    """An arm that derives from `Plant` itself, and can be put somewhere."""

    payload = Payload()


def test_a_class_that_derives_from_plant_alone_is_a_plant():
    robot = Robot(plant=Own())
    assert isinstance(robot.controller.cycle.plant, SimulatedArm)
    state = robot.tick(10)
    assert state.actual_q == pytest.approx(state.target_q)


def test_a_plant_of_ones_own_is_what_moves():
    robot = Robot(plant=NoArm())
    robot.send(c.MoveJ, q=tuple(Q2.tolist()))
    last = robot.until_rest()
    # Where it is told to be: the reference, led by what the flexible arm's gears would twist.
    assert last.actual_q == pytest.approx(Q2, abs=1e-6)
    np.testing.assert_allclose(robot.column("actual_q"), robot.column("target_q"), rtol=0.0, atol=5e-4)


@pytest.mark.parametrize(("fields", "method"), [(PUSH, "push"), ({"fault": "nan"}, "make_nan")])
def test_a_fault_that_the_plant_cannot_have_is_refused_by_name_and_changes_nothing(fields, method):
    robot, other = Robot(plant=NoArm()), Robot(plant=NoArm())
    refused = robot.send(SimulationInject, **fields)
    assert isinstance(refused, Refused)
    assert refused.code == "unknown_fault"
    assert "NoArm" in refused.why
    assert method in refused.why
    for one in (robot, other):
        one.tick(5)
    assert robot.states == other.states


def test_faults_of_the_robot_need_nothing_of_the_plant():
    robot = Robot(plant=NoArm())
    assert robot.send(SimulationInject, fault="protective_stop") == Done()
    robot.tick()
    assert "protective_stop" in robot.kinds()
    assert isinstance(robot.send(SimulationReset), Done)  # lets go of what was pushed, where that can be


def test_a_plant_that_fails_makes_a_protective_stop_and_is_reset():
    plant = Fragile()
    robot = Robot(plant=plant)
    robot.send(c.MoveJ, q=tuple(Q2.tolist()))
    robot.tick(100)
    before = plant.resets
    assert robot.send(SimulationInject, fault="nan") == Done()
    robot.tick()
    assert plant.resets == before + 1
    event = next(event for event in robot.events if event.kind == "protective_stop")
    assert event.code == "plant_failure"
    assert "the glass is broken" in event.why
    assert all(math.isfinite(q) for q in robot.states[-1].actual_q)


def test_truth_that_nobody_knows_is_refused_at_the_start():
    with pytest.raises(ValueError, match="NoArm cannot report it"):
        Controller(setup(truth=True), NoArm())


def test_true_modes_that_the_plant_does_not_know_are_empty():
    class Knows(NoArm):
        def truth(self):
            return flexible.truth()

    flexible = Controller(setup()).cycle.plant
    robot = Robot(plant=Knows(), truth=True)
    robot.tick()
    truth = robot.controller.truth()
    assert (truth.f_d, truth.zeta, truth.participation) == ([], [], [])
    assert len(truth.motor_q) == 6


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("q", np.zeros(5), r"measured q has shape \(5,\): its shape must be \(6,\)"),
        ("qd", [0.0] * 6, "measured qd is not an array"),
        ("moment", np.zeros((6, 1)), "measured moment has shape"),
        ("accelerometer", np.zeros(6), r"must be \(3,\)"),
        ("wrench", np.zeros(3), r"measured wrench has shape \(3,\): its shape must be \(6,\)"),
    ],
)
def test_what_has_the_wrong_shape_is_refused_at_the_start(field, value, said):
    class Wrong(NoArm):
        def step(self, command):
            parts = {"q": command.q, "qd": command.qd, "moment": command.q, "accelerometer": np.zeros(3)}
            return Measurement(**(parts | {field: value}))

    with pytest.raises(ValueError, match=f"plant Wrong: .*{said}"):
        Controller(setup(), Wrong())

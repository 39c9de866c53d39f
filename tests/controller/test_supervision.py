"""A robot that is moved through its own controller: what that decides becomes our state, and nothing moves on."""

from dataclasses import replace

import numpy as np
import pytest

from tvist_plant.description import Payload
from tvist_plant.foreign import called
from tvist_plant.plant import PERIOD, Condition, Halt, Measurement, PlantError, Sight
from tvist_protocol import commands as c
from tvist_protocol.io import SetIo
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Refused

from .robots import Q2, UR5E, Robot


class OtherController:
    """Follows our positions exactly, and stops as it is told."""

    payload = Payload(mass=5.0)

    def __init__(self):
        self.q, self.holds, self.halt, self.forbids, self.ticks = np.array(Q2), False, None, None, 0
        self.sent = []
        still = Measurement(self.q, np.zeros(6), np.zeros(6), np.zeros(3))
        shaped = np.array([self.q, *np.zeros((3, 6))])
        self.sight = Sight(0, still, shaped, (7, 1, 1), 1.0, 0, payload=self.payload, slider=1.0)

    def described(self):
        return UR5E

    def seen(self):
        return self.sight

    def wait(self, timeout):  # noqa: ARG002
        return True

    def switch(self, *, power, brakes):
        self.holds, self.halt = power and not brakes, None

    def stop(self):
        self.holds = False

    @property
    def condition(self):
        return Condition(self.holds, halt=self.halt)

    def measure(self):
        if self.forbids is not None:
            raise PlantError(self.forbids)
        return self._measured()

    def step(self, command):
        self.ticks += 1
        if self.holds and self.halt is None:
            self.q = command.q.copy()
            self.sent.append(self.q)
        return self._measured()

    def _measured(self):
        return Measurement(
            self.q, np.zeros(6), np.zeros(6), np.array([0.0, 0.0, 9.81]), timestamp=self.ticks * PERIOD
        )

    def says(self, **changes):
        self.sight = replace(self.sight, **changes)


@pytest.fixture
def arm():
    return OtherController()


@pytest.fixture
def robot(arm):
    robot = Robot(plant=arm)
    robot.tick(5)
    return robot


def moving(robot, arm):
    """Let it move, for a while."""
    robot.send(c.MoveJ, q=[Q2[0] + 0.5, *Q2[1:]], velocity=0.5, acceleration=1.0, jerk=20.0)
    robot.tick(200)
    assert np.abs(arm.q - np.array(Q2)).max() > 0.01


def halted(robot, arm, safety):
    arm.halt = Halt("somebody stopped it", safety)
    arm.says(modes=(7, safety, 1))
    robot.tick(2)


@pytest.mark.parametrize(
    "safety", [SafetyMode.NORMAL, SafetyMode.PROTECTIVE_STOP, SafetyMode.ROBOT_EMERGENCY_STOP]
)
def test_a_stop_of_its_controller_ends_motions_and_the_line_begins_again_where_it_stands(robot, arm, safety):
    moving(robot, arm)
    halted(robot, arm, safety)
    protective = safety == SafetyMode.PROTECTIVE_STOP
    state = robot.states[-1]
    assert state.safety_mode == safety
    assert state.robot_mode == (RobotMode.RUNNING if protective else RobotMode.POWER_OFF)
    told = [event for event in robot.events if event.why == "somebody stopped it"]
    assert {event.kind for event in told} == {
        "motion_stopped",
        "protective_stop" if protective else "safety_stop",
    }
    again = c.UnlockProtectiveStop if protective else c.PowerOn
    arm.forbids = "switch it on at the robot"
    assert isinstance(robot.send(again), Refused)
    arm.forbids, arm.q = None, arm.q + 0.05  # people have moved it meanwhile
    arm.says(modes=(7, 1, 1))
    robot.tick(20)
    sent = len(arm.sent)
    reply = robot.send(again)
    assert not isinstance(reply, Refused), reply
    robot.tick(20)
    stands = arm.sent[sent]
    assert len(arm.sent) > sent + 10
    assert all(np.abs(q - stands).max() < 1e-12 for q in arm.sent[sent:])
    assert stands == pytest.approx(arm.q, abs=1e-12)


def test_a_lease_ends_while_its_controller_does_not_answer(arm, monkeypatch):
    robot = Robot(plant=arm, clock="realtime", lease_s=0.2)
    robot.tick(5)

    def silent():
        raise PlantError("no answer")

    monkeypatch.setattr(arm, "seen", silent)
    robot.tick(200)
    assert robot.controller.session.lease is None
    assert "lease_lost" in [event.kind for event in robot.events]


def test_nothing_is_sent_while_its_controller_has_it(robot, arm):
    moving(robot, arm)
    halted(robot, arm, SafetyMode.PROTECTIVE_STOP)
    sent = len(arm.sent)
    robot.tick(300)
    assert len(arm.sent) == sent
    assert not arm.holds


def test_its_slider_scales_our_speed_and_leaves_what_was_set(robot, arm):
    robot.send(c.SetSpeed, fraction=0.5)
    arm.says(slider=0.4)
    robot.tick(2)
    assert robot.states[-1].speed_scaling == pytest.approx(0.2)
    assert robot.controller.io().target_speed_fraction == 0.5
    arm.says(slider=1.0)
    robot.tick(2)
    assert robot.states[-1].speed_scaling == pytest.approx(0.5)


@pytest.mark.parametrize("said", [{"slider": np.nan}, {"slider": -1.0}, {"speed": np.inf}, {"tool": (1.0,)}])
def test_what_no_robot_can_say_stops_it_and_names_the_field(arm, said):
    robot = Robot(plant=called(arm, 6))
    robot.tick(5)
    moving(robot, arm)
    arm.says(**said)
    robot.tick(2)
    assert f"{next(iter(said))} is" in robot.events[-1].why
    assert not arm.holds


def test_what_it_would_not_get_is_refused(robot):
    for command, given, words in (
        (SetIo, {"digital_output_mask": 1, "digital_outputs": 1}, "only set-points are sent"),
        (c.SetPayload, {"mass": 1.0, "com": (0.0, 0.0, 0.0), "inertia": (0.0,) * 6}, "tell it first"),
        (c.SetShaper, {"name": "elastic"}, "takes positions only"),
    ):
        reply = robot.send(command, **given)
        assert isinstance(reply, Refused)
        assert words in reply.why


def test_positions_are_sent_without_the_wind_up_that_its_own_drives_add(robot, arm):
    moving(robot, arm)
    targets = [state.target_q for state in robot.states if state.tick > 10]
    assert np.array(arm.sent[-150:]) == pytest.approx(np.array(targets[-150:]), abs=1e-12)

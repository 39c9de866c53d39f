"""Motions are recorded whole, and what is learnt is journaled and can be undone."""

from dataclasses import replace

import numpy as np
import pytest

from tvist_controller.loopback import LoopbackHost
from tvist_controller.safety.experience import AFTER, LONGEST, Experience
from tvist_controller.setup import paper_payload
from tvist_lab.in_process import free_setup
from tvist_lab.replay import replay
from tvist_plant.description import load
from tvist_protocol.codec import decode, encode
from tvist_protocol.commands import Forget, MoveJ, Stop, TakeControl
from tvist_protocol.lessons import PayloadLesson
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep
from tvist_protocol.stream import State

ROBOT = load("ur5e")
Q1, Q2 = ROBOT.poses["Q1"], ROBOT.poses["Q2"]


class Recalling:
    """Keeps the motions that it studies, and teaches a payload after the first one."""

    def __init__(self, mass=None):
        self.motions, self.mass = [], mass

    def study(self, motion):
        self.motions.append(motion)
        if self.mass is None or len(self.motions) != 1:
            return None
        return PayloadLesson(payload=paper_payload(ROBOT, self.mass), why=f"it carries {self.mass:g} kg")


class Served:
    """A robot that a client moves, tick by tick."""

    def __init__(self, student=None, shaper="elastic", **changes):
        setup = free_setup(None, shaper=shaper)
        self.setup = replace(setup, description=setup.description.clean(), **changes)
        self.host = LoopbackHost(self.setup, experience=student and Experience(student.study))
        self.states, self.events = [], []
        self.host.subscribe("state", lambda data: self.states.append(decode(State, data)))
        self.host.subscribe("event", self.events.append)
        self.token = self.ask(TakeControl(client="tester"))["token"]
        self.tick(5)

    def ask(self, command):
        reply = self.host._host.request(encode(command))
        assert type(reply).__name__ != "Refused", reply
        return {"token": getattr(reply, "token", None)}

    def tick(self, ticks):
        self.ask(SimulationStep(token=self.token, ticks=ticks))

    def move(self, q, seconds=3.0):
        self.ask(MoveJ(token=self.token, q=q))
        self.tick(round(seconds / 0.002))


def test_a_motion_is_recorded_from_its_first_command_until_the_arm_has_rung_down():
    student = Recalling()
    robot = Served(student)
    robot.move(Q2)
    (motion,) = student.motions
    assert motion.whole
    assert len(motion.q) == len(motion.moments) == motion.stop + AFTER
    assert np.abs(motion.q[0] - Q1).max() < 0.01  # it leads by the sag of its gears
    assert np.abs(motion.q[-1] - Q2).max() < 0.01
    moved = np.flatnonzero(np.abs(np.diff(motion.q, axis=0)).max(axis=1) > 1e-4)
    assert motion.stop - 60 < moved[-1] < motion.stop + 20


@pytest.mark.parametrize("what", ["stopped", "soon moved again"])
def test_a_motion_that_did_not_go_as_planned_says_so(what):
    student = Recalling()
    robot = Served(student)
    if what == "stopped":
        robot.move(Q2, 0.4)
        robot.ask(Stop(token=robot.token))
        robot.tick(1000)
        assert not student.motions[0].whole
        return
    robot.move(Q2, 2.0)
    robot.move(Q1)
    first, second = student.motions
    assert first.whole
    assert second.whole
    assert len(first.q) <= first.stop + AFTER
    assert len(second.q) == second.stop + AFTER


def test_what_is_learnt_is_told_journaled_replayed_and_undone():
    robot = Served(Recalling(2.0), payload=paper_payload(ROBOT, 1.0), carried=paper_payload(ROBOT, 2.0))
    controller = robot.host.controller
    robot.move(Q2)
    assert (controller.declared.mass, controller.assumed.assumed.mass) == (1.0, 2.0)
    assert b"it carries 2 kg" in b"".join(robot.events)
    robot.move(Q1)
    robot.ask(Forget(token=robot.token, what="payload"))
    assert controller.assumed.assumed.mass == 1.0
    robot.move(Q2)
    assert [entry.kind for entry in robot.host.entries].count("lesson") == 1
    assert replay(robot.setup, robot.host.entries, robot.states[1:]).first_difference is None


def test_a_motion_longer_than_the_memory_teaches_nothing():
    student = Recalling()
    robot = Served(student, shaper="none")
    robot.ask(MoveJ(token=robot.token, q=Q2, duration=LONGEST * 0.002 + 1.0))
    robot.tick(LONGEST + 1500)
    assert not student.motions
    robot.move(Q1)
    assert len(student.motions) == 1


def test_an_arm_that_is_placed_elsewhere_in_a_motion_has_made_none():
    student = Recalling()
    robot = Served(student)
    robot.move(Q2, 0.6)
    robot.ask(SimulationReset(token=robot.token, q=Q1, payload=paper_payload(ROBOT, 2.0)))
    robot.tick(500)
    assert not student.motions
    robot.move(Q2, 2.5)
    robot.ask(SimulationReset(token=robot.token, q=Q1))
    robot.move(Q2)
    assert np.abs(student.motions[-1].q[0] - Q1).max() < 0.01


class Failing:
    """Fails at each motion in the same way."""

    def study(self, motion):  # noqa: ARG002
        raise OSError(28, "No space left on device")


def test_a_study_that_fails_is_told_once():
    robot = Served(Failing())
    for q in (Q2, Q1):
        robot.move(q)
    assert b"".join(robot.events).count(b"No space left on device") == 1


def test_what_is_being_learnt_when_it_is_to_be_forgotten_is_not_taken():
    robot, works = Served(Recalling(2.0)), []

    def later(work):
        works.append(work)
        return lambda: not works

    robot.host._host._experience._later = later
    robot.move(Q2)
    robot.ask(Forget(token=robot.token, what="payload"))
    works.pop()()
    robot.tick(5)
    assert "lesson" not in [entry.kind for entry in robot.host.entries]


def test_motions_that_are_made_faster_than_studied_do_not_fill_the_memory(monkeypatch):
    monkeypatch.setattr("tvist_controller.safety.experience.WAITING", 2)
    robot = Served(Recalling())
    experience = robot.host._host._experience
    experience._later = lambda _: lambda: False
    for _ in range(2):
        robot.move(Q2, 2.5)
        robot.move(Q1, 2.5)
    assert len(experience._under_way) == 2


def test_a_motion_that_the_simulation_broke_off_after_a_fault_is_no_motion():
    student = Recalling()
    robot = Served(student)
    robot.move(Q2, 0.4)
    robot.ask(SimulationInject(token=robot.token, fault="nan"))
    robot.tick(400)
    assert not student.motions

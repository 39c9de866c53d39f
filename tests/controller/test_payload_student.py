"""A robot that follows its payload finds it after a motion, lets a right one be, and forgets it on command."""

from dataclasses import replace
from functools import partial

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.controller.test_experience import Q1, Q2, ROBOT, Served

from tvist_controller.planning.snapshot import FilterState
from tvist_controller.safety import payload_monitor
from tvist_controller.safety.experience import MotionRecord, Taught
from tvist_controller.safety.payload_student import DEAD, PayloadStudent
from tvist_controller.setup import Setup, paper_payload
from tvist_controller.sources.calibrations import load
from tvist_controller.sources.mode_source import first_source
from tvist_lab.in_process import free_setup
from tvist_lab.replay import replay
from tvist_protocol.codec import decode
from tvist_protocol.commands import Forget, SetPayload
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.stream import Event
from tvist_server.option_values import StartError

MODAL = load("ur5e_modal")


def disc(mass):
    return paper_payload(ROBOT, mass)


def taken_for(payload):
    return FilterState("zv", 1, first_source(ROBOT, None), payload, payload)


class Following(Served):
    """A robot that follows its payload."""

    def __init__(self, declared, carried, student=None, **changes):
        changes = {"adapt": "payload", "calibration": MODAL} | changes
        super().__init__(student, payload=disc(declared), carried=disc(carried), **changes)

    @property
    def assumed(self):
        return self.host.controller.assumed.assumed

    def told(self, kind):
        return [event for event in map(partial(decode, Event), self.events) if event.kind == kind]


class Keeping:
    """Keeps the motions."""

    def __init__(self):
        self.motions = []

    def study(self, motion):
        self.motions.append(motion)


@pytest.fixture(scope="module")
def motion():
    """A motion with 4 kg, of which 1 kg is declared."""
    student = Keeping()
    robot = Following(1.0, 4.0, student, adapt=None)
    robot.move(Q2)
    return student.motions[0]


@pytest.mark.parametrize(("declared", "carried"), [(0.0, 3.0), (4.0, 1.5), (2.5, 0.0)])
def test_one_motion_tells_what_is_carried_and_no_warning_nags(declared, carried):
    robot = Following(declared, carried)
    robot.move(Q2)
    assert robot.assumed.mass == pytest.approx(carried, abs=0.2)
    (event,) = robot.told("learnt")
    assert f"not {declared:g} kg" in event.why
    assert robot.host.controller.io().assumed_payload == robot.assumed
    assert robot.host.controller.declared.mass == declared
    robot.move(Q1)
    robot.tick(700)
    assert not robot.told("warning")
    assert len(robot.told("learnt")) == 1


def test_a_right_payload_is_left_alone():
    robot = Following(2.0, 2.2)
    for q in (Q2, Q1):
        robot.move(q, 2.0)
    assert not robot.told("learnt")
    assert robot.host.controller.io().assumed_payload is None


def test_what_is_found_changes_neither_rating_nor_geometry():
    robot = Following(0.5, 4.0)
    collisions, carried = robot.host.controller.motion.collisions, disc(0.5)
    robot.move(Q2)
    assert robot.assumed.mass > 3.5
    assert tuple(collisions.declared.com) == carried.com
    assert collisions.declared.mass == carried.mass


def test_more_than_the_rating_is_said_and_the_rating_assumed():
    robot = Following(2.0, 6.5)
    for q in (Q2, Q1):
        robot.move(q)
    assert robot.assumed.mass == 5.0
    (warning,) = robot.told("warning")
    assert warning.code == "payload_mismatch"
    assert "above its rating: 5 kg are assumed" in warning.why


def test_lessons_come_at_rest_are_replayed_and_forgotten_to_the_last_bit():
    robot, plain = Following(1.0, 3.0), Following(1.0, 3.0, adapt=None)
    robot.move(Q2)
    robot.move(Q1)
    taught = [entry.tick for entry in robot.host.entries if entry.kind == "lesson"]
    moving = {state.tick for state in robot.states if np.abs(state.target_qd).max() > 1e-6}
    assert taught
    assert not moving & set(taught)
    robot.ask(Forget(token=robot.token, what="payload"))
    plain.move(Q2)
    plain.move(Q1)
    for one in (robot, plain):  # both now move as the declared payload needs, whatever one has learnt before
        one.tick(500)
        one.ask(SimulationReset(token=one.token, q=Q1, seed=3))
        one.move(Q2, 1.0)
    assert "are assumed again" in robot.told("learnt")[1].why
    assert robot.assumed == robot.host.controller.declared
    after = [
        [
            (state.target_moment, state.actual_q, state.actual_tool_accelerometer)
            for state in one.states[-400:]
        ]
        for one in (robot, plain)
    ]
    assert after[0] == after[1]
    assert replay(robot.setup, robot.host.entries, robot.states[1:]).first_difference is None


def test_what_is_declared_anew_counts_and_a_lesson_from_before_is_void():
    robot = Following(1.0, 3.0)
    robot.move(Q2)
    assert robot.assumed.mass > 2.5
    anew = disc(2.0)
    robot.ask(SetPayload(token=robot.token, mass=anew.mass, com=anew.com, inertia=anew.inertia))
    assert robot.assumed == anew
    assert robot.host.controller.io().assumed_payload is None
    slow = Keeping()
    student = PayloadStudent(ROBOT)
    late = Following(1.0, 3.0, slow, adapt=None)
    late.move(Q2)
    lesson = student.study(slow.motions[0])
    experience = late.host._host._experience
    experience._under_way.append((lambda: True, [Taught(slow.motions[0].beliefs, lesson, None)]))
    late.ask(SetPayload(token=late.token, mass=anew.mass, com=anew.com, inertia=anew.inertia))
    late.tick(5)
    assert late.assumed == anew


def test_where_motions_do_not_tell_it_the_warning_still_comes(monkeypatch):
    monkeypatch.setattr(payload_monitor, "PATIENCE", 3.0)
    robot = Following(0.0, 3.0)
    robot.tick(1500)
    assert not robot.told("warning")
    robot.tick(1000)
    assert "0 kg are declared" in robot.told("warning")[0].why


def test_an_arm_that_carries_no_weight_cannot_follow_it():
    with pytest.raises(StartError, match="no joint of a one-joint arm carries weight"):
        free_setup(robot="one-joint", adapt="payload")


def test_the_setup_in_a_recording_keeps_it():
    setup = free_setup(adapt="payload")
    assert Setup.from_builtins(setup.to_builtins()).adapt == "payload"
    assert "adapt" not in free_setup().to_builtins()


def test_a_push_in_the_motion_teaches_nothing(motion):
    pushed = motion.moments.copy()
    pushed[150:300, :3] += 25.0
    assert PayloadStudent(ROBOT).study(motion) is not None
    assert PayloadStudent(ROBOT).study(replace(motion, moments=pushed)) is None


@pytest.mark.parametrize("what", ["short", "stopped", "slow", "NaN", "constant", "huge"])
def test_a_motion_that_tells_nothing_teaches_nothing(motion, what):
    q, moments, whole, kept = motion.q, motion.moments, what != "stopped", slice(None)
    if what == "short":
        kept = slice(0, 1)
    elif what == "slow":  # stands upright and hardly moves
        q = np.zeros_like(q) + [0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0] + 1e-6 * motion.q
        moments = moments * 0.0
    elif what == "NaN":
        moments = np.where(np.arange(len(q))[:, None] == 200, np.nan, moments)
    elif what == "constant":
        q, moments = np.zeros_like(q), np.zeros_like(moments)
    elif what == "huge":
        moments = moments * 1e6
    record = replace(motion, q=q[kept], moments=moments[kept], whole=whole)
    assert PayloadStudent(ROBOT).study(record) is None


@settings(deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 600), st.floats(1e-9, 1e9))
def test_no_record_makes_a_payload_that_is_none(seed, ticks, size):
    random = np.random.default_rng(seed)
    q, moments = random.standard_normal((ticks, 6)), size * random.standard_normal((ticks, 6))
    record = MotionRecord(q, moments, min(ticks, 5), True, taken_for(disc(2.0)))
    lesson = PayloadStudent(ROBOT).study(record)
    if lesson is not None:
        assert 0.0 <= lesson.payload.mass <= 5.0
        assert abs(lesson.payload.mass - 2.0) > DEAD
        assert max(map(abs, lesson.payload.com)) <= 0.3
        msgspec.json.decode(msgspec.json.encode(lesson.payload), type=type(lesson.payload))

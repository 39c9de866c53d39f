"""A motion that is made again gets a correction, which is bounded, never jumps, and never makes it worse for good."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from msgspec.structs import replace as changed
from tests.controller.test_experience import Q1, Q2, ROBOT, Recalling, Served
from tests.examples import examples

from tvist_controller.calibrations import load as load_calibration
from tvist_controller.experience.bump_responses import LATE, SAMPLES, THIN, BumpResponses
from tvist_controller.experience.motion_record import Beliefs, MotionRecord
from tvist_controller.experience.motion_student import MotionStudent
from tvist_controller.experience.twin import Twin
from tvist_controller.line.correction import (
    BUMPS,
    FARTHEST,
    JOINTS,
    LENGTH,
    MOST,
    SHAPES,
    Corrections,
    Repetition,
    bounded,
    course,
)
from tvist_controller.loopback import LoopbackHost
from tvist_controller.setup import body, paper_payload
from tvist_lab.in_process import free_setup
from tvist_lab.replay import replay
from tvist_lab.study.arms import stiffer
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD
from tvist_protocol.codec import encode
from tvist_protocol.commands import Forget, MoveJ, Pause, Resume, SetSpeed, Stop, TakeControl
from tvist_protocol.lessons import MotionLesson

NOISY = changed(ROBOT.clean(), sensors=changed(ROBOT.clean().sensors, accelerometer_noise=0.03))
SOFT = stiffer(NOISY, 0.7)
LOUD = tuple((1.0, -1.0, 1.0) for _ in range(BUMPS))


class Softer(Served):
    """A robot whose springs are a third softer than its controller knows."""

    def __init__(self, student):
        self.setup, self.states, self.events = (
            replace(free_setup(None, shaper="elastic"), description=NOISY),
            [],
            [],
        )
        arm = FlexibleArm(SOFT, body(self.setup.payload))
        self.host = LoopbackHost(self.setup, arm, students=[student])
        self.host.subscribe("event", self.events.append)
        self.token = self.ask(TakeControl(client="tester"))["token"]
        self.tick(5)


@cache
def lesson():
    """Return a lesson for the motion to Q2, which a robot makes once to know it."""
    robot = Served()
    corrections = robot.host.controller.cycle.corrections
    robot.host.controller.lessons.know_motions()
    robot.ask(MoveJ(token=robot.token, q=Q2))
    robot.tick(3)
    return MotionLesson(move=corrections.repetition.move, begins=700, bumps=LOUD, why="")


class Sent:
    """Keeps the commands that a robot sends."""

    def __init__(self, robot):
        self.commands, plant = [], robot.host.controller.cycle.line.plant
        step = plant.step

        def kept(command):
            self.commands.append(np.array([command.q, command.qd, command.torque]))
            return step(command)

        plant.step = kept

    def take(self):
        taken, self.commands[:] = np.array(self.commands), []
        return taken


def test_bumps_begin_and_end_at_rest_and_are_derivatives_of_one_another():
    for bump in range(BUMPS):
        q, qd, qdd = SHAPES[bump]
        assert np.abs(SHAPES[bump][:, [0, -1]]).max() < 0.01 * np.abs(qdd).max()
        assert np.abs(np.diff(q) / PERIOD - 0.5 * (qd[1:] + qd[:-1])).max() < 5e-5
        assert np.abs(np.diff(qd) / PERIOD - 0.5 * (qdd[1:] + qdd[:-1])).max() < 0.02


@given(
    st.lists(st.floats(-1e6, 1e6) | st.just(float("nan")) | st.just(float("inf")), min_size=30, max_size=30)
)
def test_no_correction_is_larger_than_permitted(heights):
    limited = course(bounded(np.array(heights).reshape(BUMPS, JOINTS)))
    assert np.abs(limited[:, 0]).max() <= FARTHEST * (1 + 1e-9)
    assert np.abs(limited[:, 2]).max() <= MOST * (1 + 1e-9)


def test_a_repeated_motion_of_a_softer_arm_leaves_ever_less_until_it_is_forgotten():
    student = MotionStudent(NOISY)
    robot = Softer(student)
    for _ in range(4):
        robot.move(Q2)
        robot.move(Q1)
    left = [one.kept for one in student._motions.values()]
    assert len(left) == 2
    assert all(one.best < 0.35 * one.first for one in left)
    assert b"made 3 times" in b"".join(robot.events)
    robot.ask(Forget(token=robot.token, what="motions"))
    robot.move(Q2)
    assert b"no motion is corrected any more" in b"".join(robot.events)


def test_a_replay_takes_the_lessons_from_the_journal():
    robot = Served(MotionStudent(ROBOT.clean()), shaper="none")
    for _ in range(2):
        robot.move(Q2)
        robot.move(Q1)
    lessons = [entry for entry in robot.host.entries if entry.kind == "lesson"]
    assert lessons
    assert replay(robot.setup, robot.host.entries, robot.states[1:]).first_difference is None


def test_only_the_same_motion_is_corrected():
    robot = Served()
    sent = Sent(robot)
    robot.move(Q2)
    plain = sent.take()
    robot.move(Q1)
    sent.take()
    robot.host.controller.lessons.learn(lesson())
    robot.move(Q2)
    more = sent.take() - plain
    moved = np.flatnonzero(np.abs(more[:, 0]).max(axis=1) > 1e-12)
    assert 699 <= moved[0] <= 703
    assert moved[-1] < 700 + LENGTH
    assert np.abs(more[:, 0, JOINTS:]).max() < 1e-12
    robot.move(Q1)
    sent.take()
    payload = robot.setup.payload
    robot.host.controller._payload.learn(changed(payload, mass=payload.mass - 0.5), None, "lighter")
    robot.tick(500)
    sent.take()
    robot.move(Q2)
    assert np.abs(np.diff(sent.take()[:, 0, 0], 2)).max() < 3e-5
    assert robot.host.controller.cycle.corrections.repetition.corrected is None


@examples(6)
@given(
    st.lists(
        st.tuples(st.integers(1, 900), st.sampled_from(("pause", "resume", "stop", "slow", "fast"))), min_size=1,
        max_size=4,
    )
)  # fmt: skip
@example([(21, "stop")])
def test_whatever_becomes_of_a_motion_its_correction_neither_jumps_nor_begins_at_a_wrong_moment(happenings):
    plain, corrected = (run(happenings, corrected=corrected) for corrected in (False, True))
    more = corrected - plain
    assert np.abs(more[:, 0]).max() <= FARTHEST
    assert np.abs(np.diff(more[:, 0], axis=0)).max() / PERIOD <= 0.02
    assert np.abs(np.diff(more[:, 0], 2, axis=0)).max() / PERIOD**2 <= MOST * 1.05
    assert np.abs(more[-1]).max() < 1e-12
    # The tick in which a stop begins may itself exceed the limit a little; a correction never adds to that.
    limit = np.maximum(np.array(ROBOT.limits.torque), np.abs(plain[:, 2]))
    assert (np.abs(corrected[:, 2]) <= limit + 1e-9).all()


def test_a_correction_that_is_still_playing_goes_on_to_its_end():
    def near(q):
        return (q[0] + 0.02, *q[1:])

    def sent_in(lessons, student):
        robot = Served(student)
        for one in lessons:
            robot.host.controller.lessons.learn(one)
        sent = Sent(robot)
        for q in (Q2, near(Q2)):
            robot.ask(MoveJ(token=robot.token, q=q))
            while not robot.host.controller.cycle.mode.at_rest:
                robot.tick(1)
            if not lessons:
                robot.tick(200)
        robot.tick(300)
        return sent.take()

    student = Recalling()
    sent_in((), student)
    first, second = student.motions
    lessons = [
        MotionLesson(move=first.repetition.move, begins=first.stop + LATE - LENGTH, bumps=LOUD, why=""),
        MotionLesson(move=second.repetition.move, begins=2, bumps=LOUD, why=""),
    ]
    plain = [changed(one, bumps=()) for one in lessons]
    both, neither = (sent_in(these, Recalling()) for these in (lessons, plain))
    more = both[:, 0] - neither[:, 0]
    assert np.abs(more).max() > 1e-6
    assert np.abs(np.diff(more, 2, axis=0)).max() / PERIOD**2 <= MOST * 1.05


def run(happenings, *, corrected):
    robot = Served()
    if corrected:
        robot.host.controller.lessons.learn(lesson())
    sent = Sent(robot)
    robot.ask(MoveJ(token=robot.token, q=Q2))
    sent.take()
    for ticks, what in happenings:
        robot.tick(ticks)
        make = {
            "pause": Pause(token=robot.token), "resume": Resume(token=robot.token), "stop": Stop(token=robot.token),
            "slow": SetSpeed(token=robot.token, fraction=0.5), "fast": SetSpeed(token=robot.token, fraction=1.0),
        }  # fmt: skip
        robot.host.request("tester", encode(make[what]))
    robot.tick(1200)
    return sent.take()


def record(accelerometer, corrected=None, stop=400):
    """Return a motion that stands still, but for what the accelerometer says."""
    rest = DriveCommand(np.array(Q1), np.zeros(6), np.zeros(6))
    commands = np.tile(np.array([rest.q, rest.qd, rest.torque]), (stop + 150, 1, 1))
    repetition = Repetition("0123456789abcdef", corrected)
    beliefs = Beliefs(paper_payload(ROBOT, 1.0), None, "none")
    return MotionRecord(
        rest=rest, commands=commands, q=commands[:, 0], moments=commands[:, 2], accelerometer=accelerometer, stop=stop,
        whole=True, beliefs=beliefs, repetition=repetition,
    )  # fmt: skip


@pytest.mark.parametrize("says", ["nan", "inf", "spikes", "constant", "huge", "noise"])
def test_whatever_the_accelerometer_says_the_correction_is_bounded(says):
    random = np.random.default_rng(3)
    student, corrected = MotionStudent(ROBOT), None
    for _ in range(4):
        said = {
            "nan": np.full((550, 3), np.nan), "inf": np.full((550, 3), np.inf), "constant": np.full((550, 3), 9.81),
            "huge": np.full((550, 3), 1e6), "noise": 5.0 * random.standard_normal((550, 3)),
            "spikes": 900.0 * (random.random((550, 3)) < 0.01),
        }[says]  # fmt: skip
        lesson = student.study(record(said, corrected))
        if lesson is not None and lesson.bumps:
            corrected = lesson
            assert np.abs(course(np.array(lesson.bumps))[:, 2]).max() <= MOST * (1 + 1e-9)
    assert (corrected is None) == (says in ("nan", "inf", "constant", "huge"))


def test_after_two_rises_the_best_is_kept_and_one_that_comes_to_harm_is_learnt_anew():
    student = MotionStudent(ROBOT)
    ringing = np.zeros((550, 3))
    ringing[400:, 0] = np.sin(np.arange(150) / 8.0) * np.exp(-np.arange(150) / 60.0)
    first = student.study(record(0.5 * ringing))
    assert first.bumps
    assert not first.why
    second = student.study(record(0.3 * ringing, first))
    third = student.study(record(0.8 * ringing, second))
    kept = student.study(record(0.9 * ringing, third))
    assert kept.bumps == first.bumps
    assert "which is kept" in kept.why
    assert student.study(record(0.3 * ringing, kept)) is None
    assert student.study(record(0.9 * ringing, kept)) is None
    anew = student.study(record(0.9 * ringing, kept))
    assert anew.bumps == ()
    assert "anew" in anew.why


def test_what_was_forgotten_is_learnt_anew():
    student, ringing = MotionStudent(ROBOT), np.zeros((550, 3))
    ringing[400:, 0] = np.sin(np.arange(150) / 8.0) * np.exp(-np.arange(150) / 60.0)
    lesson = student.study(record(0.5 * ringing))
    for size in (0.01, 0.01):
        student.study(record(size * ringing, lesson))
    for _ in range(2):
        assert student.study(record(0.5 * ringing)) is None
    assert student.study(record(0.5 * ringing)).bumps


def test_corrections_have_room_for_a_hundred_motions():
    corrections = Corrections(ROBOT)
    for number in range(150):
        corrections.learn(MotionLesson(move=f"{number:016x}", begins=1, bumps=LOUD, why=""))
    assert len(corrections._known) == 100
    assert corrections.forget()
    assert not corrections.forget()


def test_an_arm_out_of_phase_with_its_twin_is_learnt_in_a_few_repetitions():
    """A linear arm answers a bump with a quarter of a period's delay, and with another frequency than its twin."""

    def answer(hertz, phase):
        time = np.arange(SAMPLES) * THIN * PERIOD
        ring = np.exp(-time / 0.1) * np.sin(2 * np.pi * hertz * time + phase)
        found = np.zeros((BUMPS, JOINTS, SAMPLES, 3))
        for bump in range(BUMPS):
            late = 2 * bump
            for joint in range(JOINTS):
                found[bump, joint, late:, joint] = ring[: SAMPLES - late]
        return found

    arm, twin, random = answer(7.0, 1.5), answer(9.0, 0.0), np.random.default_rng(5)
    first = 0.3 * np.tensordot(random.standard_normal((BUMPS, JOINTS)), arm, 2)
    responses, bumps, left = BumpResponses(twin), np.zeros((BUMPS, JOINTS)), []
    for _ in range(6):
        said = first + np.tensordot(bumps, arm, 2)
        left.append(np.linalg.norm(said[(LENGTH - LATE) // THIN :]))
        responses.hear(bumps, said + 0.03 / np.sqrt(THIN) * random.standard_normal(said.shape))
        bumps = responses.best()
    assert left[-1] < 0.2 * left[0]


def test_a_twin_of_a_calibrated_arm_has_its_springs():
    beliefs = Beliefs(paper_payload(ROBOT, 1.0), load_calibration("ur5e_modal"), "elastic")
    assert Twin(ROBOT, beliefs).description.drives.gear_stiffness != ROBOT.drives.gear_stiffness

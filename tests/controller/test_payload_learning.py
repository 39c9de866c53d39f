"""Motions are recorded completely, and lessons are journaled and can be undone."""

from dataclasses import replace
from functools import partial

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.loopback import LoopbackHost
from tvist_controller.planning.snapshot import FilterState
from tvist_controller.safety.payload_learning import (
    AFTER,
    DEAD,
    MotionRecord,
    PayloadEstimator,
    PayloadLearning,
)
from tvist_controller.safety.payload_monitor import TOLERATED, PayloadMonitor
from tvist_controller.setup import body, paper_payload
from tvist_controller.sources.calibrations import load as load_calibration
from tvist_controller.sources.mode_source import first_source
from tvist_controller.trajectory import MotionLimits
from tvist_lab.in_process import free_setup
from tvist_lab.replay import replay
from tvist_plant.description import load
from tvist_protocol.codec import decode, encode
from tvist_protocol.commands import Forget, MoveJ, SetPayload, Stop, TakeControl
from tvist_protocol.simulation import SimulationReset, SimulationStep
from tvist_protocol.stream import Event, State
from tvist_server.option_values import StartError
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

from .robots import Line

ROBOT = load("ur5e")
Q1, Q2 = ROBOT.poses["Q1"], ROBOT.poses["Q2"]


class Served:
    def __init__(self, study=None, **changes):
        setup = free_setup(shaper="elastic")
        self.setup = replace(setup, description=setup.description.clean(), **changes)
        self.host = LoopbackHost(self.setup, learning=study and PayloadLearning(study))
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


def test_a_motion_is_recorded_with_its_ring_down():
    motions = []
    robot = Served(motions.append)
    robot.move(Q2)
    (motion,) = motions
    assert motion.whole
    assert len(motion.q) == len(motion.moments) == motion.stop + AFTER
    assert np.abs(motion.q[0] - Q1).max() < 0.01  # it leads by the sag of its gears
    assert np.abs(motion.q[-1] - Q2).max() < 0.01
    moved = np.flatnonzero(np.abs(np.diff(motion.q, axis=0)).max(axis=1) > 1e-4)
    assert motion.stop - 60 < moved[-1] < motion.stop + 20


@pytest.mark.parametrize("what", ["stopped", "soon moved again"])
def test_interrupted_motions_are_recorded_as_such(what):
    motions = []
    robot = Served(motions.append)
    if what == "stopped":
        robot.move(Q2, 0.4)
        robot.ask(Stop(token=robot.token))
        robot.tick(1000)
        assert not motions[0].whole
        return
    robot.move(Q2, 2.0)
    robot.move(Q1)
    first, second = motions
    assert first.whole
    assert second.whole
    assert len(first.q) <= first.stop + AFTER
    assert len(second.q) == second.stop + AFTER


def failing(_motion):
    raise OSError(28, "No space left on device")


def test_a_failing_study_is_reported_once():
    robot = Served(failing)
    for q in (Q2, Q1):
        robot.move(q)
    assert b"".join(robot.events).count(b"No space left on device") == 1


MODAL = load_calibration("ur5e_modal")


class Following(Served):
    """A robot that learns its payload."""

    def __init__(self, declared, carried, study=None, **changes):
        changes = {"adapt": "payload", "calibration": MODAL} | changes
        super().__init__(
            study, payload=paper_payload(ROBOT, declared), carried=paper_payload(ROBOT, carried), **changes
        )

    @property
    def assumed(self):
        return self.host.controller.assumed.assumed

    def told(self, kind):
        return [event for event in map(partial(decode, Event), self.events) if event.kind == kind]


@pytest.fixture(scope="module")
def deceived():
    """A robot that has moved 4 kg, of which 1 kg is declared, and the record of its motion."""
    motions = []
    robot = Following(1.0, 4.0, motions.append, adapt=None)
    robot.move(Q2)
    return robot, motions[0]


def test_a_wrong_payload_causes_a_warning_without_learning(deceived):
    assert {event.code for event in deceived[0].told("warning")} == {"payload_mismatch"}


@pytest.mark.parametrize(("declared", "carried"), [(0.0, 3.0), (4.0, 1.5), (2.5, 0.0)])
def test_one_motion_is_enough_to_learn_the_payload(declared, carried):
    robot = Following(declared, carried)
    robot.move(Q2, 2.4)
    assert robot.assumed.mass == pytest.approx(carried, abs=0.2)
    (event,) = robot.told("learnt")
    assert f"not {declared:g} kg" in event.why
    assert robot.host.controller.io().assumed_payload == robot.assumed
    assert robot.host.controller.declared.mass == declared
    robot.move(Q1, 2.4)
    assert not robot.told("warning")
    assert len(robot.told("learnt")) == 1


def test_a_learnt_payload_above_the_rating_is_limited_with_a_warning():
    robot = Following(2.0, 6.5)
    for q in (Q2, Q1):
        robot.move(q)
    assert robot.assumed.mass == 5.0
    (warning,) = robot.told("warning")
    assert warning.code == "payload_mismatch"
    assert "above its rating: 5 kg are assumed" in warning.why


def test_lessons_are_applied_at_rest_replayed_and_forgotten_bit_equally():
    robot, plain = Following(1.0, 3.0), Following(1.0, 3.0, adapt=None)
    robot.move(Q2)
    taught = [entry.tick for entry in robot.host.entries if entry.kind == "lesson"]
    moving = {state.tick for state in robot.states if np.abs(state.target_qd).max() > 1e-6}
    assert taught
    assert not moving & set(taught)
    robot.ask(Forget(token=robot.token, what="payload"))
    for one in (robot, plain):  # both now move as the declared payload needs, whatever one has learnt before
        one.tick(100)
        one.ask(SimulationReset(token=one.token, q=Q1, seed=3))
        one.move(Q2, 1.0)
    assert "are assumed again" in robot.told("learnt")[1].why
    assert robot.assumed == robot.host.controller.declared
    names = ("target_moment", "actual_q", "actual_tool_accelerometer")
    one, other = (
        [[getattr(state, name) for name in names] for state in each.states[-400:]] for each in (robot, plain)
    )
    assert one == other
    assert replay(robot.setup, robot.host.entries, robot.states[1:]).first_difference is None


def test_a_new_declaration_replaces_the_learnt_payload():
    robot = Following(1.0, 3.0)
    robot.move(Q2)
    assert robot.assumed.mass > 2.5
    anew = paper_payload(ROBOT, 2.0)
    robot.ask(SetPayload(token=robot.token, mass=anew.mass, com=anew.com, inertia=anew.inertia))
    assert robot.assumed == anew
    assert robot.host.controller.io().assumed_payload is None


def test_an_arm_without_gravity_load_cannot_learn_its_payload():
    with pytest.raises(StartError, match="no joint of a one-joint arm carries weight"):
        free_setup(robot="one-joint", adapt="payload")


def test_uninformative_motions_teach_nothing(deceived):
    _, motion = deceived
    ticks = np.arange(len(motion.q))[:, None]
    upright = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
    odd = {
        "short": {"q": motion.q[:1], "moments": motion.moments[:1]},
        "stopped": {"whole": False},
        "hardly moving": {"q": upright + 1e-6 * motion.q, "moments": 0.0 * motion.moments},
        "NaN": {"moments": np.where(ticks == 200, np.nan, motion.moments)},
        "huge": {"moments": 1e6 * motion.moments},
        "pushed": {"moments": motion.moments + 25.0 * ((ticks >= 150) & (ticks < 300)) * (np.arange(6) < 3)},
    }
    assert PayloadEstimator(ROBOT).study(motion) is not None
    for what, changes in odd.items():
        assert PayloadEstimator(ROBOT).study(replace(motion, **changes)) is None, what


@settings(deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 600), st.floats(1e-9, 1e9))
def test_random_records_never_yield_an_invalid_payload(seed, ticks, size):
    random = np.random.default_rng(seed)
    q, moments = random.standard_normal((ticks, 6)), size * random.standard_normal((ticks, 6))
    payload = paper_payload(ROBOT, 2.0)
    state = FilterState("zv", 1, first_source(ROBOT, None), payload, payload)
    record = MotionRecord(q, moments, min(ticks, 5), True, state)
    if (lesson := PayloadEstimator(ROBOT).study(record)) is not None:
        assert 0.0 <= lesson.payload.mass <= 5.0
        assert abs(lesson.payload.mass - 2.0) > DEAD
        assert max(map(abs, lesson.payload.com)) <= 0.3
        msgspec.json.decode(msgspec.json.encode(lesson.payload), type=type(lesson.payload))


def disc(mass):
    return body(paper_payload(ROBOT, mass))


def random_poses(rng, count):
    """Return collision-free postures all over the workspace."""
    model, found = CollisionModel(ROBOT, disc(5.0)), []
    while len(found) < count:
        q = rng.uniform([-np.pi, -np.pi, -2.6, -np.pi, -3, -3], [np.pi, 0, 2.6, 0, 3, 3])
        if model.meeting(q) is None:
            found.append(q)
    return found


class Watched:
    """A control line and a payload monitor."""

    def __init__(self, q, declared, carried, description=ROBOT, seed=0):
        tvist = TvistFilter(shaper("zv"), Fixed([8.0], [0.2]), joints=6)
        self.cycle = Line(description, tvist, q=q, declared=disc(declared), carried=disc(carried), seed=seed)
        self.monitor = PayloadMonitor(description, disc(declared))
        self.worst = 0.0

    def step(self):
        said = self.monitor.look(self.cycle.step())
        mass, bound = self.monitor.excess
        if self.monitor._time > 1.0 and np.isfinite(bound):
            self.worst = max(self.worst, abs(mass) / (TOLERATED + bound))
        return None if said is None else said.why

    def move(self, q, limits):
        """Return the warnings of a motion; the next one begins at once."""
        self.cycle.begin(self.cycle.plan(q, limits))
        said = []
        while not self.cycle.mode.at_rest:
            said.append(self.step())
        return [warning for warning in said if warning]


PACES = [MotionLimits(0.5, 1.0, 50.0), MotionLimits(1.5, 2.0, 100.0), MotionLimits(3.0, 8.0, 500.0)]


@pytest.mark.parametrize(
    "rounds", [5, pytest.param(50, marks=[pytest.mark.nightly, pytest.mark.timeout(1200)])]
)
def test_a_wrong_payload_causes_a_warning_within_three_moves_a_right_one_never(rounds):
    rng = np.random.default_rng(1)
    missed, false, worst = 0, 0, 0.0
    for number in range(rounds):
        poses, limits = random_poses(rng, 4), PACES[rng.integers(3)]
        description = ROBOT if number % 3 else ROBOT.clean()
        wrong = Watched(poses[0], 2.0, 5.0, description, number)
        told = [wrong.move(q, limits) for q in poses[1:]]
        missed += not any(told)
        mass = float(rng.uniform(0.0, 5.0))
        right = Watched(poses[0], mass, mass, description, number)
        false += sum(len(right.move(q, limits)) for q in poses[1:])
        worst = max(worst, right.worst)
    assert max(missed, false) <= rounds // 100
    assert rounds > 5 or worst < 0.6  # far from a false alarm

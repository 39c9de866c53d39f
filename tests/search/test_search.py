"""A search for cases in which a robot breaks its promises: `pytest -m search --cases 100 --seed 7`.

Each test tries as many cases as asked for, which differ for every seed, and the arms take turns.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from tests.search import changes, draws, paths, programs, sequences, stops, streams
from tests.search.subject import Subject, own_calibration, speeds

from tvist_controller.api.line import paper_payload
from tvist_controller.trajectory import PathStop
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_shaping import BUILT_IN

UR5E = load("ur5e")
SEVEN = str(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")
ARMS = ("ur3e", "ur5e", "ur16e", "ur30", SEVEN)
APART = 1_000_000
"""Difference between the case numbers of two consecutive seeds."""


@lru_cache
def loaded(name):
    return load(name)


def pytest_generate_tests(metafunc):
    if "case" in metafunc.fixturenames:
        count, seed = metafunc.config.getoption("cases"), metafunc.config.getoption("seed")
        cases = [(ARMS[number % len(ARMS)], seed * APART + number) for number in range(count)]
        metafunc.parametrize("case", cases, ids=[f"{Path(arm).stem}-{number}" for arm, number in cases])


@pytest.fixture
def arm(case):
    return loaded(case[0])


@pytest.fixture
def number(case):
    return case[1]


@pytest.mark.search
def test_a_stop_stays_on_the_way_behind_the_motion_and_keeps_the_limits(arm, number):
    outcome = stops.judge(arm, stops.draw(arm, number))
    assert outcome.kept, outcome


@pytest.mark.search
def test_a_path_of_the_tool_is_where_it_should_be_and_so_is_its_stop(number):
    paths.judge(number)
    paths.judge_stop(number)


@pytest.mark.search
def test_a_stream_keeps_the_clearance_and_the_limits_however_it_ends(arm, number):
    outcome = streams.judge(arm, streams.draw(arm, number))
    assert outcome.kept, outcome


@pytest.mark.search
def test_a_change_in_motion_keeps_the_clearance_and_the_limits(arm, number):
    outcome = changes.judge(arm, number)
    assert outcome.kept, outcome


@pytest.mark.search
def test_whatever_is_sent_the_promises_hold(arm, number):
    sequences.Sequence(arm, number).run()


@pytest.mark.search
def test_whatever_programs_do_the_promises_hold(arm, number):
    programs.ProgramSequence(arm, number).run()


def test_an_arm_of_two_joints_is_searched_too():
    arm = load("one-joint")
    assert streams.judge(arm, streams.draw(arm, APART)).kept
    sequences.Sequence(arm, APART).run()


def test_equal_numbers_are_equal_cases():
    one, other = (stops.draw(UR5E, 3) for _ in range(2))
    assert repr(one) == repr(other)
    first, second = sequences.Sequence(UR5E, 5), sequences.Sequence(UR5E, 5)
    first.run(10)
    second.run(10)
    assert first.done == second.done
    assert np.array_equal(first.robot.references, second.robot.references)


def test_a_stop_that_overshoots_is_found(monkeypatch):
    """A stop that goes on at its first velocity for ten ticks breaks the promise, and every search says so."""
    honest = PathStop.next

    def late(self):
        self._wasted = getattr(self, "_wasted", 0) + 1
        if self._wasted <= 10:
            q, qd, _ = self.states(np.array([0.002]))
            return q[0] + 0.002 * self._wasted * qd[0] * 1.5
        return honest(self)

    monkeypatch.setattr(PathStop, "next", late)
    found = [stops.judge(UR5E, stops.draw(UR5E, number, ("plain", "power off"))) for number in range(8)]
    assert any(not outcome.kept for outcome in found)


def test_each_arm_has_its_own_calibration_and_every_shaper_is_tried():
    names = [draws.SHAPERS[0], "um_zvd", "ei3_exact", "elastic-auto"]
    for arm in map(loaded, (SEVEN, "ur3e", "ur30")):
        known = own_calibration(arm)
        assert known.robot == arm.robot.model
        q = np.array(next(iter(arm.poses.values())))
        for name in names:
            robot = Subject(arm, q, paper_payload(arm), shaper=name)
            assert robot.controller.cycle.tvist.name == name
    assert set(names) < set(draws.SHAPERS) == set(BUILT_IN.names())


def test_a_joint_above_its_own_limit_is_found_whatever_the_others_may():
    arm = load("ur3e")  # whose wrist may turn twice as fast as its base
    time = np.arange(50)[:, np.newaxis] * PERIOD
    for joint, share in ((0, 2.0), (5, 1.0)):
        references = np.where(np.arange(6) == joint, 2.0 * arm.limits.velocity[0] * time, 0.0)
        assert speeds(arm, references)[0] == pytest.approx(share, rel=1e-4)


@pytest.mark.parametrize("name", ["ur3e", "ur30", SEVEN])
def test_limits_are_drawn_at_the_arm_s_own_and_above_which_it_refuses(name):
    arm, random = load(name), np.random.default_rng(1)
    drawn = [draws.limits(arm, random) for _ in range(100)]
    robot = Subject(arm, np.array(next(iter(arm.poses.values()))), paper_payload(arm, 0.0))
    for key, most in draws.own_limits(arm).items():
        values = [one[key] for one in drawn]
        assert max(values) == most
        assert min(values) < 0.5 * most
    for _ in range(20):
        key, value = draws.above(arm, random)
        reply = robot.send(MoveJ, q=tuple(robot.references[0]), **{key: value})
        assert (reply.code, reply.where) == (draws.CODES[key], key)

"""The search itself: it finds broken promises, and draws the same case for a number."""

from pathlib import Path

import numpy as np
import pytest
from tests.search import draws, sequences, stops, streams
from tests.search.subject import Subject, own_calibration, speeds

from tvist_controller.api.line import paper_payload
from tvist_controller.trajectory import PathStop
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_shaping import BUILT_IN

UR5E = load("ur5e")
SEVEN = str(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")


def test_search_covers_an_arm_of_two_joints():
    arm = load("one-joint")
    streams.judge(arm, streams.draw(arm, 1))
    sequences.Sequence(arm, 1).run()


def test_a_search_case_is_reproducible_from_its_number():
    one, other = (stops.draw(UR5E, 3) for _ in range(2))
    assert repr(one) == repr(other)
    first, second = sequences.Sequence(UR5E, 5), sequences.Sequence(UR5E, 5)
    first.run(10)
    second.run(10)
    assert first.done == second.done
    assert np.array_equal(first.robot.references, second.robot.references)


def test_search_finds_a_stop_that_overshoots(monkeypatch):
    """The stop continues at its first velocity for ten ticks."""
    honest = PathStop.next

    def late(self):
        self._wasted = getattr(self, "_wasted", 0) + 1
        if self._wasted <= 10:
            q, qd, _ = self.states(np.array([0.002]))
            return q[0] + 0.002 * self._wasted * qd[0] * 1.5
        return honest(self)

    monkeypatch.setattr(PathStop, "next", late)
    with pytest.raises(AssertionError, match=r"^Case"):  # noqa: PT012 - one of a few moments shows it
        for number in range(8):
            stops.judge(UR5E, stops.draw(UR5E, number, ("plain", "power off")))


def test_each_arm_has_its_calibration_and_each_shaper_is_drawn():
    names = ["um_zvd", "elastic-auto"]
    for arm in map(load, (SEVEN, "ur30")):
        known = own_calibration(arm)
        assert known.robot == arm.robot.model
        q = np.array(next(iter(arm.poses.values())))
        for name in names:
            robot = Subject(arm, q, paper_payload(arm), shaper=name)
            assert robot.controller.cycle.tvist.name == name
    assert set(names) < set(draws.SHAPERS) == set(BUILT_IN.names())


def test_each_joint_is_compared_with_its_own_limit():
    arm = load("ur3e")  # its wrist can be twice as fast as its base
    time = np.arange(50)[:, np.newaxis] * PERIOD
    for joint, share in ((0, 2.0), (5, 1.0)):
        references = np.where(np.arange(6) == joint, 2.0 * arm.limits.velocity[0] * time, 0.0)
        assert speeds(arm, references)[0] == pytest.approx(share, rel=1e-4)


@pytest.mark.parametrize("name", ["ur30", SEVEN])
def test_limits_are_drawn_up_to_those_of_the_arm_and_above(name):
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

"""A state that is written without objects is what the codec makes of it."""

import msgspec
import numpy as np
import pytest

from tvist_controller.loopback import LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_protocol.codec import decode, encode
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.io import Io
from tvist_protocol.simulation import SimulationStep
from tvist_protocol.stream import State

from .robots import UR5E, Robot

TICKS = (0, 1, 127, 128, 255, 256, 65535, 65536, 2**32 - 1, 2**32, 2**40)
"""Numbers on either side of every change of their encoded size."""


class Told:
    """A robot, and the report of its last tick."""

    def __init__(self, **options):
        self.host = LoopbackHost(free_setup(truth=False, **options))
        self.do(TakeControl(client="test"))
        self.token = self.host.controller.session.lease.token

    def do(self, command):
        self.host.request("test", encode(command))

    def step(self, ticks=1):
        self.do(SimulationStep(token=self.token, ticks=ticks))
        return self.host.controller.report

    def moving(self, ticks):
        joints = len(self.host.controller.report.state.actual_q)
        q = np.array(self.host.controller.report.state.actual_q) + np.linspace(0.1, 0.4, joints)
        self.do(MoveJ(token=self.token, q=tuple(q.tolist())))
        return self.step(ticks)


def assert_same(report):
    written = report.encoded
    assert written == encode(report.state)
    assert decode(State, written) == report.state


@pytest.mark.parametrize("shaper", ["none", "zv", "auto", "elastic"])
def test_in_motion_and_at_rest(shaper):
    told = Told(shaper=shaper)
    assert_same(told.step())
    assert_same(told.moving(60))
    for _ in range(30):
        assert_same(told.step(20))


@pytest.mark.parametrize("number", TICKS)
def test_of_any_tick_and_set_point(number):
    report = Told().moving(30)
    for sequence in (None, 0, number):
        changed = {"tick": number, "sequence": sequence, "missed": number}
        assert_same(msgspec.structs.replace(report, **changed, made=None, written=None))


def test_a_number_of_any_kind_survives():
    report = Told().moving(30)
    report.sample.signals[1:5] = [[np.nan], [np.inf], [-0.0], [5e-324]]
    assert report.encoded == encode(report.state)


Q2 = UR5E.poses["Q2"]


def test_before_the_first_tick_the_state_is_that_of_the_arm_at_rest_where_it_starts():
    robot = Robot()
    first = robot.controller.latest
    assert (first.tick, first.timestamp) == (0, 0.0)
    assert first.reference_q == first.target_q == list(UR5E.poses["Q1"])
    assert set(first.target_qd + first.target_qdd) == {0.0}
    after = robot.tick()
    assert first.actual_q == pytest.approx(after.actual_q, abs=1e-9)
    assert first.actual_moment == pytest.approx(after.actual_moment, abs=1e-6)
    assert first.estimated_f_d == after.estimated_f_d
    assert (first.robot_mode, first.safety_mode, first.runtime_state) == (
        after.robot_mode,
        after.safety_mode,
        after.runtime_state,
    )


def test_who_subscribes_in_process_is_told_at_once_and_the_run_stays_the_same():
    from tvist_controller.loopback import LoopbackHost

    told = []
    asked, unasked = LoopbackHost(free_setup()), LoopbackHost(free_setup())
    for _ in range(3):  # to ask often changes as little as to ask once
        asked.subscribe("state", lambda data: told.append(decode(State, data)))
    asked.subscribe("io", lambda data: told.append(decode(Io, data)))
    assert [message.tick for message in told] == [0, 0, 0, 1]
    for host in (asked, unasked):
        host.controller.tick()
    assert asked.controller.latest == unasked.controller.latest

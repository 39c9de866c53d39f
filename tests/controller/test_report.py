"""A state that is written without objects is what the codec makes of it."""

import msgspec
import numpy as np
import pytest

from tvist_controller.instruments import state_layout
from tvist_controller.loopback import LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_protocol.codec import decode, encode
from tvist_protocol.commands import MoveJ, ServoStart, Setpoint, TakeControl
from tvist_protocol.simulation import SimulationStep
from tvist_protocol.stream import State

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


def test_of_another_arm():
    told = Told(robot="ur3e")
    assert_same(told.moving(40))


def test_with_a_tool():
    told = Told()
    report = told.moving(40)
    other = msgspec.structs.replace(
        report,
        arm=report.arm.with_tool((0.1, -0.2, 0.3, 1.0, 2.0, -0.5)),
        made=None,
        written=None,
    )
    assert_same(other)
    assert other.state.actual_TCP_pose != report.state.actual_TCP_pose


@pytest.mark.parametrize("plain", [False, True], ids=["compiled", "python"])
@pytest.mark.parametrize("number", TICKS)
def test_of_any_tick_and_set_point(number, plain, monkeypatch):
    report = Told().moving(30)
    if plain:
        for name, function in vars(state_layout).copy().items():
            if hasattr(function, "py_func"):
                monkeypatch.setattr(state_layout, name, function.py_func)
        monkeypatch.setattr("tvist_controller.instruments.report.write_state", state_layout.write_state)
    for sequence in (None, 0, number):
        changed = msgspec.structs.replace(
            report, tick=number, sequence=sequence, missed=number, made=None, written=None
        )
        assert_same(changed)


def test_one_layout_serves_until_something_else_changes():
    told = Told()
    layouts = told.moving(300).layouts
    assert told.host.controller.report.encoded
    ((key, known),) = layouts.items()
    for _ in range(5):
        assert told.step(10).encoded
    assert layouts[key] is known
    assert msgspec.structs.replace(told.step(), missed=7, written=None).encoded
    assert len(layouts) == 1
    assert key not in layouts


def test_a_number_of_any_kind_survives():
    report = Told().moving(30)
    report.sample.signals[1:5] = [[np.nan], [np.inf], [-0.0], [5e-324]]
    assert report.encoded == encode(report.state)


def test_with_set_points():
    told = Told()
    told.do(ServoStart(token=told.token, period=0.002))
    q = np.array(told.host.controller.report.state.actual_q)
    for number in range(300):
        put = Setpoint(token=told.token, sequence=number, q=tuple((q + 1e-5 * number).tolist()))
        told.host.put_setpoint("test", encode(put))
        report = told.step()
        assert_same(report)
    assert report.state.setpoint_sequence == 299

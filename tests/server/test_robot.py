"""Messages of a served robot: those between two ticks, and to which gateways they go."""

from copy import copy

import pytest
from tests.controller.robots import Robot, setup

from tvist_lab.recordings.mcap_file import read
from tvist_protocol import commands as c
from tvist_protocol.codec import decode
from tvist_protocol.io import Io, SetIo
from tvist_protocol.programs import ProgramLoad, ProgramPlay
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationStep
from tvist_protocol.stream import Event, State
from tvist_server.gateways.base import Gateway
from tvist_server.publisher import Publisher
from tvist_server.robot import ServedRobot


class NotingGateway(Gateway):
    """Keeps what is published, unless it fails."""

    def __init__(self, *, fails=False):
        self.published, self.fails = [], fails

    def publish(self, topic, _message, data):
        if self.fails:
            raise ZeroDivisionError
        self.published.append((topic, data))

    def of(self, kind):
        return [decode(kind, data) for topic, data in self.published if topic == kind.__name__.lower()]


@pytest.fixture
def stepped(tmp_path):
    """A robot in lockstep under control, its gateway, and the token."""
    robot, gateway = ServedRobot(setup(clock="lockstep"), None, tmp_path), NotingGateway()
    robot.open([gateway])
    return robot, gateway, robot.request(c.TakeControl(client="a")).token


def test_io_published_with_the_telemetry_is_the_present_one(stepped):
    robot, gateway, token = stepped
    assert robot.request(SimulationStep(token=token, ticks=1)) == Done(tick=1)
    assert gateway.of(Io)[-1].program_state == "STOPPED"
    assert robot.request(ProgramLoad(name="paper.urp")) == Done()
    assert robot.request(ProgramPlay(token=token)) == Done()
    robot.publish_telemetry()
    robot.driven.jobs.do_waiting()
    assert [(io.program, io.program_state) for io in gateway.of(Io)[1:]] == [("paper.urp", "PLAYING")]


def test_io_is_recorded_from_the_first_tick(tmp_path):
    robot = ServedRobot(setup(clock="lockstep"), tmp_path / "run.mcap", tmp_path)
    token = robot.request(c.TakeControl(client="a")).token
    robot.request(SimulationStep(token=token, ticks=3))
    robot.request(SetIo(token=token, digital_output_mask=2, digital_outputs=2))
    robot.request(SimulationStep(token=token, ticks=2))
    robot.recorder.close()
    content = read(tmp_path / "run.mcap")
    assert [(io.tick, io.actual_digital_output_bits) for io in content.again(Io)] == [(1, 0), (4, 2)]
    assert content.recording["actual_digital_output_bits"].tolist() == [0, 0, 0, 2, 2]


def test_a_stepped_robot_does_not_repeat_a_state(stepped):
    robot, gateway, token = stepped
    for now in (1, 2):
        robot.request(SimulationStep(token=token, ticks=1))
        robot.repeat()
        assert [state.tick for state in gateway.of(State)] == list(range(1, now + 1))
    robot.repeat()
    assert [state.tick for state in gateway.of(State)] == [1, 2, 2]


def test_a_failing_gateway_does_not_affect_the_others(caplog):
    robot, publisher = Robot(), Publisher()
    publisher.gateways = gateways = [NotingGateway(fails=fails) for fails in (False, True, False)]
    state = robot.tick()
    publisher.event(Event(tick=1, kind="warning"))
    publisher.io(robot.controller.io())
    publisher.report(robot.controller.report)
    assert caplog.text.count("is not published") == 3
    assert gateways[0].published == gateways[2].published
    assert [topic for topic, _ in gateways[0].published] == ["event", "io", "state"]
    assert gateways[0].of(State) == [state]


def test_messages_without_a_reader_are_not_built():
    robot, gateway, publisher = Robot(truth=True), NotingGateway(), Publisher()
    publisher.gateways = [gateway]
    gateway.wanted_topics = {"event"}
    state, report = robot.tick(), copy(robot.controller.report)
    report.made = report.written = None
    publisher.report(report)
    publisher.truth(robot.controller.truth())
    publisher.event(Event(tick=1, kind="warning"))
    assert [topic for topic, _ in gateway.published] == ["event"]
    assert (report.made, report.written) == (None, None)
    gateway.wanted_topics = {"event", "state"}
    publisher.report(report)
    assert gateway.of(State) == [state]

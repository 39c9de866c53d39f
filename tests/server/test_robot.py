"""Messages that a served robot publishes between two ticks."""

from tests.controller.robots import setup

from tvist_lab.recordings.mcap_file import read
from tvist_protocol import commands as c
from tvist_protocol.io import Io, SetIo
from tvist_protocol.programs import ProgramLoad, ProgramPlay
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationStep
from tvist_protocol.stream import State
from tvist_server.gateways.base import Gateway
from tvist_server.robot import ServedRobot


class Told(Gateway):
    """Keeps messages of one kind."""

    def __init__(self, kind):
        self.kind, self.told = kind, []

    def publish(self, _topic, message, _data):
        if isinstance(message, self.kind):
            self.told.append(message)


def test_io_published_with_the_telemetry_is_the_present_one(tmp_path):
    robot, gateway = ServedRobot(setup(clock="lockstep"), None, tmp_path), Told(Io)
    robot.open([gateway])
    token = robot.request(c.TakeControl(client="a")).token
    assert robot.request(SimulationStep(token=token, ticks=1)) == Done(tick=1)
    assert gateway.told[-1].program_state == "STOPPED"
    assert robot.request(ProgramLoad(name="paper.urp")) == Done()
    assert robot.request(ProgramPlay(token=token)) == Done()
    robot.publish_telemetry()
    robot.driven.jobs.do_waiting()
    assert [(io.program, io.program_state) for io in gateway.told[1:]] == [("paper.urp", "PLAYING")]


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


def test_a_stepped_robot_does_not_repeat_a_state(tmp_path):
    robot, gateway = ServedRobot(setup(clock="lockstep"), None, tmp_path), Told(State)
    robot.open([gateway])
    token = robot.request(c.TakeControl(client="a")).token
    for now in (1, 2):
        robot.request(SimulationStep(token=token, ticks=1))
        robot.repeat()
        assert [state.tick for state in gateway.told] == list(range(1, now + 1))
    robot.repeat()
    assert [state.tick for state in gateway.told] == [1, 2, 2]

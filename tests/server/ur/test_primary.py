"""The primary interface: robot state, robot messages, and commands of clients."""

import struct
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.controller.robots import UR5E, cut
from tests.examples import examples

from tvist_plant.description import load
from tvist_protocol import commands as c
from tvist_protocol.programs import ProgramRun, ProgramStop
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.stream import Event
from tvist_server.gateways.ur import messages
from tvist_server.gateways.ur.primary.packages import robot_state, robot_type
from tvist_server.gateways.ur.primary.scripts import LONGEST, ScriptReader
from tvist_server.gateways.ur.primary.session import PrimarySession
from tvist_server.gateways.ur.version import DATE, VERSION

from .decoders import message, parts, split
from .hosts import host, told

RECORDED = {0: 47, 1: 251, 4: 101, 5: 225, 9: 53, 3: 75, 2: 37, 6: 445, 7: 61, 8: 9, 10: 43, 11: 26, 12: 8}
"""Parts of a recorded robot state in their order, with their lengths."""


def session(robot, control, send, **options):
    return PrimarySession(host(robot), control, send, **options)


def state_of(snapshot, description=UR5E):
    data = robot_state(description, snapshot)
    ((kind, body),) = split(data)
    assert kind == 16
    return dict(parts(body)), data


def test_parts_lengths_and_order_are_those_of_the_recording(snapshot):
    found, data = state_of(snapshot)
    assert [(number, 5 + len(part)) for number, part in found.items()] == [*RECORDED.items()]
    assert len(data) == 1386


def test_the_robot_mode_part_has_the_values_of_the_snapshot(snapshot):
    numbers = struct.unpack(">Q7?2B3dB", state_of(snapshot)[0][0])
    assert numbers[0] == round(snapshot.timestamp * 1e6)
    assert numbers[1:8] == (True, True, True, False, False, True, False)  # it has power, and moves
    assert numbers[8:10] == (7, 0)
    assert numbers[10:13] == (snapshot.target_speed_fraction, snapshot.speed_scaling, 1.0)


def flags(part):
    return struct.unpack_from(">7?", part, 8)


def test_flags_show_power_protective_stop_and_paused_program(ur5e):
    off = state_of(ur5e(mode="POWER_OFF").tick())[0][0]
    assert flags(off)[2] is False
    assert off[15] == 3
    stopped = ur5e()
    stopped.send(SimulationInject, fault="protective_stop")
    assert flags(state_of(stopped.tick(50))[0][0])[4:] == (True, False, False)
    for program, told_as in {"STOPPED": (0, 0), "PLAYING": (1, 0), "PAUSED": (0, 1)}.items():
        resting = ur5e(io_changes={"program": "f", "program_state": program})
        assert flags(state_of(resting.tick())[0][0])[5:] == told_as


def test_joint_values_are_those_of_the_snapshot(snapshot):
    columns = list(zip(*struct.iter_unpack(">3d4fB", state_of(snapshot)[0][1]), strict=True))
    for column, name in zip(columns[:3], ("actual_q", "target_q", "actual_qd"), strict=True):
        assert list(column) == getattr(snapshot, name)
    singles = ("actual_current", "actual_joint_voltage", "joint_temperatures")
    for column, name in zip(columns[3:6], singles, strict=True):
        assert column == pytest.approx(getattr(snapshot, name))
    assert set(columns[7]) == {253}


def test_pose_and_force_are_those_of_the_snapshot(snapshot):
    found = state_of(snapshot)[0]
    assert list(struct.unpack(">12d", found[4])) == snapshot.actual_TCP_pose + snapshot.tcp_offset
    assert list(struct.unpack(">7d", found[7]))[:6] == snapshot.actual_TCP_force


def test_kinematics_and_configuration_are_those_of_the_robot_file(snapshot):
    found, limits, arm = state_of(snapshot)[0], UR5E.limits, UR5E.kinematics
    table, nothing = (*arm.a, *arm.d, *arm.alpha), (0.0,) * 6
    assert struct.unpack(">6I24dI", found[5]) == (*[2**32 - 1] * 6, *nothing, *table, 0)
    numbers = struct.unpack(">53d4i", found[6])
    assert numbers[:12] == tuple(side * most for most in limits.position for side in (-1, 1))
    assert (numbers[12:24:2], numbers[13:24:2]) == (limits.velocity, limits.acceleration)
    assert min(numbers[24:29]) > 0
    assert numbers[29:53] == (*table, *nothing)
    assert all(numbers[53:55])  # the masterboard and the controller's box
    assert numbers[55:] == (1, 3)


def test_terminals_are_in_the_masterboard_and_tool_parts(ur5e):
    changes = {
        "actual_digital_input_bits": 0x20081,
        "actual_digital_output_bits": 0x10203,
        "analog_io_types": 0b0110,
        "standard_analog_input": [0.005, 7.5],
        "standard_analog_output": [2.5, 0.012],
        "tool_analog_input": [1.25, 0.5],
    }
    found = state_of(ur5e(io_changes=changes).tick())[0]
    board = struct.unpack(">2I2b2d2b2d4f3BI3B", found[3])
    assert board[:10] == (0x20081, 0x10203, 0, 1, 0.005, 7.5, 1, 0, 2.5, 0.012)
    temperature, voltage, current, io_current = board[10:14]
    assert 0 < temperature < 80
    assert (voltage, io_current) == (48.0, 0.0)
    assert current > 0
    assert (board[14:17], board[18:]) == ((1, 0, 0), (1, 1, 1))
    tool = struct.unpack(">2b2dfB2fB", found[2])
    assert (tool[2:5], tool[8]) == ((1.25, 0.5, 48.0), 253)


def test_an_arm_with_fewer_joints_fills_the_same_package(ur5e):
    arm = cut(3)
    found, data = state_of(ur5e(arm, q=arm.poses["Q1"]).tick(), arm)
    assert len(data) == 1386
    assert found[1][3 * 41 :] == bytes(3 * 41)


class At:
    """A snapshot with another tick and changed values."""

    def __init__(self, snapshot, tick, **changes):
        self._snapshot, self._changes = snapshot, changes
        self.state, self.shared = SimpleNamespace(tick=tick), {}

    def __getattr__(self, name):
        changes = self.__dict__["_changes"]
        return changes[name] if name in changes else getattr(self._snapshot, name)


def test_the_version_comes_first_and_the_first_state_at_once(robot, control, sent, snapshot):
    interface = session(robot, control, sent.append)
    interface.opened()
    hello = message(sent[0])
    assert hello.kind == 3
    assert hello.values == {"name": "URControl", "numbers": [*VERSION], "date": DATE}
    assert interface.sample(At(snapshot, 1234)) == b""
    assert [kind for kind, _ in split(b"".join(sent[1:]))] == [16]


def test_states_are_sent_at_10_hz_even_if_ticks_are_missed(robot, control, sent, snapshot):
    interface = session(robot, control, sent.append)
    interface.sample(At(snapshot, 1))
    assert len(sent) == 1
    found = [tick for tick in range(2, 501) if interface.sample(At(snapshot, tick))]
    assert found == list(range(50, 501, 50))
    assert interface.sample(At(snapshot, 561))
    assert not interface.sample(At(snapshot, 599))
    assert interface.sample(At(snapshot, 600))
    assert len(sent) == 1


def test_the_safety_mode_is_sent_only_when_it_changes(robot, control, sent, snapshot):
    interface = session(robot, control, sent.append)
    for tick, mode in enumerate((3, 3, 1, 1, 3, 1), start=1):
        interface.sample(At(snapshot, tick, safety_mode=mode))
    changes = [message(data) for data in sent if data[4] == 20]
    assert [(one.kind, one.values["mode"]) for one in changes] == [(5, 1), (5, 3), (5, 1)]


def test_a_protective_stop_is_sent_as_error_209_after_the_state(robot, control, sent, snapshot):
    interface = session(robot, control, sent.append)
    interface.sample(At(snapshot, 6))
    sent.clear()
    interface.event(Event(tick=7, kind="protective_stop", code="limit_torque", why="too much"))
    interface.sample(At(snapshot, 7, safety_mode=3))
    assert [data[4] for data in sent] == [20, 16, 20]
    error = message(sent[-1])
    assert error.kind == 6
    assert (error.values["code"], error.values["argument"], error.values["level"]) == (209, 0, 2)
    assert error.values["text"] == "too much"


def test_clients_of_the_secondary_interface_get_the_state_and_no_messages(robot, control, sent, snapshot):
    interface = session(robot, control, sent.append, informed=False)
    interface.sample(At(snapshot, 6))
    interface.event(Event(tick=7, kind="protective_stop", code="limit_torque", why="too much"))
    interface.event(Event(tick=7, kind="warning", why="mind the gap"))
    assert interface.sample(At(snapshot, 7, safety_mode=3)) == b""
    assert [data[4] for data in sent] == [16, 16]


def test_only_warnings_without_a_line_become_log_messages(robot, control, sent):
    interface = session(robot, control, sent.append)
    interface.event(Event(tick=7, kind="warning", why="for all clients, once", line=3, column=5))
    interface.event(Event(tick=7, kind="motion_started", id=1))
    interface.event(Event(tick=7, kind="warning", why="mind the gap"))
    (line,) = [message(data) for data in sent]
    assert (line.kind, line.values) == (0, {"text": "mind the gap"})


@examples(40)
@given(st.text(max_size=3000))
def test_messages_of_any_text_stay_below_2000_bytes(text):
    for made in (messages.text(None, text), messages.key(None, text, text), messages.popup(None, text, text)):
        assert len(made) <= 2000
        message(made)


PROGRAM = """def rtde():
\tglobal a = "def not() # one:"
  # if this: were code
  if a == "end":
    a = 'it"s'
  elif a:   # while
    thread t():
      while True:
        sync()
      end
    end
  else:
    if a: b = 1 end
  end
end
"""

SAMPLES = [
    ["stop program\n", "set robotmode run\n"],
    ["stop program\n", PROGRAM, "\n\n", PROGRAM, "power off\n"],
    ["sec aside():\n  x = 1\nend\n", "movej([0,0,0,0,0,0], a=1, v=1)\n"],
    ["# about it\n# more\ndef f():\nend # of it\n", 'popup("end")\n'],
    ["digital_out[0]=True\n", "set_payload(0.5, (0,0,0))\n", "end\n", "ended = 1\n", "switch_on = 2\n"],
    ["def f(\n  a=1,\n  b=2\n):\n  if a == 1 or\n    a == 2:\n    b = a\n  end\nend\n", "halt\n"],
    [
        "def f(): if a: b = 1 end\nend\n",
        "while True: sync() end\n",
        "if a:\n  b = 1\nelif c:\n  b = 2\nend\n",
    ],
]


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
@pytest.mark.parametrize("sample", SAMPLES)
def test_units_do_not_depend_on_how_the_stream_is_split(sample, ending):
    stream = "".join(sample).replace("\n", ending).encode()
    whole = ScriptReader().feed(stream)
    assert [unit.text for unit in whole] == [unit for unit in sample if unit.strip()]
    for size in (1, 2, 7):
        reader, units = ScriptReader(), []
        for at in range(0, len(stream), size):
            units += reader.feed(stream[at : at + size])
        assert units == whole
        assert reader.held == 0


def test_an_overlong_line_does_not_affect_the_next_one():
    for line in (b"a" * (3 * LONGEST), b" " * (3 * LONGEST), b"#" + b"a" * (3 * LONGEST)):
        reader = ScriptReader()
        units = []
        for at in range(0, len(line), 65536):
            units += reader.feed(line[at : at + 65536])
            assert reader.held <= LONGEST + 65536
        units += reader.feed(b"\nstop program\n")
        assert [unit.words for unit in units if not unit.too_long] == ["stop program"]
        assert sum(unit.too_long for unit in units) == 1


ORDERS = {
    "power on": [c.PowerOn(token="the-token", release_brakes=False)],
    "power off": [c.PowerOff(token="the-token")],
    "set robotmode run": [c.PowerOn(token="the-token")],
    "set unlock protective stop": [c.UnlockProtectiveStop(token="the-token")],
    "  stop   program  # now": [ProgramStop()],
    "set sim": [],
    "set real": [],
}
PROGRAMS = ("movej([0,0,0,0,0,0])\n", PROGRAM, "sec f():\nend\n", "power onto\n", "éß\n", "# a\n\nhalt\n")


def test_own_commands_act_and_other_text_runs_as_a_program(robot, control, sent):
    """`set sim` and `set real` change nothing."""
    interface, expected = session(robot, control, sent.append), []
    for text, commands in ORDERS.items():
        interface.receive(text.encode() + b"\r\n")
        expected += commands
    for text in PROGRAMS:
        interface.receive(text.encode())
        expected.append(ProgramRun(token="the-token", text=text))
    assert control.commands == expected
    assert not sent + robot.told


def test_units_are_carried_out_one_after_the_other_but_stop_at_once(robot, control, sent):
    interface = session(robot, control, sent.append)
    control.wait()
    interface.receive(b"def f():\nend\nstop program\nsec g():\nend\npower off\n")
    kinds = [ProgramRun, ProgramStop, ProgramStop, ProgramRun, c.PowerOff]  # a stop waits for nothing
    for number in range(1, 5):
        assert interface.waiting == 5 - number
        assert [type(command) for command in control.commands] == kinds[: number + 1]
        control.answer(keep=True)
    assert interface.waiting == 0


REPORTS = {
    b"power on\n": 'the script "power on" of {} was run',
    b"stop program\n": 'the script "stop program" of {} was run',
    b"set real\n": 'the script "set real" of {} changes nothing: the arm is simulated',
    PROGRAM.encode(): 'the script "rtde" of {} was started',
    b"# what it does\n\n  movej(p, a=1) # go\n": 'the script "movej(p, a=1) # go" of {} was started',
    b"x\x1b[2J\x07\xff\n": 'the script "x?[2J?\ufffd" of {} was started',
    b"y" * 100 + b"\n": f'the script "{"y" * 59}…" of {{}} was started',
    b"# \n" * 400_000: 'the script "#" of {} was refused: it has more than 1048576 bytes',
    b"def f():\n  halt\n": 'the script "f" of {} was not run: the connection ended before its last line feed',
    b"halt": 'the script "halt" of {} was not run: the connection ended before its last line feed',
}
"""What was sent until the connection ended, and the only line that the console is told."""


def test_the_result_of_a_script_is_one_line_on_the_console(robot, control, sent):
    for text, said in REPORTS.items():
        interface = session(robot, control, sent.append)
        interface.receive(text)
        interface.closed()
        assert robot.reported.pop() == said.format(control.peer)
        assert robot.reported == []


def test_an_invalid_script_is_reported_to_all_clients_and_the_console(robot, control, sent):
    why = "compile_error_name_not_found:f:"
    control.refuse("script_error", why=why, where="text:4:3")
    session(robot, control, sent.append).receive(b"# comments\n# count\ndef g():\n  f()\nend\n")
    (exception,) = told(robot)
    assert (exception.kind, exception.values) == (10, {"line": 4, "column": 3, "text": why})
    assert robot.reported == [f'the script "g" of {control.peer} was refused: line 4, column 3: {why}']
    assert not sent


@pytest.mark.parametrize("text", ["movej(q)", "set robotmode run"])
def test_a_command_in_the_wrong_mode_is_refused_to_its_sender(robot, control, sent, text):
    control.refuse("wrong_mode", why="the arm has no power")
    robot.latest = At(robot.latest, 1, robot_mode=3)
    session(robot, control, sent.append).receive(text.encode() + b"\n")
    (line,) = [message(data) for data in sent]
    assert (line.kind, line.values["text"]) == (0, f"{text} was refused: the arm has no power")
    assert not robot.told


@pytest.mark.parametrize("read_only", [True, False])
def test_commands_without_control_are_answered_with_error_210(robot, control, sent, read_only):
    control.refuse("no_control")
    interface = session(robot, control, sent.append, read_only=read_only)
    interface.receive(b"power off\ndef f():\n  x=1\nend\n" + (b"stop program\n" if read_only else b""))
    errors = [message(data) for data in sent]
    assert [(error.kind, error.values["code"]) for error in errors] == [(6, 210)] * (2 + read_only)
    assert (control.commands == []) is read_only
    assert not robot.told
    why = "this port is read-only" if read_only else "another client has control: 'a'"
    assert robot.reported[0].endswith(f"was refused: {why}")


def test_changes_already_made_succeed_but_an_early_unlock_fails(robot, control, sent):
    control.refuse("wrong_mode", why="it is stopping")
    interface, snapshot = session(robot, control, sent.append), robot.latest
    for safety, kinds in ((1, []), (3, [0])):
        robot.latest = At(snapshot, 1, safety_mode=safety)
        interface.receive(b"power on\nset robotmode run\nset unlock protective stop\n")
        assert [message(data).kind for data in sent] == kinds


def test_robot_types_are_those_of_ur():
    numbers = {"ur3e": 3, "ur5e": 1, "ur10e": 2, "ur16e": 4, "ur20": 7, "ur30": 8, "one-joint": 0}
    assert {name: robot_type(load(name)) for name in numbers} == numbers

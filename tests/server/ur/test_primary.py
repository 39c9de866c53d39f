"""The primary interface: robot state, robot messages, and the ear for commands."""

import struct
import tracemalloc
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.controller.robots import UR5E, cut

from tvist_plant.description import load
from tvist_protocol import commands as c
from tvist_protocol.programs import ProgramRun, ProgramStop
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.stream import Event
from tvist_server.gateways.ur import messages, version
from tvist_server.gateways.ur.primary.packages import robot_state, robot_type
from tvist_server.gateways.ur.primary.scripts import LONGEST, Intake
from tvist_server.gateways.ur.primary.session import PrimarySession

from .conftest import FakeControl
from .decoders import Cursor, message, parts, split
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


# ---------------------------------------------------------------------- robot state


def test_parts_lengths_and_order_are_those_of_the_recording(snapshot):
    _, data = state_of(snapshot)
    ((_, body),) = split(data)
    assert {number: 5 + len(part) for number, part in parts(body)} == RECORDED
    assert [number for number, _ in parts(body)] == list(RECORDED)
    assert len(data) == 1386


def test_robot_mode(snapshot):
    c = Cursor(state_of(snapshot)[0][0])
    assert c.take("Q") == round(snapshot.timestamp * 1e6)
    connected, enabled, power, emergency, protective, running, paused = c.many("?", 7)
    assert (connected, enabled, power) == (True, True, True)
    assert (emergency, protective) == (False, False)
    assert (running, paused) == (True, False)  # it moves
    assert c.take("B") == 7
    assert c.take("B") == 0
    assert c.many("d", 3) == [snapshot.target_speed_fraction, snapshot.speed_scaling, 1.0]
    c.take("B")
    assert c.done


def flags(part):
    return struct.unpack_from(">7?", part, 8)


def test_a_robot_without_power_in_a_protective_stop_or_with_a_paused_program_says_so(ur5e):
    off = state_of(ur5e(mode="POWER_OFF").tick())[0][0]
    assert flags(off)[2] is False
    assert off[15] == 3
    stopped = ur5e()
    stopped.send(SimulationInject, fault="protective_stop")
    part = state_of(stopped.tick(50))[0][0]
    assert flags(part)[4:] == (True, False, False)
    for program, told_as in (
        ("STOPPED", (False, False)),
        ("PLAYING", (True, False)),
        ("PAUSED", (False, True)),
    ):
        resting = ur5e(io_changes={"program": "f", "program_state": program})
        assert flags(state_of(resting.tick())[0][0])[5:] == told_as


def test_joints_have_the_snapshots_values(snapshot):
    c = Cursor(state_of(snapshot)[0][1])
    for joint in range(6):
        assert c.many("d", 3) == [
            snapshot.actual_q[joint],
            snapshot.target_q[joint],
            snapshot.actual_qd[joint],
        ]
        assert c.many("f", 3) == pytest.approx(
            [
                snapshot.actual_current[joint],
                snapshot.actual_joint_voltage[joint],
                snapshot.joint_temperatures[joint],
            ]
        )
        c.take("f")
        assert c.take("B") == 253
    assert c.done


def test_cartesian_and_force(snapshot):
    found = state_of(snapshot)[0]
    assert list(struct.unpack(">12d", found[4])) == snapshot.actual_TCP_pose + snapshot.tcp_offset
    assert list(struct.unpack(">7d", found[7]))[:6] == snapshot.actual_TCP_force


def test_kinematics_and_configuration_are_the_descriptions(snapshot):
    found = state_of(snapshot)[0]
    c = Cursor(found[5])
    assert set(c.many("I", 6)) == {2**32 - 1}
    theta, a, d, alpha = (c.many("d", 6) for _ in range(4))
    kinematics = UR5E.kinematics
    assert (theta, a, d, alpha) == ([0.0] * 6, [*kinematics.a], [*kinematics.d], [*kinematics.alpha])
    assert c.take("I") == 0
    c = Cursor(found[6])
    limits = UR5E.limits
    assert [c.many("d", 2) for _ in range(6)] == [[-most, most] for most in limits.position]
    assert [tuple(c.many("d", 2)) for _ in range(6)] == list(
        zip(limits.velocity, limits.acceleration, strict=True)
    )
    assert all(value > 0 for value in c.many("d", 5))
    assert [c.many("d", 6) for _ in range(4)] == [a, d, alpha, theta]
    board, box, robot_type, subtype = c.many("i", 4)
    assert (robot_type, subtype) == (1, 3)
    assert board
    assert box


def test_terminals(ur5e):
    changes = {
        "actual_digital_input_bits": 0x20081,
        "actual_digital_output_bits": 0x10203,
        "analog_io_types": 0b0110,
        "standard_analog_input": [0.005, 7.5],
        "standard_analog_output": [2.5, 0.012],
        "tool_analog_input": [1.25, 0.5],
    }
    found = state_of(ur5e(io_changes=changes).tick())[0]
    c = Cursor(found[3])
    assert c.many("I", 2) == [0x20081, 0x10203]
    assert (c.many("b", 2), c.many("d", 2)) == ([0, 1], [0.005, 7.5])
    assert (c.many("b", 2), c.many("d", 2)) == ([1, 0], [2.5, 0.012])
    temperature, voltage, current, io_current = c.many("f", 4)
    assert 0 < temperature < 80
    assert voltage == 48.0
    assert current > 0
    assert io_current == 0.0
    assert (c.take("B"), c.take("B"), c.take("B")) == (1, 0, 0)
    c.take("I")
    assert c.many("B", 3) == [1, 1, 1]
    assert c.done
    c = Cursor(found[2])
    c.many("b", 2)
    assert c.many("d", 2) == [1.25, 0.5]
    assert c.take("f") == 48.0
    c.take("B")
    c.many("f", 2)
    assert c.take("B") == 253
    assert c.done


@pytest.mark.parametrize("joints", [1, 3, 5])
def test_an_arm_with_fewer_joints_fills_the_same_package(ur5e, joints):
    arm = cut(joints)
    found, data = state_of(ur5e(arm, q=arm.poses["Q1"]).tick(), arm)
    assert len(data) == 1386
    assert found[1][joints * 41 :] == bytes((6 - joints) * 41)


# ---------------------------------------------------------------------- the session's stream


class Ticks:
    """Snapshots with numbers of ticks that one can choose."""

    def __init__(self, snapshot):
        self.snapshot = snapshot

    def at(self, tick, **changes):
        return Changed(self.snapshot, tick, changes)


class Changed:
    def __init__(self, snapshot, tick, changes):
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
    assert hello.values["name"] == "URControl"
    assert hello.values["numbers"] == [version.MAJOR, version.MINOR, version.BUGFIX, version.BUILD]
    assert hello.values["date"] == version.DATE
    assert interface.sample(Ticks(snapshot).at(1234)) == b""
    assert [kind for kind, _ in split(b"".join(sent[1:]))] == [16]


def test_states_come_at_10_hz_even_where_ticks_were_left_out(robot, control, sent, snapshot):
    interface = session(robot, control, sent.append)
    ticks = Ticks(snapshot)
    interface.sample(ticks.at(1))
    assert len(sent) == 1
    assert [tick for tick in range(2, 501) if interface.sample(ticks.at(tick))] == list(range(50, 501, 50))
    assert interface.sample(ticks.at(561))
    assert not interface.sample(ticks.at(599))
    assert interface.sample(ticks.at(600))
    assert len(sent) == 1


def test_it_is_packed_once_for_all_clients(robot, control, snapshot):
    states = []
    one, other = session(robot, control, states.append), session(robot, control, states.append)
    tick = Ticks(snapshot).at(50)
    one.sample(tick)
    other.sample(tick)
    assert states[0] is states[1]


def test_the_safety_mode_is_told_when_it_changes_and_not_before(robot, control, sent, snapshot):
    interface = session(robot, control, sent.append)
    ticks = Ticks(snapshot)
    interface.opened()
    for tick, mode in enumerate((1, 1, 3, 3, 1), start=1):
        interface.sample(ticks.at(tick, safety_mode=mode))
    changes = [message(data) for data in sent if data[4] == 20][1:]
    assert [(one.kind, one.values["mode"]) for one in changes] == [(5, 3), (5, 1)]


def test_a_client_that_comes_in_a_protective_stop_is_told_of_its_end_alone(robot, control, sent, snapshot):
    interface = session(robot, control, sent.append)
    ticks = Ticks(snapshot)
    interface.sample(ticks.at(1, safety_mode=3))
    interface.sample(ticks.at(2, safety_mode=1))
    assert [message(data).values["mode"] for data in sent if data[4] == 20] == [1]


def test_a_protective_stop_is_error_209_of_argument_0_as_a_warning_after_the_state(
    robot, control, sent, snapshot
):
    interface, ticks = session(robot, control, sent.append), Ticks(snapshot)
    interface.sample(ticks.at(6))
    sent.clear()
    interface.event(Event(tick=7, kind="protective_stop", code="limit_torque", why="too much"))
    interface.sample(ticks.at(7, safety_mode=3))
    assert [data[4] for data in sent] == [20, 16, 20]
    error = message(sent[-1])
    assert error.kind == 6
    assert (error.values["code"], error.values["argument"], error.values["level"]) == (209, 0, 2)
    assert error.values["text"] == "too much"


def test_clients_of_the_secondary_interface_get_the_state_and_no_messages(robot, control, sent, snapshot):
    interface, ticks = session(robot, control, sent.append, informed=False), Ticks(snapshot)
    interface.sample(ticks.at(6))
    interface.event(Event(tick=7, kind="protective_stop", code="limit_torque", why="too much"))
    interface.event(Event(tick=7, kind="warning", why="mind the gap"))
    assert interface.sample(ticks.at(7, safety_mode=3)) == b""
    assert [data[4] for data in sent] == [16, 16]


def test_warnings_are_lines_of_the_log_and_other_events_are_not_told(robot, control, sent):
    interface = session(robot, control, sent.append)
    interface.event(Event(tick=7, kind="warning", why="for all clients, once", line=3, column=5))
    interface.event(Event(tick=7, kind="motion_started", id=1))
    interface.event(Event(tick=7, kind="warning", why="mind the gap"))
    (line,) = [message(data) for data in sent]
    assert (line.kind, line.values) == (0, {"text": "mind the gap"})


# ---------------------------------------------------------------------- messages


def test_messages_say_what_they_are_given():
    key = message(messages.key(5_000_000, "PROGRAM_XXX_STARTED", "move"))
    assert (key.time, key.source, key.kind) == (5_000_000, 254, 7)
    assert (key.values["title"], key.values["text"]) == ("PROGRAM_XXX_STARTED", "move")
    exception = message(messages.runtime_exception(1, 3, 14, "no"))
    assert exception.values == {"line": 3, "column": 14, "text": "no"}
    window = message(messages.popup(1, "Title", "Text"))
    assert (window.kind, window.values["title"], window.values["text"]) == (2, "Title", "Text")
    assert window.values["flags"] == [False] * 3


@given(st.text(max_size=3000))
def test_no_text_makes_a_message_that_clients_take_for_garbage(text):
    for made in (messages.text(0, text), messages.key(0, text, text), messages.popup(0, text, text)):
        assert len(made) <= 2000
        message(made)


# ---------------------------------------------------------------------- the ear: units


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
def test_a_stream_is_cut_into_the_same_units_wherever_it_is_split(sample, ending):
    stream = "".join(sample).replace("\n", ending).encode()
    whole = Intake().feed(stream)
    assert [unit.text for unit in whole] == [unit for unit in sample if unit.strip()]
    for size in (1, 2, 7):
        intake, units = Intake(), []
        for at in range(0, len(stream), size):
            units += intake.feed(stream[at : at + size])
        assert units == whole
        assert intake.held == 0
    for at in range(len(stream)):
        intake = Intake()
        assert intake.feed(stream[:at]) + intake.feed(stream[at:]) == whole


def test_a_text_that_ends_in_the_middle_of_a_program_waits():
    intake = Intake()
    assert not intake.feed(b"def f():\n  stop program\n  if x:\n  end\n")
    assert not intake.feed(b"en")
    (unit,) = intake.feed(b"d\n")
    assert unit.name == "f"
    assert intake.feed(b"power on") == []


def test_a_unit_says_where_its_code_begins():
    comments, indented = Intake().feed(b"# one\n\n  # two\n   def f():\nend\n  movej(q)\n")
    assert (comments.line, comments.column, comments.name) == (4, 4, "f")
    assert (indented.line, indented.column, indented.name) == (1, 3, None)


def test_a_unit_that_is_too_long_is_answered_once_and_forgotten():
    intake = Intake()
    units = intake.feed(b"def f():\n")
    for _ in range(300):
        units += intake.feed(b"  x = 1 # " + b"y" * 10_000 + b"\n")
        assert intake.held <= LONGEST
    assert [unit.too_long for unit in units] == [True]
    assert units[0].text.startswith("def f():")
    units = intake.feed(b"end\nstop program\n")
    assert [unit.words for unit in units] == ["stop program"]


def test_a_unit_of_short_lines_takes_little_more_memory_than_it_has_bytes():
    intake = Intake()
    tracemalloc.start()
    try:
        intake.feed(b"def f():\n")
        for _ in range(100):
            intake.feed(b"ab\n" * 3000)
        held = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert intake.held > 900_000
    assert held < 2 * intake.held


def test_a_line_that_is_too_long_does_not_swallow_the_next():
    for line in (b"a" * (3 * LONGEST), b" " * (3 * LONGEST), b"#" + b"a" * (3 * LONGEST)):
        intake = Intake()
        units = []
        for at in range(0, len(line), 65536):
            units += intake.feed(line[at : at + 65536])
            assert intake.held <= LONGEST + 65536
        units += intake.feed(b"\nstop program\n")
        assert [unit.words for unit in units if not unit.too_long] == ["stop program"]
        assert sum(unit.too_long for unit in units) == 1


@given(
    st.lists(st.binary(max_size=40) | st.sampled_from([b"def f():\n", b"end\n", b"if x:\n", b"\r\n", b'"\n']))
)
def test_nothing_that_comes_raises(pieces):
    intake = Intake()
    for piece in pieces:
        for unit in intake.feed(piece):
            assert unit.line >= 1
            assert unit.column >= 1
            assert isinstance(unit.words, str)
            assert unit.name is None or unit.name.isidentifier() or unit.name[0].isdecimal()


# ---------------------------------------------------------------------- the ear: orders


@pytest.mark.parametrize(
    ("text", "commands"),
    [
        ("power on", [c.PowerOn(token="the-token", release_brakes=False)]),
        ("power off", [c.PowerOff(token="the-token")]),
        ("set robotmode run", [c.PowerOn(token="the-token")]),
        ("set unlock protective stop", [c.UnlockProtectiveStop(token="the-token")]),
        ("stop program", [ProgramStop()]),
        ("  stop   program  # now", [ProgramStop()]),
        ("set sim", []),
        ("set real", []),
    ],
)
def test_commands_that_are_no_urscript_act_and_a_simulated_arm_stays_one(
    robot, control, sent, text, commands
):
    session(robot, control, sent.append).receive(text.encode() + b"\r\n")
    assert control.commands == commands
    assert not sent
    assert not robot.told


@pytest.mark.parametrize(
    "text", ["movej([0,0,0,0,0,0])\n", PROGRAM, "sec f():\nend\n", "power onto\n", "éß\n", "# a\n\nhalt\n"]
)
def test_everything_else_is_a_program_and_goes_to_the_controller_as_it_was_sent(robot, control, sent, text):
    session(robot, control, sent.append).receive(text.encode())
    assert control.commands == [ProgramRun(token="the-token", text=text)]
    assert not sent + robot.told


def test_units_are_carried_out_in_their_order_each_when_the_one_before_was_answered(robot, control, sent):
    interface = session(robot, control, sent.append)
    control.wait()
    interface.receive(b"def f():\nend\nstop program\nsec g():\nend\npower off\n")
    kinds = [ProgramRun, ProgramStop, ProgramStop, ProgramRun, c.PowerOff]  # a stop waits for nothing
    for number in range(1, 5):
        assert interface.waiting == 5 - number
        assert [type(command) for command in control.commands] == kinds[: number + 1]
        control.answer(keep=True)
    assert interface.waiting == 0


def test_what_is_complete_is_carried_out_even_if_the_connection_ends(robot, control, sent):
    interface = session(robot, control, sent.append)
    control.wait()
    interface.receive(b"set robotmode run\nmovej(q)\n")
    interface.closed()
    control.answer()
    assert [type(command) for command in control.commands] == [c.PowerOn, ProgramRun]
    assert control.left == 1  # what lasted longer than the connection; the program's own lasts


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


@pytest.mark.parametrize("text", REPORTS)
def test_what_became_of_a_script_is_one_line_on_the_console(robot, control, sent, text):
    interface = session(robot, control, sent.append)
    interface.receive(text)
    interface.closed()
    assert robot.reported == [REPORTS[text].format(control.peer)]


def test_a_text_that_is_not_valid_is_told_to_everybody_and_on_the_console(robot, control, sent):
    why = "compile_error_name_not_found:f:"
    control.refuse("script_error", why=why, where="text:4:3")
    session(robot, control, sent.append).receive(b"# comments\n# count\ndef g():\n  f()\nend\n")
    (exception,) = told(robot)
    assert (exception.kind, exception.values) == (10, {"line": 4, "column": 3, "text": why})
    assert robot.reported == [f'the script "g" of {control.peer} was refused: line 4, column 3: {why}']
    assert not sent


@pytest.mark.parametrize("text", ["movej(q)", "set robotmode run"])
def test_what_cannot_be_done_now_is_a_line_of_the_log_for_who_sent_it(robot, control, sent, text):
    control.refuse("wrong_mode", why="the arm has no power")
    robot.latest = Ticks(robot.latest).at(1, robot_mode=3)
    session(robot, control, sent.append).receive(text.encode() + b"\n")
    (line,) = [message(data) for data in sent]
    assert (line.kind, line.values["text"]) == (0, f"{text} was refused: the arm has no power")
    assert not robot.told


def test_a_refusal_is_told_on_the_console_with_its_reason(robot, control, sent):
    control.refuse("no_control")
    session(robot, control, sent.append).receive(b"power off\n")
    (line,) = robot.reported
    assert line.endswith("was refused: another client has control: 'a'")
    session(robot, control, sent.append, read_only=True).receive(b"power off\n")
    assert robot.reported[1].endswith("was refused: this port is read-only")


@pytest.mark.parametrize("text", [b"power on\n", b"movej(q)\n"])
def test_who_does_not_have_control_is_told_that_the_interface_is_read_only(robot, control, sent, text):
    control.refuse("no_control")
    session(robot, control, sent.append).receive(text)
    (error,) = [message(data) for data in sent]
    assert (error.kind, error.values["code"]) == (6, 210)
    assert not robot.told


@pytest.mark.parametrize("text", [b"power on\n", b"set robotmode run\n", b"set unlock protective stop\n"])
def test_what_is_so_already_is_no_failure(robot, control, sent, text):
    control.refuse("wrong_mode")
    session(robot, control, sent.append).receive(text)
    assert not sent


def test_a_protective_stop_that_cannot_be_left_yet_is_a_refusal(robot, control, sent):
    control.reply = Refused(code="wrong_mode", where="", why="it is stopping")
    robot.latest = Ticks(robot.latest).at(1, safety_mode=3)
    session(robot, control, sent.append).receive(b"set unlock protective stop\n")
    assert message(sent[0]).kind == 0


def test_the_read_only_ports_answer_commands_with_210_and_do_nothing(robot, control, sent):
    interface = session(robot, control, sent.append, read_only=True)
    interface.receive(b"power off\ndef f():\n  x=1\nend\nstop program\n")
    errors = [message(data) for data in sent]
    assert [error.values["code"] for error in errors] == [210] * 3
    assert not control.commands
    assert not robot.told


@given(data=st.binary(max_size=300))
def test_no_bytes_break_a_session(data):
    reported = []
    said = {"tell": message, "report": reported.append, "report_refusal": reported.append}
    robot = host(SimpleNamespace(description=UR5E, latest=None, **said))
    control = FakeControl()
    control.held_by_other = True
    control.refuse()
    interface = PrimarySession(robot, control, message)
    interface.opened()
    interface.receive(data)
    interface.receive(b"\npower on\nstop program\n")
    interface.closed()
    assert all(line.isprintable() and len(line) < 300 for line in reported)


@pytest.mark.parametrize(
    ("name", "number"),
    [("ur3e", 3), ("ur5e", 1), ("ur10e", 2), ("ur16e", 4), ("ur20", 7), ("ur30", 8), ("one-joint", 0)],
)
def test_the_robot_type_is_ur_s_number_of_the_model(name, number):
    assert robot_type(load(name)) == number

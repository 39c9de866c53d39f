"""The dashboard: commands of clients, and the exact answers that they compare."""

import re
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.controller.robots import UR5E
from tests.examples import examples

from tvist_protocol import commands as c
from tvist_protocol.programs import ProgramLoad, ProgramPause, ProgramPlay, ProgramStop
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_server.gateways.ur.dashboard import COMMANDS, LONGEST, DashboardSession, find

from .conftest import FakeControl
from .decoders import message
from .hosts import LineClient, host, told


def at(tick=100, **values):
    """Return a snapshot with these modes."""
    known = {"robot_mode": 7, "safety_mode": 1, "safety_status": 1, "timestamp": 41.0, "runtime_state": 1}
    return SimpleNamespace(state=SimpleNamespace(tick=tick), **(known | values))


@pytest.fixture
def ur_robot(robot):
    """The robot, running and at rest."""
    robot.latest = at()
    return host(robot)


@pytest.fixture
def client(ur_robot, control):
    return LineClient(DashboardSession, ur_robot, control)


# What clients match whole lines against, or compare them with.
MATCHED = r"""
PolyscopeVersion -> URSoftware 5\.22\.\d+\.\d+ \(.+\)
version -> 5\.22\.\d+\.\d+
get robot model -> UR5
get serial number -> 20\d+
ROBOTMODE -> Robotmode: RUNNING
safetymode -> Safetymode: NORMAL
safetystatus -> Safetystatus: NORMAL
is in remote control -> true
running -> Program running: false
programState -> STOPPED .+
get loaded program -> No program loaded
isProgramSaved -> false .+
power on -> Powering on
power off -> Powering off
brake release -> Brake releasing
unlock protective stop -> Protective stop releasing
restart safety -> Restarting safety
close safety popup -> closing safety popup
close popup -> closing popup
popup Test Popup -> showing popup
load wait_program.urp -> Loading program: wait_program\.urp
load /ursim/programs/wait_program.urp -> Loading program: /ursim/programs/wait_program\.urp
load nothing.urp -> File not found: nothing\.urp
load installation default.installation -> Loading installation: default\.installation
load installation other.installation -> File not found: other\.installation
play -> Failed to execute: play
pause -> Failed to execute: pause
stop -> Stopped
set operational mode manual -> Operational mode MANUAL is set
set operational mode fast -> Failed setting operational mode: fast
get operational mode -> NONE
clear operational mode -> No longer controlling the operational mode\..*
addToLog something -> Added log message
addToLog -> No log message to add
saveLog -> Log saved to disk
generate flight report system -> Flight Report generated with id: ?\S+
generate support file . -> Completed successfully: ?\S+
shutdown -> Shutting down
brake_release -> could not understand: 'brake_release'
running now -> could not understand: 'running now'
quit -> Disconnected
""".strip().split("\n")


def test_answers_are_those_that_clients_compare(robot, control):
    asked = set()
    for line in MATCHED:
        robot.latest = at()
        said, answer = line.split(" -> ")
        (heard,) = LineClient(DashboardSession, host(robot), control).send(said + "\r\n")
        assert re.fullmatch(answer, heard), line
        asked |= {find(said)[0]} if find(said) else set()
    assert asked == set(COMMANDS)
    for command in COMMANDS:
        assert find(command.keyword) == (command, ""), "no command hides another"


T = {"token": "the-token"}
POWER = [
    ("power on", 1, c.PowerOn(**T, release_brakes=False)),
    ("brake release", 1, c.PowerOn(**T)),
    ("power off", 1, c.PowerOff(**T)),
    ("shutdown", 1, c.PowerOff(**T)),
    ("restart safety", 1, c.PowerOff(**T)),
    ("restart safety", 8, c.RestartSafety(**T)),
    ("restart safety", 9, c.RestartSafety(**T)),
    ("unlock protective stop", 3, c.UnlockProtectiveStop(**T)),
]
"""A line, the safety mode, and the command that the robot gets."""


def test_power_and_safety_commands_fail_without_control(client, control, ur_robot):
    for asked, safety, command in POWER:
        ur_robot.latest = at(safety_mode=safety, safety_status=safety)
        control.reply = Done()
        assert not client.ask(asked).startswith("Failed")
        assert control.commands[-1] == command
        control.refuse("no_control")
        assert client.ask(asked) == f"Failed to execute: {asked}"


def test_programs_and_modes_do_not_change_without_control(client, control, ur_robot):
    client.ask("load wait_program.urp")
    control.held_by_other = True
    for asked, answer in (
        ("is in remote control", "false"),
        ("play", "Failed to execute: play"),
        ("load Q1.urp", "Error while loading program: Q1.urp"),
        ("load installation default.installation", "Failed to load installation: default.installation"),
        ("set operational mode MANUAL", "Failed setting operational mode: MANUAL"),
        ("clear operational mode", "Failed to execute: clear operational mode"),
        ("robotmode", "Robotmode: RUNNING"),
        ("stop", "Stopped"),  # any client may stop the robot
    ):
        assert client.ask(asked) == answer
    assert ur_robot.programs.name == "wait_program.urp"


def test_power_on_twice_succeeds_and_a_stopping_arm_cannot_be_unlocked(client, control, ur_robot):
    control.refuse("wrong_mode", why="it moves")
    assert client.send("power on\nbrake release\n") == ["Powering on", "Brake releasing"]
    ur_robot.latest = at(safety_mode=3, safety_status=3)
    assert client.ask("unlock protective stop").startswith("Cannot unlock protective stop until 5s after")


ROBOT_MODES = {-1: "NO_CONTROLLER", 3: "POWER_OFF", 4: "POWER_ON", 5: "IDLE", 6: "BACKDRIVE", 7: "RUNNING"}
SAFETY_MODES = {2: "REDUCED", 3: "PROTECTIVE_STOP", 5: "SAFEGUARD_STOP", 7: "ROBOT_EMERGENCY_STOP"}


def test_modes_have_ur_s_names(client, ur_robot):
    for number, name in ROBOT_MODES.items():
        ur_robot.latest = at(robot_mode=number)
        assert client.ask("robotmode") == f"Robotmode: {name}"
    for number, name in SAFETY_MODES.items():
        ur_robot.latest = at(safety_mode=number, safety_status=number)
        assert client.send("safetymode\nsafetystatus\n") == [f"Safetymode: {name}", f"Safetystatus: {name}"]
    ur_robot.latest = None
    assert client.ask("robotmode") == "Robotmode: NO_CONTROLLER"
    assert client.ask("safetymode").startswith("Safetymode: ")


def test_the_operational_mode_is_shared_by_all_clients(client, ur_robot, control):
    client.ask("set operational mode automatic")
    assert LineClient(DashboardSession, ur_robot, control).ask("get operational mode") == "AUTOMATIC"
    client.ask("clear operational mode")
    assert client.ask("get operational mode") == "NONE"


def test_popups_and_log_messages_are_sent_as_robot_messages(client, ur_robot):
    client.ask("popup Mind the gap")
    client.ask("addToLog it went well")
    window, line = told(ur_robot)
    assert (window.kind, window.values["text"], window.values["flags"]) == (2, "Mind the gap", [False] * 3)
    assert (line.kind, line.values["text"]) == (0, "it went well")


def test_a_program_is_loaded_played_paused_and_stopped(client, control):
    assert client.ask("load wait_program.urp") == "Loading program: wait_program.urp"
    states = []
    for asked in ("play", "pause", "play", "stop"):
        states += [client.ask(asked), client.ask("programState"), client.ask("running")]
    assert states == [
        "Starting program", "PLAYING wait_program.urp", "Program running: true",
        "Pausing program", "PAUSED wait_program.urp", "Program running: false",
        "Starting program", "PLAYING wait_program.urp", "Program running: true",
        "Stopped", "STOPPED wait_program.urp", "Program running: false",
    ]  # fmt: skip
    assert client.ask("get loaded program") == "Loaded program: /programs/wait_program.urp"
    assert client.ask("isProgramSaved") == "true wait_program.urp"
    kinds = [type(command) for command in control.commands]
    assert kinds == [ProgramLoad, ProgramPlay, ProgramPause, ProgramPlay, ProgramStop]
    assert control.commands[0].name == "wait_program.urp"


PLAYING, STOPPING, STOPPED = 2, 0, 1


@pytest.mark.parametrize(
    ("asked", "answer"), [("stop", "Stopped"), ("load Q1.urp", "Loading program: Q1.urp")]
)
def test_stop_and_load_are_answered_once_the_arm_is_at_rest(client, control, ur_robot, asked, answer):
    control.reply = Accepted(id=7)
    client.send("load Q2.urp\nplay\n")
    ur_robot.latest = at(runtime_state=PLAYING)
    assert client.send(asked + "\nrobotmode\n") == []
    for tick, runtime in enumerate((PLAYING, STOPPING, STOPPING), start=101):
        assert client.session.sample(at(tick, runtime_state=runtime)) == b""
        assert client.heard() == []
    client.session.sample(at(104, runtime_state=STOPPED))
    assert client.heard() == [answer, "Robotmode: RUNNING"]


def test_stop_fails_if_the_arm_does_not_come_to_rest(client, ur_robot):
    ur_robot.latest = at(runtime_state=PLAYING)
    client.send("stop\n")
    client.session.sample(at(2599, runtime_state=PLAYING))
    assert client.heard() == []
    client.session.sample(at(2600, runtime_state=PLAYING))
    assert client.heard() == ["Failed to execute: stop"]
    assert client.ask("robotmode") == "Robotmode: RUNNING"


def test_answers_keep_their_order_and_end_with_quit(client, control):
    control.wait()
    assert client.send("robotmode\npower on\npower off\nquit\nrobotmode\n") == ["Robotmode: RUNNING"]
    assert len(control.commands) == 1  # the next begins when the last was answered
    assert not client.session.over
    control.answer()
    assert client.heard() == ["Powering on", "Powering off", "Disconnected"]
    assert client.session.over
    assert client.send("robotmode\n") == []


def test_an_overlong_line_is_answered_once(client):
    client.session.receive(b"x" * (3 * LONGEST))
    first, second = client.send("y\nrobotmode\n")
    assert first.startswith("could not understand: 'xxx")
    assert len(first) < 300
    assert second == "Robotmode: RUNNING"


KEYWORDS = st.sampled_from([command.keyword for command in COMMANDS if command.keyword != "quit"])
LINES = st.one_of(
    st.binary(max_size=30),
    st.text(max_size=20).map(str.encode),
    st.tuples(KEYWORDS, st.text(max_size=10)).map(lambda pair: " ".join(pair).encode()),
)


@examples(40)
@given(lines=st.lists(LINES.map(lambda line: line.replace(b"\n", b"")), max_size=20), data=st.data())
def test_every_line_gets_exactly_one_answer(lines, data):
    lines = [line for line in lines if line.strip().lower() != b"quit"]
    said = {"tell": message, "report_refusal": str}
    robot = host(SimpleNamespace(description=UR5E, name="a", serial="20245500001", latest=None, **said))
    replies = st.sampled_from([Done(), Accepted(id=1), Refused(code="no_control", where="", why="x")])
    control = FakeControl()
    control.held_by_other = data.draw(st.booleans())
    control.change = lambda _: control.asked(data.draw(replies))
    client = LineClient(DashboardSession, robot, control)
    stream = b"".join(line + b"\n" for line in lines)
    cut = data.draw(st.integers(0, len(stream)))
    client.session.receive(stream[:cut])
    client.session.receive(stream[cut:])
    assert len(client.heard()) == len(lines)

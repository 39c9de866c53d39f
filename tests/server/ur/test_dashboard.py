"""The dashboard: what clients ask and the very words they wait for."""

import re
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.controller.robots import UR5E

from tvist_protocol import commands as c
from tvist_protocol.programs import ProgramLoad, ProgramPause, ProgramPlay, ProgramStop
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_server.gateways.ur.dashboard import COMMANDS, LONGEST, DashboardSession, find

from .conftest import FakeControl
from .decoders import message
from .hosts import host, told


def at(tick=100, **values):
    """A tick with these modes."""
    known = {"robot_mode": 7, "safety_mode": 1, "safety_status": 1, "timestamp": 41.0, "runtime_state": 1}
    return SimpleNamespace(state=SimpleNamespace(tick=tick), **(known | values))


def moved_to(robot, **values):
    """The robot's last tick with other modes."""
    robot.latest = at(**values)


class Client:
    """One client: asks, and hears lines."""

    def __init__(self, robot, control):
        self.sent = []
        self.session = DashboardSession(robot, control, self.sent.append)
        self.session.opened()
        self.heard()

    def heard(self):
        """The lines since the last look."""
        text, self.sent[:] = b"".join(self.sent).decode(), []
        assert not text or text.endswith("\n")
        return text.split("\n")[:-1]

    def send(self, text):
        self.session.receive(text.encode())
        return self.heard()

    def ask(self, text):
        (line,) = self.send(text + "\n")
        return line


@pytest.fixture
def desk(robot):
    """The robot, running and at rest."""
    moved_to(robot)
    return host(robot)


@pytest.fixture
def client(desk, control):
    return Client(desk, control)


# What clients match whole lines against, or compare them with.
MATCHED = [
    ("PolyscopeVersion", r"URSoftware 5\.22\.\d+\.\d+ \(.+\)"),
    ("version", r"5\.22\.\d+\.\d+"),
    ("get robot model", r"UR5"),
    ("get serial number", r"20\d+"),
    ("robotmode", r"Robotmode: RUNNING"),
    ("safetymode", r"Safetymode: NORMAL"),
    ("safetystatus", r"Safetystatus: NORMAL"),
    ("is in remote control", r"true"),
    ("running", r"Program running: false"),
    ("programState", r"STOPPED .+"),
    ("get loaded program", r"No program loaded"),
    ("isProgramSaved", r"false .+"),
    ("power on", r"Powering on"),
    ("power off", r"Powering off"),
    ("brake release", r"Brake releasing"),
    ("unlock protective stop", r"Protective stop releasing"),
    ("restart safety", r"Restarting safety"),
    ("close safety popup", r"closing safety popup"),
    ("close popup", r"closing popup"),
    ("popup Test Popup", r"showing popup"),
    ("load wait_program.urp", r"Loading program: wait_program\.urp"),
    ("load /ursim/programs/wait_program.urp", r"Loading program: /ursim/programs/wait_program\.urp"),
    ("load nothing.urp", r"File not found: nothing\.urp"),
    ("load installation default.installation", r"Loading installation: default\.installation"),
    ("load installation other.installation", r"File not found: other\.installation"),
    ("play", r"Failed to execute: play"),
    ("pause", r"Failed to execute: pause"),
    ("stop", r"Stopped"),
    ("set operational mode AUTOMATIC", r"Operational mode AUTOMATIC is set"),
    ("set operational mode manual", r"Operational mode MANUAL is set"),
    ("set operational mode fast", r"Failed setting operational mode: fast"),
    ("get operational mode", r"NONE"),
    ("clear operational mode", r"No longer controlling the operational mode\..*"),
    ("addToLog something", r"Added log message"),
    ("addToLog", r"No log message to add"),
    ("saveLog", r"Log saved to disk"),
    ("generate flight report", r"Flight Report generated with id: ?\S+"),
    ("generate flight report system", r"Flight Report generated with id: ?\S+"),
    ("generate support file .", r"Completed successfully: ?\S+"),
    ("shutdown", r"Shutting down"),
    ("quit", r"Disconnected"),
    ("brake_release", r"could not understand: 'brake_release'"),
    ("running now", r"could not understand: 'running now'"),
    ("", r"could not understand: ''"),
]


@pytest.mark.parametrize(("asked", "answer"), MATCHED)
def test_answers_are_the_words_clients_wait_for(client, asked, answer):
    assert re.fullmatch(answer, client.ask(asked))


def test_every_command_was_asked_for():
    assert {find(asked)[0] for asked, _ in MATCHED if find(asked)} == set(COMMANDS)


def test_no_command_hides_another():
    for command in COMMANDS:
        assert find(command.keyword) == (command, "")
        assert find(command.keyword.upper()) == (command, "")


def test_case_and_line_ends_do_not_matter(client):
    assert client.send("ROBOTMODE\r\nPower On\nPOPUP Hello You\r\n") == [
        "Robotmode: RUNNING",
        "Powering on",
        "showing popup",
    ]


# ---------------------------------------------------------------------- power and safety

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
"""What is asked for in a safety mode, and the robot's command for it."""


@pytest.mark.parametrize(("asked", "safety", "command"), POWER)
def test_power_and_safety_are_commands_of_the_robot_which_fail_without_control(
    client, control, desk, asked, safety, command
):
    moved_to(desk, safety_mode=safety, safety_status=safety)
    assert not client.ask(asked).startswith("Failed")
    assert control.commands == [command]
    control.refuse("no_control")
    assert client.ask(asked) == f"Failed to execute: {asked}"


def test_without_control_programs_and_modes_stay_as_they_are(client, control, desk):
    client.ask("load wait_program.urp")
    control.held_by_other = True
    assert client.ask("is in remote control") == "false"
    assert client.ask("play") == "Failed to execute: play"
    assert client.ask("load Q1.urp") == "Error while loading program: Q1.urp"
    assert client.ask("load installation default.installation") == (
        "Failed to load installation: default.installation"
    )
    assert client.ask("set operational mode MANUAL") == "Failed setting operational mode: MANUAL"
    assert client.ask("clear operational mode") == "Failed to execute: clear operational mode"
    assert desk.programs.name == "wait_program.urp"
    assert client.ask("robotmode") == "Robotmode: RUNNING"
    assert client.ask("stop") == "Stopped"  # anyone may


@pytest.mark.parametrize(
    ("asked", "answer"), [("power on", "Powering on"), ("brake release", "Brake releasing")]
)
def test_power_for_a_robot_that_has_it_is_no_failure(client, control, asked, answer):
    control.refuse("wrong_mode", why="it moves")
    assert client.ask(asked) == answer


def test_an_arm_that_is_still_stopping_cannot_be_unlocked(client, control, desk):
    moved_to(desk, safety_mode=3, safety_status=3)
    control.refuse("wrong_mode", why="it is stopping")
    assert client.ask("unlock protective stop").startswith("Cannot unlock protective stop until 5s after")


ROBOT_MODES = {-1: "NO_CONTROLLER", 3: "POWER_OFF", 4: "POWER_ON", 5: "IDLE", 6: "BACKDRIVE", 7: "RUNNING"}
SAFETY_MODES = {
    1: "NORMAL",
    2: "REDUCED",
    3: "PROTECTIVE_STOP",
    5: "SAFEGUARD_STOP",
    7: "ROBOT_EMERGENCY_STOP",
}


def test_modes_have_ur_s_names(client, desk):
    for number, name in ROBOT_MODES.items():
        moved_to(desk, robot_mode=number)
        assert client.ask("robotmode") == f"Robotmode: {name}"
    for number, name in SAFETY_MODES.items():
        moved_to(desk, safety_mode=number, safety_status=number)
        assert client.send("safetymode\nsafetystatus\n") == [f"Safetymode: {name}", f"Safetystatus: {name}"]


def test_before_the_first_tick_there_is_no_controller(client, desk):
    desk.latest = None
    assert client.ask("robotmode") == "Robotmode: NO_CONTROLLER"
    assert client.ask("safetymode").startswith("Safetymode: ")
    assert client.ask("popup hello") == "showing popup"


def test_the_operational_mode_is_the_robots(client, desk, control):
    client.ask("set operational mode automatic")
    assert Client(desk, control).ask("get operational mode") == "AUTOMATIC"
    client.ask("clear operational mode")
    assert client.ask("get operational mode") == "NONE"


def test_popups_and_the_log_are_told_to_who_listens_to_the_robot(client, desk):
    client.ask("popup Mind the gap")
    client.ask("addToLog it went well")
    window, line = told(desk)
    assert (window.kind, window.values["text"]) == (2, "Mind the gap")
    assert (line.kind, line.values["text"]) == (0, "it went well")


# ---------------------------------------------------------------------- programs


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
def test_what_was_stopped_rests_when_that_is_answered(client, control, desk, asked, answer):
    control.reply = Accepted(id=7)
    client.send("load Q2.urp\nplay\n")
    moved_to(desk, runtime_state=PLAYING)
    assert client.send(asked + "\nrobotmode\n") == []
    for tick, runtime in enumerate((PLAYING, STOPPING, STOPPING), start=101):
        assert client.session.sample(at(tick, runtime_state=runtime)) == b""
        assert client.heard() == []
    client.session.sample(at(104, runtime_state=STOPPED))
    assert client.heard() == [answer, "Robotmode: RUNNING"]
    client.session.sample(at(105, runtime_state=STOPPED))
    assert client.heard() == []


def test_what_does_not_come_to_rest_has_not_been_stopped(client, desk):
    moved_to(desk, runtime_state=PLAYING)
    client.send("stop\n")
    client.session.sample(at(2599, runtime_state=PLAYING))
    assert client.heard() == []
    client.session.sample(at(2600, runtime_state=PLAYING))
    assert client.heard() == ["Failed to execute: stop"]
    assert client.ask("robotmode") == "Robotmode: RUNNING"


# ---------------------------------------------------------------------- order, bounds, ends


def test_answers_come_in_the_order_of_the_questions(client, control):
    control.wait()
    assert client.send("robotmode\npower on\nversion\npower off\nrobotmode\n") == ["Robotmode: RUNNING"]
    assert len(control.commands) == 1  # the next begins when the last was answered
    control.answer()
    heard = client.heard()
    assert heard[0] == "Powering on"
    assert heard[2:] == ["Powering off", "Robotmode: RUNNING"]


def test_who_quits_gets_nothing_more(client, control):
    control.wait()
    assert client.send("power on\nquit\nrobotmode\n") == []
    assert not client.session.over
    control.answer()
    assert client.heard() == ["Powering on", "Disconnected"]
    assert client.session.over
    assert client.send("robotmode\n") == []


def test_a_line_that_is_too_long_is_one_line(client):
    client.session.receive(b"x" * (3 * LONGEST))
    assert len(client.session._lines.rest) <= LONGEST
    first, second = client.send("y\nrobotmode\n")
    assert first.startswith("could not understand: 'xxx")
    assert len(first) < 300
    assert second == "Robotmode: RUNNING"


SCRIPT = "PolyscopeVersion\r\nget serial number\nload paper.urp\npopup äöü\nfoo\nrobotmode\n".encode()


def test_lines_may_be_cut_anywhere(desk, control):
    whole = Client(desk, control).send(SCRIPT.decode())
    for at in range(len(SCRIPT) + 1):
        halves = Client(desk, control)
        halves.session.receive(SCRIPT[:at])
        halves.session.receive(SCRIPT[at:])
        assert halves.heard() == whole


KEYWORDS = st.sampled_from([command.keyword for command in COMMANDS if command.keyword != "quit"])
LINES = st.one_of(
    st.binary(max_size=30),
    st.text(max_size=20).map(str.encode),
    st.tuples(KEYWORDS, st.text(max_size=10)).map(lambda pair: " ".join(pair).encode()),
)


@given(lines=st.lists(LINES.map(lambda line: line.replace(b"\n", b"")), max_size=20), data=st.data())
def test_every_line_is_answered_with_one_line(lines, data):
    lines = [line for line in lines if line.strip().lower() != b"quit"]
    said = {"tell": message, "report_refusal": str}
    robot = host(SimpleNamespace(description=UR5E, name="a", serial="20245500001", latest=None, **said))
    replies = st.sampled_from([Done(), Accepted(id=1), Refused(code="no_control", where="", why="x")])
    control = FakeControl()
    control.held_by_other = data.draw(st.booleans())
    control.change = lambda _: control.asked(data.draw(replies))
    client = Client(robot, control)
    stream = b"".join(line + b"\n" for line in lines)
    cut = data.draw(st.integers(0, len(stream)))
    client.session.receive(stream[:cut])
    client.session.receive(stream[cut:])
    assert len(client.heard()) == len(lines)

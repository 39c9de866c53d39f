"""UR's interfaces of served robots, over real sockets and processes."""

import re
import socket
import sys
from pathlib import Path

import pytest
from tests import forked
from tests.conformance.served import PATIENCE, Served, refused_to_start
from tests.places import own_address

from tvist_client.blocking import Robot
from tvist_protocol.modes import RuntimeState
from tvist_server.ur_ports import WITHOUT_JOINTS, UrPorts

SEVEN = Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf"

pytestmark = pytest.mark.realtime


def asked(host, *lines, port=29999):
    """What the dashboard answers, after its greeting."""
    with (
        socket.create_connection((host, port), PATIENCE) as stream,
        stream.makefile("rw", newline="\n") as talk,
    ):
        assert talk.readline().startswith("Connected")
        said = []
        for line in lines:
            talk.write(f"{line}\n")
            talk.flush()
            said.append(talk.readline().strip())
        return said


def test_each_of_several_robots_has_interfaces_of_its_own():
    with Served("--robots", "ur5e*2", "--ur", "--ur-address", own_address(1), name=None) as served:
        first, second = (asked(own_address(last), "get serial number", "power off") for last in (1, 2))
        assert first[0] != second[0]
        assert first[1] == second[1] == "Powering off"
        assert served.end() == 0


def test_a_client_at_a_door_does_not_keep_the_robot_from_ending():
    with (
        Served("--ur", "--ur-address", own_address(9)) as served,
        socket.create_connection((own_address(9), 30003), PATIENCE) as stream,
    ):
        assert len(stream.recv(1220, socket.MSG_WAITALL)) == 1220
        assert served.end() == 0


def test_an_arm_with_seven_joints_has_the_dashboard_and_the_interpreter_alone():
    limited = [interface for interface in UrPorts().open() if interface not in WITHOUT_JOINTS]
    shut = [word for interface in limited for word in ("--ur-port", f"{interface}=off")]
    options = ("--robot", str(SEVEN), "--calibration", "none", "--ur", "--ur-address", own_address(25))
    code, said = refused_to_start(*options)
    assert (code, "the robot seven has 7 joints" in said) == (2, True)
    with Served(*options, *shut, name="seven") as served:
        said = asked(own_address(25), "power on", "brake release", "load Q2.urp", "play")
        assert said[-1] == "Starting program"
        with Robot.connect(served.endpoint, name="seven") as robot:
            for state in robot.states():
                if state.runtime_state == RuntimeState.STOPPED and state.actual_q[6] > 0.4:
                    break
            assert state.actual_q == pytest.approx([0.5] * 7, abs=0.01)
        assert served.end() == 0


def test_without_the_option_nothing_listens():
    with Served() as served, pytest.raises(ConnectionError):
        socket.create_connection(("127.0.0.1", 29999), PATIENCE).close()
    assert "30004" not in served.said


@pytest.mark.parametrize(
    ("options", "code", "named"),
    [
        (["--ur-port", "rtde"], 2, "INTERFACE=PORT"),
        (["--ur-port", "rtde=x"], 2, "INTERFACE=PORT"),
        (["--ur-port", "rtdee=30004"], 2, "rtdee"),
        (["--ur-address", "192.168.0.1"], 2, "--insecure"),
        (["--ur-address", "203.0.113.7", "--insecure"], 1, "does not have this address"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(options, code, named):
    ended = forked.run(
        [sys.executable, "-m", "tvist_cli", "serve", "--listen", "tcp/127.0.0.1:0", *options],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert ended.returncode == code, ended.stderr
    assert named in ended.stderr
    assert "Traceback" not in ended.stderr


def test_the_console_says_what_became_of_a_program_and_a_flood_of_them_does_not_flood_it():
    with Served("--ur", "--ur-address", own_address(17)) as served:
        with socket.create_connection((own_address(17), 30002), PATIENCE) as stream:
            host, port = stream.getsockname()
            stream.sendall(b"def there():\n  sync()\nend\n")
            served.wait_until_said(
                f'the script "there" of the client {host}:{port} of port 30002 was started'
            )
            stream.sendall(b"textmsg(1)\n" * 1000)
            served.wait_until_said("not shown since the last line")
            stream.sendall(b"set sim\n")
            served.wait_until_said('the script "set sim"')
        assert served.end() == 0
        lines = [line for line in served.lines if "the script" in line]
        left_out = [
            int(count) for line in lines for count in re.findall(r"since the last line: (\d+)\)", line)
        ]
        assert len(lines) + sum(left_out) == 1002
        assert len(lines) < sum(left_out)  # one a second: tests/server/ur/test_notices.py

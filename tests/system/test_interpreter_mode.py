"""UR's interpreter mode of a served robot in real time: a client that waits as UR's samples do, and its replay."""

import re
import socket

import pytest
from tests.conformance.served import PATIENCE, Served
from tests.places import own_address
from tests.system.shell import tvist

from tvist_lab.recordings.mcap_file import read

pytestmark = pytest.mark.realtime

HOST = own_address(33)
HOME = (-1.60, -1.727, -2.203, -0.808, 1.595, -0.031)
PROGRAM = """def main():
  global n = 1
  interpreter_mode(clearQueueOnEnter=False)
  write_output_integer_register(2, n)
end
"""
REPLY = re.compile(r"(\w+):\W+(\d+)?")
"""What UR's samples read of an answer."""


class Interpreter:
    """A client that asks one line at a time, as UR's samples do."""

    def __init__(self):
        self._stream = socket.create_connection((HOST, 30020), PATIENCE)
        self._talk = self._stream.makefile("rw", newline="\n")

    def ask(self, line):
        """Send a line; its answer's first word and number."""
        self._talk.write(f"{line}\n")
        self._talk.flush()
        return REPLY.match(self._talk.readline()).groups()

    def __call__(self, line):
        """Send a line that has to be accepted; the number in its answer."""
        kind, number = self.ask(line)
        assert kind != "discard", line
        return int(number)

    def until_accepted(self, line):
        """Send a line until a program takes it."""
        while self.ask(line)[0] == "discard":
            pass

    def until_executed(self, number):
        while self("statelastexecuted") < number or self("stateunexecuted"):
            pass

    def close(self):
        self._talk.close()
        self._stream.close()


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A run in which a client has the arm move, changes its mind, and lets the program end."""
    path = tmp_path_factory.mktemp("interpreter") / "run.mcap"
    with Served("--ur", "--ur-address", HOST, "--record", str(path)) as served:
        client = Interpreter()
        script = socket.create_connection((HOST, 30003), PATIENCE)
        script.sendall(PROGRAM.encode())
        client.until_accepted("sync()")
        near, far = ([angle + offset for angle in HOME] for offset in (0.1, 0.8))
        assert client(f"def there(q): movej(q, a=3, v=2) n = n + 1 end there({near})") == 2
        client.until_executed(client("write_output_integer_register(1, n)"))
        client(f"movej({far}, a=1, v=0.3)")
        client("write_output_integer_register(1, 99)")
        assert client("stateunexecuted") >= 1
        client("skipbuffer")
        assert client("stateunexecuted") == 0
        client("abort")
        client.until_executed(client("write_output_integer_register(1, 3)"))
        last = client("clear_interpreter()")
        client("sync()")
        assert client("statelastcleared") in {0, last}
        client("end_interpreter()")
        client.close()
        script.close()
        assert served.end() == 0
    return path


def test_statements_moved_the_arm_and_what_was_skipped_did_nothing(recording):
    content = read(recording)
    started = [event for event in content.events if event.kind == "motion_started"]
    assert len(started) == 2
    assert any(event.kind == "motion_stopped" and event.id == started[1].id for event in content.events)
    assert not [event for event in content.events if event.line is not None]


def test_its_replay_is_equal_to_the_last_bit(recording):
    said = tvist("log", "replay", recording, "--json").assert_done().json
    assert (said["equal"], said["first_difference"]) == (True, None)

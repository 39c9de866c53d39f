"""Programs in URScript over UR's interfaces of a served robot: what clients send, and what they are told of it."""

import socket
import struct
import time

import pytest
from tests.conformance.served import PATIENCE, Served
from tests.places import own_address
from tests.server.ur.decoders import message

pytestmark = pytest.mark.realtime

HOST, ELSEWHERE = own_address(31), own_address(32)
"""Address of the robot, and that of a client on another host."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("programs")
    (folder / "wait.script").write_text("def wait():\n  while True:\n    sync()\n  end\nend\n")
    (folder / "bad.script").write_text("def bad():\n  nothing()\nend\n")
    (folder / "packed.urp").write_bytes(b"\x1f\x8b nothing")
    return folder


@pytest.fixture(scope="module")
def served(folder):
    with Served("--ur", "--ur-address", HOST, "--programs", str(folder)) as served:
        yield served


def connect(port, source=None):
    address = None if source is None else (source, 0)
    return socket.create_connection((HOST, port), PATIENCE, source_address=address)


def send(text, port=30002):
    """Send a script, and leave when it has arrived: a client that leaves with states unread may take it back."""
    with connect(port) as stream:
        stream.sendall(text.encode())
        stream.shutdown(socket.SHUT_WR)
        while stream.recv(4096):
            pass


class Dashboard:
    """A client of the dashboard; a call asks one line."""

    def __init__(self, source=None):
        self._stream = connect(29999, source)
        self._talk = self._stream.makefile("rw", newline="\n")
        assert self._talk.readline().startswith("Connected")

    def __call__(self, line):
        self._talk.write(f"{line}\n")
        self._talk.flush()
        return self._talk.readline().strip()

    def until(self, line, answer):
        """Ask until the answer comes."""
        latest = time.monotonic() + PATIENCE
        while (said := self(line)) != answer:
            assert time.monotonic() < latest, said

    def close(self):
        self._talk.close()
        self._stream.close()


@pytest.fixture
def dashboard(served):
    dashboard = Dashboard()
    yield dashboard
    dashboard("stop")
    dashboard.close()


class Listener:
    """A client of the primary interface."""

    def __init__(self):
        self._stream = connect(30001)
        self._read = self._stream.makefile("rb")
        assert self.next().kind == 3

    def next(self):
        """The next robot message."""
        while True:
            head = self._read.read(5)
            length, kind = struct.unpack(">iB", head)
            package = head + self._read.read(length - 5)
            if kind == 20:
                return message(package)

    def keys(self, count):
        """The next key messages in short, without what comes between them."""
        found = []
        while len(found) < count:
            told = self.next()
            if told.kind == 7:
                found.append(f"{told.values['title'].removeprefix('PROGRAM_XXX_')} {told.values['text']}")
        return found

    def until(self, kind):
        """The next message of a kind."""
        while (told := self.next()).kind != kind:
            pass
        return told.values

    def close(self):
        self._read.close()
        self._stream.close()


@pytest.fixture
def listener(served):
    listener = Listener()
    yield listener
    listener.close()


@pytest.mark.parametrize("port", [30001, 30002, 30003])
def test_a_text_that_is_not_valid_is_an_exception_at_its_place_and_nothing_starts(served, listener, port):
    send("stop program\ndef f():\n  calldoesntexist()\nend\n", port)
    text = "compile_error_name_not_found:calldoesntexist:"
    assert listener.until(10) == {"line": 2, "column": 3, "text": text}
    send("def g():\n  sync()\nend\n", port)
    assert listener.keys(2) == ["STARTED g", "STOPPED g"]
    served.wait_until_said(f"of port {port} was refused: line 2, column 3: {text}")


def test_an_exception_of_a_running_program_names_its_line(listener):
    send("def f():\n  sleep(0.02)\n  movej(p[10,0,0,0,0,0])\nend\n")
    assert listener.keys(1) == ["STARTED f"]
    exception = listener.until(10)
    assert (exception["line"], exception["column"]) == (3, 3)
    assert listener.keys(1) == ["STOPPED f"]


def package(stream):
    """The next package of the real-time interface, as doubles."""
    return struct.unpack(">152d", stream.recv(1220, socket.MSG_WAITALL)[4:])


def test_a_line_is_a_program_that_runs_until_the_arm_is_there(dashboard, listener):
    with connect(30003) as stream:
        before = package(stream)
        assert before[131] == 1.0
        goal = [angle + 0.1 for angle in before[1:7]]
        send(f"movej({goal}, a=3, v=1)\n")
        assert listener.keys(1) == ["STARTED movej"]
        while package(stream)[131] != 2.0:
            pass
        assert dashboard("programState") == "PLAYING movej"
        while (now := package(stream))[131] != 1.0:
            pass
        assert now[1:7] == pytest.approx(goal, abs=1e-3)
    assert listener.keys(1) == ["STOPPED movej"]


def test_a_program_replaces_the_one_that_runs_and_order_is_kept_in_a_segment(dashboard, listener):
    programs = {name: f"def {name}():\n  sleep(100)\nend\n" for name in ("one", "two", "three")}
    send(programs["one"] + programs["two"] + "stop program\n" + programs["three"])
    assert listener.keys(5) == ["STARTED one", "STOPPED one", "STARTED two", "STOPPED two", "STARTED three"]
    send(programs["one"])
    assert listener.keys(2) == ["STOPPED three", "STARTED one"]


def test_texts_and_popups_reach_the_clients_and_a_blocking_popup_is_closed(dashboard, listener):
    send(
        'def f():\n  textmsg("n=", 3)\n  popup("Go on?", title="T", error=True, blocking=True)\n  textmsg("on")\nend\n'
    )
    assert listener.until(0)["text"] == "n=3"
    popup = listener.until(2)
    assert (popup["title"], popup["text"], popup["flags"]) == ("T", "Go on?", [False, True, True])
    assert dashboard("close popup") == "closing popup"
    assert listener.until(0)["text"] == "on"
    assert listener.keys(1) == ["STOPPED f"]


def test_files_of_the_folder_are_loaded_and_played(served, dashboard, listener):
    assert dashboard("load wait.urp") == "Loading program: wait.urp"
    assert dashboard("get loaded program") == "Loaded program: /programs/wait.urp"
    assert dashboard("isProgramSaved") == "true wait.urp"
    assert dashboard("play") == "Starting program"
    assert listener.keys(1) == ["STARTED wait"]
    assert dashboard("programState") == "PLAYING wait.urp"
    assert dashboard("pause") == "Pausing program"
    assert dashboard("programState") == "PAUSED wait.urp"
    assert dashboard("play") == "Starting program"
    assert dashboard("stop") == "Stopped"
    assert listener.keys(1) == ["STOPPED wait"]
    assert dashboard("load nowhere.urp") == "File not found: nowhere.urp"
    assert dashboard("load packed.urp") == "File not found: packed.urp"
    served.wait_until_said("cannot be unpacked")
    assert dashboard("load bad.script") == "Error while loading program: bad.script"
    served.wait_until_said("line 2, column 3: compile_error_name_not_found:nothing:")


def test_a_program_keeps_control_after_its_client_has_gone_and_gives_it_back_at_its_end(served, listener):
    elsewhere = Dashboard(ELSEWHERE)
    elsewhere.until("is in remote control", "true")
    with connect(30001) as stream:
        stream.sendall(b"def f():\n  sleep(0.5)\nend\n")
        assert listener.keys(1) == ["STARTED f"]
    assert elsewhere("is in remote control") == "false"
    with connect(30001, ELSEWHERE) as refused, refused.makefile("rb") as answers:
        refused.sendall(b"textmsg(1)\n")
        codes = []
        while 210 not in codes:
            length, kind = struct.unpack(">iB", answers.read(5))
            body = answers.read(length - 5)
            if kind == 20 and body[9] == 6:
                codes.append(struct.unpack_from(">i", body, 10)[0])
    assert listener.keys(1) == ["STOPPED f"]
    elsewhere.until("is in remote control", "true")
    elsewhere.close()

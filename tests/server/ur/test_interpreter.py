"""UR's interpreter mode: statements for a running program, and the lines that answer them."""

import asyncio
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_protocol.programs import Interpreter, ProgramInterpret, ProgramSkip
from tvist_protocol.replies import Accepted
from tvist_server.gateways.ur.interpreter import InterpreterSession

from .conftest import FakeControl, io
from .desks import PATIENCE, connect, lines, until

TOKEN = "the-token"


class Client:
    def __init__(self, robot, control):
        self.sent = []
        self.session = InterpreterSession(robot, control, self.sent.append)

    def say(self, text):
        self.session.receive(text.encode())
        heard, self.sent[:] = b"".join(self.sent).decode().splitlines(), []
        return heard


@pytest.fixture
def client(robot, control):
    seen = io(interpreter=Interpreter(interpreted=9, executed=7, cleared=4, waiting=2))
    robot.latest = SimpleNamespace(io=seen)
    return Client(robot, control)


def test_a_statement_is_passed_on_and_acknowledged_with_its_number(client, control):
    control.reply = Accepted(id=10)
    assert client.say("movej([0,0,0,0,0,0])\r\n") == ["ack: 10: movej([0,0,0,0,0,0])"]
    assert client.say("def f():\n  x = 1\nend\n") == ["ack: 10: def f(): x = 1 end"]
    assert [command.text for command in control.commands] == [
        "movej([0,0,0,0,0,0])\n",
        "def f():\n  x = 1\nend\n",
    ]


def test_a_statement_that_is_refused_is_discarded_with_the_reason(client, control):
    control.refuse("script_error", why="compile_error_name_not_found:f:", where="text:1:3")
    assert client.say("  f()\n") == ["discard: line 1, column 3, compile_error_name_not_found:f:: f()"]
    control.refuse("wrong_mode", why="no program waits")
    assert client.say("f()\n") == ["discard: no program waits: f()"]


def test_questions_are_answered_from_what_the_robot_publishes(client, control, robot):
    asked = ("statelastinterpreted", "statelastexecuted", "statelastcleared", "stateunexecuted")
    numbers = [client.say(question + "\n") for question in asked]
    assert numbers == [[f"state: {n}: {question}"] for n, question in zip((9, 7, 4, 2), asked, strict=True)]
    robot.latest = SimpleNamespace(io=io())
    assert client.say("stateunexecuted\n") == ["state: 0: stateunexecuted"]
    assert not control.commands


def test_commands_skip_what_waits_or_what_moves(client, control):
    assert client.say("skipbuffer\nabort\n") == ["ack: 9: skipbuffer", "ack: 9: abort"]
    assert control.commands == [
        ProgramSkip(token=TOKEN, what="statements"),
        ProgramSkip(token=TOKEN, what="move"),
    ]


def test_statements_are_passed_on_one_after_the_other(client, control):
    control.wait()
    assert client.say("a = 1\nb = 2\nc = 3\n") == []
    assert client.session.waiting == 3
    control.answer(Accepted(id=1), keep=True)
    assert client.say("") == ["ack: 1: a = 1"]
    assert len(control.of(ProgramInterpret)) == 2
    client.session.closed()
    control.answer(Accepted(id=2))
    assert client.say("") == []
    assert len(control.of(ProgramInterpret)) == 2


@given(data=st.binary(max_size=300), cut=st.integers(0, 300))
def test_no_bytes_break_it(data, cut):
    class Bare:
        latest = None

    client = Client(Bare(), FakeControl())
    client.session.receive(data[:cut])
    client.session.receive(data[cut:])
    client.session.receive(b"\nstateunexecuted\n")
    client.session.closed()
    assert all(line.decode().isprintable() for line in b"".join(client.sent).split(b"\n"))


async def test_a_program_is_built_statement_by_statement(desk):
    await desk.tick()
    _, script = await connect(desk, "secondary")
    script.write(b'def main():\n  a = 5\n  interpreter_mode()\n  textmsg("over")\nend\n')
    await until(lambda: desk.controller.programs.state == "PLAYING")
    await desk.tick(2)
    reader, writer = await connect(desk, "interpreter")
    assert await lines(reader, writer, "b = a + 1", "write_output_integer_register(3, b)", "nothing()") == [
        "ack: 1: b = a + 1",
        "ack: 2: write_output_integer_register(3, b)",
        "discard: line 1, column 1, compile_error_name_not_found:nothing:: nothing()",
    ]
    await desk.tick(2)
    assert desk.interfaces.robot.latest.output_int_register_3 == 6
    assert await lines(reader, writer, "statelastexecuted", "end_interpreter()") == [
        "state: 2: statelastexecuted",
        "ack: 3: end_interpreter()",
    ]
    await desk.tick(3)
    assert desk.controller.programs.state == "STOPPED"
    assert (await lines(reader, writer, "b = 1"))[0].startswith("discard: no program waits for statements")


async def test_without_control_a_statement_is_discarded(desk):
    await desk.tick()
    _, script = await connect(desk, "secondary")
    script.write(b"interpreter_mode()\n")
    await until(lambda: desk.controller.programs.state == "PLAYING")
    await desk.tick(2)
    reader, writer = await asyncio.open_connection(
        "127.0.0.1", desk.interfaces.ports["interpreter"], local_addr=("127.0.0.5", 0)
    )
    writer.write(b"sync()\n")
    answer = await asyncio.wait_for(reader.readline(), PATIENCE)
    assert answer.startswith(b"discard: ")
    assert b"control is held by" in answer
    writer.close()

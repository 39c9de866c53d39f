"""UR's interpreter mode: statements for a running program, and their answers."""

import asyncio
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_protocol.programs import Interpreter, ProgramInterpret, ProgramSkip
from tvist_protocol.replies import Accepted, Done
from tvist_server.gateways.ur.interpreter import LONGEST, InterpreterSession
from tvist_server.gateways.ur.programs import Programs

from .conftest import FakeControl, io
from .hosts import LineClient, external
from .served_controller import PATIENCE, connect, lines, until


@pytest.fixture
def robot():
    return SimpleNamespace(programs=Programs(None, external()))


@pytest.fixture
def client(robot, control):
    robot.programs.io(io(interpreter=Interpreter(interpreted=9, executed=7, cleared=4, waiting=2)))
    return LineClient(InterpreterSession, robot, control)


def test_a_statement_is_passed_on_and_acknowledged_with_its_number(client, control):
    control.reply = Accepted(id=10)
    assert client.send("movej([0,0,0,0,0,0])\r\n") == ["ack: 10: movej([0,0,0,0,0,0])"]
    control.reply = Accepted(id=11)
    assert client.send("  a = 1 b = 2\n") == ["ack: 11: a = 1 b = 2"]
    assert [command.text for command in control.commands] == ["movej([0,0,0,0,0,0])", "a = 1 b = 2"]


def test_an_overlong_statement_is_discarded(client, control):
    control.reply = Accepted(id=10)
    assert client.send("x" * (LONGEST + 1)) == []
    heard = client.send("x = 2\ny = 2\n")
    assert heard[0].startswith("discard: Statement is too long: it has more than")
    assert heard[1:] == ["ack: 10: y = 2"]
    assert [command.text for command in control.commands] == ["y = 2"]


REFUSED = [
    ("script_error", "compile_error_name_not_found:f:", "text:1:3",
     "Compile error: column 3, compile_error_name_not_found:f:"),
    ("script_error", "syntax_error_on_line:1:unexpected ')':", "text:1:3",
     "Syntax error: column 3, syntax_error_on_line:1:unexpected ')':"),
    ("wrong_mode", "no program waits", "", "Program is in an invalid state: no program waits"),
    ("busy", "it is full", "text", "Too many interpreted messages: it is full"),
    ("no_control", "another client has control", "", "another client has control"),
]  # fmt: skip


def test_a_refused_statement_is_discarded_with_the_reason(client, control):
    for code, why, where, said in REFUSED:
        control.refuse(code, why=why, where=where)
        assert client.send("f()\n") == [f"discard: {said}: f()"]


def test_state_questions_count_statements_since_the_last_io(client, control, robot):
    asked = ("statelastinterpreted", "statelastexecuted", "statelastcleared", "stateunexecuted")
    numbers = [client.send(question + "\n") for question in asked]
    assert numbers == [[f"state: {n}: {question}"] for n, question in zip((9, 7, 4, 2), asked, strict=True)]
    assert not control.commands
    control.reply = Accepted(id=10)
    heard = client.send("def f():\nstateunexecuted\n\n \r\nstatelastinterpreted\n")  # which opens no block
    assert heard == ["ack: 10: def f():", "state: 3: stateunexecuted", "state: 10: statelastinterpreted"]
    control.reply = Done()
    assert client.send("skipbuffer\nstateunexecuted\n")[1] == "state: 0: stateunexecuted"
    robot.programs.io(io(interpreter=Interpreter(interpreted=10, executed=8, waiting=2)))
    assert client.send("stateunexecuted\n") == ["state: 2: stateunexecuted"]
    control.reply = Accepted(id=1)  # of another program
    assert client.send("f()\nstateunexecuted\n")[1] == "state: 1: stateunexecuted"
    robot.programs.io(io())
    assert client.send("stateunexecuted\n") == ["state: 0: stateunexecuted"]


def test_skipbuffer_and_abort_skip_statements_or_the_move(client, control):
    assert client.send("skipbuffer\nabort\n") == ["ack: 9: skipbuffer", "ack: 9: abort"]
    assert control.commands == [ProgramSkip(token="the-token", what=what) for what in ("statements", "move")]


def test_statements_are_sent_one_after_the_other(client, control):
    control.wait()
    assert client.send("a = 1\nb = 2\nc = 3\n") == []
    assert client.session.waiting == 3
    control.answer(Accepted(id=1), keep=True)
    assert client.send("") == ["ack: 1: a = 1"]
    assert len(control.of(ProgramInterpret)) == 2
    client.session.closed()
    control.answer(Accepted(id=2), keep=True)
    control.answer(Accepted(id=3))
    assert client.send("") == []
    assert [command.text for command in control.of(ProgramInterpret)] == ["a = 1", "b = 2", "c = 3"]
    assert control.left == 1


@examples(40)
@given(data=st.binary(max_size=300), cut=st.integers(0, 300))
def test_random_bytes_do_not_break_a_session(data, cut):
    robot = SimpleNamespace(programs=Programs(None, external()))
    client = LineClient(InterpreterSession, robot, FakeControl())
    client.session.receive(data[:cut])
    client.session.receive(data[cut:])
    client.session.receive(b"\nstateunexecuted\n")
    client.session.closed()
    assert all(line.decode().isprintable() for line in b"".join(client.sent).split(b"\n"))


async def test_statements_run_one_by_one_and_errors_have_their_number(served):
    listener, script = await connect(served, "primary")
    script.write(b"def main():\n  a = 5\n  interpreter_mode()\nend\n")
    await until(lambda: served.controller.programs.state == "PLAYING")
    await served.tick(2)
    reader, writer = await connect(served, "interpreter")
    assert await lines(reader, writer, "write_output_integer_register(3, a + 1)", "nothing()") == [
        "ack: 1: write_output_integer_register(3, a + 1)",
        "discard: Compile error: column 1, compile_error_name_not_found:nothing:: nothing()",
    ]
    await served.tick(2)
    assert served.interfaces.robot.latest.output_int_register_3 == 6
    asked = ("statelastexecuted", "a = [1] b = a[4]")
    assert await lines(reader, writer, *asked) == [f"state: 1: {asked[0]}", f"ack: 2: {asked[1]}"]
    await served.tick(3)
    assert served.controller.programs.state == "STOPPED"
    assert (await lines(reader, writer, "b = 1"))[0].startswith("discard: Program is in an invalid state: ")
    seen = b""
    async with asyncio.timeout(PATIENCE):
        while b"(in statement 2)" not in seen:
            seen += await listener.read(4096)

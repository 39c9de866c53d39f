"""UR's interpreter mode: statements for a running program, and the lines that answer them."""

import asyncio
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_protocol.programs import Interpreter, ProgramInterpret, ProgramSkip
from tvist_protocol.replies import Accepted, Done
from tvist_server.gateways.ur.interpreter import LONGEST, InterpreterSession
from tvist_server.gateways.ur.programs import Programs

from .conftest import FakeControl, io
from .desks import PATIENCE, connect, lines, until
from .hosts import external

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
def robot():
    return SimpleNamespace(programs=Programs(None, external()))


@pytest.fixture
def client(robot, control):
    robot.programs.io(io(interpreter=Interpreter(interpreted=9, executed=7, cleared=4, waiting=2)))
    return Client(robot, control)


def test_a_statement_is_passed_on_and_acknowledged_with_its_number(client, control):
    control.reply = Accepted(id=10)
    assert client.say("movej([0,0,0,0,0,0])\r\n") == ["ack: 10: movej([0,0,0,0,0,0])"]
    control.reply = Accepted(id=11)
    assert client.say("  a = 1 b = 2\n") == ["ack: 11: a = 1 b = 2"]
    assert [command.text for command in control.commands] == ["movej([0,0,0,0,0,0])", "a = 1 b = 2"]


def test_each_line_is_answered_even_if_it_opens_a_block(client, control):
    """A forgotten `end` must not swallow what follows."""
    control.reply = Accepted(id=10)
    assert client.say("def f():\nstatelastexecuted\n\n \r\n# nothing\n") == [
        "ack: 10: def f():",
        "state: 7: statelastexecuted",
        "ack: 10: # nothing",
    ]


def test_a_line_that_is_too_long_is_discarded_and_not_passed_on(client, control):
    control.reply = Accepted(id=10)
    assert client.say("x" * (LONGEST + 1)) == []
    heard = client.say("x = 2\ny = 2\n")
    assert heard[0].startswith("discard: Statement is too long: it has more than")
    assert heard[1:] == ["ack: 10: y = 2"]
    assert [command.text for command in control.commands] == ["y = 2"]


def test_a_statement_that_is_refused_is_discarded_with_the_reason(client, control):
    control.refuse("script_error", why="compile_error_name_not_found:f:", where="text:1:3")
    assert client.say("a=f()\n") == [
        "discard: Compile error: column 3, compile_error_name_not_found:f:: a=f()"
    ]
    control.refuse("script_error", why="syntax_error_on_line:1:unexpected ')':", where="text:1:3")
    assert client.say("f))\n") == [
        "discard: Syntax error: column 3, syntax_error_on_line:1:unexpected ')':: f))"
    ]
    control.refuse("wrong_mode", why="no program waits")
    assert client.say("f()\n") == ["discard: Program is in an invalid state: no program waits: f()"]
    control.refuse("busy", why="it is full", where="text")
    assert client.say("f()\n") == ["discard: Too many interpreted messages: it is full: f()"]
    control.refuse("no_control", why="another client has control")
    assert client.say("f()\n") == ["discard: another client has control: f()"]


def test_questions_count_what_was_answered_since_the_robot_told_of_its_statements(client, control, robot):
    control.reply = Accepted(id=10)
    assert client.say("f()\nstateunexecuted\nstatelastinterpreted\n")[1:] == [
        "state: 3: stateunexecuted",
        "state: 10: statelastinterpreted",
    ]
    control.reply = Done()
    assert client.say("skipbuffer\nstateunexecuted\n")[1] == "state: 0: stateunexecuted"
    robot.programs.io(io(interpreter=Interpreter(interpreted=10, executed=8, waiting=2)))
    assert client.say("stateunexecuted\n") == ["state: 2: stateunexecuted"]
    control.reply = Accepted(id=1)  # of another program
    assert client.say("f()\nstateunexecuted\n")[1] == "state: 1: stateunexecuted"


def test_questions_are_answered_from_what_the_robot_publishes(client, control, robot):
    asked = ("statelastinterpreted", "statelastexecuted", "statelastcleared", "stateunexecuted")
    numbers = [client.say(question + "\n") for question in asked]
    assert numbers == [[f"state: {n}: {question}"] for n, question in zip((9, 7, 4, 2), asked, strict=True)]
    robot.programs.io(io())
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
    control.answer(Accepted(id=2), keep=True)
    control.answer(Accepted(id=3))
    assert client.say("") == []
    assert [command.text for command in control.of(ProgramInterpret)] == ["a = 1", "b = 2", "c = 3"]
    assert control.left == 1


@given(data=st.binary(max_size=300), cut=st.integers(0, 300))
def test_no_bytes_break_it(data, cut):
    client = Client(SimpleNamespace(programs=Programs(None, external())), FakeControl())
    client.session.receive(data[:cut])
    client.session.receive(data[cut:])
    client.session.receive(b"\nstateunexecuted\n")
    client.session.closed()
    assert all(line.decode().isprintable() for line in b"".join(client.sent).split(b"\n"))


async def waiting(desk, program="interpreter_mode()\n"):
    """Have a program wait for statements; what speaks to it."""
    _, script = await connect(desk, "secondary")
    script.write(program.encode())
    await until(lambda: desk.controller.programs.state == "PLAYING")
    await desk.tick(2)
    return await connect(desk, "interpreter")


async def ask(desk, *sent):
    reader, writer = await connect(desk, "interpreter")
    answers = await lines(reader, writer, *sent)
    writer.close()
    return answers


async def test_a_program_is_built_statement_by_statement(desk):
    program = 'def main():\n  a = 5\n  interpreter_mode()\n  textmsg("over")\nend\n'
    reader, writer = await waiting(desk, program)
    assert await lines(reader, writer, "b = a + 1", "write_output_integer_register(3, b)", "nothing()") == [
        "ack: 1: b = a + 1",
        "ack: 2: write_output_integer_register(3, b)",
        "discard: Compile error: column 1, compile_error_name_not_found:nothing:: nothing()",
    ]
    await desk.tick(2)
    assert desk.interfaces.robot.latest.output_int_register_3 == 6
    assert await lines(reader, writer, "statelastexecuted", "end_interpreter()") == [
        "state: 2: statelastexecuted",
        "ack: 3: end_interpreter()",
    ]
    await desk.tick(3)
    assert desk.controller.programs.state == "STOPPED"
    assert (await lines(reader, writer, "b = 1"))[0].startswith("discard: Program is in an invalid state: ")


async def test_without_control_a_statement_is_discarded(desk):
    await waiting(desk)
    reader, writer = await asyncio.open_connection(
        "127.0.0.1", desk.interfaces.ports["interpreter"], local_addr=("127.0.0.5", 0)
    )
    writer.write(b"sync()\n")
    answer = await asyncio.wait_for(reader.readline(), PATIENCE)
    assert answer.startswith(b"discard: ")
    assert b"control is held by" in answer
    writer.close()


async def test_lines_may_arrive_in_pieces_or_all_at_once(desk):
    reader, writer = await waiting(desk)
    for piece in (b"write_output_", b"integer_register(3, 4", b")\r", b"\nstateun"):
        writer.write(piece)
        await desk.tick(2)
    assert await reader.readline() == b"ack: 1: write_output_integer_register(3, 4)\n"
    assert await lines(reader, writer, "executed") == ["state: 1: stateunexecuted"]
    writer.write(b"".join(b"write_output_integer_register(3, %d)\n" % number for number in range(200)))
    answers = [await asyncio.wait_for(reader.readline(), PATIENCE) for _ in range(200)]
    assert [answer.split(b":")[1].strip() for answer in answers] == [
        b"%d" % number for number in range(2, 202)
    ]
    await desk.tick(10)
    assert desk.interfaces.robot.latest.output_int_register_3 == 199


async def test_what_has_arrived_is_carried_out_though_its_client_leaves(desk):
    _, writer = await waiting(desk)
    number = b"write_output_integer_register(3, %d)\n"
    writer.write(number % 1 + number % 2 + number % 3 + b"write_output_integer_register(3, 9")
    writer.close()
    await until(lambda: desk.controller.io().interpreter.interpreted == 3)
    await desk.tick(3)
    assert desk.interfaces.robot.latest.output_int_register_3 == 3
    assert desk.controller.programs.state == "PLAYING"
    assert await ask(desk, "statelastexecuted") == ["state: 3: statelastexecuted"]


async def test_two_clients_of_a_host_add_to_one_program_and_see_each_others_statements(desk):
    first = await waiting(desk)
    second = await connect(desk, "interpreter")
    assert await lines(*first, "a = 1", "def f(): return 2 end") == [
        "ack: 1: a = 1",
        "ack: 2: def f(): return 2 end",
    ]
    assert await lines(*second, "stateunexecuted", "write_output_integer_register(3, a + f())") == [
        "state: 2: stateunexecuted",
        "ack: 3: write_output_integer_register(3, a + f())",
    ]
    await desk.tick(3)
    assert desk.interfaces.robot.latest.output_int_register_3 == 3
    assert await lines(*first, "statelastexecuted") == ["state: 3: statelastexecuted"]


async def test_statements_after_a_program_was_stopped_are_discarded_until_the_next_one_runs(desk):
    reader, writer = await waiting(desk)
    assert await lines(reader, writer, "sleep(100)", "b = 1") == ["ack: 1: sleep(100)", "ack: 2: b = 1"]
    await desk.tick(3)
    _, primary = await connect(desk, "primary")
    primary.write(b"stop program\n")
    await until(lambda: desk.controller.programs.state == "STOPPED")
    await desk.tick(2)
    (answer,) = await lines(reader, writer, "b = 1")
    assert answer.startswith("discard: Program is in an invalid state: ")
    assert await lines(reader, writer, "stateunexecuted") == ["state: 0: stateunexecuted"]
    await waiting(desk)
    assert await lines(reader, writer, "b = 1") == ["ack: 1: b = 1"]


async def test_an_error_of_a_statement_is_told_with_its_number(desk):
    """It has been acknowledged, as it is valid; the program ends with it."""
    reader, writer = await waiting(desk)
    listener, _ = await connect(desk, "primary")
    await desk.tick()
    assert await lines(reader, writer, "a = 1", "a = [1] b = a[4]") == [
        "ack: 1: a = 1",
        "ack: 2: a = [1] b = a[4]",
    ]
    await desk.tick(3)
    assert desk.controller.programs.state == "STOPPED"
    seen = b""
    async with asyncio.timeout(PATIENCE):
        while b"(in statement 2)" not in seen:
            seen += await listener.read(4096)

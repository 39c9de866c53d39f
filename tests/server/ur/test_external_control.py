"""Programs with a node External Control: loaded by name, completed by the client that plays them, then played."""

import asyncio

import pytest

from tvist_protocol.programs import ProgramLoad, ProgramPause, ProgramPlay
from tvist_server.gateways.ur import program_request
from tvist_server.gateways.ur.external_control import ALONE, ExternalControl
from tvist_server.gateways.ur.program_request import ProgramRequests
from tvist_server.gateways.ur.programs import Programs
from tvist_server.program_folder import ProgramFolder

from .conftest import io
from .hosts import told

SENT = "# HEADER_BEGIN\nglobal a = 1\n# HEADER_END\nwhile a < 2:\n  sync()\nend\n# NODE_CONTROL_LOOP_ENDS\n"


class Client:
    """Machines that are asked, and what they answer."""

    def __init__(self, answer=SENT):
        self.answer, self.asked = answer, []

    def fetch(self, host, then):
        self.asked.append(host)
        then(self.answer)


def of(robot, folder=None, answer=SENT):
    client = Client(answer)
    return Programs(robot, ExternalControl(folder, client.fetch)), client


def test_it_exists_without_a_file_and_gets_its_text_when_it_is_played(robot, control):
    programs, client = of(robot)
    outcomes, heard = [], []
    programs.load("/programs/external_control.urp", control, outcomes.append)
    assert control.commands == [ProgramLoad(name="external_control.urp", text=ALONE)]
    assert not client.asked
    programs.play(control, heard.append)
    load, play = control.commands[1:]
    assert (outcomes, heard, client.asked) == ([None], [True], ["10.0.0.2"])
    assert isinstance(play, ProgramPlay)
    assert load.name == "external_control.urp"
    assert "global a = 1" in load.text
    assert programs.state == "PLAYING"


def test_a_machine_that_does_not_answer_starts_nothing(robot, control):
    programs, _ = of(robot, answer=None)
    programs.load("external_control.urp", control, lambda _: None)
    heard = []
    programs.play(control, heard.append)
    assert heard == [False]
    assert control.of(ProgramPlay) == []


def test_a_text_that_is_not_valid_is_an_exception_and_starts_nothing(robot, control):
    programs, _ = of(robot)
    programs.load("external_control.urp", control, lambda _: None)
    control.refuse("script_error", "syntax_error", "text:3:4")
    heard = []
    programs.play(control, heard.append)
    assert heard == [False]
    assert [message.kind for message in told(robot)] == [10]


@pytest.mark.parametrize("what", ["stop", "load", "play"])
def test_what_comes_while_a_machine_is_asked_counts(robot, control, what):
    waiting = []
    programs = Programs(robot, ExternalControl(None, lambda _, then: waiting.append(then)))
    programs.load("external_control.urp", control, lambda _: None)
    heard = []
    programs.play(control, lambda well: heard.append(("first", well)))
    if what == "stop":
        programs.stop(control, lambda _: None)
    elif what == "load":
        programs.load("Q1.urp", control, lambda _: None)
    else:
        programs.play(control, lambda well: heard.append(("second", well)))
    for then in waiting:
        then(SENT)
    assert heard == [("first", False)] + ([("second", True)] if what == "play" else [])
    assert len(control.of(ProgramPlay)) == (1 if what == "play" else 0)


def test_a_script_of_this_name_that_a_client_has_sent_is_played_as_it_is(robot, control):
    programs, client = of(robot)
    programs.io(io(program="external_control"))
    programs.play(control, lambda _: None)
    assert not client.asked
    assert len(control.of(ProgramPlay)) == 1


def test_a_paused_one_goes_on_as_it_is(robot, control):
    programs, client = of(robot)
    programs.load("external_control.urp", control, lambda _: None)
    programs.play(control, lambda _: None)
    programs.pause(control, lambda _: None)
    programs.play(control, lambda _: None)
    assert len(client.asked) == len(control.of(ProgramPause)) == 1
    assert len(control.of(ProgramPlay)) == 2


def test_a_file_of_this_name_comes_first_and_other_programs_are_left_alone(robot, control, tmp_path):
    (tmp_path / "external_control.script").write_text("sync()\n")
    (tmp_path / "bad.urp").write_bytes(b"\xff")
    programs, client = of(robot, ProgramFolder(tmp_path))
    for name in ("external_control.urp", "Q1.urp", "bad.urp"):
        programs.load(name, control, lambda _: None)
        programs.play(control, lambda _: None)
    assert not client.asked
    assert all(command.text is None for command in control.of(ProgramLoad))


@pytest.mark.parametrize(
    ("pieces", "ends", "text"),
    [
        ([SENT.encode()], False, SENT),
        ([SENT.encode()[:30], SENT.encode()[30:]], False, SENT),
        ([b"sync()\n"], True, "sync()\n"),
        ([], True, None),
        ([b"\xff\n"], True, None),
    ],
)
def test_a_machine_is_asked_for_its_program(monkeypatch, pieces, ends, text):
    """The library sends its program in one go and leaves the connection open; another may end it."""

    async def run():
        asked, answers = [], []
        done = asyncio.Event()

        async def serve(reader, writer):
            asked.append(await reader.readline())
            for piece in pieces:
                writer.write(piece)
                await writer.drain()
                await asyncio.sleep(0.01)
            if ends:
                writer.close()
            else:
                await reader.read()
                writer.close()

        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        monkeypatch.setattr(program_request, "PORT", server.sockets[0].getsockname()[1])

        def then(sent):
            answers.append(sent)
            done.set()

        requests = ProgramRequests()
        requests.fetch("127.0.0.1", then)
        await asyncio.wait_for(done.wait(), 60)
        server.close()
        assert answers == [text]
        assert asked == [b"request_program\n"]

    asyncio.run(run())


def test_where_nobody_listens_the_answer_is_none(monkeypatch):
    async def run():
        monkeypatch.setattr(program_request, "PORT", 1)
        answered = asyncio.get_running_loop().create_future()
        requests = ProgramRequests()
        requests.fetch("127.0.0.1", answered.set_result)
        assert await asyncio.wait_for(answered, 60) is None

    asyncio.run(run())

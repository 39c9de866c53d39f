"""Programs with an External Control node: loaded by name, completed by the client that plays them, and played."""

import asyncio

import pytest

from tvist_protocol.programs import ProgramLoad, ProgramPlay
from tvist_server.gateways.ur import program_request
from tvist_server.gateways.ur.deferred import Deferred
from tvist_server.gateways.ur.external_control import ALONE
from tvist_server.gateways.ur.program_request import program_of
from tvist_server.gateways.ur.programs import Programs
from tvist_server.program_folder import ProgramFolder

from .conftest import io
from .decoders import message
from .hosts import external, hear

SENT = "# HEADER_BEGIN\nglobal a = 1\n# HEADER_END\nwhile a < 2:\n  sync()\nend\n# NODE_CONTROL_LOOP_ENDS\n"


def of(robot, folder=None, answer=SENT):
    """Return programs, and the list of machines that were asked for one."""
    asked = []

    async def fetch(host):
        asked.append(host)
        return answer

    return Programs(robot, external(folder, fetch)), asked


def test_the_built_in_program_gets_its_text_when_it_is_played(robot, control):
    programs, asked = of(robot)
    outcomes, heard = [], []
    hear(programs.load("/programs/external_control.urp", control), outcomes)
    assert control.commands == [ProgramLoad(name="external_control.urp", text=ALONE)]
    assert not asked
    hear(programs.play(control), heard)
    load, play = control.commands[1:]
    assert (outcomes, heard, asked) == ([None], [True], ["10.0.0.2"])
    assert isinstance(play, ProgramPlay)
    assert load.name == "external_control.urp"
    assert "global a = 1" in load.text
    assert programs.state == "PLAYING"


@pytest.mark.parametrize(("answer", "code"), [(None, None), (SENT, "script_error")])
def test_no_program_starts_without_a_valid_text(robot, control, answer, code):
    programs, _ = of(robot, answer=answer)
    hear(programs.load("external_control.urp", control), [])
    if code is not None:
        control.refuse(code, "syntax_error", "text:3:4")
    heard = []
    hear(programs.play(control), heard)
    assert (heard, control.of(ProgramPlay)) == ([False], [])
    assert [message(data).kind for data in robot.told] == ([10] if code else [])


@pytest.mark.parametrize("what", ["stop", "load", "play"])
def test_stop_load_and_play_cancel_a_pending_request_for_the_text(robot, control, what):
    waiting = [Deferred(), Deferred()]
    left = iter(waiting)
    programs = Programs(robot, external(fetch=lambda _: next(left)))
    hear(programs.load("external_control.urp", control), [])
    heard = []
    hear(programs.play(control), heard)
    if what == "load":
        hear(programs.load("Q1.urp", control), [])
    else:
        hear(getattr(programs, what)(control), heard if what == "play" else [])
    for sent in waiting:
        sent.set(SENT)
    assert heard == [False] + ([True] if what == "play" else [])
    assert len(control.of(ProgramPlay)) == (1 if what == "play" else 0)


def test_a_file_named_external_control_replaces_the_built_in_program(robot, control, tmp_path):
    (tmp_path / "external_control.script").write_text("sync()\n")
    (tmp_path / "bad.urp").write_bytes(b"\xff")
    programs, asked = of(robot, ProgramFolder(tmp_path))
    programs.io(io(program="external_control"))  # that a client has sent
    hear(programs.play(control), [])
    for name in ("external_control.urp", "Q1.urp", "bad.urp"):
        hear(programs.load(name, control), [])
        hear(programs.play(control), [])
    assert not asked
    assert all(command.text is None for command in control.of(ProgramLoad))


@pytest.mark.parametrize(
    ("pieces", "ends", "text"),
    [
        ([SENT.encode()[:30], SENT.encode()[30:]], False, SENT),
        ([b"sync()\n"], True, "sync()\n"),
        ([], True, None),
        ([b"\xff\n"], True, None),
    ],
)
async def test_the_program_is_requested_from_the_client(monkeypatch, pieces, ends, text):
    """The library sends its program in one go and leaves the connection open; another may end it."""
    asked = []

    async def serve(reader, writer):
        asked.append(await reader.readline())
        for piece in pieces:
            writer.write(piece)
            await writer.drain()
        if not ends:
            await reader.read()
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    monkeypatch.setattr(program_request, "PORT", server.sockets[0].getsockname()[1])
    assert await asyncio.wait_for(program_of("127.0.0.1"), 60) == text
    server.close()
    assert asked == [b"request_program\n"]


async def test_a_client_that_does_not_listen_sends_no_program(monkeypatch):
    monkeypatch.setattr(program_request, "PORT", 1)
    assert await asyncio.wait_for(program_of("127.0.0.1"), 60) is None

"""Scripts that clients send: run in their order, with the client's control, and told about on the primary interface."""

import asyncio
import select
import socket
import struct

from tvist_protocol.programs import ProgramRun

from .decoders import message
from .desks import PATIENCE, connect, connect_and_greet, lines, until


async def robot_messages(reader, count):
    """The next messages of the primary interface, without states and versions."""
    found = []
    while len(found) < count:
        head = await asyncio.wait_for(reader.readexactly(5), PATIENCE)
        length, kind = struct.unpack(">iB", head)
        package = head + await reader.readexactly(length - 5)
        if kind == 20 and message(package).kind != 3:
            found.append(message(package))
    return found


async def listening(desk):
    """What reads the primary interface, and what writes to the secondary one."""
    listener, _ = await connect(desk, "primary")
    _, writer = await connect(desk, "secondary")
    return listener, writer


def keys(messages):
    """Key messages and exceptions in short."""
    return [one.values.get("title", one.values["text"])[12:] + " " + one.values["text"] for one in messages]


async def test_a_script_is_run_and_told_about_even_if_its_client_has_gone(desk):
    listener, writer = await listening(desk)
    writer.write(b"movej([0.1,-1.6,0.1,-1.5,0,0])\n")
    writer.close()
    await until(lambda: desk.controller.programs.state == "PLAYING")
    await desk.tick(2)
    assert keys(await robot_messages(listener, 1)) == ["STARTED movej"]
    snapshot = desk.interfaces.robot.latest
    assert (snapshot.runtime_state, snapshot.robot_status_bits, snapshot.script_control_line) == (2, 3, 1)
    assert desk.holder() == "ur-127.0.0.1"
    await desk.tick(1500)
    assert keys(await robot_messages(listener, 1)) == ["STOPPED movej"]
    await until(lambda: desk.holder() is None)
    assert desk.interfaces.robot.latest.runtime_state == 1


async def test_programs_in_one_segment_are_run_one_after_the_other(desk):
    listener, _ = await connect(desk, "primary")
    _, writer = await connect(desk, "realtime")
    programs = [f"def {name}():\n  sleep(10)\nend\n" for name in ("one", "two", "three")]
    writer.write("".join([programs[0], programs[1], "stop program\n", programs[2]]).encode())
    await until(lambda: desk.controller.programs.name == "three")
    await desk.tick(2)
    told = await robot_messages(listener, 5)
    assert keys(told) == ["STARTED one", "STOPPED one", "STARTED two", "STOPPED two", "STARTED three"]


async def test_a_secondary_program_runs_beside_and_is_not_told_about(desk):
    listener, _ = await connect(desk, "primary")
    _, writer = await connect(desk, "primary")
    writer.write(b"def main():\n  sleep(10)\nend\n")
    await until(lambda: desk.controller.programs.name == "main")
    await desk.tick(2)
    writer.write(b'sec aside():\n  textmsg("beside")\nend\n')
    await until(lambda: isinstance(desk.last, ProgramRun) and "aside" in desk.last.text)
    await desk.tick(2)
    assert desk.controller.programs.state == "PLAYING"
    writer.write(b"stop program\n")
    await until(lambda: desk.controller.programs.state == "STOPPED")
    await desk.tick(2)
    assert keys(await robot_messages(listener, 3)) == ["STARTED main", " beside", "STOPPED main"]


async def test_an_exception_of_a_running_program_comes_before_its_end(desk):
    listener, writer = await listening(desk)
    writer.write(b"def f():\n  sleep(0.01)\n  movej(p[10,0,0,0,0,0])\nend\n")
    await until(lambda: desk.controller.programs.state == "PLAYING")
    await desk.tick(20)
    started, exception, stopped = await robot_messages(listener, 3)
    assert keys([started, stopped]) == ["STARTED f", "STOPPED f"]
    assert (exception.kind, exception.values["line"], exception.values["column"]) == (10, 3, 3)


async def test_the_dashboard_plays_a_script_again_under_its_name(desk):
    _, writer = await connect(desk, "secondary")
    writer.write(b"def again():\n  sleep(0.01)\nend\n")
    await until(lambda: desk.controller.programs.name == "again")
    await desk.tick(20)
    dashboard = await connect_and_greet(desk)
    asked = (
        "programState",
        "get loaded program",
        "isProgramSaved",
        "play",
        "programState",
        "pause",
        "programState",
    )
    assert await lines(*dashboard, *asked) == [
        "STOPPED again",
        "Loaded program: again",
        "false again",
        "Starting program",
        "PLAYING again",
        "Pausing program",
        "PAUSED again",
    ]


async def test_a_client_that_leaves_at_once_without_reading_has_sent_its_script(desk):
    stream = socket.create_connection(("127.0.0.1", desk.interfaces.ports["realtime"]))
    await until(lambda: desk.interfaces._connections)
    await desk.tick()
    select.select([stream], [], [], PATIENCE)
    stream.sendall(b"def f():\n  sleep(10)\nend\n")
    stream.close()  # with a reset, since there is something to read
    desk.host.tick()
    desk.host.tick()
    await until(lambda: desk.controller.programs.name == "f")
    await until(lambda: not desk.interfaces._connections)

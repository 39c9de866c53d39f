"""Sockets of the interfaces: new, slow and disconnected clients."""

import asyncio
import gc
import select
import socket
import struct
import threading
import weakref
from types import SimpleNamespace

import pytest
from tests.controller.cells import a_cell
from tests.controller.robots import UR5E

from tvist_controller.cell.live_cell import LiveCell
from tvist_controller.instruments.snapshot import Instruments
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol.codec import encode
from tvist_protocol.programs import ProgramStop
from tvist_server.gateways.base import GatewayError
from tvist_server.gateways.ur.interfaces import UrInterfaces

from . import rtde_client
from .served_controller import PATIENCE, connect, connect_and_greet, lines, rtde, until


async def test_every_port_answers_in_its_protocol(served):
    reader, writer = await connect(served, "dashboard")
    assert (await reader.readline()).startswith(b"Connected")
    assert await lines(reader, writer, "robotmode") == ["Robotmode: RUNNING"]
    for interface in ("primary", "secondary", "primary_read_only", "secondary_read_only"):
        reader, _ = await connect(served, interface)
        assert (await reader.readexactly(5))[4] == 20
    for interface in ("realtime", "realtime_read_only"):
        before = len(served.interfaces._connections)
        reader, _ = await connect(served, interface)
        await until(lambda before=before: len(served.interfaces._connections) > before)
        await served.tick()
        package = await reader.readexactly(1220)
        assert struct.unpack_from(">id", package) == (1220, 40.0 + served.controller.now)
    reader, writer = await connect(served, "rtde")
    writer.write(rtde_client.version())
    assert await reader.readexactly(4) == struct.pack(">HBB", 4, ord("V"), 1)


async def test_only_the_client_that_stops_reading_loses_samples(served):
    quick, _ = await connect(served, "realtime")
    _, slow = await connect(served, "realtime")
    slow.transport.pause_reading()
    await until(lambda: len(served.interfaces._connections) == 2)
    stamps, ticks = [], 1500
    for _ in range(ticks):
        await served.tick()
        stamps.append(struct.unpack_from(">id", await quick.readexactly(1220))[1])
    first = served.controller.tick_number - ticks + 1
    assert stamps == [40.0 + tick * 0.002 for tick in range(first, first + ticks)]
    dropped = sorted(connection.dropped for connection in served.interfaces._connections)
    assert dropped[0] == 0
    # What the system holds of packages of 1220 bytes, on both sides, and one that waits.
    assert dropped[1] > 0


async def test_an_exception_ends_only_its_connection(served, monkeypatch, caplog):
    (broken, _), (whole, _) = [await connect(served, "realtime") for _ in range(2)]
    await until(lambda: len(served.interfaces._connections) == 2)
    first = next(iter(served.interfaces._connections))
    monkeypatch.setattr(first.session, "sample", lambda _: 1 / 0)
    await served.tick(3)
    await until(lambda: len(served.interfaces._connections) == 1)
    got = []
    for reader in (broken, whole):
        try:
            got.append(await asyncio.wait_for(reader.readexactly(3 * 1220), PATIENCE))
        except asyncio.IncompleteReadError as error:
            got.append(error.partial)
    assert {len(data) for data in got} == {0, 3 * 1220}
    assert "failed" in caplog.text


async def test_a_port_in_use_is_refused_with_the_next_step(served):
    ports = {"rtde": served.interfaces.ports["rtde"]}
    with pytest.raises(GatewayError, match=rf"port {ports['rtde']} for rtde: .*--ur-port"):
        UrInterfaces(served, UR5E, "ur5e", "127.0.0.1", ports)
    with pytest.raises(GatewayError, match="does not have this address"):
        UrInterfaces(served, UR5E, "ur5e", "203.0.113.7", {"rtde": 0})


async def test_a_file_that_blocks_delays_no_other_client_and_no_stop(served):
    """A stop takes effect even behind the file and many questions of the same client."""
    read = threading.Event()
    folder = SimpleNamespace(read=lambda _: "sync()" if read.wait(PATIENCE) else None)
    served.interfaces.robot.programs._external._folder = folder
    (_, loads), other = await connect_and_greet(served), await connect_and_greet(served)
    loads.write(b"load a.urp\n" + 200 * b"robotmode\n" + b"stop\n")
    await until(lambda: isinstance(getattr(served, "last", None), ProgramStop))
    assert await lines(*other, "programState", "stop") == ["STOPPED <unnamed>", "Stopped"]
    read.set()


async def test_reading_from_a_client_that_does_not_read_is_paused(served):
    reader, writer = await connect_and_greet(served)
    reader._transport.pause_reading()
    (connection,) = served.interfaces._connections
    writer.write(b"\n" * 40_000)
    await until(lambda: not connection._transport.is_reading())
    assert connection._transport.get_write_buffer_size() < 600_000
    assert await lines(*await connect_and_greet(served), "robotmode") == ["Robotmode: RUNNING"]
    reader._transport.resume_reading()
    for _ in range(40_000):
        assert await asyncio.wait_for(reader.readline(), PATIENCE)


async def test_thousands_of_scripts_disconnect_nobody_and_log_few_lines(served, caplog):
    (listener, _), (_, writer) = await connect(served, "primary"), await connect(served, "realtime")
    await until(lambda: len(served.interfaces._connections) == 2)
    writer.write(b"nothing_of_that_name()\n" * 3000)
    heard = 0
    while heard < 1000:
        data = await asyncio.wait_for(listener.read(1 << 16), PATIENCE)
        assert data
        heard += data.count(b"compile_error_name_not_found:nothing_of_that_name:")
    assert len(served.interfaces._connections) == 2
    assert 1 < sum("nothing_of_that_name" in line for line in caplog.messages) < 40
    await served.interfaces.shut()
    assert any("left out here" in line for line in caplog.messages)


async def test_reading_is_paused_while_many_commands_wait(served, monkeypatch):
    due = []
    monkeypatch.setattr(
        served, "command", lambda command, answer, _origin=None: due.append((command, answer))
    )
    _, writer = await connect(served, "realtime")
    writer.write(b"stop program\n" * 1000)
    await until(lambda: due)
    (connection,) = served.interfaces._connections
    done = most = 0
    while done < 1000:
        await until(lambda: due)
        most = max(most, connection.session.waiting)
        done += len(due)
        for command, answer in due:
            answer(served.host.request(encode(command)))
        due.clear()
    assert 1 < most < 100


MANY = 300  # requests at once: more than may wait for their answers


async def test_many_requests_to_the_gripper_are_answered_in_order(make_served):
    plant, terminals = FlexibleArm(UR5E, UR5E.payload), SimpleNamespace(set_tcp=print)
    cell, waiting = LiveCell(a_cell(), UR5E, plant, terminals, print), []
    served = make_served({"gripper": 0}, gripper=lambda *asked: waiting.append(asked))
    await served.tick()
    await served.interfaces.open()
    reader, writer = await connect(served, "gripper")
    writer.write(b"".join(b"SET POS %d\nGET PRE\n" % (number % 256) for number in range(MANY)))
    expected = b"".join(b"ackPRE %d\n" % (number % 256) for number in range(MANY))
    reading, most = asyncio.create_task(reader.readexactly(len(expected))), 0
    while not reading.done():
        await until(lambda: waiting or reading.done())
        most = max(most, len(waiting))
        while waiting:
            request, answer = waiting.pop(0)
            answer(cell.answer(request))
    assert await reading == expected
    assert 0 < most < MANY


async def test_a_tick_leaves_no_reference_cycles(served):
    await rtde(served, ["actual_q", "target_current", "output_int_register_3"])
    gc.collect()
    gc.disable()
    try:
        await served.tick()
        gone = weakref.ref(served.interfaces.robot.latest)
        await served.tick(2)
        assert gone() is None
    finally:
        gc.enable()


async def test_keepalive_detects_a_client_without_power_within_30_s(served):
    await connect(served, "dashboard")
    await until(lambda: served.interfaces._connections)
    (connection,) = served.interfaces._connections
    found = connection._transport.get_extra_info("socket")
    assert found.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    idle = found.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE)
    every = found.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL)
    assert idle + every * found.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT) <= 30


async def test_without_clients_ticks_are_batched_and_none_is_lost(make_served, monkeypatch):
    served = make_served({"rtde": 0, "dashboard": 0})
    interfaces = served.interfaces
    waiting = asyncio.create_task(interfaces.open())
    await asyncio.sleep(0)
    assert not waiting.done(), "who comes first finds a robot"
    await served.tick()
    await waiting
    looks, look = [], interfaces._handle_queue
    monkeypatch.setattr(interfaces, "_handle_queue", lambda: looks.append(1) or look())
    reference, states = Instruments(UR5E), [interfaces.robot.latest.state]
    reference.snapshot(states[0], interfaces._io)
    for _ in range(95):
        served.controller.begin_tick()
        report, _ = served.controller.complete_tick()
        state = report.state
        interfaces.report(report)
        expected = reference.snapshot(state, interfaces._io)
        await asyncio.sleep(0)
    assert len(looks) == 9
    await connect_and_greet(served)
    assert interfaces.robot.latest.state == state
    for name in ("joint_temperatures", "actual_robot_energy_consumed", "actual_robot_current"):
        assert getattr(interfaces.robot.latest, name) == getattr(expected, name)


async def test_the_script_of_a_client_that_resets_its_connection_runs(served):
    stream = socket.create_connection(("127.0.0.1", served.interfaces.ports["realtime"]))
    await until(lambda: served.interfaces._connections)
    await served.tick()
    select.select([stream], [], [], PATIENCE)
    stream.sendall(b"def f():\n  sleep(10)\nend\n")
    stream.close()  # with a reset, since there is something to read
    served.host.tick()
    served.host.tick()
    await until(lambda: served.controller.programs.name == "f")
    await until(lambda: not served.interfaces._connections)

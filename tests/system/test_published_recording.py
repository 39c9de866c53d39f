"""`tvist log replay --publish`: a recording on the network, cut off as it may be, for the clients that robots have."""

from itertools import pairwise

import msgspec
import pytest
from tests.conformance.served import Served

from tvist_client.robot import Robot
from tvist_lab.recordings.mcap_file import read
from tvist_protocol import Event, Info, Io, State, Truth
from tvist_protocol.errors import RefusedError
from tvist_protocol.generate import FOLDER
from tvist_protocol.recorded import topics
from tvist_server.recording.segments import Segments
from tvist_server.recording.writer import heading

TICKS = 700


def golden(kind):
    path = FOLDER / "fixtures" / "v1" / f"{kind.__name__.lower()}.json"
    return msgspec.json.decode(path.read_bytes(), type=kind)


INFO, STATE, TRUTH, IO = map(golden, (Info, State, Truth, Io))


class PublishedRecording(Served):
    """A recording as a server of its own."""

    program = ("-m", "tvist_cli", "log", "replay")


@pytest.fixture
def path(tmp_path):
    """A recording that keeps the last ticks, and whose process was killed."""
    path = tmp_path / "run.mcap"
    of, nothing = topics(INFO.name), dict.fromkeys(topics(INFO.name), 0)
    written = Segments(path, of, heading(INFO, {"seed": 1}), nothing, 300)
    for tick in range(1, TICKS):
        q = [tick * 1e-3] * 6
        written.write(msgspec.structs.replace(IO, tick=tick))
        if tick % 50 == 0:
            written.write(Event(tick=tick, kind="warning", why=str(tick)))
        written.write(msgspec.structs.replace(STATE, tick=tick, timestamp=tick * 0.002, actual_q=q))
        written.write(msgspec.structs.replace(TRUTH, tick=tick, timestamp=tick * 0.002, motor_q=q))
    written.close()
    return path.with_name("run-1-part*.mcap")


@pytest.mark.realtime
async def test_a_client_reads_it_as_it_reads_a_robot(path):
    content = read(path)
    length = content.states[-1].tick - content.states[0].tick + 1
    with PublishedRecording(str(path), "--publish", "--loop", name="ghost") as served:
        async with await Robot.connect(served.endpoint, "ghost") as robot:
            info = await robot.info()
            states, truths, events = [], [], []
            robot.on_truth(truths.append)
            robot.on_event(events.append)
            async for state in robot.states():
                states.append(state)
                if len(states) >= 300 and events and truths:
                    break
            io = await robot.io()
            with pytest.raises(RefusedError, match="takes no commands"):
                async with robot.control("anna"):
                    pass
    assert (info.name, info.model, info.control) == ("ghost", INFO.model, None)
    assert all(after.tick > before.tick for before, after in pairwise(states))
    recorded = {state.tick: state.actual_q for state in content.states}
    first = content.states[0].tick
    assert all(state.actual_q == recorded[(state.tick - first) % length + first] for state in states)
    assert events[0].kind == "warning"
    assert io.tcp_offset == IO.tcp_offset

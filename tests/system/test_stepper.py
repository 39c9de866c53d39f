"""The client that holds the clock advances time; other clients are served within its steps."""

import msgpack
import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Wire

from tvist_client.robot import Robot

from .test_ur_lockstep import replayed

FAR = [1.5, -3.0, 0.2, -1.5, 0.1, 0.3]
LONG = 100_000


def test_stop_of_another_client_and_a_signal_take_effect_within_a_long_step(tmp_path):
    path = tmp_path / "run.mcap"
    with (
        Served("--clock", "lockstep", "--record", str(path)) as served,
        Wire(served.endpoint) as stepper,
        Wire(served.endpoint) as mover,
    ):
        clock, token = stepper.take("clock", "stepper"), mover.take("control", "mover")
        mover.listen("state", "event")
        assert mover.command("move_j", token=token, q=FAR, velocity=0.05)["type"] == "accepted"
        replies = stepper.begin("simulation.step", token=clock, ticks=LONG)
        mover.wait("state", lambda state: state["target_qd"][0] > 0.02)
        assert mover.command("stop")["type"] == "done"
        stopped = mover.wait("event", lambda event: event["kind"] == "motion_stopped")
        assert stopped["why"] == "a stop was commanded"
        assert mover.info()["stepper"] == "stepper"
        assert replies.try_recv() is None
        assert served.end() == 0
    content = replayed(path)
    told = [(entry.tick, entry.message["type"]) for entry in content.journal if entry.kind == "command"]
    assert [kind for _, kind in told] == ["take_clock", "take_control", "move_j", "simulation.step", "stop"]
    assert 1 < told[-1][0] <= stopped["tick"] <= content.states[-1].tick < LONG


def test_a_running_step_ends_when_another_client_takes_the_clock(lockstep):
    with Wire(lockstep.endpoint) as mover, Wire(lockstep.endpoint) as stepper:
        mover.listen("state")
        token = mover.take("control", "mover")
        before = mover.info()["tick"]
        replies = mover.begin("simulation.step", token=token, ticks=LONG)
        mover.until(before + 10)
        clock = stepper.take("clock", "stepper")
        (reply,) = replies
        ended = msgpack.unpackb(reply.ok.payload.to_bytes())
        assert ended["type"] == "done"
        assert before + 10 <= ended["tick"] < before + LONG
        assert stepper.info()["tick"] == ended["tick"]
        refused = mover.command("simulation.step", token=token, ticks=1)
        assert (refused["code"], refused["where"]) == ("no_control", "token")
        assert "'stepper'" in refused["why"]
        done = {"type": "done", "tick": ended["tick"] + 5}
        assert stepper.command("simulation.step", token=clock, ticks=5) == done
        assert stepper.command("release_clock", token=clock) == {"type": "done"}
        assert mover.command("simulation.step", token=token, ticks=1)["tick"] == ended["tick"] + 6
        assert mover.command("release_control", token=token) == {"type": "done"}


async def test_client_receives_a_state_before_the_first_tick():
    with Served("--clock", "lockstep", "--start", "q2") as unstepped:
        async with await Robot.connect(unstepped.endpoint) as robot:
            state, io, info = await robot.state(), await robot.io(), await robot.info()
    assert (state.tick, io.tick, info.tick) == (0, 1, 0)
    assert state.target_q[0] == pytest.approx(1.5707963)

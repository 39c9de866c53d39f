"""Faults of the server: it is suspended, killed or blocked, or its arm fails."""

import signal

import pytest
from tests.conformance.served import Served, free_endpoint
from tests.conformance.wire import Q1, STOPPED, TICK

from tvist_client import NotConnectedError, RefusedError
from tvist_client.blocking import Robot
from tvist_protocol.commands import KeepAlive
from tvist_server.schedule import CATCH_UP

from .bystander import Bystander

pytestmark = pytest.mark.realtime

FAR, NEAR = [2.0, *Q1[1:]], [0.2, *Q1[1:]]
SUSPENDED = 0.3  # shortest time for which the server is suspended [s]


def test_suspended_server_counts_missed_ticks_and_ends_leases_by_tick(measured):
    """This happens when a machine sleeps or a virtual one is moved. A shorter lease ends at its own tick."""
    with Served() as served, Bystander(served.endpoint) as bystander:
        token = bystander.command("take_control", client="mover")["token"]
        motion = bystander.command("move_j", token=token, q=NEAR)["id"]
        before = bystander.next("state", lambda state: state["target_qd"][0] > 0.05)
        suspend(served, bystander)
        assert bystander.command("keep_alive", token=token) == {"type": "done"}
        # The server makes up for some ticks.
        least = before["missed_ticks"] + round(SUSPENDED / TICK) - CATCH_UP
        after = bystander.next("telemetry", lambda told: told["missed_ticks"] >= least)
        measured(f"missed ticks of {SUSPENDED} s", after["missed_ticks"] - before["missed_ticks"])
        # Telemetry is made after the state of its tick, and may count a tick that was missed in between.
        shown = bystander.next("state", lambda state: state["tick"] > after["tick"])
        assert shown["missed_ticks"] >= after["missed_ticks"]
        assert bystander.event("motion_done")["id"] == motion
        assert bystander.command("release_control", token=token) == {"type": "done"}
        began = bystander.info()["tick"]
        bystander.command("take_control", client="sleepy", lease_s=0.4)
        granted = bystander.info()["tick"]
        suspend(served, bystander)
        assert began + 200 <= bystander.event("lease_lost")["tick"] <= granted + 205
        bystander.assert_undisturbed()


def suspend(served, bystander):
    served.process.send_signal(signal.SIGSTOP)
    with pytest.raises(AssertionError, match="no such state"):
        bystander.next("state", lambda _: False, timeout=SUSPENDED)
    served.process.send_signal(signal.SIGCONT)


def test_client_of_a_killed_server_raises_and_reconnects_to_the_next_one():
    endpoint = free_endpoint()
    with Served(endpoint=endpoint) as first, Robot.connect(endpoint) as robot:
        with robot.control("me") as arm:
            token = arm.token
            motion = arm.move_j(FAR, wait=False)
            first.process.kill()
            with pytest.raises(NotConnectedError, match="this client reconnects when it is back"):
                motion.wait()
            with pytest.raises(NotConnectedError):
                arm.stop()
        first.wait()
        with Served(endpoint=endpoint):
            assert next(robot.states()).tick > 0
            with pytest.raises(RefusedError, match="no_control"):
                robot.request(KeepAlive(token=token))
            with robot.control("me") as arm:
                arm.move_j([0.01, *Q1[1:]])


BUSY_LOOP = """
import asyncio, sys, time
from tvist_server.server import Server

run = Server.run

def ticks(self):
    return self.robots[0].controller.tick_number

async def busy(self, ready, ending=None):
    async def block():
        while True:
            end = ticks(self) + 25
            while ticks(self) < end:
                pass
            await asyncio.sleep(0.05)
    blocking = asyncio.ensure_future(block())
    await run(self, ready, ending)
    blocking.cancel()

Server.run = busy
sys.argv = ["tvist", "serve", *sys.argv[1:]]
from tvist_cli.main import main
main()
"""


class Blocked(Served):
    """Its event loop is blocked again and again, for 25 ticks, by a loop that holds the interpreter's lock."""

    program = ("-c", BUSY_LOOP)


def test_ticks_continue_while_the_event_loop_is_blocked():
    """The loop blocks until ticks pass, so if ticks waited for it, neither would continue."""
    with Blocked() as served, Bystander(served.endpoint) as bystander:
        for _ in range(2):  # the loop does its own work, too
            bystander.next("telemetry")
        bystander.assert_undisturbed()


def test_failing_arm_is_stopped_and_recorded_and_another_robot_is_not_disturbed(called, tmp_path):
    options = ("--robots", "ur5e*2", "--dump", str(tmp_path))
    with Served(*options, name=None) as served, Bystander(served.endpoint, "ur5e-1") as hit:
        with Bystander(served.endpoint, "ur5e-2") as other, hit.control("mover") as token:
            with other.control("other") as its:
                goes_on = other.command("move_j", token=its, q=NEAR)["id"]
                motion = hit.command("move_j", token=token, q=FAR)["id"]
                hit.next("state", lambda state: state["target_qd"][0] > 0.1)
                assert hit.command("simulation.inject", token=token, fault="nan") == {"type": "done"}
                event = hit.event("protective_stop")
                assert event["code"] == "plant_failure"
                stopped = hit.event("motion_stopped")
                assert (stopped["id"], stopped["tick"]) == (motion, event["tick"])
                state = hit.until(event["tick"])
                assert (state["safety_mode"], state["runtime_state"]) == (3, STOPPED)
                assert other.event("motion_done")["id"] == goes_on
            assert hit.command("move_j", token=token, q=Q1)["code"] == "wrong_mode"
            assert hit.command("unlock_protective_stop", token=token) == {"type": "done"}
            motion = hit.command("move_j", token=token, q=Q1)["id"]
            assert hit.event("motion_done")["id"] == motion
            hit.assert_undisturbed()
            other.assert_undisturbed()
        served.wait_until_said("look with tvist log analyze")
    (dump,) = tmp_path.glob("*.mcap")
    assert f"tvist-ur5e-1-{served.process.pid}-{event['tick']}" in dump.name
    assert called("log", "analyze", dump, "--json").assert_done().json["events"]

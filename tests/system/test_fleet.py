"""Robots behind a router are found, distinguished by namespace, stopped together, and found again after a crash."""

import asyncio
import json
import shutil
import signal
from collections import Counter
from queue import Queue

import pytest
import zenoh
from tests.conformance.served import PATIENCE, Served, free_endpoint
from tests.conformance.wire import Q1, Wire
from zenoh.handlers import Callback

from tvist_client import NotConnectedError, fleet
from tvist_client.fleet import Fleet, ManyStates, RobotPlace
from tvist_client.transports.session import open_session
from tvist_server.gateways import network

from .keyring import forge, free_tls_endpoint, made
from .relay import Relay
from .routed import Router
from .shell import begun, tvist
from .test_wrong_invocations import assert_said

LOCKSTEP = ("--clock", "lockstep")
MOST_ROUNDS = 50_000  # after as many rounds of messages a robot without states is starved


@pytest.fixture(scope="module")
def router():
    with Router() as router:
        yield router


@pytest.fixture(scope="module")
def robots(router):
    """Two robots without a namespace, and one with the first one's name in a namespace."""
    with (
        Served(*LOCKSTEP, "--robots", "ur5e*2", name=None, router=router.endpoint),
        Served(*LOCKSTEP, "--namespace", "hall-3/line-1", name="ur5e-1", router=router.endpoint) as third,
    ):
        found(router.endpoint, 3)
        yield third


def found(endpoint, number):
    """Wait until a router names this many robots; return what they tell."""

    async def look():
        async with Fleet(endpoint) as fleet:
            while len(fleet.places) < number:  # noqa: ASYNC110  tokens come from another thread
                await asyncio.sleep(0.1)
            return await fleet.look()

    return asyncio.run(asyncio.wait_for(look(), PATIENCE))


ALL = [RobotPlace("", "ur5e-1"), RobotPlace("", "ur5e-2"), RobotPlace("hall-3/line-1", "ur5e-1")]


def test_fleet_finds_all_robots_with_their_namespaces(router, robots):
    async def look(namespace):
        async with Fleet(router.endpoint, namespace=namespace) as fleet:
            return [RobotPlace(robot.namespace, robot.name) for robot in await fleet.look() if robot.ready]

    assert asyncio.run(look("")) == ALL
    assert asyncio.run(look("hall-3")) == ALL[2:]
    assert asyncio.run(look("hall-4")) == []


def test_robots_of_one_name_in_two_namespaces_are_separate(router, robots):
    with (
        Wire(router.endpoint, "ur5e-1") as here,
        Wire(router.endpoint, "ur5e-1", {"namespace": "hall-3/line-1"}) as there,
        here.control("anna") as mine,
        there.control("otto") as other,
    ):
        assert here.step(mine, 3)["tick"] == 3
        assert there.step(other, 5)["tick"] == 5
        assert here.command("move_j", token=other, q=Q1)["code"] == "stale_token"


def test_stop_reaches_all_robots_and_reports_a_missing_one(router, robots):
    at = ("--endpoint", router.endpoint)
    stopped = tvist("stop", "--all", *at, "--json").assert_done().json["robots"]
    assert [report["ok"] for report in stopped] == [True] * 3
    said = tvist("stop", "--all", "--namespace", "hall-3", *at).assert_done().out
    assert said.splitlines() == ["hall-3/line-1/ur5e-1: stopped"]
    tvist("stop", "--all", "--namespace", "hall-4", *at).assert_failed(1, "there are no robots, so none")

    async def stop():
        async with Fleet(router.endpoint) as fleet:
            return await fleet.stop([ALL[2], RobotPlace("", "ur5e-9")])

    reports = [(report.name, report.ok, report.said) for report in asyncio.run(stop())]
    assert reports == [("ur5e-9", False, "it does not answer"), ("ur5e-1", True, "stopped")]


async def test_router_that_does_not_name_all_robots_is_reported(router, monkeypatch):
    with Relay(router.endpoint) as link:

        def held(*where):
            session = open_session(*where)
            link.hold()
            return session

        monkeypatch.setattr(fleet, "open_session", held)
        monkeypatch.setattr(fleet, "ANSWER_S", 0.1)
        with pytest.raises(NotConnectedError, match="has not named all robots within"):
            await Fleet(link.endpoint).__aenter__()


def test_watch_shows_all_robots_or_the_states_of_one(router, robots):
    def first_line(*options):
        with begun("watch", router.endpoint, *options, "--json") as process:
            return json.loads(process.stdout.readline())

    assert [RobotPlace(one["namespace"], one["name"]) for one in first_line()["robots"]] == ALL
    assert first_line("--namespace", "hall-3")["type"] == "state"


def test_states_of_many_robots_come_by_one_key(router, robots):
    async def look():
        async with ManyStates("**/tvist/*/state", router.endpoint) as states:
            while len(found := states.look()) < 3:  # noqa: ASYNC110  in lockstep a state comes once a second
                await asyncio.sleep(0.1)
            return found

    assert sorted(asyncio.run(asyncio.wait_for(look(), PATIENCE))) == ALL


def test_robots_run_on_and_are_found_again_after_a_router_was_killed():
    with Router() as router, Served(*LOCKSTEP, "--robots", "ur5e*2", name=None, router=router.endpoint):
        router.process.send_signal(signal.SIGKILL)
        router.wait()
        with Router(endpoint=router.endpoint) as again:
            assert [robot.safety_mode for robot in found(again.endpoint, 2)] == ["NORMAL", "NORMAL"]


def test_router_reduces_the_rate_of_states_of_each_listed_robot_but_not_of_events():
    """Each round waits for all events of the last one, so that queues stay short and links stay up."""
    names, rounds = [f"r-{number}" for number in (1, 2, 3)], 0
    came, got = Queue(), Counter()
    with (
        Router("--rate", "20", "--robot", "r*3") as router,
        Wire(router.endpoint) as robot,
        Wire(router.endpoint) as client,
    ):
        take = Callback(lambda sample: came.put(str(sample.key_expr)), indirect=False)
        client.session.declare_subscriber("tvist/*/*", take)
        keys = [f"tvist/{name}/{leaf}" for name in names for leaf in ("state", "event")]
        block, declare = zenoh.CongestionControl.BLOCK, robot.session.declare_publisher
        publishers = [declare(key, congestion_control=block) for key in keys]
        while not all(publisher.matching_status.matching for publisher in publishers):
            pass
        while not all(3 <= got[f"tvist/{name}/state"] < rounds for name in names) and rounds < MOST_ROUNDS:
            for publisher in publishers:
                publisher.put(b"x")
            rounds += 1
            while any(got[f"tvist/{name}/event"] < rounds for name in names):
                got[came.get(timeout=PATIENCE)] += 1
    assert all(3 <= got[f"tvist/{name}/state"] < rounds for name in names), (rounds, got)


def test_missing_router_and_expired_certificate_are_reported(called, monkeypatch, tmp_path):
    monkeypatch.setitem(network.CONNECT, "connect/timeout_ms", 200)
    nowhere = free_endpoint()
    said = f"tvist: no connection to {nowhere}: no router answers within 10 s"
    assert_said(called("serve", *LOCKSTEP, "--connect", nowhere), 1, [said])
    ring = made(tmp_path / "keys", "--member", "hall-3")
    issuer = (ring / "authority.pem", ring / "authority.key")
    expired = forge(tmp_path / "old", "hall-3", issuer=issuer, days=-1)
    shutil.copy(ring / "authority.pem", expired)
    with Router("--security", str(ring), endpoint=free_tls_endpoint()) as router:
        ended = called("serve", *LOCKSTEP, "--connect", router.endpoint, "--security", str(expired))
    assert_said(ended, 1, ["certificate", "expired"])

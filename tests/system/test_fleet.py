"""Robots behind a router: found, told apart by namespaces, stopped together, and back after the router was gone."""

import asyncio
import json
import shutil
import signal
import sys
from collections import Counter
from queue import Queue

import pytest
import zenoh
from tests.conformance.served import PATIENCE, Served, finished, free_endpoint
from tests.conformance.wire import Q1, Wire
from zenoh.handlers import Callback

from tvist_cli import main
from tvist_client.across import ManyStates, Place
from tvist_client.check import check
from tvist_client.fleet import Fleet
from tvist_server.gateways import network

from .keyring import forge, free_tls_endpoint, made
from .routed import Router, far

LOCKSTEP = ("--clock", "lockstep")
MOST_ROUNDS = 50_000
"""Rounds of messages after which a robot whose states do not come has been starved."""


@pytest.fixture(scope="module")
def router():
    with Router() as router:
        yield router


@pytest.fixture(scope="module")
def robots(router):
    """Two robots without a namespace, and one in one that is called like the first of them."""
    with (
        Served(*LOCKSTEP, "--robots", "ur5e*2", name=None, router=router.endpoint),
        Served(*LOCKSTEP, "--namespace", "hall-3/line-1", name="ur5e-1", router=router.endpoint) as third,
    ):
        yield third


ALL = [Place("", "ur5e-1"), Place("", "ur5e-2"), Place("hall-3/line-1", "ur5e-1")]


def tvist(*arguments):
    done = finished("-m", "tvist_cli", *arguments)
    return done.returncode, done.stdout, done.stderr


def test_all_are_found_and_each_is_known_by_its_namespace(router, robots):
    async def look(namespace):
        async with Fleet(router.endpoint, namespace=namespace) as fleet:
            return [Place(robot.namespace, robot.name) for robot in await fleet.look() if robot.ready]

    assert asyncio.run(look("")) == ALL
    assert asyncio.run(look("hall-3")) == ALL[2:]
    assert asyncio.run(look("hall-4")) == []


def test_robots_of_one_name_in_two_namespaces_never_meet(router, robots):
    with (
        far(router.endpoint, "ur5e-1", "") as here,
        far(router.endpoint, "ur5e-1", "hall-3/line-1") as there,
        here.control("anna") as mine,
        there.control("otto") as other,
    ):
        assert here.step(mine, 3)["tick"] == 3
        assert there.step(other, 5)["tick"] == 5
        assert here.command("move_j", token=other, q=Q1)["code"] == "stale_token"


def test_check_moves_and_the_rest_reach_a_robot_in_a_namespace(router, robots):
    report = check(router.endpoint, "ur5e-1", namespace="hall-3/line-1")
    assert report.ok, report
    assert report.robots == ["ur5e-1"]


def test_stop_reaches_all_and_a_robot_that_is_not_there_is_no_success(router, robots):
    code, out, _ = tvist("stop", "--all", "--endpoint", router.endpoint, "--json")
    assert code == 0
    assert [report["ok"] for report in json.loads(out)["robots"]] == [True] * 3
    code, out, _ = tvist("stop", "--all", "--namespace", "hall-3", "--endpoint", router.endpoint)
    assert (code, out.splitlines()) == (0, ["hall-3/line-1/ur5e-1: stopped"])
    code, _, err = tvist("stop", "--all", "--namespace", "hall-4", "--endpoint", router.endpoint)
    assert (code, err) == (1, "tvist: there are no robots, so none was stopped\n")

    async def stop():
        async with Fleet(router.endpoint) as fleet:
            return await fleet.stop([ALL[2], Place("", "ur5e-9")])

    reports = [(report.name, report.ok, report.said) for report in asyncio.run(stop())]
    assert reports == [("ur5e-9", False, "it does not answer"), ("ur5e-1", True, "stopped")]


def test_watch_shows_all_robots_and_of_one_its_states(router, robots):
    code, out, _ = tvist("watch", router.endpoint, "--seconds", "4", "--json")
    first = json.loads(out.splitlines()[0])["robots"]
    assert (code, [Place(one["namespace"], one["name"]) for one in first]) == (0, ALL)
    assert {one["safety_mode"] for one in first} == {"NORMAL"}
    code, out, _ = tvist("watch", router.endpoint, "--namespace", "hall-3", "--seconds", "4", "--json")
    assert (code, json.loads(out.splitlines()[0])["type"]) == (0, "state")


def test_states_of_many_come_by_one_key(router, robots):
    async def look():
        async with ManyStates("**/tvist/*/state", router.endpoint) as states:
            while len(found := states.look()) < 3:  # noqa: ASYNC110  in lockstep a state comes once a second
                await asyncio.sleep(0.1)
            return found

    assert sorted(asyncio.run(asyncio.wait_for(look(), PATIENCE))) == ALL


def test_a_router_that_was_killed_finds_all_again_and_no_robot_has_stopped():
    router = Router()
    router.wait_until_ready()
    with Served(*LOCKSTEP, "--robots", "ur5e*2", name=None, router=router.endpoint):
        router.process.send_signal(signal.SIGKILL)
        router.wait()
        with Router(endpoint=router.endpoint) as again:

            async def back():
                async with Fleet(again.endpoint) as fleet:
                    while len(fleet.places) < 2:  # noqa: ASYNC110  tokens come from another thread
                        await asyncio.sleep(0.1)
                    return await fleet.look()

            found = asyncio.run(asyncio.wait_for(back(), PATIENCE))
            assert [robot.safety_mode for robot in found] == ["NORMAL", "NORMAL"]
    router.kill()


def test_a_reduced_rate_holds_for_each_listed_robot_and_leaves_events_alone():
    """A round follows when all events of the last one have come: nothing waits in a queue, and no link is lost."""
    names, rounds = [f"r-{number}" for number in (1, 2, 3)], 0
    came, got = Queue(), Counter()
    with (
        Router("--rate", "20", "--robot", "r*3") as router,
        Wire(router.endpoint) as robot,
        Wire(router.endpoint) as client,
    ):
        client.session.declare_subscriber(
            "tvist/*/*", Callback(lambda sample: came.put(str(sample.key_expr)), indirect=False)
        )
        publishers = [
            robot.session.declare_publisher(
                f"tvist/{name}/{leaf}", congestion_control=zenoh.CongestionControl.BLOCK
            )
            for name in names
            for leaf in ("state", "event")
        ]
        while not all(publisher.matching_status.matching for publisher in publishers):
            pass
        while not all(3 <= got[f"tvist/{name}/state"] < rounds for name in names) and rounds < MOST_ROUNDS:
            for publisher in publishers:
                publisher.put(b"x")
            rounds += 1
            while any(got[f"tvist/{name}/event"] < rounds for name in names):
                got[came.get(timeout=PATIENCE)] += 1
    assert all(3 <= got[f"tvist/{name}/state"] < rounds for name in names), (rounds, got)


@pytest.fixture
def serve(monkeypatch, capfd):
    """Start `tvist serve` in this process, which gives up after a fifth of a second; exit code and stderr."""
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setitem(network.CONNECT, "connect/timeout_ms", 200)

    def serve(*options):
        monkeypatch.setattr(sys, "argv", ["tvist", "serve", "--clock", "lockstep", *map(str, options)])
        with pytest.raises(SystemExit) as ended:
            main.main()
        return ended.value.code, capfd.readouterr().err

    return serve


def test_a_router_that_is_not_there_is_said_in_one_sentence(serve):
    nowhere = free_endpoint()
    code, said = serve("--connect", nowhere)
    assert code == 1
    assert said.startswith(f"tvist: no connection to {nowhere}: no router answers within 10 s")
    assert said.count("\n") == 1


def test_a_certificate_that_has_expired_is_said_in_one_sentence(serve, tmp_path):
    ring = made(tmp_path / "keys", "--member", "hall-3")
    expired = forge(
        tmp_path / "old", "hall-3", issuer=(ring / "authority.pem", ring / "authority.key"), days=-1
    )
    shutil.copy(ring / "authority.pem", expired)
    with Router("--security", str(ring), endpoint=free_tls_endpoint()) as router:
        code, said = serve("--connect", router.endpoint, "--security", expired)
    assert code == 1
    assert "certificate" in said
    assert "expired" in said
    assert said.count("\n") == 1

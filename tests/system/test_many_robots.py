"""Several robots in one process: each is reached, moves, stops and is recorded by itself."""

import pytest
import zenoh
from tests.conformance.served import Served
from tests.conformance.wire import Q1, Wire

from tvist_client.check import check
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file

from .keyring import free_tls_endpoint, made, shown

pytestmark = pytest.mark.realtime

FAR = [1.0, *Q1[1:]]
PLAYING = 2


@pytest.fixture(scope="module")
def served():
    """Two robots in real time."""
    with Served("--robots", "ur5e*2", name=None) as served:
        yield served


@pytest.fixture
def one(served):
    with Wire(served.endpoint, "ur5e-1") as wire:
        yield wire.listen("state", "event", "telemetry")


@pytest.fixture
def two(served):
    with Wire(served.endpoint, "ur5e-2") as wire:
        yield wire.listen("state", "event", "telemetry")


def done(wire, motion):
    return wire.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)


def test_each_says_its_own_name_and_both_are_found(served, one, two):
    assert one.info()["name"] == "ur5e-1"
    assert two.info()["name"] == "ur5e-2"
    assert f"ur5e-1, ur5e-2; shaper zv) listens on {served.endpoint}" in served.said


def test_two_clients_move_two_robots_at_once(one, two):
    with one.control("anna") as first, two.control("otto") as second:
        motions = [
            wire.command("move_j", token=token, q=FAR, velocity=0.5)["id"]
            for wire, token in ((one, first), (two, second))
        ]
        both = [wire.wait("state", lambda state: state["target_qd"][0] > 0.2) for wire in (one, two)]
        assert {state["runtime_state"] for state in both} == {PLAYING}
        for wire, motion in zip((one, two), motions, strict=True):
            ended = done(wire, motion)  # on a busy machine it comes before states of earlier ticks
            assert wire.until(ended["tick"])["target_q"] == pytest.approx(FAR, abs=1e-6)


def test_a_stop_and_a_client_that_goes_concern_one_robot_alone(served, one, two):
    with two.control("otto") as second:
        with Wire(served.endpoint, "ur5e-1") as leaving:
            leaving.announce("anna")
            token = leaving.command("take_control", client="anna")["token"]
            leaving.command("move_j", token=token, q=FAR, velocity=0.5)
            motion = two.command("move_j", token=second, q=FAR)["id"]
            one.next("state", lambda state: state["target_qd"][0] > 0.2)
            assert one.command("stop")["type"] == "done"
            stopped = one.wait("event", lambda event: event["kind"] == "motion_stopped")
            assert stopped["why"] == "a stop was commanded"
        one.wait("event", lambda event: event["kind"] == "lease_lost")
        done(two, motion)
        kinds = [event["kind"] for event in two.received["event"]]
        assert "lease_lost" not in kinds
        assert "motion_stopped" not in kinds
        assert two.info()["control"] == "otto"


def test_a_token_of_one_robot_is_none_of_the_other(one, two):
    with one.control("anna") as token:
        assert two.command("move_j", token=token, q=FAR)["code"] in {"stale_token", "no_control"}


def test_each_tells_its_own_figures(one, two):
    before = [wire.next("telemetry")["refused"] for wire in (one, two)]
    one.command("nonsense")
    ticks = [wire.state()["tick"] for wire in (one, two)]
    after = [
        wire.next("telemetry", lambda told, tick=tick: told["tick"] > tick)["refused"]
        for wire, tick in zip((one, two), ticks, strict=True)
    ]
    assert after == [before[0] + 1, before[1]]


def test_check_says_which_robots_there_are(served):
    found = check(served.endpoint)
    assert (found.ok, found.robot, found.robots) == (True, "ur5e-1", ["ur5e-1", "ur5e-2"])
    assert found.findings[0].said == f"ur5e-1 at {served.endpoint}; also there: ur5e-2"
    assert check(served.endpoint, "ur5e-2").robot == "ur5e-2"
    missing = check(served.endpoint, "ur5e")
    assert not missing.ok
    assert "ur5e-1, ur5e-2" in missing.findings[-1].said


def test_in_lockstep_each_has_its_own_time():
    with (
        Served("--robots", "ur5e*2", "--clock", "lockstep", name=None) as served,
        Wire(served.endpoint, "ur5e-1") as one,
        Wire(served.endpoint, "ur5e-2") as two,
        one.control() as first,
        two.control() as second,
    ):
        assert one.step(first, 300)["tick"] == 300
        assert two.info()["tick"] == 0
        assert two.step(second, 20)["tick"] == 20
        assert one.info()["tick"] == 300


def test_each_is_recorded_into_a_file_of_its_own_that_replays_equal(tmp_path):
    path = tmp_path / "out.mcap"
    with Served("--robots", "ur5e*2", "--record", str(path), name=None) as served:
        with Wire(served.endpoint, "ur5e-2") as wire:
            token = wire.command("take_control", client="mover")["token"]
            wire.command("move_j", token=token, q=FAR)
            wire.until(wire.state()["tick"] + 300)
        assert served.end() == 0
    assert not path.exists()
    first, second = (read(tmp_path / f"out-ur5e-{number}.mcap") for number in (1, 2))
    assert [recorded.robot for recorded in (first, second)] == ["ur5e-1", "ur5e-2"]
    assert [recorded.start["seed"] for recorded in (first, second)] == [0, 1]
    assert [entry.kind for entry in first.journal if entry.kind == "command"] == []
    assert first.complete
    assert second.complete
    assert replay_file(second).first_difference is None


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    return made(tmp_path_factory.mktemp("keys") / "ring", "--operator", "anna", "--viewer", "wall")


@pytest.fixture(scope="module")
def secured(ring):
    """Two robots that others could reach."""
    options = ("--robots", "ur5e*2", "--security", str(ring))
    with Served(*options, name=None, endpoint=free_tls_endpoint()) as served:
        yield served


@pytest.mark.parametrize("robot", ["ur5e-1", "ur5e-2"])
def test_an_operator_moves_each_and_a_viewer_none(secured, ring, robot):
    with (
        Wire(secured.endpoint, robot, settings=shown(ring / "anna")) as operator,
        Wire(secured.endpoint, robot, settings=shown(ring / "wall")) as viewer,
    ):
        operator.listen("event")
        assert viewer.state()["tick"] > 0
        assert viewer.ask(viewer.key("command"), b"") == []
        with operator.control("anna") as token:
            done(operator, operator.command("move_j", token=token, q=FAR)["id"])


def test_a_stranger_sees_neither(secured):
    with pytest.raises(zenoh.ZError), Wire(secured.endpoint, "ur5e-1"):
        pass


def test_a_file_names_several_robots(tmp_path):
    path = tmp_path / "robots.toml"
    path.write_text('robots = "ur5e*3"\nclock = "lockstep"\n', encoding="utf-8")
    with Served("--config", str(path), name=None) as served:
        assert check(served.endpoint).robots == ["ur5e-1", "ur5e-2", "ur5e-3"]

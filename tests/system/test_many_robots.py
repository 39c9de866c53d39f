"""Several robots in one process: each is reached, moves, stops and is recorded by itself."""

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Q1, Wire

from tvist_client.check import check
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file

from .keyring import free_tls_endpoint, made, shown

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


@pytest.mark.realtime
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


@pytest.mark.realtime
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


def test_in_lockstep_each_has_its_own_time_and_a_recording_of_its_own_that_replays_equal(tmp_path):
    path = tmp_path / "out.mcap"
    options = ("--robots", "ur5e*2", "--clock", "lockstep", "--record", str(path))
    with (
        Served(*options, name=None) as served,
        Wire(served.endpoint, "ur5e-1") as one,
        Wire(served.endpoint, "ur5e-2") as two,
    ):
        clients = zip((one, two), ("anna", "otto"), strict=True)
        first, second = (wire.command("take_control", client=name)["token"] for wire, name in clients)
        assert two.command("move_j", token=first, q=FAR)["code"] == "stale_token"
        two.command("move_j", token=second, q=FAR)
        assert two.step(second, 300)["tick"] == 300
        assert one.info()["tick"] == 0
        assert one.step(first, 20)["tick"] == 20
        assert two.info()["tick"] == 300
        assert served.end() == 0
    assert not path.exists()
    ours, other = (read(tmp_path / f"out-ur5e-{number}.mcap") for number in (1, 2))
    assert [recorded.robot for recorded in (ours, other)] == ["ur5e-1", "ur5e-2"]
    assert [recorded.start["seed"] for recorded in (ours, other)] == [0, 1]
    assert [recorded.complete for recorded in (ours, other)] == [True, True]
    assert "move_j" not in {entry.message["type"] for entry in ours.journal if entry.kind == "command"}
    assert replay_file(other).first_difference is None


def test_an_operator_moves_each_and_a_viewer_none(tmp_path):
    ring = made(tmp_path / "ring", "--operator", "anna", "--viewer", "wall")
    options = ("--robots", "ur5e*2", "--clock", "lockstep", "--security", str(ring))
    with Served(*options, name=None, endpoint=free_tls_endpoint()) as secured:
        for robot in ("ur5e-1", "ur5e-2"):
            with (
                Wire(secured.endpoint, robot, settings=shown(ring / "anna")) as operator,
                Wire(secured.endpoint, robot, settings=shown(ring / "wall")) as viewer,
                operator.control("anna") as token,
            ):
                viewer.listen("state")
                assert viewer.ask(viewer.key("command"), b"") == []
                assert operator.step(token, 5)["tick"] == 5
                assert viewer.until(5)["tick"] == 5


def test_a_file_names_several_robots_and_the_command_line_goes_before_it(tmp_path):
    path = tmp_path / "robots.toml"
    path.write_text('robots = "ur5e*3"\nclock = "lockstep"\nshaper = "none"\n', encoding="utf-8")
    with Served("--config", str(path), "--shaper", "mzv", name=None) as served:
        found = check(served.endpoint)
        assert (found.ok, found.robots) == (True, ["ur5e-1", "ur5e-2", "ur5e-3"])
        with Wire(served.endpoint, "ur5e-2") as wire:
            assert (wire.info()["clock"], wire.info()["shaper"]) == ("lockstep", "mzv")

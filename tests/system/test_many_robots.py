"""Several robots in one process move, stop and are recorded independently."""

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import Q1, Wire

from .test_ur_lockstep import replayed

FAR = [0.8, *Q1[1:]]


@pytest.mark.realtime
def test_stop_and_a_disconnected_client_affect_one_robot_only():
    with (
        Served("--robots", "ur5e*2", name=None) as served,
        Wire(served.endpoint, "ur5e-1") as one,
        Wire(served.endpoint, "ur5e-2") as two,
        two.control("otto") as second,
    ):
        one.listen("state", "event")
        two.listen("event")
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
        two.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)
        assert not {"lease_lost", "motion_stopped"} & {event["kind"] for event in two.received["event"]}
        assert two.info()["control"] == "otto"


def test_each_robot_has_its_own_time_and_recording_in_lockstep(tmp_path):
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
    ours, other = (replayed(tmp_path / f"out-ur5e-{number}.mcap") for number in (1, 2))
    assert [recorded.robot for recorded in (ours, other)] == ["ur5e-1", "ur5e-2"]
    assert [recorded.start["seed"] for recorded in (ours, other)] == [0, 1]
    assert "move_j" not in {entry.message["type"] for entry in ours.journal if entry.kind == "command"}

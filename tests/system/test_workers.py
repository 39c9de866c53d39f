"""Several processes behind one endpoint act like one server, and end together."""

import signal
import urllib.request

import psutil
import pytest
from tests.conformance.served import PATIENCE, Served, refused_to_start
from tests.conformance.wire import Q1, Wire
from tests.places import free_port, own_address
from tests.system.routed import Router
from tests.system.waiting import eventually

from tvist_client.check import check
from tvist_lab.recordings.mcap_file import read

from .test_ur_lockstep import replayed

LOCKSTEP = ("--robots", "ur5e*3", "--workers", "2", "--clock", "lockstep")
NAMES = ["ur5e-1", "ur5e-2", "ur5e-3"]


def processes(served):
    """Return the process that clients connect to, which starts first, and those with robots."""
    return sorted(psutil.Process(served.process.pid).children(), key=lambda child: child.pid)


def states(endpoint, name, ticks=200):
    with Wire(endpoint, name) as wire:
        wire.listen("state")
        with wire.control() as token:
            wire.command("move_j", token=token, q=[1.0, *Q1[1:]])
            wire.step(token, ticks)
            wire.until(ticks)
        told = [state for state in wire.received["state"] if state["tick"] > 0]
        return told[: [state["tick"] for state in told].index(ticks) + 1]  # later it repeats the last one


@pytest.fixture(scope="module")
def served():
    with Served(*LOCKSTEP, name=None) as served:
        yield served


def test_robots_of_all_processes_are_found_at_one_endpoint(served):
    assert check(served.endpoint).robots == NAMES
    ready = [line for line in served.lines if "listens" in line]
    assert len(ready) == 1
    assert f"{', '.join(NAMES)}; shaper zv) listens on {served.endpoint} in 2 processes" in ready[0]
    assert len(processes(served)) == 1 + 2


def test_states_equal_those_of_a_single_process(served):
    with Served(*LOCKSTEP[:2], *LOCKSTEP[4:], name=None) as alone:
        for name in (NAMES[0], NAMES[2]):
            behind, direct = states(served.endpoint, name), states(alone.endpoint, name)
            assert [state["tick"] for state in behind] == list(range(1, 201))
            assert behind == direct


def test_signal_to_all_processes_ends_them_in_order(tmp_path):
    with Served(*LOCKSTEP, "--record", str(tmp_path / "out.mcap"), name=None) as served:
        states(served.endpoint, "ur5e-3")
        _, *children = processes(served)
        for child in children:  # like a terminal or a supervisor
            child.send_signal(signal.SIGINT)
        assert served.end(signal.SIGINT) == 0
        assert psutil.wait_procs(children, PATIENCE)[1] == []
    assert all(f"recorded into {tmp_path / f'out-{name}.mcap'}\n" in served.said for name in NAMES)
    replayed(tmp_path / "out-ur5e-3.mcap")


def test_killed_process_is_reported_with_its_robots_and_ends_the_others(tmp_path):
    with Served(*LOCKSTEP, "--record", str(tmp_path / "out.mcap"), name=None) as served:
        states(served.endpoint, "ur5e-1")
        _, first, second = processes(served)
        second.kill()
        assert served.wait() == 1
        assert "worker 2 of 2 (ur5e-2, ur5e-3) was ended by SIGKILL: the other robots were" in served.said
        assert not first.is_running()
        assert read(tmp_path / "out-ur5e-1.mcap").complete


def test_killed_front_process_is_reported_and_ends_the_others():
    with Served(*LOCKSTEP, name=None) as served:
        front, *others = processes(served)
        front.kill()
        assert served.wait() == 1
        assert "the process that clients connect to was ended by SIGKILL: the other robots" in served.said
        assert not [other for other in others if other.is_running()]


def test_port_in_use_is_refused_and_leaves_no_recordings(served, tmp_path):
    options = (*LOCKSTEP, "--record", tmp_path / "out.mcap")
    code, said = refused_to_start(*options, endpoint=served.endpoint)
    assert code == 1
    assert "the port is in use" in said
    port, address = free_port(), own_address(9)
    with Served(*LOCKSTEP, "--ur-address", address, "--ur-port", f"rtde={port}", name=None):
        code, said = refused_to_start(*options, "--ur-address", address, "--ur-port", f"rtde={port}")
    assert code == 1
    assert f"cannot listen on {address} port" in said
    assert list(tmp_path.iterdir()) == []


def test_robots_of_all_processes_are_found_behind_a_router_in_a_namespace():
    with Router() as router, Served(*LOCKSTEP, "--namespace", "hall-3", router=router.endpoint, name=None):
        assert check(router.endpoint, NAMES[0], namespace="hall-3").robots == NAMES


def test_metrics_of_all_processes_are_on_one_page():
    port = free_port()

    def page():
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics") as answer:
            return answer.read().decode()

    with Served(*LOCKSTEP, "--namespace", "hall-3", "--metrics", str(port), name=None):
        eventually(lambda: page().count("tvist_ticks_total{") == 3)
        for name in NAMES:
            assert f'tvist_ticks_total{{namespace="hall-3",robot="{name}"}}' in page()

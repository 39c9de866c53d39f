"""A starting robot answers with its progress, and is found only when it is ready."""

import os

import msgpack
import pytest
from tests.conformance.served import Served
from tests.conformance.session import plain_session
from tests.system.waiting import eventually

from tvist_client.check import check
from tvist_client.robot import Robot
from tvist_protocol.codec import encode
from tvist_protocol.commands import TakeControl
from tvist_protocol.errors import RefusedError

SLOW = """
import os, sys
from tvist_cli import serving
from tvist_cli.main import main
def compile_slowly(tell):
    with open(os.environ["PROGRESS"]) as progress:
        for line in progress:
            tell(*map(int, line.split()))
serving.compile_if_new = compile_slowly
sys.argv[0] = "tvist"
main()
"""
"""`tvist serve` whose compilation has the progress written into a pipe, and ends with it."""
ONE = ("--clock", "lockstep")


class SlowlyServed(Served):
    program = ("-c", SLOW, "serve")


def asked(session, keys):
    found = []
    for key in keys:
        payload = encode(TakeControl(client="eager")) if key.endswith("command") else None
        found += [msgpack.unpackb(reply.ok.payload.to_bytes()) for reply in session.get(key, payload=payload)]
    return found


def all_are_starting(session, keys, words):
    answers = asked(session, keys)
    right = [answer["code"] == "starting" and words in answer["why"] for answer in answers]
    return len(answers) == len(keys) and all(right)


async def started(options, names, place, tmp_path, monkeypatch):
    """Start robots slowly; check what they answer to queries before they are ready, and then."""
    pipe = tmp_path / "progress"
    os.mkfifo(pipe)
    monkeypatch.setenv("PROGRESS", str(pipe))
    served = SlowlyServed(*options, name=None if "--robots" in options else "ur5e")
    within = f"{place}/tvist" if place else "tvist"
    keys = [f"{within}/{name}/{leaf}" for name in names for leaf in ("command", "info")]
    try:
        with pipe.open("w", buffering=1) as progress:  # the server reads: its network is open
            with plain_session(served.endpoint) as session:
                for done in (3, 5):
                    progress.write(f"{done} 7\n")
                    words = f"the robot is starting: {done} of 7 kernels are compiled"
                    eventually(lambda words=words: all_are_starting(session, keys, words))
            with pytest.raises(RefusedError, match="starting: the robot is starting: 5 of 7"):
                await Robot.connect(served.endpoint, names[0], namespace=place)
            assert "listens" not in served.said
        served.wait_until_ready()
        for name in names:
            async with await Robot.connect(served.endpoint, name, namespace=place) as robot:
                assert (await robot.info()).name == name
        with plain_session(served.endpoint) as session:
            assert [answer["type"] for answer in asked(session, keys)] == ["accepted", "info"] * len(names)
        assert served.end() == 0
        served.assert_quiet()
    finally:
        served.kill()


async def test_queries_are_answered_with_the_progress_until_the_robot_is_ready(tmp_path, monkeypatch):
    await started(ONE, ["ur5e"], "", tmp_path, monkeypatch)


async def test_robots_of_several_processes_answer_with_the_progress_until_ready(tmp_path, monkeypatch):
    options = (*ONE, "--robots", "ur5e*2", "--workers", "2", "--namespace", "hall-3")
    await started(options, ["ur5e-1", "ur5e-2"], "hall-3", tmp_path, monkeypatch)


@pytest.mark.nightly
def test_first_start_reports_its_progress_and_the_next_one_compiles_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    served = Served(*ONE, cold=True)
    heard = []
    try:
        report = check(served.endpoint, wait=float("inf"), tell=heard.append)
        assert report.ok, report
        shares = [int(said.split(": ")[1].split(" of ")[0]) for said in heard if "kernels" in said]
        assert shares == sorted(shares)
        assert shares[0] < 10 < shares[-1]
        assert "compiling what a robot computes for this processor; this happens once" in served.said
        assert " kernels are compiled\n" in served.said
        served.end()
    finally:
        served.kill()
    with Served(*ONE, cold=True) as again:
        assert "compil" not in again.said

"""Programs end even if they do not close their connection or are interrupted."""

import signal
import subprocess
import sys

import pytest

from tvist_protocol.stream import Event

ASYNCHRONOUS = """
import asyncio, sys
from tvist_client import Robot
async def main():
    robot = await Robot.connect(sys.argv[1])
    states = robot.states()
    await anext(states)
    print("end of main")
asyncio.run(main())
"""
ABANDONED = """
import asyncio, sys
from tvist_client import Robot
loop = asyncio.new_event_loop()
robot = loop.run_until_complete(Robot.connect(sys.argv[1]))
robot.on_state(print)
loop.close()
print("end of main")
"""
FAILING = """
import sys
from tvist_client.blocking import Robot
robot = Robot.connect(sys.argv[1])
control = robot.control("me")
control.__enter__()
next(robot.states())
raise SystemExit("end of main")
"""
INTERRUPTED = """
import sys
from tvist_client.blocking import Robot
try:
    with Robot.connect(sys.argv[1]) as robot, robot.control("me") as arm:
        events = robot.events()
        print("listens", flush=True)
        for event in events:
            print(event.why, flush=True)
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.parametrize("program", [ASYNCHRONOUS, ABANDONED, FAILING])
def test_a_program_that_does_not_close_its_connection_ends(realtime, endpoint, program):
    command = [sys.executable, "-c", program, endpoint]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert "end of main" in ended.stdout + ended.stderr
    assert "Traceback" not in ended.stderr


def test_an_interrupted_program_releases_control_and_ends(realtime, endpoint):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", INTERRUPTED, endpoint], **pipes) as program:
        assert program.stdout.readline() == "listens\n"
        realtime.post(lambda: realtime.robot.publish(Event(tick=1, kind="warning", why="it waits")))
        assert program.stdout.readline() == "it waits\n"
        program.send_signal(signal.SIGINT)
        out, err = program.communicate(timeout=100.0)
    assert (out.splitlines()[-1], err, program.returncode) == ("interrupted", "", 0)
    assert realtime.robot.holder is None

"""How `tvist serve` and `tvist log record` end: signals before, while and after they serve, kills, and failures."""

import itertools
import os
import signal
import subprocess
import sys

import pytest
from tests.conformance.served import NOISE, PATIENCE, Served, finished, free_endpoint
from tests.conformance.wire import Wire

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file

FAR = [1.5, -3.0, 0.2, -1.5, 0.1, 0.3]
ENDING = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT]


@pytest.mark.realtime
@pytest.mark.parametrize("number", ENDING)
def test_a_signal_in_mid_motion_ends_it_with_the_recording_complete(number, tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--record", str(path), "--truth") as served:
        with Wire(served.endpoint) as wire:
            wire.listen("state", "truth", "event")
            wire.announce("mover")
            token = wire.command("take_control", client="mover")["token"]
            assert wire.command("move_j", token=token, q=FAR)["type"] == "accepted"
            wire.wait("state", lambda state: state["target_qd"][0] > 0.2)
            assert served.end(number) == 0
            last = wire.received["state"][-1]["tick"]
        assert f"recorded into {path}" in served.said
    content = read(path)
    assert (content.complete, content.note, content.recording.missing_ticks) == (True, None, 0)
    assert content.states[-1].tick >= last
    assert len(content.truths) == len(content.states)


SIGNALLED = """
import importlib, os, sys
from tvist_cli.main import main
number, module = int(sys.argv.pop(1)), sys.argv.pop(1)
module, _, name = module.rpartition(".")
module = importlib.import_module(module)
original = getattr(module, name)
def signalled(*arguments, **named):
    try:
        os.kill(os.getpid(), number)
    finally:  # while that ends it
        os.kill(os.getpid(), number)
    return original(*arguments, **named)
setattr(module, name, signalled)
sys.argv[0] = "tvist"
main()
"""
MOMENTS = [
    ("tvist_server.server.Network", signal.SIGTERM, False),  # nothing is there yet
    ("tvist_server.kernels.compiled", signal.SIGHUP, False),  # the network is open, and there is no robot yet
    ("asyncio.run", signal.SIGQUIT, True),  # the robot is made, and does not serve yet
]


@pytest.mark.parametrize(("where", "number", "recorded"), MOMENTS)
def test_a_signal_before_it_serves_is_a_clean_end_that_leaves_nothing_behind(
    where, number, recorded, tmp_path
):
    """A recording that has begun is closed like any other."""
    path = tmp_path / "x.mcap"
    arguments = ("serve", "--listen", free_endpoint(), "--record", path)
    ended = finished("-c", SIGNALLED, str(int(number)), where, *arguments)
    assert (ended.returncode, ended.stdout) == (0, "")
    assert not [word for word in NOISE if word in ended.stderr]
    assert (f"recorded into {path}" in ended.stderr, list(tmp_path.iterdir())) == (
        recorded,
        [path] * recorded,
    )


@pytest.mark.realtime
def test_signals_until_it_is_gone_do_no_harm(tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--record", str(path), cold=True) as served:
        with Wire(served.endpoint) as wire:
            wire.state()
        for number in itertools.cycle(ENDING):
            served.process.send_signal(number)
            if served.process.poll() is not None:
                break
        assert served.wait() == 0
    assert read(path).complete


@pytest.mark.realtime
def test_one_that_was_started_with_nohup_outlives_the_end_of_its_terminal():
    nohup = (sys.executable, "-c", "import os, sys; os.execvp('nohup', ['nohup', *sys.argv[1:]])")
    with Served(around=nohup) as served:
        with Wire(served.endpoint) as wire:
            tick = wire.state()["tick"]
            served.process.send_signal(signal.SIGHUP)
            wire.until(tick + 250)
        assert served.end() == 0


TERMINAL = """
import fcntl, os, sys, termios
os.setsid()
fcntl.ioctl(2, termios.TIOCSCTTY, 0)
os.execv(sys.executable, [sys.executable, "-m", "tvist_cli", "serve", *sys.argv[1:]])
"""


@pytest.mark.realtime
def test_the_end_of_its_terminal_ends_it_with_the_recording_complete(tmp_path):
    """Its messages then go nowhere, which is no failure."""
    path, (ours, its) = tmp_path / "run.mcap", os.openpty()
    command = [sys.executable, "-c", TERMINAL, "--listen", free_endpoint(), "--record", path]
    process = subprocess.Popen(command, stdin=its, stdout=its, stderr=its)
    os.close(its)
    said = b""
    try:
        while b"Press Control+C to stop" not in said:
            said += os.read(ours, 4096)
        os.close(ours)
        assert process.wait(PATIENCE) == 0
    finally:
        process.kill()
        process.wait(PATIENCE)
    assert read(path).complete


@pytest.mark.realtime
def test_a_signal_ends_a_client_s_recording_complete(realtime, tmp_path):
    """Twice, as impatient people send it."""
    path = tmp_path / "seen.mcap"
    command = [sys.executable, "-m", "tvist_cli", "log", "record", path, "--endpoint", realtime.endpoint]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert "recording ur5e into" in process.stderr.readline()
            with Wire(realtime.endpoint) as wire:
                wire.until(wire.state()["tick"] + 100)
            for _ in range(2):
                process.send_signal(signal.SIGTERM)
            _, said = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
    assert process.returncode == 0, said
    assert "states recorded" in said
    assert read(path).complete


STOPPED_READER = """
import os, signal, sys
from tests.conformance.session import plain_session
session = plain_session(sys.argv[1])
session.declare_subscriber("tvist/ur5e/state", lambda sample: None)
next(iter(session.get("tvist/ur5e/info")))
print("under way", flush=True)
os.kill(os.getpid(), signal.SIGSTOP)
"""


def test_a_client_that_has_stopped_reading_does_not_hold_up_the_end(start, tmp_path):
    """It stands still until the robot has ended, and the recording is complete."""
    path = tmp_path / "run.mcap"
    with Served("--clock", "lockstep", "--record", str(path)) as served:
        start("-c", STOPPED_READER, served.endpoint)
        with Wire(served.endpoint) as wire:
            token = wire.command("take_control", client="stepper")["token"]
            assert wire.command("move_j", token=token, q=FAR)["type"] == "accepted"
            wire.listen("state")
            for _ in range(6):  # more states than its socket holds
                wire.begin("simulation.step", token=token, ticks=1000)
            wire.until(500)
            assert served.end() == 0
    assert read(path).complete


@pytest.mark.realtime
def test_a_killed_server_leaves_a_recording_that_can_be_read_and_replays_equal(tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--record", str(path)) as served:
        with Wire(served.endpoint) as wire:
            token = wire.command("take_control", client="mover")["token"]
            wire.command("move_j", token=token, q=FAR)
            began = wire.state()["tick"]
            wire.until(began + 500)
        served.process.kill()
        served.wait()
    content = read(path)
    assert not content.complete
    assert "was not closed" in content.note
    assert content.states[-1].tick > began  # a chunk holds some 70 states
    assert replay_file(content).first_difference is None


@pytest.mark.realtime
def test_a_controller_that_fails_ends_the_server_with_exit_code_1_and_a_readable_recording(tmp_path):
    """A server that answers but ticks no more would be worse than none."""
    path = tmp_path / "run.mcap"
    program = """
import sys
from tvist_cli.main import main
from tvist_controller.controller import Controller
tick = Controller.complete_tick
def failing(self):
    if self.tick_number == 100:
        raise ArithmeticError("on purpose")
    return tick(self)
Controller.complete_tick = failing
sys.argv = ["tvist", "serve", *sys.argv[1:]]
main()
"""
    ended = finished("-c", program, "--listen", free_endpoint(), "--record", str(path))
    assert ended.returncode == 1
    assert "ArithmeticError: on purpose" in ended.stderr
    assert ended.stderr.splitlines()[-1].startswith("tvist: ")
    content = read(path)
    assert content.complete
    assert content.states[-1].tick == 100

"""How `tvist serve` and `tvist log record` end by signals at different moments."""

import itertools
import os
import signal
import subprocess
import sys

import pytest
from tests.conformance.served import NOISE, PATIENCE, Served, finished, free_endpoint
from tests.conformance.wire import Wire
from tests.system.shell import Begun, begun

from tvist_lab.recordings.mcap_file import read
from tvist_server.shutdown import ending_signals

FAR = [1.5, -3.0, 0.2, -1.5, 0.1, 0.3]
ENDING = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT]


@pytest.mark.realtime
def test_signal_in_a_motion_ends_the_server_with_a_complete_recording(tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--record", str(path), "--truth") as served:
        with Wire(served.endpoint) as wire:
            wire.listen("state", "truth", "event")
            wire.announce("mover")
            token = wire.command("take_control", client="mover")["token"]
            assert wire.command("move_j", token=token, q=FAR)["type"] == "accepted"
            wire.wait("state", lambda state: state["target_qd"][0] > 0.2)
            assert served.end(signal.SIGINT) == 0
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
    finally:  # during the shutdown
        os.kill(os.getpid(), number)
    return original(*arguments, **named)
setattr(module, name, signalled)
sys.argv[0] = "tvist"
main()
"""
MOMENTS = [
    ("tvist_server.server.Network", signal.SIGTERM, False),  # nothing exists yet
    ("tvist_server.kernels.compiled", signal.SIGHUP, False),  # the network is open, without a robot
    ("asyncio.run", signal.SIGQUIT, True),  # the robot exists, but is not served
]


@pytest.mark.parametrize(("where", "number", "recorded"), MOMENTS)
def test_signal_during_the_start_ends_the_server_cleanly(where, number, recorded, tmp_path):
    """A recording that has begun is closed."""
    path = tmp_path / "x.mcap"
    arguments = ("serve", "--listen", free_endpoint(), "--record", path)
    ended = finished("-c", SIGNALLED, str(int(number)), where, *arguments)
    assert (ended.returncode, ended.stdout) == (0, "")
    assert not [word for word in NOISE if word in ended.stderr]
    assert (f"recorded into {path}" in ended.stderr) == recorded
    assert list(tmp_path.iterdir()) == [path] * recorded


@pytest.mark.realtime
def test_repeated_signals_do_not_disturb_the_shutdown(tmp_path):
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


def test_sighup_that_nohup_ignores_does_not_end_a_server():
    handler = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert signal.SIGHUP not in ending_signals()
    finally:
        signal.signal(signal.SIGHUP, handler)


TERMINAL = """
import fcntl, sys, termios
from tvist_cli.main import main
fcntl.ioctl(2, termios.TIOCSCTTY, 0)
sys.argv = ["tvist", "serve", *sys.argv[1:]]
main()
"""


@pytest.mark.realtime
def test_end_of_the_terminal_ends_the_server_with_a_complete_recording(tmp_path):
    path, (ours, its) = tmp_path / "run.mcap", os.openpty()
    command = [sys.executable, "-c", TERMINAL, "--listen", free_endpoint(), "--record", path]
    with Begun(command, stdin=its, stdout=its, stderr=its, start_new_session=True) as process:
        os.close(its)
        said = b""
        while b"Press Control+C to stop" not in said:
            said += os.read(ours, 4096)
        os.close(ours)
        assert process.wait(PATIENCE) == 0
    assert read(path).complete


def test_message_to_a_closed_terminal_is_no_failure():
    """Nor is it when Python ends."""
    ours, its = os.openpty()
    program = "import sys; from tvist_cli.output import say; sys.stdin.read(); say('gone')"
    process = subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stderr=its)
    os.close(its)
    os.close(ours)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 0


@pytest.mark.realtime
def test_signals_end_the_recording_of_a_client_completely(realtime, tmp_path):
    """Impatient people send two."""
    path = tmp_path / "seen.mcap"
    with begun("log", "record", path, "--endpoint", realtime.endpoint) as process:
        assert "recording ur5e into" in process.stderr.readline()
        with Wire(realtime.endpoint) as wire:
            wire.until(wire.state()["tick"] + 20)
        for _ in range(2):
            process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=PATIENCE)
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


def test_suspended_client_does_not_delay_the_shutdown(start, tmp_path):
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

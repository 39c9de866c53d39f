"""Signals: what ends `tvist serve` and `tvist log record` in order, before, while and after they serve."""

import itertools
import os
import signal
import subprocess
import sys

import pytest
from tests.conformance.served import NOISE, PATIENCE, Served, finished, free_endpoint
from tests.conformance.wire import Wire

from tvist_lab.recordings.mcap_file import read

pytestmark = pytest.mark.realtime

ENDING = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT]

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


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
@pytest.mark.parametrize(
    "where",
    [
        "tvist_server.kernels.compiled",  # the network is open, and there is no robot yet
        "tvist_server.server.Network",  # nothing is there yet
    ],
)
def test_a_signal_before_it_serves_is_a_clean_end_that_leaves_nothing_behind(where, number, tmp_path):
    arguments = ("serve", "--listen", free_endpoint(), "--record", tmp_path / "x.mcap")
    ended = finished("-c", SIGNALLED, str(int(number)), where, *arguments, run=subprocess.run)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "", "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_a_signal_between_its_making_and_its_serving_is_not_lost(number, tmp_path):
    """Then there is a recording, which is closed like any other."""
    path = tmp_path / "x.mcap"
    arguments = ("serve", "--listen", free_endpoint(), "--record", path)
    ended = finished("-c", SIGNALLED, str(int(number)), "asyncio.run", *arguments, run=subprocess.run)
    assert ended.returncode == 0, ended.stderr
    assert f"recorded into {path}" in ended.stderr
    assert not [word for word in NOISE if word in ended.stderr]


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
        served.assert_quiet()
    assert read(path).complete


class Nohup(Served):
    """One that was started to outlive its terminal."""

    program = (
        "-c",
        "import os, sys; os.execvp('nohup', ['nohup', sys.executable, *sys.argv[1:]])",
        *Served.program,
    )


def test_one_that_was_started_with_nohup_outlives_the_end_of_its_terminal():
    with Nohup() as served:
        with Wire(served.endpoint) as wire:
            tick = wire.state()["tick"]
            served.process.send_signal(signal.SIGHUP)
            wire.until(tick + 500)
        assert served.end() == 0


TERMINAL = """
import fcntl, os, sys, termios
os.setsid()
fcntl.ioctl(2, termios.TIOCSCTTY, 0)
os.execv(sys.executable, [sys.executable, "-m", "tvist_cli", "serve", *sys.argv[1:]])
"""


def test_the_end_of_its_terminal_ends_it_with_the_recording_complete(tmp_path):
    """Its messages then go nowhere, which is no failure."""
    path, (ours, its) = tmp_path / "run.mcap", os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", TERMINAL, "--listen", free_endpoint(), "--record", path],
        stdin=its,
        stdout=its,
        stderr=its,
    )
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


@pytest.mark.parametrize("number", ENDING)
def test_a_signal_ends_a_client_s_recording_complete(number, tmp_path):
    path = tmp_path / "seen.mcap"
    with Served(cold=True) as served:
        process = subprocess.Popen(
            [sys.executable, "-m", "tvist_cli", "log", "record", path, "--endpoint", served.endpoint],
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            assert "recording ur5e into" in process.stderr.readline()
            with Wire(served.endpoint) as wire:
                wire.until(wire.state()["tick"] + 100)
            process.send_signal(number)
            process.send_signal(number)
            _, said = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
            process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, said
    assert "states recorded" in said
    assert read(path).complete

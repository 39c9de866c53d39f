"""A signal ends the process even if its shutdown hangs."""

import signal
import subprocess
import sys

import pytest
from tests.places import free_endpoint

HANGING = """
import atexit, signal, threading, time
from tvist_server import shutdown as module
def on_and_on():
    while True: {what}
module.LONGEST = 0.5
shutdown = module.Shutdown()
{where}
"""


@pytest.mark.parametrize(
    ("what", "where"),
    [("time.sleep(9)", "on_and_on()"), ("time.sleep(9)", "threading.Thread(target=on_and_on).start()"),
     ("sum(range(10**12))", "atexit.register(on_and_on)"), ("sum(range(10**12))", "shutdown.on_request(on_and_on)")],
)  # fmt: skip
def test_a_hanging_shutdown_is_ended_with_a_traceback(what, where):
    """This also holds for code that keeps the interpreter's lock after the signal."""
    code = HANGING.format(what=what, where=f"signal.raise_signal(signal.SIGTERM); {where}")
    ended = subprocess.run([sys.executable, "-c", code], stderr=subprocess.PIPE, check=False)
    assert (ended.returncode, b"in on_and_on" in ended.stderr) == (1, True)


SERVING = """
import sys
from tvist_cli.main import main
from tvist_server import clock, shutdown
def on_and_on(*_):
    while True: pass
clock.Lockstep.close = on_and_on
shutdown.LONGEST = 1.0
sys.argv = ["tvist", "serve", "--clock", "lockstep", "--listen", "{}"]
main()
"""


def test_a_hanging_server_ends_at_a_signal():
    text = SERVING.format(free_endpoint())
    with subprocess.Popen([sys.executable, "-c", text], stderr=subprocess.PIPE, text=True) as serving:
        assert any("ready after" in line for line in iter(serving.stderr.readline, ""))
        serving.send_signal(signal.SIGINT)
        assert "in on_and_on" in serving.stderr.read()
    assert serving.returncode == 1

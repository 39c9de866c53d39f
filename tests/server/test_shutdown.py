"""A signal ends the process whatever it does."""

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
module.LONGEST = 0.2
shutdown = module.Shutdown()
{where}
"""


@pytest.mark.parametrize(
    ("what", "where"),
    [("time.sleep(9)", "on_and_on()"), ("time.sleep(9)", "threading.Thread(target=on_and_on).start()"),
     ("sum(range(10**12))", "atexit.register(on_and_on)"), ("sum(range(10**12))", "shutdown.hear(on_and_on)")],
)  # fmt: skip
def test_a_shutdown_that_hangs_is_cut_off_and_says_where(what, where):
    """Also in code that keeps the interpreter's lock once the signal was heard."""
    code = HANGING.format(what=what, where=f"signal.raise_signal(signal.SIGTERM); {where}")
    ended = subprocess.run([sys.executable, "-c", code], stderr=subprocess.PIPE, check=False)
    assert (ended.returncode, b"in on_and_on" in ended.stderr) == (1, True)


SERVING = """
import sys
from tvist_cli.main import main
from tvist_server import shutdown as module
from {module} import {owner} as owner
def on_and_on(*_):
    while True: pass
owner.{name} = on_and_on
module.LONGEST = {longest}
sys.argv = ["tvist", "serve", "--listen", "{endpoint}"]
main()
"""


@pytest.mark.parametrize(
    ("number", "module", "owner", "name", "longest", "code", "why"),
    [(signal.SIGTERM, "tvist_controller.host", "Host", "tick", 100.0, 0, "has not returned for 1.5 s"),
     (signal.SIGINT, "tvist_server.plan_ahead", "PlanAhead", "close", 1.0, 1, "in on_and_on")],
)  # fmt: skip
def test_a_server_that_hangs_ends_at_a_signal_and_says_where(number, module, owner, name, longest, code, why):
    where = {"module": module, "owner": owner, "name": name, "endpoint": free_endpoint()}
    text = SERVING.format(longest=longest, **where)
    with subprocess.Popen([sys.executable, "-c", text], stderr=subprocess.PIPE, text=True) as serving:
        assert any("ready after" in line for line in iter(serving.stderr.readline, ""))
        serving.send_signal(number)
        assert why in serving.stderr.read()
    assert serving.returncode == code

"""Compiling ahead: all needed kernels are compiled, and no process is left behind."""

import subprocess
import sys

import pytest
from tests.conformance.served import finished

from tvist_server import kernels

TICKING = """
import sys
from pathlib import Path

from tvist_kernels.cache import KernelCache
from tvist_protocol import commands as c
from tvist_server.config import from_mapping
from tvist_server.robot import ServedRobot

setup = from_mapping({"clock": "realtime"}, "configuration").setup()
controller = ServedRobot(setup, None, Path(sys.argv[1])).controller
token = controller.receive(c.TakeControl(client="a")).token
load, ticking = KernelCache.load_overload, False


def told(kernel, sig, context):
    if ticking:
        print(kernel.name)
    return load(kernel, sig, context)


def tick(count):
    global ticking
    ticking = True
    for _ in range(count):
        controller.begin_tick()
        report, _ = controller.complete_tick()
        report.encoded, report.state
    ticking = False


KernelCache.load_overload = told
q = controller.cycle.sample.reference
for period in (1, 4):
    controller.receive(c.ServoStart(token=token, period=0.002 * period))
    for number in range(100):
        controller.receive_setpoint(c.Setpoint(token=token, sequence=number, q=tuple(q + 1e-5 * number)))
        tick(period)
    controller.receive(c.ServoStop(token=token))
    tick(500)
for turn, name in enumerate(("elastic", "auto", "zv")):
    controller.receive(c.MoveJ(token=token, q=tuple(q + 0.1 * turn)))
    tick(100)
    print(controller.receive(c.SetShaper(token=token, name=name)), file=sys.stderr)
    tick(1500)
"""
"""What a served robot loads while it ticks, one line for each kernel."""
SLEEP = "import time; print('{}', flush=True); time.sleep(1000)"


@pytest.fixture
def begun(monkeypatch):
    """Programs of the compiling processes by part, and the started processes."""
    programs, started = {}, []

    def begin(part):
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        started.append(subprocess.Popen([sys.executable, "-c", programs[part]], **pipes))
        return started[-1]

    monkeypatch.setattr(kernels, "PARTS", programs)
    monkeypatch.setattr(kernels, "_begin", begin)
    monkeypatch.setattr(kernels, "CHECK_EVERY", 0.0)
    return programs, started


def test_the_error_of_a_compiling_process_is_reported(begun):
    begun[0].update(a="pass", b="raise SystemExit(3)", c="print('noise'); raise SystemExit('no room')")
    with pytest.raises(kernels.KernelsError, match=r"^no room$"):
        kernels.compile_ahead(1)


def test_a_signal_ends_the_compiling_processes(begun):
    begun[0].update(a=SLEEP, b=SLEEP)

    def interrupt(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kernels.compile_ahead(2, interrupt)
    assert [process.returncode for process in begun[1]] == [-9, -9]


def test_a_served_robot_loads_no_kernel_while_it_ticks(tmp_path):
    done = finished("-c", TICKING, tmp_path, run=subprocess.run)
    assert done.stderr.count("Done(") == 3, done.stderr
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.nightly
def test_all_kernels_that_a_robot_needs_are_compiled_ahead(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    subprocess.run([sys.executable, "-m", "tvist_cli", "serve", "--compile"], check=True)
    ahead = sorted(tmp_path.rglob("*.kernel"))
    from tests.conftest import __file__ as shared

    subprocess.run(
        [sys.executable, "-c", f"import runpy; runpy.run_path({shared!r})['compile_kernels']()"], check=True
    )
    assert sorted(tmp_path.rglob("*.kernel")) == ahead

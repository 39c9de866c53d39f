"""Options of pytest, the order of parallel tests, and measured figures."""

import argparse
import asyncio
import contextlib
import os
import signal

import pytest
import tests.examples  # noqa: F401  registers the profiles
from hypothesis import settings
from tests.durations import Durations, arrange, quick
from tests.forked import NURSERY
from tests.nightly import NightlyRecord
from tests.skips import Skips

settings.load_profile("full")
NICE = os.nice(0)  # of this process at its start


def _count(text):
    if not text.isdecimal() or text == "0":
        raise argparse.ArgumentTypeError(f"is {text}: must be a whole number of at least 1")
    return int(text)


def pytest_addoption(parser):
    parser.addoption("--keep-durations", action="store_true", help="write durations to durations.json")
    parser.addoption("--record-nightly", action="store_true", help="write the outcome: nightly.json")
    parser.addoption("--known-skips", action="store_true", help="fail unless skips equal skips.json")
    parser.addoption("--quick", action="store_true", help="run what is quick by durations.json")
    parser.addoption("--cases", type=_count, default=1, help="cases of each test with the mark `search`")
    parser.addoption("--seed", type=int, default=0, help="seed of these cases")


def pytest_configure(config):
    if hasattr(config, "workerinput"):  # the first process hears what all processes report
        return
    asked = config.option
    plugins = {Durations: asked.keep_durations, NightlyRecord: asked.record_nightly, Skips: asked.known_skips}
    for plugin, wanted in plugins.items():
        if wanted:
            config.pluginmanager.register(plugin())


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(config, items):
    """Mark users of the fixture `realtime`, choose quick tests, and order parallel ones."""
    chosen = quick(items) if config.option.quick else items
    if len(chosen) < len(items):
        config.hook.pytest_deselected(items=list(set(items) - set(chosen)))
        items[:] = chosen
    for item in items:
        if "realtime" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.realtime)
    if not hasattr(config, "workerinput"):
        return (yield)
    arrange(items)
    done = yield
    if not all("@" in item.nodeid for item in items):
        raise pytest.UsageError("pytest-xdist does not group tests: its version does not fit that of pytest")
    return done


def pytest_sessionstart(session):
    """Compile the kernels once before parallel tests, and start the process from which tests fork programs.

    Started programs react to signals also under nohup, because they do not inherit handlers, unlike SIG_IGN.
    """
    if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: None)
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # a shell sets this for background jobs
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if getattr(session.config.option, "numprocesses", None):
        compile_kernels()
    if hasattr(session.config, "workerinput"):
        NURSERY.start()


def pytest_runtest_setup(item):
    """Give real-time tests, which one of several processes runs, priority over the tests of the others."""
    if hasattr(item.config, "workerinput"):
        nice = NICE if item.get_closest_marker("realtime") else NICE + 10
        with contextlib.suppress(PermissionError):  # only root may lower the value again
            os.setpriority(os.PRIO_PROCESS, 0, nice)


def compile_kernels():
    """Make shaped motions, so that numba finds their kernels on disk."""
    from tvist_lab.in_process import free_setup, robot_in_process

    async def move(shaper):
        async with robot_in_process(free_setup(shaper=shaper)) as robot, robot.control("compiler") as arm:
            await arm.move_j([0.2, -1.4, 1.7, -1.8, -1.5, 0.3])
            x, y, z, *turn = await robot.forward_kinematics()
            await robot.inverse_kinematics([x, y, z + 0.05, *turn])
            await arm.move_l([x, y, z + 0.05, *turn], velocity=1.0)
            await arm.speed_l([0.0, 0.0, -0.1, 0.0, 0.0, 0.0], duration=0.1)
            await arm.stop_l()

    for shaper in ("zv", "auto"):
        asyncio.run(move(shaper))


@pytest.fixture(scope="session")
def ur5e():
    """The paper's arm, as its robot file describes it."""
    from tvist_plant.description import load

    return load("ur5e")


@pytest.fixture
def measured(request):
    """Record a figure with `measured(what, value)`; `pytest -v` shows it."""

    def note(what, value):
        request.node.user_properties.append((what, str(value)))

    return note


def pytest_terminal_summary(terminalreporter):
    """Show measured figures."""
    if terminalreporter.verbosity < 1:
        return
    for report in (*terminalreporter.getreports("passed"), *terminalreporter.getreports("failed")):
        if report.when == "call":
            for what, value in report.user_properties:
                terminalreporter.write_line(f"{what}: {value}")

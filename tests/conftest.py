"""What all tests share: options, the order in which they run side by side, and figures that they measure."""

import argparse
import asyncio
import signal

import pytest
import tests.examples  # noqa: F401  registers the profiles
from hypothesis import settings
from tests.durations import Durations, arrange, quick
from tests.nightly import NightlyRecord
from tests.skips import Skips

settings.load_profile("full")


def _count(text):
    if not text.isdecimal() or text == "0":
        raise argparse.ArgumentTypeError(f"is {text}: must be a whole number of at least 1")
    return int(text)


def pytest_addoption(parser):
    parser.addoption(
        "--keep-durations", action="store_true", help="write how long tests took: durations.json"
    )
    parser.addoption("--record-nightly", action="store_true", help="write the outcome: nightly.json")
    parser.addoption(
        "--known-skips", action="store_true", help="fail unless skipped is what skips.json lists"
    )
    parser.addoption("--quick", action="store_true", help="run what is quick by durations.json")
    parser.addoption(
        "--cases", type=_count, default=2, help="number of cases of each test with the mark `search`"
    )
    parser.addoption("--seed", type=int, default=0, help="seed of these cases")


def pytest_configure(config):
    if hasattr(config, "workerinput"):  # the first process hears what all processes report
        return
    asked = config.option
    for wanted, plugin in (
        (asked.keep_durations, Durations),
        (asked.record_nightly, NightlyRecord),
        (asked.known_skips, Skips),
    ):
        if wanted:
            config.pluginmanager.register(plugin())


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(config, items):
    """Mark what needs no mark of its own, see README.md, choose what is quick, and order what runs side by side."""
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
    """Compile the kernels before tests run side by side, so that not each process does.

    Programs that tests start hear signals also under nohup, as a handler, unlike SIG_IGN, is not inherited.
    """
    if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: None)
    if (
        signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    ):  # a shell does so for what it runs in the background
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if getattr(session.config.option, "numprocesses", None):
        compile_kernels()


def compile_kernels():
    """Have a robot make a shaped motion, whose kernels numba then finds on disk."""
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


@pytest.fixture
def measured(request):
    """Note a figure, `measured(what, value)`, that `pytest -v` shows whether the test passes or fails."""

    def note(what, value):
        request.node.user_properties.append((what, str(value)))

    return note


def pytest_terminal_summary(terminalreporter):
    """Show the figures that were measured."""
    if terminalreporter.verbosity < 1:
        return
    for report in (*terminalreporter.getreports("passed"), *terminalreporter.getreports("failed")):
        if report.when == "call":
            for what, value in report.user_properties:
                terminalreporter.write_line(f"{what}: {value}")

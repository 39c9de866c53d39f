"""Clocks of robots: jobs run before a tick, and exceptions end only their robot."""

import os
import threading
import time
from contextlib import contextmanager

import pytest

from tvist_plant.plant import PlantError
from tvist_server import punctual
from tvist_server.clock import Lockstep, Realtime, TickedRobot

pytestmark = pytest.mark.realtime

WAIT = 100.0
PERIOD = 0.002


class FakeHost:
    """Counts its ticks; `reached` is set after `enough` of them."""

    def __init__(self, enough=5):
        self.failure, self.enough, self.reached = None, enough, threading.Event()
        self.ticks, self.missed_ticks, self.warned, self.threads = 0, 0, [], set()

    def leave_arm(self):
        self.left = True

    def tick(self):
        self.ticks += 1
        self.threads.add(threading.current_thread().name)
        if self.ticks >= self.enough:
            self.reached.set()

    def missed(self, ticks):
        self.missed_ticks += ticks

    def warn(self, why):
        self.warned.append(why)


@contextmanager
def ticking(*robots, **options):
    """Drive robots in real time until the body has ended and each has ticked often enough."""
    clock = Realtime(robots, PERIOD, **options)
    clock.start()
    yield
    for robot in robots:
        assert robot.host.reached.wait(WAIT)
    clock.close()


def test_one_thread_ticks_all_robots_and_measures_their_lateness():
    robots = [TickedRobot(FakeHost()) for _ in range(3)]
    with ticking(*robots):
        pass
    assert {name for robot in robots for name in robot.host.threads} == {"tvist-tick"}
    for robot in robots:
        assert [robot.lateness.look().ticks for _ in range(2)] == [robot.host.ticks, 0]
        assert robot.overload.missed == robot.host.missed_ticks <= robot.overload.due >= robot.host.ticks


def test_jobs_run_in_order_before_the_next_tick_and_before_the_end():
    robot, seen = TickedRobot(FakeHost()), []
    for number in range(100):
        robot.post(lambda number=number: seen.append((number, robot.host.ticks)))
    with ticking(robot):
        assert robot.host.reached.wait(WAIT)
        robot.post(lambda: seen.append("last"))
    assert seen == [*((number, 0) for number in range(100)), "last"]


def test_clients_are_answered_and_warned_once_while_the_arm_gives_no_tick():
    paces = [True, False, False, True, False]
    robot = TickedRobot(FakeHost(), pace=lambda timeout: paces.pop(0) if paces else time.sleep(timeout))
    answered = threading.Event()
    robot.host.reached.set()
    with ticking(robot):
        while paces:
            time.sleep(PERIOD)
        robot.post(answered.set)
        assert answered.wait(WAIT)
    assert robot.host.ticks == 2
    assert ["does not begin" in why for why in robot.host.warned] == [True, True]


def test_the_clock_ticks_an_arm_that_fails_to_give_its_tick():
    def fails(_):
        raise PlantError("no cable")

    host, failures = FakeHost(), []
    host.fail = failures.append
    with ticking(TickedRobot(host, pace=fails)):
        pass
    assert set(failures) == {"no cable"}
    assert host.failure is None


class Failing(FakeHost):
    def tick(self):
        raise self.error("on purpose")


@pytest.mark.parametrize("failing", ["tick", "job"])
def test_an_exception_in_a_tick_or_job_ends_only_that_robot(caplog, failing):
    other, robot, answered = TickedRobot(FakeHost()), TickedRobot(Failing()), threading.Event()
    robot.host.error = ArithmeticError if failing == "tick" else None
    if failing == "job":
        robot.post(lambda: 1 / 0)
    robot.host.reached.set()
    with ticking(other, robot):
        assert other.host.reached.wait(WAIT)
        robot.post(answered.set)
        assert answered.wait(WAIT)
    assert other.host.failure is None
    assert "see the log" in robot.host.failure
    assert robot.host.left
    assert caplog.text.count("Traceback") == 1


@pytest.mark.parametrize("error", [KeyboardInterrupt, GeneratorExit])
def test_all_robots_end_with_the_tick_thread(caplog, error):
    robots = [TickedRobot(FakeHost()), TickedRobot(Failing())]
    robots[1].host.error = error
    clock = Realtime(robots, PERIOD)
    clock.start()
    clock._thread.join(WAIT)
    assert all("see the log" in robot.host.failure for robot in robots)
    assert all(robot.host.left for robot in robots)
    assert "on purpose" in caplog.text


def test_the_server_ends_although_a_call_of_the_arm_never_returns(caplog, monkeypatch):
    monkeypatch.setattr("tvist_server.clock.LONGEST_TICK", 0.1)
    begun, go_on = threading.Event(), threading.Event()

    class Hanging(FakeHost):
        def tick(self):
            begun.set()
            go_on.wait(WAIT)

    clock = Realtime([TickedRobot(Hanging())], PERIOD)
    clock.start()
    assert begun.wait(WAIT)
    clock.close()
    assert "has not returned" in caplog.text
    go_on.set()


def test_recorders_get_the_priority_below_that_of_the_tick_thread(monkeypatch):
    """A program that displaced a recorder holding the interpreter's lock would delay the tick."""
    asked, ended = [], threading.Event()
    recorder = threading.Thread(target=ended.wait, args=(WAIT,), name=punctual.RECORDER)
    recorder.start()

    def ask(which, policy, parameter):
        asked.append((threading.current_thread().name, which, policy, parameter.sched_priority))

    monkeypatch.setattr(os, "sched_setscheduler", ask)
    for options in ({}, {"priority": True}):
        assert asked == []
        with ticking(TickedRobot(FakeHost()), **options):
            pass
    ended.set()
    policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK  # what a thread with this priority starts has none
    assert asked == [
        ("tvist-tick", 0, policy, punctual.PRIORITY),
        ("tvist-tick", recorder.native_id, policy, punctual.PRIORITY - 1),
    ]


def test_refused_real_time_priority_is_logged_and_the_robot_ticks(monkeypatch, caplog):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    robot = TickedRobot(FakeHost())
    with ticking(robot, priority=True):
        pass
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    assert "real-time priority is not permitted (Operation not permitted)" in record.getMessage()
    assert "\n" not in record.getMessage()
    assert robot.host.ticks >= 5


def test_in_lockstep_no_tick_starts_and_the_state_is_repeated_even_if_many_jobs_arrive(monkeypatch):
    """A new client gets the state even if other jobs, such as telemetry, come as often."""
    monkeypatch.setattr("tvist_server.clock.REPEAT_EVERY", 0.01)
    robot, repeated, jobs = TickedRobot(FakeHost()), threading.Event(), []
    clock = Lockstep(robot, repeated.set)

    def another():
        jobs.append(1)
        if not repeated.is_set():
            robot.post(another)

    robot.post(another)
    clock.start()
    assert repeated.wait(WAIT)
    clock.close()
    assert jobs
    assert robot.host.ticks == 0


def test_clients_are_warned_of_what_the_counts_of_ticks_tell(monkeypatch):
    """When an overload begins and ends: test_schedule.py."""
    monkeypatch.setattr("tvist_server.clock.TickCounts.note", lambda *_: "overloaded")
    robot = TickedRobot(FakeHost())
    with ticking(robot):
        pass
    assert robot.host.warned == ["overloaded"] * robot.host.ticks

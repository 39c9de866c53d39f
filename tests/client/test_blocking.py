"""The blocking client has the same methods as the asynchronous one."""

import asyncio
import inspect
import threading
import traceback

import pytest
from tools import stubs

import tvist_client
from tvist_client import LoopbackTransport, NotConnectedError, RefusedError, blocking
from tvist_client.blocking import Robot
from tvist_client.errors import ClientError, MisuseError, MotionStoppedError

from .conftest import NEAR

INTERNAL = {
    "Robot": {"pass_time", "put_setpoint", "until", "watch"},
    "Arm": {"keep_alive_every"},
    "Motion": {"on_event", "fail", "wait_event"},
    "Servo": {"check"},
    "Stream": {"push", "end"},
}


@pytest.fixture
def robot(host):
    with Robot.over(LoopbackTransport(host)) as robot:
        yield robot


@pytest.mark.parametrize("name", INTERNAL)
def test_blocking_and_asynchronous_methods_have_the_same_arguments(name):
    def methods(module):
        return {
            method: list(inspect.signature(function).parameters.values())
            for method, function in inspect.getmembers(getattr(module, name), callable)
            if not method.startswith("_")
        }

    def plain(parameters):
        return [(p.name, p.kind, p.default) for p in parameters]

    ours, theirs = methods(blocking), methods(tvist_client)
    assert set(ours) == set(theirs) - INTERNAL[name]
    for method, parameters in ours.items():
        assert plain(parameters) == plain(theirs[method]), method


def test_the_stubs_are_up_to_date():
    for path, text in stubs.generated().items():
        assert path.read_text(encoding="utf-8") == text, "run `make schemas`"


def test_a_blocking_program_moves_steps_and_streams(host, robot):
    assert robot.info().model == "UR5e"
    assert robot.clock() == "free"
    with robot.control("me") as arm:
        states = robot.states()
        motion = arm.move_j(NEAR)
        assert (motion.id, motion.started, motion.ended) == (1, 1, True)
        assert [next(states).tick for _ in range(150)] == list(range(1, 151))
        assert robot.state().target_q == pytest.approx(NEAR)
        before = host.controller.tick_number
        assert robot.advance(5) == before + 5
        assert arm.step(1) == before + 6
        with arm.servo() as servo:
            assert servo.set(NEAR) == 0
            assert servo.step_through([NEAR, NEAR]) == before + 8
            assert (servo.sequence, servo.period) == (3, 0.002)
    assert host.holder is None


def test_blocking_calls_and_blocks_raise_errors(host, robot):
    with pytest.raises(ZeroDivisionError), robot.control("me"):
        raise ZeroDivisionError
    assert host.holder is None
    with robot.control("me") as arm:
        motion = arm.move_j(NEAR, wait=False)
        assert (motion.stopped, motion.ended) == (None, False)
        robot.advance(5)
        arm.stop()
        with pytest.raises(MotionStoppedError) as raised:
            motion.wait()
        assert motion.stopped == raised.value.event


def test_a_traceback_of_the_blocking_client_shows_the_line_of_the_caller(robot):
    with robot.control("me") as arm:
        with pytest.raises(RefusedError) as raised:
            arm.move_j([9.0] * 6)
        frames = traceback.extract_tb(raised.value.__traceback__)
        assert frames[0].line == "arm.move_j([9.0] * 6)"
        assert [frame.name for frame in frames[1:]] == ["__call__", "call"]
        assert (raised.value.__cause__, raised.value.__suppress_context__) == (None, True)


def test_a_blocking_call_in_a_callback_raises_an_error(robot):
    raised = []

    def on_state(_):
        try:
            robot.state()
        except ClientError as error:
            raised.append(error)

    robot.on_state(on_state)
    with robot.control("me"):
        robot.advance(1)
    assert isinstance(raised[0], MisuseError)
    assert "callback" in str(raised[0])


async def test_blocking_iterators_end_when_the_connection_closes(host):
    await asyncio.to_thread(iterate_and_close, host)


def iterate_and_close(host):
    robot = Robot.over(LoopbackTransport(host))
    states = robot.states()
    with robot.control("me") as arm:
        arm.step(2)
    robot.close()
    robot.close()
    for use in (lambda: next(states), robot.info):
        with pytest.raises(NotConnectedError, match="closed"):
            use()


def test_callbacks_run_until_they_are_cancelled(robot):
    seen, threads = [], set()

    def callback(state):
        seen.append(state.tick)
        threads.add(threading.current_thread().name)

    with robot.control("me") as arm:
        others = (robot.on_event, robot.on_truth, robot.on_telemetry)
        ends = [robot.on_state(callback), *(listen(print) for listen in others)]
        arm.step(2)
        for end in ends:
            end()
        arm.step(2)
    assert seen[-2:] == [1, 2]
    assert threads == {"tvist-client"}


def test_a_failed_connection_leaves_no_thread(endpoint):
    with pytest.raises(NotConnectedError):
        Robot.connect(endpoint)
    assert "tvist-client" not in {thread.name for thread in threading.enumerate()}

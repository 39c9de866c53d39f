"""The blocking face: the same names, in threads that may wait."""

import asyncio
import inspect
import threading

import pytest
from tools import stubs

import tvist_client
from tvist_client import LoopbackTransport, MotionStoppedError, NotConnectedError, RefusedError, blocking
from tvist_client.blocking import Robot

Q = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
INTERNAL = {"Robot": {"pass_time", "put_setpoint", "until", "watch"}, "Arm": {"keep_alive_every"}}
INTERNAL |= {
    "Motion": {"on_event", "fail", "wait_event"},
    "Servo": {"check"},
    "Stream": {"push", "fail", "finish"},
}


@pytest.fixture
def robot(fake):
    with Robot.over(LoopbackTransport(fake)) as robot:
        yield robot


@pytest.mark.parametrize("name", ["Robot", "Arm", "Servo", "Motion", "Stream"])
def test_both_faces_have_the_same_methods_with_the_same_arguments(name):
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


def test_the_stubs_are_those_that_are_made():
    for path, text in stubs.generated().items():
        assert path.read_text(encoding="utf-8") == text, "run `make schemas`"


def test_a_program_reads_as_it_should(fake, robot):
    assert robot.info().model == "UR5e"
    assert robot.clock() == "free"
    with robot.control("me") as arm:
        states = robot.states()
        motion = arm.move_j(Q)
        assert (motion.id, motion.started, motion.done, motion.ended) == (1, 1, 120, True)
        assert [next(states).tick for _ in range(150)] == list(range(1, 151))
        assert states.dropped == 0
        assert robot.state().target_q == list(Q)
        assert robot.advance(5) == 155
        assert arm.step(1) == 156
        with arm.servo() as servo:
            assert servo.set(Q) == 0
            assert servo.step_through([Q, Q]) == 158
            assert (servo.sequence, servo.period) == (3, 0.002)
        arm.set_shaper("zv")
        arm.set_estimator("fixed", f_d=6.7, zeta=0.34)
        arm.set_payload(1.0, (0, 0, 0), (0,) * 6)
        arm.reset(Q, seed=1)
        arm.keep_alive()
        arm.stop()
    assert fake.holder is None
    robot.stop()


def test_errors_come_out_of_calls_and_of_blocks(fake, robot):
    def fail():
        with robot.control("me"):
            assert fake.holder == "me"
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert fake.holder is None
    with robot.control("me") as arm:
        with pytest.raises(RefusedError):
            arm.move_j([9.0] * 6)
        motion = arm.move_j(Q, wait=False)
        assert (motion.stopped, motion.ended) == (None, False)
        arm.stop()
        with pytest.raises(MotionStoppedError) as raised:
            motion.wait()
        assert motion.stopped == raised.value.event


def test_iterators_end_with_the_connection(fake):
    robot = Robot.over(LoopbackTransport(fake))
    states, events = robot.states(), robot.events()
    with robot.control("me") as arm:
        arm.step(2)
    robot.close()
    robot.close()
    assert list(events._inner._waiting) == []
    with pytest.raises(NotConnectedError, match="closed"):
        next(states)
    with pytest.raises(NotConnectedError, match="closed"):
        robot.info()


def test_callbacks_run_until_they_are_ended(robot):
    seen, threads = [], set()

    def callback(state):
        seen.append(state.tick)
        threads.add(threading.current_thread().name)

    with robot.control("me") as arm:
        ends = [
            robot.on_state(callback),
            robot.on_event(print),
            robot.on_truth(print),
            robot.on_telemetry(print),
        ]
        arm.step(2)
        for end in ends:
            end()
        arm.step(2)
    assert seen == [1, 2]
    assert threads == {"tvist-client"}


def test_over_the_network_it_works_the_same(realtime, endpoint):
    with Robot.connect(endpoint) as robot, robot.control("me") as arm:
        assert arm.move_j(Q).done is not None
        states = robot.states()
        ticks = [next(states).tick for _ in range(20)]
        assert ticks == sorted(set(ticks))
        assert robot.rest().runtime_state == 1


def test_a_connection_that_fails_leaves_no_thread_behind(endpoint):
    with pytest.raises(NotConnectedError):
        Robot.connect(endpoint)
    assert "tvist-client" not in {thread.name for thread in threading.enumerate()}


def test_it_may_be_used_beside_a_running_loop(fake):
    async def main():
        return await asyncio.to_thread(use)

    def use():
        with Robot.over(LoopbackTransport(fake)) as robot:
            return robot.info().model

    assert asyncio.run(main()) == "UR5e"

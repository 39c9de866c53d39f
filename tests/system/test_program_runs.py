"""Runs of programs are the same to the last bit: in a replay, in lockstep again, and live counted from their start."""

import asyncio

import pytest
from tests.conformance.served import Served

from tvist_client.robot import Robot
from tvist_lab.collect import collect
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.recordings.mcap_file import read
from tvist_protocol.errors import RefusedError
from tvist_protocol.programs import ProgramInterpret, ProgramSkip

from .test_determinism import assert_equal
from .test_live_replay import tvist

HOME = (-1.60, -1.727, -2.203, -0.808, 1.595, -0.031)
"""A posture away from singular ones, with room around it."""
WITH_A_CLIENT = f"""def with_a_client():
  global seen = 0
  thread watch():
    while True:
      seen = seen + read_input_integer_register(0)
      write_output_integer_register(0, seen)
      sync()
    end
  end
  run watch()
  movej({list(HOME)})
  movel(pose_add(get_target_tcp_pose(), p[0, 0.1, 0, 0, 0, 0]), a=0.8, v=0.3, r=0.03)
  write_output_integer_register(1, 1)
  movel(pose_add(get_forward_kin({list(HOME)}), p[0, 0.1, 0.1, 0, 0, 0]), a=0.8, v=0.3)
  speedj([0.2, 0, 0, 0.1, 0, 0], 1.0, 0.3)
  stopj(2)
  while read_input_integer_register(1) == 0:
    sync()
  end
  speedl([0, 0.1, 0, 0, 0, 0], 0.5, 0.2)
  protective_stop()
  sync()
  movej({list(HOME)}, a=1.4 + 0.0001 * seen)
  write_output_integer_register(1, 2)
end
"""
"""Moves as its client writes registers; the last move depends on when it wrote them."""
ALONE = f"""def alone():
  global count = 0
  thread beside():
    while True:
      count = count + 1
      write_output_integer_register(0, count)
      sync()
    end
  end
  thread turn():
    speedj([0.3, 0, 0, 0, 0, 0], 0.8, 9)
  end
  run beside()
  movej({list(HOME)})
  movel(pose_add(get_target_tcp_pose(), p[0, 0.1, 0, 0, 0, 0]), a=0.8, v=0.3, r=0.03)
  movep(pose_add(get_forward_kin({list(HOME)}), p[0, 0.1, 0.1, 0, 0, 0]), a=0.8, v=0.3)
  handle = run turn()
  sleep(0.4)
  kill handle
  sleep(0.5)
  i = 0
  while i < 100:
    servoj({[round(angle + 0.1, 3) for angle in HOME]}, t=0.002, lookahead_time=0.1, gain=300)
    i = i + 1
  end
  stopj(3)
  movej({list(HOME)})
end
"""
"""Waits for nothing from outside."""
WAITING = """def waiting():
  global n = 0
  interpreter_mode(clearQueueOnEnter=False)
  write_output_integer_register(0, n)
end
"""
STATEMENTS = (
    "def turn(angle): movej([-1.60 + angle, -1.727, -2.203, -0.808, 1.595, -0.031], a=2, v=1) n = n + 1 end",
    "turn(0)",
    "turn(0.4) turn(-0.2)",
    "movel(pose_add(get_target_tcp_pose(), p[0, 0.1, 0, 0, 0, 0]), a=0.8, v=0.3, r=0.03)",
    "movel(pose_add(get_target_tcp_pose(), p[0, 0.1, 0.1, 0, 0, 0]), a=0.8, v=0.3)",
    "thread count(): while True: n = n + 1 sync() end end run count()",
    "speedj([0.2, 0, 0, 0, 0, 0], 1, 0.2) clear_interpreter()",
    "movej([-1.60, -1.727, -2.203, -0.808, 1.595, -0.031], a=0.5 + 0.001 * n)",
    "turn(0)",
)
"""The last one is not valid, as the function has been forgotten."""


async def with_a_client(robot):
    """Run that program, write registers all the time, and unlock the protective stop; what the robot told."""
    with collect(robot) as told:
        async with robot.control("programs") as arm:
            await arm.run_program(WITH_A_CLIENT)
            for number in range(300):
                await arm.set_registers("input_int", [number % 7, int(number > 200)])
                await robot.advance(13)
                kinds = [event.kind for event in told.events]
                if "protective_stop" in kinds:
                    break
            await robot.rest()
            await arm.unlock_protective_stop()
            await robot.advance(50)
            await arm.play_program()
            while not any(event.kind == "program_stopped" for event in told.events):
                await robot.advance(50)
            await robot.advance(50)
            (stopped,) = (event for event in told.events if event.kind == "program_stopped")
            assert stopped.why is None
            assert not [event for event in told.events if event.line is not None]
    return told


async def with_statements(robot):
    """Add statements to a program while it moves, skip some, and let it end; what the robot told."""
    with collect(robot) as told:
        async with robot.control("programs") as arm:
            await arm.run_program(WAITING)
            for text in STATEMENTS[:-1]:
                await robot.request(ProgramInterpret(token=arm.token, text=text))
                await robot.advance(37)
            with pytest.raises(RefusedError, match="turn"):
                await robot.request(ProgramInterpret(token=arm.token, text=STATEMENTS[-1]))
            await robot.advance(600)
            await robot.request(ProgramSkip(token=arm.token, what="move"))
            await robot.advance(2500)
            await robot.request(ProgramInterpret(token=arm.token, text="sleep(9)"))
            await robot.request(ProgramInterpret(token=arm.token, text="halt"))
            await robot.request(ProgramSkip(token=arm.token, what="statements"))
            await robot.request(ProgramInterpret(token=arm.token, text="end_interpreter()"))
            while not any(event.kind == "program_stopped" for event in told.events):
                await robot.advance(50)
            kinds = [event.kind for event in told.events]
            assert kinds.count("motion_started") == 6
            assert not [event for event in told.events if event.line is not None]
    return told


async def alone(robot):
    """Run the program that waits for nothing; what the robot told."""
    with collect(robot) as told:
        async with robot.control("programs") as arm:
            await arm.run_program(ALONE)
            while not any(event.kind == "program_stopped" for event in told.events):
                await robot.advance(50)
            await robot.advance(100)
    return told


def motion(told):
    """Target and reference of each tick from the start of the program on, to a while after its end."""
    start, end = (
        next(event.tick for event in told.events if event.kind == kind)
        for kind in ("program_started", "program_stopped")
    )
    return [
        (state.target_q, state.target_qd, state.target_qdd, state.reference_q)
        for state in told.states
        if start <= state.tick < end + 50
    ]


async def served(scenario, *options):
    """Carry out a scenario with a served robot."""
    with Served(*options) as server:
        async with await Robot.connect(server.endpoint) as robot:
            told = await scenario(robot)
        assert server.end() == 0
    return told


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """What a client of a live robot saw of the program that waits for it, and the recording."""
    path = tmp_path_factory.mktemp("programs") / "run.mcap"
    return asyncio.run(served(with_a_client, "--record", str(path), "--truth")), path


@pytest.mark.realtime
def test_the_replay_of_a_live_run_with_a_client_is_equal_to_the_last_bit(live):
    told, path = live
    code, said, _ = tvist("log", "replay", path)
    assert (code, said["equal"], said["first_difference"]) == (0, True, None)
    by_tick = {state.tick: state for state in read(path).states}
    assert told.states
    assert all(by_tick[state.tick] == state for state in told.states)


@pytest.mark.realtime
def test_the_live_run_did_all_that_may_differ(live):
    kinds = [event.kind for event in live[0].events]
    assert kinds.count("program_started") == kinds.count("program_stopped") == 1
    assert kinds.count("motion_started") == 5
    assert kinds.count("protective_stop") == 1


async def test_two_runs_with_a_client_in_lockstep_give_bit_equal_states():
    one, other = [await served(with_a_client, "--clock", "lockstep", "--truth") for _ in range(2)]
    assert_equal(one, other)


async def test_a_run_with_statements_in_lockstep_is_the_same_again_and_in_its_replay(tmp_path):
    path = tmp_path / "run.mcap"
    one = await served(with_statements, "--clock", "lockstep", "--truth", "--record", str(path))
    other = await served(with_statements, "--clock", "lockstep", "--truth")
    assert_equal(one, other)
    code, said, _ = tvist("log", "replay", path)
    assert (code, said["equal"], said["first_difference"]) == (0, True, None)


@pytest.mark.realtime
def test_a_program_that_waits_for_nothing_moves_alike_live_and_as_fast_as_it_computes():
    """Plans are made beside the ticks live, and at once otherwise."""

    async def free():
        async with robot_in_process(free_setup()) as robot:
            return await alone(robot)

    one, other = motion(asyncio.run(served(alone))), motion(asyncio.run(free()))
    assert len(one) > 2000
    assert len(one) == len(other)
    differing = [tick for tick, (before, after) in enumerate(zip(one, other, strict=True)) if before != after]
    assert differing == []

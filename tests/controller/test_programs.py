"""Programs in URScript move the arm, read and write what clients see, and end as UR's controllers end them."""

import numpy as np
import pytest

from tvist_controller.kinematics.arm import Arm
from tvist_controller.paths.poses import placement_vector
from tvist_protocol import commands as c
from tvist_protocol.codec import encode
from tvist_protocol.io import SetRegisters
from tvist_protocol.motions import MoveL
from tvist_protocol.programs import ProgramClosePopup, ProgramPause, ProgramPlay, ProgramRun, ProgramStop
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.values import Payload

from .robots import UR5E, Robot
from .scripts import URSIM, a_robot, failure, finish, playing, run, said, script, start

KINEMATICS = Arm(UR5E)
HERE = placement_vector(*KINEMATICS.pose(np.array(URSIM)))
NEAR = [angle + 0.2 for angle in URSIM]


def ended(robot):
    """Why each program has ended, None for those that ended by themselves."""
    return [event.why for event in robot.events if event.kind == "program_stopped"]


def pose(dx=0.0, dy=0.0, dz=0.0):
    """A pose beside the one at the start, as text."""
    x, y, z, *turn = HERE
    return f"p{[x + dx, y + dy, z + dz, *turn]}"


def place(dx, dy, dz):
    """A place beside the one at the start [m]."""
    return np.array([HERE[0] + dx, HERE[1] + dy, HERE[2] + dz])


def places(robot):
    """Positions of the tool before shaping, one a tick [m]."""
    return np.array([KINEMATICS.pose(np.array(state.reference_q))[1] for state in robot.states])


def numbers(robot, first, count):
    return list(robot.controller.io().output_double_register[first : first + count])


def test_a_movej_is_the_motion_of_the_command_to_the_last_bit():
    one, other = a_robot(shaper="zv"), a_robot(shaper="zv")
    run(one, f"movej({NEAR}, a=1.5, v=0.9)")
    other.send(c.MoveJ, q=tuple(NEAR), acceleration=1.5, velocity=0.9)
    other.tick(len(one.states))
    assert [state.target_q for state in one.states] == [state.target_q for state in other.states]


def test_a_movel_is_the_line_of_the_command_and_begins_a_fixed_time_later():
    one, other = a_robot(), a_robot()
    run(one, f"movel({pose(dy=0.1)}, a=1.0, v=0.2)")
    x, y, z, *turn = HERE
    other.send(MoveL, pose=(x, y + 0.1, z, *turn), acceleration=1.0, velocity=0.2)
    other.tick(len(one.states))
    delay = next(event.tick for event in one.events if event.kind == "motion_started") - 1
    assert delay == 10
    moved = [state.target_q for state in one.states[delay:]]
    assert moved == [state.target_q for state in other.states[: len(moved)]]


def test_statements_after_a_move_run_when_the_shaped_reference_is_at_rest():
    robot = a_robot(shaper="zv")
    run(robot, f"movej({NEAR})", "textmsg(norm(get_target_joint_speeds()))")
    done = next(event.tick for event in robot.events if event.kind == "motion_done")
    told = next(event.tick for event in robot.events if event.kind == "text")
    assert told == done + 1
    assert float(said(robot)[0]) < 1e-4


def test_a_movej_to_a_pose_ends_there_near_the_present_joints():
    robot = a_robot()
    run(robot, f"movej({pose(dz=0.05)})")
    np.testing.assert_allclose(places(robot)[-1], place(0, 0, 0.05), atol=1e-6)
    assert np.abs(np.array(robot.states[-1].reference_q) - URSIM).max() < 0.5


@pytest.mark.parametrize(
    ("move", "text"),
    [
        ("movej(p[10,0,0,0,0,0])", "no joint positions reach the pose p[10, 0, 0, 0, 0, 0]"),
        ("movej([-123, 0, 0, 0, 0, 0])", "q[0] is -123 rad"),
        ("movej([0, 0, 0])", "q has 3 elements: it must have 6"),
        ('movej("there")', "q is"),
        ("movej([0, 0, 0, 0, 0, True])", "q[5] is True: it must be a number"),
        (f"movej({NEAR}, a=0)", "a is 0: it must be above 0"),
        (f"movej({NEAR}, r=-1)", "r is -1"),
        ("optimovej([0, -1, 0, 0, 0, 0], a=2)", "a is 2: it must be above 0 and at most 1"),
        (f"optimovel({pose()}, v=0)", "v is 0"),
        ("set_payload(99)", "rated for 5"),
        ("set_gravity([0, 9.82, 0])", "stands upright"),
        ("get_inverse_kin(p[10,0,0,0,0,0])", "no joint positions reach"),
        ("get_actual_joint_positions_history(5000)", "steps is 5000"),
        ("read_input_integer_register(48)", "address is 48"),
        ("write_output_integer_register(0, 1.5)", "value is 1.5: it must be an integer"),
        ("set_digital_out(10, True)", "n is 10"),
        (
            "force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,1,0,0,0], 4, [1,1,1,1,1,1])",
            "type is 4: it must be from 1 to 3",
        ),
        (
            "force_mode(p[0,0,0,0,0,0], [0,0,2,0,0,0], [0,0,1,0,0,0], 2, [1,1,1,1,1,1])",
            "selection_vector[2] is 2",
        ),
        (
            "force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,1,0,0,0], 2, [1,1,-1,1,1,1])",
            "limits[2] is -1",
        ),
        ("force_mode_set_damping(1.5)", "damping is 1.5: it must be from 0 to 1"),
        ("force_mode_set_gain_scaling(3)", "scaling is 3: it must be from 0 to 2"),
        ("freedrive_mode([1, 1, 1])", "freeAxes has 3 elements"),
        ('freedrive_mode(feature="table")', "feature is table"),
        ("tool_contact([0, 0, 1])", "direction has 3 elements"),
        ("direct_torque([0, 0, 0, 0, 0, 0])", "does not simulate torque control"),
    ],
)
def test_what_cannot_be_done_ends_the_program_at_its_call_and_the_arm_stays(move, text):
    robot = a_robot()
    run(robot, "textmsg(1)", move, "textmsg(2)")
    error = failure(robot)
    assert text in error.why
    assert (error.line, error.column, error.program) == (3, 3, "prog")
    assert said(robot) == ["1"]
    assert all(state.reference_q == list(URSIM) for state in robot.states)


@pytest.mark.parametrize("target", ["p[10,0,0,0,0,0]", pose(dz=-0.8)])
def test_a_line_that_the_arm_cannot_follow_ends_in_a_protective_stop_that_can_be_unlocked(target):
    robot = a_robot()
    run(robot, f"movel({target})", "textmsg(1)")
    assert robot.controller.programs.state == "PAUSED"
    assert robot.states[-1].safety_mode == 3
    assert failure(robot) is None
    assert robot.send(c.UnlockProtectiveStop) == Done()
    run(robot, f"movej({NEAR})")
    np.testing.assert_allclose(robot.states[-1].reference_q, NEAR, atol=1e-9)


def test_moves_with_a_radius_are_one_motion_and_what_comes_between_happens_in_the_blend():
    robot, radius = a_robot(), 0.03
    corner = place(0, 0.12, 0)
    run(
        robot,
        f"movel({pose(dy=0.12)}, a=0.8, v=0.2, r={radius})",
        "write_output_integer_register(0, 1)",
        'textmsg("corner")',
        f"movel({pose(dy=0.12, dz=0.12)}, a=0.8, v=0.2)",
        'textmsg("end")',
    )
    assert [event.kind for event in robot.events].count("motion_started") == 1
    away = np.linalg.norm(places(robot) - corner, axis=1)
    assert 1e-4 < away.min() < radius
    ticks = {event.why: event.tick for event in robot.events if event.kind == "text"}
    assert away[ticks["corner"] - 1] == pytest.approx(radius, abs=1.5e-3)
    assert ticks["end"] == next(event.tick for event in robot.events if event.kind == "motion_done") + 1


def test_a_blend_without_a_move_after_it_stops_at_its_point():
    robot = a_robot()
    run(robot, f"movel({pose(dy=0.1)}, r=0.05)", "sleep(0.1)", "textmsg(1)")
    np.testing.assert_allclose(places(robot)[-1], place(0, 0.1, 0), atol=1e-6)
    ended = [event.kind for event in robot.events if event.kind in {"motion_done", "text"}]
    assert ended == ["motion_done", "text"]


def test_servoj_follows_and_the_end_of_its_thread_stops_the_arm():
    robot = a_robot()
    aim = [angle + 0.05 for angle in URSIM]
    start(robot, f"while True:\n    servoj({aim}, t=0.002, lookahead_time=0.03, gain=1200)\n  end")
    robot.tick(500)
    np.testing.assert_allclose(robot.states[-1].reference_q, aim, atol=1e-3)
    robot = a_robot()
    start(
        robot,
        "thread servo():",
        "  while True:",
        f"    servoj({[angle + 0.1 for angle in URSIM]})",
        "  end",
        "end",
        "handle = run servo()",
        "sleep(0.2)",
        "kill handle",
        "sleep(1)",
        "textmsg(norm(get_target_joint_speeds()))",
    )
    finish(robot)
    assert float(said(robot)[0]) == 0.0
    assert failure(robot) is None


def test_a_thread_killed_in_a_move_leaves_it_to_the_stop_that_follows():
    robot = a_robot()
    run(
        robot,
        "thread go():",
        f"  movej({[angle + 1.0 for angle in URSIM[:1]] + list(URSIM[1:])}, a=2, v=1)",
        "end",
        "handle = run go()",
        "sleep(0.4)",
        "kill handle",
        "stopj(1.0)",
        "textmsg(norm(get_target_joint_speeds()))",
    )
    assert said(robot) == ["0"] or float(said(robot)[0]) < 1e-6
    assert failure(robot) is None
    speeds = robot.column("target_qd")[:, 0]
    slowest = np.diff(speeds).min() / 0.002
    assert -1.6 < slowest < -0.9


def test_two_threads_cannot_move_the_arm_at_once():
    robot = a_robot()
    run(
        robot,
        "thread go():",
        f"  movej({NEAR})",
        "end",
        "run go()",
        "sleep(0.1)",
        f"movej({list(URSIM)})",
    )
    assert "another thread is controlling the robot" in failure(robot).why
    assert robot.until_rest()


def test_speedj_returns_after_its_time_and_keeps_the_speed_until_the_program_ends():
    robot = a_robot()
    run(
        robot, "speedj([0.1, 0, 0, 0, 0, 0], 1.0, 0.3)", "textmsg(get_target_joint_speeds()[0])", "sleep(0.2)"
    )
    assert float(said(robot)[0]) == pytest.approx(0.1, abs=1e-6)
    told = next(event.tick for event in robot.events if event.kind == "text")
    assert told == 151
    assert robot.column("target_qd")[200:240, 0] == pytest.approx(0.1, abs=1e-9)
    robot.until_rest()


def test_speedj_without_a_time_returns_when_the_speed_is_reached():
    robot = a_robot()
    run(robot, "speedj([0.2, 0, 0, 0, 0, 0], 1.0)", "textmsg(1)")
    told = next(event.tick for event in robot.events if event.kind == "text")
    assert 100 <= told <= 103


def test_servoc_goes_to_its_pose_and_no_faster_than_it_is_told():
    robot = a_robot()
    start(robot, f"servoc({pose(dy=0.1)}, a=0.5, v=0.1)")
    finish(robot)
    ways = np.linalg.norm(np.diff(places(robot), axis=0), axis=1) / 0.002
    assert ways.max() <= 0.1 * (1 + 1e-6)
    np.testing.assert_allclose(places(robot)[-1], place(0, 0.1, 0), atol=2e-3)


def test_time_passes_by_sync_and_sleep_and_by_nothing_else():
    robot = a_robot()
    run(robot, "i = 0", "while i < 20:", "  i = i + 1", "end", "textmsg(1)", "sync()", "textmsg(2)",
        "sleep(0.02)", "textmsg(3)")  # fmt: skip
    assert [event.tick for event in robot.events if event.kind == "text"] == [1, 2, 12]


def test_registers_that_a_program_writes_are_published_with_the_tick_in_which_it_does():
    robot = a_robot()
    start(robot, "sleep(0.01)", "write_output_float_register(3, 1.5)", "sleep(1)")
    for _ in range(20):
        robot.controller.begin_tick()
        io = robot.controller.changed_io()
        state, _ = robot.controller.complete_tick()
        if io is not None and io.output_double_register[3] == 1.5:
            assert io.tick == state.tick == 6
            return
    raise AssertionError("the register was not published")


def test_a_program_follows_the_registers_that_a_client_writes():
    robot = a_robot()
    start(robot, "while read_input_integer_register(24) == 0:", "  sync()", "end",
          "textmsg(read_input_float_register(47))", "textmsg(read_input_boolean_register(64))")  # fmt: skip
    robot.tick(50)
    assert said(robot) == []
    for bank, first, value in (("input_double", 47, 2.5), ("input_bit", 64, True), ("input_int", 24, 7)):
        assert robot.send(SetRegisters, bank=bank, first=first, values=(value,)) == Done()
    finish(robot)
    assert said(robot) == ["2.5", "True"]


def test_outputs_read_back():
    robot = a_robot()
    run(robot, "set_standard_digital_out(3, True)", "set_tool_digital_out(1, True)", "digital_out[0] = True",
        "set_analog_outputdomain(1, 1)", "set_standard_analog_out(1, 0.25)", "set_tool_voltage(24)",
        "textmsg(get_standard_digital_out(3))", "textmsg(get_standard_analog_out(1))")  # fmt: skip
    io = robot.controller.io()
    assert io.actual_digital_output_bits == 1 << 3 | 1 << 17 | 1
    assert io.standard_analog_output[1] == 2.5
    assert io.tool_output_voltage == 24
    assert said(robot) == ["True", "0.25"]


def test_a_blocking_popup_waits_until_somebody_closes_it():
    robot = a_robot()
    start(robot, 'popup("look", title="T", warning=True, blocking=True)', "textmsg(1)")
    robot.tick(100)
    (shown,) = (event for event in robot.events if event.kind == "popup")
    assert (shown.why, shown.title, shown.level) == ("look", "T", "warning")
    assert said(robot) == []
    assert robot.controller.receive(ProgramClosePopup()) == Done()
    finish(robot)
    assert said(robot) == ["1"]


@pytest.mark.parametrize(("action", "state"), [("pause", "PAUSED"), ("stop", "STOPPED")])
def test_a_watchdog_pauses_or_stops_the_program_when_its_register_is_not_written(action, state):
    robot = a_robot()
    start(
        robot, f'rtde_set_watchdog("input_int_register_0", 10.0, "{action}")', "speedj([0.1,0,0,0,0,0], 1, 9)"
    )
    for _ in range(10):
        robot.tick(40)
        robot.send(SetRegisters, bank="input_int", first=0, values=(1,))
        assert playing(robot)
        assert robot.controller.io().watched == ["input_int_register_0"]
    robot.tick(60)
    assert robot.controller.programs.state == state
    assert (robot.controller.io().watched == []) == (action == "stop")
    robot.until_rest()


@pytest.mark.parametrize("seconds", [0.0, 0.1, 1.0])
def test_what_is_published_goes_over_to_another_payload_in_the_time_that_a_program_says(seconds):
    robot = a_robot(payload=Payload(mass=2.0, com=(0.0, 0.0, 0.01), inertia=(0.0,) * 6))
    start(robot, f"set_target_payload(1, [0.02, 0, 0.05], [0, 0, 0, 0, 0, 0], {seconds})", "sleep(2)")
    masses = []
    for _ in range(600):
        robot.tick()
        io = robot.controller.changed_io()
        masses.append(masses[-1] if io is None else io.payload.mass)
        share = 2.0 - masses[-1]
        if io is not None:
            np.testing.assert_allclose(io.payload.com, (0.02 * share, 0.0, 0.01 + 0.04 * share), atol=1e-12)
    changing = sum(1.0 < mass < 2.0 for mass in masses)
    assert changing == pytest.approx(seconds / 0.002, abs=1)
    assert max(np.diff(masses)) <= 0.0
    assert (masses[0], masses[-1]) == (2.0, 1.0)


def test_set_tcp_set_payload_and_their_getters():
    robot = a_robot()
    run(robot, "set_tcp(p[0, 0, 0.1, 0, 0, 0])", "set_target_payload(1.0, [0.0, 0.0, 0.05], [0,0,0,0,0,0], 1.0)",
        "textmsg(get_tcp_offset())", "textmsg(get_target_payload())", "textmsg(get_target_payload_cog())",
        "a = get_actual_tool_flange_pose()", "b = get_actual_tcp_pose()",
        "textmsg(norm([b[0]-a[0], b[1]-a[1], b[2]-a[2]]))")  # fmt: skip
    assert said(robot)[:3] == ["p[0, 0, 0.1, 0, 0, 0]", "1", "[0, 0, 0.05]"]
    assert float(said(robot)[3]) == pytest.approx(0.1, abs=1e-6)
    assert robot.controller.declared.mass == 1.0
    assert robot.controller.cycle.dynamics.changing  # for a second


def test_kinematics_of_programs_agree_with_each_other():
    robot = a_robot()
    run(robot, f"q = {NEAR}", "x = get_forward_kin(q)", "s = get_inverse_kin(x, q)",
        "textmsg(norm(s - q) < 0.000001)", "textmsg(get_inverse_kin_has_solution(p[9,0,0,0,0,0]))",
        "textmsg(is_within_safety_limits(q))", "textmsg(is_within_safety_limits([7,0,0,0,0,0]))",
        "m = get_mass_matrix()", "textmsg(m[0, 1] == m[1, 0])",
        "textmsg(get_list_length(get_jacobian()))")  # fmt: skip
    assert said(robot) == ["True", "False", "True", "False", "True", "6"]


def test_is_steady_half_a_second_after_the_target_has_come_to_rest():
    robot = a_robot()
    run(robot, f"movej({NEAR})", "i = 0", "while not is_steady():", "  i = i + 1", "  sync()", "end",
        "textmsg(i)")  # fmt: skip
    assert 245 <= int(said(robot)[0]) <= 250


def test_secondary_programs_run_beside_the_main_one_and_do_not_move_the_arm():
    robot = a_robot()
    start(robot, "sleep(0.1)", "textmsg(2)")
    robot.tick(2)
    text = "sec extra():\n  set_standard_digital_out(0, True)\n  textmsg(1)\nend\n"
    assert robot.send(ProgramRun, text=text) == Done()
    finish(robot)
    assert said(robot) == ["1", "2"]
    assert robot.controller.io().actual_digital_output_bits == 1
    refused = robot.send(ProgramRun, text=f"sec extra():\n  movej({NEAR})\nend\n")
    assert refused.code == "script_error"


def test_a_text_with_an_error_is_refused_with_its_place_and_changes_nothing():
    robot = a_robot()
    start(robot, "sleep(1)", "textmsg(1)")
    robot.tick(5)
    refused = robot.send(ProgramRun, text=script("calldoesntexist()"))
    assert (refused.code, refused.where) == ("script_error", "text:2:3")
    assert refused.why == "compile_error_name_not_found:calldoesntexist:"
    finish(robot)
    assert said(robot) == ["1"]


def test_a_new_program_replaces_the_one_that_runs_and_waits_until_the_arm_rests():
    robot = a_robot()
    start(robot, "speedj([0.5,0,0,0,0,0], 2, 9)", name="one")
    robot.tick(300)
    start(robot, f"movej({NEAR})", name="two")
    finish(robot)
    told = [(event.kind, event.program) for event in robot.events if event.kind.startswith("program_")]
    assert told == [
        ("program_started", "one"), ("program_stopped", "one"), ("program_started", "two"), ("program_stopped", "two"),
    ]  # fmt: skip
    np.testing.assert_allclose(robot.states[-1].reference_q, NEAR, atol=1e-9)
    speeds = robot.column("target_qd")
    assert (np.abs(np.diff(speeds, axis=0)) / 0.002).max() < 40.0


def test_pausing_a_guided_motion_stops_it_and_playing_goes_on():
    robot = a_robot()
    start(robot, "i = 0", "while i < 400:", "  speedj([0.1,0,0,0,0,0], 1, 0.002)", "  i = i + 1", "end")
    robot.tick(200)
    assert robot.send(ProgramPause) == Done()
    robot.tick(300)
    assert robot.controller.cycle.mode.at_rest
    assert robot.send(ProgramPlay) == Done()
    robot.tick(100)
    assert robot.states[-1].target_qd[0] == pytest.approx(0.1, abs=1e-3)
    finish(robot)


def test_the_slider_stretches_the_time_of_speedj_and_not_that_of_sleep():
    robot = a_robot()
    robot.send(c.SetSpeed, fraction=0.5)
    start(robot, "speedj([0.1,0,0,0,0,0], 1.0, 0.2)", "textmsg(1)", "sleep(0.2)", "textmsg(2)", "stopj(5)")
    finish(robot)
    first, second = (event.tick for event in robot.events if event.kind == "text")
    assert first == pytest.approx(201, abs=2)
    assert second - first == 100


def test_equal_programs_and_inputs_give_equal_bits():
    lines = (
        "global count = 0",
        "thread other():",
        "  while True:",
        "    count = count + read_input_integer_register(0)",
        "    write_output_integer_register(0, count)",
        "    sync()",
        "  end",
        "end",
        "run other()",
        f"movel({pose(dy=0.05)}, r=0.01)",
        f"movel({pose(dz=0.05)})",
        "speedj([0.1, 0, 0, 0, 0, 0], 0.5, 0.2)",
        "stopj(1)",
        f"movej({NEAR})",
    )
    runs = []
    for _ in range(2):
        robot = Robot(q=URSIM, shaper="ei3")
        start(robot, *lines)
        for tick in range(40):
            robot.send(SetRegisters, bank="input_int", first=0, values=(tick,))
            robot.tick(7)
        runs.append((finish(robot).states, robot.controller.io()))
    assert runs[0] == runs[1]


def test_the_end_of_a_program_says_why_unless_it_is_its_own():
    robot = a_robot()
    run(robot, "sleep(0.1)")
    assert ended(robot) == [None]
    start(robot, "sleep(10)", name="first")
    run(robot, "sleep(0.1)")
    assert ended(robot)[1:] == ["another program was started", None]
    for stop in (lambda: robot.send(ProgramStop), lambda: robot.send(c.PowerOff)):
        start(robot, "sleep(10)")
        robot.tick(5)
        stop()
        robot.tick()
    assert ended(robot)[3:] == ["the program was stopped", "power_off was commanded"]
    assert failure(robot) is None


def test_the_end_of_a_program_names_the_safety_stop():
    robot = a_robot()
    start(robot, f"movej({NEAR})")
    robot.tick(50)
    robot.send(SimulationInject, fault="emergency_stop")
    robot.tick()
    (why,) = ended(robot)
    (stop,) = [event for event in robot.events if event.kind == "safety_stop"]
    assert why == stop.why


def test_a_program_that_is_paused_in_a_safeguard_stop_stays_paused_after_it():
    robot = a_robot()
    start(robot, f"movel({pose(dz=0.1)}, v=0.1)")
    robot.tick(200)
    robot.send(SimulationInject, fault="safeguard_stop", seconds=1.0)
    robot.tick(300)
    assert robot.send(ProgramPause) == Done()
    robot.tick(200)
    held = robot.states[-1].reference_q
    robot.tick(800)
    assert robot.states[-1].reference_q == held
    assert robot.send(ProgramPlay) == Done()
    finish(robot)
    np.testing.assert_allclose(places(robot)[-1], place(0, 0, 0.1), atol=1e-6)


@pytest.mark.parametrize("secondary", [True, False])
def test_a_program_that_uses_all_evaluations_leaves_some_to_the_others(secondary):
    busy = ("while True:", "  i = 0", "  while i < 200:", "    i = i + 1", "  end", "  sync()", "end")
    robot = a_robot()
    if secondary:
        text = "\n".join(("sec busy():", *busy, "end", ""))
        robot.send(ProgramRun, text=text)
        start(robot, "sleep(0.01)", "textmsg(1)")
    else:
        start(robot, *busy)
        robot.send(ProgramRun, text="sec other():\n  sleep(0.01)\n  textmsg(1)\nend\n")
    robot.tick(100)
    assert said(robot) == ["1"]


def test_a_watchdog_waits_while_the_program_is_paused_and_watches_again_after():
    robot = a_robot()
    start(robot, 'rtde_set_watchdog("input_int_register_0", 10.0, "stop")', "while True:", "  sync()", "end")
    robot.tick(20)
    robot.send(ProgramPause)
    robot.tick(300)
    assert robot.controller.programs.state == "PAUSED"
    robot.send(ProgramPlay)
    robot.tick(40)
    assert playing(robot)
    robot.tick(20)
    assert robot.controller.programs.state == "STOPPED"


def test_what_is_left_of_a_cut_character_is_shown_as_one_that_is_not_known():
    robot = a_robot()
    run(robot, 'textmsg(str_at("é", 0))')
    (text,) = (event for event in robot.events if event.kind == "text")
    assert encode(text)
    assert text.why == "\ufffd"


def test_a_program_cannot_move_an_arm_that_a_client_streams_to():
    robot = a_robot()
    robot.send(c.ServoStart, period=0.002, velocity=1.0, acceleration=2.0, jerk=100.0)
    start(robot, f"movej({NEAR})")
    robot.tick(5)
    assert "streams set-points" in failure(robot).why


def test_the_history_of_the_joints_has_the_present_from_the_first_tick():
    robot = a_robot()
    run(robot, "textmsg(norm(get_actual_joint_positions_history(0) - get_actual_joint_positions()))")
    assert said(robot) == ["0"]


def test_a_servoj_to_where_the_arm_rests_is_no_motion():
    """Clients that hold a posture repeat it 500 times a second."""
    robot = run(a_robot(), "q = get_target_joint_positions()", *["servoj(q)"] * 50, "textmsg(get_steptime())")
    assert robot.kinds().count("motion_started") == 0
    moved = run(
        a_robot(),
        f"while True:\n servoj({NEAR})\n if get_target_joint_positions() == {NEAR}:\n halt\n end\n end",
    )
    assert moved.kinds().count("motion_started") == 1


@pytest.mark.parametrize(
    ("inertia", "found"),
    [
        ("[0.001, 0.001, 0.00205, 0, 0, 0]", [0.00105, 0.00105, 0.0021]),
        ("[0.001, 0.001, 0.002, 0, 0, 0]", None),
    ],
)
def test_an_inertia_that_was_rounded_becomes_that_of_a_body_with_a_warning(inertia, found):
    robot = run(
        a_robot(),
        f"set_target_payload(1.0, [0, 0, 0.05], {inertia})",
        "textmsg(get_target_payload_inertia())",
    )
    assert failure(robot) is None
    kept = robot.controller.declared.inertia
    assert [kept[0], kept[3], kept[5]] == pytest.approx(found or [0.001, 0.001, 0.002], abs=1e-9)
    told = [event.why for event in robot.events if event.kind == "warning"]
    assert bool(told) == bool(found)
    assert all(
        inertia.replace(" 0,", " 0.0,").replace(" 0]", " 0.0]") in why and "5e-05" in why for why in told
    )


@pytest.mark.parametrize("inertia", ["[0.001, 0.001, 0.0022, 0, 0, 0]", "[1, 1, 1, 3, 0, 0]"])
def test_an_inertia_that_no_body_has_ends_the_program(inertia):
    robot = run(a_robot(), f"set_target_payload(1.0, [0, 0, 0.05], {inertia})")
    assert "no body has these moments of inertia" in failure(robot).why

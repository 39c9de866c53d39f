"""Programs in URScript move the arm, read and write what clients see, and end as on UR's controllers."""

from itertools import pairwise

import numpy as np
import pytest

from tvist_controller.kinematics.pose import placement_vector
from tvist_protocol import commands as c
from tvist_protocol.io import SetRegisters
from tvist_protocol.motions import MoveL
from tvist_protocol.programs import ProgramClosePopup, ProgramPause, ProgramPlay, ProgramRun, ProgramStop
from tvist_protocol.replies import Accepted, Done
from tvist_protocol.values import Payload
from tvist_urscript import EVALUATIONS

from .forces import KINEMATICS, places
from .scripts import URSIM, a_robot, failure, finish, playing, run, said, script, start

HERE = placement_vector(*KINEMATICS.pose(np.array(URSIM)))
NEAR = [angle + 0.2 for angle in URSIM]


@pytest.fixture
def robot():
    return a_robot()


def ended(robot):
    """Return why each program has ended, None for those that ended by themselves."""
    return [event.why for event in robot.told("program_stopped")]


def told(robot):
    """Return the ticks in which programs wrote a text."""
    return [event.tick for event in robot.told("text")]


def pose(dx=0.0, dy=0.0, dz=0.0):
    """Return a pose near the start, as text."""
    x, y, z, *turn = HERE
    return f"p{[x + dx, y + dy, z + dz, *turn]}"


def place(dx, dy, dz):
    """Return a position near the start [m]."""
    return np.array([HERE[0] + dx, HERE[1] + dy, HERE[2] + dz])


def test_movej_is_bit_equal_to_the_command_move_j():
    one, other = a_robot(shaper="zv"), a_robot(shaper="zv")
    run(one, f"movej({NEAR}, a=1.5, v=0.9)")
    other.send(c.MoveJ, q=tuple(NEAR), acceleration=1.5, velocity=0.9)
    other.tick(len(one.states))
    assert [state.target_q for state in one.states] == [state.target_q for state in other.states]


def test_movel_equals_the_command_move_l_after_a_fixed_delay():
    one, other = a_robot(), a_robot()
    run(one, f"movel({pose(dy=0.1)}, a=1.0, v=0.2)")
    x, y, z, *turn = HERE
    other.send(MoveL, pose=(x, y + 0.1, z, *turn), acceleration=1.0, velocity=0.2)
    other.tick(len(one.states))
    delay = one.told("motion_started")[0].tick - 1
    assert delay == 10
    moved = [state.target_q for state in one.states[delay:]]
    assert moved == [state.target_q for state in other.states[: len(moved)]]


def test_statements_after_a_move_run_when_the_shaped_reference_rests():
    robot = a_robot(shaper="zv")
    run(robot, f"movej({NEAR})", "textmsg(norm(get_target_joint_speeds()))")
    done = robot.told("motion_done")[0].tick
    told = robot.told("text")[0].tick
    assert told == done + 1
    assert float(said(robot)[0]) < 1e-4


def test_movej_to_a_pose_uses_the_nearest_joint_positions(robot):
    run(robot, f"movej({pose(dz=0.05)})")
    np.testing.assert_allclose(places(robot)[-1], place(0, 0, 0.05), atol=1e-6)
    assert np.abs(np.array(robot.states[-1].reference_q) - URSIM).max() < 0.5


FORCE = "force_mode(p[0,0,0,0,0,0], {}, [0,0,1,0,0,0], {}, {})"


@pytest.mark.parametrize(("call", "why"), [
    ("movej(p[10,0,0,0,0,0])", "no joint positions reach the pose p[10, 0, 0, 0, 0, 0]"),
    ("movej([-123, 0, 0, 0, 0, 0])", "q[0] is -123 rad"),
    ("movej([0, 0, 0])", "q has 3 elements: it must have 6"),
    ('movej("there")', "q is"),
    ("movej([0, 0, 0, 0, 0, True])", "q[5] is True: it must be a number"),
    (f"movej({NEAR}, a=0)", "a is 0: it must be above 0"),
    (f"movej({NEAR}, r=-1)", "r is -1"),
    ("optimovej([0, -1, 0, 0, 0, 0], a=2)", "a is 2: it must be above 0 and at most 1"),
    ("movel(p[1e8, 0, 0, 0, 0, 0])", "pose[0] is 1e+08: it must be from -1000 to 1000"),
    ("movec(get_target_tcp_pose(), p[0, -1e8, 0, 0, 0, 0])", "pose_to[1] is -1e+08"),
    ("set_tcp(p[1e160, 0, 0, 0, 0, 0])", "tcp[0] is 1e+160: it must be from -10 to 10"),
    ("set_payload(99)", "at most 5 kg, the arm's rating"),
    ("set_payload(1e300)", "m is 1e+300: it must be from 0 to 100"),
    ("set_target_payload(1, [0, 0, 3])", "cog[2] is 3: it must be from -2 to 2"),
    ("set_target_payload(1, [0, 0, .05], [.001, .001, .0022, 0, 0, 0])", "the moments of inertia of a real body"),
    ("set_target_payload(1, [0, 0, .05], [1, 1, 1, 3, 0, 0])", "the moments of inertia of a real body"),
    ("set_gravity([0, 9.82, 0])", "stands upright"),
    ("get_inverse_kin(p[10,0,0,0,0,0])", "no joint positions reach"),
    ("get_actual_joint_positions_history(5000)", "steps is 5000"),
    ("read_input_integer_register(48)", "address is 48"),
    ("write_output_integer_register(0, 1.5)", "value is 1.5: it must be an integer"),
    ("set_digital_out(10, True)", "n is 10"),
    (FORCE.format([0, 0, 1, 0, 0, 0], 4, [1] * 6), "type is 4: it must be from 1 to 3"),
    (FORCE.format([0, 0, 2, 0, 0, 0], 2, [1] * 6), "selection_vector[2] is 2"),
    (FORCE.format([0, 0, 1, 0, 0, 0], 2, [1, 1, -1, 1, 1, 1]), "limits[2] is -1"),
    ("force_mode_set_damping(1.5)", "damping is 1.5: it must be from 0 to 1"),
    ("freedrive_mode([1, 1, 1])", "freeAxes has 3 elements"),
    ("tool_contact([0, 0, 1])", "direction has 3 elements"),
    ('socket_open("h", 70000)', "port is 70000"),
    ("socket_read_binary_integer(31)", "number is 31"),
    ("socket_send_int(2147483648)", "value is"),
    ("movej()", "movej needs a value for its parameter q"),
    ('rpc_factory("xmlrpc", "http://1.2.3.4")', "does not simulate remote procedure calls"),
    ("direct_torque([0, 0, 0, 0, 0, 0])", "does not simulate torque control"),
    ("set_tool_analog_input_domain(2, 0)", "port is 2: it must be from 0 to 1"),
    ("set_tool_output_mode(2)", "mode is 2: it must be from 0 to 1"),
    ("set_tool_communication(True, 9601, 0, 1, 1.5, 3.5)", "baud_rate is 9601: it must be one of 9600"),
    ("set_tool_communication(True, 9600, 0, 1, 0.5, 3.5)", "rx_idle_chars is 0.5: it must be from 1 to 40"),
    ('set_gp_boolean_input_action(128, "default")', "port is 128: it must be from 0 to 127"),
    ('set_standard_digital_input_action(0, "stop")', 'action is stop: it must be "default" or "freedrive"'),
    ("jerk_gain_scaling_set(0)", "gain is 0: it must be from 0.01 to 1"),
    ("set_base_acceleration([0.1, 0, 0])", "the simulated arm's base stands"),
    ("set_runstate_tool_digital_output_to_value(2, 1)", "outputId is 2: it must be from 0 to 1"),
    ("set_runstate_standard_digital_output_to_value(0, 6)", "whether the arm has power are not simulated"),
    ("time(2)", "mode is 2; this controller has no clock of the day"),
    ('modbus_add_signal("1.2.3.4", 255, 0, 0, "x", True)', "does not simulate Modbus"),
    ("x = struct(a=1)\nx.go(1)", "go: this controller does not simulate remote procedure calls and Ethernet/IP"),
])  # fmt: skip
def test_invalid_arguments_end_the_program_at_their_call(robot, call, why):
    run(robot, "textmsg(1)", call, "textmsg(2)")
    error = failure(robot)
    assert why in error.why
    assert (error.line, error.column, error.program) == (3 + call.count("\n"), 3, "prog")
    assert said(robot) == ["1"]
    assert all(state.reference_q == list(URSIM) for state in robot.states)


@pytest.mark.parametrize("target", ["p[10,0,0,0,0,0]", pose(dz=-0.8)])
def test_an_impossible_line_causes_a_protective_stop_that_can_be_unlocked(robot, target):
    run(robot, f"movel({target})", "textmsg(1)")
    assert robot.controller.programs.state == "PAUSED"
    assert robot.states[-1].safety_mode == 3
    assert failure(robot) is None
    assert robot.send(c.UnlockProtectiveStop) == Done()
    run(robot, f"movej({NEAR})")
    np.testing.assert_allclose(robot.states[-1].reference_q, NEAR, atol=1e-9)


def test_effects_between_blended_moves_happen_in_the_blend():
    robot, radius = a_robot(), 0.03
    run(robot, f"movel({pose(dy=0.12)}, a=0.8, v=0.2, r={radius})", "write_output_integer_register(0, 1)",
        'textmsg("corner")', f"movel({pose(dy=0.12, dz=0.12)}, a=0.8, v=0.2)", 'textmsg("end")')  # fmt: skip
    assert robot.kinds().count("motion_started") == 1
    away = np.linalg.norm(places(robot) - place(0, 0.12, 0), axis=1)
    assert 1e-4 < away.min() < radius
    corner, end = told(robot)
    assert away[corner - 1] == pytest.approx(radius, abs=1.5e-3)
    assert end == robot.told("motion_done")[0].tick + 1


def test_the_end_of_a_servoj_thread_stops_the_arm(robot):
    aim = [angle + 0.05 for angle in URSIM]
    servo = f"while True:\n servoj({aim}, t=0.002, lookahead_time=0.03, gain=1200)\n end"
    start(robot, f"thread servo():\n {servo}\n end", "handle = run servo()", "sleep(1)", "kill handle", "sleep(1)",
          "textmsg(norm(get_target_joint_speeds()))")  # fmt: skip
    robot.tick(500)
    np.testing.assert_allclose(robot.states[-1].reference_q, aim, atol=1e-3)
    finish(robot)
    assert float(said(robot)[0]) == 0.0
    assert failure(robot) is None


def test_stopj_stops_the_move_of_a_killed_thread(robot):
    run(robot, f"thread go():\n movej({[URSIM[0] + 1.0, *URSIM[1:]]}, a=2, v=1)\n end", "handle = run go()",
        "sleep(0.4)", "kill handle", "stopj(1.0)", "textmsg(norm(get_target_joint_speeds()))")  # fmt: skip
    assert float(said(robot)[0]) < 1e-6
    assert failure(robot) is None
    slowest = np.diff(robot.column("target_qd")[:, 0]).min() / 0.002
    assert -1.6 < slowest < -0.9


def test_two_threads_cannot_move_the_arm_at_once(robot):
    run(robot, f"thread go():\n movej({NEAR})\n end", "run go()", "sleep(0.1)", f"movej({list(URSIM)})")
    assert "another thread is controlling the robot" in failure(robot).why
    assert robot.until_rest()


def test_speedj_returns_after_its_time_and_keeps_the_speed(robot):
    run(robot, "speedj([0.1, 0, 0, 0, 0, 0], 1, 0.3)", "textmsg(get_target_joint_speeds()[0])", "sleep(0.2)")
    assert float(said(robot)[0]) == pytest.approx(0.1, abs=1e-6)
    assert told(robot) == [151]
    assert robot.column("target_qd")[200:240, 0] == pytest.approx(0.1, abs=1e-9)
    robot.until_rest()


def test_written_registers_are_published_in_the_same_tick(robot):
    start(robot, "sleep(0.01)", "write_output_float_register(3, 1.5)", "sleep(1)")
    told = []
    for _ in range(20):
        robot.controller.begin_tick()
        io = robot.controller.changed_io()
        told += [] if io is None else [(io.tick, io.output_double_register[3])]
        state, _ = robot.controller.complete_tick()
        assert not told or told[-1][0] <= state.tick
    assert told[-1] == (6, 1.5)


def test_a_program_reads_registers_written_by_a_client(robot):
    start(robot, "while read_input_integer_register(24) == 0:", "  sync()", "end",
          "textmsg(read_input_float_register(47))", "textmsg(read_input_boolean_register(64))")  # fmt: skip
    robot.tick(50)
    assert said(robot) == []
    for bank, first, value in (("input_double", 47, 2.5), ("input_bit", 64, True), ("input_int", 24, 7)):
        assert robot.send(SetRegisters, bank=bank, first=first, values=(value,)) == Done()
    assert said(finish(robot)) == ["2.5", "True"]


def test_outputs_can_be_read_back(robot):
    run(robot, "set_standard_digital_out(3, True)", "set_tool_digital_out(1, True)", "digital_out[0] = True",
        "set_analog_outputdomain(1, 1)", "set_standard_analog_out(1, 0.25)", "set_tool_voltage(24)",
        "textmsg(get_standard_digital_out(3))", "textmsg(get_standard_analog_out(1))")  # fmt: skip
    io = robot.controller.io()
    assert io.actual_digital_output_bits == 1 << 3 | 1 << 17 | 1
    assert io.standard_analog_output[1] == 2.5
    assert io.tool_output_voltage == 24
    assert said(robot) == ["True", "0.25"]


def test_a_blocking_popup_waits_until_it_is_closed(robot):
    start(robot, 'popup("look", title="T", warning=True, blocking=True)', "textmsg(1)")
    robot.tick(100)
    (shown,) = robot.told("popup")
    assert (shown.why, shown.title, shown.level) == ("look", "T", "warning")
    assert said(robot) == []
    assert robot.controller.receive(ProgramClosePopup()) == Done()
    assert said(finish(robot)) == ["1"]


@pytest.mark.parametrize(("action", "state"), [("pause", "PAUSED"), ("stop", "STOPPED")])
def test_a_watchdog_pauses_or_stops_the_program_without_register_writes(action, state):
    robot, watchdog = a_robot(), f'rtde_set_watchdog("input_int_register_0", 10.0, "{action}")'
    start(robot, watchdog, "speedj([0.1,0,0,0,0,0], 1, 9)")
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
def test_the_published_payload_changes_within_the_transition_time(seconds):
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


def test_secondary_programs_run_beside_the_main_one_without_moves(robot):
    start(robot, "sleep(0.1)", "textmsg(2)")
    robot.tick(2)
    text = "sec extra():\n  set_standard_digital_out(0, True)\n  textmsg(1)\nend\n"
    assert robot.send(ProgramRun, text=text) == Done()
    assert said(finish(robot)) == ["1", "2"]
    assert robot.controller.io().actual_digital_output_bits == 1
    refused = robot.send(ProgramRun, text=f"sec extra():\n  movej({NEAR})\nend\n")
    assert refused.code == "script_error"


@pytest.mark.parametrize(("main", "extra"), [("halt", "sync()"), ("sync()", "halt")])
def test_halt_ends_all_programs_and_the_motion(robot, main, extra):
    start(robot, "speedj([0.5,0,0,0,0,0], 2, 0.1)", "sleep(0.1)", "while True:", main, "end")
    robot.tick(2)
    counts = "n = n + 1\n    write_output_integer_register(3, n)\n    sync()"
    text = f"sec extra():\n  n = 0\n  sleep(0.05)\n  {extra}\n  while True:\n    {counts}\n  end\nend\n"
    assert robot.send(ProgramRun, text=text) == Done()
    finish(robot)
    last = robot.controller.peripherals.read("output_int", 3)
    robot.tick(20)
    assert robot.controller.peripherals.read("output_int", 3) == last


@pytest.mark.parametrize(
    "move",
    [
        f"movej({NEAR})",
        f"servoj({NEAR}, t=0.2)",
        f"servoc({pose(dy=0.1)}, a=1.0, v=0.1)",
        "speedj([0.1, 0, 0, 0, 0, 0], 1, 0.2)",
        "speedl([0, 0.1, 0, 0, 0, 0], 1, 0.2)",
    ],
)
def test_a_new_program_replaces_the_running_one_and_waits_for_rest(robot, move):
    start(robot, "speedj([0.5,0,0,0,0,0], 2, 9)", name="one")
    robot.tick(300)
    start(robot, move, "textmsg(1)", name="two")
    finish(robot)
    assert failure(robot) is None
    assert said(robot) == ["1"]
    if move.startswith("movej"):
        np.testing.assert_allclose(robot.states[-1].reference_q, NEAR, atol=1e-9)
    kinds = [(event.kind, event.program) for event in robot.events if event.kind.startswith("program_")]
    assert kinds == [(f"program_{what}", name) for name in ("one", "two") for what in ("started", "stopped")]
    assert (np.abs(np.diff(robot.column("target_qd"), axis=0)) / 0.002).max() < 40.0


def test_the_speed_slider_stretches_speedj_but_not_sleep(robot):
    robot.send(c.SetSpeed, fraction=0.5)
    run(robot, "speedj([0.1,0,0,0,0,0], 1.0, 0.2)", "textmsg(1)", "sleep(0.2)", "textmsg(2)", "stopj(5)")
    first, second = told(robot)
    assert first == pytest.approx(201, abs=2)
    assert second - first == 100


def test_the_end_of_a_program_has_a_reason_unless_it_finished(robot):
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


def test_servoj_to_the_present_position_starts_no_motion():
    """Clients that hold a posture repeat it 500 times a second."""
    robot = run(a_robot(), "q = get_target_joint_positions()", *["servoj(q)"] * 50)
    assert robot.kinds().count("motion_started") == 0
    there = f"if get_target_joint_positions() == {NEAR}:\n halt\n end"
    moved = run(a_robot(), f"while True:\n servoj({NEAR})\n {there}\n end")
    assert moved.kinds().count("motion_started") == 1


@pytest.mark.parametrize(("zz", "found"), [("0.00205", [0.00105, 0.00105, 0.0021]), ("0.002", None)])
def test_a_rounded_inertia_is_corrected_with_a_warning(zz, found):
    robot = run(a_robot(), f"set_target_payload(1.0, [0, 0, 0.05], [0.001, 0.001, {zz}, 0, 0, 0])")
    assert failure(robot) is None
    kept = robot.controller.declared.inertia
    assert [kept[0], kept[3], kept[5]] == pytest.approx(found or [0.001, 0.001, 0.002], abs=1e-9)
    warnings = robot.warnings()
    assert [zz in why and "5e-05" in why for why in warnings] == [True] * bool(found)


UP = "movel(pose_trans(get_target_tcp_pose(), p[0, 0, -{way}, 0, 0, 0]), {how})"
TWIST = "movel(pose_trans(get_target_tcp_pose(), p[0, 0, 0, 0, 0, 2]), a=5, v=1)"
TURN = "movej([-1.6, -1.727, -2.203, -0.808, 1.595, {to}], {how})"
ARC = (
    "movec(pose_trans(get_target_tcp_pose(), p[0.05, 0, 0.05, 0, 0, 0]), "
    "pose_trans(get_target_tcp_pose(), p[0.1, 0, 0, 0, 0, 0]), {how})"
)


def warned(line, **changes):
    robot = run(a_robot(**changes), line)
    return [(event.code, event.why) for event in robot.told("warning")]


@pytest.mark.parametrize(
    "line",
    [
        UP.format(way=0.15, how="a=1.2, v=0.25"),
        UP.format(way=0.055, how="a=1.2, v=0.25"),  # just long enough
        UP.format(way=0.03, how="a=1.2, v=0.25"),  # a triangle
        UP.format(way=0.1, how="t=1"),
        ARC.format(how="a=1.2, v=0.25"),
        TURN.format(to=0.5, how="a=1.4, v=1.05"),
        TURN.format(to=0.2, how="v=9, t=0.5"),  # the speed does not count
    ],
)
def test_reached_or_short_moves_cause_no_limit_warning(line):
    assert warned(line) == []


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        (UP.format(way=0.15, how="a=30, v=9"), "limit_acceleration", ["velocity is 0.", "of 9 m/s", "jerk"]),
        (UP.format(way=0.02, how="a=30, v=9"), "limit_acceleration", ["velocity is 0.", "of 9 m/s", "jerk"]),
        (UP.format(way=0.3, how="a=30, v=2"), "limit_acceleration", ["velocity is 0.", "of 2 m/s", "jerk"]),
        (TWIST, "limit_velocity", ["of 1 m/s", "joint wrist_3", "3.142 rad/s"]),
        (UP.format(way=0.1, how="t=0.05"), "limit_acceleration", ["duration is 0.", "instead of 0.05"]),
        (ARC.format(how="a=30, v=2"), "limit_acceleration", ["velocity is 0.", "of 2 m/s"]),
        (TURN.format(to=0.5, how="a=40, v=3"), "limit_acceleration", ["of 3 rad/s", "jerk", "100 rad/s³"]),
        (TURN.format(to=2.5, how="a=40, v=9"), "limit_velocity", ["v of movej is 9 rad/s", "at most 3.142"]),
        (TURN.format(to=0.5, how="t=0.1"), "limit_acceleration", ["duration is 0.", "instead of 0.1"]),
    ],
)
def test_a_lowered_speed_is_reported_with_both_values(line, code, words):
    ((found, why),) = warned(line)
    assert found == code
    assert all(word in why for word in words), why


LINE = f"movel({pose(dy=0.1)}, a=1.0, v=0.2)"


@pytest.mark.parametrize("ticks", [1, 5, 9])
def test_a_client_may_move_the_arm_while_a_line_is_planned(robot, ticks):
    """The program stops the client's motion first, as it does if one continues when a move is called."""
    start(robot, LINE, "textmsg(1)")
    robot.tick(ticks)
    moved = robot.send(c.MoveJ, q=tuple(NEAR))
    assert isinstance(moved, Accepted)
    assert said(finish(robot)) == ["1"]
    assert failure(robot) is None
    ended = [(event.kind, event.id) for event in robot.events if event.id is not None]
    assert ended == [("motion_started", 1), ("motion_stopped", 1), ("motion_started", 2), ("motion_done", 2)]
    np.testing.assert_allclose(places(robot)[-1], place(0, 0.1, 0), atol=1e-6)


def test_a_resumed_servoc_can_be_paused_again(robot):
    start(robot, f"servoc({pose(dy=0.1)}, a=1.0, v=0.05)", "textmsg(1)")
    robot.tick(200)
    assert robot.send(ProgramPause) == Done()
    robot.until_rest()
    assert robot.send(ProgramPlay) == Done()
    robot.tick(50)
    assert playing(robot)
    assert not robot.controller.cycle.mode.at_rest
    assert robot.send(ProgramPause) == Done()
    robot.tick(100)
    assert robot.controller.cycle.mode.at_rest
    assert robot.send(ProgramPlay) == Done()
    assert said(finish(robot)) == ["1"]


@pytest.mark.parametrize("move", [f"movej({NEAR})", LINE, "speedj([0.1, 0, 0, 0, 0, 0], 1, 0.2)", "sync()"])
def test_protective_stop_pauses_the_program_at_the_next_waiting_statement(robot, move):
    """Also at a move in the same tick, which is carried out after the program is played again."""
    start(robot, "protective_stop()", move, "textmsg(1)")
    robot.tick(20)
    assert robot.controller.programs.state == "PAUSED"
    assert failure(robot) is None
    assert robot.send(c.UnlockProtectiveStop) == Done()
    assert robot.controller.programs.state == "PAUSED"
    assert robot.send(ProgramPlay) == Done()
    assert said(finish(robot)) == ["1"]
    assert ("motion_started" in robot.kinds()) == (move != "sync()")


BUSY = "thread guide():", "  while True:", "    speedj([0.2, 0, 0, 0, 0, 0], 4, 0.002)", "{}", "  end", "end"


def guiding(work):
    """Return a robot guided by a thread that computes for a while after each command."""
    robot = a_robot()
    text = script(*BUSY, "handle = run guide()", "while True:", "  sync()", "end").format(work)
    robot.send(ProgramRun, text=text)
    return robot


def test_a_thread_that_misses_turns_is_reported_once():
    robot = guiding("    i = 0\n    while i < 1100:\n      i = i + 1\n    end")
    robot.tick(200)
    (warning,) = robot.warnings()
    assert warning.startswith("guide, line ")
    assert f"had no turn within the {EVALUATIONS} evaluations" in warning
    assert robot.states[-1].target_qd[0] == pytest.approx(0.2)


def test_the_arm_slows_down_while_its_guiding_thread_computes():
    robot = guiding("    i = 0\n    while i < 200000:\n      i = i + 1\n    end")
    speeds = []
    for _ in range(1000):
        robot.tick()
        speeds.append(robot.states[-1].target_qd[0])
    first = next(k for k, speed in enumerate(speeds) if speed > 0.0)
    assert max(speeds) < 0.1  # it slowed down before it reached 0.2
    assert sum(speed == 0.0 for speed in speeds[first:]) > 500
    assert sum(a == 0.0 < b for a, b in pairwise(speeds)) >= 2
    assert any("slows down" in why for why in robot.warnings())


STOPS = "thread t():\n protective_stop()\n end"
LAST = {
    "the last statement": ["protective_stop()"],
    "before halt": ["protective_stop()", "halt"],
    "in a branch": ["if True:", "  protective_stop()", "else:", "  sync()", "end"],
    "in a function": ["def f():", "  protective_stop()", "end", "f()"],
    "in a thread of a thread": [STOPS, "thread u():\n t = run t()\n join t\n end", "u = run u()", "join u"],
    "during a motion": ["speedj([0.1, 0, 0, 0, 0, 0], 1, 0.1)", "protective_stop()"],
}


@pytest.mark.parametrize("lines", LAST.values(), ids=LAST)
def test_a_final_protective_stop_ends_the_program(robot, lines):
    start(robot, *lines)
    finish(robot)
    assert robot.controller.programs.state == "STOPPED"
    assert {"protective_stop", "program_stopped"} <= set(robot.kinds())


@pytest.mark.parametrize("follows", ["x = 1", 'popup("a", blocking=True)', "sync()"])
def test_a_protective_stop_followed_by_statements_pauses_the_program(follows):
    for lines in (("protective_stop()", follows), (STOPS, "handle = run t()", "join handle", follows)):
        robot = a_robot()
        start(robot, *lines)
        finish(robot)
        assert (robot.controller.programs.state, said(robot)) == ("PAUSED", [])

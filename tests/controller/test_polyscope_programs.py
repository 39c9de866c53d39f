"""Programs as PolyScope exports them: set-up, functions that are not simulated, run states."""

from pathlib import Path

import pytest

from tvist_controller.instruments.snapshot import Instruments
from tvist_controller.programs.compiling import check_program
from tvist_controller.programs.functions.unsimulated import SUBJECTS
from tvist_controller.programs.library import known_signatures
from tvist_controller.programs.table import page
from tvist_protocol.programs import ProgramPause, ProgramPlay
from tvist_protocol.replies import Done
from tvist_urscript import METHOD

from .robots import UR5E
from .scripts import URSIM, a_robot, failure, finish, playing, run, said, script, start

PREAMBLE = """
set_standard_analog_input_domain(0, 1)
set_tool_analog_input_domain(0, 0)
set_tool_analog_input_domain(1, 1)
set_analog_outputdomain(0, 0)
set_input_actions_to_default()
set_standard_digital_input_action(7, "default")
set_configurable_digital_input_action(7, "default")
set_tool_digital_input_action(1, "default")
set_gp_boolean_input_action(127, "default")
set_tool_communication(False, 115200, 0, 1, 1.5, 3.5)
set_tool_output_mode(1)
set_tool_digital_output_mode(0, 2)
set_tool_digital_output_mode(1, 3)
set_tool_voltage(24)
set_gravity([0.0, 0.0, 9.82])
set_base_acceleration([0, 0, 0])
set_safety_mode_transition_hardness(1)
position_deviation_warning(False)
reset_revolution_counter(qNear=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
motion_version_set(1)
jerk_gain_scaling_set(0.5)
high_holding_torque_enable()
high_holding_torque_disable()
global Plane_1 = p[0.1, 0.2, 0.3, 0.0, 0.0, 1.57]
""".strip().splitlines()


def test_a_polyscope_preamble_is_accepted_and_its_settings_show_in_rtde():
    robot = run(
        a_robot(),
        *PREAMBLE,
        '$ 1 "Robot Program"',
        "textmsg([get_gravity(), get_base_acceleration(), get_tool_current(), motion_version_get()])",
        'varmsg("Camera", [1, True])',
    )
    assert failure(robot) is None
    assert robot.warnings() == []
    assert said(robot) == ["[[0, 0, 9.82], [0, 0, 0], 0, 1]", "Camera = [1, True]"]
    snapshot = Instruments(UR5E).snapshot(robot.states[-1], robot.controller.io())
    assert (snapshot.tool_analog_input_types, snapshot.tool_output_mode) == (2, 1)
    assert (snapshot.tool_digital_output0_mode, snapshot.tool_digital_output1_mode) == (2, 3)


@pytest.mark.parametrize(
    ("call", "why"),
    [
        ("set_tool_communication(True, 115200, 0, 1, 1.5, 3.5)", "no tool is connected"),
        ('set_tool_digital_input_action(1, "freedrive")', "tool digital input 1 has the action freedrive"),
        ("position_deviation_warning(True)", "does not warn of deviations"),
    ],
)
def test_settings_without_effect_cause_a_warning(call, why):
    robot = run(a_robot(), call)
    assert failure(robot) is None
    assert [why in one for one in robot.warnings()] == [True]


def test_time_is_robot_time_and_random_is_reproducible():
    apart = "textmsg(b.sec - a.sec + (b.nanosec - a.nanosec) / 1000000000)"
    robot = run(a_robot(), "a = time()", "sleep(1.5)", "b = time()", apart, "textmsg([random(), random()])")
    apart, first, second = said(run(robot, "textmsg([random(), random()])"))
    assert (apart, first == second) == ("1.5", True)
    one, other = map(float, first.strip("[]").split(","))
    assert 0.0 <= one < 1.0 > other >= 0.0
    assert one != other


def test_get_rtde_value_returns_the_values_of_clients():
    keys = (
        "target_q",
        "runtime_state",
        "output_int_register_7",
        "output_bit_register_64",
        "tcp_offset",
        "payload",
    )
    robot = run(a_robot(), "write_output_integer_register(7, -9)", "write_output_boolean_register(64, True)", "sync()",
                *(f'textmsg(get_rtde_value("{key}"))' for key in keys), 'get_rtde_value("_kept")')  # fmt: skip
    assert '"_kept"' in failure(robot).why
    q, *others = said(robot)
    assert [float(one) for one in q.strip("[]").split(", ")] == pytest.approx(URSIM, abs=1e-6)
    assert others == ["2", "-9", "True", "[0, 0, 0, 0, 0, 0]", "5"]


def outputs(robot):
    io = robot.controller.io()
    return [bool(io.actual_digital_output_bits >> bit & 1) for bit in (0, 1, 2, 11, 17)]


CHOICES = [
    "set_runstate_standard_digital_output_to_value(0, 1)",
    "set_runstate_standard_digital_output_to_value(1, 2)",
    "set_runstate_standard_digital_output_to_value(2, 3)",
    "set_runstate_configurable_digital_output_to_value(3, 4)",
    "set_runstate_tool_digital_output_to_value(1, 5)",
    "set_runstate_standard_analog_output_to_value(1, 3)",
    "set_runstate_gp_boolean_output_to_value(100, 3)",
    "set_standard_digital_out(0, True)",
    "set_configurable_digital_out(3, True)",
]


def test_runstate_outputs_show_running_paused_and_stopped_programs():
    robot = a_robot()
    assert start(robot, *CHOICES, "sleep(1)") == Done()
    robot.tick(3)
    assert outputs(robot) == [True, False, True, True, True]
    assert robot.controller.io().standard_analog_output[1] == 0.02
    assert robot.controller.io().output_bit_register[3] == 1 << 4
    robot.send(ProgramPause)
    assert outputs(robot) == [False, True, False, True, True]
    robot.send(ProgramPlay)
    assert outputs(robot) == [False, True, True, True, True]
    finish(robot)
    assert outputs(robot) == [False, True, False, True, True]
    assert robot.controller.io().standard_analog_output[1] == 0.004
    assert robot.controller.io().output_bit_register[3] == 0


@pytest.mark.parametrize("how", ["x = [][0]", "protective_stop()"])
def test_runstate_outputs_show_an_error_or_stop(how):
    assert outputs(run(a_robot(), *CHOICES, "sleep(0.01)", how)) == [False, True, False, False, False]


def test_powerdown_ends_the_program_and_cuts_power():
    robot = run(a_robot(), "powerdown()", "textmsg(1)")
    robot.tick(5)
    assert (said(robot), playing(robot)) == ([], False)
    assert robot.states[-1].robot_mode == 3


def test_unsimulated_functions_are_warnings_beside_errors():
    lines = "path_offset_enable()", "sleep(1)", "nope()", "end_freedrive_mode()", "path_offset_enable()"
    found = check_program(script(*lines))
    assert [(one.line, one.level) for one in found] == [(2, "warning"), (4, "error"), (6, "warning")]
    assert {one.column for one in found} == {3}
    assert found[0].text == "path_offset_enable: this controller does not simulate path offsets"


THREAD = ("thread job():", "x = {}", "sync()", "end", "t = run job()")


@pytest.mark.parametrize(
    ("before", "value", "warned"),
    [
        ("hold = 0.5", "2 * hold + hold", True),
        ("if True:\n hold = 0.5\nend", "[1, sin(hold)]", True),
        ("hold = [1, 2]", "hold[0]", True),
        ("global hold = 0.5", "hold", False),
        ("hold = 1\nglobal hold = 2", "hold", False),
        ("hold = 1", "1\nhold = 2\nx = hold", False),
    ],
)
def test_a_local_variable_used_in_a_thread_is_a_warning(before, value, warned):
    text = script(*before.split("\n"), *(line.format(value) for line in THREAD))
    warnings = [one for one in check_program(text) if "in the thread job" in one.text]
    assert [one.level for one in warnings] == ["warning"] * warned
    for one in warnings:
        assert text.split("\n")[one.line - 1][one.column - 1 :].startswith("hold")


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("def p():\nwhile True:\nsync()\nend\nsleep(1)\nend\n", [4]),
        ("# a\ndef p():\n  if True:\n    sync()\nend # if\n  sleep(1)\nend\n", [5]),
        ("def f():\n  sync()\nend\ndef p():\ndef g():\nend\nf()\nend\np()\n", [6]),
        ("def p():\n  while True:\n    sync()\n  end\nend_force_mode()\nend\n", []),
        ("def p():\r\n  sync()\r\nend\r\n", []),
    ],
)
def test_an_early_end_in_column_one_is_a_warning(text, lines):
    warnings = [one for one in check_program(text) if "in column 1" in one.text]
    assert [(one.line, one.column, one.level) for one in warnings] == [(line, 1, "warning") for line in lines]


def test_every_unsimulated_function_causes_a_warning():
    for name in SUBJECTS.keys() - {METHOD}:
        needed = ["0"] * known_signatures()[name].required
        (finding,) = check_program(script(f"{name}({', '.join(needed)})"))
        assert (finding.line, finding.level) == (2, "warning")
        assert finding.text.startswith(f"{name}: ")


def test_the_page_of_functions_is_up_to_date():
    reference = Path(__file__).parents[2] / "docs" / "reference" / "generated" / "urscript-functions.md"
    assert reference.read_text(encoding="utf-8") == page()

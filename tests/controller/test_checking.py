"""What is wrong with a program is found without running it: every place, with its line and column."""

from pathlib import Path

import pytest

from tvist_controller.programs.checking import check_program
from tvist_controller.programs.functions.unsimulated import SUBJECTS
from tvist_controller.programs.library import known_signatures
from tvist_controller.programs.table import page
from tvist_urscript import METHOD

from .scripts import script


def found(*lines):
    return [(one.line, one.column, one.level) for one in check_program(script(*lines))]


def test_a_program_that_can_run_has_nothing_wrong():
    assert check_program(script("movej([0, 0, 0, 0, 0, 0])", 'textmsg("done")')) == []


def test_every_error_is_found_in_the_order_of_the_text():
    assert found("movj(1)", "x = 1", "movej(y)", 'textmsg("a", b=3)') == [
        (2, 3, "error"), (4, 9, "error"), (5, 16, "error"),
    ]  # fmt: skip


def test_of_a_text_that_is_no_program_the_first_token_that_does_not_fit_is_found():
    (finding,) = check_program("def prog():\n  if x\nend\n")
    assert (finding.line, finding.level) == (2, "error")
    assert finding.text.startswith("syntax_error_on_line:2:")


def test_an_unknown_name_that_is_nearly_a_function_is_told_which():
    (finding,) = check_program(script("moveJ([0, 0, 0, 0, 0, 0])"))
    assert finding.text == "compile_error_name_not_found:moveJ: did you mean movej?"


def test_functions_that_are_not_simulated_are_warnings_beside_the_errors():
    assert found("path_offset_enable()", "sleep(1)", "nope()", "end_freedrive_mode()", "path_offset_enable()") == [
        (2, 3, "warning"), (4, 3, "error"), (6, 3, "warning"),
    ]  # fmt: skip
    (finding, *_) = check_program(script("path_offset_enable()"))
    assert finding.text == "path_offset_enable: this controller does not simulate path offsets"


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
def test_a_variable_that_a_robot_does_not_find_in_a_thread_is_a_warning(before, value, warned):
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
def test_an_end_in_column_one_before_that_of_the_program_is_a_warning(text, lines):
    warnings = [one for one in check_program(text) if "in column 1" in one.text]
    assert [(one.line, one.column, one.level) for one in warnings] == [(line, 1, "warning") for line in lines]


def test_every_function_that_is_not_simulated_is_warned_of():
    for name in SUBJECTS.keys() - {METHOD}:
        needed = [one.name for one in known_signatures()[name].parameters][
            : known_signatures()[name].required
        ]
        (finding,) = check_program(script(f"{name}({', '.join('0' for _ in needed)})"))
        assert (finding.line, finding.level) == (2, "warning")
        assert finding.text.startswith(f"{name}: ")


def test_the_page_of_the_functions_is_up_to_date():
    reference = Path(__file__).parents[2] / "docs" / "reference" / "urscript-functions.md"
    assert reference.read_text(encoding="utf-8") == page()


def test_a_function_of_the_programs_own_hides_one_that_is_not_simulated():
    assert found("def freedrive_mode():", "end", "freedrive_mode()") == []

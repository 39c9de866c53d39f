"""Errors and warnings that the checker finds, and limits of a script's size."""

import pytest
from tests.conformance.served import finished

from tvist_urscript import ScriptError, Signature, check, compile_script, parameters

KNOWN = {"textmsg": Signature(parameters("a", b=""))}


def places(text):
    return [(error.line, error.column, error.text) for error in check(text, KNOWN).errors]


def test_all_unknown_names_are_reported_in_text_order():
    assert places("def f():\n  x = b + a(c)\n  y(1)\nend") == [
        (2, 7, "compile_error_name_not_found:b:"),
        (2, 11, "compile_error_name_not_found:a:"),
        (2, 13, "compile_error_name_not_found:c:"),
        (3, 3, "compile_error_name_not_found:y:"),
    ]


def test_calls_that_cannot_work_are_warnings_beside_errors():
    known = KNOWN | {"rpc": Signature((), fails="no simulation")}
    text = "def f():\n  textmsg(1, 2, x)\n  rpc(y)\n  def g(a):\n  end\n  g(rpc())\n  g()\nend"
    errors, warnings = check(text, known)
    assert [(one.line, one.column) for one in errors] == [(2, 17), (3, 7)]
    assert [(one.line, one.column, one.text) for one in warnings] == [
        (2, 17, "textmsg takes at most 2 arguments, but 3 are given"),
        (3, 3, "rpc: no simulation"),
        (6, 5, "rpc: no simulation"),
        (7, 3, "g needs a value for its parameter a"),
    ]


def test_a_syntax_error_is_the_only_error():
    assert [place[:2] for place in places("x = = 1\ny = unknown\nz = = 2")] == [(1, 5)]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("x = 1\nx = " + "(" * 100 + "x" + ")" * 100, None),
        ("x = 1\nx = " + "(" * 101 + "x" + ")" * 101, "levels are nested"),
        ("x = " + "(" * 100, "ends before"),
        ("x = " + "[" * 10_000 + "]" * 10_000, "levels are nested"),
        ("x = 1\n" + "a" * 255 + " = 1", None),
        ("x = 1\n y = " + "a" * 256 + " + 1", "a name of 256 characters is too long"),
        ("x = 1\ndef f(" + ", ".join(f"a{k}" for k in range(255)) + "):\nend", None),
        ("x = 1\ndef f(" + ", ".join(f"a{k}" for k in range(256)) + "):\nend", "256 parameters of f are"),
        ("x = 1\n" + "def f():\nend\n" * 2_000, "2001 functions"),
        ("textmsg(1\n end\nend", "unexpected 'end'"),
        ("x = 1\nx = " + "not " * 1_100 + "x", "levels are nested"),
        ("x = 1\nx = " + "x + " * 1_100 + "x", "levels are nested"),
        ("x = 1\nx = " + "x or " * 1_001 + "x", "operations is too long"),
        ("x = [" + "1, " * 1_000 + "1]", "too long"),
        ("if True:\n" * 1_100 + "end\n" * 1_100, "levels are nested"),
        ("while True:\n" * 18 + "end\n" * 18, "loops are nested"),
        ("def f():\n" * 1_100, "ends before"),
        ("x = " + "9" * 10_000, "too large"),
        ('x = "' + "a" * 2_000 + '"', "too long"),
        ("x = 1\n" * 1_000, None),
        ("def g():\n def f():\n" + "x = 1\n" * 4_001 + " end\nend", "too many in one function"),
        ("x = 0\nif x == 1:\n" + "elif x == 2:\n" * 1_000 + "else:\ntextmsg(1)\nend", None),
        ("x = 0\ndef f():\n" + "x = x + x * x\n" * 1_500 + "end", None),
        ("x = 0\ndef f():\n" + "x = x + x * x\n" * 1_700 + "end", "10200 operations and names of f are"),
        ("x = 0\nif x:\n" + f"elif {' and '.join(['x'] * 90)}:\n" * 115 + "end", "too many in one function"),
        ("x = 0\n" + f"x = [{', '.join(['x * x'] * 400)}]\n" * 5, None),
        ("\0\1\2", "unexpected character"),
        ("é = 1", "unexpected character"),
    ],
    ids=range(28),
)
def test_sizes_and_nesting_are_limited(text, why):
    if why is None:
        compile_script(text, KNOWN)
        return
    with pytest.raises(ScriptError, match=why) as caught:
        compile_script(text, KNOWN)
    lines = text.split("\n")
    assert 1 <= caught.value.line <= len(lines)
    assert 1 <= caught.value.column <= len(lines[caught.value.line - 1]) + 1


def test_scripts_cannot_use_python_names():
    for name in ("print", "machine", "add", "SPENT", "__builtins__", "v_x", "depth"):
        assert places(f"x = {name}")[0][2] == f"compile_error_name_not_found:{name}:"


def test_a_program_without_def_is_named_after_its_first_word():
    for text, name, secondary in (
        ("def f():\nend", "f", False),
        ("sec g():\nend", "g", True),
        ("# a comment\n  textmsg(1)", "textmsg", False),
        ("x = 1", "x", False),
        ("(1)", "program", False),
    ):
        script = compile_script(text, KNOWN)
        assert (script.name, script.secondary, script.text) == (name, secondary, text)


@pytest.mark.parametrize(
    ("lines", "errors"),
    [
        ("  movej([0, 0, 0, 0, 0, 0])\n  x = sqrt(2)\n", []),  # movej may be the robot's
        (
            "  movej(q)\n  x = sqrt(1, 2)\n",
            [
                "2:9: compile_error_name_not_found:q:",
                "3:15: warning: sqrt takes at most 1 argument, but 2 are given",
            ],
        ),
    ],
)
def test_the_checker_prints_errors_with_their_positions(tmp_path, lines, errors):
    path = tmp_path / "a.script"
    path.write_text(f"def f():\n{lines}end\n")
    done = finished("-m", "tvist_urscript", path)
    said = [f"{path}:{error}" for error in errors]
    assert (done.returncode, done.stdout.splitlines(), done.stderr) == (len(errors) > 0, said, "")

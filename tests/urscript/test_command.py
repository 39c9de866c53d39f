"""`python -m tvist_urscript`: a script without a robot, from the command line."""

from tvist_urscript.__main__ import main


def test_what_a_script_says_gives_a_terminal_no_commands(tmp_path, capsys):
    path = tmp_path / "p.script"
    path.write_text('textmsg("\x1b]0;owned\x07 it is 21 °C")\n', encoding="utf-8")
    assert main([str(path)]) == 0
    assert (
        capsys.readouterr().out == "\N{REPLACEMENT CHARACTER}]0;owned\N{REPLACEMENT CHARACTER} it is 21 °C\n"
    )

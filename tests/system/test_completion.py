"""What `tvist completion` prints lets a shell complete commands, options and files."""

import shutil
import subprocess
import sys

import pytest

from tvist_cli.main import COMMANDS

pytestmark = pytest.mark.quick


@pytest.fixture(scope="module")
def script():
    """The script for a shell."""

    def script(shell):
        words = [sys.executable, "-m", "tvist_cli", "completion", shell]
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout

    return script


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        (("tvist", "che"), ["check-script", "check"]),
        (("tvist", "run", "--lo"), ["--lockstep"]),
        (("tvist", "run", "wave.script", "--input", "digital_input_1=1", "--prof"), ["--profile"]),
        (("tvist", "serve", "--no-f"), ["--no-floor"]),
        (("tvist", "completion", "f"), ["fish"]),
        (("tvist", "run", "wav"), ["wave.script"]),
        (("tvist", "check-script", "one.script", "wav"), ["wave.script"]),
    ],
    ids=lambda value: value[-1] if isinstance(value, tuple) else "",
)
def test_bash_completes(script, tmp_path, typed, completed):
    (tmp_path / "completion").write_text(script("bash"), encoding="utf-8")
    (tmp_path / "wave.script").touch()
    asks = 'source completion; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _tvist; printf "%s\\n" "${COMPREPLY[@]}"'
    ended = subprocess.run(
        ["bash", "-c", asks, "-", *typed], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert sorted(ended.stdout.split()) == sorted(completed)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_command_is_in_the_script(script, shell):
    text = script(shell)
    assert [name for name in COMMANDS if name not in text] == []

"""What `tvist completion` prints lets each shell complete commands, options, their values and files."""

import contextlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tvist_cli import offered
from tvist_cli.commands.completion import completion
from tvist_cli.main import COMMANDS, LOG

ASKING_ZSH = Path(__file__).with_name("completion")
PATHS = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
"""The shell asks the program for the names."""
CASES = {
    "tvist che": {"check"},
    "tvist log an": {"analyze"},
    "tvist run wave.script --input digital_input_1=1 --prof": {"--profile"},
    "tvist serve --no-f": {"--no-floor"},
    "tvist run wav": {"wave.script"},
    "tvist serve --robot ur5": {"ur5-light", "ur5e", "ur5e_stiction"},
}
"""Typed lines with what completes their last word."""
ASKED = {
    "tvist serve --shaper zvd": {"zvd", "zvdd", "zvddd"},
    "tvist move Q": {"Q1", "Q2", "Q3"},
    "tvist study moves --shapers zvd": {"zvd", "zvdd", "zvddd"},
}
"""The same for values that the shell asks the program for."""
OF_EACH_KIND = ("tvist log an", "tvist serve --no-f", "tvist run wav", "tvist serve --robot ur5")
VALUES = [
    (offered.SHAPERS, "zvd", {"zvd", "zvdd", "zvddd"}),
    (offered.SHAPERS, "ow", {"own.py"}),
    (offered.ROBOTS, "a", {"arm.toml"}),
    (offered.POSES, "Q", {"Q1", "Q2", "Q3"}),
    (offered.COMPARED, "zvd", {"zvd", "zvdd", "zvddd"}),
    (offered.PLANTS, "stri", {"stribeck"}),
    (offered.STUDIES, "ma", {"match"}),
    (offered.WORLDS, "ta", {"table"}),
    (offered.PROFILES, "re", {"real"}),
]
"""What completes a value of an option that is annotated so."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with files, and the script of each shell under the name that the shell expects."""
    folder = tmp_path_factory.mktemp("completed")
    for name in ("wave.script", "own.py", "arm.toml"):
        (folder / name).touch()
    for shell, file in {"bash": "bash-script", "zsh": "_tvist", "fish": "fish-script"}.items():
        with (folder / file).open("w", encoding="utf-8") as script, contextlib.redirect_stdout(script):
            completion(shell)
    shutil.copy(ASKING_ZSH / "capture.zsh", folder)
    return folder


def candidates(shell, folder, typed):
    """What a shell offers for the last word of a line."""
    if shutil.which(shell) is None:
        pytest.skip(f"there is no {shell}")
    match shell:
        case "bash":
            asks = (
                'source bash-script; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
                "function=$(complete -p tvist | sed 's/.*-F \\([^ ]*\\) .*/\\1/'); "
                '"$function"; printf "%s\\n" "${COMPREPLY[@]}"'
            )
            words = ["bash", "-c", asks, "-", *typed.split(" ")]
        case "fish":
            words = ["fish", "--no-config", "-c", 'source fish-script; complete -C "$argv"', typed]
        case "zsh":
            words = ["zsh", "-f", ASKING_ZSH / "ask.zsh", typed]
    ended = subprocess.run(
        words, capture_output=True, text=True, check=True, cwd=folder, timeout=300, env=PATHS
    )
    return {line.partition("\t")[0] for line in ended.stdout.splitlines() if line}


@pytest.mark.parametrize("typed", CASES)
def test_bash_completes_the_last_word(typed, folder):
    assert candidates("bash", folder, typed) == CASES[typed]


@pytest.mark.parametrize("typed", ASKED)
def test_bash_completes_values(typed, folder):
    assert candidates("bash", folder, typed) == ASKED[typed]


@pytest.mark.parametrize("typed", OF_EACH_KIND)
def test_zsh_completes_the_last_word(typed, folder):
    assert candidates("zsh", folder, typed) == CASES[typed]


@pytest.mark.parametrize("typed", OF_EACH_KIND)
def test_fish_completes_the_last_word(typed, folder):
    assert candidates("fish", folder, typed) == CASES[typed]


@pytest.mark.parametrize(("annotation", "typed", "wanted"), VALUES)
def test_completion_offers_the_valid_values_of_each_kind_of_option(
    annotation, typed, wanted, folder, monkeypatch
):
    monkeypatch.chdir(folder)
    names = annotation.completer(SimpleNamespace(incomplete=typed))
    assert {name for name in names if name.startswith(typed)} == wanted


@pytest.mark.parametrize("file", ["bash-script", "_tvist", "fish-script"])
def test_the_completion_script_contains_every_command(folder, file):
    text = (folder / file).read_text(encoding="utf-8")
    assert [name for name in (*COMMANDS, *LOG) if name not in text] == []

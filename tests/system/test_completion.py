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
ASKED = {"tvist move Q": {"Q1", "Q2", "Q3"}, "tvist study moves --shapers zvd": {"zvd", "zvdd", "zvddd"}}
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
    """A folder with files, where `script` writes the script of each shell."""
    folder = tmp_path_factory.mktemp("completed")
    for name in ("wave.script", "own.py", "arm.toml"):
        (folder / name).touch()
    shutil.copy(ASKING_ZSH / "capture.zsh", folder)
    return folder


def script(shell, folder):
    """Return the script of a shell, under the name that the shell expects."""
    path = folder / {"bash": "bash-script", "zsh": "_tvist", "fish": "fish-script"}[shell]
    if not path.exists():
        with path.open("w", encoding="utf-8") as file, contextlib.redirect_stdout(file):
            completion(shell)
    return path


ASKING_BASH = """
source bash-script
function=$(complete -p tvist | sed 's/.*-F \\([^ ]*\\) .*/\\1/')
for typed in "$@"; do
  read -ra COMP_WORDS <<< "$typed"
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  "$function"
  printf '%s\\n' "$typed" "${COMPREPLY[@]}" ""
done
"""
"""Prints a paragraph for each of its lines: the line, and what bash offers for its last word."""


def shown(shell, folder, *words):
    if shutil.which(shell) is None:
        pytest.skip(f"there is no {shell}")
    script(shell, folder)
    how = {"text": True, "cwd": folder, "timeout": 300, "env": PATHS}
    return subprocess.run([shell, *words], capture_output=True, check=True, **how).stdout


def offered_by_bash(folder, cases):
    paragraphs = shown("bash", folder, "-c", ASKING_BASH, "-", *cases).split("\n\n")
    return {typed: set(found) for typed, *found in map(str.splitlines, filter(None, paragraphs))}


def test_bash_completes_the_last_word(folder):
    assert offered_by_bash(folder, CASES) == CASES


def test_bash_completes_values(folder):
    assert offered_by_bash(folder, ASKED) == ASKED


@pytest.mark.parametrize("typed", OF_EACH_KIND)
def test_zsh_completes_the_last_word(typed, folder):
    assert set(shown("zsh", folder, "-f", ASKING_ZSH / "ask.zsh", typed).splitlines()) == CASES[typed]


@pytest.mark.parametrize("typed", OF_EACH_KIND)
def test_fish_completes_the_last_word(typed, folder):
    asks = 'source fish-script; complete -C "$argv"'
    lines = shown("fish", folder, "--no-config", "-c", asks, typed).splitlines()
    assert {line.partition("\t")[0] for line in lines} == CASES[typed]


@pytest.mark.parametrize(("annotation", "typed", "wanted"), VALUES)
def test_completion_offers_the_values_of_each_kind_of_option(annotation, typed, wanted, folder, monkeypatch):
    monkeypatch.chdir(folder)
    names = annotation.completer(SimpleNamespace(incomplete=typed))
    assert {name for name in names if name.startswith(typed)} == wanted


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_script_contains_every_command(folder, shell):
    text = script(shell, folder).read_text(encoding="utf-8")
    assert [name for name in (*COMMANDS, *LOG) if name not in text] == []

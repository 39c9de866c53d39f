"""The tutorials, followed literally: their files are saved and their commands run in their order.

Also the examples of all commands.
"""

import contextlib
import io
import re
import shlex
import shutil
import signal
import sys

import pytest
from rich.console import Console
from tests import forked
from tests.conformance.served import Served, finished
from tests.docs.test_docs import DOCS, FENCE, ROOT, run
from tests.places import free_endpoint

from tvist_cli.main import GROUPS, OF_GROUPS, _overview, application, examples

EXAMPLES = examples()
COMPARED = (DOCS / "how-to" / "change-a-shaper.md").read_text("utf-8")
WAVE = ROOT / "clients" / "examples" / "wave.script"
SERVED = ("check", "move", "watch", "log record", "stop", "unlock", "forget", "view")
"""Commands whose examples need the robot of `serve`'s example."""
SILENT = ("log report", "log export", "log record")  # commands without output
SAVED = r"^Save this as `([\w.]+)`.*?^```\w+\n(.*?)^```$"


def tutorial(name):
    return (DOCS / "tutorials" / f"{name}.md").read_text("utf-8")


def blocks(text, kind):
    return [match["text"] for match in FENCE.finditer(text) if match["kind"] == kind]


def with_files(folder, text):
    """Write the files that readers save according to a page; return the folder."""
    for name, written in re.findall(SAVED, text, re.MULTILINE | re.DOTALL):
        (folder / name).write_text(written, encoding="utf-8")
    shutil.copy(WAVE, folder)
    return folder


def commands(text):
    """Yield the words and the documented exit code of each command of a page."""
    for line in "".join(blocks(text, "sh")).splitlines():
        program, *words = shlex.split(line, comments=True)
        assert program == "tvist"
        yield words, int(re.search(r"# exit code (\d)|$", line)[1] or 0)


@pytest.mark.realtime
@pytest.mark.nightly
@pytest.mark.parametrize("page", ["program-in-ci", "your-log", "your-shaper"])
def test_commands_of_a_tutorial_have_the_documented_output_and_files(page, tmp_path, monkeypatch):
    text, told, served = tutorial(page), "", None
    folder = with_files(tmp_path, text)
    monkeypatch.chdir(folder)
    with contextlib.ExitStack() as stack:
        for words, code in commands(text):
            at = words.index(">") if ">" in words else len(words)
            if words[0] == "serve":
                served = stack.enter_context(Served(*words[1:]))
                continue
            if words[0] == "log" and served is not None:
                assert served.end(signal.SIGINT) == 0
            where = ["--endpoint", served.endpoint] if words[0] == "move" else []
            ended = finished("-m", "tvist_cli", *words[:at], *where, cwd=folder)
            assert ended.returncode == code, ended.stdout + ended.stderr
            told += " ".join([*ended.stdout.split(), *ended.stderr.split(), ""])
            if words[at:]:
                (folder / words[-1]).write_text(ended.stdout, encoding="utf-8")
    for line in "".join(blocks(text, "text")[page == "program-in-ci" :]).splitlines():  # its first is a file
        assert line == "…" or " ".join(line.split()) in told
    pictures = re.findall(r"`(\w+/\w+\.png)`", text)
    assert pictures
    assert all((folder / name).exists() for name in pictures)


@pytest.mark.nightly
def test_comparison_of_shapers_has_the_documented_output(tmp_path):
    folder = with_files(tmp_path, tutorial("your-shaper"))
    (script,) = [text for text in blocks(COMPARED, "python") if "asyncio.run" in text]
    (folder / "compare.py").write_text(script, encoding="utf-8")
    assert run("-W", "error", "compare.py", cwd=folder) == blocks(COMPARED, "text")[0]


@pytest.mark.parametrize("command", EXAMPLES)
def test_help_has_an_example_in_80_columns_and_no_repeated_words(command):
    words, stream = command.split(), io.StringIO()
    application(words).help_print(words, console=Console(file=stream, width=80))
    told = stream.getvalue()
    assert f"Example: {EXAMPLES[command]}"[:80] in told
    assert EXAMPLES[command].split()[: len(words) + 1] == ["tvist", *words]
    assert max(map(len, told.splitlines())) <= 80
    assert not re.search(r"\[default: ?(\(\))?\]|\b([A-Z]+) --(?i:\2)\b", told)


def test_list_of_commands_fits_into_80_columns(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    application().help_print([])
    for told in (_overview(), capsys.readouterr().out):
        assert 60 < max(map(len, told.splitlines())) <= 80


def test_each_command_has_an_example():
    names = [name for group in GROUPS.values() for name in group if name != "log"]
    inside = [f"{name} {one}" for name, those in OF_GROUPS.items() for one in those]
    assert sorted(EXAMPLES) == sorted(names + inside)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with the files that examples read."""
    folder = with_files(tmp_path_factory.mktemp("examples"), "")
    # They are recorded here, because another processor's last bits may differ.
    for shaped, name in (("--shaper", "none", "--payload", "2"), "day.mcap"), ((), "first.mcap"):
        run = ("run", "wave.script", "--lockstep", *shaped, "--record", name)
        assert finished("-m", "tvist_cli", *run, cwd=folder).returncode == 0
    return folder


@pytest.fixture(scope="module")
def served(place):
    how = shlex.split(EXAMPLES["serve"].replace("first.mcap", str(place / "served.mcap")))[2:]
    with Served(*how) as robot:
        yield robot


def until(sign, *words, cwd):
    """Run a program until stderr has a word, then interrupt it."""
    with forked.Popen([sys.executable, "-m", "tvist_cli", *words], stderr=-1, text=True, cwd=cwd) as process:
        said = ""
        while sign not in said:
            line = process.stderr.readline()
            assert line, said
            said += line
        process.send_signal(signal.SIGINT)
        assert process.wait() in (0, 130)


@pytest.mark.realtime
@pytest.mark.nightly
@pytest.mark.parametrize("command", [name for name in EXAMPLES if name != "serve"])
def test_example_works(command, place, request):
    """A fixture runs the example of `serve`."""
    words = shlex.split(EXAMPLES[command])[1:]
    if command in SERVED:
        endpoint = request.getfixturevalue("served").endpoint
        words += [endpoint] if command in ("check", "watch", "unlock", "view") else ["--endpoint", endpoint]
    if command == "view":
        until("http://", *words, "--port", "0", cwd=place)
    elif command == "ros2":
        with Served("--ros2") as robot:
            until("is in ROS 2", *words, robot.endpoint, cwd=place)
    elif command == "router":
        until("listens", *words, "--listen", free_endpoint(), cwd=place)
    else:
        assert run("-m", "tvist_cli", *words, cwd=place) or command in SILENT

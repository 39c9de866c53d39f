"""The page that rehearses a real arm, followed literally: its files are saved, its commands run in their order."""

import re
import shlex
import signal
import time

import pytest
from tests.conformance.served import PATIENCE, Served, finished
from tests.docs.test_docs import DOCS, FENCE
from tests.places import free_endpoint, own_address
from tests.view.browser import Page

from tvist_client.blocking import Robot

pytestmark = [pytest.mark.realtime, pytest.mark.nightly]

PAGE = (DOCS / "how-to" / "rehearse-a-real-arm.md").read_text(encoding="utf-8")
ENDPOINTS = {"tcp/127.0.0.1:7447": free_endpoint(), "tcp/127.0.0.1:7448": free_endpoint()}
PLACES = {"127.0.0.10": own_address(71), "127.0.0.20": own_address(72), **ENDPOINTS}
ROBOT, ARM = ENDPOINTS.values()
ATTEMPTS = 20


def placed(text):
    """A text of the page with places of this process."""
    for said, here in PLACES.items():
        text = text.replace(said, here)
    return text


def taken(words, option, default):
    """Take an option and its value out of a command."""
    if option not in words:
        return default
    at = words.index(option)
    value = words[at + 1]
    del words[at : at + 2]
    return value


class Rehearsal:
    """Terminals of somebody who follows the page."""

    def __init__(self, folder):
        self.folder, self.served, self.moves = folder, {}, False
        for name, text in re.findall(r"ave this as `(\w+\.py)`.*?```python\n(.*?)```", PAGE, re.DOTALL):
            (folder / name).write_text(placed(text), encoding="utf-8")

    def serve(self, words):
        name, endpoint = taken(words, "--name", "ur5e"), taken(words, "--listen", ROBOT)
        if name in self.served:
            self.end(name)
        self.moves = "--enable-motion" in words
        words = [str(self.folder / word) if word.endswith(".mcap") else word for word in words]
        self.served[name] = Served(*words, name=name, endpoint=endpoint).__enter__()

    def end(self, name):
        self.served.pop(name).__exit__(None, None, None)

    def hold(self):
        """A machine under load loses the arm now and then, and the page says how it is had again."""
        for _ in range(ATTEMPTS):
            if self.tvist("check", ARM, "--name", "arm").returncode == 0:
                return
            self.tvist("unlock", "--power-on", ARM, "--name", "arm")
        raise AssertionError(self.served["arm"].said)

    def tvist(self, *words):
        return finished("-m", "tvist_cli", *words, cwd=self.folder)

    def do(self, line):
        program, *words = shlex.split(line, comments=True)
        code = int(re.search(r"# exit code (\d)|$", line)[1] or 0)
        if words[0] == "serve" and not code:
            self.serve(words[1:])
            return
        if words[0] == "view":
            with Page(*words[1:]):  # it comes up
                return
        if words[0] == "log":
            self.end("arm")
        moves = self.moves and "arm" in self.served
        run = self.python if program == "python" else self.tvist
        for _ in range(ATTEMPTS):
            if moves and words[0] in ("move", "check", "program.py") and not code:
                self.hold()
            ended = run(*words)
            if ended.returncode == code or not moves:
                break
        assert ended.returncode == code, f"{line}: {ended.stdout}{ended.stderr}"
        assert "Traceback" not in ended.stderr
        if words[0] == "pendant.py" and moves:
            self.served["arm"].wait_until_said("does not follow")

    def python(self, *words):
        return finished(*words, cwd=self.folder)


def test_every_command_of_the_page_does_what_it_says(tmp_path):
    pytest.importorskip("rtde_control")
    rehearsal = Rehearsal(tmp_path)
    commands = [
        line for match in FENCE.finditer(PAGE) if match["kind"] == "sh" for line in match["text"].splitlines()
    ]
    try:
        for line in commands:
            if line.startswith("python program.py"):
                freeze(rehearsal)
            rehearsal.do(placed(line))
        assert (tmp_path / "arm.html").stat().st_size > 0
    finally:
        for served in rehearsal.served.values():
            served.kill()


def freeze(rehearsal):
    """Control+Z, and later fg."""
    rehearsal.hold()
    arm = rehearsal.served["arm"]
    before = arm.said.count("does not follow")
    arm.process.send_signal(signal.SIGSTOP)
    with Robot.connect(ROBOT, "robot") as robot:
        robot.advance(100)
    arm.process.send_signal(signal.SIGCONT)
    deadline = time.monotonic() + PATIENCE
    with Robot.connect(ARM, "arm") as robot:
        while arm.said.count("does not follow") == before:
            assert time.monotonic() < deadline, arm.said
            robot.advance(10)

"""The reference page of the interfaces matches the code; test_realtime.py has the layout of the real-time package."""

import re
from pathlib import Path

from tvist_server.gateways.ur.dashboard import COMMANDS
from tvist_server.gateways.ur.primary.packages import robot_state

from .decoders import parts, split

PAGE = (Path(__file__).parents[3] / "docs/reference/ur-interfaces.md").read_text(encoding="utf-8")
LINES = [line.strip("|") for line in PAGE.splitlines() if line[:1] == "|"]
ROWS = [[cell.strip() for cell in line.split("|")] for line in LINES]


def test_every_dashboard_command_has_a_row():
    names = " ".join(row[0] for row in ROWS if len(row) == 3)
    for command in COMMANDS:
        rows = re.findall(rf"`{re.escape(command.keyword)}(?: [\w.]+)?`", names)
        assert 1 <= len(rows) <= 1 + (command.keyword == "load")  # of an installation, too


def test_the_documented_lengths_of_the_robot_state_are_right(snapshot, robot):
    ((_, body),) = split(robot_state(robot.description, snapshot))
    said = {row[0]: row[1] for row in ROWS if len(row) == 5 and row[0].isdecimal()}
    assert said == {str(number): str(5 + len(part)) for number, part in parts(body)}

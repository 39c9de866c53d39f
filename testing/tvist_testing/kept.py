"""What remains of a failed test: the recording and the log of each of its robots."""

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from tvist_testing.robots import ServedRobot

LONGEST_NAME = 120
"""Longest name of a test's folder [characters]."""
LOG_LINES = 10
"""Number of lines of the log that a report shows."""


@dataclass
class RobotOfTest:
    """A robot of a test, which may have ended.

    Attributes:
        served: The robot.
        recording: File that it records into, in a folder that goes with the test.
        log: File that it logs into, beside the recording.
        kept: Folder that both are moved to if the test fails.
        seed: Its seed.
    """

    served: ServedRobot
    recording: Path
    log: Path
    kept: Path
    seed: int

    def keep(self) -> None:
        """End the robot in order, and move its files to where they remain."""
        self.served.close()
        self.kept.mkdir(parents=True, exist_ok=True)
        for file in (self.recording, self.log):
            if file.exists():
                (self.kept / file.name).unlink(missing_ok=True)
                shutil.move(file, self.kept / file.name)

    def discard(self) -> None:
        """End the robot at once, and remove its files."""
        self.served.discard()
        for file in (self.recording, self.log):
            file.unlink(missing_ok=True)

    def properties(self) -> list[tuple[str, str]]:
        """Names and values for JUnit."""
        return [
            ("tvist_recording", str(self.kept / self.recording.name)),
            ("tvist_log", str(self.kept / self.log.name)),
            ("tvist_seed", str(self.seed)),
        ]

    def described(self) -> str:
        """Return what a report says about the robot of a failed test."""
        recording = self.kept / self.recording.name
        lines = [
            f"recording: {recording}",
            f"log:       {self.kept / self.log.name}",
            f"seed:      {self.seed}",
            f"next:      tvist log analyze {recording}; tvist log replay {recording}",
        ]
        try:
            told = self.log.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:
            told = []
        return "\n".join([*lines, *(["its log ends with:", *told[-LOG_LINES:]] if told else [])])


def folder_of(nodeid: str) -> str:
    """Return the name of the folder for a test, which says which test it is."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", nodeid).strip("-")[-LONGEST_NAME:]

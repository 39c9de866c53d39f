"""Make robots for a session of tests from their markers, and keep the files of failed tests."""

import itertools
import json
import re
import shutil
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tvist_protocol.errors import TvistError
from tvist_server.own_folder import OwnFolder
from tvist_testing.fixture_robot import FixtureRobot
from tvist_testing.markers import ROBOTS, MarkerError, WantedRobot, combined
from tvist_testing.robots import CannotServeError, RobotProcess, Robots

NAME = "ur5e"  # name of a single robot, for which clients look by default
MAX_ROBOTS = 100  # most robots of a test
LONGEST_NAME = 120  # longest name of a test's folder [characters]
LOG_LINES = 10  # lines of the log that a report shows


@dataclass
class RobotOfTest:
    """A robot of a test, which may have ended."""

    served: RobotProcess
    recording: Path  # in a folder that is removed after the test
    kept: Path  # folder to which recording and log are moved if the test fails
    seed: int

    @property
    def files(self) -> tuple[Path, Path]:
        """Recording and log."""
        return self.recording, self.recording.with_suffix(".log")

    def keep(self) -> None:
        """End the robot in order, and move its files to `kept`."""
        self.served.close()
        self.kept.mkdir(parents=True, exist_ok=True)
        for file in self.files:
            if file.exists():
                shutil.move(file, self.kept / file.name)

    def discard(self) -> None:
        """End the robot at once, and remove its files."""
        self.served.discard()
        for file in self.files:
            file.unlink(missing_ok=True)

    def properties(self) -> list[tuple[str, str]]:
        """Names and values for JUnit."""
        recording, log = (str(self.kept / file.name) for file in self.files)
        return [("tvist_recording", recording), ("tvist_log", log), ("tvist_seed", str(self.seed))]

    def described(self) -> str:
        """Return the section of a failed test's report about the robot."""
        (_, recording), (_, log), (_, seed) = self.properties()
        lines = [
            f"recording: {recording}",
            f"log:       {log}",
            f"seed:      {seed}",
            f"next:      tvist log analyze {recording}; tvist log replay {recording}",
        ]
        with suppress(OSError):
            told = self.files[1].read_text(encoding="utf-8", errors="replace").splitlines()
            if told:
                lines += ["its log ends with:", *told[-LOG_LINES:]]
        return "\n".join(lines)


class Serving:
    """Makes robots."""

    def __init__(self, kept: Path, seed: int) -> None:
        self._own = OwnFolder()
        self._kept = kept
        self._seed = seed
        self._robots = Robots()
        self._numbers = itertools.count()

    def close(self) -> None:
        """End the process that makes robots, and remove the files of robots whose tests were interrupted."""
        self._robots.close()
        self._own.close()

    def robots(self, request: pytest.FixtureRequest, count: int, before: int) -> list[FixtureRobot]:
        """Make several robots of a test."""
        if not isinstance(count, int) or not 1 <= count <= MAX_ROBOTS - before:
            why = f"tvist_robots has {count!r}: must be 1 to {MAX_ROBOTS - before} robots"
            pytest.fail(why, pytrace=False)
        numbers = range(before, before + count)
        return [self.robot(request, f"{NAME}-{number + 1}", number) for number in numbers]

    def robot(
        self, request: pytest.FixtureRequest, name: str = NAME, number: int = 0, *, ur: bool = False
    ) -> FixtureRobot:
        """Make a robot that ends with its test; fail the test with one line if that is impossible."""
        item: pytest.Item = request.node
        folder = self._own.path / str(next(self._numbers))
        folder.mkdir()
        recording = folder / f"{name}.mcap"
        try:
            part = combined(item)
            seed = part.pop("seed", self._seed) + number
            served = self._robots.serve(self._wanted(part, recording, seed, ur=ur))
            try:
                robot = FixtureRobot.of(served, name, seed, recording)
            except BaseException:
                served.kill()
                raise
        except (MarkerError, CannotServeError) as error:
            what = f"the robot of this test cannot be made: {error}"
            raise pytest.fail.Exception(what, pytrace=False) from None
        except TvistError as error:
            what = f"the robot of this test does not answer: {error}"
            raise pytest.fail.Exception(what, pytrace=False) from None
        request.addfinalizer(robot.close)
        kept = self._kept / re.sub(r"[^A-Za-z0-9_.-]+", "-", item.nodeid).strip("-")[-LONGEST_NAME:]
        item.stash.setdefault(ROBOTS, []).append(RobotOfTest(served, recording, kept, seed))
        return robot

    @staticmethod
    def _wanted(part: dict[str, Any], recording: Path, seed: int, *, ur: bool) -> WantedRobot:
        faults, program = part.pop("faults"), part.pop("program", None)
        fields = part.pop("fields", None)
        if fields is not None:
            state = recording.with_suffix(".json")
            try:
                state.write_text(json.dumps(fields, default=list), encoding="utf-8")
            except TypeError:
                raise MarkerError(f"tvist_state has {fields}: must be numbers, lists and texts") from None
            part["state"] = str(state)
        options = {
            **part,
            "name": recording.stem,
            "seed": seed,
            "clock": "realtime" if ur else "lockstep",
            "truth": True,
            "record": str(recording),
            "dump": str(recording.parent),
        }
        return WantedRobot(options, program, faults, ur, str(recording.with_suffix(".log")))

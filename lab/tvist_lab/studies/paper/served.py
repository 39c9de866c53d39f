"""Run the experiment on a served robot in real time, measure it in the robot's recording, and replay it."""

import asyncio
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tvist_lab.recordings.mcap_file import RecordingFile, read
from tvist_lab.replay import replay_file
from tvist_lab.served import served_robot
from tvist_lab.studies.paper.experiment import Experiment, Progress, experiment, judge
from tvist_lab.studies.paper.report import as_dict


@dataclass(frozen=True)
class ServedExperiment:
    """One run of the experiment on a served robot."""

    done: Experiment
    report: dict[str, Any]  # results of the experiment and of the checks, as plain values
    difference: str | None  # first difference between replay and recording; None if there is none

    @property
    def equal(self) -> bool:
        """Whether the replay gave equal states, and recording and live stream gave equal figures."""
        return self.difference is None and bool(self.report["recording_gives_same_figures"])


def serve(path: Path, seed: int, progress: Progress) -> ServedExperiment:
    """Serve a robot, run the experiment once, and replay the recording, which replaces an earlier one.

    Figures come from the server's own recording, which is complete even on a busy machine, and are compared
    with those from the received messages. Raises RuntimeError if the robot did not start or disconnected,
    NotMeasurableError or RecordingError if its recording is not usable.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    done = asyncio.run(_run(path, seed, progress))
    content = read(path)
    same, lost = _measure(done, content)
    again = replay_file(content)
    report = as_dict(done) | {
        "replayed_ticks": len(again.states),
        "replay_equal": again.first_difference is None,
        "recording_gives_same_figures": same,
        "states_lost_on_the_way": lost,
        "missed_ticks": content.states[-1].missed_ticks,
    }
    return ServedExperiment(done, report, again.first_difference)


async def _run(path: Path, seed: int, progress: Progress) -> Experiment:
    """Move the arm; return the experiment before measurement, with the client's recordings."""
    options = ["--record", str(path), "--truth", "--seed", str(seed)]
    async with served_robot(options) as (robot, _), robot.control("demo") as arm:
        return await experiment(
            robot, arm, runs=1, seed=seed, baselines=False, progress=progress, judged=False
        )


def _measure(done: Experiment, content: RecordingFile) -> tuple[bool, int]:
    """Measure each recorded motion; return whether live streams without loss agree, and states lost."""
    same, lost = True, 0
    for key, received in list(done.first.items()):
        ticks = received["tick"]
        cut = content.recording.between(int(ticks[0]), int(ticks[-1]))
        done.first[key], done.judged[key] = cut, [judge(cut)]
        missing = received.missing_ticks
        lost += missing
        if missing == 0 and np.isfinite(received["truth_tool_acceleration"]).all():
            same = same and judge(received).result == done.judged[key][0].result
    return same, lost

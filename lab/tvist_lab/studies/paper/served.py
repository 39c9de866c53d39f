"""The experiment on a served robot: in real time, measured by the robot's recording, and replayed."""

import asyncio
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tvist_lab.recordings import Recording
from tvist_lab.recordings.mcap_file import RecordingFile, read
from tvist_lab.replay import replay_file
from tvist_lab.served import served_robot
from tvist_lab.studies.paper.experiment import SHAPED, UNSHAPED, Experiment, Progress, judge, run, table_1
from tvist_lab.studies.paper.published import MOTIONS
from tvist_lab.studies.paper.report import as_dict


@dataclass(frozen=True)
class Served:
    """One run of the experiment on a served robot."""

    done: Experiment
    report: dict[str, Any]
    """Results as plain values, with those of the checks."""
    difference: str | None
    """Where the replay differs from the recording first; None if it does not."""

    @property
    def equal(self) -> bool:
        """Whether the replay gave equal states, and the recording the figures of the live stream."""
        return self.difference is None and bool(self.report["recording_gives_same_figures"])


def serve(path: Path, seed: int, progress: Progress) -> Served:
    """Serve a robot, run the experiment once, and replay the recording, which replaces an earlier one.

    The figures come from the server's own recording, which is complete however busy the machine is. The figures from
    the messages that this client received are compared with them.

    Raises:
        RuntimeError: The robot did not start or disconnected.
        NotMeasurableError: Its recording cannot be measured.
        RecordingError: Its recording cannot be read.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    done, live = asyncio.run(_run(path, seed, progress))
    content = read(path)
    same, lost = _measure(done, live, content)
    again = replay_file(content)
    report = as_dict(done) | {
        "replayed_ticks": len(again.states),
        "replay_equal": again.first_difference is None,
        "recording_gives_same_figures": same,
        "states_lost_on_the_way": lost,
        "missed_ticks": content.states[-1].missed_ticks,
    }
    return Served(done, report, again.first_difference)


async def _run(
    path: Path, seed: int, progress: Progress
) -> tuple[Experiment, dict[tuple[str, str], Recording]]:
    """Move the arm; return the experiment, not yet measured, and the client's own recording of each motion."""
    live = {}
    options = ["--record", str(path), "--truth", "--seed", str(seed)]
    async with served_robot(options) as (robot, _), robot.control("demo") as arm:
        table = await table_1(robot, arm)
        done = Experiment(info=await robot.info(), seed=seed, runs=1, table_1=table)
        for motion in MOTIONS:
            for method in (UNSHAPED, SHAPED):
                live[motion, method.name] = await run(robot, arm, motion, method, seed=1000 * seed)
                done.labels[method.name] = method.label
                progress(f"{motion} {method.name}")
    return done, live


def _measure(
    done: Experiment, live: dict[tuple[str, str], Recording], content: RecordingFile
) -> tuple[bool, int]:
    """Judge each motion by the recording; return whether the live stream, if it arrived completely, gives the same."""
    same, lost = True, 0
    for key, received in live.items():
        ticks = received["tick"]
        cut = content.recording.between(int(ticks[0]), int(ticks[-1]))
        done.first[key], done.judged[key] = cut, [judge(cut)]
        missing = received.missing_ticks
        lost += missing
        if missing == 0 and np.isfinite(received["truth_tool_acceleration"]).all():
            same = same and judge(received).result == done.judged[key][0].result
    return same, lost

"""The paper's three motions over the network in real time, recorded, analysed and replayed."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tvist_lab.figures import FigureFiles
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.paper_drawing import draw, overview
from tvist_lab.recordings import Recording, RecordingError
from tvist_lab.recordings.mcap_file import RecordingFile, read
from tvist_lab.replay import replay_file
from tvist_lab.served import served_robot
from tvist_lab.studies.paper.experiment import Experiment, judge, run, table_1
from tvist_lab.studies.paper.methods import SHAPED, UNSHAPED
from tvist_lab.studies.paper.published import MOTIONS
from tvist_lab.studies.paper.report import as_dict

ANSWERED = "Q1-Q3"
"""Motion of which the overview is drawn: on its way the arm's frequency doubles, and its vibration is seen to ring."""


class DemoError(RuntimeError):
    """The demonstration failed."""


@dataclass(frozen=True)
class Demo:
    """Result of the demonstration."""

    report: dict[str, Any]
    """Report of `tvist paper`, with the checks."""
    recording: Path
    overview: Path
    """Figure of one motion that shows the answer at a glance."""
    figures: list[Path]
    """The paper's figures."""
    difference: str | None
    """Where the replay differs from the recording first; None if it does not."""

    @property
    def equal(self) -> bool:
        """Whether the replay gave equal states, and the recording the figures of the live stream."""
        return self.difference is None and bool(self.report["recording_gives_same_figures"])


def run_demo(files: FigureFiles, seed: int, progress: Callable[[str], None]) -> Demo:
    """Run the demonstration.

    The figures come from the server's own recording, which is complete however busy the machine is. The figures from
    the messages that this client received are compared with them.

    Args:
        files: Folder for recording and figures, and how the latter are written; the recording of an earlier
            demonstration in it is replaced.
        seed: Seed of noise and gear errors.
        progress: Called after each motion.

    Raises:
        DemoError: The robot did not start or disconnected, or its recording cannot be measured.
    """
    files.folder.mkdir(parents=True, exist_ok=True)
    path = files.folder / "demo.mcap"
    path.unlink(missing_ok=True)
    try:
        done, live = asyncio.run(_run(path, seed, progress))
        content = read(path)
        same, lost = _measure(done, live, content)
    except (RuntimeError, NotMeasurableError, RecordingError) as error:
        raise DemoError(str(error)) from error
    again = replay_file(content)
    report = as_dict(done) | {
        "replayed_ticks": len(again.states),
        "replay_equal": again.first_difference is None,
        "recording_gives_same_figures": same,
        "states_lost_on_the_way": lost,
        "missed_ticks": content.states[-1].missed_ticks,
    }
    return Demo(
        report=report,
        recording=path,
        overview=files.write(overview(done, ANSWERED), "vibration-with-and-without-shaping"),
        figures=[files.write(figure, name) for name, figure in draw(done, all_figures=False).items()],
        difference=again.first_difference,
    )


async def _run(
    path: Path, seed: int, progress: Callable[[str], None]
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
        truth = received["truth_tool_acceleration"]
        complete = missing == 0 and bool(np.isfinite(truth).all())
        lost += missing
        if complete:
            same = same and judge(received).result == done.judged[key][0].result
    return same, lost

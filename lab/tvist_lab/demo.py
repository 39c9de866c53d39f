"""The paper's three motions over the network in real time, recorded, analysed and replayed."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tvist_lab.mcap_file import RecordingFile, read
from tvist_lab.metrics import motions
from tvist_lab.paper.drawing import draw
from tvist_lab.paper.experiment import Experiment, experiment, judge
from tvist_lab.paper.report import as_dict
from tvist_lab.replay import replay_file
from tvist_lab.served import served_robot


class DemoError(RuntimeError):
    """The demonstration did not run."""


@dataclass(frozen=True)
class Demo:
    """What came out."""

    report: dict[str, Any]
    """As of `tvist paper`, with the checks."""
    recording: Path
    figures: list[Path]
    equal: bool
    """The replay gave equal states and the recording equal figures."""
    verdict: str
    """The checks in words."""


def run_demo(folder: Path, seed: int, progress: Callable[[str], None]) -> Demo:
    """Run it.

    Args:
        folder: For recording and figures; an earlier demonstration's recording there is replaced.
        seed: Of noise and gear errors.
        progress: Told of each motion done.

    Raises:
        DemoError: The robot did not come up or went away.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "demo.mcap"
    path.unlink(missing_ok=True)
    try:
        done = asyncio.run(_run(path, seed, progress))
    except RuntimeError as error:
        raise DemoError(str(error)) from error
    content = read(path)
    again = replay_file(content)
    same_figures = _same_figures(done, content)
    report = as_dict(done)
    report["replayed_ticks"] = len(again.states)
    report["replay_equal"] = again.first_difference is None
    report["recording_gives_same_figures"] = same_figures
    report["missed_ticks"] = content.states[-1].missed_ticks
    verdict = (
        f"{len(again.states)} ticks in real time, {report['missed_ticks']} missed; the recorded commands, run again "
        + ("free of any clock, give every state to the last bit" if again.first_difference is None
           else f"free of any clock, differ: {again.first_difference}")
        + ("; the recording gives the same figures." if same_figures else "; the recording gives OTHER figures.")
    )  # fmt: skip
    return Demo(
        report=report,
        recording=path,
        figures=draw(done, folder, all_figures=False),
        equal=again.first_difference is None and same_figures,
        verdict=verdict,
    )


async def _run(path: Path, seed: int, progress: Callable[[str], None]) -> Experiment:
    options = ["--record", str(path), "--truth", "--seed", str(seed)]
    async with served_robot(options) as (robot, _), robot.control("demo") as arm:
        return await experiment(robot, arm, runs=1, seed=seed, baselines=False, progress=progress)


def _same_figures(done: Experiment, content: RecordingFile) -> bool:
    """Whether the recording, cut where the client's recordings begin and end, measures the same."""
    for key, live in done.first.items():
        ticks = live["tick"]
        cut = content.recording.between(int(ticks[0]), int(ticks[-1]))
        if len(motions(cut)) != 1 or judge(cut).result != done.judged[key][0].result:
            return False
    return True

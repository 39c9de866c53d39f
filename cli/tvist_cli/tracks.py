"""Converts recordings and simulated motions to tracks, which a page plays back."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tvist_cli.compiling import compile_if_new
from tvist_cli.failure import Failure, Misuse, failing_on
from tvist_cli.judging import judge
from tvist_cli.output import progress
from tvist_controller.about import geometry_of
from tvist_controller.refusal import RefusalError
from tvist_lab.in_process import run_beside
from tvist_lab.metrics import MeasuredRecording, pairs
from tvist_lab.recordings.mcap_file import RecordingFile, read_checked
from tvist_plant.description import DescriptionError, RobotDescription, load
from tvist_plant.plant import PERIOD
from tvist_protocol.content import checked
from tvist_protocol.values import Payload
from tvist_view import described
from tvist_view.look import Look
from tvist_view.playback import playback, said
from tvist_view.request_handler import MotionRecord
from tvist_view.track import Track

LEAD = 150  # ticks at rest shown before a motion
REST = 500  # ticks shown after a motion


@dataclass(frozen=True)
class Shows:
    """Tracks for a page to play back."""

    title: str
    tracks: list[Track]
    result: dict[str, Any] | None = None

    @property
    def lasts(self) -> float:
        """Duration [s]."""
        return max(track.end for track in self.tracks) - min(track.start for track in self.tracks)

    def page(self, factor: float) -> str:
        """Return the page that plays the tracks back."""
        return playback(self.tracks, self.title, factor=factor, result=self.result)


def recorded(file: Path) -> Shows:
    """Return the track of a recording."""
    with failing_on(ValueError):
        content = read_checked(file)
        return Shows(file.stem, [Track(file.stem, _look_of(content), content.states, content.truths)])


def repeated(file: Path) -> Shows:
    """Return the recorded pair of motions, without and with a shaper, whose times to rest differ most."""
    with failing_on(ValueError):
        content = read_checked(file)
        measured = MeasuredRecording.of(content.recording)
        found = [one for one in pairs(measured) if one.change.less_percent is not None]
        if not found:
            raise Failure(
                f"{file} contains no motion without and with a shaper: record one with none first, then with a shaper"
            )
        best = max(found, key=lambda one: (one.change.gain_ms or 0, one.change.less_percent))
        look, shaper = _look_of(content), best.shaper or "the shaper"
        ticks = content.recording["tick"]
        tracks = []
        for place, label in ((best.unshaped, "without"), (best.shaped, f"with {shaper}")):
            motion = measured.motions[place]
            before = slice(max(motion.start - LEAD, 0), motion.start + 1)
            way = np.abs(np.diff(content.recording["reference_q"][before], axis=0)).max(axis=1)
            set_elsewhere = np.flatnonzero(way > 0.0)  # the arm was put elsewhere, as by a reset
            first = int(ticks[before][set_elsewhere[-1] + 1 if len(set_elsewhere) else 0])
            last = min(int(ticks[motion.reference_stop]) + REST, int(ticks[motion.end - 1]))
            states = [state for state in content.states if first <= state.tick <= last]
            truths = [truth for truth in content.truths if first <= truth.tick <= last]
            begun = float(content.recording.time[motion.start]) - LEAD * PERIOD
            tracks.append(Track(label, look, states, truths, begun))
    return Shows(f"{file.stem}: {best.name}", tracks, said(best.change.as_dict(), shaper, best.name))


def compared(shapers: Sequence[str], robot: str) -> Shows:
    """Simulate the same motion with each shaper."""
    if not 2 <= len(shapers) <= 3:
        raise Misuse(f"compare has {len(shapers)} shapers: give two or three")
    compile_if_new()
    tracks, runs = [], []
    with (
        failing_on(DescriptionError, RefusalError, exit_code=2),
        progress(len(shapers), "runs") as advance,
    ):
        poses = load(robot).poses
        named = described.pairs(list(poses))
        if not named:
            raise Misuse(f"robot file {robot} names no two poses to move between: add poses to it")
        first, last = named[0]
        for shaper in shapers:
            info, collected = asyncio.run(run_beside(shaper, (poses[first], poses[last]), robot=robot))
            assert info.geometry is not None  # this process's server sends it
            label = "without" if shaper == "none" else f"with {shaper}" if "none" in shapers else shaper
            look = Look(info.geometry, info.payload)
            tracks.append(Track(label, look, collected.states, collected.truths))
            runs.append(MotionRecord(collected.states, collected.truths, collected.events))
            advance()
    result = None
    if len(shapers) == 2 and shapers[0] == "none":
        result = said(judge(*runs), shapers[1], f"{first} → {last}")
    return Shows(f"{' and '.join(shapers)}: {info.model}, {first} → {last}", tracks, result)


def _look_of(content: RecordingFile) -> Look:
    """Return how to draw a recording's robot: as recorded, or by the robot file that a server recorded."""
    info, start = content.info, content.start or {}
    if info is not None and info.geometry is not None:
        return Look(info.geometry, info.payload)
    if "description" in start:
        geometry = geometry_of(checked(start["description"], RobotDescription))
        nothing = Payload(mass=0.0, com=(0.0, 0.0, 0.0), inertia=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        return Look(geometry, nothing if info is None else info.payload)
    raise Failure(
        "the recording does not contain the shape of its robot: record it with tvist serve --record"
    )

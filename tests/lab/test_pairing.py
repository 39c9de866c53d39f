"""Motions of one recording are paired by what was commanded, and the verdict says what shaping changed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.lab.conftest import make_recording, ring, straight_step

from tvist_lab.metrics import MeasuredRecording, pairs
from tvist_lab.metrics.comparison import MotionChange
from tvist_lab.report.verdict import verdict_on_pairs

TICKS = 1500


def many(*made, named=True):
    """Build a recording of motions, each with its shaper, its delay in ticks, how long it takes, and how it rings."""
    parts, events = [], []
    for place, (shaper, late, ticks, amplitude) in enumerate(made):
        stop = 100 + ticks
        reference = straight_step(TICKS, 100, stop, 1.0)
        target = straight_step(TICKS, 101, stop + 1 + late, 1.0)
        position = np.zeros((TICKS, 3))
        position[:, 0] = np.interp(np.arange(TICKS), [100, stop + late + 30], [0.5, 0.0])
        parts.append((reference, target, position, ring(TICKS, stop + 1 + late, 10.0, 0.1, amplitude)))
        changed = f"{shaper} with estimator modal"
        events += [SimpleNamespace(tick=TICKS * place, kind="shaper_changed", why=changed, id=None)] * named
    reference, target, position, rung = (np.concatenate(part) for part in zip(*parts, strict=True))
    info = SimpleNamespace(poses={"Q1": [0.0] * 6, "Q2": [1.0, *[0.0] * 5]}, shaper="zv")
    recording = make_recording(
        reference, target, ticks=len(reference), position=position, alpha=rung, truth=rung, events=events,
    )  # fmt: skip
    return MeasuredRecording.of(replace(recording, info=info if named else None))


def test_shaped_motion_is_paired_with_the_unshaped_one_of_equal_path_and_speed():
    measured = many(("none", 0, 400, 1.0), ("zv", 37, 400, 0.1), ("zv", 37, 300, 0.1), ("ei", 60, 400, 0.5))
    found = pairs(measured)
    ways = [(one.unshaped, one.shaped, one.shaper, one.name) for one in found]
    assert ways == [(0, 1, "zv", "Q1 → Q2"), (0, 3, "ei", "Q1 → Q2")]
    assert found[0].change.less_percent == pytest.approx(90.0, abs=1.0)
    lead, ei, alone = verdict_on_pairs(found, measured.results, "x")
    assert lead.startswith("x: 90 % less vibration after the stop with zv than without a shaper, at rest ")
    assert lead.endswith("for a motion that is 74 ms longer (1 motion).")
    assert "50 % less vibration after the stop with ei" in ei
    assert alone == "Made only with or only without a shaper: 1 motion of x."


def test_repeated_motions_are_paired_in_order():
    measured = many(
        ("none", 0, 400, 1.0), ("zv", 37, 400, 0.1), ("none", 0, 400, 1.0), ("zv", 37, 400, 0.05), ("zv", 37, 400, 0.1)
    )  # fmt: skip
    assert [(one.unshaped, one.shaped) for one in pairs(measured)] == [(0, 1), (2, 3)]
    lead, each, _ = verdict_on_pairs(pairs(measured), measured.results, "x")
    assert lead.startswith("x: 90 % to 95 % less vibration")
    assert "(2 motions)" in lead
    assert each.startswith("Q1 → Q2: 90 % less, came to rest")


def test_delay_identifies_shaping_without_events():
    measured = many(("", 0, 400, 1.0), ("", 37, 400, 0.1), named=False)
    (one,) = pairs(measured)
    assert (one.shaper, one.name) == ("", "motions 1 and 2")
    assert pairs(many(("", 0, 400, 1.0), ("", 0, 400, 1.0), named=False)) == []


def test_motions_without_vibration_or_with_more_are_reported():
    worse = many(("none", 0, 400, 0.2), ("zv", 37, 400, 0.3))
    assert "50 % more vibration" in verdict_on_pairs(pairs(worse), worse.results, "x")[0]
    quiet = many(("none", 0, 400, 0.1), ("zv", 37, 400, 0.02))
    assert "though neither is noticeable" in verdict_on_pairs(pairs(quiet), quiet.results, "x")[0]
    unknown = replace(pairs(quiet)[0], change=MotionChange(None, 0.1, None, 5.0))
    assert "could not be measured" in verdict_on_pairs([unknown], quiet.results, "x")[0]

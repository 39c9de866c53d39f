"""A real UR5 that rings: seven stops of a published recording, see `data/NOTICE`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tvist_lab.advice import advise
from tvist_lab.metrics import MeasuredRecording, measure, motions
from tvist_lab.recordings import read
from tvist_shaping import SHAPERS

RECORDED = Path(__file__).parent / "data" / "ur5_stops.csv.gz"
A_SLOW, B_SLOW, A_FAST, B_FAST = (13.53, 0.06), (11.88, 0.047), (12.83, 0.044), (8.84, 0.05)
"""f_d [Hz] and ζ by matrix pencils of three orders on three axes, means of the repetitions in several runs."""
STOPS = {
    5.413: B_SLOW, 8.415: A_SLOW, 11.406: B_SLOW, 12.656: A_FAST, 15.647: B_FAST, 18.637: A_FAST, 21.628: B_FAST,
}  # fmt: skip
"""End of the target's motion [s]."""


@pytest.fixture(scope="module")
def found():
    """The last five stops: a slow one, and two fast motions, each made twice."""
    recording = read(RECORDED)
    last = motions(recording)[2:]
    return MeasuredRecording(recording, last, [measure(recording, motion) for motion in last])


def assert_right(results, stops):
    assert len(results) == len(stops)
    for result, (stop, (f_d, zeta)) in zip(results, stops, strict=True):
        assert result.stop_s == pytest.approx(stop, abs=0.03)
        low, high = result.f_d_interval_hz
        assert result.f_d_hz == pytest.approx(f_d, rel=0.03)
        assert low * 0.99 <= f_d <= high * 1.01  # the repetitions differ by 1 %
        assert result.zeta == pytest.approx(zeta, abs=0.02)


def test_frequencies_of_a_real_arm_are_right(found):
    assert_right(found.results, [*STOPS.items()][2:])


def test_frequencies_of_a_real_arm_are_right_without_target(found):
    ends = [int(found.recording["tick"][motion.end - 1]) for motion in motions(found.recording)]
    recording = found.recording.between(ends[0], ends[4])
    kept = {name: one for name, one in recording.columns.items() if not name.startswith("target_")}
    results = MeasuredRecording.of(replace(recording, columns=kept)).results
    assert_right(results, [*STOPS.items()][1:5])


def test_modes_are_distinct_and_ordered_by_strength(found):
    for result in found.results:
        assert result.modes[0]["f_d_hz"] == result.f_d_hz
        assert 2 <= len(result.modes) <= 3
        assert np.all(np.diff(sorted(mode["f_d_hz"] for mode in result.modes)) > 1.0)


def test_repeated_stops_agree_within_their_intervals(found):
    for again in (found.results[1::2], found.results[2::2]):
        assert max(one.f_d_interval_hz[0] for one in again) < min(one.f_d_interval_hz[1] for one in again)


def test_two_modes_leave_a_sixth_of_the_vibration_and_one_mode_a_third(found, measured, monkeypatch):
    monkeypatch.setattr("tvist_lab.advice.options.SHAPERS", {"zv": SHAPERS["zv"]})
    left = {option.count: option.left_percent for option in advise([found]).options}
    measured("one mode leaves [%]", left[1])
    measured("two modes leave [%]", left[2])
    assert 22.0 < left[1] < 50.0
    assert left[2] <= 20.0
